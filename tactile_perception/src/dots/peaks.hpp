// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dots/disc.hpp"
#include "dots/image.hpp"

namespace tactile {

// Candidates for dots: positions u, v, u, v, ..., px, of peaks of the smoothed image above the mean of a square around each. The fit
// rejects those that are no dots.
std::vector<double> find_peaks(const Image& image, const DotLook& look);

}  // namespace tactile
