// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contacts of a pressure image: the score of each taxel, and outlines.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/outlines.hpp"

namespace tactile::taxel {

// What the pad makes of the pressure at the border of a contact. Lengths in taxels.
struct ScoreRule {
    double smooth;         // standard deviation of the Gaussian that averages noise and differences of gain
    std::ptrdiff_t reach;  // thickness of the pad, in whole taxels
    float least;           // least level of pressure that counts as contact
    float share;           // pressure at the border of a flat face over the level inside
    float ramp;            // taxels: pressure at the border of a curved face over the slope of the level there
};

// Scores (rows, columns) of pressure, 0 to 1, LEVEL at the border of a contact; 0 far from all contacts. full: taxels that are saturated.
std::vector<float> contact_score(const float* pressure, const std::uint8_t* full, std::ptrdiff_t rows, std::ptrdiff_t columns,
                                 const ScoreRule& rule);

// Outlines of the regions of an array.
struct Outlines {
    Loops loops;                                   // in taxels
    std::vector<double> points;                    // (M, 3) m, of the loops
    std::vector<std::int32_t> label;               // of each loop: the taxels at its inner side
    std::vector<std::array<double, 6>> integrals;  // of 1, x, y, xx, xy, yy within each loop, m; negative for holes
};

// Outlines where score (rows, columns) exceeds level; labels: (rows, columns) of the taxels there; pitch: m.
Outlines outlines_of(const float* score, const std::int32_t* labels, std::ptrdiff_t rows, std::ptrdiff_t columns, double level,
                     double pitch);

}  // namespace tactile::taxel
