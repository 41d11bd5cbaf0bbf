// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace tactile {

// Grey levels, row after row. Pixel (0, 0) has its centre at u = v = 0.
struct Image {
    const std::uint8_t* pixels;
    std::ptrdiff_t rows, columns;
};

}  // namespace tactile
