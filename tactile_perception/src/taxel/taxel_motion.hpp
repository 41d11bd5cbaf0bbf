// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace tactile {

// A frame of an object's past: time, s, and its motion so far at the origin, m, m, rad.
using PastFrame = std::array<double, 4>;

// How an object is followed.
struct FollowRule {
    double window, reported;        // s, longest stretch of a steady motion, and the stretch of the velocity that is reported
    std::ptrdiff_t fewest, latest;  // frames that are kept at least, and for a velocity; last frames in which it must move on
    std::array<double, 2> arm;      // m, of the contact's middle
    double reach;                   // m, of its edges from there
    double least, bound;            // m, noise of a place at least; standard deviations of steady_motion
};

// Motion of an object in the last of its frames.
struct ObjectMotion {
    std::vector<PastFrame> past;                // that are kept
    std::array<double, 3> place{}, velocity{};  // without noise, at the origin: m, m, rad and per s
    std::array<double, 3> reported{};           // velocity over the reported stretch, NaN with fewer than fewest frames
    double noise = 0;                           // m, of a place
    double speed = 0, sigma = 0;                // m/s, of the contact's middle and edges together, and the standard deviation of each
    double lasting = 0;                         // s, of the steady motion
    std::ptrdiff_t used = 0;                    // its frames
    double expected = 0, went = 0;              // m, way of the last frames by that speed, and as it was; 0 in a short past
};

// The motion after the past frames (count) and the one now.
ObjectMotion object_motion(const PastFrame* past, std::ptrdiff_t count, const PastFrame& now, const FollowRule& rule);

}  // namespace tactile
