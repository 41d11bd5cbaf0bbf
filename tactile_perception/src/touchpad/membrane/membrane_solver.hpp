// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Ranges of a membrane's dots from measured ones and the balance of forces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// One frame. origin (3), m, and unit rays (K, 3); measured (K), m, and their weights (K), 1/m^2, 0 where unknown; ranges (K), m, touched
// (K) and pressure, Pa: of the last frame, touched is null where there is none; response (I, I): information about the load on each
// inner dot (columns) from the range of one (rows) at unit weight; change (K), m: of the measured ranges, whose effect is returned.
struct MembraneFrame {
    const double *origin, *rays, *measured, *weight, *ranges, *touched;
    const float* response;
    const double* change;
    double pressure;
};

// ranges (K), m; touched (K): probability that a dot carries a load; weight (K): without the ranges that were left out; pressure, Pa; moved
// (K), m, and lifted, Pa: first-order change of ranges and pressure for the frame's change of the measured ranges.
struct MembraneSolution {
    std::vector<double> ranges, touched, weight;
    double pressure;
    std::vector<double> moved;
    double lifted = 0;
};

MembraneSolution solve_membrane(const Membrane& membrane, const MembraneFrame& frame);

}  // namespace tactile
