// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/fields.hpp"
#include "dots/image.hpp"

namespace tactile {

// A region of a small image, px of it: box, centre, and its number among the labels.
struct BlobRegion {
    std::ptrdiff_t left, top, width, height;
    double u, v;
    std::uint16_t label;
};

// A marker: position, px, area, px^2, standard deviation of u and of v, px, grey levels over the ground, and area over that of the ellipse
// with the same second moments.
struct Blob {
    double u, v, area, sigma, amplitude, solidity;
};

struct Blobs {
    std::vector<Blob> blobs;
    double blur;  // px, standard deviation of the edges' blur; NaN without a marker
    TACTILE_FIELDS(blur)
};

// Markers of an image that was reduced by step (1 or 2) to a small one, whose pixels have labels, the regions grown by a pixel. A
// box, without that pixel, is inside the small image by a pixel or more.
Blobs fit_blobs(const Image& image, const Image& small, int step, const std::uint16_t* labels, const std::vector<BlobRegion>& regions);

}  // namespace tactile
