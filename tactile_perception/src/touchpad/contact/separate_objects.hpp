// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Dots of each separate object that touches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/vectors.hpp"
#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// Numbers of dots.
using Dots = std::vector<std::ptrdiff_t>;

// Dots of each separate object, the largest first: touched dots (K) with up to one free dot between them belong together.
std::vector<Dots> separate_objects(Grid grid, const std::vector<std::uint8_t>& touched);

// Rows (N, 3) of an array (K, 3): those of the dots.
std::vector<double> gathered(const double* array, const Dots& dots);

// Mean of the places (K, 3) of an object's dots and of those beside them, weighted by their scores (K); NaN where these are 0.
Vec3 region_centre(Grid grid, const Dots& dots, const double* score, const double* places);

}  // namespace tactile
