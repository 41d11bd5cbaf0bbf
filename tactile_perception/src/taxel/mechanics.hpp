// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contact regions and the object's motion in each frame of an array, by a model of its pad.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/fields.hpp"
#include "taxel/region.hpp"
#include "taxel/tracker.hpp"

namespace tactile::taxel {

// What one frame shows.
struct Observation {
    Regions regions;
    std::vector<float> surface;          // (rows, columns) pressure without the part that traction causes
    std::optional<ObjectMotion> motion;  // none where nothing touches
    TACTILE_FIELDS(regions, surface, motion)
};

class Mechanics {
 public:
    // known: whether pressure is in Pa; else the load is assumed to be that of the usual pad.
    Mechanics(const ShearPad& pad, const MotionLimits& limits, bool known) : tracker(pad, limits), known_(known) {}
    // Nothing touches.
    void reset() { tracker.reset(); }
    // pressure (rows, columns), of noise sigma; full: (rows, columns), taxels that are saturated; stamp: s; can_roll: whether the object
    // can roll over the pad.
    Observation process(const float* pressure, double sigma, const std::uint8_t* full, double stamp, bool can_roll);

    MotionTracker tracker;
    TACTILE_FIELDS(tracker)

 private:
    bool known_;
    float unit_ = 1;  // Pa per unit of pressure
};

}  // namespace tactile::taxel
