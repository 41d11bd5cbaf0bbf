// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// The nearest region (K) of each dot, from 1, of several the first, 0 far from all; and the share (K) of the dot's force that belongs to
// it: 1 in the region, less and less around it.
struct NearRegions {
    std::vector<std::int32_t> region;
    std::vector<double> share;
};

// region (K): of the dots in regions, 0 for others.
NearRegions near_regions(Grid grid, std::vector<std::int32_t> region);

// force (K, 3), N, on the dots that carry a load and, by their shares, on those around, 0 on others; their wrench (6), N and N m, about the
// origin.
struct CarriedLoads {
    std::vector<double> force;
    std::array<double, 6> wrench;
};

// The dots with a load (K) over loaded, and those around, carry what the object puts on them: force (K, 3), N, at places (K, 3), m.
CarriedLoads carried_loads(Grid grid, const double* places, const double* force, const double* load, double loaded);

}  // namespace tactile
