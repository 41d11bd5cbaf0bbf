// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Dots of an image: a maximum-likelihood fit of each candidate, and rejection of fits that are not dots.
#pragma once

#include <memory>
#include <vector>

#include "common/fields.hpp"
#include "dots/disc.hpp"
#include "dots/image.hpp"

namespace tactile {

// px of the whole image, px^2; sigma: standard deviation of a position along an axis.
struct Dot {
    double u, v, area, sigma;
};

// uv and candidates, the peaks that were fitted: u, v, u, v, ...; the others a number each.
struct FoundDots {
    std::vector<double> uv, area, sigma, candidates;
    bool outgrown = false;  // whether some are larger than the model's largest disc, and therefore left out
    TACTILE_FIELDS(uv, area, sigma, candidates, outgrown)

    void add(const Dot& dot) { uv.insert(uv.end(), {dot.u, dot.v}), area.push_back(dot.area), sigma.push_back(dot.sigma); }
};

// All that decides what is a dot. What each is and how it was found: docs/constants.md.
struct DotLimits {
    double same = 0.4;      // of the typical diameter: nearer candidates belong to one dot
    double met = 0.15;      // of the typical diameter: fits that converge to within this distance belong to one dot
    double farthest = 1.4;  // px from the middle of the patch: the model's nodes end at 1 px, a fit further away has diverged
    double faintest = 0.2;  // of the typical contrast
    double noise = 4.0;     // residual, in standard deviations of a pixel, that any dot may have
    double plain = 0.12;    // and as a share of its contrast
    double usual = 2.5;     // times the median ratio of residual to contrast
    double unlikest = 0.3;  // and its bound
    TACTILE_FIELDS(same, met, farthest, faintest, noise, plain, usual, unlikest)
};

// Finds dots with contrast and size of the look and shape of a disc, wholly inside the image, their positions corrected for sloping light.
// Results are in px of the image before it was reduced.
class DotFinder {
 public:
    DotFinder(std::shared_ptr<const DiscModel> model, const DotLook& look, const DotLimits& limits = {});
    FoundDots find(const Image& image) const;

 private:
    std::shared_ptr<const DiscModel> model_;
    DotLook look_;
    DotLimits limits_;
};

}  // namespace tactile
