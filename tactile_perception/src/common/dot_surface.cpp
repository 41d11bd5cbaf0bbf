// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/dot_surface.hpp"

#include <algorithm>
#include <cmath>

#include "common/constants.hpp"

namespace tactile {
namespace {

constexpr std::size_t CHANNELS = 16;  // at most

// Weights of the nodes -1, 0, 1, 2 at t in [0, 1].
void cubic_weights(double t, double* weights) {
    const double square = t * t, cube = square * t;
    weights[0] = 0.5 * (2 * square - cube - t);
    weights[1] = 0.5 * (2 - 5 * square + 3 * cube);
    weights[2] = 0.5 * (t + 4 * square - 3 * cube);
    weights[3] = 0.5 * (cube - square);
}

// The four nodes, and their weights, at a position along an axis; nodes beyond its ends are the last ones.
struct Four {
    std::ptrdiff_t node[4];
    double weight[4];
};

Four four_around(std::ptrdiff_t start, double t, std::ptrdiff_t nodes) {
    Four four;
    cubic_weights(t, four.weight);
    for (std::ptrdiff_t k = 0; k < 4; ++k) four.node[k] = std::clamp<std::ptrdiff_t>(start + k - 1, 0, nodes - 1);
    return four;
}

Four four_refined(std::ptrdiff_t position, std::ptrdiff_t refine, std::ptrdiff_t nodes) {
    const std::ptrdiff_t start = std::min(position / refine, nodes - 2);
    return four_around(start, static_cast<double>(position) / static_cast<double>(refine) - static_cast<double>(start), nodes);
}

void weighted_sum(const Nodes& nodes, const Four& down, const Four& across, double* found) {
    std::fill_n(found, nodes.channels, 0.0);
    for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < 4; ++j) {
            const double weight = down.weight[i] * across.weight[j];
            if (weight == 0) continue;
            const double* value = nodes.values + (down.node[i] * nodes.columns + across.node[j]) * nodes.channels;
            for (std::ptrdiff_t c = 0; c < nodes.channels; ++c) found[c] += weight * value[c];
        }
    }
}

Four four_at(double position, std::ptrdiff_t nodes) {
    const auto last = static_cast<double>(nodes - 2);
    const double inside = position >= 1 ? std::min(position, last) : 1.0;  // also of NaN
    const std::ptrdiff_t start = std::min(static_cast<std::ptrdiff_t>(inside), nodes - 3);
    return four_around(start, inside - static_cast<double>(start), nodes);
}

// A number that is whole but for rounding, as whole.
double snapped(double number) {
    const double whole = std::round(number);
    return std::abs(number - whole) < 1e-9 ? whole : number;
}

// Extrapolates BEYOND vectors on both sides of count ones, which lie a step apart.
void extrapolate(double* first, std::ptrdiff_t count, std::ptrdiff_t step) {
    double* last = first + (count - 1) * step;
    for (std::ptrdiff_t k = 1; k <= BEYOND; ++k) {
        for (int axis = 0; axis < 3; ++axis) {
            first[axis - k * step] = 2 * first[axis - (k - 1) * step] - first[axis - (k - 2) * step];
            last[axis + k * step] = 2 * last[axis + (k - 1) * step] - last[axis + (k - 2) * step];
        }
    }
}

// Difference of neighbours on both sides of a node, of one of them where the other is NaN or beyond the end of the line.
Eigen::Vector3d slope(const double* positions, std::ptrdiff_t node, std::ptrdiff_t step, bool has_before, bool has_after) {
    const Eigen::Vector3d none = Eigen::Vector3d::Constant(NAN);
    const Eigen::Vector3d here = vec3_at(positions, node);
    const Eigen::Vector3d before = has_before ? Eigen::Vector3d(here - vec3_at(positions, node - step)) : none;
    const Eigen::Vector3d after = has_after ? Eigen::Vector3d(vec3_at(positions, node + step) - here) : none;
    const auto either = [](double a, double b) { return std::isnan(a) ? b : std::isnan(b) ? a : 0.5 * (a + b); };
    return before.binaryExpr(after, either);
}

}  // namespace

std::vector<double> extended(const Array<double>& positions) {
    const std::ptrdiff_t rows = positions.length(0), columns = positions.length(1);
    const std::ptrdiff_t row = 3 * (columns + 2 * BEYOND), inset = 3 * BEYOND;
    std::vector<double> wide((rows + 2 * BEYOND) * row);
    for (std::ptrdiff_t r = 0; r < rows; ++r) std::copy_n(positions + 3 * r * columns, 3 * columns, &wide[(r + BEYOND) * row + inset]);
    for (std::ptrdiff_t c = 0; c < columns; ++c) extrapolate(&wide[BEYOND * row + inset + 3 * c], rows, row);
    for (std::ptrdiff_t r = 0; r < rows + 2 * BEYOND; ++r) extrapolate(&wide[r * row + inset], columns, 3);
    return wide;
}

std::vector<double> grid_normals(const Array<double>& positions) {
    const std::ptrdiff_t rows = positions.length(0), columns = positions.length(1);
    std::vector<double> normals(3 * rows * columns);
    for (std::ptrdiff_t row = 0, node = 0; row < rows; ++row) {
        for (std::ptrdiff_t column = 0; column < columns; ++column, ++node) {
            const Eigen::Vector3d normal = slope(positions, node, 1, column > 0, column + 1 < columns)
                                    .cross(slope(positions, node, columns, row > 0, row + 1 < rows));
            const double size = normal.norm();
            store(normals.data(), node, normal / (size > 0 ? size : NAN));
        }
    }
    return normals;
}

void refined_value(const Nodes& nodes, std::ptrdiff_t row, std::ptrdiff_t column, std::ptrdiff_t refine, double* found) {
    weighted_sum(nodes, four_refined(row, refine, nodes.rows), four_refined(column, refine, nodes.columns), found);
}

std::vector<double> refined_field(const std::vector<double>& field, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t refine) {
    const std::ptrdiff_t tall = (rows - 1) * refine + 1, wide = (columns - 1) * refine + 1;
    std::vector<double> line(columns), found(tall * wide);
    std::vector<Four> across;
    for (std::ptrdiff_t c = 0; c < wide; ++c) across.push_back(four_refined(c, refine, columns));
    for (std::ptrdiff_t r = 0; r < tall; ++r) {
        const Four down = four_refined(r, refine, rows);
        for (std::ptrdiff_t c = 0; c < columns; ++c) {
            line[c] = 0;
            for (int i = 0; i < 4; ++i) line[c] += down.weight[i] * field[down.node[i] * columns + c];
        }
        for (std::ptrdiff_t c = 0; c < wide; ++c) {
            for (int j = 0; j < 4; ++j) found[r * wide + c] += across[c].weight[j] * line[across[c].node[j]];
        }
    }
    return found;
}

void add_along_line(const Nodes& nodes, double row, double column, std::ptrdiff_t refine, double factor, double* sum) {
    row = snapped(row), column = snapped(column);
    const auto top = static_cast<std::ptrdiff_t>(row), left = static_cast<std::ptrdiff_t>(column);
    const double down = row - static_cast<double>(top), right = column - static_cast<double>(left), share = down + right;
    double first[CHANNELS], second[CHANNELS];
    refined_value(nodes, top, left, refine, first);
    if (share > 0) refined_value(nodes, top + (down > 0), left + (right > 0), refine, second);
    for (std::ptrdiff_t c = 0; c < nodes.channels; ++c)
        sum[c] += factor * (share > 0 ? first[c] + share * (second[c] - first[c]) : first[c]);
}

Eigen::Vector3d surface_point(const Nodes& wide, double row, double column) {
    double found[3];
    weighted_sum(wide, four_at(row + BEYOND, wide.rows), four_at(column + BEYOND, wide.columns), found);
    return {found[0], found[1], found[2]};
}

SurfacePoint surface_at(const Nodes& wide, double x, double y) {
    double row = 0, column = 0, least = INFINITY;
    for (std::ptrdiff_t r = 0; r < wide.rows - 2 * BEYOND; ++r) {
        for (std::ptrdiff_t c = 0; c < wide.columns - 2 * BEYOND; ++c) {
            const Eigen::Vector3d dot = vec3_at(wide.values, (r + BEYOND) * wide.columns + c + BEYOND);
            const double square = (dot.x() - x) * (dot.x() - x) + (dot.y() - y) * (dot.y() - y);
            if (square < least) least = square, row = static_cast<double>(r), column = static_cast<double>(c);
        }
    }
    const Eigen::Vector3d here = surface_point(wide, row, column);
    const Eigen::Vector3d down = 1 / COMMON.slope_step * (surface_point(wide, row + COMMON.slope_step, column) - here);
    const Eigen::Vector3d right = 1 / COMMON.slope_step * (surface_point(wide, row, column + COMMON.slope_step) - here);
    const double inverse = 1 / (down.x() * right.y() - down.y() * right.x());
    for (int step = 0; step < 2; ++step) {  // the Jacobian is kept for both steps
        const Eigen::Vector3d at = surface_point(wide, row, column);
        const double off_x = x - at.x(), off_y = y - at.y();
        row += std::clamp((right.y() * off_x - right.x() * off_y) * inverse, -1.0, 1.0);
        column += std::clamp((down.x() * off_y - down.y() * off_x) * inverse, -1.0, 1.0);
    }
    const Eigen::Vector3d along = surface_point(wide, row, column + 1) - surface_point(wide, row, column - 1);
    const Eigen::Vector3d across = surface_point(wide, row + 1, column) - surface_point(wide, row - 1, column);
    return {surface_point(wide, row, column), along.cross(across).normalized()};
}

}  // namespace tactile
