// The rollout with Pinocchio: base twist from its algorithms, Runge-Kutta on the quaternion, a rollout at a time.
//
// Headers only: the wheel's library is built for a plainer processor, and what -march=native makes of Eigen's types
// would not fit it. The model is built from numbers, not from a file, with joints about z, Pinocchio's fastest kind.
#include <cmath>
#include <vector>

#include "model.hpp"

#include <pinocchio/algorithm/crba.hpp>

#include "law.hpp"
#include "threads.hpp"

namespace {

struct Robot {
    pin::Model model;
    std::vector<double> joints;
    int count;
};

// What one thread needs: Pinocchio's data, and the configuration and velocity with the base's in front.
struct Worker {
    const Robot& robot;
    pin::Data data;
    Eigen::VectorXd q, v;
    Worker(const Robot& robot)
        : robot(robot), data(robot.model), q(Eigen::VectorXd::Zero(robot.model.nq)),
          v(Eigen::VectorXd::Zero(robot.model.nv)) {}

    void at(const double* row, const double* free) {
        for (int i = 0; i < robot.count; ++i) {
            const double* joint = robot.joints.data() + i * JOINT_COLUMNS;
            double argument, rate;
            law_argument(row, joint, free[i], free[robot.count + i], argument, rate);
            q[7 + i] = joint[0] + joint[1] * std::sin(argument);
            v[6 + i] = joint[1] * std::cos(argument) * rate;
        }
    }

    // Base twist in the base's frame, at zero momentum.
    Eigen::Matrix<double, 6, 1> twist(const Eigen::Quaterniond& attitude) {
        q.segment<4>(3) = attitude.coeffs();
        pin::crba(robot.model, data, q, pin::Convention::LOCAL);
        const Eigen::Matrix<double, 6, 6> block = data.M.topLeftCorner<6, 6>().selfadjointView<Eigen::Upper>();
        const Eigen::Matrix<double, 6, 1> carried = data.M.block(0, 6, 6, robot.count) * v.tail(robot.count);
        return -block.llt().solve(carried);
    }

    Eigen::Vector4d slope(const Eigen::Vector4d& quaternion) {
        // A stage's quaternion is not quite of unit length: the base's rotation is made with the unit one.
        const Eigen::Quaterniond now(quaternion);
        const Eigen::Vector3d omega = twist(now.normalized()).tail<3>();
        return 0.5 * (now * Eigen::Quaterniond(0.0, omega[0], omega[1], omega[2])).coeffs();
    }

    Eigen::Vector4d spin(const Eigen::Vector4d& quaternion, const Eigen::Vector3d& omega) {
        return 0.5 * (Eigen::Quaterniond(quaternion) * Eigen::Quaterniond(0.0, omega[0], omega[1], omega[2])).coeffs();
    }

    // Four evaluations a step, each at the stage's own attitude.
    Eigen::Vector4d roll(const double* law, double step, int steps, const double* free) {
        Eigen::Vector4d x(0.0, 0.0, 0.0, 1.0);
        for (int s = 0; s < steps; ++s) {
            const double* row = law + 2 * s * LAW_COLUMNS;
            at(row, free);
            const Eigen::Vector4d k1 = slope(x);
            at(row + LAW_COLUMNS, free);
            const Eigen::Vector4d k2 = slope(x + 0.5 * step * k1);
            const Eigen::Vector4d k3 = slope(x + 0.5 * step * k2);
            at(row + 2 * LAW_COLUMNS, free);
            const Eigen::Vector4d k4 = slope(x + step * k3);
            x += step / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
            x.normalize();
        }
        return x;
    }

    // Two evaluations a step: at zero momentum the rate in the base's own frame does not depend on the attitude.
    Eigen::Vector4d roll_shared(const double* law, double step, int steps, const double* free) {
        const Eigen::Quaterniond still = Eigen::Quaterniond::Identity();
        Eigen::Vector4d x(0.0, 0.0, 0.0, 1.0);
        at(law, free);
        Eigen::Vector3d first = twist(still).tail<3>();
        for (int s = 0; s < steps; ++s) {
            at(law + (2 * s + 1) * LAW_COLUMNS, free);
            const Eigen::Vector3d middle = twist(still).tail<3>();
            at(law + (2 * s + 2) * LAW_COLUMNS, free);
            const Eigen::Vector3d last = twist(still).tail<3>();
            const Eigen::Vector4d k1 = spin(x, first), k2 = spin(x + 0.5 * step * k1, middle);
            const Eigen::Vector4d k3 = spin(x + 0.5 * step * k2, middle), k4 = spin(x + step * k3, last);
            x += step / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
            x.normalize();
            first = last;
        }
        return x;
    }
};

}  // namespace

extern "C" {

void* make_robot(int count, const int* parents, const double* rotation, const double* offset, const double* mass,
                 const double* com, const double* inertia, const double* joints) {
    Robot* robot = new Robot;
    robot->count = count;
    robot->joints.assign(joints, joints + count * JOINT_COLUMNS);
    robot->model = arm_model(count, parents, rotation, offset, mass, com, inertia);
    return robot;
}

void free_robot(void* robot) { delete static_cast<Robot*>(robot); }

// free (batch, 2n): the alphas, then the betas; attitude (batch, 4) is (w, x, y, z) at the end, from the identity.
void rollouts(void* handle, const double* law, double step, int steps, const double* free, int batch, double* attitude,
              int shared, int threads) {
    const Robot& robot = *static_cast<Robot*>(handle);
    split(batch, threads, [&](int begin, int end) {
        Worker worker(robot);
        for (int i = begin; i < end; ++i) {
            const double* numbers = free + static_cast<long>(i) * 2 * robot.count;
            const Eigen::Vector4d x = shared ? worker.roll_shared(law, step, steps, numbers)
                                             : worker.roll(law, step, steps, numbers);
            double* out = attitude + 4l * i;
            out[0] = x[3], out[1] = x[0], out[2] = x[1], out[3] = x[2];
        }
    });
}

// angles and rates (batch, n), attitude (batch, 4) as (w, x, y, z), twist (batch, 6) in I.
void twists(void* handle, const double* angles, const double* rates, const double* attitude, int batch, double* twist,
            int threads) {
    const Robot& robot = *static_cast<Robot*>(handle);
    split(batch, threads, [&](int begin, int end) {
        Worker worker(robot);
        for (int i = begin; i < end; ++i) {
            const long n = robot.count;
            worker.q.tail(n) = Eigen::Map<const Eigen::VectorXd>(angles + n * i, n);
            worker.v.tail(n) = Eigen::Map<const Eigen::VectorXd>(rates + n * i, n);
            const double* a = attitude + 4l * i;
            const Eigen::Quaterniond quaternion(a[0], a[1], a[2], a[3]);
            const Eigen::Matrix<double, 6, 1> body = worker.twist(quaternion);
            Eigen::Map<Eigen::Vector3d>(twist + 6l * i) = quaternion * body.head<3>();
            Eigen::Map<Eigen::Vector3d>(twist + 6l * i + 3) = quaternion * body.tail<3>();
        }
    });
}

}  // extern "C"
