// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Velocity from the longest stretch of the past in which it was constant: lines are fitted to ever longer stretches, as long as the
// confidence intervals of their slopes have a point in common (Goldenshluger and Nemirovski 1997; Katkovnik 1999). A start, a stop or a
// reversal is seen within a few frames, and a slow motion is averaged over many.
#include "common/steady_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "common/median.hpp"

namespace tactile {

SteadyMotion steady_motion(const double* times, const double* places, std::ptrdiff_t count, double sigma, double bound) {
    constexpr double LARGEST = std::numeric_limits<double>::max();
    SteadyMotion found;
    if (count == 0) return found;
    const double* last = places + 3 * (count - 1);
    found = {{last[0], last[1], last[2]}, {}, LARGEST, 1};
    std::array<double, 3> least{-LARGEST, -LARGEST, -LARGEST}, most{LARGEST, LARGEST, LARGEST}, sum{}, moment{};
    double total = 0, square = 0;  // of the times before the last one
    for (std::ptrdiff_t n = 1; n <= count; ++n) {
        const double time = times[count - n] - times[count - 1];
        total += time;
        square += time * time;
        for (int axis = 0; axis < 3; ++axis) {
            const double off = places[3 * (count - n) + axis] - last[axis];
            sum[axis] += off;
            moment[axis] += time * off;
        }
        const double spread = square - total * total / static_cast<double>(n);
        if (!(spread > 0)) continue;
        const double slope_sigma = sigma / std::sqrt(spread);
        SteadyMotion line{{}, {}, slope_sigma, n};
        bool steady = true;
        for (int axis = 0; axis < 3; ++axis) {
            const double slope = (moment[axis] - total * sum[axis] / static_cast<double>(n)) / spread;
            line.velocity[axis] = slope;
            line.place[axis] = last[axis] + (sum[axis] - slope * total) / static_cast<double>(n);
            least[axis] = std::max(least[axis], slope - bound * slope_sigma);
            most[axis] = std::min(most[axis], slope + bound * slope_sigma);
            steady = steady && least[axis] <= most[axis];
        }
        if (!steady) break;
        found = line;
    }
    return found;
}

double noise_of_places(const double* places, std::ptrdiff_t count) {
    if (count < 4) return 0;
    std::vector<double> bends;
    for (const double* here = places; here < places + 3 * (count - 3); here += 3) {
        const double x = here[6] - 2 * here[3] + here[0], y = here[7] - 2 * here[4] + here[1], square = x * x + y * y;
        bends.push_back(square >= 0 ? std::sqrt(square) : std::numeric_limits<double>::infinity());
    }
    // A second difference has six times the variance of a place; the median of a Rayleigh distribution is sqrt(2 ln 2).
    return median(std::move(bends)) / std::sqrt(6 * 2 * std::log(2.0));
}

}  // namespace tactile
