// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// A pad on an array of rows by columns taxels.
struct ShearPad {
    std::ptrdiff_t rows, columns;
    double pitch;      // m
    double thickness;  // taxels
    double coupling;   // stiffness between neighbours over that of an element to its ground
    double limit;      // m/Pa: friction over shear stiffness
    double on_top;     // share of the unsharp mask that gives the pressure on the pad's surface
    double sharp;      // taxels, width of that mask
};

// Rigid motion of the object in one frame: m at the origin, in the middle of the array, and rad.
struct Shift {
    double x, y, turn;
};

// Fields (2, rows, columns) m, along x and along y: displacement of the pad's surface, traction over shear stiffness, slip of the object.
struct Sheared {
    std::vector<float> drag, pull, slip;
    double pulled[2] = {0, 0};  // sums of pull
};

// The fields after a motion of the object; drag: displacement before; touched, pressure (Pa): (rows, columns).
Sheared moved(const ShearPad& pad, const float* drag, const std::uint8_t* touched, const float* pressure, const Shift& shift);

// A Gaussian of a width, taxels, and a share.
struct Spread {
    double share, width;
};

// Pressure (rows, columns) under the pad that pull (2, rows, columns) causes: gain times its convergence, spread.
std::vector<float> pressure_of_pull(const float* pull, std::ptrdiff_t rows, std::ptrdiff_t columns, double gain,
                                    const Spread (&spreads)[2]);

}  // namespace tactile
