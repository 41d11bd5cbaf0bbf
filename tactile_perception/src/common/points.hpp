// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Sets of points: their shapes, normals and motions in a plane.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace tactile {

// Whether none of the values (count) is NaN or beyond most.
bool all_within(const double* values, std::ptrdiff_t count, double most);

// Unit normals (rows, columns, 3) of the surface through places (rows, columns, 3) of dots, NaN unknown: cross products of the differences
// along columns and rows, central, one-sided next to a gap; NaN where a dot has no neighbour along either.
std::vector<double> grid_normals(const double* places, std::ptrdiff_t rows, std::ptrdiff_t columns);

// A motion in the plane: velocity at the origin, angular velocity, centre of rotation. NaN: unknown; of a translation, the centre alone.
struct PlanarTwist {
    std::array<double, 2> linear;
    double turn;
    std::array<double, 2> centre;
};

// Least squares of velocity (count, 2) at place (count, 2). A centre farther than `far` radii of the places counts as a translation.
PlanarTwist planar_twist(const double* place, const double* velocity, std::ptrdiff_t count, double far);

// Whether points (count, 3) lie on a line: the second largest extent of their scatter is less than this share of the largest one.
bool lie_on_a_line(const double* points, std::ptrdiff_t count, double thinnest);

// Largest depth of a closed polygon's notches: distance of one of its corners (count, 2) from the side of the convex hull that spans it. 0
// for a convex polygon and for less than four corners.
double deepest_notch(const double* corners, std::ptrdiff_t count);

}  // namespace tactile
