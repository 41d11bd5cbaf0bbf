// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "finger/light.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/median.hpp"
#include "finger/constants.hpp"

namespace tactile::finger {
namespace {

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

// Cross term of light with the shaded light added, minus that of a single contact at its spot, V; NaN where it is not known.
double missing_cross(const Eigen::Vector4d& light, const Eigen::Vector4d& shaded, const FingerModel& model) {
    const Eigen::Vector4d whole = light + shaded;
    const Eigen::Vector2d spot = centroid(whole);
    if (!(light[TOTAL] > 0 && whole[TOTAL] > 0) || spot.hasNaN()) return UNKNOWN;
    return whole[CROSS] - Cell(model, spot).value(CROSS_PART) * whole[TOTAL];
}

}  // namespace

void Offset::start(const Eigen::Vector4d& level, const Eigen::Matrix4d& spread, double fastest) {
    // The light of the room changes in strength: the sums move together, nearly along the offset, which includes the dark voltages.
    const Eigen::Vector4d along = level / std::max(std::abs(level[TOTAL]), 1e-9);
    const Eigen::Matrix4d moves = along * along.transpose() + 0.001 * Eigen::Matrix4d::Identity();
    drift_ = square(fastest / 4) * moves;
    rate_ = square(FINGER.drift_acceleration * fastest) * moves;
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
    const double most = deviation(total) > FINGER.limit_sigmas * noise ? median({total.begin(), total.end()}) : total.maxCoeff();
    std::vector<Eigen::Vector4d> used;
    std::copy_if(taken_.begin(), taken_.end(), std::back_inserter(used), [&](const Eigen::Vector4d& one) { return one[TOTAL] <= most; });
    Eigen::Vector4d mean = Eigen::Vector4d::Zero();
    for (const Eigen::Vector4d& one : used) mean += one / static_cast<double>(used.size());
    noise_ = FINGER.min_sigma * FINGER.min_sigma * Eigen::Matrix4d::Identity();
    for (const Eigen::Vector4d& one : used) noise_ += (one - mean) * (one - mean).transpose() / std::max<double>(used.size() - 1, 1);
    offset_.start(mean, noise_ / static_cast<double>(used.size()), fastest_);
    taken_.clear();
    ready_ = true;
}

std::optional<Eigen::Vector4d> Light::add(const Eigen::Vector4d& volts, double period, const FingerModel& model) {
    if (!ready_) {
        taken_.push_back(mix(volts));
        have_s_ += period;
        if (have_s_ >= seconds_ * (1 - 1e-9) && taken_.size() >= FINGER.min_samples) measure();
        return std::nullopt;
    }
    const Eigen::Vector4d sums = mix(volts) - offset_.level();
    if (!std::isnan(threshold_)) {
        touching_ = sums[TOTAL] > threshold_;
        return sums;
    }
    const bool is_lamp = watch(sums, period), was_touching = touching_, touched = was_touching && seen_ > 1;
    const Eigen::Vector2d spot = centroid(sums);
    double over = -std::numeric_limits<double>::infinity();
    if (sums[TOTAL] > FINGER.quiet_sigmas * sigma() && !spot.hasNaN())
        over = sums[TOTAL] - std::max(FINGER.limit_sigmas * sigma(), Cell(model, spot).value(LEVEL));
    // Contact begins and ends at the light at first contact, with hysteresis.
    touching_ = state_ == NEAR && (over > FINGER.quiet_sigmas * sigma() || (touched && !(over < -FINGER.quiet_sigmas * sigma())));
    if (touching_) {
        if (!was_touching && apart_s_ > FINGER.new_contact_s) begin(model);
        apart_s_ = 0;
    } else {
        if (was_touching) clear_bin();
        apart_s_ += period;
        if (state_ != WATCHED && !is_lamp) follow(sums, period);
    }
    return sums;
}

// Updates the state by a sample; returns whether it completes the onset of a lamp, whose light is now part of the offset.
bool Light::watch(const Eigen::Vector4d& sums, double period) {
    const double total = sums[TOTAL], noise = sigma(), part = 1 / std::max(std::ceil(FINGER.history_s / period), FINGER.min_history);
    const bool grown = seen_ < FINGER.min_history || last_ > FINGER.quiet_sigmas * noise ||
                       recent_ > FINGER.quiet_sigmas * noise * std::sqrt(part / (2 - part));
    recent_ = seen_ > 0 ? recent_ + part * (total - recent_) : total;
    last_ = total;
    ++seen_;
    if (state_ != WATCHED) {
        const bool near = total > FINGER.change_sigmas * noise || (state_ == NEAR && !(total < FINGER.quiet_sigmas * noise));
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
    const double half = std::max(std::ceil(FINGER.mains_s / period), 3.0);
    (++watched_ > half ? late_ : early_) += sums / half;
    if (total < FINGER.quiet_sigmas * noise) {
        state_ = NOTHING;  // a single spike
    } else if (total > (1 + FINGER.growth) * first_ + FINGER.change_sigmas * noise) {
        state_ = NEAR;
    } else if (watched_ >= 2 * half) {
        const double change = std::abs(late_[TOTAL] - early_[TOTAL]);
        const bool steady = change < FINGER.quiet_sigmas * noise * std::sqrt(2 / half) + FINGER.steady_share * late_[TOTAL];
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

// Follows the offset without contact.
void Light::follow(const Eigen::Vector4d& sums, double period) {
    sum_ += sums;
    square_ += sums * sums.transpose();
    ++count_;
    if (count_ * period >= 2 * FINGER.mains_s * (1 - 1e-9)) update(count_ * period);
}

void Light::update(double seconds) {
    const Eigen::Vector4d mean = sum_ / count_;
    const Eigen::Matrix4d noise = noise_ / count_;
    const double total = mean[TOTAL], scatter = sigma() / std::sqrt(count_), drift = fastest_ * (FINGER.steady_s / 2 + unseen_s_);
    const bool was_touched = leaves_;
    leaves_ = false;
    if (total < -FINGER.quiet_sigmas * scatter - fastest_ * seconds) {  // no object sends less than nothing
        offset_.jump(mean, noise);
    } else if (total >
               FINGER.quiet_sigmas * std::hypot(scatter, uncertainty()) + drift) {  // an object that is near, or ambient light if it stays
        if (std::abs(total - flat_at_) > FINGER.quiet_sigmas * scatter + 2 * fastest_ * flat_s_) {
            flat_s_ = 0;
            flat_at_ = total;
        }
        flat_s_ += seconds;
        if (flat_s_ >= FINGER.steady_s) {
            offset_.jump(mean, noise);
            flat_s_ = 0;
        }
    } else if (was_touched) {
        offset_.predict(seconds);
    } else {
        flat_s_ = unseen_s_ = 0;
        offset_.correct(mean, noise, seconds);
        const double part = -std::expm1(-seconds / FINGER.noise_memory_s);
        noise_ += part * (square_ / count_ + FINGER.min_sigma * FINGER.min_sigma * Eigen::Matrix4d::Identity() - noise_);
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
    if (unseen_s_ < FINGER.extrapolation_s) {
        unseen_s_ += inside * period;
        ahead_s_ += inside * period;
        if (ahead_s_ >= 2 * FINGER.mains_s) {
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
        if (count_ * period >= FINGER.mains_s * (1 - 1e-9)) end_bin(period, model);
        added = level - offset_.level();
    }
    now_.setZero();
    if (rest_) {
        const Eigen::Vector4d change = mean + added - *rest_;
        const double noise = sigma() / std::sqrt(count);
        if (std::abs(change[TOTAL]) > FINGER.quiet_sigmas * noise && of_room(change, noise)) {
            if (of_contact(change, noise) || std::abs(change[TOTAL]) < FINGER.change_sigmas * noise)
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

// Whether a change of the light may be the room's: it has the room's centroid, and is not too bright.
bool Light::of_room(const Eigen::Vector4d& change, double sigma) const {
    const double size = std::abs(change[TOTAL]), least = (std::copysign(1.0, change[TOTAL]) * unmix(change)).minCoeff();
    return room_[TOTAL] >= FINGER.change_sigmas * sigma && least >= -sigma && size <= FINGER.max_lamp * room_[TOTAL] &&
           distance(change, room_) < FINGER.lamp_radius + FINGER.change_sigmas * sigma / size;
}

// Whether it may be the object's.
bool Light::of_contact(const Eigen::Vector4d& change, double sigma) const {
    const double to_object = distance(change, *rest_);
    return to_object < FINGER.object_radius + FINGER.change_sigmas * sigma / std::abs(change[TOTAL]) || to_object < distance(change, room_);
}

// Processes the mean of the present bin and starts the next one.
void Light::end_bin(double period, const FingerModel& model) {
    const double seconds = count_ * period, noise = sigma() / std::sqrt(count_);
    const Eigen::Vector4d light = sum_ / count_;
    since_s_ += seconds;
    restless_s_ += seconds;
    if (3 * FINGER.mains_s < since_s_ && since_s_ <= 3 * FINGER.mains_s + FINGER.steady_s) measure_shade(light, seconds, model);
    clear_bin();
    bins_.push_back(light);
    if (bins_.size() > FINGER.rest_periods) bins_.erase(bins_.begin());
    if (bins_.size() == FINGER.rest_periods) {
        Eigen::Vector4d mean = Eigen::Vector4d::Zero(), least = light, most = light;
        for (const Eigen::Vector4d& bin : bins_) {
            mean += bin / FINGER.rest_periods;
            least = least.cwiseMin(bin);
            most = most.cwiseMax(bin);
        }
        if ((most - least).maxCoeff() <= FINGER.limit_sigmas * noise) judge_rest(mean, noise / std::sqrt(FINGER.rest_periods));
    }
    if (restless_s_ > FINGER.steady_s) rest_.reset();
}

// The object rests with that light: its difference from the last rest is the room's, the object's, or may be either.
void Light::judge_rest(const Eigen::Vector4d& light, double sigma) {
    restless_s_ = 0;
    const Eigen::Vector4d change = rest_ ? (light - *rest_).eval() : Eigen::Vector4d::Zero().eval();
    const bool changed = std::abs(change[TOTAL]) > FINGER.change_sigmas * sigma;
    const bool lamp = changed && of_room(change, sigma) && !of_contact(change, sigma);
    // Light that remains when the object leaves.
    const double most = FINGER.limit_sigmas * sigma + FINGER.steady_share * (rest_ ? (*rest_)[TOTAL] : 0);
    const bool came = doubtful_[TOTAL] > FINGER.change_sigmas * sigma && ((light - doubtful_).array().abs() < most).all();
    const bool left = change[TOTAL] < 0 && changed && (came || (of_room(light, sigma) && !of_contact(light, sigma)));
    if (lamp || left) {
        offset_.jump(lamp ? change : light, noise_ / (FINGER.rest_periods * 10));
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
    return 1 / square(std::max(FINGER.shade * std::min(std::abs(beyond_[TOTAL]) / all, 1.0), FINGER.shade_deviation));
}

// Light of the room that the object shades.
Eigen::Vector4d Light::shaded(double shade) const {
    return FINGER.shade * beyond_ + shade * room_;
}

// Updates the shaded share by the cross term of a bin's light; the error of the model is the same in all bins of a contact.
void Light::measure_shade(const Eigen::Vector4d& light, double seconds, const FingerModel& model) {
    const double missing = missing_cross(light, shaded(shade_), model);
    const double slope = (missing_cross(light, shaded(shade_ + FINGER.shade_deviation), model) - missing) / FINGER.shade_deviation;
    const double each = noise_(CROSS, CROSS) / count_, same = square(model.cross_volts) + offset_.spread()(CROSS, CROSS);
    const double known = shade_known(), before = known + gained_, variance = each + same * FINGER.steady_s / seconds;
    if (!(square(missing) <= square(FINGER.limit_sigmas) * (each + same + slope * slope / before)))
        return;  // two contacts: the cross term is not that of one
    const double after = std::min(before + slope * slope / variance, std::max(before, 1 / square(FINGER.shade_deviation)));
    const double shade = shade_ - slope * missing / variance / after;
    if (std::isnan(shade)) return;
    const double expected = FINGER.shade * beyond_[TOTAL], least = -expected / std::max(room_[TOTAL], expected);
    gained_ = after - known;
    shade_ = std::min(std::max(shade, std::min(least, 0.0)), FINGER.max_shade);  // no object adds light
}

LightErrors Light::errors() const {
    const double shaded_volts = std::abs(room_[TOTAL]) / std::sqrt(shade_known() + std::max(gained_, 0.0));
    return {noise_, room_, std::hypot(uncertainty(), shaded_volts), doubtful_ + now_, false};
}

}  // namespace tactile::finger
