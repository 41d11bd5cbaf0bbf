// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The rigid motion of points, and that which most of them share.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace tactile {

// after = rotation before + translation, row by row, m. The second singular value of the sum of products of coordinates, m^2, and the
// third, negative where after is a mirror image of before.
struct RigidMotion {
    std::array<double, 9> rotation;
    std::array<double, 3> translation;
    double second, third;
};

// Least squares over points before and after (count, 3), m, with weights (count).
RigidMotion rigid_motion(const double* before, const double* after, const double* weights, std::ptrdiff_t count);

// Weights (count) of points before (count, 3) and after (count, 3), m, in the motion that most of them share; 0 for those that do not share
// it. base (count): 1 / variance of a coordinate of after - before, m^-2; steps: most rounds of reweighting.
std::vector<double> rigid_inliers(const double* before, const double* after, const double* base, std::ptrdiff_t count, int steps);

}  // namespace tactile
