// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Outlines of regions: level contours of a field on a grid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/dot_surface.hpp"

namespace tactile {

// Closed polygons, one after the other, region by region, largest first: each region's outline, then its holes.
struct Loops {
    std::vector<double> vertices;        // (M, 2) of (row, column)
    std::vector<std::int64_t> start{0};  // (L + 1) first vertex of each polygon, and the number of vertices
    std::vector<std::int64_t> region;    // (L) number of the region
};

// Polygons along which field (rows, columns) crosses level; nodes at its border count as below. Linear between nodes; around what is above,
// they turn from +column to +row, around holes in the opposite direction (marching squares, saddle cells resolved by their mean).
Loops find_contours(const double* field, std::ptrdiff_t rows, std::ptrdiff_t columns, double level);

// Outlines of the regions where score (rows, columns), clipped to 0 and 1, is above level, refine steps a node. Regions at the grid's border
// are closed half a node outside.
Loops find_outlines(const Array<double>& score, double level, std::ptrdiff_t refine);

// Points (M, 3) of a surface at the vertices of outlines that are refine steps a node; wide: see dot_surface.
std::vector<double> points_of(const Loops& loops, const Nodes& wide, std::ptrdiff_t refine);

}  // namespace tactile
