// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dots/image.hpp"

namespace tactile {

// Colour of the background around each of N dots; NaN where it cannot be read.
struct RingColours {
    std::vector<double> ratios;       // N x 2: ln(blue / red), ln(green / red)
    std::vector<double> brightness;   // N: ln(red), red in grey levels
    std::vector<std::int64_t> count;  // N: ring points used, of 16
    std::vector<double> patchiness;   // N: relative variance of blue / red around the ring without its mean and first harmonic
};

// The colours on rings of the given radius, px, around N dots at u, v, u, v, ... px.
RingColours ring_colours(const ColourImage& image, const double* places, std::ptrdiff_t count, double radius);

}  // namespace tactile
