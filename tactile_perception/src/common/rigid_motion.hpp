// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The rigid motion of points, and that which most of them share.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace tactile {

// Why points leave a motion open: less than three have a weight; those before or after the motion are at one place, or on a line; or those
// after are a mirror image of those before.
enum class Undetermined { NO, TOO_FEW, BEFORE_AT_ONE_PLACE, AFTER_AT_ONE_PLACE, BEFORE_ON_A_LINE, AFTER_ON_A_LINE, REFLECTION };

// after = rotation before + translation, row by row, m. residuals (count, 3), m: after less its prediction; weights (count): as used.
struct RigidMotion {
    std::array<double, 9> rotation;
    std::array<double, 3> translation;
    std::vector<double> residuals, weights;
    Undetermined open;
};

// Least squares over points before and after (count, 3), m, with weights (count). With steps, most rounds of reweighting, it is the motion
// that most points share; the others get the weight 0, and weights are 1 / variance of a coordinate of after - before, m^-2.
RigidMotion rigid_motion(const double* before, const double* after, const double* weights, std::ptrdiff_t count, int steps);

}  // namespace tactile
