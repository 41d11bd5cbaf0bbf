// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Maximum-likelihood fit of one blurred disc to a compressed patch. At each node of the model, the weighted least-squares estimate of the
// differences from the node is a matrix applied to the patch.
#include "dots/detect/disc_fit.hpp"

#include <algorithm>
#include <cmath>

#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr double LONGEST = 0.7, LONGEST_DIAMETER = 1.5;  // px, longest step of a position and of the diameter. Chosen
constexpr double NOTHING = 1e-12;                        // grey levels, prevents division by zero

// The whole number nearest to a coordinate, from least to most; least for NaN.
int nearest(double place, int least, int most) {
    if (!(place > least)) return least;
    return place < most ? least + static_cast<int>(place - least + 0.5) : most;
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

DiscNode nearest_node(const Disc& disc, const DiscModel& model) {
    const auto farthest = static_cast<int>(model.phases - 1), last = static_cast<int>(model.diameters - 1);
    const double per_diameter = last / (model.largest - model.smallest);
    return {nearest((disc.diameter - model.smallest) * per_diameter, 0, last), nearest(disc.v * farthest, -farthest, farthest),
            nearest(disc.u * farthest, -farthest, farthest)};
}

TACTILE_WIDE Disc estimate(const float* patch, const DiscNode& node, const DiscModel& model) {
    const Quadrant quadrant(patch, node, model);
    const float* rows = model.estimators + quadrant.index * ESTIMATES * DIMENSIONS;
    double answer[ESTIMATES];
    for (std::ptrdiff_t k = 0; k < ESTIMATES; ++k) answer[k] = quadrant.times(rows + k * DIMENSIONS);
    const double inverse = 1 / (answer[3] + NOTHING), phase = 1 / static_cast<double>(model.phases - 1);
    const double spacing = (model.largest - model.smallest) / static_cast<double>(model.diameters - 1);
    return {node.across * phase + quadrant.along_u * std::clamp(answer[0] * inverse, -LONGEST, LONGEST),
            node.down * phase + quadrant.along_v * std::clamp(answer[1] * inverse, -LONGEST, LONGEST),
            model.smallest + node.size * spacing + std::clamp(answer[2] * inverse, -LONGEST_DIAMETER, LONGEST_DIAMETER), answer[3],
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
    double rest = quadrant.times(quadrant.values);
    for (std::ptrdiff_t mode = 0; mode < MODES; ++mode) {
        const double part = quadrant.times(model.modes + (quadrant.index * MODES + mode) * DIMENSIONS);
        rest -= part * part;
    }
    return std::max(rest, 0.0) / static_cast<double>(DIMENSIONS - MODES);
}

}  // namespace tactile
