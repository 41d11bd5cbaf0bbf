// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// How far the dots beside a contact's border are from it, from their surroundings.
#pragma once

#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// Scores (K): half a dot's distance from the border, pitches, plus 1/2, between 0, a pitch outside, and 1, a pitch inside; 0 where score
// (K), of contact_score, says that no contact is near. load (K): over the fluid's pressure; places (K, 3), m; normals (K, 3); pitch, m.
std::vector<double> edge_distance(Grid grid, const double* score, const double* load, const double* places, const double* normals,
                                  double pitch);

}  // namespace tactile
