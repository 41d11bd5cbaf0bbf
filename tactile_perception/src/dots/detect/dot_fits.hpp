// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dots/detect/disc_fit.hpp"
#include "dots/detect/disc_model.hpp"
#include "dots/detect/image.hpp"

namespace tactile {

// A candidate and its fit.
struct DotFit {
    double start_u, start_v;     // px, of the candidate
    std::ptrdiff_t column, row;  // middle pixel of its patch
    Disc disc;                   // relative to that pixel; its ground relative to the look's
    DiscNode node;               // of the last step
    bool single = true;          // false: a second fit of another's dot
    double variance = 0;         // of the residual, grey levels^2
    float patch[DIMENSIONS];     // compressed

    double u() const { return static_cast<double>(column) + disc.u; }
    double v() const { return static_cast<double>(row) + disc.v; }
    double away() const;  // px from the middle pixel: the larger of both axes
};

// Fits of dots near places (count, 2), px; where dots overlap or are close, each without its neighbours' images. Places that are not finite
// or show no dot are left out.
std::vector<DotFit> fit_dots(const Image& image, const double* places, std::ptrdiff_t count, const DiscModel& model, const DotLook& look);

}  // namespace tactile
