// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "finger/light.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/median.hpp"

namespace tactile::finger {
namespace {

// What decides, with its reason; what half and double of each does: docs/psd_finger_method.md.
struct Rule {
    double certain = 5, quiet = 3;  // noises from which light has come or changed, and within which it has not: once in 1e6, 400 samples
    double rests = 5;               // periods of mains, alike, in which an object rests: shorter than any press by hand
    double flat = 0.2;              // s: so long no hand holds an object near without touching; after it a rest is forgotten
    double grows = 0.1;             // part of the light by which an object's grows in two periods of mains, and a lamp's does not
    double around = 0.2;            // half widths, from the centroid of the offset, which holds dark voltages, to a lamp's
    double apart = 0.05;            // half widths: how far the centroid moves when an object is pressed harder
    double brightest = 3;           // of the room's light, of a lamp: beyond it is a second object
    double shade = 0.05;            // of the room's light, that an object shades, and its standard deviation before it is measured
    double differs = 0.01;          // the same between objects, of all of the room's light
    double unseen = 0.5;            // s for which a drift goes on under a contact: half of a room's fastest period
    double acceleration = 0.2;      // 1/sqrt(s), as part of the fastest drift: a room takes seconds to come to that
};
constexpr Rule RULE;

constexpr double MAINS_S = 0.01;  // a period of lamps on 50 Hz mains, over which light is averaged; a lamp is switched within two
constexpr double MEMORY_S = 5;    // over which noise is averaged: some presses
constexpr double APART_S = 0.02;  // without contact, after which it is a new one for the light that it holds
constexpr double STEADY = 0.02;   // part of the light by which a lamp's varies, and an object's grows by creep
constexpr double LEAST = 4;       // noises of the total that a contact has at least, and by which what is alike differs at most
constexpr double BEFORE_S = 0.002, BEFORE = 4;  // s, and samples at least, in which light is averaged for a growth before an onset
constexpr double LEAST_SIGMA = 1e-4;            // V, floor of the total's standard deviation: keeps thresholds positive for noiseless input
constexpr std::size_t FEWEST = 5;               // samples of a measurement

double square(double value) {
    return value * value;
}

// Distance between the centroids of two lights on the detector, half widths.
double distance(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
    return std::hypot(a[X] / a[TOTAL] - b[X] / b[TOTAL], a[Y] / a[TOTAL] - b[Y] / b[TOTAL]);
}

// Standard deviation about the mean.
double deviation(const Eigen::ArrayXd& values) {
    return std::sqrt((values - values.mean()).square().mean());
}

// The cross term that is missing from light to which the shaded light is added, V; NaN where it is not known.
double missing_cross(const Eigen::Vector4d& light, const Eigen::Vector4d& shaded, const FingerModel& model) {
    const Eigen::Vector4d whole = light + shaded;
    const Eigen::Vector2d place = centroid(whole);
    if (!(light[TOTAL] > 0 && whole[TOTAL] > 0) || place.hasNaN()) return UNKNOWN;
    return whole[CROSS] - Cell(model, place).value(CROSS_PART) * whole[TOTAL];
}

}  // namespace

void Offset::start(const Eigen::Vector4d& level, const Eigen::Matrix4d& spread, double fastest) {
    // Light of the room changes in strength: the sums move together, nearly along the offset, which holds the dark voltages, too.
    const Eigen::Vector4d along = level / std::max(std::abs(level[TOTAL]), 1e-9);
    const Eigen::Matrix4d moves = along * along.transpose() + 0.001 * Eigen::Matrix4d::Identity();
    drift_ = square(fastest / 4) * moves;
    rate_ = square(RULE.acceleration * fastest) * moves;
    state_.setZero();
    jump(level, spread);
}

void Offset::jump(const Eigen::Vector4d& change, const Eigen::Matrix4d& spread) {
    state_.head<4>() += change;
    state_.tail<4>().setZero();
    spread_.setZero();
    spread_.topLeftCorner<4, 4>() = spread;
    spread_.bottomRightCorner<4, 4>() = drift_;
}

void Offset::predict(double seconds) {
    Eigen::Matrix<double, 8, 8> step = Eigen::Matrix<double, 8, 8>::Identity(), noise;
    step.topRightCorner<4, 4>() = seconds * Eigen::Matrix4d::Identity();
    noise << seconds * seconds * seconds / 3 * rate_, seconds * seconds / 2 * rate_, seconds * seconds / 2 * rate_, seconds * rate_;
    state_ = step * state_;
    spread_ = step * spread_ * step.transpose() + noise;
}

void Offset::correct(const Eigen::Vector4d& above, const Eigen::Matrix4d& noise, double seconds) {
    const Eigen::Vector4d measured = level() + above;
    predict(seconds);
    Eigen::Matrix<double, 4, 8> seen;
    seen << Eigen::Matrix4d::Identity(), -0.5 * seconds * Eigen::Matrix4d::Identity();
    const Eigen::Matrix<double, 8, 4> gain = spread_ * seen.transpose() * (seen * spread_ * seen.transpose() + noise).inverse();
    state_ += (gain * (measured - seen * state_)).eval();
    spread_ -= (gain * seen * spread_).eval();
    spread_ = (0.5 * (spread_ + spread_.transpose())).eval();
}

void Light::reset() {
    taken_.clear();
    have_s_ = 0;
    ready_ = false;
    release();
}

void Light::release() {
    touching_ = leaves_ = false;
    state_ = NOTHING;
    apart_s_ = std::numeric_limits<double>::infinity();
    flat_s_ = unseen_s_ = ahead_s_ = 0;
    clear_bin();
    interrupt();
}

void Light::interrupt() {
    seen_ = 0;
    if (state_ == WATCHED) state_ = NOTHING;
    apart_s_ = std::numeric_limits<double>::infinity();
    rest_.reset();
    bins_.clear();
    if (touching_) clear_bin();
    restless_s_ = 0;
}

void Light::clear_bin() {
    sum_.setZero();
    square_.setZero();
    count_ = 0;
}

// Averages. Where the total varies beyond its noise, only the darker half, so that a contact at the start does less harm.
void Light::measure() {
    const auto count = static_cast<std::ptrdiff_t>(taken_.size());
    Eigen::ArrayXd total(count);
    for (std::ptrdiff_t k = 0; k < count; ++k) total[k] = taken_[k][TOTAL];
    const double noise = deviation(total.tail(count - 1) - total.head(count - 1)) / std::sqrt(2.0) + 1e-12;
    const double most = deviation(total) > LEAST * noise ? median({total.begin(), total.end()}) : total.maxCoeff();
    std::vector<Eigen::Vector4d> used;
    std::copy_if(taken_.begin(), taken_.end(), std::back_inserter(used), [&](const Eigen::Vector4d& one) { return one[TOTAL] <= most; });
    Eigen::Vector4d mean = Eigen::Vector4d::Zero();
    for (const Eigen::Vector4d& one : used) mean += one / static_cast<double>(used.size());
    noise_ = LEAST_SIGMA * LEAST_SIGMA * Eigen::Matrix4d::Identity();
    for (const Eigen::Vector4d& one : used) noise_ += (one - mean) * (one - mean).transpose() / std::max<double>(used.size() - 1, 1);
    offset_.start(mean, noise_ / static_cast<double>(used.size()), fastest_);
    taken_.clear();
    ready_ = true;
}

std::optional<Eigen::Vector4d> Light::add(const Eigen::Vector4d& volts, double period, const FingerModel& model) {
    if (!ready_) {
        taken_.push_back(mix(volts));
        have_s_ += period;
        if (have_s_ >= seconds_ * (1 - 1e-9) && taken_.size() >= FEWEST) measure();
        return std::nullopt;
    }
    const Eigen::Vector4d sums = mix(volts) - offset_.level();
    if (!std::isnan(threshold_)) {
        touching_ = sums[TOTAL] > threshold_;
        return sums;
    }
    const bool lamp = watch(sums, period), was = touching_, touched = was && seen_ > 1;
    const Eigen::Vector2d place = centroid(sums);
    double over = -std::numeric_limits<double>::infinity();
    if (sums[TOTAL] > RULE.quiet * sigma() && !place.hasNaN())
        over = sums[TOTAL] - std::max(LEAST * sigma(), Cell(model, place).value(LEVEL));  // a level of NaN is none
    // Contact begins and ends at the light at first contact, with hysteresis.
    touching_ = state_ == NEAR && (over > RULE.quiet * sigma() || (touched && !(over < -RULE.quiet * sigma())));
    if (touching_) {
        if (!was && apart_s_ > APART_S) begin(model);
        apart_s_ = 0;
    } else {
        if (was) clear_bin();
        apart_s_ += period;
        if (state_ != WATCHED && !lamp) follow(sums, period);
    }
    return sums;
}

// Takes a sample into the state; returns whether it was the last one of a lamp's, which the offset then holds.
bool Light::watch(const Eigen::Vector4d& sums, double period) {
    const double total = sums[TOTAL], noise = sigma(), part = 1 / std::max(std::ceil(BEFORE_S / period), BEFORE);
    const bool grown = seen_ < BEFORE || last_ > RULE.quiet * noise || recent_ > RULE.quiet * noise * std::sqrt(part / (2 - part));
    recent_ = seen_ > 0 ? recent_ + part * (total - recent_) : total;
    last_ = total;
    ++seen_;
    if (state_ != WATCHED) {
        const bool near = total > RULE.certain * noise || (state_ == NEAR && !(total < RULE.quiet * noise));
        if (!near || state_ == NEAR || grown) {
            state_ = near ? NEAR : NOTHING;
            return false;
        }
        state_ = WATCHED;
        first_ = total;
        watched_ = 0;
        early_.setZero();
        late_.setZero();
    }
    const double half = std::max(std::ceil(MAINS_S / period), 3.0);
    (++watched_ > half ? late_ : early_) += sums / half;
    if (total < RULE.quiet * noise) {
        state_ = NOTHING;  // a single spike
    } else if (total > (1 + RULE.grows) * first_ + RULE.certain * noise) {
        state_ = NEAR;
    } else if (watched_ >= 2 * half) {
        const double change = std::abs(late_[TOTAL] - early_[TOTAL]);
        const bool steady = change < RULE.quiet * noise * std::sqrt(2 / half) + STEADY * late_[TOTAL];
        state_ = steady ? NOTHING : NEAR;
        if (steady) {
            offset_.jump(late_, noise_ / half);
            clear_bin();
            last_ = recent_ = 0;
        }
        return steady;
    }
    return false;
}

// Without contact the offset follows.
void Light::follow(const Eigen::Vector4d& sums, double period) {
    sum_ += sums;
    square_ += sums * sums.transpose();
    ++count_;
    if (count_ * period >= 2 * MAINS_S * (1 - 1e-9)) update(count_ * period);
}

void Light::update(double seconds) {
    const Eigen::Vector4d mean = sum_ / count_;
    const Eigen::Matrix4d noise = noise_ / count_;
    const double total = mean[TOTAL], scatter = sigma() / std::sqrt(count_), drift = fastest_ * (RULE.flat / 2 + unseen_s_);
    const bool left = leaves_;
    leaves_ = false;
    if (total < -RULE.quiet * scatter - fastest_ * seconds) {  // no object
        offset_.jump(mean, noise);
    } else if (total > RULE.quiet * std::hypot(scatter, uncertainty()) + drift) {  // an object near, or the room if it stays
        if (std::abs(total - flat_at_) > RULE.quiet * scatter + 2 * fastest_ * flat_s_) {
            flat_s_ = 0;
            flat_at_ = total;
        }
        flat_s_ += seconds;
        if (flat_s_ >= RULE.flat) {
            offset_.jump(mean, noise);
            flat_s_ = 0;
        }
    } else if (left) {
        offset_.predict(seconds);
    } else {
        flat_s_ = unseen_s_ = 0;
        offset_.correct(mean, noise, seconds);
        const double part = -std::expm1(-seconds / MEMORY_S);
        noise_ += part * (square_ / count_ + LEAST_SIGMA * LEAST_SIGMA * Eigen::Matrix4d::Identity() - noise_);
    }
    clear_bin();
}

void Light::begin(const FingerModel& model) {
    room_ = offset_.level();
    beyond_ = model.room.hasNaN() ? Eigen::Vector4d::Zero().eval() : (room_ - mix(model.room)).eval();
    since_s_ = restless_s_ = 0;
    doubtful_.setZero();
    now_.setZero();
    rest_.reset();
    bins_.clear();
    clear_bin();
}

void Light::hold(Eigen::Ref<Eigen::Matrix4Xd> sums, const std::uint8_t* contact, const std::uint8_t* saturated, double period,
                 const FingerModel& model) {
    if (!std::isnan(threshold_)) return;
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    double count = 0, inside = 0;
    for (std::ptrdiff_t k = 0; k < sums.cols(); ++k) {
        inside += contact[k];
        if (!contact[k] || saturated[k]) continue;
        sum += sums.col(k);
        ++count;
    }
    if (inside == 0) return;
    leaves_ = true;
    if (unseen_s_ < RULE.unseen) {
        unseen_s_ += inside * period;
        ahead_s_ += inside * period;
        if (ahead_s_ >= 2 * MAINS_S) {
            offset_.predict(ahead_s_);
            ahead_s_ = 0;
        }
    }
    if (count == 0) return;
    const Eigen::Vector4d mean = sum / count, level = offset_.level();
    Eigen::Vector4d added = Eigen::Vector4d::Zero();
    if (touching_) {
        sum_ += sum;
        count_ += count;
        if (count_ * period >= MAINS_S * (1 - 1e-9)) end_bin(period, model);
        added = level - offset_.level();
    }
    now_.setZero();
    if (rest_) {
        const Eigen::Vector4d change = mean + added - *rest_;
        const double noise = sigma() / std::sqrt(count);
        if (std::abs(change[TOTAL]) > RULE.quiet * noise && of_room(change, noise)) {
            if (of_contact(change, noise) || std::abs(change[TOTAL]) < RULE.certain * noise)
                now_ = change;
            else
                added -= change;
        }
    }
    added += shaded(shade_);
    for (std::ptrdiff_t k = 0; k < sums.cols(); ++k) {
        if (contact[k]) sums.col(k) += added;
    }
}

// Whether a change of the light may be the room's: of its centroid, and not too bright.
bool Light::of_room(const Eigen::Vector4d& change, double sigma) const {
    const double size = std::abs(change[TOTAL]), least = (std::copysign(1.0, change[TOTAL]) * unmix(change)).minCoeff();
    return room_[TOTAL] >= RULE.certain * sigma && least >= -sigma && size <= RULE.brightest * room_[TOTAL] &&
           distance(change, room_) < RULE.around + RULE.certain * sigma / size;
}

// Whether it may be the object's.
bool Light::of_contact(const Eigen::Vector4d& change, double sigma) const {
    const double off = distance(change, *rest_);
    return off < RULE.apart + RULE.certain * sigma / std::abs(change[TOTAL]) || off < distance(change, room_);
}

// Takes the mean of the present bin into account and begins the next one.
void Light::end_bin(double period, const FingerModel& model) {
    const double seconds = count_ * period, noise = sigma() / std::sqrt(count_);
    const Eigen::Vector4d light = sum_ / count_;
    since_s_ += seconds;
    restless_s_ += seconds;
    if (3 * MAINS_S < since_s_ && since_s_ <= 3 * MAINS_S + RULE.flat) measure_shade(light, seconds, model);
    clear_bin();
    bins_.push_back(light);
    if (bins_.size() > RULE.rests) bins_.erase(bins_.begin());
    if (bins_.size() == RULE.rests) {
        Eigen::Vector4d mean = Eigen::Vector4d::Zero(), least = light, most = light;
        for (const Eigen::Vector4d& bin : bins_) {
            mean += bin / RULE.rests;
            least = least.cwiseMin(bin);
            most = most.cwiseMax(bin);
        }
        if ((most - least).maxCoeff() <= LEAST * noise) judge_rest(mean, noise / std::sqrt(RULE.rests));
    }
    if (restless_s_ > RULE.flat) rest_.reset();
}

// The object rests with that light: what it differs from the last rest by is the room's, the object's, or may be either.
void Light::judge_rest(const Eigen::Vector4d& light, double sigma) {
    restless_s_ = 0;
    const Eigen::Vector4d change = rest_ ? (light - *rest_).eval() : Eigen::Vector4d::Zero().eval();
    const bool changed = std::abs(change[TOTAL]) > RULE.certain * sigma;
    const bool lamp = changed && of_room(change, sigma) && !of_contact(change, sigma);
    // What is left when the object goes.
    const double most = LEAST * sigma + STEADY * (rest_ ? (*rest_)[TOTAL] : 0);
    const bool came = doubtful_[TOTAL] > RULE.certain * sigma && ((light - doubtful_).array().abs() < most).all();
    const bool left = change[TOTAL] < 0 && changed && (came || (of_room(light, sigma) && !of_contact(light, sigma)));
    if (lamp || left) {
        offset_.jump(lamp ? change : light, noise_ / (RULE.rests * 10));
        bins_.clear();
        if (left) interrupt();
        return;
    }
    if (changed && of_room(change, sigma)) doubtful_ += change;
    rest_ = light;
}

// Information on the shaded part of the room's light before it is measured.
double Light::shade_known() const {
    const double all = std::max(std::abs(room_[TOTAL]), 1e-9);
    return 1 / square(std::max(RULE.shade * std::min(std::abs(beyond_[TOTAL]) / all, 1.0), RULE.differs));
}

// What the object shades of the room's light.
Eigen::Vector4d Light::shaded(double shade) const {
    return RULE.shade * beyond_ + shade * room_;
}

// Updates the shaded part by the cross term of a bin's light; its error by the model is the same in all bins of a contact.
void Light::measure_shade(const Eigen::Vector4d& light, double seconds, const FingerModel& model) {
    const double missing = missing_cross(light, shaded(shade_), model);
    const double slope = (missing_cross(light, shaded(shade_ + RULE.differs), model) - missing) / RULE.differs;
    const double each = noise_(CROSS, CROSS) / count_, same = square(model.cross_volts) + offset_.spread()(CROSS, CROSS);
    const double known = shade_known(), before = known + gained_, variance = each + same * RULE.flat / seconds;
    if (!(square(missing) <= square(LEAST) * (each + same + slope * slope / before))) return;  // two contacts
    const double after = std::min(before + slope * slope / variance, std::max(before, 1 / square(RULE.differs)));
    const double shade = shade_ - slope * missing / variance / after;
    if (std::isnan(shade)) return;
    const double expected = RULE.shade * beyond_[TOTAL], least = -expected / std::max(room_[TOTAL], expected);
    gained_ = after - known;
    shade_ = std::min(std::max(shade, std::min(least, 0.0)), 0.3);  // no object adds light, or shades most of it
}

LightErrors Light::errors() const {
    const double shaded_volts = std::abs(room_[TOTAL]) / std::sqrt(shade_known() + std::max(gained_, 0.0));
    return {noise_, room_, std::hypot(uncertainty(), shaded_volts), doubtful_ + now_, false};
}

}  // namespace tactile::finger
