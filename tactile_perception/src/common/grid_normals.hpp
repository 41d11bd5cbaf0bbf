// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace tactile {

// Unit normals (rows, columns, 3) of the surface through places (rows, columns, 3) of dots, NaN unknown: cross products of the differences
// along columns and rows, central, one-sided next to a gap; NaN where a dot has no neighbour along either.
std::vector<double> grid_normals(const double* places, std::ptrdiff_t rows, std::ptrdiff_t columns);

}  // namespace tactile
