// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Labels of regions of an image, each region grown by a pixel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// Labels (rows x columns), 0 ground, with each region grown by a pixel in all eight directions, except where two would meet: 0 there.
std::vector<std::uint16_t> grown_labels(const std::uint16_t* labels, std::ptrdiff_t rows, std::ptrdiff_t columns);

}  // namespace tactile
