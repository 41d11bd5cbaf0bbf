// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace tactile {

// Place and velocity at the last of some times, by a straight line through the latest places.
struct SteadyMotion {
    std::array<double, 3> place{}, velocity{};
    double sigma = 0;         // standard deviation of each velocity
    std::ptrdiff_t used = 0;  // places of the line
};

// The motion along places (count, 3) at rising times (count,), with noise of standard deviation sigma; bound: standard deviations.
SteadyMotion steady_motion(const double* times, const double* places, std::ptrdiff_t count, double sigma, double bound);

// Standard deviation of the first two coordinates of places (count, 3), by the median length of their second differences, in which steady
// motion has no part; without the last one, in which a motion may begin.
double noise_of_places(const double* places, std::ptrdiff_t count);

}  // namespace tactile
