// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Each separate object has a motion of its own. Sticking dots move with it; a dot that lags behind it slips. In gross slip no dot moves
// with the object: all lag behind it along their drag, under the largest friction. So the object's motion is propagated from frame to
// frame, and kept while all dots lag behind it in that way; it is estimated again once they move otherwise or the friction ratio falls.
// Dots at rest under the largest friction mean that the object rests (object_rest.cpp). Dots of a resting object that move on under the
// largest friction slip again, and so do those that spring back, not as one, under it. An object whose dots begin to lag has slowed down if
// many of them still move exactly as one. A new object has no motion yet: dots that lag along their drag behind one that comes down along
// the sensor's axis slip. An object that is not found in a frame is still known in the next.
#include "touchpad/contact/stick_slip.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/median.hpp"
#include "touchpad/contact/dragged_dots.hpp"
#include "touchpad/contact/known_objects.hpp"
#include "touchpad/contact/object_rest.hpp"
#include "touchpad/contact/separate_objects.hpp"

namespace tactile {
namespace {

enum State : std::uint8_t { FREE, STICKING, SLIPPING };
constexpr double HALF = 0.5;             // score of the border of a contact
constexpr std::ptrdiff_t FEWEST = 2;     // dots that tell a motion, as turns are held back; chosen: those of a light touch
constexpr double SMOOTHING = 0.2;        // weight of a new value in the running means of noise and friction; chosen
constexpr double LEAST_FRICTION = 0.05;  // friction coefficient; smaller estimates are not used; chosen
constexpr double MANY = 0.1;             // share of slipping dots from which gross slip may follow; chosen: one of a light touch's ten
constexpr double ALL = 0.9;              // share of dots that move as one, from which an object that starts or stops holds them; chosen
constexpr double HELD = 0.25;            // share of dots, four or more, that move so and tell that the object holds them; chosen
constexpr double FEW_SLIP = 0.6;         // share of slipping dots below which an object that slows down is told from one that slips; chosen
constexpr double LIFTS = 2;              // noises along the normal by which an object that is lifted rises in a frame at least; chosen
constexpr std::ptrdiff_t TWELVE = 12;    // dots that tell the noise along the normal: twice the unknowns of their motion
constexpr double STARTS = 0.75;          // of the tolerance: dots of an object at rest after gross slip that move less stay at rest; chosen
constexpr double ALONG = 0.5;  // mean cosine between lags and drags from which dots slip grossly; half of it while they do; chosen

// One object in one frame: how it moves, and which of its dots slip.
class ObjectMotion {
 public:
    ObjectMotion(const DraggedDots& dots, const ObjectRest& rest, StickSlipMemory& memory) : dots_(dots), rest_(rest), memory_(memory) {}

    // Which dots slip. Updates the object and the memory.
    std::vector<std::uint8_t> classify(TouchingObject& thing) {
        const bool starts = !thing.moves && starts_sliding(thing);
        const Twist twist = starts ? dots_.expected() : find_motion(thing);
        thing.gross = thing.gross || starts;
        std::vector<std::uint8_t> slips(dots_.count());
        if (dots_.count() < FEWEST && !thing.gross) {  // they tell no motion
            thing = TouchingObject{thing.friction};
            return slips;
        }
        const double limit = dots_.slip_limit();
        for (std::ptrdiff_t i = 0; i < dots_.count(); ++i) slips[i] = length(dots_.motions().residual(i, twist)) > limit;
        learn(thing, twist, slips);
        if (starts) return slips;
        thing.twist = thing.rests ? dots_.expected() : twist, thing.centre = dots_.motions().centre(), thing.moves = true;
        thing.slipping = static_cast<double>(std::count(slips.begin(), slips.end(), 1)) / static_cast<double>(dots_.count());
        return slips;
    }

 private:
    // The object's twist; sets whether it slips grossly or rests after that.
    Twist find_motion(TouchingObject& thing) const {
        const bool gross = thing.gross, rested = thing.rests, creep = rested && rest_.creeps(thing);
        if (creep) thing.still = 0;
        const bool still = thing.still >= rest_.rest_frames(thing);
        thing.gross = thing.rests = false;
        if (still) {
            thing.rests = gross || rested;
            return {};
        }
        if (rested && !creep && dots_.mean_size({}) < STARTS * memory_.tolerance && dots_.in_touch({})) {
            thing.rests = true;
            return {};
        }
        if (rested && slides_again(thing)) {
            thing.gross = true;
            return dots_.expected();
        }
        const double fine = memory_.tolerance, share = 0.1 * static_cast<double>(dots_.count());
        std::vector<double> grip(dots_.count(), 1.0);
        for (std::ptrdiff_t i = 0; thing.friction > 0 && i < dots_.count(); ++i) {
            grip[i] = std::pow(std::clamp((thing.friction - dots_.ratio(i)) / (0.4 * thing.friction), 0.05, 1.0), 2);
        }
        const auto by_dots = [&] { return dots_.fit(nullptr, grip, 30 * fine, 0); };
        if (thing.moves && !rested) {
            const Twist near = dots_.fit(&dots_.expected(), grip, 4 * fine, std::max(1.0, share));
            const double agree = dots_.following(near);
            const bool slides = slides_on(thing, gross);
            // Far from the expected motion the fit stays near that. Dots cannot lead their object: it has sped up. One that starts or stops
            // may leave that motion within a frame.
            const bool leads = dots_.along_drag(dots_.mean_residual(dots_.expected())) > fine;
            if (!gross && (leads || agree < (1 - MANY) * static_cast<double>(dots_.count()))) {
                const Twist whole = by_dots();
                const bool follow = !slides && dots_.following(whole) > ALL * static_cast<double>(dots_.count());
                if ((leads || follow || slows_down(thing, near, whole)) && dots_.in_touch(whole)) return whole;
            }
            if (agree >= std::max(FEWEST - 1.0, share) && !gross && dots_.in_touch(near) && !(slides && behind(near))) return near;
            thing.gross = slides;
            if (slides) return dots_.expected();
        }
        const Twist whole = by_dots();
        thing.gross = false;
        const bool back = rested && (dots_.spring_back() || dots_.lowered()[2] > LIFTS * memory_.depth_noise);
        if (!back || dots_.held(whole) >= HELD * static_cast<double>(dots_.count())) return whole;
        const Twist straight = dots_.constrained_to_normals({});
        thing.gross = dots_.in_touch(straight);
        return thing.gross ? straight : whole;
    }

    // Whether the object has slowed down, to a twist by which it still holds dots, instead of sliding on.
    bool slows_down(const TouchingObject& thing, const Twist& near, const Twist& whole) const {
        const double stuck = (1 - thing.slipping) * static_cast<double>(dots_.count());
        return thing.slipping < FEW_SLIP && dots_.held(whole) > std::max(dots_.held(near), HELD * stuck);
    }

    // Whether the dots of a new object lag along their drag behind an object that moves along the sensor's axis alone. Dots that stuck to
    // one that moves aside would be dragged along with it.
    bool starts_sliding(const TouchingObject& thing) const {
        return dots_.mean_size(dots_.expected()) > dots_.slip_limit() && dots_.lag_along_drag() > ALONG && dots_.loaded(thing);
    }

    // Whether the motion that most dots share lags behind the expected one along the drag: then these dots slip, they do not stick.
    bool behind(const Twist& near) const {
        return dots_.along_drag(dots_.mean_residual(near) - dots_.mean_residual(dots_.expected())) > 2 * memory_.tolerance;
    }

    // Whether the dots of an object that rested after gross slip move as in gross slip again: not back against their drags, which in a turn
    // cancel each other.
    bool slides_again(const TouchingObject& thing) const {
        double moved = 0, size = 0;
        for (std::ptrdiff_t i = 0; i < dots_.count(); ++i) {
            const Vec3 drag = dots_.drag(i);
            moved += dot(dots_.motions().residual(i, {}), drag), size += length(drag);
        }
        return moved > -0.5 * memory_.tolerance * size && dots_.loaded(thing) && dots_.in_touch(dots_.expected());
    }

    // Whether the dots lag behind the expected motion as in gross slip: all along their drag, at the friction of earlier slip.
    bool slides_on(const TouchingObject& thing, bool gross) const {
        return dots_.lag_along_drag() > (gross ? ALONG / 2 : ALONG) && dots_.loaded(thing) && dots_.in_touch(dots_.expected()) &&
               (gross || thing.slipping > MANY);
    }

    // Updates the running means of the slipping dots' friction and, where there are enough dots, of the noise along the normal.
    void learn(TouchingObject& thing, const Twist& twist, const std::vector<std::uint8_t>& slips) {
        const Twist along = dots_.constrained_to_normals(twist);
        std::vector<double> off(dots_.count()), slipping;
        for (std::ptrdiff_t i = 0; i < dots_.count(); ++i) {
            off[i] = std::abs(dots_.motions().normal_residual(i, along));
            if (slips[i]) slipping.push_back(dots_.ratio(i));
        }
        const double spread = std::max(SIGMA_PER_MAD * median_with_unknown(off), memory_.tolerance / 2);
        if (dots_.count() >= TWELVE) memory_.depth_noise += SMOOTHING * (spread - memory_.depth_noise);
        const double seen = slipping.size() >= FEWEST ? median_with_unknown(slipping) : 0.0;
        if (!(seen > LEAST_FRICTION)) return;
        thing.friction = thing.friction > 0 ? thing.friction + SMOOTHING * (seen - thing.friction) : seen;
        memory_.friction = thing.friction;
    }

    const DraggedDots& dots_;
    const ObjectRest& rest_;
    StickSlipMemory& memory_;
};

}  // namespace

std::vector<std::uint8_t> stick_slip(Grid grid, const FrameBefore& last, const TouchedFrame& now, const double* origin,
                                     StickSlipMemory& memory) {
    std::vector<std::uint8_t> touched(grid.size()), states(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) touched[k] = now.score[k] > HALF, states[k] = touched[k] ? STICKING : FREE;
    std::vector<TouchingObject> objects;
    std::vector<std::int64_t> held(grid.size());
    for (const Dots& dots : separate_objects(grid, touched)) {
        TouchingObject thing = continued(dots, memory);
        Dots both;
        for (const std::ptrdiff_t k : dots) {
            held[k] = static_cast<std::int64_t>(objects.size()) + 1;
            if (now.seen[k] && last.seen[k] && memory.held[k] > 0) both.push_back(k);
        }
        if (!both.empty()) {
            const DraggedDots dragged(grid, last, now, both, origin, thing, touched, memory);
            const ObjectRest rest(grid, last, now, both, dragged, memory, thing);
            const std::vector<std::uint8_t> slips = ObjectMotion(dragged, rest, memory).classify(thing);
            for (std::size_t i = 0; i < both.size(); ++i) states[both[i]] = slips[i] ? SLIPPING : STICKING;
            for (const std::ptrdiff_t k : dots) {  // new dots do as their object
                if (memory.held[k] == 0 && thing.gross) states[k] = SLIPPING;
            }
        }
        thing.lost = false;
        objects.push_back(thing);
    }
    keep_lost(memory, touched, objects, held);
    memory.objects = std::move(objects), memory.held = std::move(held);
    return states;
}

}  // namespace tactile
