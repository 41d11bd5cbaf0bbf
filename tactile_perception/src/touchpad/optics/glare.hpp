// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "touchpad/optics/light_path.hpp"

namespace tactile {

// The light on a skin, dot by dot of a grid.
struct SkinLight {
    std::vector<double> irradiance, lengths;  // in units of the lamps' power; m, in the water
};

// The light on a skin through rows x columns places (N x 3), m; at the grid's border its normals are border_normals (N x 3).
SkinLight skin_light(const LightPath& path, const double* places, const double* border_normals, std::ptrdiff_t rows,
                     std::ptrdiff_t columns);

// The colour of the water: the ratios blue/red and green/red are exp(constant - absorption * length), their logarithms have covariance
// noise.
struct WaterColour {
    double constants[2], absorptions[2], noise[4];
};

// What is measured at N dots: log ratios (N x 2), points of the ring used (N, of 16), patchiness (N), excess (N): ln of the red light over
// the light expected without glare, and its standard deviation excess_sigma (N), NaN where unknown.
struct DotColours {
    const double* ratios;
    const std::int64_t* count;
    const double *patchiness, *excess, *excess_sigma;
    const double* colour;  // (N x 2) blue/red and green/red of glare over those of the scattered light
    std::ptrdiff_t dots;
};

// Glare: light that the skin mirrors. Its share is its red light over the scattered red light.
struct Glare {
    double probability;  // of a dot to have glare, before it is measured
    double size;         // standard deviation of the shares
};

// Path lengths (N) and their standard deviations (N), m. Dots whose excess or colour is unknown are taken to have no glare.
struct WaterLengths {
    std::vector<double> lengths, sigma;
};

WaterLengths water_lengths(const WaterColour& water, const Glare& glare, const DotColours& seen);

}  // namespace tactile
