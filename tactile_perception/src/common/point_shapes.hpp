// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Shapes of sets of points.
#pragma once

#include <cstddef>

namespace tactile {

// Whether points (count, 3) lie on a line: the second largest extent of their scatter is less than this share of the largest one.
bool lie_on_a_line(const double* points, std::ptrdiff_t count, double thinnest);

// Largest depth of a closed polygon's notches: distance of one of its corners (count, 2) from the side of the convex hull that spans it. 0
// for a convex polygon and for less than four corners.
double deepest_notch(const double* corners, std::ptrdiff_t count);

}  // namespace tactile
