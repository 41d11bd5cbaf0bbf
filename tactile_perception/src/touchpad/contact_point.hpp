// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contact point and depth from the dots in a contact region.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/dot_surface.hpp"
#include "common/fields.hpp"

namespace tactile {

/// A region of dots, in m and m^2; pitch: of the dots; sigma: standard deviation of a coordinate of a dot.
struct RegionShape {
    Eigen::Vector3d centroid, normal;
    double area = 0, pitch = 1, sigma = 0;
    TACTILE_FIELDS(centroid, normal, area, pitch, sigma)
};

/// The points of a region's polygons: see Loops.
struct RegionBorder {
    const double* points;
    const std::int64_t* start;
    std::ptrdiff_t loops;
};

/// Contact point, m, its covariance, m^2, and the unit normal of the surface there.
struct ContactPosition {
    Eigen::Vector3d position;
    Eigen::Matrix3d covariance;
    Eigen::Vector3d normal;
    double depth = NAN;  // m, of contact_depth
    TACTILE_FIELDS(position, covariance, normal, depth)
};

/// Contact point on the surface wide (see dot_surface) of a region whose dots are at points (count, 3). The dots lie on the object. Along a
/// principal direction in which they curve like a fingertip, the contact point is the lowest point of the fitted curve; along one without
/// curvature (a face, an edge), it is the area centroid. With too few dots for a fit the covariance covers both cases.
ContactPosition contact_point(const double* points, std::ptrdiff_t count, const RegionShape& region, const RegionBorder& border,
                              const Nodes& wide);

/// The undeformed surface: the upper half of a sphere around (0, 0, centre_z), m.
struct RestCap {
    double centre_z = 0, radius = 0;
    TACTILE_FIELDS(centre_z, radius)
};

/// Maximum height of the undeformed surface over points (count, 3), m, by a quadratic fitted around the deepest one; NaN if no point is
/// below the surface.
double contact_depth(const double* points, std::ptrdiff_t count, const RestCap& rest, double pitch);

}  // namespace tactile
