// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "touchpad/optics/light_path.hpp"

namespace tactile {

// N dots of a printed grid of rows x columns; without a grid (rows or columns below 3) the surface keeps its normals at rest.
struct SeenDots {
    const std::int64_t* id;      // N: row * columns + column, within the grid
    const double* rays;          // N x 3, unit, from the camera's centre
    const double* rest_ranges;   // N, m
    const double* rest_normals;  // N x 3, unit, outward
    std::ptrdiff_t count, rows, columns;
};

// Ranges of dots and how much longer the light's path gets with a longer range.
struct WaterRanges {
    std::vector<double> ranges, slopes;  // N, m; N
};

// Ranges at which the light's paths have the given lengths (N), m. A length is the mean over a ring around the dot; its radius over the
// dots' pitch is ring_share.
WaterRanges water_ranges(const LightPath& path, const SeenDots& dots, const double* lengths, double ring_share);

}  // namespace tactile
