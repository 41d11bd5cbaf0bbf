// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// The nearest points of each query, by rising distance; the arrays are (queries, count). Where there are fewer points than count, the
// distance is infinite and the index is the number of points.
struct Nearest {
    std::vector<double> distance;
    std::vector<std::int64_t> index;
};

// points (size, 2) and queries (queries, 2) are finite, in any unit; the distance is in the same unit.
Nearest nearest_points(const double* points, std::ptrdiff_t size, const double* queries, std::ptrdiff_t query_count, std::ptrdiff_t count);

}  // namespace tactile
