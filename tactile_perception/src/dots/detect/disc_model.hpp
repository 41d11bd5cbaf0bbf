// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "common/wide.hpp"

namespace tactile {

constexpr std::ptrdiff_t DIMENSIONS = 32;  // of a compressed patch
constexpr std::ptrdiff_t ESTIMATES = 5;    // amplitude times du, dv and ddiameter; amplitude; ground
constexpr std::ptrdiff_t MODES = 10;       // of a dot's image that the residual leaves out
constexpr std::ptrdiff_t SECTORS = 4;      // parities of a patch: even or odd along u and along v
// Number of dimensions of each sector: even, odd along u, odd along v, odd along both.
constexpr std::ptrdiff_t SECTOR_SIZES[SECTORS] = {12, 8, 8, 4};

constexpr int BASIS_UNITS = 32768;           // of the basis' whole numbers
constexpr std::ptrdiff_t LARGEST_HALF = 30;  // px. Derived: sums of products of patch and basis stay within 32 bits
constexpr std::ptrdiff_t LANES = 8;          // sums side by side, which an instruction adds at once, in a fixed order

// The least multiple of LANES that is not less than a count.
constexpr std::ptrdiff_t padded(std::ptrdiff_t count) {
    return (count + LANES - 1) / LANES * LANES;
}

// Sum of the products of two rows; count is a multiple of LANES.
TACTILE_INLINE float product(const float* a, const float* b, std::ptrdiff_t count) {
    typedef float Lanes __attribute__((vector_size(LANES * sizeof(float))));
    Lanes sums{}, left, right;
    for (std::ptrdiff_t k = 0; k < count; k += LANES) {
        std::memcpy(&left, a + k, sizeof left);
        std::memcpy(&right, b + k, sizeof right);
        sums += left * right;
    }
    return (sums[0] + sums[4]) + (sums[1] + sums[5]) + ((sums[2] + sums[6]) + (sums[3] + sums[7]));
}

// Tables of a blurred disc in square patches with sides of 2 half + 1 px (dots/detect/disc_model.py makes them). The nodes of linearisation
// are diameters and distances of the centre from the patch's middle pixel, 0 to 1 px down and across; other quadrants mirror them.
struct DiscModel {
    std::ptrdiff_t half;
    double smallest, largest;             // px, of the nodes' diameters
    double blur;                          // px, standard deviation
    std::ptrdiff_t diameters, phases;     // number of nodes: diameters, distances
    const std::int16_t* basis = nullptr;  // (DIMENSIONS, padded((half + 1)^2)), in BASIS_UNITS, see DiscPatch::compress
    const float* estimators = nullptr;    // (diameters, phases, phases, ESTIMATES, DIMENSIONS)
    const float* modes = nullptr;         // (diameters, phases, phases, MODES, DIMENSIONS), orthonormal
    const double* gains = nullptr;        // (diameters, phases, phases): px^2, variance of a position at unit contrast and pixel noise
    const double* levers = nullptr;       // (diameters, 2): px^2, shift by a slope of the ground and of the dot
    std::ptrdiff_t profiles = 0, profile_length = 0;
    double per_square = 0;           // entries of a profile per px^2 of squared radius
    const float* profile = nullptr;  // (profiles, profile_length): image of unit brightness, of diameters smallest to largest
};

// Typical dots of an image; px and grey levels.
struct DotLook {
    double typical;   // px, diameter
    double contrast;  // dot minus ground, signed
    int ground;       // whole grey levels, 0 to 255
    double noise;
};

}  // namespace tactile
