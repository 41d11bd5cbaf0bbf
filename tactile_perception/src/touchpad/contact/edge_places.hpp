// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Where, between a touched dot and a free one beside it, a contact ends, from the loads on both.
#pragma once

#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// Scores (K), above 0.5 where score (K) is, of all dots: beside an edge the mean of score and of what the dot's distance from the edge
// says. load (K): over the fluid's pressure.
std::vector<double> place_edges(Grid grid, const double* score, const double* load);

}  // namespace tactile
