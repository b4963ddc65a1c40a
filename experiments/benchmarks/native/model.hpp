// Pinocchio's model of an arm on a free base, from numbers and not from a file, with joints about z, its fastest kind.
#pragma once

#include <string>
#include <vector>

#include <pinocchio/multibody.hpp>

namespace pin = pinocchio;

typedef Eigen::Matrix<double, 3, 3, Eigen::RowMajor> Rows;

inline pin::Inertia inertia_of(const double* mass, const double* com, const double* inertia) {
    return pin::Inertia(*mass, Eigen::Map<const Eigen::Vector3d>(com), Eigen::Map<const Rows>(inertia));
}

// Joint i hangs from body parents[i], 0 being the base; joint i + 2 of the model moves body i + 1.
inline pin::Model arm_model(int count, const int* parents, const double* rotation, const double* offset,
                            const double* mass, const double* com, const double* inertia) {
    pin::Model model;
    std::vector<pin::JointIndex> body(count + 1);
    body[0] = model.addJoint(0, pin::JointModelFreeFlyer(), pin::SE3::Identity(), "base");
    model.appendBodyToJoint(body[0], inertia_of(mass, com, inertia), pin::SE3::Identity());
    for (int i = 0; i < count; ++i) {
        const pin::SE3 place(Eigen::Map<const Rows>(rotation + 9 * i), Eigen::Map<const Eigen::Vector3d>(offset + 3 * i));
        body[i + 1] = model.addJoint(body[parents[i]], pin::JointModelRZ(), place, "joint" + std::to_string(i));
        const int k = i + 1;
        model.appendBodyToJoint(body[k], inertia_of(mass + k, com + 3 * k, inertia + 9 * k), pin::SE3::Identity());
    }
    model.gravity.setZero();
    return model;
}
