// C entry points of the vectorised kernel, called through ctypes.
#include <vector>

#include "lanes.hpp"
#include "kernel.hpp"
#include "threads.hpp"

namespace {

System system_of(const double* bodies, const double* joints, const double* base_inertia, double mass) {
    System system{bodies, joints, {}, mass, {0.0, 0.0, 0.0}};
    for (int k = 0; k < 6; ++k) system.base_inertia[k] = base_inertia[k];
    return system;
}

// Column `column` of `count` rows from `row` on, the last row repeated where the lanes are more.
Lanes gathered(const double* rows, int width, int column, int row, int end) {
    Lanes x;
    for (int k = 0; k < LANES; ++k) x[k] = rows[std::min(row + k, end - 1) * static_cast<long>(width) + column];
    return x;
}

void scatter(Lanes x, double* rows, int width, int column, int row, int end) {
    for (int k = 0; k < LANES && row + k < end; ++k) rows[(row + k) * static_cast<long>(width) + column] = x[k];
}

}  // namespace

extern "C" {

// free (batch, 2 JOINTS): the alphas, then the betas; attitude (batch, 4) is that at the end, from the identity.
void rollouts(const double* bodies, const double* joints, const double* base_inertia, double mass, const double* law,
              double step, int steps, const double* free, int batch, double* attitude, int threads) {
    const System system = system_of(bodies, joints, base_inertia, mass);
    const int groups = (batch + LANES - 1) / LANES;
    split(groups, threads, [=](int begin, int end) {
        for (int group = begin; group < end; ++group) {
            Lanes alpha[JOINTS], beta[JOINTS], q[4] = {all(1.0), all(0.0), all(0.0), all(0.0)};
            for (int i = 0; i < JOINTS; ++i) {
                alpha[i] = gathered(free, 2 * JOINTS, i, group * LANES, batch);
                beta[i] = gathered(free, 2 * JOINTS, JOINTS + i, group * LANES, batch);
            }
            roll(system, law, step, steps, alpha, beta, q);
            for (int k = 0; k < 4; ++k) scatter(q[k], attitude, 4, k, group * LANES, batch);
        }
    });
}

// angles and rates (batch, JOINTS), attitude (batch, 4), twist (batch, 6).
void twists(const double* bodies, const double* joints, const double* base_inertia, double mass, const double* angles,
            const double* rates, const double* attitude, int batch, double* twist, int threads) {
    const System system = system_of(bodies, joints, base_inertia, mass);
    const int groups = (batch + LANES - 1) / LANES;
    split(groups, threads, [=](int begin, int end) {
        for (int group = begin; group < end; ++group) {
            Lanes q[JOINTS], qd[JOINTS], a[4], out[6];
            for (int i = 0; i < JOINTS; ++i) {
                q[i] = gathered(angles, JOINTS, i, group * LANES, batch);
                qd[i] = gathered(rates, JOINTS, i, group * LANES, batch);
            }
            for (int k = 0; k < 4; ++k) a[k] = gathered(attitude, 4, k, group * LANES, batch);
            twist_of(system, q, qd, a, out);
            for (int k = 0; k < 6; ++k) scatter(out[k], twist, 6, k, group * LANES, batch);
        }
    });
}

// Floating-point operations of one rollout, counted by running the kernel with numbers that only count.
long operations(int steps) {
    static double zeros[JOINTS * BODY_COLUMNS] = {}, joints[JOINTS * JOINT_COLUMNS] = {};
    const System system{zeros, joints, {}, 1.0, {}};
    std::vector<double> law((2 * steps + 1) * LAW_COLUMNS, 0.0);
    Counted alpha[JOINTS], beta[JOINTS], q[4];
    Counted::operations = 0;
    roll(system, law.data(), 0.1, steps, alpha, beta, q);
    return Counted::operations;
}

}  // extern "C"
