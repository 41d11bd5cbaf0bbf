// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Where the border of a contact is.
#pragma once

#include <cstddef>
#include <vector>

#include "touchpad/membrane.hpp"

namespace tactile {

// A network of two hidden layers (rectified linear units) that tells a dot's distance from the border, pitches. Weights: a row for each
// number that is fed in.
struct BorderNetwork {
    static constexpr std::ptrdiff_t REACH = 2, SIDE = 2 * REACH + 1, NEXT = SIDE * SIDE;  // dots, of what is fed in around each
    static constexpr std::ptrdiff_t KINDS = 2, FED = KINDS * NEXT + 1;                    // loads and bends; and the spread of all loads
    static constexpr std::ptrdiff_t FIRST = 48, SECOND = 16;                              // units of the hidden layers
    std::vector<float> weights_1, biases_1, weights_2, biases_2, weights_3;
    float bias_3 = 0;
};

// Scores (K) of the dots: half a dot's distance from the border, pitches, plus 1/2, between 0, a pitch outside, and 1, a pitch inside; 0
// where no dot next to it carries a load. pitch: of the dots, m.
std::vector<double> border_scores(const BorderNetwork& network, Grid grid, const DotLoads& loads, double pitch);

}  // namespace tactile
