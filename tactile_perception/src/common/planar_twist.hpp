// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace tactile {

// A motion in the plane: velocity at the origin, angular velocity, centre of rotation. NaN: unknown; of a translation, the centre alone.
struct PlanarTwist {
    std::array<double, 2> linear;
    double turn;
    std::array<double, 2> centre;
};

// Least squares of velocity (count, 2) at place (count, 2). A centre farther than `far` radii of the places counts as a translation.
PlanarTwist planar_twist(const double* place, const double* velocity, std::ptrdiff_t count, double far);

}  // namespace tactile
