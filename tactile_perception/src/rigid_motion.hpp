// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The rigid motion that most of some points share.
#pragma once

#include <cstddef>
#include <vector>

namespace tactile {

// Weights (count) of points before (count, 3) and after (count, 3), m, in the motion that most of them share; 0 for those that do not share
// it. base (count): 1 / variance of a coordinate of after - before, m^-2; steps: most rounds of reweighting.
std::vector<double> rigid_inliers(const double* before, const double* after, const double* base, std::ptrdiff_t count, int steps);

}  // namespace tactile
