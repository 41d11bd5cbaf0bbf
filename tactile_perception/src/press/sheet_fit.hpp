// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Fits presses to the markers of a sheet.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>

#include "common/fields.hpp"
#include "common/rows.hpp"
#include "press/choice.hpp"
#include "press/sheet_library.hpp"

namespace tactile {

using Rows6 = Rows<PRESS_SIZE>;
using Rows9 = Rows<9>;

constexpr int MAX_SHEET_PRESSES = 2;

/// The undeformed markers: rest (N, 2) and the centre of the camera that sees each (N, 3), m. radius: of a marker, m, which is a disc if it
/// is nearer than near, m, to a press, else a point.
struct SheetMarkers {
    Rows2 rest;
    Rows3 camera_centre;
    double radius = 0, near = 0;
    TACTILE_FIELDS(rest, camera_centre, radius, near)
};

/// The measurements of a frame: value (N, 3) shift, m, and growth, NaN where unknown; motion (N, 3) of value since the last frame, of the
/// markers that a second camera sees at another time, 0 for the others.
struct SheetFrame {
    Rows3 value, motion;
    TACTILE_FIELDS(value, motion)
};

/// Standard deviations: shift, m, and growth of an untouched marker; model error over a marker's displacement (growth 1/m), and over the
/// depth of the press (growth 1/m).
struct MarkerNoise {
    double shift = 0, growth = 0, share_shift = 0, share_growth = 0, depth_shift = 0, depth_growth = 0;
    TACTILE_FIELDS(shift, growth, share_shift, share_growth, depth_shift, depth_growth)
};

/// Prior of the presses: mean and standard deviation of the log of the tip's radius over the middle one; drags: whether the drags are
/// unknown, else they are 0.
struct SheetPrior {
    double log_radius = 0, sigma = 0.15;
    bool drags = false;
    TACTILE_FIELDS(log_radius, sigma, drags)
};

/// Presses that explain a frame.
struct SheetFit {
    Rows6 presses;
    double interaction;          // factor of the interaction of two, 0 for one
    Eigen::MatrixXd covariance;  // (S, S) of the presses' parameters and, of two, of that factor; 0 of known ones
    double misfit, expected;     // mean squared residual, normalised without the model error of drags, and its expectation with it
    Rows9 wrenches;              // of each press
    TipRadius radius() const { return {presses(0, 3), std::sqrt(covariance(3, 3))}; }
    TACTILE_FIELDS(presses, interaction, covariance, misfit, expected, wrenches)
};

/// Fits presses to a frame, from start.
SheetFit fit_presses(const SheetTable& table, const SheetMarkers& markers, const SheetFrame& frame, const MarkerNoise& noise,
                     const SheetPrior& prior, const Rows6& start);

/// Shift and growth of markers under presses with a factor of interaction, and the Shape of the sheet there, column by column.
struct ShownMarkers {
    Rows3 value;
    Rows9 shape;
    TACTILE_FIELDS(value, shape)
};
ShownMarkers show_presses(const SheetTable& table, const SheetMarkers& markers, const Rows6& presses, double interaction);

/// Shift and growth (N, 3) of discs on a sheet with the field (side * side, 3) of one press at position (2,), m.
Rows3 show_field(const SheetTable& table, const SheetMarkers& markers, const double* position, const float* field);

}  // namespace tactile
