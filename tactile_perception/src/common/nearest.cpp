// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/nearest.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

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
    std::vector<std::int64_t> order(size);  // by the first coordinate; a search goes outwards along it, to both sides
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](std::int64_t i, std::int64_t j) { return points[2 * i] < points[2 * j]; });
    Nearest found{std::vector<double>(query_count * count, NONE), std::vector<std::int64_t>(query_count * count, size)};
    for (std::ptrdiff_t query = 0; query < query_count; ++query) {
        const double u = queries[2 * query], v = queries[2 * query + 1];
        double* squares = found.distance.data() + query * count;
        std::int64_t* index = found.index.data() + query * count;
        auto right = std::lower_bound(order.begin(), order.end(), u, [&](std::int64_t i, double at) { return points[2 * i] < at; });
        auto left = right;
        while (left != order.begin() || right != order.end()) {
            const double to_left = left == order.begin() ? NONE : u - points[2 * *(left - 1)];
            const double to_right = right == order.end() ? NONE : points[2 * *right] - u;
            const double along = std::min(to_left, to_right);
            if (along * along >= squares[count - 1]) break;
            const std::int64_t point = to_left < to_right ? *--left : *right++;
            const double across = points[2 * point + 1] - v, square = along * along + across * across;
            if (square < squares[count - 1]) insert(square, point, squares, index, count);
        }
        std::transform(squares, squares + count, squares, [](double square) { return std::sqrt(square); });
    }
    return found;
}

}  // namespace tactile
