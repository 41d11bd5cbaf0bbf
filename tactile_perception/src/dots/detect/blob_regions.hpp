// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dots/detect/image.hpp"

namespace tactile {

// Which regions are markers: bounds of their area over the median area of those of more than speck px.
struct MarkerSizes {
    double least, most;
    std::int64_t speck;
};

// Connected regions (eight neighbours) of a mask. labels (rows x columns), 0 ground; of those that the border does not cut and that have a
// marker's size: box (N, 4) left, top, width, height; centre (N, 2), px; area (N), px; label (N). Regions beyond the number of labels are
// ground.
struct BlobRegions {
    std::vector<std::uint16_t> labels, label;
    std::vector<std::int32_t> box;
    std::vector<double> centre;
    std::vector<std::int64_t> area;
};

BlobRegions find_blob_regions(const Image& mask, const MarkerSizes& sizes);

}  // namespace tactile
