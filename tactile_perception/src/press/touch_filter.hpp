// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace tactile {

constexpr int MEASURED = 4, STATE = 2 * MEASURED;  // place and depth; and their velocities

// A touch that is followed: state, m and m/s, and covariance (STATE, STATE).
struct TouchState {
    std::array<double, STATE> state;
    std::array<double, STATE * STATE> covariance;
};

// Place and depth of one frame, m, and their covariance (MEASURED, MEASURED).
struct TouchMeasurement {
    std::array<double, MEASURED> value;
    std::array<double, MEASURED * MEASURED> covariance;
};

struct TouchMotion {
    double elapsed;       // s, since the last frame
    double acceleration;  // m/s^2, standard deviation
    double gate;          // squared Mahalanobis distance, largest of a measurement that continues a touch
};

// Predicts the touches at constant velocity, pairs them with the measurements one to one, and updates those that have one. Returns the
// touch that each measurement continues, -1 without.
std::vector<std::ptrdiff_t> follow_touches(std::vector<TouchState>& touches, const std::vector<TouchMeasurement>& measured,
                                           const TouchMotion& motion);

}  // namespace tactile
