// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Dots of an image: a maximum-likelihood fit of each candidate, and rejection of fits that are not dots.
#pragma once

#include <memory>
#include <vector>

#include "dots/disc.hpp"
#include "dots/image.hpp"

namespace tactile {

// px of the whole image, px^2; sigma: standard deviation of a position along an axis.
struct Dot {
    double u, v, area, sigma;
};

struct FoundDots {
    std::vector<Dot> dots;
    bool outgrown;  // whether some are larger than the model's largest disc, and therefore left out
};

// Finds dots with contrast and size of the look and shape of a disc, wholly inside the image, their positions corrected for sloping light.
// The first image tells how much dots differ from discs. Results are in px of the image before it was reduced.
class DotFinder {
 public:
    DotFinder(std::shared_ptr<const DiscModel> model, const DotLook& look);
    // candidates: rough positions, px, as u, v, u, v, ...; those that are not finite are left out.
    FoundDots find(const Image& image, const std::vector<double>& candidates);

 private:
    std::shared_ptr<const DiscModel> model_;
    DotLook look_;
    double usual_;  // median ratio of residual to contrast in the first image, NaN before it
};

}  // namespace tactile
