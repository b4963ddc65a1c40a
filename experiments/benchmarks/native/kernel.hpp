// The arithmetic of jffsr's rollout, the batch in the lanes of vector registers.
//
// JOINTS and PARENTS, the tree of a robot with turning joints only, are set by the compiler's command line; the
// robot's numbers are arguments, so nothing is left out that is zero in one robot and not in another.
#pragma once

#include "law.hpp"

constexpr int TREE[JOINTS] = PARENTS;

// A row a body: its mass and that of all it carries, first moment, inertia about its joint, rotation and offset.
constexpr int BODY_COLUMNS = 2 + 3 + 6 + 9 + 3;

struct System {
    const double* bodies;  // JOINTS rows
    const double* joints;  // JOINTS rows, see law.hpp
    double base_inertia[6];
    double mass;
    double momentum[3];  // about the system's centre of mass, in I
};

template <class T>
struct Carried {
    T first[3], inertia[6], linear[3], angular[3];
};

// What the attitude needs of the joints at one time: the inverse of the locked inertia, and the rate that
// cancels the joints' momentum.
template <class T>
struct Terms {
    T inverse[6], rate[3];
};

template <class T>
inline void turned(T cosine, T sine, T& a, T& b) {
    const T x = cosine * a - sine * b;
    b = sine * a + cosine * b;
    a = x;
}

template <class T>
inline void rows_times(const double* m, const T* v, T* out) {
    for (int r = 0; r < 3; ++r) out[r] = m[3 * r] * v[0] + m[3 * r + 1] * v[1] + m[3 * r + 2] * v[2];
}

template <class T, class V>
inline void symmetric_times(const T* s, const V* v, T* out) {
    out[0] = s[0] * v[0] + s[3] * v[1] + s[4] * v[2];
    out[1] = s[3] * v[0] + s[1] * v[1] + s[5] * v[2];
    out[2] = s[4] * v[0] + s[5] * v[1] + s[2] * v[2];
}

// Take up one body and pass its joint: from about the outer joints to about the parent's frame.
template <class T>
inline void pass(const double* body, T q, T qd, const Carried<T>& in, Carried<T>& out) {
    const double m = body[1], *rotation = body + 11, *offset = body + 20;
    T f[3], j[6], p[3], l[3];
    for (int k = 0; k < 3; ++k) f[k] = in.first[k] + body[2 + k];
    for (int k = 0; k < 6; ++k) j[k] = in.inertia[k] + body[5 + k];
    p[0] = in.linear[0] - qd * f[1];
    p[1] = in.linear[1] + qd * f[0];
    p[2] = in.linear[2];
    l[0] = in.angular[0] + qd * j[4];
    l[1] = in.angular[1] + qd * j[5];
    l[2] = in.angular[2] + qd * j[2];

    T sine, cosine;
    sine_cosine(q, sine, cosine);
    turned(cosine, sine, f[0], f[1]);
    turned(cosine, sine, p[0], p[1]);
    turned(cosine, sine, l[0], l[1]);
    turned(cosine, sine, j[4], j[5]);
    const T mean = 0.5 * (j[0] + j[1]), half = 0.5 * (j[0] - j[1]);
    const T double_cosine = cosine * cosine - sine * sine, double_sine = 2.0 * sine * cosine;
    const T spread = double_cosine * half - double_sine * j[3];
    j[3] = double_sine * half + double_cosine * j[3];
    j[0] = mean + spread;
    j[1] = mean - spread;

    T a[3], linear[3], angular[3], left[9];
    rows_times(rotation, f, a);
    rows_times(rotation, p, linear);
    rows_times(rotation, l, angular);
    const double x = offset[0], y = offset[1], z = offset[2];
    out.angular[0] += angular[0] + (y * linear[2] - z * linear[1]);
    out.angular[1] += angular[1] + (z * linear[0] - x * linear[2]);
    out.angular[2] += angular[2] + (x * linear[1] - y * linear[0]);
    for (int k = 0; k < 3; ++k) out.linear[k] += linear[k];
    for (int r = 0; r < 3; ++r) symmetric_times(j, rotation + 3 * r, left + 3 * r);
    const auto element = [&](int r, int k) {
        const T* row = left + 3 * r;
        return row[0] * rotation[3 * k] + row[1] * rotation[3 * k + 1] + row[2] * rotation[3 * k + 2];
    };
    out.inertia[0] += element(0, 0) + (2.0 * (a[1] * y + a[2] * z) + m * (y * y + z * z));
    out.inertia[1] += element(1, 1) + (2.0 * (a[0] * x + a[2] * z) + m * (x * x + z * z));
    out.inertia[2] += element(2, 2) + (2.0 * (a[0] * x + a[1] * y) + m * (x * x + y * y));
    out.inertia[3] += element(0, 1) - ((a[0] * y + a[1] * x) + m * x * y);
    out.inertia[4] += element(0, 2) - ((a[0] * z + a[2] * x) + m * x * z);
    out.inertia[5] += element(1, 2) - ((a[1] * z + a[2] * y) + m * y * z);
    for (int k = 0; k < 3; ++k) out.first[k] += a[k] + m * offset[k];
}

// Body 0 is the base; joint i hangs from body TREE[i] and moves body i + 1.
template <class T>
inline void carried_by_base(const System& system, const T* q, const T* qd, Carried<T>& base) {
    Carried<T> on[JOINTS + 1];
    for (int b = 0; b <= JOINTS; ++b) on[b] = Carried<T>{};
#pragma GCC unroll 16
    for (int i = JOINTS - 1; i >= 0; --i) {
        pass(system.bodies + i * BODY_COLUMNS, q[i], qd[i], on[i + 1], on[TREE[i]]);
    }
    base = on[0];
}

template <class T>
inline void terms_of(const System& system, const T* q, const T* qd, Terms<T>& out, T* com, T* com_velocity) {
    Carried<T> c;
    carried_by_base(system, q, qd, c);
    const double share = 1 / system.mass;
    for (int k = 0; k < 3; ++k) com[k] = share * c.first[k];
    for (int k = 0; k < 3; ++k) com_velocity[k] = share * c.linear[k];
    const T x = com[0], y = com[1], z = com[2];
    const T shift[6] = {y * y + z * z, x * x + z * z, x * x + y * y, -(x * y), -(x * z), -(y * z)};
    T s[6];
    for (int k = 0; k < 6; ++k) s[k] = system.base_inertia[k] + c.inertia[k] - system.mass * shift[k];
    const T angular[3] = {
        c.angular[0] - (y * c.linear[2] - z * c.linear[1]),
        c.angular[1] - (z * c.linear[0] - x * c.linear[2]),
        c.angular[2] - (x * c.linear[1] - y * c.linear[0]),
    };
    const T cofactors[6] = {
        s[1] * s[2] - s[5] * s[5], s[0] * s[2] - s[4] * s[4], s[0] * s[1] - s[3] * s[3],
        s[4] * s[5] - s[3] * s[2], s[3] * s[5] - s[4] * s[1], s[3] * s[4] - s[0] * s[5],
    };
    const T inverse = 1.0 / (s[0] * cofactors[0] + s[3] * cofactors[3] + s[4] * cofactors[4]);
    for (int k = 0; k < 6; ++k) out.inverse[k] = inverse * cofactors[k];
    symmetric_times(out.inverse, angular, out.rate);
}

// Rows of the rotation matrix of a unit quaternion (w, x, y, z).
template <class T>
inline void matrix_of(const T* q, T* m) {
    const T w = q[0], x = q[1], y = q[2], z = q[3];
    m[0] = 1.0 - 2.0 * (y * y + z * z), m[1] = 2.0 * (x * y - w * z), m[2] = 2.0 * (x * z + w * y);
    m[3] = 2.0 * (x * y + w * z), m[4] = 1.0 - 2.0 * (x * x + z * z), m[5] = 2.0 * (y * z - w * x);
    m[6] = 2.0 * (x * z - w * y), m[7] = 2.0 * (y * z + w * x), m[8] = 1.0 - 2.0 * (x * x + y * y);
}

// Angular velocity of the base, in its own frame.
template <class T>
inline void base_rate(const System& system, const Terms<T>& terms, const T* q, T* omega) {
    T m[9], momentum[3];
    matrix_of(q, m);
    for (int k = 0; k < 3; ++k) {
        momentum[k] = m[k] * system.momentum[0] + m[3 + k] * system.momentum[1] + m[6 + k] * system.momentum[2];
    }
    symmetric_times(terms.inverse, momentum, omega);
    for (int k = 0; k < 3; ++k) omega[k] = omega[k] - terms.rate[k];
}

template <class T>
inline void slope(const System& system, const Terms<T>& terms, const T* q, T* k) {
    T o[3];
    base_rate(system, terms, q, o);
    k[0] = 0.5 * (-(q[1] * o[0]) - q[2] * o[1] - q[3] * o[2]);
    k[1] = 0.5 * (q[0] * o[0] + q[2] * o[2] - q[3] * o[1]);
    k[2] = 0.5 * (q[0] * o[1] + q[3] * o[0] - q[1] * o[2]);
    k[3] = 0.5 * (q[0] * o[2] + q[1] * o[1] - q[2] * o[0]);
}

template <class T>
inline void sample(const System& system, const double* row, const T* alpha, const T* beta, Terms<T>& terms) {
    T q[JOINTS], qd[JOINTS], com[3], com_velocity[3];
    for (int i = 0; i < JOINTS; ++i) {
        const double* joint = system.joints + i * JOINT_COLUMNS;
        T argument, rate, sine, cosine;
        law_argument(row, joint, alpha[i], beta[i], argument, rate);
        sine_cosine(argument, sine, cosine);
        q[i] = joint[0] + joint[1] * sine;
        qd[i] = joint[1] * cosine * rate;
    }
    terms_of(system, q, qd, terms, com, com_velocity);
}

// Classical Runge-Kutta of order 4; q (4) is the attitude at the start and then at the end.
template <class T>
inline void roll(const System& system, const double* law, double step, int steps, const T* alpha, const T* beta, T* q) {
    Terms<T> first, middle, last;
    sample(system, law, alpha, beta, first);
    for (int s = 0; s < steps; ++s) {
        sample(system, law + (2 * s + 1) * LAW_COLUMNS, alpha, beta, middle);
        sample(system, law + (2 * s + 2) * LAW_COLUMNS, alpha, beta, last);
        T k1[4], k2[4], k3[4], k4[4], there[4];
        slope(system, first, q, k1);
        for (int k = 0; k < 4; ++k) there[k] = q[k] + (0.5 * step) * k1[k];
        slope(system, middle, there, k2);
        for (int k = 0; k < 4; ++k) there[k] = q[k] + (0.5 * step) * k2[k];
        slope(system, middle, there, k3);
        for (int k = 0; k < 4; ++k) there[k] = q[k] + step * k3[k];
        slope(system, last, there, k4);
        for (int k = 0; k < 4; ++k) q[k] = q[k] + (step / 6) * (k1[k] + 2.0 * k2[k] + 2.0 * k3[k] + k4[k]);
        const T scale = 1.0 / root(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        for (int k = 0; k < 4; ++k) q[k] = q[k] * scale;
        first = last;
    }
}

// One base twist: [linear; angular] in I, of the base's centre of mass, at zero linear momentum.
template <class T>
inline void twist_of(const System& system, const T* q, const T* qd, const T* attitude, T* twist) {
    Terms<T> terms;
    T com[3], moving[3], o[3], m[9];
    terms_of(system, q, qd, terms, com, moving);
    base_rate(system, terms, attitude, o);
    const T swing[3] = {
        -(o[1] * com[2] - o[2] * com[1] + moving[0]),
        -(o[2] * com[0] - o[0] * com[2] + moving[1]),
        -(o[0] * com[1] - o[1] * com[0] + moving[2]),
    };
    matrix_of(attitude, m);
    for (int r = 0; r < 3; ++r) {
        twist[r] = m[3 * r] * swing[0] + m[3 * r + 1] * swing[1] + m[3 * r + 2] * swing[2];
        twist[3 + r] = m[3 * r] * o[0] + m[3 * r + 1] * o[1] + m[3 * r + 2] * o[2];
    }
}
