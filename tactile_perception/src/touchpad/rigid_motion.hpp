// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Rigid motions fitted to points, and the motion of an object by the dots that stick to it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/fields.hpp"

namespace tactile {

/// The motion q = rotation p + translation, m.
struct RigidMotion {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();
    TACTILE_FIELDS(rotation, translation)

    Eigen::Vector3d operator()(const Eigen::Vector3d& p) const { return rotation * p + translation; }
    RigidMotion operator*(const RigidMotion& first) const { return {rotation * first.rotation, (*this)(first.translation)}; }
    /// The motion after another one that has this result.
    RigidMotion since(const RigidMotion& first) const {
        const Eigen::Matrix3d turn = rotation * first.rotation.transpose();
        return {turn, translation - turn * first.translation};
    }
};

/// Whether the second largest extent of points (count, 3) is less than a thousandth of the largest one.
bool are_collinear(const double* points, std::ptrdiff_t count);

/// Rigid motion from points p (count, 3) to q (count, 3), m, by least squares (Kabsch 1976). Nothing if they do not determine it: fewer
/// than three, or collinear.
std::optional<RigidMotion> fit_rigid(const double* p, const double* q, std::ptrdiff_t count);

/// Refers the motions of an object to the dots that have stuck to it since a common start, so that their errors do not add up.
///
/// The motion from frame to frame is precise, but its tilt has a bias of some 0.01 degrees a frame. A rigid fit to the positions of the
/// same dots at the start has none, and more noise. A fixed part of their difference corrects each motion: the gain of a Kalman filter in
/// its steady state. The start is the last frame before one in which enough dots stick; a new one begins when too few are left.
class StickingReference {
 public:
    /// Corrects the motion of the object since the last frame. xyz (K, 3), m: positions of all dots; sticks (K): those that are seen and
    /// stick to the object.
    RigidMotion corrected(const std::vector<double>& xyz, const std::vector<std::uint8_t>& sticks, const RigidMotion& motion);

    /// Drops all earlier frames.
    void reset() { *this = {}; }

 private:
    std::vector<double> last_xyz_, start_;
    std::vector<std::uint8_t> last_sticks_, common_;  // common_: those that have stuck since the start
    RigidMotion pose_;                                // since the start
};

}  // namespace tactile
