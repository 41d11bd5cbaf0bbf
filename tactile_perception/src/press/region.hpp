// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contact region between the skin and round tips.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/fields.hpp"
#include "common/rows.hpp"
#include "press/marker_surface.hpp"

namespace tactile {

/// The disc where the skin touches a tip: centre, m, unit normal and radius, m.
struct ContactDisc {
    Eigen::Vector3d centre, normal;
    double radius;

    /// Of a tip of radius, m, whose lowest point, m, is pressed to a depth, m; max_ratio: of contact radius over tip radius.
    ContactDisc(const MarkerSurface& surface, const Eigen::Vector3d& lowest, double depth, double tip_radius, double max_ratio);
};

/// Region of all discs.
struct PressRegion {
    std::vector<std::uint8_t> under;  // (N), markers that appear under a disc
    Rows3 corners;                    // (T CORNERS, 3), m, of the circles around the discs
    double area = 0, diameter = 0;    // m^2, and m, of the only disc, else NaN
    Eigen::Vector3d centroid, normal;
    TACTILE_FIELDS(under, corners, area, diameter, centroid, normal)
};

/// Radius, m, of the contact of a round tip with a taut membrane clamped at a distance of clearance, m.
///
/// Within it, a, the membrane follows the tip (a paraboloid with the slope a / tip_radius at its edge); outside it solves Laplace's
/// equation, so that depth is logarithmic in the distance: depth = a^2 / tip_radius (1/2 + ln(clearance / a)).
double contact_radius(double depth, double tip_radius, double clearance, double max_ratio);

/// The region of T > 0 discs. Markers appear at positions (N, 2), m, in the viewing plane, seen from the camera centres (N, 3), m.
PressRegion press_region(const MarkerSurface& surface, const std::vector<ContactDisc>& discs, const Rows2& positions,
                         const Rows3& camera_centre);

}  // namespace tactile
