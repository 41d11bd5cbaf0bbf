// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/membrane/settled_holes.hpp"

#include <algorithm>
#include <cmath>

#include "common/band.hpp"
#include "common/vectors.hpp"

namespace tactile {
namespace {

// Standard deviation of an interpolated position and largest step, m; chosen.
constexpr double SIGMA = 1e-3, STEP = 4e-4;
// Load expected of a free and of a touched dot, and their standard deviations; chosen: 1 under a face, 2 to 3 under a ball or an edge.
constexpr double EXPECTED[2] = {0.0, 1.3}, SPREAD[2] = {0.4, 0.8}, TOUCHED = 0.5;

}  // namespace

std::vector<double> settle_holes(const Membrane& membrane, const double* places, const double* load, const bool* seen, const double* origin,
                                 double pressure) {
    const Grid grid = membrane.grid;
    std::vector<double> settled(places, places + 3 * grid.size()), rays(3 * grid.size());
    std::vector<std::ptrdiff_t> holes, number(grid.size());
    std::vector<std::uint8_t> beside(grid.size());  // inner dots with an unseen one among the 3 x 3 dots around them
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        const Vec3 away = vec3_at(places, k) - vec3_at(origin, 0);
        store(rays.data(), k, 1 / length(away) * away);
        if (seen[k]) continue;
        number[k] = static_cast<std::ptrdiff_t>(holes.size());
        holes.push_back(k);
        around(grid, k, [&](std::ptrdiff_t j) {
            if (grid.inner(j / grid.columns, j % grid.columns)) beside[j] = 1;
        });
    }
    if (holes.empty()) return settled;
    const Balance balance = find_balance(membrane, places, pressure);
    const std::vector<double> slopes = find_slopes(membrane, places, rays.data(), pressure, balance);
    const auto size = static_cast<std::ptrdiff_t>(holes.size());
    Band<double> normal(size, std::min(size - 1, 2 * grid.columns + 2));  // dots beside the same one are at most so far apart
    std::vector<double> right(size);
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!beside[k]) continue;
        const bool held = load[k] > TOUCHED;
        const double weight = 1 / (SPREAD[held] * SPREAD[held]), off = load[k] - EXPECTED[held];
        for (int i = 0; i < 9; ++i) {
            const std::ptrdiff_t one = k + (i / 3 - 1) * grid.columns + i % 3 - 1;
            if (seen[one]) continue;
            right[number[one]] -= weight * slopes[9 * k + i] * off;
            for (int j = 0; j <= i; ++j) {
                const std::ptrdiff_t other = k + (j / 3 - 1) * grid.columns + j % 3 - 1;
                if (!seen[other])
                    normal.column(number[other])[number[one] - number[other]] += weight * slopes[9 * k + i] * slopes[9 * k + j];
            }
        }
    }
    for (std::ptrdiff_t h = 0; h < size; ++h) normal.column(h)[0] += 1 / (SIGMA * SIGMA);
    if (!factorise(normal)) return settled;
    solve(normal, right.data());
    for (std::ptrdiff_t h = 0; h < size; ++h) {
        if (!std::isnan(right[h])) add_to(settled.data(), holes[h], std::clamp(right[h], -STEP, STEP) * vec3_at(rays.data(), holes[h]));
    }
    return settled;
}

}  // namespace tactile
