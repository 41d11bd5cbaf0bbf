// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Whether an object rests after gross slip.
#pragma once

#include "touchpad/contact/dragged_dots.hpp"

namespace tactile {

// The signs of rest of one object in one frame. Notes in the object how long its dots have been at rest, and how they moved before.
class ObjectRest {
 public:
    ObjectRest(Grid grid, const FrameBefore& last, const TouchedFrame& now, const Dots& members, const DraggedDots& dots,
               const StickSlipMemory& memory, TouchingObject& thing)
        : grid_(grid), last_(last), now_(now), members_(members), dots_(dots), memory_(memory) {
        watch_rest(thing);
    }

    // Frames for which dots must be at rest before the object counts as at rest.
    int rest_frames(const TouchingObject& thing) const;

    // Whether dots that hardly move drift, not back against their drags, below an object that turns in place.
    bool creeps(const TouchingObject& thing) const;

 private:
    // Counts the frames in which the dots are at rest and those of gross slip, and notes how far the dots move.
    void watch_rest(TouchingObject& thing);

    // Whether the expected motion is so fast that dots at rest under it mean that the object rests.
    bool is_swift() const;

    // By which share of the way that the object was expected to slide its region moves over the dots; NaN where that way is short, and
    // below an object that turns in place.
    double taken_along() const;

    // Mean motion of the dots, m a frame, that is more than noise.
    double clear() const;

    // Whether the dots' motions in the last frames tell that an object that turned has stopped: if it turns on they fade at an even rate.
    bool stopped(const TouchingObject& thing) const;

    Grid grid_;
    const FrameBefore& last_;
    const TouchedFrame& now_;
    const Dots& members_;
    const DraggedDots& dots_;
    const StickSlipMemory& memory_;
    bool calm_ = false;  // whether the dots move by no more than their noise
};

}  // namespace tactile
