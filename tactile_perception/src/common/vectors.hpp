// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Vectors in arrays (N, 3).
#pragma once

#include <Eigen/Geometry>
#include <cstddef>

namespace tactile {

inline Eigen::Map<const Eigen::Vector3d> vec3_at(const double* array, std::ptrdiff_t k) {
    return Eigen::Map<const Eigen::Vector3d>(array + 3 * k);
}
inline void store(double* array, std::ptrdiff_t k, const Eigen::Vector3d& a) {
    Eigen::Map<Eigen::Vector3d>(array + 3 * k) = a;
}

}  // namespace tactile
