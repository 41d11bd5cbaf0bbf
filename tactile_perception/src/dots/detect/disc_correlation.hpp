// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace tactile {

// Grey levels as fractions, in row-major order.
struct FloatImage {
    const float* pixels;
    std::ptrdiff_t rows, columns;
};

// A disc, and disc and ring together: shares of pixels ((half + 1)^2), at distances down and across from the centre, falling outwards.
struct DiscTemplate {
    std::ptrdiff_t half;
    const float *inside, *support;
};

// Which peaks of the correlation are discs; lengths in px.
struct DiscPeakRules {
    double least;          // correlation
    std::ptrdiff_t apart;  // to the nearest higher pixel
    double margin;         // to the border
    double radius;         // at which, along any axis, the correlation has fallen
    double line;           // share of the peak's correlation that is left there at most: streaks of light keep more
};

struct DiscPeak {
    std::ptrdiff_t column, row;
    float correlation, amplitude;  // amplitude: grey levels of disc over ring
};

// Peaks of the normalised correlation of an image with bright discs.
std::vector<DiscPeak> find_disc_peaks(const FloatImage& image, const DiscTemplate& disc, const DiscPeakRules& rules);

}  // namespace tactile
