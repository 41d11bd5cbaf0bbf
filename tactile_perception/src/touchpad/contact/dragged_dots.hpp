// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Motions and tangential loads of the dots of one object in one frame, beside the motion that is expected of it.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "touchpad/contact/object_twist.hpp"
#include "touchpad/contact/separate_objects.hpp"
#include "touchpad/contact/stick_slip.hpp"

namespace tactile {

// Dots of an object that were in contact and seen in the last frame too. All numbers are m a frame, N, or shares.
class DraggedDots {
 public:
    DraggedDots(Grid grid, const FrameBefore& last, const TouchedFrame& now, const Dots& dots, const double* origin,
                const TouchingObject& thing, const std::vector<std::uint8_t>& touched, const StickSlipMemory& memory);

    std::ptrdiff_t count() const { return count_; }
    const DotMotions& motions() const { return motions_; }

    // Twist by which the object moves if it goes on as before, about the dots' centre; of a new one: along the sensor's axis.
    const Twist& expected() const { return expected_; }

    // Tangential over normal load, and the tangential load, of each dot, summed over 3 x 3 dots. Where the object slides over the surface,
    // only the load in that direction counts: it may differ from dot to dot.
    double ratio(std::ptrdiff_t i) const { return ratio_[i]; }
    Vec3 drag(std::ptrdiff_t i) const { return vec3_at(drag_.data(), i); }

    // Lag behind the object, m a frame, above which a dot slips.
    double slip_limit() const { return std::hypot(1.3 * memory_.tolerance, 3 * memory_.noise); }

    // The motion that the dots share, each with its probability grip (count) of sticking: see DotMotions::fit_robust.
    Twist fit(const Twist* start, const std::vector<double>& grip, double coarse, double hold) const;

    // twist with the components that move the surface along its normals fitted to the dots, the others, which slip hides, kept.
    Twist constrained_to_normals(const Twist& twist) const;

    // Motion along the sensor's axis that follows the dots along their normals.
    Twist lowered() const;

    // Whether the dots follow the object along the normal, as all dots in contact must.
    bool in_touch(const Twist& twist) const;

    // Whether the dots are dragged as below an object that turns in place.
    bool turns() const;

    // Sum of the dots' tangential loads.
    Vec3 whole_drag() const;

    // Part of a motion along the dots' drag.
    double along_drag(Vec3 motion) const;

    // Sum of the parts of the dots' motions beyond the twist's that are along each one's drag.
    double moved_along_drags(const Twist& twist) const;

    // Whether the dots move back against their drags.
    bool spring_back() const;

    // Dots that move with an object of this twist as precisely as those that stick to it do, where there are enough to tell.
    double held(const Twist& twist) const;

    // Dots that move with an object of this twist.
    double following(const Twist& twist) const;

    // Mean size of the dots' motions beyond the twist's, and their mean.
    double mean_size(const Twist& twist) const;
    Vec3 mean_residual(const Twist& twist) const;

    // Whether the dots are dragged about as much as in earlier slip.
    bool loaded(const TouchingObject& thing) const;

    // Mean cosine, weighted by their size, between the dots' lags behind the expected motion and their drags.
    double lag_along_drag() const;

 private:
    // Direction in which the object, by the expected twist, slides over a dot, across its normal; 0: unknown.
    Vec3 sliding_direction(std::ptrdiff_t i) const;
    void find_friction(const std::vector<std::uint8_t>& touched, bool expected);

    Grid grid_;
    const TouchedFrame& now_;
    const Dots& dots_;
    std::ptrdiff_t count_;
    std::vector<double> normals_;
    DotMotions motions_;
    const StickSlipMemory& memory_;
    Twist expected_{};
    std::vector<double> ratio_, drag_;
};

}  // namespace tactile
