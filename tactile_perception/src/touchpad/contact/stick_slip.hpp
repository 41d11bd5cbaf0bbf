// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// State of each dot (free, sticking, slipping) from loads and motions, without a known friction coefficient.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "touchpad/contact/object_twist.hpp"
#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// What is known of one object from its last frame. moves: whether its twist, a frame, about a centre, is known; friction: coefficient;
// slipping: share of its dots that slip; gross: whether it slips grossly; rests: whether it has stopped after gross slip, of which twist
// then is the last; still: frames for which its dots have been at rest; slid: frames for which it has slipped grossly; lively: m, motion
// of its dots a frame, in the last few in which they moved; drift: m, sizes of their mean motion in the last frames, the newest first;
// lost: whether none of them was touched in the last frame.
struct TouchingObject {
    double friction = std::numeric_limits<double>::quiet_NaN();
    bool moves = false, gross = false, rests = false;
    Twist twist{};
    Vec3 centre{0, 0, 0};
    double slipping = 0, lively = 0;
    int still = 0, slid = 0;
    std::array<double, 9> drift{};
    bool lost = false;
};

// All that is known from earlier frames. tolerance: m, lag of a sticking dot behind the object in a frame; noise, depth_noise: m, standard
// deviations of a dot's motion across its ray and along the normal; friction: coefficient in the last slip; held (K): number of the object
// that holds a dot, from 1, 0: none.
struct StickSlipMemory {
    double tolerance, noise, depth_noise, friction;
    std::vector<TouchingObject> objects;
    std::vector<std::int64_t> held;
};

// The frame before: places (K, 3), which dots are seen (K), and scores (K).
struct FrameBefore {
    const double* places;
    const bool* seen;
    const double* score;
};

// A frame: places (K, 3), scores (K), above a half in contact, which dots are seen (K), normals and force (K, 3).
struct TouchedFrame {
    const double *places, *score;
    const bool* seen;
    const double *normals, *force;
};

// States (K): 0 free, 1 sticking, 2 slipping, in the frame now; updates the memory of the last frame. origin: camera centre.
std::vector<std::uint8_t> stick_slip(Grid grid, const FrameBefore& last, const TouchedFrame& now, const double* origin,
                                     StickSlipMemory& memory);

}  // namespace tactile
