// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/sheet_library.hpp"

#include <algorithm>
#include <cmath>

#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr std::ptrdiff_t MAX_ORDER = 8;  // of the polynomials; checked at the border

// Chebyshev polynomials, T_k(cos t) = cos(k t), of the nearness of a position to the clamp along an axis, and their derivatives, 1/m. The
// stiffness under a press grows in proportion to that nearness, the inverse hyperbolic tangent of the position over half the side.
struct Polynomials {
    float value[2 * MAX_ORDER], slope[2 * MAX_ORDER];
    Polynomials(double position, double half, double reach, std::ptrdiff_t order) {
        const double share = std::clamp(position / half, -reach / half, reach / half), whole = std::atanh(reach / half);
        const double angle = std::acos(std::clamp(std::atanh(share) / whole, -1 + 1e-6, 1 - 1e-6));
        const double around = 1 / (std::sin(angle) * whole * half * (1 - share * share));
        for (std::ptrdiff_t k = 0; k < 2 * order; ++k) {
            const double degree = static_cast<double>(k);
            value[k] = static_cast<float>(std::cos(degree * angle));
            slope[k] = static_cast<float>(std::sin(degree * angle) * degree * around);
        }
    }
};

// Uniform cubic B-splines at a depth: the first level, weights, and their derivatives, 1/m.
struct DepthSplines {
    std::ptrdiff_t first;
    float value[4], slope[4];
    DepthSplines(double depth, const SheetTable& table) {
        const double share = std::clamp(depth / table.depth, 1e-6, 1.0);
        const double level = std::pow(share, 1 / table.power) * static_cast<double>(table.levels);
        first = std::min(static_cast<std::ptrdiff_t>(level), table.levels - 1);
        const double f = level - static_cast<double>(first), g = 1 - f, by = level / (table.power * share * table.depth);
        const double values[] = {g * g * g, 3 * f * f * f - 6 * f * f + 4, -3 * f * f * f + 3 * f * f + 3 * f + 1, f * f * f};
        const double slopes[] = {-g * g, 3 * f * f - 4 * f, -3 * f * f + 2 * f + 1, f * f};
        for (int k = 0; k < 4; ++k) value[k] = static_cast<float>(values[k] / 6), slope[k] = static_cast<float>(slopes[k] * by / 2);
    }
};

// Weights of the terms, and their derivatives by log radius and by drag x and y.
struct TermWeights {
    double value[TERMS], slope[3][TERMS] = {};
    TermWeights(const double* press, const SheetTable& table) {
        const double e = std::clamp(press[3] / table.spread, -1.2, 1.2), x = press[4], y = press[5];
        const double values[] = {1, e, e * e, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y};
        std::copy(values, values + TERMS, value);
        slope[0][1] = 1 / table.spread, slope[0][2] = 2 * e / table.spread;
        slope[1][3] = 1, slope[1][5] = 2 * x, slope[1][6] = y, slope[1][8] = 3 * x * x, slope[1][9] = 2 * x * y, slope[1][10] = y * y;
        slope[2][4] = 1, slope[2][6] = x, slope[2][7] = 2 * y, slope[2][9] = x * x, slope[2][10] = 2 * x * y, slope[2][11] = 3 * y * y;
    }
};

// Terms whose sign a reflection changes.
constexpr int ODD_X[TERMS] = {0, 0, 0, 1, 0, 0, 1, 0, 1, 0, 1, 0}, ODD_Y[TERMS] = {0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 0, 1};

// What the terms of a table are worth at a press.
struct AtPress {
    Polynomials along, across;
    DepthSplines down;
    TermWeights weights;
    AtPress(const SheetTable& table, const double* press)
        : along(press[0], table.half[0], table.reach[0], table.order),
          across(press[1], table.half[1], table.reach[1], table.order),
          down(press[2], table),
          weights(press, table) {}
};

// Columns of one class at a press (columns, LANES): value, and derivatives by the numbers of the press.
TACTILE_WIDE void mix(const SheetTable& table, const float* coefficients, int part, const AtPress& at, int terms, float* mixed) {
    const auto& [along, across, down, weights] = at;
    const std::ptrdiff_t order = table.order, columns = table.modes[part] + WRENCH_COLUMNS[part];
    const std::ptrdiff_t rows = terms * order * order, size = rows * columns;
    const std::ptrdiff_t level = TERMS * order * order * columns;
    const float* levels = coefficients + down.first * level;
    std::vector<float> at_depth(2 * size), by_row(2 * rows * LANES);  // coefficients, and their changes with depth; the weights of both
    float *now = at_depth.data(), *change = now + size;
    for (std::ptrdiff_t k = 0; k < size; ++k) {
        const float between[] = {levels[k], levels[k + level], levels[k + 2 * level], levels[k + 3 * level]};
        now[k] = down.value[0] * between[0] + down.value[1] * between[1] + down.value[2] * between[2] + down.value[3] * between[3];
        change[k] = down.slope[0] * between[0] + down.slope[1] * between[1] + down.slope[2] * between[2] + down.slope[3] * between[3];
    }
    float *weight = by_row.data(), *weight_of_change = weight + rows * LANES;
    for (int term = 0; term < terms; ++term) {
        const auto value = static_cast<float>(weights.value[term]);
        const int odd_x = (part / 2) ^ ODD_X[term], odd_y = (part % 2) ^ ODD_Y[term];
        for (std::ptrdiff_t k = 0; k < order * order; ++k, weight += LANES, weight_of_change += LANES) {
            const std::ptrdiff_t i = 2 * (k / order) + odd_x, j = 2 * (k % order) + odd_y;
            const float polynomial = along.value[i] * across.value[j];
            weight[0] = value * polynomial, weight[1] = value * along.slope[i] * across.value[j];
            weight[2] = value * along.value[i] * across.slope[j], weight_of_change[3] = weight[0];
            for (int n = 0; n < 3; ++n) weight[4 + n] = static_cast<float>(weights.slope[n][term]) * polynomial;
        }
    }
    weigh_rows(now, 2 * rows, columns, by_row.data(), mixed);
}

// Adds the modes of a class, mirrored from their quarter to the whole mesh; sums: a buffer for the quarter, (3 (n + 1)^2, LANES).
TACTILE_WIDE void add_modes(const SheetTable& table, const float* shapes, int part, const float* mixed, float* sums, float* field) {
    const std::ptrdiff_t quarter = table.n + 1, side = table.side();
    weigh_rows(shapes, table.modes[part], 3 * quarter * quarter, mixed, sums);
    const float sign_x = part / 2 ? -1.0f : 1.0f, sign_y = part % 2 ? -1.0f : 1.0f;
    for (std::ptrdiff_t i = 0; i < side; ++i) {
        for (std::ptrdiff_t j = 0; j < side; ++j, field += CHANNELS) {
            const bool far_x = i >= quarter, far_y = j >= quarter;
            const float* from = sums + CHANNELS * ((far_x ? side - 1 - i : i) * quarter + (far_y ? side - 1 - j : j));
            const float whole = (far_x ? sign_x : 1.0f) * (far_y ? sign_y : 1.0f);
            const float signs[3] = {far_x ? -whole : whole, far_y ? -whole : whole, whole};
            for (int c = 0; c < 3; ++c)
                for (std::ptrdiff_t k = c * LANES; k < (c + 1) * LANES; ++k) field[k] += signs[c] * from[k];
        }
    }
}

// sinh(asinh(x) / 3), of x >= 0.
double sinh_of_third(double x) {
    const double root = std::cbrt(x + std::sqrt(x * x + 1));
    return (root - 1 / root) / 2;
}

// Mesh coordinate of a position along an axis and quadratic B-splines there.
struct Splines {
    std::ptrdiff_t first;
    float weights[3][3];  // value, first and second derivative by the position, 1/m, 1/m^2, of three splines
    double carried,
        stretch;  // derivatives by the position of the press: of the position at a mesh coordinate, minus 1; of its derivative, 1/m

    // The mesh is as in press/sheet/mechanics.py:spread: |offset| = scale t + (length - scale) t^3, solved by thirds of angles.
    Splines(const SheetTable& table, int axis, double position, double pressed) {
        const double half = table.half[axis], offset = std::clamp(position, -half, half) - pressed;
        const double cubic = (offset < 0 ? half + pressed : half - pressed) - table.scale;
        const double width = std::sqrt(table.scale / (3 * std::max(std::abs(cubic), 1e-6 * table.scale)));
        const double third = std::abs(offset) * 1.5 / (table.scale * width);
        const double root = cubic > 0 ? sinh_of_third(third) : std::sin(std::asin(std::min(third, 1.0)) / 3);
        const double t = std::min(2 * width * root, 1.0), xi = offset < 0 ? -t : t;
        const double slope = 1 / (table.scale + 3 * cubic * t * t), by_position = static_cast<double>(table.n) * slope;
        const double bend = -6 * cubic * xi * slope * slope * by_position;
        const double span = (xi + 1) * static_cast<double>(table.n);
        first = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(span), 0, 2 * table.n - 1);
        const double f = span - static_cast<double>(first), g = 1 - f, curve = by_position * by_position;
        const double values[] = {0.5 * g * g, 1 - 0.5 * g * g - 0.5 * f * f, 0.5 * f * f};
        const double slopes[] = {-g * by_position, (g - f) * by_position, f * by_position};
        const double bends[] = {curve - g * bend, -2 * curve + (g - f) * bend, curve + f * bend};
        for (int k = 0; k < 3; ++k) {
            weights[0][k] = static_cast<float>(values[k]);
            weights[1][k] = static_cast<float>(slopes[k]);
            weights[2][k] = static_cast<float>(bends[k]);
        }
        carried = t * t * t - 1, stretch = 3 * t * xi * slope;
    }
};

constexpr int ORDERS = 6;  // value, by x, by y, by x x, by x y, by y y
constexpr int ORDER_X[ORDERS] = {0, 1, 0, 2, 1, 0}, ORDER_Y[ORDERS] = {0, 0, 1, 0, 1, 2};

// Sums over the nodes around a position, weighted by splines: values and first derivatives of all channels, second derivatives of the
// value.
struct NodeSums {
    float sums[3][CHANNELS] = {}, bends[ORDERS - 3][3] = {};
};

TACTILE_INLINE void add_nodes(const SheetTable& table, const Splines& x, const Splines& y, const float* field, bool slopes,
                              NodeSums& found) {
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            const float* node = field + ((x.first + i) * table.side() + y.first + j) * CHANNELS;
            float products[ORDERS];
            for (int o = 0; o < ORDERS; ++o) products[o] = x.weights[ORDER_X[o]][i] * y.weights[ORDER_Y[o]][j];
            for (int o = 0; o < 3; ++o) {
                for (int c = 0; c < 3 && !slopes; ++c) found.sums[o][c * LANES] += products[o] * node[c * LANES];
                for (int c = 0; c < CHANNELS && slopes; ++c) found.sums[o][c] += products[o] * node[c];
                for (int c = 0; c < 3 && slopes; ++c) found.bends[o][c] += products[3 + o] * node[c * LANES];
            }
        }
    }
}

}  // namespace

void look_up(const SheetTable& table, const double* press, bool drags, PressedSheet& found) {
    std::copy(press, press + PRESS_SIZE, found.press);
    found.numbers = drags ? PRESS_SIZE : STRAIGHT_SIZE;
    found.field.assign(table.side() * table.side() * CHANNELS, 0.0f);
    const AtPress at(table, press);
    const float *coefficients = table.coefficients.data(), *shapes = table.shapes.data();
    const std::ptrdiff_t quarter = 3 * (table.n + 1) * (table.n + 1);
    std::vector<float> mixed, sums(quarter * LANES);
    for (int part = 0; part < 4; ++part) {
        const std::ptrdiff_t modes = table.modes[part], columns = modes + WRENCH_COLUMNS[part];
        mixed.resize(columns * LANES);
        mix(table, coefficients, part, at, drags ? TERMS : STRAIGHT_TERMS, mixed.data());
        add_modes(table, shapes, part, mixed.data(), sums.data(), found.field.data());
        for (int k = 0; k < WRENCH_COLUMNS[part]; ++k) found.wrench[WRENCH_NUMBERS[part][k]] = mixed[(modes + k) * LANES];
        coefficients += TERMS * table.order * table.order * (table.levels + 3) * columns;
        shapes += modes * quarter;
    }
}

TACTILE_WIDE void read_point(const SheetTable& table, const double* press, const float* field, int numbers, const double* rest,
                             Deformed& found) {
    const Splines x(table, 0, rest[0], press[0]), y(table, 1, rest[1], press[1]);
    NodeSums node_sums;
    if (numbers > 0)
        add_nodes(table, x, y, field, true, node_sums);
    else
        add_nodes(table, x, y, field, false, node_sums);
    const auto& [sums, bends] = node_sums;
    for (int o = 0; o < 3; ++o)
        for (int c = 0; c < 3; ++c) {
            found.value(c, o) = sums[o][c * LANES];
            for (int k = 0; k < numbers; ++k) found.slope(3 * o + c, k) = sums[o][c * LANES + 1 + k];
        }
    for (int axis = 0; axis < 2 && numbers; ++axis) {  // the mesh moves with the press
        const Splines& along = axis == 0 ? x : y;
        auto slope = found.slope.col(axis);
        for (int c = 0; c < 3; ++c) {
            slope[c] += found.value(c, 1 + axis) * along.carried;
            slope[3 + c] += bends[axis][c] * along.carried;
            slope[6 + c] += bends[1 + axis][c] * along.carried;
            slope[3 * (1 + axis) + c] += found.value(c, 1 + axis) * along.stretch;
        }
    }
}

}  // namespace tactile
