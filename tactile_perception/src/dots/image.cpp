// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/image.hpp"

#include "common/wide.hpp"

namespace tactile {

TACTILE_WIDE std::vector<std::uint8_t> extract_channel(const ColourImage& image, int channel) {
    std::vector<std::uint8_t> found(image.rows * image.columns);
    const std::uint8_t* from = image.pixels + channel;
    std::uint8_t* out = found.data();
    for (std::ptrdiff_t k = 0; k < image.rows * image.columns; ++k) out[k] = from[3 * k];
    return found;
}

}  // namespace tactile
