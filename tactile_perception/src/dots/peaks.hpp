// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dots/image.hpp"

namespace tactile {

// Parameters of the search for peaks.
struct PeakSearch {
    int step;      // 1, or 2 to average blocks of two by two pixels first
    int smooth;    // odd, pixels after averaging: side of the Gaussian filter
    int box;       // odd, pixels after averaging: side of the square whose mean is the local background
    int sign;      // 1: dots are brighter than their background, -1: darker
    float lowest;  // grey levels: smallest contrast of a peak to its background
};

// Positions of peaks, px of the image, as u, v, u, v, ... Peaks in the outermost pixels are omitted.
std::vector<double> find_peaks(const Image& image, const PeakSearch& search);

}  // namespace tactile
