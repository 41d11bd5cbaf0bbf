// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Dots whose score hardly decides follow the dots next to them: objects have smooth outlines.
#pragma once

#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// Scores (K): lower for a dot in contact (above 0.5) with at most one of the four next to it in contact, which sticks out of its region, if
// that is of more than a few dots; higher for a loaded dot without contact that has three or four, which dents it.
std::vector<double> smooth_edges(Grid grid, const double* score);

}  // namespace tactile
