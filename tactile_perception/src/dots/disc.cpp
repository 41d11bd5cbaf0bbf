// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/disc.hpp"

#include <algorithm>
#include <cmath>

#include "common/wide.hpp"

namespace tactile {
namespace {

// Maximum-likelihood fit of one blurred disc to a compressed patch. At each node of the model, the weighted least-squares estimate of the
// differences from the node is a matrix applied to the patch.

constexpr double MAX_STEP = 0.7, MAX_DIAMETER_STEP = 1.5;  // px, longest step of a position and of the diameter
constexpr double MIN_AMPLITUDE = 1e-12;                    // grey levels, prevents division by zero

// The whole number nearest to a coordinate, from low to high; low for NaN.
int nearest(double coordinate, int low, int high) {
    if (!(coordinate > low)) return low;
    return coordinate < high ? low + static_cast<int>(coordinate - low + 0.5) : high;
}

// A patch mirrored into the quadrant where across and down are positive, and the node's tables there.
class Quadrant {
 public:
    Quadrant(const float* patch, const DiscNode& node, const DiscModel& model)
        : along_u(node.across < 0 ? -1 : 1), along_v(node.down < 0 ? -1 : 1) {
        const float signs[SECTORS] = {1, along_u, along_v, along_u * along_v};
        std::ptrdiff_t at = 0;
        for (std::ptrdiff_t s = 0; s < SECTORS; ++s) {
            for (const std::ptrdiff_t end = at + SECTOR_SIZES[s]; at < end; ++at) values[at] = signs[s] * patch[at];
        }
        index = (node.size * model.phases + std::abs(node.down)) * model.phases + std::abs(node.across);
    }
    // Product of the patch with a row of a table.
    double times(const float* row) const { return product(values, row, DIMENSIONS); }
    float values[DIMENSIONS];
    const float along_u, along_v;
    std::ptrdiff_t index;  // of the node
};

}  // namespace

DiscPatch::DiscPatch(const DiscModel& model)
    : model_(model), half_(model.half), side_(2 * half_ + 1), stride_((side_ + LANES - 1) / LANES * LANES), values_(side_ * stride_) {}

TACTILE_WIDE void DiscPatch::cut(const Image& image, std::ptrdiff_t column, std::ptrdiff_t row, int level) {
    const std::ptrdiff_t left = column - half_;
    const bool is_inside = left >= 0 && left + stride_ <= image.columns;
    for (std::ptrdiff_t r = 0; r < side_; ++r) {
        const std::uint8_t* pixels = image.pixels + std::clamp<std::ptrdiff_t>(row - half_ + r, 0, image.rows - 1) * image.columns;
        float* out = values_.data() + r * stride_;
        if (is_inside) {
            for (std::ptrdiff_t c = 0; c < stride_; c += LANES)
                for (std::ptrdiff_t k = 0; k < LANES; ++k) out[c + k] = static_cast<float>(pixels[left + c + k] - level);
        } else {
            for (std::ptrdiff_t c = 0; c < side_; ++c)
                out[c] = static_cast<float>(pixels[std::clamp<std::ptrdiff_t>(left + c, 0, image.columns - 1)] - level);
        }
    }
}

TACTILE_WIDE void DiscPatch::subtract(double u, double v, double diameter, double amplitude) {
    const double per_diameter = static_cast<double>(model_.profiles - 1) / (model_.largest - model_.smallest);
    const double at = std::clamp((diameter - model_.smallest) * per_diameter + 0.5, 0.0, static_cast<double>(model_.profiles - 1));
    const float* profile = model_.profile.data() + static_cast<std::ptrdiff_t>(at) * model_.profile_length;
    const double reach = std::sqrt(static_cast<double>(model_.profile_length - 1) / model_.per_square);
    const auto within = [&](double coordinate) {
        return static_cast<std::ptrdiff_t>(std::clamp(coordinate, 0.0, static_cast<double>(side_)));
    };
    const auto across = static_cast<double>(half_) + u, down = static_cast<double>(half_) + v;  // from the patch's corner
    const std::ptrdiff_t first = within(across - reach), last = within(across + reach + 1), outermost = model_.profile_length - 1;
    const auto strength = static_cast<float>(amplitude), density = static_cast<float>(model_.per_square),
               middle = static_cast<float>(across);
    for (std::ptrdiff_t r = within(down - reach); r < within(down + reach + 1); ++r) {
        const auto below = static_cast<float>(static_cast<double>(r) - down);
        const float square = below * below * density + 0.5f;
        float* out = values_.data() + r * stride_;
        for (std::ptrdiff_t c = first; c < last; ++c) {
            const float beside = static_cast<float>(c) - middle;
            out[c] -= strength * profile[std::min(static_cast<std::ptrdiff_t>(beside * beside * density + square), outermost)];
        }
    }
}

TACTILE_WIDE void DiscPatch::compress(float* out) const {
    typedef float Part __attribute__((vector_size(8 * sizeof(float))));
    constexpr std::ptrdiff_t PARTS = DIMENSIONS / 8, SECTOR_OF_PART[PARTS][2] = {{0, 0}, {0, 1}, {1, 2}, {2, 3}};  // of the halves of a part
    Part sums[PARTS] = {};
    const float* basis = model_.basis.data();
    float folded[SECTORS][LARGEST_HALF + 1];
    for (std::ptrdiff_t r = 0; r <= half_; ++r) {
        const float *up = middle_of(half_ - r), *down = middle_of(half_ + r);
        for (std::ptrdiff_t c = 0; c <= half_; ++c) {
            const float even = down[c] + up[c], odd = down[c] - up[c], even_left = down[-c] + up[-c], odd_left = down[-c] - up[-c];
            folded[0][c] = even + even_left, folded[1][c] = even - even_left;
            folded[2][c] = odd + odd_left, folded[3][c] = odd - odd_left;
        }
        for (std::ptrdiff_t c = 0; c <= half_; ++c, basis += DIMENSIONS) {
            for (std::ptrdiff_t k = 0; k < PARTS; ++k) {
                const float a = folded[SECTOR_OF_PART[k][0]][c], b = folded[SECTOR_OF_PART[k][1]][c];
                Part part;
                std::memcpy(&part, basis + 8 * k, sizeof part);
                sums[k] += Part{a, a, a, a, b, b, b, b} * part;
            }
        }
    }
    std::memcpy(out, sums, sizeof sums);
}

DiscNode nearest_node(const Disc& disc, const DiscModel& model) {
    const auto farthest = static_cast<int>(model.phases - 1), last = static_cast<int>(model.diameters - 1);
    const double per_diameter = last / (model.largest - model.smallest);
    return {nearest((disc.diameter - model.smallest) * per_diameter, 0, last), nearest(disc.v * farthest, -farthest, farthest),
            nearest(disc.u * farthest, -farthest, farthest)};
}

TACTILE_WIDE Disc estimate(const float* patch, const DiscNode& node, const DiscModel& model) {
    const Quadrant quadrant(patch, node, model);
    const float* rows = model.estimators.data() + quadrant.index * ESTIMATES * DIMENSIONS;
    double answer[ESTIMATES];
    for (std::ptrdiff_t k = 0; k < ESTIMATES; ++k) answer[k] = quadrant.times(rows + k * DIMENSIONS);
    const double inverse = 1 / (answer[3] + MIN_AMPLITUDE), phase = 1 / static_cast<double>(model.phases - 1);
    const double spacing = (model.largest - model.smallest) / static_cast<double>(model.diameters - 1);
    return {node.across * phase + quadrant.along_u * std::clamp(answer[0] * inverse, -MAX_STEP, MAX_STEP),
            node.down * phase + quadrant.along_v * std::clamp(answer[1] * inverse, -MAX_STEP, MAX_STEP),
            model.smallest + node.size * spacing + std::clamp(answer[2] * inverse, -MAX_DIAMETER_STEP, MAX_DIAMETER_STEP), answer[3],
            answer[4]};
}

Disc fit_disc(const float* patch, Disc start, int steps, const DiscModel& model, DiscNode& node) {
    node = nearest_node(start, model);
    Disc disc = estimate(patch, node, model);
    for (int step = 1; step < steps; ++step) {
        const DiscNode next = nearest_node(disc, model);
        if (next == node) break;  // at the same node, a step repeats the last one
        node = next;
        disc = estimate(patch, node, model);
    }
    return disc;
}

TACTILE_WIDE double residual_variance(const float* patch, const DiscNode& node, const DiscModel& model) {
    const Quadrant quadrant(patch, node, model);
    double residual = quadrant.times(quadrant.values);
    for (std::ptrdiff_t mode = 0; mode < MODES; ++mode) {
        const double part = quadrant.times(model.modes.data() + (quadrant.index * MODES + mode) * DIMENSIONS);
        residual -= part * part;
    }
    return std::max(residual, 0.0) / static_cast<double>(DIMENSIONS - MODES);
}

}  // namespace tactile
