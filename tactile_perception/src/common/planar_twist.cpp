// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/planar_twist.hpp"

#include <cmath>

namespace tactile {
namespace {

constexpr double COINCIDENT = 1e-24;  // m^2: a picometre

std::array<double, 2> mean(const double* values, std::ptrdiff_t count) {
    double x = 0, y = 0;
    for (std::ptrdiff_t k = 0; k < count; ++k) x += values[2 * k], y += values[2 * k + 1];
    return {x / static_cast<double>(count), y / static_cast<double>(count)};
}

}  // namespace

PlanarTwist planar_twist(const double* place, const double* velocity, std::ptrdiff_t count, double far) {
    const std::array<double, 2> middle = mean(place, count), drift = mean(velocity, count);
    double spread = 0, product = 0;
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        const double x = place[2 * k] - middle[0], y = place[2 * k + 1] - middle[1];
        spread += x * x + y * y;
        product += x * (velocity[2 * k + 1] - drift[1]) - y * (velocity[2 * k] - drift[0]);
    }
    if (!(spread > COINCIDENT && spread < INFINITY)) return {{NAN, NAN}, NAN, {NAN, NAN}};
    const double turn = product / spread, radius = std::sqrt(spread / static_cast<double>(count));
    const std::array<double, 2> linear{drift[0] + turn * middle[1], drift[1] - turn * middle[0]};
    if (std::hypot(drift[0], drift[1]) >= std::abs(turn) * far * radius) return {linear, turn, {NAN, NAN}};
    return {linear, turn, {middle[0] - drift[1] / turn, middle[1] + drift[0] / turn}};
}

}  // namespace tactile
