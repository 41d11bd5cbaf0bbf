// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// A clamped sheet under a round tip: incompressible neo-Hookean membrane with bending, contact and friction, in equilibrium.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "common/fields.hpp"

namespace tactile {

/// Elements of a sheet: spans * spans, each with four integration points and nine quadratic B-splines, of side * side with
/// side = spans + 2; those at the border are clamped.
struct SheetElements {
    std::vector<double> value, slope, laplacian;  // of the splines (E, 4, 9), (E, 4, 2, 9) 1/m and (E, 4, 9) 1/m^2
    std::vector<double> weight, rest;             // of the points: (E, 4) m^2 and (E, 4, 2) m
    std::ptrdiff_t spans = 0;
    TACTILE_FIELDS(value, slope, laplacian, weight, rest)
};

/// A round tip that presses straight down at position, m. Energies are per shear modulus times thickness.
struct SheetLoad {
    Eigen::Vector2d position = Eigen::Vector2d::Zero();
    double radius = 0, prestretch = 1;
    double bending = 0;                              // m^2
    double friction = 0;                             // Coulomb's coefficient, of a tip that comes straight down
    bool slides = false;                             // whether all of the contact slides instead, with a traction of drag times pressure
    Eigen::Vector2d drag = Eigen::Vector2d::Zero();  // traction over pressure in the plane of the sheet
    TACTILE_FIELDS(position, radius, prestretch, bending, friction, slides, drag)
};

/// Numbers of a wrench: force of the tip on the sheet, m; its moment about the tip, m^2; centre of the pressure relative to the tip, m.
constexpr int PRESS_WRENCH = 9;

/// Equilibria at some depths: displacements of the splines (count, side * side, 3), m, and wrenches (count, PRESS_WRENCH).
struct PressedSheets {
    std::vector<double> fields, wrenches;
};

/// Computes the equilibria at rising depths, m. From the first depth without convergence on they are NaN.
PressedSheets press_sheet(const SheetElements& sheet, const SheetLoad& load, const std::vector<double>& depths);

}  // namespace tactile
