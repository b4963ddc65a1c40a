// The sine-polynomial joint law from a table over the time grid: what the native opponents share.
#pragma once

// A row a grid point: ramp, its rate, bump, its rate, 2 s - 1, twice the bump over the duration.
constexpr int LAW_COLUMNS = 6;

// A row a joint: middle and half width of the limits, arcsine at the start, and its way to the goal.
constexpr int JOINT_COLUMNS = 4;

// The argument of the sine and its rate.
template <class T>
inline void law_argument(const double* row, const double* joint, T alpha, T beta, T& argument, T& rate) {
    const T shape = alpha + beta * row[4];
    argument = joint[2] + joint[3] * row[0] + row[2] * shape;
    rate = joint[3] * row[1] + row[3] * shape + row[5] * beta;
}
