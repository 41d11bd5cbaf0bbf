// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/region_moments.hpp"

#include <algorithm>
#include <cmath>

#include "common/constants.hpp"

namespace tactile {
namespace {

// Rows or columns that some vertices need: those around them and one node more on each side, where there is one, for the cubic.
struct Span {
    std::ptrdiff_t first, count;
};

Span span_of(const std::vector<double>& vertices, std::size_t axis, std::ptrdiff_t nodes) {
    double least = INFINITY, most = -INFINITY;
    for (std::size_t i = axis; i < vertices.size(); i += 2) least = std::min(least, vertices[i]), most = std::max(most, vertices[i]);
    const std::ptrdiff_t first = std::max<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(std::floor(least)) - 1, 1 - BEYOND);
    return {first, std::min(static_cast<std::ptrdiff_t>(std::ceil(most)) + 1, nodes + BEYOND - 2) - first + 1};
}

// The integrands per unit of area in (row, column), at a node of the surface.
void integrands(const Nodes& wide, std::ptrdiff_t row, std::ptrdiff_t column, double* found) {
    const std::ptrdiff_t node = (row + BEYOND) * wide.columns + column + BEYOND;
    const Eigen::Vector3d across = vec3_at(wide.values, node + 1) - vec3_at(wide.values, node - 1);
    const Eigen::Vector3d down = vec3_at(wide.values, node + wide.columns) - vec3_at(wide.values, node - wide.columns);
    const Eigen::Vector3d area = 0.25 * across.cross(down), position = vec3_at(wide.values, node);
    const double density = area.norm();
    found[0] = density;
    store(found + 1, 0, area);
    store(found + 4, 0, density * position);
    found[7] = density * position.x() * position.x(), found[8] = density * position.x() * position.y(),
    found[9] = density * position.y() * position.y();
}

}  // namespace

RegionMoments region_moments(const Loops& loops, std::ptrdiff_t regions, const Nodes& wide, std::ptrdiff_t refine) {
    RegionMoments found{std::vector<double>(regions * MOMENTS), NAN};
    if (loops.vertices.empty()) return found;
    const Span rows = span_of(loops.vertices, 0, wide.rows - 2 * BEYOND), columns = span_of(loops.vertices, 1, wide.columns - 2 * BEYOND);
    // Integrated along the columns once; a contour integral over the rows then gives the double integral.
    std::vector<double> along(rows.count * columns.count * MOMENTS);
    double last[MOMENTS] = {}, here[MOMENTS], total = 0;
    for (std::ptrdiff_t r = 0; r < rows.count; ++r) {
        for (std::ptrdiff_t c = 0; c < columns.count; ++c, std::copy(here, here + MOMENTS, last)) {
            integrands(wide, rows.first + r, columns.first + c, here);
            total += here[0];
            if (c == 0) continue;
            double* sum = &along[(r * columns.count + c) * MOMENTS];
            for (int k = 0; k < MOMENTS; ++k) sum[k] = sum[k - MOMENTS] + 0.5 * (here[k] + last[k]);
        }
    }
    found.pitch = std::sqrt(total / static_cast<double>(rows.count * columns.count));
    const Nodes nodes{along.data(), rows.count, columns.count, MOMENTS};
    const auto fine = static_cast<double>(refine);
    for (std::size_t loop = 0; loop < loops.region.size(); ++loop) {
        const std::int64_t first = loops.start[loop], count = loops.start[loop + 1] - first;
        for (std::int64_t i = 0; i < count; ++i) {  // by the trapezoidal rule between vertices
            const double* at = &loops.vertices[2 * (first + i)];
            const double step = loops.vertices[2 * (first + (i + 1) % count)] - loops.vertices[2 * (first + (i + count - 1) % count)];
            add_along_line(nodes, (at[0] - static_cast<double>(rows.first)) * fine, (at[1] - static_cast<double>(columns.first)) * fine,
                           refine, 0.5 * step, &found.of[loops.region[loop] * MOMENTS]);
        }
    }
    return found;
}

RegionOutlines outline_regions(const Array<double>& score, const Array<double>& wide, double level, std::ptrdiff_t refine) {
    Loops loops = find_outlines(score, level, refine);
    RegionMoments moments = region_moments(loops, loops.region.empty() ? 0 : loops.region.back() + 1, nodes_of(wide), refine);
    std::vector<double> points = points_of(loops, nodes_of(wide), refine);
    return {std::move(loops), std::move(points), std::move(moments.of), moments.pitch};
}

double border_sigma(double squares, double pitch) {
    return COMMON.outline_sigma * pitch * std::sqrt(COMMON.outline_length * pitch * squares);
}

Eigen::Vector3d region_axes(const Array<double>& sums, const Array<double>& points, const Array<std::int64_t>& start, double pitch) {
    const double area = sums[0], x = sums[1] / area, y = sums[2] / area;
    const double xx = sums[3] / area - x * x, xy = sums[4] / area - x * y, yy = sums[5] / area - y * y;
    const double mean = 0.5 * (xx + yy), half = std::hypot(0.5 * (xx - yy), xy), angle = 0.5 * std::atan2(2 * xy, xx - yy);
    const double major = 4 * std::sqrt(std::max(mean + half, 0.0)), minor = 4 * std::sqrt(std::max(mean - half, 0.0));
    const double cosine = std::cos(angle), sine = std::sin(angle);
    double squares = 0;  // of the difference of the squares along and across
    each_side(points, start, start.length() - 1, [&](const Eigen::Vector3d& at, double side) {
        const double along = cosine * (at.x() - x) + sine * (at.y() - y), across = cosine * (at.y() - y) - sine * (at.x() - x);
        const double off = along * along - across * across;
        squares += side * off * off;
    });
    const bool reported = !(2 * half < COMMON.direction_sigmas * border_sigma(squares, pitch) / area);
    return {major, minor, !reported ? NAN : angle > -0.5 * M_PI ? angle : 0.5 * M_PI};
}

}  // namespace tactile
