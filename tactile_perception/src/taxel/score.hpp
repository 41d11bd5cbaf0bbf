// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

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

}  // namespace tactile::taxel
