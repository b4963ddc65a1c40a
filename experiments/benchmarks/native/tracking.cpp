// The generalized Jacobian and a step of resolved-rate tracking with Pinocchio, a state at a time, at zero momentum.
#include <cmath>

#include "model.hpp"

#include <Eigen/SVD>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/jacobian.hpp>

#include "threads.hpp"

namespace {

typedef Eigen::Matrix<double, 6, 6> Matrix6;
typedef Eigen::Matrix<double, 6, 1> Vector6;
typedef Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor> RowMatrix;

struct Arm {
    pin::Model model;
    int count;
    pin::JointIndex tool;
    Eigen::Vector3d offset;
};

struct Worker {
    const Arm& arm;
    pin::Data data;
    Eigen::VectorXd q;
    Eigen::MatrixXd jacobian, generalized;
    Worker(const Arm& arm)
        : arm(arm), data(arm.model), q(Eigen::VectorXd::Zero(arm.model.nq)),
          jacobian(Eigen::MatrixXd::Zero(6, arm.model.nv)), generalized(6, arm.count) {}

    // Base twists in the base's frame per joint rate, (6, n).
    Eigen::MatrixXd base_map() {
        const Matrix6 block = data.M.topLeftCorner<6, 6>().selfadjointView<Eigen::Upper>();
        return -block.llt().solve(data.M.topRightCorner(6, arm.count));
    }

    // J* in world axes. shared: crba in the world's frame, which leaves the joints' Jacobians behind.
    void jacobian_at(bool shared) {
        if (shared) {
            pin::crba(arm.model, data, q, pin::Convention::WORLD);
        } else {
            pin::computeJointJacobians(arm.model, data, q);
            pin::crba(arm.model, data, q, pin::Convention::LOCAL);
        }
        const pin::SE3& place = data.oMi[arm.tool];
        jacobian.setZero();
        pin::getJointJacobian(arm.model, data, arm.tool, pin::ReferenceFrame::LOCAL_WORLD_ALIGNED, jacobian);
        const Eigen::Vector3d lever = place.rotation() * arm.offset;
        for (int k = 0; k < arm.model.nv; ++k)
            jacobian.col(k).head<3>() += jacobian.col(k).tail<3>().cross(lever);
        generalized = jacobian.rightCols(arm.count) + jacobian.leftCols<6>() * base_map();
    }

    // Joint rates with the adaptive damping, and the singular values.
    Eigen::VectorXd rates(const Vector6& twist, double largest, double epsilon, Vector6& sigma) {
        const Eigen::JacobiSVD<Eigen::MatrixXd> svd(generalized, Eigen::ComputeThinU | Eigen::ComputeThinV);
        sigma = svd.singularValues();
        Vector6 answer = svd.matrixU().transpose() * twist;
        for (int k = 0; k < 6; ++k) {
            const double lambda = sigma[k] < epsilon ? 0.5 * largest * (1 + std::cos(M_PI * sigma[k] / epsilon)) : 0.0;
            answer[k] *= sigma[k] / (sigma[k] * sigma[k] + lambda * lambda);
        }
        return svd.matrixV() * answer;
    }

    // Base velocity in its own frame for joints at first + time * rate; the attitude does not matter to it.
    Vector6 base_at(const Eigen::VectorXd& first, const Eigen::VectorXd& rate, double time) {
        q.tail(arm.count) = first + time * rate;
        pin::crba(arm.model, data, q, pin::Convention::LOCAL);
        return base_map() * rate;
    }

    // Position and quaternion of the base after the rates were held: Runge-Kutta, two evaluations a step.
    void hold(const Eigen::VectorXd& rate, double period, int steps, Eigen::Vector3d& position, Eigen::Vector4d& turn) {
        const Eigen::VectorXd first = q.tail(arm.count);
        const double h = period / steps;
        const auto slope = [](const Eigen::Vector4d& x, const Vector6& v, Eigen::Vector3d& speed) {
            const Eigen::Quaterniond now(x);
            speed = now.normalized() * v.head<3>();
            return Eigen::Vector4d(0.5 * (now * Eigen::Quaterniond(0.0, v[3], v[4], v[5])).coeffs());
        };
        Vector6 before = base_at(first, rate, 0.0);
        for (int s = 0; s < steps; ++s) {
            const Vector6 middle = base_at(first, rate, (s + 0.5) * h), after = base_at(first, rate, (s + 1) * h);
            Eigen::Vector3d v1, v2, v3, v4;
            const Eigen::Vector4d k1 = slope(turn, before, v1), k2 = slope(turn + 0.5 * h * k1, middle, v2);
            const Eigen::Vector4d k3 = slope(turn + 0.5 * h * k2, middle, v3), k4 = slope(turn + h * k3, after, v4);
            turn += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
            turn.normalize();
            position += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
            before = after;
        }
    }

    void place(const double* angles, const double* attitude) {
        q.head<3>().setZero();
        q.segment<4>(3) << attitude[1], attitude[2], attitude[3], attitude[0];
        q.tail(arm.count) = Eigen::Map<const Eigen::VectorXd>(angles, arm.count);
    }
};

}  // namespace

extern "C" {

// tool: the body that carries it, and its offset (3,) there.
void* make_arm(int count, const int* parents, const double* rotation, const double* offset, const double* mass,
               const double* com, const double* inertia, int tool, const double* tool_offset) {
    Arm* arm = new Arm;
    arm->count = count;
    arm->model = arm_model(count, parents, rotation, offset, mass, com, inertia);
    arm->tool = tool + 1;
    arm->offset = Eigen::Map<const Eigen::Vector3d>(tool_offset);
    return arm;
}

// angles (batch, n), attitude (batch, 4) as (w, x, y, z); jacobian (batch, 6, n) in I.
void generalized_jacobians(void* handle, const double* angles, const double* attitude, int batch, double* jacobian,
                           int shared, int threads) {
    const Arm& arm = *static_cast<Arm*>(handle);
    split(batch, threads, [&](int begin, int end) {
        Worker worker(arm);
        for (int i = begin; i < end; ++i) {
            worker.place(angles + static_cast<long>(arm.count) * i, attitude + 4l * i);
            worker.jacobian_at(shared);
            Eigen::Map<RowMatrix>(jacobian + 6l * arm.count * i, 6, arm.count) = worker.generalized;
        }
    });
}

// twist (batch, 6) of the tool in I; out (batch, n + 7 + 6): joints, base position and quaternion (w, x, y, z) at the
// end of the period, singular values at its start.
void steps(void* handle, const double* angles, const double* attitude, const double* twist, double largest,
           double epsilon, double period, int inner, int batch, double* out, int threads) {
    const Arm& arm = *static_cast<Arm*>(handle);
    split(batch, threads, [&](int begin, int end) {
        Worker worker(arm);
        for (int i = begin; i < end; ++i) {
            const long n = arm.count;
            worker.place(angles + n * i, attitude + 4l * i);
            worker.jacobian_at(true);
            Vector6 sigma;
            const Eigen::VectorXd rate =
                worker.rates(Eigen::Map<const Vector6>(twist + 6l * i), largest, epsilon, sigma);
            Eigen::Vector3d position = Eigen::Vector3d::Zero();
            Eigen::Vector4d turn = worker.q.segment<4>(3);
            const Eigen::VectorXd joints = worker.q.tail(n) + period * rate;
            worker.hold(rate, period, inner, position, turn);
            double* row = out + (n + 13) * i;
            Eigen::Map<Eigen::VectorXd>(row, n) = joints;
            Eigen::Map<Eigen::Vector3d>(row + n) = position;
            row[n + 3] = turn[3], row[n + 4] = turn[0], row[n + 5] = turn[1], row[n + 6] = turn[2];
            Eigen::Map<Vector6>(row + n + 7) = sigma;
        }
    });
}

}  // extern "C"
