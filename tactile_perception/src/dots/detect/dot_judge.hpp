// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dots/detect/dot_fits.hpp"

namespace tactile {

// An accepted dot, px of the image and px^2.
struct Dot {
    double u, v, area, sigma;  // sigma: standard deviation of a position along an axis
};

struct JudgedDots {
    std::vector<Dot> dots;
    bool outgrown;  // whether some are larger than the model's largest disc, and therefore left out
    double usual;   // median ratio of residual to contrast when the appearance was measured; NaN if unknown
};

// The fits with contrast and size of a dot and shape of a disc, wholly inside the image, their positions corrected for sloping light.
// usual: as in JudgedDots, NaN on the first image after the appearance was measured.
JudgedDots judge_dots(const Image& image, const std::vector<DotFit>& fits, const DiscModel& model, const DotLook& look, double usual);

}  // namespace tactile
