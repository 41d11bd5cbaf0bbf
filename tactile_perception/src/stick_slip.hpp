// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// State of each dot (free, sticking, slipping) from loads and motions, without a known friction coefficient.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "membrane_forces.hpp"
#include "object_twist.hpp"

namespace tactile {

// What is known of one object from its last frame. moves: whether its twist, a frame, about a centre, is known; friction: coefficient;
// slipping: share of its dots that slip; gross: whether it slips grossly; still: frames for which its dots have been at rest; slid,
// followed: how far it should have slid over dots that are about at rest, and how far its region has moved.
struct TouchingObject {
    double friction = std::numeric_limits<double>::quiet_NaN();
    bool moves = false, gross = false;
    Twist twist{};
    Vec3 centre{0, 0, 0}, slid{0, 0, 0}, followed{0, 0, 0};
    double slipping = 0;
    int still = 0;
};

// All that is known from earlier frames. tolerance: m, lag of a sticking dot behind the object in a frame; noise, depth_noise: m, standard
// deviations of a dot's motion across its ray and along the normal; friction: coefficient in the last slip; held (K): number of the object
// that holds a dot, from 1, 0: none.
struct StickSlipMemory {
    double tolerance, noise, depth_noise, friction;
    std::vector<TouchingObject> objects;
    std::vector<std::int64_t> held;
};

// A frame: places (K, 3), scores (K), above a half in contact, and which dots are seen (K); normals and force (K, 3) of a new one.
struct TouchedFrame {
    const double *places, *score;
    const bool* seen;
    const double *normals, *force;
};

// States (K): 0 free, 1 sticking, 2 slipping, in the frame now; updates the memory of the last frame. origin: camera centre.
std::vector<std::uint8_t> stick_slip(Grid grid, const TouchedFrame& last, const TouchedFrame& now, const double* origin,
                                     StickSlipMemory& memory);

}  // namespace tactile
