// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/nearest.hpp"

#include <cmath>
#include <limits>

#include "common/cells.hpp"

namespace tactile {
namespace {

constexpr double NONE = std::numeric_limits<double>::infinity();

// Inserts a point into the sorted nearest ones, of which the last one drops out.
void insert(double square, std::int64_t point, double* squares, std::int64_t* index, std::ptrdiff_t count) {
    std::ptrdiff_t slot = count - 1;
    for (; slot > 0 && squares[slot - 1] > square; --slot) squares[slot] = squares[slot - 1], index[slot] = index[slot - 1];
    squares[slot] = square, index[slot] = point;
}

}  // namespace

Nearest nearest_points(const double* points, std::ptrdiff_t size, const double* queries, std::ptrdiff_t query_count, std::ptrdiff_t count) {
    Nearest found{std::vector<double>(query_count * count, NONE), std::vector<std::int64_t>(query_count * count, size)};
    if (size == 0) return found;
    const Cells cells(points, size);
    const double start = 1.5 * cells.side() * std::sqrt(static_cast<double>(count));  // usually holds so many
    for (std::ptrdiff_t query = 0; query < query_count; ++query) {
        const double u = queries[2 * query], v = queries[2 * query + 1];
        double* squares = found.distance.data() + query * count;
        std::int64_t* index = found.index.data() + query * count;
        const auto [nearest, farthest] = cells.distances(u, v);
        for (double radius = nearest + start;; radius = nearest + 2 * (radius - nearest)) {
            std::fill_n(squares, count, NONE), std::fill_n(index, count, size);
            cells.within(u, v, radius, [&](std::ptrdiff_t point, double square) {
                if (square < squares[count - 1]) insert(square, point, squares, index, count);
            });
            if (squares[count - 1] < NONE || radius > farthest) break;
        }
        for (std::ptrdiff_t k = 0; k < count; ++k) squares[k] = std::sqrt(squares[k]);
    }
    return found;
}

}  // namespace tactile
