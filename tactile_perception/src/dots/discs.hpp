// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Discs on a ring of ground, by correlation (Lewis, Fast normalized cross-correlation, 1995).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/fields.hpp"
#include "dots/image.hpp"

namespace tactile {

// Values in row-major order.
struct Plane {
    const float* values;
    std::ptrdiff_t rows, columns;
};

// Share of each pixel of a square of an odd side inside a disc, and inside the disc and its ring.
struct DiscShape {
    const float *disc, *both;
    std::ptrdiff_t side;
};

// A disc at a pixel: correlation, -1 to 1; amplitude: grey levels of disc over ring, negative for dark ones; ground: of the ring.
struct FoundDisc {
    std::ptrdiff_t column, row;
    double correlation, amplitude, ground;
};

// Whatever is at the pixels (column, row), which are inside the image.
std::vector<FoundDisc> correlate(const Plane& image, const std::int64_t* column, const std::int64_t* row, std::ptrdiff_t count,
                                 const DiscShape& shape);

// What decides which peaks are discs. sign: 1 for bright ones, -1 for dark; margin: px of the image's border without peaks; reach: px
// around a peak without a higher one; height: lowest of a peak in the relief; contrast: grey levels, and correlation that a disc exceeds;
// most: number of peaks, of the highest, that are looked at.
struct DiscSearch {
    int sign = 0;
    std::ptrdiff_t margin = 0, reach = 0;
    double height = 0, contrast = 0, correlation = 0;
    std::ptrdiff_t most = 0;
    TACTILE_FIELDS(sign, margin, reach, height, contrast, correlation, most)
};

// Discs at the peaks of a relief of the image.
std::vector<FoundDisc> find_discs(const Plane& image, const float* relief, const DiscShape& shape, const DiscSearch& search);

// Whether each of positions (count, 2) px has no better one, by score (count), nearer than the larger distance apart (count), px, of both;
// of equal scores the first is better.
std::vector<std::uint8_t> without_doubles(const double* positions, const double* score, const double* apart, std::ptrdiff_t count);

// A dot: centre, px, and area, px^2.
struct Centroid {
    double u, v, area;
};

// Dots near positions (count, 2) px, with these diameters (count), px, of this sign, as centroids of what is brighter than the ground
// around them, darker for sign -1.
std::vector<Centroid> centroids(const Image& image, int sign, const double* positions, const double* diameter, std::ptrdiff_t count);

}  // namespace tactile
