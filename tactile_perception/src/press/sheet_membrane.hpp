// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// A clamped sheet under a round tip: incompressible neo-Hookean membrane with bending, contact and friction, in equilibrium.
#pragma once

#include <Eigen/Core>
#include <cstddef>

namespace tactile {

/// Elements of a sheet: spans * spans, each with four integration points and nine quadratic B-splines, of side * side with
/// side = spans + 2; those at the border are clamped.
struct SheetElements {
    std::ptrdiff_t spans;
    const double *value, *slope, *laplacian;  // of the splines (E, 4, 9), (E, 4, 2, 9) 1/m and (E, 4, 9) 1/m^2
    const double *weight, *rest;              // of the points: (E, 4) m^2 and (E, 4, 2) m
};

/// A round tip that presses straight down at position, m. Energies are per shear modulus times thickness.
struct SheetLoad {
    Eigen::Vector2d position = Eigen::Vector2d::Zero();
    double radius = 0, prestretch = 1;
    double bending = 0;                              // m^2
    double friction = 0;                             // Coulomb's coefficient, of a tip that comes straight down
    bool slides = false;                             // whether all of the contact slides instead, with a traction of drag times pressure
    Eigen::Vector2d drag = Eigen::Vector2d::Zero();  // traction over pressure in the plane of the sheet
};

/// Numbers of a wrench: force of the tip on the sheet, m; its moment about the tip, m^2; centre of the pressure relative to the tip, m.
constexpr int PRESS_WRENCH = 9;

/// Computes the equilibria at rising depths (count,), m: displacements of the splines (count, side * side, 3), m, and wrenches
/// (count, PRESS_WRENCH). From the first depth without convergence on they stay as given.
void press_sheet(const SheetElements& sheet, const SheetLoad& load, const double* depths, std::ptrdiff_t count, double* fields,
                 double* wrenches);

}  // namespace tactile
