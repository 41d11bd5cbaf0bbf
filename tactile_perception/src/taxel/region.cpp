// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/region.hpp"

#include <algorithm>
#include <cmath>

namespace tactile::taxel {
namespace {

// Integrals within a polygon (count, 3) by Green's theorem, about its first vertex, and then moved to the origin: a tiny polygon keeps its
// digits.
std::array<double, 6> integrals_of(const double* points, std::ptrdiff_t count) {
    const double x0 = points[0], y0 = points[1];
    double area = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (std::ptrdiff_t k = 1; k + 1 < count; ++k) {
        const double ax = points[3 * k] - x0, ay = points[3 * k + 1] - y0, bx = points[3 * k + 3] - x0, by = points[3 * k + 4] - y0;
        const double twice = ax * by - bx * ay;  // of the triangle with the first vertex
        area += twice / 2;
        x += twice * (ax + bx) / 6;
        y += twice * (ay + by) / 6;
        xx += twice * (ax * ax + ax * bx + bx * bx) / 12;
        xy += twice * (2 * ax * ay + ax * by + bx * ay + 2 * bx * by) / 24;
        yy += twice * (ay * ay + ay * by + by * by) / 12;
    }
    return {area,
            x + area * x0,
            y + area * y0,
            xx + 2 * x0 * x + area * x0 * x0,
            xy + x0 * y + y0 * x + area * x0 * y0,
            yy + 2 * y0 * y + area * y0 * y0};
}

}  // namespace

Outlines outlines_of(const float* score, const std::int32_t* labels, std::ptrdiff_t rows, std::ptrdiff_t columns, double level,
                     double pitch) {
    std::vector<double> field((rows + 2) * (columns + 2));  // with a margin, in which contours close
    for (std::ptrdiff_t r = 0; r < rows; ++r) std::copy_n(score + r * columns, columns, &field[(r + 1) * (columns + 2) + 1]);
    Outlines found{find_contours(field.data(), rows + 2, columns + 2, level), {}, {}, {}};
    for (double& place : found.loops.places) place -= 1;
    const std::vector<double>& places = found.loops.places;
    for (std::size_t k = 0; k + 1 < places.size(); k += 2) {
        found.points.insert(found.points.end(), {pitch * (places[k + 1] - 0.5 * static_cast<double>(columns - 1)),
                                                 pitch * (places[k] - 0.5 * static_cast<double>(rows - 1)), 0});
    }
    const auto label = [&](double row, double column) {
        const auto r = static_cast<std::ptrdiff_t>(row), c = static_cast<std::ptrdiff_t>(column);
        return r < 0 || c < 0 || r >= rows || c >= columns ? 0 : labels[r * columns + c];
    };
    for (std::size_t k = 0; k < found.loops.region.size(); ++k) {
        const std::int64_t first = found.loops.start[k];
        const double row = places[2 * first], column = places[2 * first + 1];
        // Of the two taxels beside a vertex one is inside.
        found.label.push_back(std::max(label(std::floor(row), std::floor(column)), label(std::ceil(row), std::ceil(column))));
        found.integrals.push_back(integrals_of(&found.points[3 * first], found.loops.start[k + 1] - first));
    }
    return found;
}

}  // namespace tactile::taxel
