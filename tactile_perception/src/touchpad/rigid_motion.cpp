// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/rigid_motion.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>

#include "common/vectors.hpp"

namespace tactile {
namespace {

constexpr double MIN_ASPECT = 1e-3;          // of points that are not collinear: second largest over largest extent
constexpr std::ptrdiff_t MIN_STICKING = 10;  // dots of a fit: its tilt is as precise as ten motions, 0.3 degrees
constexpr double GAIN = 0.15;  // of a deviation from the fit, a frame: 0.03 degrees of a motion over 0.2 of a fit to ten to twenty dots

using Points = Eigen::Map<const Eigen::Matrix3Xd>;

}  // namespace

bool are_collinear(const double* points, std::ptrdiff_t count) {
    const Points all(points, 3, count);
    const Eigen::Matrix3Xd centred = all.colwise() - all.rowwise().mean();
    const Eigen::Matrix3d scatter = centred * centred.transpose();
    const double total = scatter.trace();  // its square less the squares is twice the sum of the products of two squared extents
    return total * total - scatter.squaredNorm() <= 2 * MIN_ASPECT * MIN_ASPECT * total * total;
}

std::optional<RigidMotion> fit_rigid(const double* p, const double* q, std::ptrdiff_t count) {
    if (count < 3 || are_collinear(p, count) || are_collinear(q, count)) return {};
    const Points from(p, 3, count), to(q, 3, count);
    const Eigen::Vector3d start = from.rowwise().mean(), end = to.rowwise().mean();
    const Eigen::Matrix3d product = (to.colwise() - end) * (from.colwise() - start).transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> parts(product, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (parts.matrixU() * parts.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    RigidMotion found;
    found.rotation = parts.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * parts.matrixV().transpose();
    found.translation = end - found.rotation * start;
    return found;
}

RigidMotion StickingReference::corrected(const std::vector<double>& xyz, const std::vector<std::uint8_t>& sticks,
                                         const RigidMotion& motion) {
    const auto size = static_cast<std::ptrdiff_t>(sticks.size());
    const bool is_first = last_xyz_.empty();
    std::ptrdiff_t left = 0;
    for (std::size_t k = 0; k < common_.size(); ++k) left += common_[k] & sticks[k];
    if (left < MIN_STICKING) start_ = std::move(last_xyz_), common_ = std::move(last_sticks_), pose_ = {};
    last_xyz_ = xyz, last_sticks_ = sticks;
    if (is_first) return motion;
    std::vector<double> start, now;
    for (std::ptrdiff_t k = 0; k < size; ++k) {
        common_[k] &= sticks[k];
        if (!common_[k]) continue;
        start.insert(start.end(), start_.data() + 3 * k, start_.data() + 3 * k + 3);
        now.insert(now.end(), xyz.data() + 3 * k, xyz.data() + 3 * k + 3);
    }
    RigidMotion pose = motion * pose_;
    const auto count = static_cast<std::ptrdiff_t>(start.size() / 3);
    if (count >= MIN_STICKING) {
        if (const std::optional<RigidMotion> fitted = fit_rigid(start.data(), now.data(), count)) {
            const Eigen::Vector3d middle = Points(start.data(), 3, count).rowwise().mean(), moved = pose(middle),
                                  seen = Points(now.data(), 3, count).rowwise().mean();
            Eigen::AngleAxisd turn(Eigen::Matrix3d(fitted->rotation * pose.rotation.transpose()));
            turn.angle() *= GAIN;
            pose.rotation = turn.toRotationMatrix() * pose.rotation;
            pose.translation = moved + GAIN * (seen - moved) - pose.rotation * middle;
        }
    }
    const RigidMotion step = pose.since(pose_);
    pose_ = pose;
    return step;
}

}  // namespace tactile
