// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dots/detect/disc_correlation.hpp"

namespace tactile {

// A fitted disc, px: centre, radius, and the standard deviation of the centre along an axis.
struct WornDisc {
    double u, v, radius, sigma;
};

// Robust fits of soft-edged bright discs on sloping ground, from places (count, 2), px, finite, of discs of about this radius, px. ring:
// outer radius of the window over that of the disc.
std::vector<WornDisc> fit_worn_discs(const FloatImage& image, const double* places, std::ptrdiff_t count, double radius, double ring);

}  // namespace tactile
