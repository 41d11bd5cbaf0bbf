// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "dots/detect/dot_fits.hpp"

namespace tactile {

// Slopes of the ground along u and v, shares of the ground per px; zero with fewer than four dots around.
struct GroundSlope {
    double along_u = 0, along_v = 0;
};

// The slope at each dot, from planes fitted to the grounds of the dots in blocks of three by three cells. grounds (dots), grey levels;
// used (dots): the dots that count; cell: px, about the dots' pitch.
std::vector<GroundSlope> ground_slopes(const std::vector<DotFit>& dots, const std::vector<double>& grounds,
                                       const std::vector<std::uint8_t>& used, double cell);

}  // namespace tactile
