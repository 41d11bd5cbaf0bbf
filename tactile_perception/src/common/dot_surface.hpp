// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Values on a grid of nodes, and cubic convolution between them (Keys 1981, a = -1/2: exact for parabolas).
#pragma once

#include <cstddef>
#include <vector>

#include "common/array.hpp"
#include "common/vectors.hpp"

namespace tactile {

constexpr std::ptrdiff_t BEYOND = 2;  // nodes that a dot surface is extrapolated by on each side, as a cubic needs

// values (rows, columns, channels) on the nodes of a grid.
struct Nodes {
    const double* values;
    std::ptrdiff_t rows, columns, channels;
};
inline Nodes nodes_of(const Array<double>& positions) {
    return {positions, positions.length(0), positions.length(1), 3};
}

// positions (rows, columns, 3), 2 x 2 or more, with BEYOND nodes more on each side, extrapolated linearly from the last two.
std::vector<double> extended(const Array<double>& positions);

// Unit normals (rows, columns, 3), z upwards, of the surface through positions (rows, columns, 3): by differences of neighbours, one-sided
// next to a gap (NaN); NaN without neighbours along an axis.
std::vector<double> grid_normals(const Array<double>& positions);

// Writes the values (channels) where the grid's nodes are refine times as dense, at that row and column; nodes off the grid are those at
// its border.
void refined_value(const Nodes& nodes, std::ptrdiff_t row, std::ptrdiff_t column, std::ptrdiff_t refine, double* found);

// The same for all rows and columns, ((rows - 1) refine + 1, (columns - 1) refine + 1), of one channel.
std::vector<double> refined_field(const std::vector<double>& field, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t refine);

// Adds the values (channels) at a position of (row, column), in nodes of the refined grid, on a line between two of them, times a factor.
void add_along_line(const Nodes& nodes, double row, double column, std::ptrdiff_t refine, double factor, double* sum);

// Point of a surface through the dots, wide (rows + 2 BEYOND, columns + 2 BEYOND, 3), at a position of (row, column) up to a node off them.
Eigen::Vector3d surface_point(const Nodes& wide, double row, double column);

// A point on the surface, seen along z at x and y, and its unit normal out of the sensor, as it slopes over a node on each side: Newton
// steps from the nearest dot.
struct SurfacePoint {
    Eigen::Vector3d point, normal;
};
SurfacePoint surface_at(const Nodes& wide, double x, double y);

}  // namespace tactile
