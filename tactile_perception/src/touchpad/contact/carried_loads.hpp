// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// force (K, 3), N, on the dots that carry a load, 0 on others; their wrench (6), N and N m, about the origin.
struct CarriedLoads {
    std::vector<double> force;
    std::array<double, 6> wrench;
};

// The dots with a load (K) over loaded, and their neighbours, which have a part of a border's load, carry what the object puts on them:
// force (K, 3), N, at places (K, 3), m.
CarriedLoads carried_loads(Grid grid, const double* places, const double* force, const double* load, double loaded);

}  // namespace tactile
