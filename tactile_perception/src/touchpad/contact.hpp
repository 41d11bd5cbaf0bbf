// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Scores of dots by their distance from the border of a contact.
#pragma once

#include <cstddef>
#include <vector>

#include "common/fields.hpp"
#include "touchpad/membrane.hpp"

namespace tactile {

/// A network of two hidden layers (rectified linear units) that estimates a dot's distance from the border, in pitches. The weights have a
/// row for each input.
struct BorderNetwork {
    static constexpr std::ptrdiff_t RADIUS = 2, SIDE = 2 * RADIUS + 1, NEIGHBOURS = SIDE * SIDE;  // dots around each one that are inputs
    static constexpr std::ptrdiff_t MAPS = 2, INPUTS = MAPS * NEIGHBOURS + 1;  // loads and bends; and the spread of all loads
    static constexpr std::ptrdiff_t FIRST = 48, SECOND = 16;                   // units of the hidden layers
    std::vector<float> weights_1, biases_1, weights_2, biases_2, weights_3;
    float bias_3 = 0;
    TACTILE_FIELDS(weights_1, biases_1, weights_2, biases_2, weights_3, bias_3)
};

/// Scores (K) of the dots: half of a dot's distance from the border, in pitches, plus 1/2. It is 0 from a pitch outside on, 1 from a pitch
/// inside on, and 0 where no adjacent dot carries a load. pitch: of the dots, m.
std::vector<double> border_scores(const BorderNetwork& network, Grid grid, const DotLoads& loads, double pitch);

// Steps from the nearest loaded dot up to which forces count in full, and from which they do not count. The weight falls linearly between,
// which is less noisy than a sharp border. On simulated faces, rings, balls and edges the force errors are 2.7 to 2.9 % for all values
// between 2 to 3 and 4 to 6, and 7.0 % with the neighbouring dots alone; under glare 8.5 to 9.6 % and 12.8 %.
constexpr int FULL_WEIGHT_STEPS = 2, ZERO_WEIGHT_STEPS = 6;

// Forces (K, 3), N, of an object on the dots with a load and, with a weight, on those around: range errors beside an edge move load between
// the dots at the edge and the free dots around it, but hardly change the sum. wrench: N and N m, at the origin.
struct ContactForces {
    std::vector<double> force, wrench;
    TACTILE_FIELDS(force, wrench)
};

ContactForces contact_forces(const DotLoads& loads, Grid grid);

}  // namespace tactile
