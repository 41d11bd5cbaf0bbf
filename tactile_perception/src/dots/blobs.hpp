// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/fields.hpp"
#include "dots/finder.hpp"
#include "dots/image.hpp"

namespace tactile {

// What decides which regions are markers, each with its unit and what it is.
struct BlobLimits {
    double min_area = 0.2, max_area = 5;                // 1, limit: of the typical area, smallest and largest region that is a marker
    double min_solidity = 0.975, max_solidity = 1.05;   // 1, limit: of one whole marker; others are partly hidden or touch another
    double min_small_solidity = 0.8, max_small_solidity = 1.25;  // 1, limit: the same of small markers, whose pixels are coarse
    double faint = 0.15;                                // 1, limit: of the typical amplitude, smallest of a marker
};

// Markers of a sensor. sign: 1 for bright ones, -1 for dark; step: by which the image is reduced for the search, 1 or 2; box: px of that
// image, an odd side of the square of the local mean; threshold: grey levels over it; area: of a marker, px of that image.
struct BlobLook {
    int sign = 1, step = 1, box = 1;
    double threshold = 0, area = 1;
    TACTILE_FIELDS(sign, step, box, threshold, area)
};

// Finds large markers: regions over the local mean, then moments of weights that rise from ground to plateau on a marker's edge.
class BlobFinder {
 public:
    explicit BlobFinder(const BlobLook& look) : look_(look) {}
    // In an image of 4 x 4 px and more. If it is reduced, an odd last row or column is left out.
    FoundDots find(const Image& image) const;

 private:
    BlobLook look_;
};

}  // namespace tactile
