// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "finger/finger.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "finger/constants.hpp"

namespace tactile::finger {
namespace {

constexpr double FOREVER_S = std::numeric_limits<double>::infinity();

bool is_known(const Eigen::Vector4d& volts) {
    return (volts.array().abs() <= FINGER.max_volts).all();  // not of NaN
}

}  // namespace

std::vector<std::pair<std::ptrdiff_t, std::ptrdiff_t>> Samples::runs() const {
    std::vector<std::pair<std::ptrdiff_t, std::ptrdiff_t>> found;
    for (std::ptrdiff_t k = 0; k < size(); ++k) {
        if (!known[k] || (!found.empty() && id[found.back().first] == id[k])) continue;
        if (!found.empty()) found.back().second = k;
        found.emplace_back(k, size());
    }
    return found;
}

PsdFinger::PsdFinger(std::shared_ptr<const FingerModel> model, const FingerSettings& settings)
    : model_(std::move(model)),
      settings_(settings),
      light_(settings.reference_seconds, settings.fastest_drift, settings.threshold),
      creep_(model_->creep) {}

void PsdFinger::set_reference() {
    light_.reset();
}

void PsdFinger::interrupt(double seconds) {
    gap_s_ += seconds;
    if (gap_s_ > FINGER.gap_s) {
        light_.interrupt();
        last_.setConstant(UNKNOWN);
        same_.setZero();
    }
    if (gap_s_ > FINGER.lost_s) light_.release();
}

Samples PsdFinger::detect(const Volts& volts, double period) {
    Samples found;
    found.sums.setConstant(4, volts.cols(), UNKNOWN);
    const auto at_once = std::max<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(std::min(FINGER.mains_s / period, 1e9)), 1);
    for (std::ptrdiff_t begin = 0; begin < volts.cols(); begin += at_once) {
        const std::ptrdiff_t count = std::min(at_once, volts.cols() - begin);
        for (std::ptrdiff_t k = begin; k < begin + count; ++k) add(volts.col(k), period, found);
        light_.hold(found.sums.middleCols(begin, count), &found.contact[begin], &found.saturated[begin], period, *model_);
    }
    return found;
}

// Adds the state of one sample.
void PsdFinger::add(const Eigen::Vector4d& volts, double period, Samples& found) {
    const auto at = static_cast<std::ptrdiff_t>(found.id.size());
    for (int i = 0; i < 4; ++i)  // a saturated output may be constant
        same_[i] = volts[i] < settings_.saturation ? (volts[i] == last_[i] ? same_[i] + 1 : 1) : 0;
    last_ = volts;
    std::optional<Eigen::Vector4d> sums;
    const bool was_touching = light_.touching();
    if (is_known(volts)) {
        gap_s_ = 0;
        sums = light_.add(volts, period, *model_);
    } else {
        interrupt(period);
    }
    const bool contact = sums && light_.touching();
    if (contact && !was_touching) ++id_;
    if (sums) found.sums.col(at) = *sums;
    found.known.push_back(sums.has_value());
    found.contact.push_back(contact);
    found.saturated.push_back(sums && (volts.array() >= settings_.saturation).any());
    found.id.push_back(contact ? id_ : 0);
}

std::optional<Touch> PsdFinger::touch(const Samples& samples, std::ptrdiff_t begin, std::ptrdiff_t end) const {
    MeanLight mean;
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    std::int64_t id = 0;
    for (std::ptrdiff_t k = begin; k < end; ++k) {
        mean.samples += samples.contact[k];
        mean.saturated |= samples.saturated[k] != 0;
        id = id ? id : samples.id[k];
        if (!samples.contact[k] || samples.saturated[k]) continue;
        sum += samples.sums.col(k);
        ++mean.used;
    }
    if (mean.samples == 0) return std::nullopt;
    mean.sums = sum / static_cast<double>(mean.used);
    LightErrors errors = light_.errors();
    errors.stuck = is_stuck();
    Touch found = estimate_touch(mean, errors, *model_, settings_.radius);
    found.id = id;
    return found;
}

Estimates PsdFinger::estimate(const Volts& volts, double stamp_s, double period) {
    Estimates found;
    const double since = stamp_s - last_s_;
    last_s_ = stamp_s;
    if (period > 0) {
        if (stamp_s > next_s_ + period) interrupt(stamp_s - next_s_);
    } else if (0 < since && since < FINGER.max_period_s) {
        period = since;
    } else {
        interrupt(FOREVER_S);
        found.needs_period = true;
        return found;
    }
    const Samples samples = detect(volts, period);
    for (const auto& [begin, end] : samples.runs()) {
        if (!settings_.each_sample) found.estimates.push_back(estimate_run(samples, {begin, end}, stamp_s, period));
        for (std::ptrdiff_t k = begin; settings_.each_sample && k < end; ++k) {
            if (samples.known[k]) found.estimates.push_back(estimate_run(samples, {k, k + 1}, stamp_s, period));
        }
    }
    next_s_ = stamp_s + static_cast<double>(volts.cols()) * period;
    return found;
}

// The result of a run, without creep.
Estimate PsdFinger::estimate_run(const Samples& samples, std::pair<std::ptrdiff_t, std::ptrdiff_t> run, double stamp_s, double period) {
    double sum = 0, known = 0;
    for (std::ptrdiff_t k = run.first; k < run.second; ++k) {
        sum += samples.known[k] ? static_cast<double>(k) : 0;
        known += samples.known[k];
    }
    Estimate found{sum / known, touch(samples, run.first, run.second)};
    if (found.touch) creep_.correct(*found.touch, stamp_s + found.at * period, settings_.radius);
    return found;
}

std::array<bool, 4> PsdFinger::stuck() const {
    std::array<bool, 4> found;
    for (int k = 0; k < 4; ++k) found[k] = same_[k] >= FINGER.stuck_samples;
    return found;
}

bool PsdFinger::is_stuck() const {
    return same_.maxCoeff() >= FINGER.stuck_samples;
}

}  // namespace tactile::finger
