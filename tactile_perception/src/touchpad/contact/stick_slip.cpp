// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Each separate object has a motion of its own. Sticking dots move with it; a dot that lags behind it slips. In gross slip no dot moves
// with the object: all lag behind it along their drag, under the largest friction. So the object's motion is propagated from frame to
// frame, and kept while all dots lag behind it in that way; it is estimated again once they move otherwise or the friction ratio falls.
// Dots at rest under the largest friction mean that the object rests: at once if its region stays as well, or if they moved just before and
// it does not move along, since dots under a sliding object move as its edges pass them; only below one that turns in place they may not:
// there it rests if their motions ended suddenly. Dots of a resting object that move on under the largest friction slip again, and so do
// those that spring back, not as one, under it. An object whose dots begin to lag has slowed down if many of them still move
// exactly as one. A new object has no motion yet: dots that lag along their drag behind one that comes down along the sensor's axis slip. An
// object that is not found in a frame is still known in the next.
#include "touchpad/contact/stick_slip.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/median.hpp"
#include "touchpad/contact/known_objects.hpp"
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
constexpr double TIGHT = 0.15;           // of the tolerance: dots that stick move with their object within that; chosen
constexpr double HELD = 0.25;            // share of dots, four or more, that move so and tell that the object holds them; chosen
constexpr double FEW_SLIP = 0.6;         // share of slipping dots below which an object that slows down is told from one that slips; chosen
constexpr double LIFTS = 2;              // noises along the normal by which an object that is lifted rises in a frame at least; chosen
constexpr double BACK = 0.7;             // mean cosine between their motions and -drags from which dots spring back; chosen
constexpr std::ptrdiff_t TWELVE = 12;    // dots that tell the noise along the normal: twice the unknowns of their motion
constexpr double LAG = 0.4;              // of the tolerance: standard deviation of a sticking dot's lag behind its object; chosen
constexpr double LOOSE = 1e-3;           // weight of a twist, in dots, that is kept where nothing else tells; chosen
// Frames with dots at rest before an object rests that slid, and one that turned in place and did not clearly stop; chosen.
constexpr int REST_AFTER_GROSS = 3, REST_AFTER_TURN = 15;
constexpr double QUIET = 1.0 / 3;        // of the tolerance: dots that move less are at rest; chosen: a sixth of what sliding dots move
constexpr double STARTS = 0.75;  // of the tolerance: dots of an object at rest after gross slip that move less stay at rest; chosen
constexpr double SWIFT = 50;     // tolerances: an object that slides over its dots by more in a frame moves some in each; chosen: half a mm
constexpr double BRISK = 12;     // tolerances: an object that slides on by more in a frame takes its region along visibly; chosen
constexpr double TAKEN = 0.3;    // share of that way by which its region has to move at least; chosen: an edge may stay behind
constexpr std::ptrdiff_t ENOUGH = 20;    // dots: the place of their region is known well enough for that; chosen
constexpr double SUDDEN = 0.5;   // share of what even fading leaves of the dots' mean motion: if less is left, the object stops; chosen
constexpr double CLEAR = 5;      // standard deviations of noise above which the dots' mean motion is clear; chosen
constexpr double FADING = 0.5;   // share of the liveliness that is left a frame later; chosen
constexpr double LIVELY = 3;     // tolerances: dots that moved by more just before they came to rest were stopped; chosen
constexpr double ONE_WAY = 0.5;  // of the sum of the drags' lengths: drags with a smaller sum are those of a turn; chosen
constexpr double ALONG = 0.5;    // mean cosine between lags and drags from which dots slip grossly; half of it while they do; chosen
constexpr double LOADED = 0.65;  // of the friction coefficient: ratio from which dots may slip grossly; chosen

// One object in one frame: the motions of its dots, which were in contact and seen in the last frame too.
class ObjectFrame {
 public:
    ObjectFrame(Grid grid, const FrameBefore& last, const TouchedFrame& now, const Dots& dots, const double* origin,
                StickSlipMemory& memory)
        : grid_(grid),
          last_(last),
          now_(now),
          dots_(dots),
          count_(static_cast<std::ptrdiff_t>(dots.size())),
          normals_(gathered(now.normals, dots)),
          motions_(gathered(last.places, dots).data(), gathered(now.places, dots).data(), normals_.data(), count_, origin,
                   std::hypot(memory.noise, LAG * memory.tolerance), memory.depth_noise),
          memory_(memory) {}

    // Which dots slip. Updates the object and the memory.
    std::vector<std::uint8_t> classify(TouchingObject& thing, const std::vector<std::uint8_t>& touched) {
        if (!thing.moves) {
            expected_ = lowered();
        } else {
            const Vec3 turn{thing.twist[3], thing.twist[4], thing.twist[5]}, shift = cross(turn, motions_.centre() - thing.centre);
            expected_ = thing.twist;
            expected_[0] += shift.x, expected_[1] += shift.y, expected_[2] += shift.z;
            if (!in_touch(expected_)) expected_ = constrained_to_normals(expected_);
        }
        find_friction(touched, thing.moves);
        watch_rest(thing);
        const bool starts = !thing.moves && starts_sliding(thing);
        const Twist twist = starts ? expected_ : find_motion(thing);
        thing.gross = thing.gross || starts;
        std::vector<std::uint8_t> slips(count_);
        if (count_ < FEWEST && !thing.gross) {  // they tell no motion
            thing = TouchingObject{thing.friction};
            return slips;
        }
        const double limit = slip_limit();
        for (std::ptrdiff_t i = 0; i < count_; ++i) slips[i] = length(motions_.residual(i, twist)) > limit;
        learn(thing, twist, slips);
        if (starts) return slips;
        thing.twist = thing.rests ? expected_ : twist, thing.centre = motions_.centre(), thing.moves = true;
        thing.slipping = static_cast<double>(std::count(slips.begin(), slips.end(), 1)) / static_cast<double>(count_);
        return slips;
    }

 private:
    // Lag behind the object, m a frame, above which a dot slips.
    double slip_limit() const { return std::hypot(1.3 * memory_.tolerance, 3 * memory_.noise); }

    // twist with the components that move the surface along its normals fitted to the dots, the others, which slip hides, kept.
    Twist constrained_to_normals(const Twist& twist) const {
        const std::vector<double> none(3 * count_);
        return motions_.fit_robust(&twist, none.data(), none.data(), 1, 1, LOOSE);
    }

    // Motion along the sensor's axis that follows the dots along their normals.
    Twist lowered() const {
        double product = 0, square = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            const double upright = vec3_at(normals_.data(), i).z;
            product += upright * motions_.normal_residual(i, {}), square += upright * upright;
        }
        return {0, 0, square > 0 ? product / square : 0, 0, 0, 0};
    }

    // Whether the dots follow the object along the normal, as all dots in contact must.
    bool in_touch(const Twist& twist) const {
        std::vector<double> off(count_), size(count_);
        for (std::ptrdiff_t i = 0; i < count_; ++i) off[i] = motions_.normal_residual(i, twist), size[i] = std::abs(off[i]);
        return std::abs(median_with_unknown(off)) < 2 * memory_.depth_noise && median_with_unknown(size) < 3 * memory_.depth_noise;
    }

    // Direction in which the object, by the expected twist, slides over a dot, across its normal; 0: unknown.
    Vec3 sliding_direction(std::ptrdiff_t i) const {
        const Vec3 up = vec3_at(normals_.data(), i), lag = -1.0 * motions_.residual(i, expected_), across = lag - dot(lag, up) * up;
        const double size = length(across);
        return size > memory_.tolerance / 2 ? 1 / size * across : Vec3{0, 0, 0};
    }

    // Tangential over normal load, and the tangential load, of each dot, summed over 3 x 3 dots. Where the object slides over the surface,
    // only the load in that direction counts: it may differ from dot to dot.
    void find_friction(const std::vector<std::uint8_t>& touched, bool expected) {
        std::vector<double> normal(grid_.size()), along(grid_.size());
        std::vector<Vec3> pull(grid_.size(), Vec3{0, 0, 0}), direction(count_, Vec3{0, 0, 0});
        for (std::ptrdiff_t k = 0; k < grid_.size(); ++k) {
            if (!touched[k]) continue;
            const Vec3 force = vec3_at(now_.force, k), up = vec3_at(now_.normals, k);
            normal[k] = -dot(force, up);
            pull[k] = force + normal[k] * up;
        }
        for (std::ptrdiff_t i = 0; expected && i < count_; ++i) {
            direction[i] = sliding_direction(i);
            along[dots_[i]] = dot(pull[dots_[i]], direction[i]);
        }
        ratio_.resize(count_), drag_.resize(3 * count_);
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            double carried = 0, slid = 0;
            Vec3 sum{0, 0, 0};
            around(grid_, dots_[i], [&](std::ptrdiff_t k) { carried += normal[k], slid += along[k], sum = sum + pull[k]; });
            const bool told = direction[i].x != 0 || direction[i].y != 0 || direction[i].z != 0;
            ratio_[i] = (told ? slid : length(sum)) / std::max(carried, 1e-9);
            store(drag_.data(), i, sum);
        }
    }

    // Counts the frames in which the dots are at rest and those of gross slip, and notes how far the dots move.
    void watch_rest(TouchingObject& thing) {
        const auto count = static_cast<double>(count_);
        double squares = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            const Vec3 across = motions_.residual(i, {});
            squares += dot(across, across);
        }
        // Dots under an object that slid fast creep on a little when it stops.
        const double quiet = thing.gross && is_swift() ? 1 : QUIET;
        // Whether the mean square motion is within three standard deviations of noise, or far below that of dots under a sliding object.
        const double size = std::sqrt(squares / count), excess = size * size / (2 * memory_.noise * memory_.noise) - 1;
        calm_ = excess < 3 / std::sqrt(count);
        if ((calm_ || size < quiet * memory_.tolerance) && in_touch({})) {
            thing.still = std::min(thing.still + 1, 1 << 20);
        } else {
            thing.still = 0;
            thing.lively = std::max(size, FADING * thing.lively);
        }
        std::copy_backward(thing.drift.begin(), thing.drift.end() - 1, thing.drift.end());
        thing.drift[0] = length(mean_residual({}));
        thing.slid = thing.gross ? std::min(thing.slid + 1, 1 << 20) : 0;
    }

    // Whether the expected motion is so fast that dots at rest under it mean that the object rests.
    bool is_swift() const { return mean_size(expected_) > SWIFT * memory_.tolerance; }

    // Frames for which dots must be at rest before the object counts as at rest.
    int rest_frames(const TouchingObject& thing) const {
        if (!thing.gross || is_swift()) return 1;
        const double along = taken_along();
        // Dots below an object that slides on fade to rest; these moved just before, and now not at all.
        const bool halted = calm_ && thing.lively > memory_.tolerance && !(along >= TAKEN);
        if (halted || (count_ >= ENOUGH && along < TAKEN)) return 1;
        return turns() && !stopped(thing) ? REST_AFTER_TURN : REST_AFTER_GROSS;
    }

    // By which share of the way that the object was expected to slide its region moves over the dots; NaN where that way is short, and below
    // an object that turns in place.
    double taken_along() const {
        const Vec3 lag = -1.0 * mean_residual(expected_);
        const double way = length(lag);
        if (way < BRISK * memory_.tolerance || turns()) return NAN;
        const auto centre = [&](const double* score) { return region_centre(grid_, dots_, score, now_.places); };
        return dot(centre(now_.score) - centre(last_.score), lag) / (way * way);
    }

    // Whether the dots are dragged as below an object that turns in place.
    bool turns() const {
        double sum = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) sum += length(vec3_at(drag_.data(), i));
        return length(whole_drag()) < ONE_WAY * sum;
    }

    // Mean motion of the dots, m a frame, that is more than noise.
    double clear() const { return CLEAR * memory_.noise * std::sqrt(2 / static_cast<double>(count_)); }

    // Whether the dots' motions in the last frames tell that an object that turned has stopped: if it turns on they fade at an even rate.
    bool stopped(const TouchingObject& thing) const {
        double middle[3];  // medians of three frames each, the newest first
        for (int k = 0; k < 3; ++k) middle[k] = median_with_unknown({thing.drift[3 * k], thing.drift[3 * k + 1], thing.drift[3 * k + 2]});
        const bool steady = thing.slid >= static_cast<int>(thing.drift.size()) && middle[1] > clear();
        return thing.lively > LIVELY * memory_.tolerance ||
               (steady && thing.drift[0] < clear() && middle[0] * middle[2] < SUDDEN * middle[1] * middle[1]);
    }

    // Whether dots that hardly move drift, not back against their drags, below an object that turns in place.
    bool creeps(const TouchingObject& thing) const {
        double along = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            const Vec3 drag = vec3_at(drag_.data(), i);
            along += dot(motions_.residual(i, {}), drag) / std::max(length(drag), 1e-12);
        }
        return turns() && thing.drift[0] > std::max(clear(), -along / static_cast<double>(count_));
    }

    // Sum of the dots' tangential loads.
    Vec3 whole_drag() const {
        Vec3 sum{0, 0, 0};
        for (std::ptrdiff_t i = 0; i < count_; ++i) sum = sum + vec3_at(drag_.data(), i);
        return sum;
    }

    // Part of a motion along the dots' drag.
    double along_drag(Vec3 motion) const {
        const Vec3 drag = whole_drag();
        return dot(motion, drag) / std::max(length(drag), 1e-12);
    }

    // The object's twist; sets whether it slips grossly or rests after that.
    Twist find_motion(TouchingObject& thing) const {
        const bool gross = thing.gross, rested = thing.rests, creep = rested && creeps(thing);
        if (creep) thing.still = 0;
        const bool still = thing.still >= rest_frames(thing);
        thing.gross = thing.rests = false;
        if (still) {
            thing.rests = gross || rested;
            return {};
        }
        if (rested && !creep && mean_size({}) < STARTS * memory_.tolerance && in_touch({})) {
            thing.rests = true;
            return {};
        }
        if (rested && slides_again(thing)) {
            thing.gross = true;
            return expected_;
        }
        const double fine = memory_.tolerance, share = 0.1 * static_cast<double>(count_);
        std::vector<double> grip(count_, 1.0);
        for (std::ptrdiff_t i = 0; thing.friction > 0 && i < count_; ++i) {
            grip[i] = std::pow(std::clamp((thing.friction - ratio_[i]) / (0.4 * thing.friction), 0.05, 1.0), 2);
        }
        const auto by_dots = [&] { return motions_.fit_robust(nullptr, drag_.data(), grip.data(), 30 * fine, fine, 0); };
        if (thing.moves && !rested) {
            const Twist near = motions_.fit_robust(&expected_, drag_.data(), grip.data(), 4 * fine, fine, std::max(1.0, share));
            const double agree = following(near);
            const bool slides = slides_on(thing, gross);
            // Far from the expected motion the fit stays near that. Dots cannot lead their object: it has sped up. One that starts or stops
            // may leave that motion within a frame.
            const bool leads = along_drag(mean_residual(expected_)) > fine;
            if (!gross && (leads || agree < (1 - MANY) * static_cast<double>(count_))) {
                const Twist whole = by_dots();
                const bool follow = !slides && following(whole) > ALL * static_cast<double>(count_);
                if ((leads || follow || slows_down(thing, near, whole)) && in_touch(whole)) return whole;
            }
            if (agree >= std::max(FEWEST - 1.0, share) && !gross && in_touch(near) && !(slides && behind(near))) return near;
            thing.gross = slides;
            if (slides) return expected_;
        }
        const Twist whole = by_dots();
        thing.gross = false;
        const bool back = rested && (spring_back() || lowered()[2] > LIFTS * memory_.depth_noise);
        if (!back || held(whole) >= HELD * static_cast<double>(count_)) return whole;
        const Twist straight = constrained_to_normals({});
        thing.gross = in_touch(straight);
        return thing.gross ? straight : whole;
    }

    // Whether the dots move back against their drags.
    bool spring_back() const {
        double along = 0, size = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            const Vec3 moved = motions_.residual(i, {}), drag = vec3_at(drag_.data(), i);
            size += length(moved) + 1e-12;
            along += dot(moved, drag) / std::max(length(drag), 1e-12);
        }
        return along < -BACK * size && size > slip_limit() * static_cast<double>(count_);
    }

    // Dots that move with an object of this twist as precisely as those that stick to it do, where there are enough to tell.
    double held(const Twist& twist) const {
        double count = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) count += length(motions_.residual(i, twist)) < TIGHT * memory_.tolerance;
        return count < 4 ? 0 : count;
    }

    // Whether the object has slowed down, to a twist by which it still holds dots, instead of sliding on.
    bool slows_down(const TouchingObject& thing, const Twist& near, const Twist& whole) const {
        const double stuck = (1 - thing.slipping) * static_cast<double>(count_);
        return thing.slipping < FEW_SLIP && held(whole) > std::max(held(near), HELD * stuck);
    }

    // Dots that move with an object of this twist.
    double following(const Twist& twist) const {
        double count = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) count += length(motions_.residual(i, twist)) < 1.3 * memory_.tolerance;
        return count;
    }

    // Whether the dots of a new object lag along their drag behind an object that moves along the sensor's axis alone. Dots that stuck to
    // one that moves aside would be dragged along with it.
    bool starts_sliding(const TouchingObject& thing) const {
        return mean_size(expected_) > slip_limit() && lag_along_drag() > ALONG && loaded(thing);
    }

    // Whether the motion that most dots share lags behind the expected one along the drag: then these dots slip, they do not stick.
    bool behind(const Twist& near) const {
        return along_drag(mean_residual(near) - mean_residual(expected_)) > 2 * memory_.tolerance;
    }

    // Whether the dots of an object that rested after gross slip move as in gross slip again: not back against their drags, which in a turn
    // cancel each other.
    bool slides_again(const TouchingObject& thing) const {
        double moved = 0, size = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            const Vec3 drag = vec3_at(drag_.data(), i);
            moved += dot(motions_.residual(i, {}), drag), size += length(drag);
        }
        return moved > -0.5 * memory_.tolerance * size && loaded(thing) && in_touch(expected_);
    }

    double mean_size(const Twist& twist) const {
        double sum = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) sum += length(motions_.residual(i, twist));
        return sum / static_cast<double>(count_);
    }

    Vec3 mean_residual(const Twist& twist) const {
        Vec3 sum{0, 0, 0};
        for (std::ptrdiff_t i = 0; i < count_; ++i) sum = sum + motions_.residual(i, twist);
        return 1.0 / static_cast<double>(count_) * sum;
    }

    // Whether the dots are dragged about as much as in earlier slip.
    bool loaded(const TouchingObject& thing) const {
        return !(thing.friction > 0) || median_with_unknown(ratio_) > LOADED * thing.friction;
    }

    // Whether the dots lag behind the expected motion as in gross slip: all along their drag, at the friction of earlier slip.
    bool slides_on(const TouchingObject& thing, bool gross) const {
        return lag_along_drag() > (gross ? ALONG / 2 : ALONG) && loaded(thing) && in_touch(expected_) && (gross || thing.slipping > MANY);
    }

    // Mean cosine, weighted by their size, between the dots' lags behind the expected motion and their drags.
    double lag_along_drag() const {
        double along = 0, size = 0;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            const Vec3 lag = -1.0 * motions_.residual(i, expected_), drag = vec3_at(drag_.data(), i);
            size += length(lag) + 1e-12;
            along += dot(lag, drag) / std::max(length(drag), 1e-12);
        }
        return along / size;
    }

    // Updates the running means of the slipping dots' friction and, where there are enough dots, of the noise along the normal.
    void learn(TouchingObject& thing, const Twist& twist, const std::vector<std::uint8_t>& slips) {
        const Twist along = constrained_to_normals(twist);
        std::vector<double> off(count_), slipping;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            off[i] = std::abs(motions_.normal_residual(i, along));
            if (slips[i]) slipping.push_back(ratio_[i]);
        }
        const double spread = std::max(SIGMA_PER_MAD * median_with_unknown(off), memory_.tolerance / 2);
        if (count_ >= TWELVE) memory_.depth_noise += SMOOTHING * (spread - memory_.depth_noise);
        const double seen = slipping.size() >= FEWEST ? median_with_unknown(slipping) : 0.0;
        if (!(seen > LEAST_FRICTION)) return;
        thing.friction = thing.friction > 0 ? thing.friction + SMOOTHING * (seen - thing.friction) : seen;
        memory_.friction = thing.friction;
    }

    Grid grid_;
    const FrameBefore& last_;
    const TouchedFrame& now_;
    const Dots& dots_;
    std::ptrdiff_t count_;
    std::vector<double> normals_;
    DotMotions motions_;
    StickSlipMemory& memory_;
    Twist expected_{};
    bool calm_ = false;  // whether the dots move by no more than their noise
    std::vector<double> ratio_, drag_;
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
            const std::vector<std::uint8_t> slips = ObjectFrame(grid, last, now, both, origin, memory).classify(thing, touched);
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
