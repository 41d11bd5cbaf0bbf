// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The undeformed surface of a sensor with markers: a clamped sheet in the plane z = 0, or a spherical cap over a round rim.
#pragma once

#include <Eigen/Core>

#include "common/fields.hpp"
#include "common/rows.hpp"

namespace tactile {

/// Size of a sheet along x and y, m, zeros for a dome; rim radius and height of a dome, m, 0 for a sheet.
struct MarkerSurface {
    Eigen::Vector2d size = Eigen::Vector2d::Zero();
    double rim_radius = 0, height = 0;
    TACTILE_FIELDS(size, rim_radius, height)

    bool is_sheet() const { return size.minCoeff() > 0; }
    /// Height of the viewing plane, m: the untouched sheet, or the top of the dome.
    double plane_z() const { return is_sheet() ? 0 : height; }
    /// One over the radius of the sphere, 1/m; 0 for a sheet.
    double curvature() const { return is_sheet() ? 0 : 2 * height / (rim_radius * rim_radius + height * height); }
    /// Unit normal at a position, m; outside a dome's rim that at the rim.
    Eigen::Vector3d normal(const Eigen::Vector2d& position) const;
    /// Radius, m, of the circular membrane that is as compliant in its centre as the surface is at a position, m. That of a disc is
    /// (R^2 - r^2) / R; that of a rectangle is approximated from those of its two strips.
    double clearance(const Eigen::Vector2d& position) const;
    /// Positions (K, 3), m, of markers that appear at rest (K, 2), m, in the viewing plane, seen from the camera centres (K, 3), m; NaN
    /// where unknown.
    Rows3 rest_points(const Rows2& rest, const Rows3& camera_centre) const;
    /// Positions (K, 3), m, of those markers, on their rays, that appear displaced by shift (K, 2), m, and are raised by so much (K), m.
    Rows3 raised_points(const Rows2& rest, const Rows2& shift, const Rows3& camera_centre, const Eigen::VectorXd& raised) const;
};

}  // namespace tactile
