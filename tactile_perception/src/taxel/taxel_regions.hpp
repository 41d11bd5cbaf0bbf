// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contact regions of a taxel array: what is connected, its outline, area and load.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/grid.hpp"
#include "common/outlines.hpp"

namespace tactile {

struct TaxelRule {
    std::ptrdiff_t rows, columns;
    double level;           // score at the border of a contact
    double pitch;           // m
    std::ptrdiff_t most;    // regions of which outlines are told: the largest
    std::ptrdiff_t around;  // taxels around a region that share its force
};

struct TaxelRegion {
    std::int32_t label = 0;        // in the labels below
    std::ptrdiff_t count = 0;      // of taxels
    Box box{};                     // around them
    double force = 0, peak = 0;    // sum of pressure times area over its taxels and those around, and the largest pressure
    std::array<double, 6> sums{};  // integrals of 1, x, y, xx, xy, yy within its outline, without its holes, m
};

struct TaxelRegions {
    std::vector<std::int32_t> labels;  // (rows, columns) of connected taxels, 0 outside
    std::vector<std::int32_t> near;    // the same, extended to the taxels around
    Loops loops;                       // in taxels
    std::vector<double> points;        // (M, 3) m, of the loops
    std::vector<TaxelRegion> regions;  // of the loops, largest first
    bool broken = false;               // whether there are more than the rule's most
};

// Regions where score (rows, columns) exceeds the rule's level, with the load of pressure (rows, columns).
TaxelRegions taxel_regions(const float* score, const float* pressure, const TaxelRule& rule);

}  // namespace tactile
