// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// How surely each dot of a grid is in contact, from the loads on the dots and the shape of the surface.
#pragma once

#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// Score (K) of each dot, from 0, free, to 1, well inside; above 0.5 it is in contact. load (K): over the fluid's pressure; places (K, 3),
// m; normals (K, 3); pitch: of the dots, m.
std::vector<double> contact_score(Grid grid, const double* load, const double* places, const double* normals, double pitch);

// Sets the scores (K) of isolated dots above 0.5 to 0.5, unless they carry a large load (K), or the largest of all as in a light touch, and
// all around them a large net load: an error of one range adds no load in all.
void drop_single_dots(Grid grid, const double* load, std::vector<double>& score);

}  // namespace tactile
