// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Displacement and wrench of a pressed sheet, looked up in a table of simulated presses.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "common/fields.hpp"
#include "common/weighted_rows.hpp"

namespace tactile {

/// Number of parameters of a press: position x, y and depth, m; log of the tip's radius over the middle one; drag x, y: tangential over
/// normal force, beyond that of a straight press.
constexpr int PRESS_SIZE = 6;

constexpr int STRAIGHT_SIZE = 4;  // parameters of a straight press

/// Terms of a table: three polynomials of the radius, then x, y, x^2, x y, y^2, x^3, x^2 y, x y^2 and y^3 of the drag.
constexpr int TERMS = 12, STRAIGHT_TERMS = 3;

/// Numbers of a wrench: log of normal force over depth; tangential over normal force, x and y; moment about the tip over normal force, m,
/// x, y and z; centre of the pressure relative to the tip, m, x, y and z.
constexpr int WRENCH_SIZE = 9;

/// Range of a table of presses: half size of the sheet, and of the pressed area, m; scale of the mesh and maximum depth, m; maximum log
/// radius; grading of the depths; the widening of sheet_fit.cpp, on moderate slopes; half the spans of the mesh; order of the polynomials;
/// levels of depth.
struct SheetPlan {
    Eigen::Vector2d half = Eigen::Vector2d::Zero(), reach = half;
    double scale = 0, depth = 0, spread = 0, power = 0, widening = 0;
    std::ptrdiff_t n = 0, order = 0, levels = 0;
    TACTILE_FIELDS(half, reach, scale, depth, spread, power, widening, n, order, levels)
};

/// A table of presses; see press/sheet/library.py. Class 2 a + b holds what is odd along x (a) and odd along y (b).
struct SheetTable : SheetPlan {
    std::ptrdiff_t modes[4];          // of each class
    std::vector<float> coefficients;  // of each class (levels + 3, TERMS, order, order, modes + columns of the wrench)
    std::vector<float> shapes;        // of each class (modes, n + 1, n + 1, 3) on one quarter of the mesh
    std::ptrdiff_t side() const { return 2 * n + 2; }
};

// Columns of the wrench in each class, and which of its numbers they are.
constexpr int WRENCH_COLUMNS[4] = {2, 3, 3, 1};
constexpr int WRENCH_NUMBERS[4][3] = {{0, 8, 8}, {2, 3, 7}, {1, 4, 6}, {5, 5, 5}};

/// For each axis, a value and its derivatives by the parameters of a press; the last lane is unused.
constexpr std::ptrdiff_t CHANNELS = 3 * LANES;

/// A press looked up: coefficients of uniform quadratic B-splines (side * side, CHANNELS), m, with derivatives by the first numbers of its
/// parameters, PRESS_SIZE or STRAIGHT_SIZE; and the wrench.
struct PressedSheet {
    double press[PRESS_SIZE];
    int numbers;
    std::vector<float> field;
    double wrench[WRENCH_SIZE];
};

/// Looks up a press, whose parameters are clamped to the table. drags: whether derivatives by the drag are wanted; else the drag counts as
/// zero.
void look_up(const SheetTable& table, const double* press, bool drags, PressedSheet& found);

/// A point of the sheet: columns displacement, m, and its derivatives by x and by y. Its derivatives by the parameters of a press are
/// columns of nine, one such column after the other.
using Shape = Eigen::Matrix3d;
struct Deformed {
    Shape value;
    Eigen::Matrix<double, 9, PRESS_SIZE> slope;  // of the wanted numbers
};

/// Reads the point with undeformed position rest, m, of a sheet pressed at press[0], press[1], with its field (side * side, CHANNELS);
/// numbers: of parameters of the press by which derivatives are wanted.
void read_point(const SheetTable& table, const double* press, const float* field, int numbers, const double* rest, Deformed& found);

}  // namespace tactile
