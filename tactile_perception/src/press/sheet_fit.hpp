// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Fits presses to the markers of a sheet.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "press/sheet_library.hpp"

namespace tactile {

constexpr int MOST_PRESSES = 2;
constexpr int MOST_STATE = MOST_PRESSES * PRESS_SIZE + 2;  // the presses, the factor of their interaction, the lateness of a view

// The markers of a frame: rest (N, 2), camera_centre (N, 3), m; value (N, 3) shift and growth, NaN where unknown; motion (N, 3) of
// value since the frame before, of those that a second camera sees at a moment of its own, 0 for the others.
struct SeenMarkers {
    std::ptrdiff_t count;
    const double *rest, *camera_centre, *value, *motion;
    double radius;  // m, of a marker
};

// Standard deviations: shift, m, and growth of an untouched marker; model error over a marker's displacement, and over the depth of the
// press (growth 1/m).
struct MarkerNoise {
    double shift, growth, share_shift, share_growth, depth_shift, depth_growth;
};

// What is known of the tip before: mean and standard deviation of the log of its radius over the middle one.
struct TipPrior {
    double log_radius, sigma;
};

struct PressFit {
    Eigen::VectorXd state;       // (S) of the presses, and of two the factor of their interaction
    Eigen::MatrixXd covariance;  // (S, S), 0 of what is known
    double misfit, expected;     // mean squared normalised residual, and what the doubt of drags makes of 1
    Eigen::Matrix<double, Eigen::Dynamic, WRENCH_SIZE, Eigen::RowMajor> wrenches;  // of each press
};

// Fits count presses from start (count, PRESS_SIZE); drags: whether their drags are unknown, too; near: m, from a press, within which
// markers are discs, farther away points.
PressFit fit_presses(const SheetTable& table, const SeenMarkers& seen, const MarkerNoise& noise, const TipPrior& tip, const double* start,
                     int count, bool drags, double near);

// Shift and growth (N, 3) of markers under presses (count, PRESS_SIZE) with an interaction factor, and the displacement
// of the sheet there with its derivatives by x and y (N, 3, 3).
void show_presses(const SheetTable& table, const SeenMarkers& seen, const double* presses, int count, double mixed, double near,
                  double* shown, double (*deformed)[3][3]);

// Shift and growth (N, 3) of discs on a sheet with the field (side * side, 3) of one press at place (2,), m.
void show_field(const SheetTable& table, const SeenMarkers& seen, const double* place, const float* field, double* shown);

}  // namespace tactile
