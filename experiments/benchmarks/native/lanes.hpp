// Numbers that the kernel computes with: the widest vector of the machine, and one that only counts.
#pragma once

#include <cmath>
#include <cstdint>

#if defined(__AVX512F__)
constexpr int LANES = 8;
#elif defined(__AVX__)
constexpr int LANES = 4;
#else
constexpr int LANES = 2;
#endif

typedef double Lanes __attribute__((vector_size(LANES * sizeof(double))));

inline Lanes all(double x) { return Lanes{} + x; }
inline Lanes root(Lanes x) {
    Lanes y;
    for (int k = 0; k < LANES; ++k) y[k] = std::sqrt(x[k]);
    return y;
}
// To the nearest whole number, for what is far below 2^51.
inline Lanes nearest(Lanes x) { return (x + 6755399441055744.0) - 6755399441055744.0; }

// Stands for a number and counts what is done with it; a division or a root counts one.
struct Counted {
    static inline int64_t operations = 0;
    Counted(double = 0) {}
    Counted operator-() const { return {}; }
    Counted& operator+=(Counted) { ++operations; return *this; }
};
inline Counted counted() { ++Counted::operations; return {}; }
inline Counted operator+(Counted, Counted) { return counted(); }
inline Counted operator-(Counted, Counted) { return counted(); }
inline Counted operator*(Counted, Counted) { return counted(); }
inline Counted operator/(Counted, Counted) { return counted(); }
inline Counted root(Counted) { return counted(); }
inline Counted nearest(Counted) { return counted(), counted(); }

// sin(angle - multiple pi), negative for odd turns: pi in three parts, Taylor's series of 11 terms on what is left.
template <class T>
inline T signed_series(T angle, T multiple, T turns) {
    const T rest =
        ((angle - multiple * 3.1415926534682512) - multiple * 1.2154201012607932e-10) - multiple * 4.044532497591901e-21;
    const T odd = turns - 2.0 * nearest(0.5 * turns - 0.25);
    const T square = rest * rest;
    constexpr double factors[] = {
        1 / 51090942171709440000.0, -1 / 121645100408832000.0, 1 / 355687428096000.0, -1 / 1307674368000.0,
        1 / 6227020800.0, -1 / 39916800.0, 1 / 362880.0, -1 / 5040.0, 1 / 120.0, -1 / 6.0,
    };
    T total{};
    for (double factor : factors) total = (total + factor) * square;
    return (1.0 - 2.0 * odd) * (rest + rest * total);
}

template <class T>
inline void sine_cosine(T angle, T& sine, T& cosine) {
    const T whole = nearest(angle * 0.31830988618379067154);
    const T half = nearest(angle * 0.31830988618379067154 - 0.5);
    sine = signed_series(angle, whole, whole);
    cosine = -signed_series(angle, half + 0.5, half);
}
