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

inline void sine_cosine(Lanes angle, Lanes& sine, Lanes& cosine) {
    // pi/2 in three parts; Taylor's series to order 17 and 18 inside [-pi/4, pi/4].
    const Lanes turns = nearest(angle * 0.63661977236758134308);
    const Lanes rest =
        ((angle - turns * 1.5707963267341256) - turns * 6.0771005063039659e-11) - turns * 2.0222662487959506e-21;
    const Lanes x = rest * rest;
    Lanes s = all(1 / 355687428096000.0);
    s = s * x - 1 / 1307674368000.0;
    s = s * x + 1 / 6227020800.0;
    s = s * x - 1 / 39916800.0;
    s = s * x + 1 / 362880.0;
    s = s * x - 1 / 5040.0;
    s = s * x + 1 / 120.0;
    s = s * x - 1 / 6.0;
    s = rest + rest * x * s;
    Lanes c = all(-1 / 6402373705728000.0);
    c = c * x + 1 / 20922789888000.0;
    c = c * x - 1 / 87178291200.0;
    c = c * x + 1 / 479001600.0;
    c = c * x - 1 / 3628800.0;
    c = c * x + 1 / 40320.0;
    c = c * x - 1 / 720.0;
    c = c * x + 1 / 24.0;
    c = (1.0 - 0.5 * x) + x * x * c;
    const Lanes quarter = turns - 4.0 * nearest(0.25 * turns - 0.375);
    const auto odd = (quarter == 1.0) | (quarter == 3.0);
    const Lanes first = odd ? c : s, second = odd ? s : c;
    sine = (quarter >= 2.0) ? -first : first;
    cosine = ((quarter == 1.0) | (quarter == 2.0)) ? -second : second;
}

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
inline void sine_cosine(Counted, Counted&, Counted&) {
    // One for the range, six for the rest, 2 + 16 + 3 and 16 + 6 for the two series, four for the quarter.
    Counted::operations += 54;
}
