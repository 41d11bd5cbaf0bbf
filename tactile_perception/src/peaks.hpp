// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "image.hpp"

namespace tactile {

// Where dots may be: how an image is looked at.
struct PeakSearch {
    int step;      // 1, or 2: two by two pixels are averaged into one first
    int smooth;    // pixels after that, odd: side of the Gaussian that takes the noise off
    int box;       // the same of the square whose mean is the local ground
    int sign;      // 1: dots are brighter than their ground, -1: darker
    float lowest;  // grey levels: what stands out less from its ground is no peak
};

// Columns and rows of peaks, px of the image, one after the other: u, v, u, v, ... Peaks at the border are left out.
std::vector<double> find_peaks(const Image& image, const PeakSearch& search);

}  // namespace tactile
