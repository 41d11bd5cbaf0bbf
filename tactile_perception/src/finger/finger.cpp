// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "finger/finger.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactile::finger {
namespace {

constexpr double FAR = std::numeric_limits<double>::infinity();
constexpr double AT_ONCE = 0.01;    // s, longest time that is judged at once. Derived: one period of lamps on 50 Hz mains
constexpr double STEP_SAMPLES = 3;  // that determine a step of ambient light, at least. Chosen
constexpr double LIT = 3;           // standard deviations of the total, from which a position is computed. Chosen
constexpr double LEAST = 4;         // standard deviations of the total, lowest threshold of contact. Chosen
constexpr double STUCK = 50;    // equal samples in a row that mark an output as stuck. Chosen: noise of one count makes 50 in a row very
                                // unlikely
constexpr double GAP = 0.003;   // s without samples, beyond which neighbours are not compared. Chosen: an object moves little in it
constexpr double APART = 0.02;  // s without contact, after which it is a new one for the light that it holds. Chosen: less is noise about
                                // the threshold
constexpr double LOST = 0.1;    // s without samples, after which a contact is a new one. Chosen: shorter than two presses of a finger
constexpr double LONGEST_STEP = 1;  // s between single samples of unknown rate. Chosen, as in finger/stage.py
constexpr double HIGHEST = 1e12;    // V. Chosen: beyond any signal, and squares stay far from overflow

bool is_known(const Eigen::Vector4d& volts) {
    return (volts.array().abs() <= HIGHEST).all();  // not of NaN
}

// A time as a number of samples, of those that are given.
std::ptrdiff_t count_of(double seconds, double least, double period, std::ptrdiff_t given) {
    return static_cast<std::ptrdiff_t>(std::min(std::max(std::floor(seconds / period), least), static_cast<double>(given)));
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
      reference_(settings.reference_seconds, settings.fastest_drift),
      detector_(settings.threshold),
      apart_s_(FAR),
      creep_(model_->creep) {}

void PsdFinger::set_reference() {
    reference_.reset();
    detector_.reset();
}

void PsdFinger::interrupt(double seconds) {
    if (seconds > GAP) {
        detector_.interrupt();
        held_.interrupt();
        apart_s_ = FAR;
        last_.setConstant(UNKNOWN);
        same_.setZero();
    }
    if (seconds > LOST) detector_.reset();
}

Samples PsdFinger::detect(const Volts& volts, double period) {
    count_repeats(volts);
    Samples found;
    found.sums.setConstant(4, volts.cols(), UNKNOWN);
    const std::ptrdiff_t at_once = count_of(AT_ONCE, 1, period, volts.cols());
    for (std::ptrdiff_t begin = 0; begin < volts.cols();)
        begin += detect_some(volts.middleCols(begin, std::min(at_once, volts.cols() - begin)), period, found);
    return found;
}

// An output that is saturated stands still for that.
void PsdFinger::count_repeats(const Volts& volts) {
    for (std::ptrdiff_t k = 0; k < volts.cols(); ++k) {
        for (int i = 0; i < 4; ++i) {
            const double now = volts(i, k);
            same_[i] = now < settings_.saturation ? (now == last_[i] ? same_[i] + 1 : 1) : 0;
            last_[i] = now;
        }
    }
}

// Adds the states of the first samples, at least one; returns how many.
std::ptrdiff_t PsdFinger::detect_some(const Volts& volts, double period, Samples& found) {
    std::ptrdiff_t count = 0;
    const bool known = is_known(volts.col(0));
    while (count < volts.cols() && is_known(volts.col(count)) == known) ++count;
    if (!known) {
        interrupt(static_cast<double>(count) * period);
        return pass_unknown(count, found);
    }
    if (!reference_.ready()) return pass_unknown(reference_.measure(volts.leftCols(count), period), found);

    const double sigma = reference_.sigma();
    Eigen::Matrix4Xd sums(4, count);
    std::vector<double> totals(count), over(count, -FAR);
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        sums.col(k) = mix(volts.col(k) - reference_.offset());
        totals[k] = sums(TOTAL, k);
        const Eigen::Vector2d place = centroid(sums.col(k));
        if (!(totals[k] > LIT * sigma) || place.hasNaN()) continue;
        const double level = Cell(*model_, place).value(LEVEL);
        over[k] = totals[k] - std::max(LEAST * sigma, level);  // a level of NaN is none
    }
    const bool was_touching = detector_.touching();
    const ContactStates states = detector_.detect(totals, over, sigma, period);
    const std::ptrdiff_t used = static_cast<std::ptrdiff_t>(states.contact.size());
    const std::ptrdiff_t inside = std::count(states.contact.begin(), states.contact.end(), 1);
    sums.conservativeResize(4, used);
    std::vector<std::uint8_t> saturated(used);
    for (std::ptrdiff_t k = 0; k < used; ++k) saturated[k] = (volts.col(k).array() >= settings_.saturation).any();
    if (inside < used) follow_ambient_light(sums, states, period);
    if (inside > 0 && std::isnan(settings_.threshold))
        hold(sums, states, saturated, period, !(was_touching && states.contact[0]) && apart_s_ > APART);
    apart_s_ = inside > 0 ? 0 : apart_s_ + static_cast<double>(used) * period;

    found.sums.middleCols(found.size(), used) = sums;
    for (std::ptrdiff_t k = 0; k < used; ++k) {
        const bool before = k > 0 ? states.contact[k - 1] : was_touching;
        if (states.contact[k] && !before) ++id_;
        found.id.push_back(states.contact[k] ? id_ : 0);
    }
    found.known.insert(found.known.end(), used, 1);
    found.contact.insert(found.contact.end(), states.contact.begin(), states.contact.end());
    found.saturated.insert(found.saturated.end(), saturated.begin(), saturated.end());
    return used;
}

std::ptrdiff_t PsdFinger::pass_unknown(std::ptrdiff_t count, Samples& found) const {
    found.known.insert(found.known.end(), count, 0);
    found.contact.insert(found.contact.end(), count, 0);
    found.saturated.insert(found.saturated.end(), count, 0);
    found.id.insert(found.id.end(), count, 0);
    return count;
}

// The reference follows samples outside contact.
void PsdFinger::follow_ambient_light(const Eigen::Matrix4Xd& sums, const ContactStates& states, double period) {
    const Eigen::Vector4d at = reference_.offset();
    for (std::ptrdiff_t k = 0; k < sums.cols(); ++k) {
        if (!states.contact[k] && states.settled[k]) reference_.follow(sums.col(k), at, period);
    }
    if (!states.ambient_step) return;
    reference_.shift(unmix(sums.rightCols(count_of(AT_ONCE, STEP_SAMPLES, period, sums.cols())).rowwise().mean()));
}

// Corrects the sums in contact for ambient light that changes during it; the offset follows what is certain. begins: the contact is new.
void PsdFinger::hold(Eigen::Matrix4Xd& sums, const ContactStates& states, const std::vector<std::uint8_t>& saturated, double period,
                     bool begins) {
    reference_.hold(static_cast<double>(sums.cols()) * period);
    if (begins) {
        reference_.drop();
        held_.begin(reference_.offset(), model_->room.hasNaN() ? reference_.offset() : model_->room);
    }
    const HeldLight::Noise noise{reference_.noise(), std::hypot(model_->cross_volts, reference_.uncertainty_across()), period};
    if (const auto lasting = held_.follow(sums, states.contact, saturated, *model_, noise)) reference_.shift(unmix(*lasting));
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
    const double room_volts = std::hypot(2 * reference_.uncertainty(), held_.shaded_volts());
    const LightErrors errors{reference_.noise(), held_.room(), room_volts, held_.lamp_volts(reference_.sigma()), is_stuck()};
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
    } else if (0 < since && since < LONGEST_STEP) {
        period = since;
    } else {
        interrupt(FAR);
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
    return {same_[0] >= STUCK, same_[1] >= STUCK, same_[2] >= STUCK, same_[3] >= STUCK};
}

bool PsdFinger::is_stuck() const {
    return same_.maxCoeff() >= STUCK;
}

}  // namespace tactile::finger
