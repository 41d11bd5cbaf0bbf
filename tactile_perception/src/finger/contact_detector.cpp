// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "finger/contact_detector.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tactile::finger {
namespace {

// Chosen, in standard deviations of the untouched total: thresholds of an object. The tests fail with ON of 2.5 and 10, and pass with OFF
// of 1.5 to 6.
constexpr double ON = 5, OFF = 3;
constexpr double HALF = 3;  // standard deviations of the untouched total: half the hysteresis. Derived: noise crosses it once in 700 samples
constexpr double RISEN = 3;  // standard deviations by which light must have risen before an onset. Chosen: the tests fail at 1.5, pass at 6
constexpr double BEFORE_S = 0.002, BEFORE = 4;  // s, and samples at least, in which that rise is looked for. Chosen
constexpr double JUDGE_S = 0.02, JUDGE = 6;     // s, and samples at least, that a sudden onset is watched. Derived: two periods of lamps on
                                                // 50 Hz mains
constexpr double GROWS = 5,
                 GROWS_BY = 0.1;  // standard deviations, and part of the light, of a growth that ambient light does not show. Chosen
constexpr double FLAT = 0.02;     // part of the light that ambient light may change by between the halves of that time. Chosen

double mean(const double* begin, const double* end) {
    return std::accumulate(begin, end, 0.0) / static_cast<double>(end - begin);
}

// The last so many seconds, at least so many, as a number of samples; of a vector that holds them, or all of it.
std::size_t count_of(double seconds, double least, double period, std::size_t most) {
    return static_cast<std::size_t>(std::min(std::max(std::ceil(seconds / period), least), static_cast<double>(most)));
}

}  // namespace

void ProximityDetector::reset() {
    near_ = false;
    interrupt();
}

void ProximityDetector::interrupt() {
    before_.clear();
    watching_ = false;
}

ProximityDetector::State ProximityDetector::add(double total, double sigma, double period) {
    const bool near = total > ON * sigma || (near_ && !(total < OFF * sigma));
    if (!watching_ && near && !near_ && !rises(sigma, period)) {
        watching_ = true;
        watched_.clear();
    }
    const State state = watching_ ? watch(total, sigma, period) : near ? OBJECT : NOTHING;
    near_ = state == OBJECT;
    watching_ = state == WATCHED;
    if (state == AMBIENT_STEP) {
        before_.clear();
        return state;
    }
    before_.push_back(total);
    const std::size_t kept = count_of(BEFORE_S, BEFORE, period, before_.size());
    if (before_.size() >= 2 * kept + 64) before_.erase(before_.begin(), before_.end() - static_cast<std::ptrdiff_t>(kept));
    return state;
}

ProximityDetector::State ProximityDetector::watch(double total, double sigma, double period) {
    watched_.push_back(total);
    if (total < OFF * sigma) return PASSED;  // a single spike
    if (total > (1 + GROWS_BY) * watched_.front() + GROWS * sigma) return OBJECT;
    if (static_cast<double>(watched_.size()) < std::max(std::ceil(JUDGE_S / period), JUDGE)) return WATCHED;
    return stays(sigma) ? AMBIENT_STEP : OBJECT;
}

// Whether the light has risen before the onset.
bool ProximityDetector::rises(double sigma, double period) const {
    const std::size_t count = count_of(BEFORE_S, BEFORE, period, before_.size());
    if (static_cast<double>(count) < BEFORE) return true;
    const double *end = before_.data() + before_.size(), light = mean(end - count, end);
    return before_.back() > RISEN * sigma || light > RISEN * sigma / std::sqrt(static_cast<double>(count));
}

bool ProximityDetector::stays(double sigma) const {
    const std::size_t half = watched_.size() / 2;
    const double *begin = watched_.data(), *end = begin + watched_.size(), second = mean(begin + half, end);
    return std::abs(second - mean(begin, begin + half)) < RISEN * sigma * std::sqrt(2 / static_cast<double>(half)) + FLAT * second;
}

void ContactDetector::reset() {
    touching_ = seen_ = false;
    proximity_.reset();
}

void ContactDetector::interrupt() {
    seen_ = false;
    proximity_.interrupt();
}

ContactStates ContactDetector::detect(const std::vector<double>& totals, const std::vector<double>& over, double sigma, double period) {
    ContactStates found;
    bool touching = touching_ && seen_;
    for (std::size_t k = 0; k < totals.size() && !found.ambient_step; ++k) {
        if (!std::isnan(threshold_)) {
            touching = totals[k] > threshold_;
            found.contact.push_back(touching);
            found.settled.push_back(touching);
            continue;
        }
        const ProximityDetector::State state = proximity_.add(totals[k], sigma, period);
        const bool near = state == ProximityDetector::OBJECT;
        touching = near && (over[k] > HALF * sigma || (touching && !(over[k] < -HALF * sigma)));
        found.contact.push_back(touching);
        found.settled.push_back(near || state == ProximityDetector::NOTHING);
        found.ambient_step = state == ProximityDetector::AMBIENT_STEP;
    }
    touching_ = touching;
    seen_ = true;
    return found;
}

}  // namespace tactile::finger
