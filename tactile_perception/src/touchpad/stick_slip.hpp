// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// State of each dot (free, sticking, slipping) from loads and motions, without a known friction coefficient.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "touchpad/membrane.hpp"

namespace tactile {

enum DotState : std::uint8_t { FREE, STICKING, SLIPPING };

// Translation of the centre, m a frame, and w = 2 tan(angle / 2) times the axis. Cayley's form is exact and linear:
// after - before = v + w x ((before + after) / 2 - centre).
using Twist = Eigen::Matrix<double, 6, 1>;

// An object that touches. friction: coefficient in its last slip; moves: whether its twist about a centre is known; gross: whether all its
// dots slip; slipping: share of its dots that slip; still: frames for which they have been at rest; adrift: s for which it has slipped
// grossly.
struct TouchingObject {
    double friction = std::numeric_limits<double>::quiet_NaN();
    bool moves = false, gross = false;
    Twist twist = Twist::Zero();
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double slipping = 0, adrift = 0;
    int still = 0;
};

// The dots of a grid, frame by frame. Each separate object has a motion of its own. Sticking dots move with it; a dot that lags behind it
// slips. In gross slip no dot moves with the object: all lag behind it along their drag, under the largest friction. So the object's motion
// is propagated from frame to frame, and kept while all dots lag behind it in that way; it is estimated again once they move otherwise or
// the friction ratio falls. Dots at rest under the largest friction mean that the object rests. A new object has no motion yet: dots that
// lag along their drag behind one that comes down along the sensor's axis slip.
class StickSlip {
 public:
    // origin: the camera's centre.
    StickSlip(Grid grid, Eigen::Vector3d origin);

    // States (K) of the dots in the next frame, so many seconds after the last. score (K): above a half in contact.
    std::vector<std::uint8_t> update(const DotLoads& loads, const std::vector<double>& score, double seconds);

    // (K, 2) m: way in the last frame over each dot of an object in gross slip that neither turns nor is lifted, as it last moved with its
    // dots, a second before at most; NaN: unknown. Standard deviation: a third, since it may have changed its speed.
    std::vector<double> slides() const;

    std::ptrdiff_t size() const { return grid_.size(); }
    double friction() const { return friction_; }  // coefficient in the last slip, NaN before the first
    double noise() const { return noise_; }        // m, standard deviation of a dot's motion across its ray, measured while nothing touches

 private:
    class ObjectDots;
    std::vector<std::uint8_t> classify(TouchingObject& object, const ObjectDots& dots, double seconds);
    Twist find_motion(TouchingObject& object, const ObjectDots& dots) const;
    bool rests(TouchingObject& object, const ObjectDots& dots) const;
    void learn(TouchingObject& object, const ObjectDots& dots, const std::vector<std::uint8_t>& slips);
    TouchingObject continued(const std::vector<std::ptrdiff_t>& dots) const;
    void measure_noise(const DotLoads& loads);

    Grid grid_;
    Eigen::Vector3d origin_;
    double noise_, friction_ = std::numeric_limits<double>::quiet_NaN();
    std::vector<TouchingObject> objects_;
    std::vector<int> held_;  // number of the object that holds a dot, from 1, 0: none
    std::vector<double> last_xyz_, moved_;
    std::vector<std::uint8_t> last_seen_;
};

}  // namespace tactile
