// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Dots at rest under the largest friction mean that the object rests: at once if its region stays as well, or if they moved just before and
// it does not move along, since dots under a sliding object move as its edges pass them; only below one that turns in place they may not:
// there it rests if their motions ended suddenly.
#include "touchpad/contact/object_rest.hpp"

#include <algorithm>
#include <cmath>

#include "common/median.hpp"

namespace tactile {
namespace {

// Frames with dots at rest before an object rests that slid, and one that turned in place and did not clearly stop; chosen.
constexpr int REST_AFTER_GROSS = 3, REST_AFTER_TURN = 15;
constexpr double QUIET = 1.0 / 3;  // of the tolerance: dots that move less are at rest; chosen: a sixth of what sliding dots move
constexpr double SWIFT = 50;   // tolerances: an object that slides over its dots by more in a frame moves some in each; chosen: half a mm
constexpr double BRISK = 12;   // tolerances: an object that slides on by more in a frame takes its region along visibly; chosen
constexpr double TAKEN = 0.3;  // share of that way by which its region has to move at least; chosen: an edge may stay behind
constexpr std::ptrdiff_t ENOUGH = 20;  // dots: the place of their region is known well enough for that; chosen
constexpr double SUDDEN = 0.5;  // share of what even fading leaves of the dots' mean motion: if less is left, the object stops; chosen
constexpr double CLEAR = 5;     // standard deviations of noise above which the dots' mean motion is clear; chosen
constexpr double FADING = 0.5;  // share of the liveliness that is left a frame later; chosen
constexpr double LIVELY = 3;    // tolerances: dots that moved by more just before they came to rest were stopped; chosen

}  // namespace

void ObjectRest::watch_rest(TouchingObject& thing) {
    const auto count = static_cast<double>(dots_.count());
    double squares = 0;
    for (std::ptrdiff_t i = 0; i < dots_.count(); ++i) {
        const Vec3 across = dots_.motions().residual(i, {});
        squares += dot(across, across);
    }
    // Dots under an object that slid fast creep on a little when it stops.
    const double quiet = thing.gross && is_swift() ? 1 : QUIET;
    // Whether the mean square motion is within three standard deviations of noise, or far below that of dots under a sliding object.
    const double size = std::sqrt(squares / count), excess = size * size / (2 * memory_.noise * memory_.noise) - 1;
    calm_ = excess < 3 / std::sqrt(count);
    if ((calm_ || size < quiet * memory_.tolerance) && dots_.in_touch({})) {
        thing.still = std::min(thing.still + 1, 1 << 20);
    } else {
        thing.still = 0;
        thing.lively = std::max(size, FADING * thing.lively);
    }
    std::copy_backward(thing.drift.begin(), thing.drift.end() - 1, thing.drift.end());
    thing.drift[0] = length(dots_.mean_residual({}));
    thing.slid = thing.gross ? std::min(thing.slid + 1, 1 << 20) : 0;
}

bool ObjectRest::is_swift() const {
    return dots_.mean_size(dots_.expected()) > SWIFT * memory_.tolerance;
}

int ObjectRest::rest_frames(const TouchingObject& thing) const {
    if (!thing.gross || is_swift()) return 1;
    const double along = taken_along();
    // Dots below an object that slides on fade to rest; these moved just before, and now not at all.
    const bool halted = calm_ && thing.lively > memory_.tolerance && !(along >= TAKEN);
    if (halted || (dots_.count() >= ENOUGH && along < TAKEN)) return 1;
    return dots_.turns() && !stopped(thing) ? REST_AFTER_TURN : REST_AFTER_GROSS;
}

double ObjectRest::taken_along() const {
    const Vec3 lag = -1.0 * dots_.mean_residual(dots_.expected());
    const double way = length(lag);
    if (way < BRISK * memory_.tolerance || dots_.turns()) return NAN;
    const auto centre = [&](const double* score) { return region_centre(grid_, members_, score, now_.places); };
    return dot(centre(now_.score) - centre(last_.score), lag) / (way * way);
}

double ObjectRest::clear() const {
    return CLEAR * memory_.noise * std::sqrt(2 / static_cast<double>(dots_.count()));
}

bool ObjectRest::stopped(const TouchingObject& thing) const {
    double middle[3];  // medians of three frames each, the newest first
    for (int k = 0; k < 3; ++k) middle[k] = median_with_unknown({thing.drift[3 * k], thing.drift[3 * k + 1], thing.drift[3 * k + 2]});
    const bool steady = thing.slid >= static_cast<int>(thing.drift.size()) && middle[1] > clear();
    return thing.lively > LIVELY * memory_.tolerance ||
           (steady && thing.drift[0] < clear() && middle[0] * middle[2] < SUDDEN * middle[1] * middle[1]);
}

bool ObjectRest::creeps(const TouchingObject& thing) const {
    return dots_.turns() && thing.drift[0] > std::max(clear(), -dots_.moved_along_drags({}) / static_cast<double>(dots_.count()));
}

}  // namespace tactile
