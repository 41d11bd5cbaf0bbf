// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/marker_surface.hpp"

#include <algorithm>
#include <cmath>

namespace tactile {
namespace {

using Eigen::Vector2d, Eigen::Vector3d;

constexpr double MAX_SHARE = 0.499;  // of a side, numeric: positions nearer to the clamp have no clearance

}  // namespace

Vector3d MarkerSurface::normal(const Vector2d& position) const {
    if (is_sheet()) return Vector3d::UnitZ();
    const double inside = std::min(1.0, rim_radius / std::max(position.norm(), 1e-12)) * curvature();
    const Vector2d aside = position * inside;
    return {aside[0], aside[1], std::sqrt(std::max(1 - aside.squaredNorm(), 0.0))};
}

double MarkerSurface::clearance(const Vector2d& position) const {
    if (!is_sheet()) return std::max(rim_radius - position.squaredNorm() / rim_radius, 0.0);
    double sum = 0;
    for (int axis = 0; axis < 2; ++axis) {
        const double share = std::clamp(position[axis] / size[axis], -MAX_SHARE, MAX_SHARE);
        sum += std::pow(2 * size[axis] / M_PI * std::cos(M_PI * share), -4);
    }
    return std::pow(sum, -0.25);
}

Rows3 MarkerSurface::rest_points(const Rows2& rest, const Rows3& camera_centre) const {
    Rows3 points(rest.rows(), 3);
    points << rest, Eigen::VectorXd::Constant(rest.rows(), plane_z());
    for (Eigen::Index k = 0; k < rest.rows() && !is_sheet(); ++k) {
        const Vector3d centre = camera_centre.row(k), ray = (points.row(k).transpose() - centre).normalized();
        const Vector3d offset = centre - Vector3d(0, 0, height - 1 / curvature());  // from the centre of the sphere
        const double along = ray.dot(offset), inside = along * along - offset.squaredNorm() + 1 / (curvature() * curvature());
        points.row(k) = centre + (std::sqrt(inside) - along) * ray;  // NaN where the ray misses the sphere
    }
    return points;
}

Rows3 MarkerSurface::raised_points(const Rows2& rest, const Rows2& shift, const Rows3& camera_centre, const Eigen::VectorXd& raised) const {
    Rows3 points = rest_points(rest, camera_centre);
    for (Eigen::Index k = 0; k < rest.rows(); ++k) {
        const Vector3d centre = camera_centre.row(k);
        const Vector3d seen(rest(k, 0) + shift(k, 0), rest(k, 1) + shift(k, 1), plane_z());
        points.row(k) = centre + (points(k, 2) + raised[k] - centre[2]) / (plane_z() - centre[2]) * (seen - centre);
        if (!shift.row(k).allFinite()) points.row(k).setConstant(NAN);
    }
    return points;
}

}  // namespace tactile
