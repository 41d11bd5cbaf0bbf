// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "dots/finder.hpp"
#include "dots/image.hpp"

namespace tactile {

// Centroids of dots of any shape near places (count, 2), px, of discs of about that diameter, px. sign: 1 for bright dots, -1 for dark
// ones; noise: standard deviation of a pixel, grey levels. Dots that are less solid than most, as those that something hides in part, are
// left out.
std::vector<Dot> place_dots(const Image& image, int sign, const double* places, std::ptrdiff_t count, double diameter, double noise);

}  // namespace tactile
