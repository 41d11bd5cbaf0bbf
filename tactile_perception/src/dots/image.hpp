// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// Grey levels in row-major order. The centre of pixel (0, 0) is at u = v = 0.
struct Image {
    const std::uint8_t* pixels;
    std::ptrdiff_t rows, columns;
};

// Pixels of three bytes each, blue, green, red, in row-major order.
struct ColourImage {
    const std::uint8_t* pixels;
    std::ptrdiff_t rows, columns;
};

// One channel of an image, 0 to 2.
std::vector<std::uint8_t> extract_channel(const ColourImage& image, int channel);

}  // namespace tactile
