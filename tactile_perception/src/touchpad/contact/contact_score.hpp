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

// Heights (N), m, along the mean normal, of points (N, 3), m, above a paraboloid fitted robustly to them. neighbours (N): number of other
// points of the patch beside each; points with many of them, and low points, weigh more. NaN where the fit is singular.
std::vector<double> heights_over_face(const std::vector<double>& points, const double* mean_normal, const std::vector<int>& neighbours);

}  // namespace tactile
