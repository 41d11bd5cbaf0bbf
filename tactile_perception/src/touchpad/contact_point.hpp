// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contact point and depth from the dots in a contact region.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>

#include "common/dot_surface.hpp"

namespace tactile {

// A region: its mean place and unit normal, area, and the points of its polygons, see Loops; pitch: of the dots.
struct RegionShape {
    Vec3 centroid, normal;
    double area;
    const double* border;
    const std::int64_t* start;
    std::ptrdiff_t loops;
    double pitch;
};

struct ContactPlace {
    Vec3 position;
    Eigen::Matrix3d covariance;
    Vec3 normal;
};

// Contact point on the surface wide (see dot_surface) of a region whose dots are at points (count, 3), each coordinate with standard
// deviation sigma. The dots lie on the object. Along a principal direction in which they curve like a fingertip, the contact point is the
// lowest point of the fitted curve; along one without curvature (a face, an edge), it is the area centroid. With too few dots for a fit the
// covariance covers both cases.
ContactPlace contact_point(const double* points, std::ptrdiff_t count, const RegionShape& region, const Nodes& wide, double sigma);

// The upper half of a sphere around (0, 0, centre_z), m.
struct RestCap {
    double centre_z, radius;
};

// Largest height of the surface at rest over points (count, 3), m, by a quadratic fitted around the highest one; NaN without points
// under it.
double contact_depth(const double* points, std::ptrdiff_t count, const RestCap& rest, double pitch);

}  // namespace tactile
