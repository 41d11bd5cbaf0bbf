// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Area, first and second moments of regions on the curved surface through the dots, from their polygons (Green's theorem).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/fields.hpp"
#include "common/outlines.hpp"

namespace tactile {

constexpr int MOMENTS = 10;  // area, vector area, integrals of x, y, z, and of xx, xy, yy

struct RegionMoments {
    std::vector<double> of;  // (regions, MOMENTS)
    double pitch;            // mean distance of neighbouring dots in the part of the surface that the regions cover
};

// Moments of the regions, without their holes, on the surface wide (see dot_surface), by polygons that are refine steps a node. Vertices
// are at most a node off the grid.
RegionMoments region_moments(const Loops& loops, std::ptrdiff_t regions, const Nodes& wide, std::ptrdiff_t refine);

// Outlines of the regions (find_outlines), their points on the surface wide (see dot_surface), and their moments.
struct RegionOutlines : Loops {
    std::vector<double> points;   // (M, 3) m
    std::vector<double> moments;  // (regions, MOMENTS)
    double pitch;                 // m
    TACTILE_FIELDS(vertices, start, region, points, moments, pitch)
};
RegionOutlines outline_regions(const Array<double>& score, const Array<double>& wide, double level, std::ptrdiff_t refine);

// Standard deviation of an integral over a region due to errors of its outline; squares: over its border, of the integrand. Errors of a
// third of a pitch are independent for each pitch.
double border_sigma(double squares, double pitch);

// Full lengths of the ellipse of the same moments, and its direction, rad, NaN where it is not significant. sums (6): integrals of 1, x, y,
// xx, xy, yy; points (M, 3), start (L + 1): of L polygons.
Eigen::Vector3d region_axes(const Array<double>& sums, const Array<double>& points, const Array<std::int64_t>& start, double pitch);

// Calls visit(point, length) for each vertex of the polygons and the side from it to the next one.
template <class Visit>
void each_side(const double* points, const std::int64_t* start, std::ptrdiff_t count, Visit visit) {
    for (std::ptrdiff_t loop = 0; loop < count; ++loop) {
        for (std::int64_t i = start[loop]; i < start[loop + 1]; ++i) {
            const Eigen::Vector3d here = vec3_at(points, i), next = vec3_at(points, i + 1 < start[loop + 1] ? i + 1 : start[loop]);
            visit(here, (next - here).norm());
        }
    }
}

}  // namespace tactile
