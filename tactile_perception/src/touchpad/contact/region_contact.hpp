// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "common/contact_point.hpp"
#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// Dots of a frame: id (count), on the grid; places (count, 3), m; whether inside a region (count) and whether in that or another one,
// touched (count); force, N, of carried_loads on all dots of the grid (K, 3), null where unknown.
struct RegionDots {
    Grid grid;
    const std::int64_t* id;
    const double *places, *force;
    const bool *inside, *touched;
    std::ptrdiff_t count;
};

// The contact in a region: its place; depth, m, at least 0, and normal force, N, NaN where unknown.
struct RegionContact {
    ContactPlace place;
    double depth, force;
};

// wide, sigma: as for contact_point; rest: as for contact_depth. The force is that of all dots to which this region is the nearest, see
// near_regions, along the region's mean normal, at least 0.
RegionContact region_contact(const RegionDots& dots, const RegionShape& region, const Nodes& wide, const RestCap& rest, double sigma);

}  // namespace tactile
