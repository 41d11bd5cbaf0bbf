// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/grid_normals.hpp"

#include <cmath>
#include <limits>

#include "common/vectors.hpp"

namespace tactile {
namespace {

// Slope at place k, number `at` along an axis of count places, step numbers apart.
double slope(const double* values, std::ptrdiff_t k, std::ptrdiff_t step, std::ptrdiff_t at, std::ptrdiff_t count) {
    constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();
    const double before = at > 0 ? values[k] - values[k - step] : UNKNOWN;
    const double after = at + 1 < count ? values[k + step] - values[k] : UNKNOWN;
    if (std::isnan(before) || std::isnan(after)) return std::isnan(before) ? after : before;
    return 0.5 * (before + after);
}

}  // namespace

std::vector<double> grid_normals(const double* places, std::ptrdiff_t rows, std::ptrdiff_t columns) {
    std::vector<double> normals(static_cast<std::size_t>(3 * rows * columns), std::numeric_limits<double>::quiet_NaN());
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        for (std::ptrdiff_t c = 0; c < columns; ++c) {
            const std::ptrdiff_t k = r * columns + c;
            double across[3], down[3];
            for (std::ptrdiff_t axis = 0; axis < 3; ++axis) {
                across[axis] = slope(places, 3 * k + axis, 3, c, columns);
                down[axis] = slope(places, 3 * k + axis, 3 * columns, r, rows);
            }
            const Vec3 normal = cross(vec3_at(across, 0), vec3_at(down, 0));
            const double size = length(normal);
            if (size > 0) store(normals.data(), k, 1 / size * normal);
        }
    }
    return normals;
}

}  // namespace tactile
