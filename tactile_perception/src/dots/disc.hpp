// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// One blurred disc: tables of its model, patches of an image, and its maximum-likelihood fit to a patch.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "common/fields.hpp"
#include "common/wide.hpp"
#include "dots/image.hpp"

namespace tactile {

constexpr std::ptrdiff_t DIMENSIONS = 32;  // of a compressed patch
constexpr std::ptrdiff_t ESTIMATES = 5;    // amplitude times du, dv and ddiameter; amplitude; ground
constexpr std::ptrdiff_t MODES = 10;       // of a dot's image that the residual excludes
constexpr std::ptrdiff_t SECTORS = 4;      // parities of a patch: even or odd along u and along v
// Number of dimensions of each sector: even, odd along u, odd along v, odd along both.
constexpr std::ptrdiff_t SECTOR_SIZES[SECTORS] = {12, 8, 8, 4};

constexpr std::ptrdiff_t LARGEST_HALF = 30;  // px: bounds the memory
constexpr std::ptrdiff_t LANES = 8;          // sums side by side, which an instruction adds at once, in a fixed order

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

// Tables of a blurred disc in square patches with sides of 2 half + 1 px (fit.py makes them). The nodes of linearisation
// are diameters and distances of the centre from the patch's middle pixel, 0 to 1 px down and across; other quadrants mirror them.
struct DiscModel {
    std::ptrdiff_t half;
    double smallest, largest;          // px, of the nodes' diameters
    double blur;                       // px, standard deviation
    std::ptrdiff_t diameters, phases;  // number of nodes: diameters, distances
    std::vector<float> basis;          // ((half + 1)^2, DIMENSIONS), see DiscPatch::compress
    std::vector<float> estimators;     // (diameters, phases, phases, ESTIMATES, DIMENSIONS)
    std::vector<float> modes;          // (diameters, phases, phases, MODES, DIMENSIONS), orthonormal
    std::vector<double> gains;         // (diameters, phases, phases): px^2, variance of a position at unit contrast and pixel noise
    std::vector<double> levers;        // (diameters, 2): px^2, shift by a slope of the ground and of the dot
    std::ptrdiff_t profiles, profile_length;
    double per_square;           // entries of a profile per px^2 of squared radius
    std::vector<float> profile;  // (profiles, profile_length): image of unit brightness, of diameters smallest to largest
    TACTILE_FIELDS(half, smallest, largest, blur, estimators, basis, modes, gains, levers, profile, per_square)
};

// Typical dots of an image; px and grey levels.
struct DotLook {
    double typical;   // px, diameter
    double contrast;  // dot minus ground, signed
    int ground;       // whole grey levels, 0 to 255
    double noise;
    int step;  // by which the image was reduced
};

// Pixels around a dot, and their projection onto the few dimensions that its fit needs.
class DiscPatch {
 public:
    explicit DiscPatch(const DiscModel& model);

    // Copies the pixels around (column, row), which is inside the image, minus a grey level; outside the image, the outermost pixels.
    void cut(const Image& image, std::ptrdiff_t column, std::ptrdiff_t row, int level);

    // Subtracts the image of a disc at (u, v), px from the middle pixel; diameter: px; amplitude: grey levels; all finite.
    void subtract(double u, double v, double diameter, double amplitude);

    // Writes the DIMENSIONS coefficients, grey levels. The basis consists of functions that are even or odd along each axis, so that the
    // patch is first folded to the sums and differences of mirrored pixels, a quarter of a patch for each of the four parities. The middle
    // row and column are added to themselves; the basis halves them.
    void compress(float* out) const;

 private:
    const float* middle_of(std::ptrdiff_t row) const { return values_.data() + row * stride_ + half_; }

    const DiscModel& model_;
    const std::ptrdiff_t half_, side_, stride_;  // stride: of a row, side_ rounded up to LANES
    std::vector<float> values_;
};

// A disc: centre, px from the patch's middle pixel; diameter, px; amplitude (disc minus ground) and ground, grey levels.
struct Disc {
    double u, v, diameter, amplitude, ground;
};

// A node of linearisation; across and down are negative in the mirrored quadrants.
struct DiscNode {
    int size, down, across;
    bool operator==(const DiscNode& other) const { return size == other.size && down == other.down && across == other.across; }
};

// The node nearest to a disc; its numbers may be NaN.
DiscNode nearest_node(const Disc& disc, const DiscModel& model);

// One Gauss-Newton step: the weighted least-squares disc, linearised at the node, in a compressed patch (DIMENSIONS).
Disc estimate(const float* patch, const DiscNode& node, const DiscModel& model);

// Up to `steps` steps, fewer where the node stays; node: the one of the last step.
Disc fit_disc(const float* patch, Disc start, int steps, const DiscModel& model, DiscNode& node);

// Variance of the pixels, grey levels^2, not explained by the disc at this node, sloping ground, ellipticity and blur, none of which
// shifts positions.
double residual_variance(const float* patch, const DiscNode& node, const DiscModel& model);

}  // namespace tactile
