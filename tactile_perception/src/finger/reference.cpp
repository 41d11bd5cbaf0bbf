// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "finger/reference.hpp"

#include <cmath>

#include "common/median.hpp"

namespace tactile::finger {
namespace {

// 1/sqrt(s): changes of the drift within a second, as parts of the fastest. Chosen on simulated rooms that are calm, and that drift by 0.1
// V within seconds: more filters between them do no better.
constexpr double ACCELERATIONS[] = {0.01, 0.3};
constexpr double MEMORY = 5;  // s in which the weights fade. Chosen: some presses
// Standard deviation of the drift beforehand, as part of the fastest, of each filter. Chosen on such rooms: a calm one is known as calm
// from its first second on.
constexpr double FIRST_DRIFTS[] = {0.03, 0.3};
constexpr double BASE = 5, LEARNT = 20;  // s: changes are those from the mean of the first, and are remembered for the second. Chosen
constexpr double FIRST_WEIGHT = 3e-4;    // V^2 s: squared changes, over their time, that count as much as the first direction. Chosen: a
                                         // tenth is as good

constexpr double SLOW = 0.1;          // s of the fastest drift that are no object. Chosen: 10 mV of 0.1 V/s
constexpr double UNSEEN = 0.5;        // s, longest time for which drift goes on under a contact. Chosen: a lasting one shows nothing of it
constexpr double FAST = 0.02;         // s, time constant of falling light, which no contact causes. Chosen: one update
constexpr double NOISE = 5;           // s, time constant of the noise. Chosen
constexpr double UPDATE = 0.02;       // s, between updates. Chosen: two periods of lamps on 50 Hz mains
constexpr double FLAT = 0.2;          // s: light that is constant for so long, without contact, is ambient. Chosen: twice SLOW
constexpr double QUIET = 3;           // standard deviations of the total within which nothing is near. Chosen
constexpr double LEAST_SIGMA = 1e-4;  // V, floor of the total's standard deviation: keeps thresholds positive for noiseless input
constexpr double VARIES = 4;          // noises by which the total of an untouched finger varies at most. Chosen
constexpr std::size_t FEWEST = 5;     // samples of a measurement. Chosen

Eigen::Vector4d unit(const Eigen::Vector4d& vector) {
    return vector / std::max(vector.norm(), 1e-9);
}

// Standard deviation about the mean.
double deviation(const Eigen::ArrayXd& values) {
    return std::sqrt((values - values.mean()).square().mean());
}

}  // namespace

DriftFilter::DriftFilter(const Eigen::Vector4d& offset, double variance, double fastest)
    : fastest_(fastest), first_(unit(offset)), room_(first_), base_(offset), changes_(Eigen::Vector4d::Zero()) {
    score_.setZero();
    weigh();
    for (Filter& filter : filters_) filter.offset = offset;
    restart(variance);
}

void DriftFilter::restart(double variance) {
    for (int k = 0; k < FILTERS; ++k) {
        const double drift = FIRST_DRIFTS[k] * fastest_;
        filters_[k].drift.setZero();
        filters_[k].spread << variance, 0, 0, drift * drift;
    }
}

void DriftFilter::weigh() {
    weights_ = score_.exp();
    weights_.colwise() /= weights_.rowwise().sum().eval();
}

Eigen::Vector4d DriftFilter::offset() const {
    Eigen::Vector4d across = Eigen::Vector4d::Zero();
    double more_along = 0;
    for (int k = 0; k < FILTERS; ++k) {
        across += weights_(1, k) * filters_[k].offset;
        more_along += (weights_(0, k) - weights_(1, k)) * filters_[k].offset.dot(room_);
    }
    return across + more_along * room_;
}

Eigen::Vector2d DriftFilter::variances() const {
    Eigen::Vector2d found = Eigen::Vector2d::Zero();
    for (int k = 0; k < FILTERS; ++k) found += weights_.col(k).matrix() * filters_[k].spread(0, 0);
    return found;
}

void DriftFilter::move(const Eigen::Vector4d& change) {
    for (Filter& filter : filters_) filter.offset += change;
    base_ += change;
}

void DriftFilter::predict(double seconds) {
    Eigen::Matrix2d step, noise;
    step << 1, seconds, 0, 1;
    noise << seconds * seconds * seconds / 3, seconds * seconds / 2, seconds * seconds / 2, seconds;
    for (int k = 0; k < FILTERS; ++k) {
        const double acceleration = ACCELERATIONS[k] * fastest_;
        filters_[k].offset += seconds * filters_[k].drift;
        filters_[k].spread = (step * filters_[k].spread * step.transpose() + acceleration * acceleration * noise).eval();
    }
}

void DriftFilter::correct(const Eigen::Vector4d& change, double variance, double seconds) {
    const Eigen::Vector4d measured = offset() + change;
    predict(seconds);
    for (int k = 0; k < FILTERS; ++k) {
        Filter& filter = filters_[k];
        const Eigen::Vector4d innovation = measured - (filter.offset - 0.5 * seconds * filter.drift);
        const double expected = filter.spread(0, 0) + variance, along = std::pow(innovation.dot(room_), 2);
        const Eigen::Array2d square{along, innovation.squaredNorm() - along}, outputs{1, 3};
        score_.col(k) = score_.col(k) * std::exp(-seconds / MEMORY) - 0.5 * (square / expected + outputs * std::log(expected));
        const Eigen::Vector2d gain = filter.spread.col(0) / expected;
        filter.offset += gain[0] * innovation;
        filter.drift += gain[1] * innovation;
        filter.spread -= (gain * filter.spread.row(0)).eval();
    }
    score_.colwise() -= score_.rowwise().maxCoeff().eval();
    weigh();
    learn_direction(seconds);
}

// The direction in which the room's light changes, from how the offset has changed of late.
void DriftFilter::learn_direction(double seconds) {
    const Eigen::Vector4d change = offset() - base_;
    base_ += (1 - std::exp(-seconds / BASE)) * change;
    changes_ = changes_ * std::exp(-seconds / LEARNT) + seconds * change.dot(room_) * change;
    room_ = unit(FIRST_WEIGHT * first_ + changes_);
}

Reference::Reference(double seconds, double fastest)
    : seconds_(seconds), fastest_(fastest), drift_(Eigen::Vector4d::Zero(), 0, fastest / 4) {
    take_noise(Eigen::Matrix4d::Zero());
    use_drift();
    reset();
}

void Reference::reset() {
    taken_.clear();
    have_s_ = ahead_s_ = flat_s_ = flat_at_ = unseen_s_ = 0;
    clear_sums();
    ready_ = leaves_ = false;
}

void Reference::clear_sums() {
    sum_.setZero();
    square_.setZero();
    count_ = 0;
}

void Reference::use_drift() {
    offset_ = drift_.offset();
    uncertainty_ = 2 * drift_.variances().cwiseSqrt();
}

void Reference::take_noise(const Eigen::Matrix4d& noise) {
    noise_ = noise;
    sigma_ = std::sqrt(noise(TOTAL, TOTAL));
}

std::ptrdiff_t Reference::measure(const Eigen::Ref<const Eigen::Matrix4Xd>& volts, double period) {
    const double missing = std::max(std::ceil((seconds_ - have_s_) / period - 1e-9), 1.0), given = static_cast<double>(volts.cols());
    const std::ptrdiff_t used = missing < given ? static_cast<std::ptrdiff_t>(missing) : volts.cols();
    for (std::ptrdiff_t k = 0; k < used; ++k) taken_.emplace_back(volts.col(k));
    have_s_ += static_cast<double>(used) * period;
    if (missing <= given && taken_.size() >= FEWEST) settle();
    return used;
}

// Averages. Where the total varies beyond its noise, only the darker half, so that a contact at the start does less harm.
void Reference::settle() {
    const std::ptrdiff_t count = static_cast<std::ptrdiff_t>(taken_.size());
    Eigen::ArrayXd total(count);
    for (std::ptrdiff_t k = 0; k < count; ++k) total[k] = taken_[k].sum();
    const double noise = deviation(total.tail(count - 1) - total.head(count - 1)) / std::sqrt(2.0) + 1e-12;
    const double most = deviation(total) > VARIES * noise ? median({total.begin(), total.end()}) : total.maxCoeff();
    Eigen::Vector4d mean = Eigen::Vector4d::Zero();
    double used = 0;
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        if (total[k] > most) continue;
        mean += taken_[k];
        ++used;
    }
    mean /= used;
    Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        const Eigen::Vector4d sums = mix(taken_[k] - mean);
        if (total[k] <= most) squares += sums * sums.transpose();
    }
    take_noise(squares / std::max(used - 1, 1.0) + LEAST_SIGMA * LEAST_SIGMA * Eigen::Matrix4d::Identity());
    taken_.clear();
    ready_ = true;
    drift_ = DriftFilter(mean, sigma_ * sigma_ / (4 * used), fastest_ / 4);
    use_drift();
}

void Reference::follow(Eigen::Vector4d sums, const Eigen::Vector4d& at, double period) {
    sums += mix(at - offset_);
    sum_ += sums;
    square_ += sums * sums.transpose();
    ++count_;
    if (count_ >= std::ceil(UPDATE / period - 1e-9)) update(count_ * period);
}

void Reference::hold(double seconds) {
    leaves_ = true;
    if (unseen_s_ >= UNSEEN) return;
    unseen_s_ += seconds;
    ahead_s_ += seconds;
    if (ahead_s_ < UPDATE) return;
    drift_.predict(ahead_s_);
    ahead_s_ = 0;
    use_drift();
}

// The sums of the last seconds are complete.
void Reference::update(double seconds) {
    const double scatter = sigma_ / std::sqrt(count_), total = sum_[TOTAL] / count_;
    const Eigen::Vector4d change = unmix(sum_ / count_);
    const bool leaves = leaves_;
    leaves_ = false;
    if (total < -QUIET * scatter - fastest_ * seconds) {
        step(change * (1 - std::exp(-seconds / FAST)), scatter);
    } else if (total > QUIET * scatter + fastest_ * (SLOW + unseen_s_)) {
        if (stays(total, scatter, seconds))
            step(change, scatter);
        else if (!leaves)
            drift_.move(change * std::min(fastest_ * seconds / total, 1.0));
    } else if (leaves) {  // the object that touched may still be near
        drift_.predict(seconds);
    } else {
        correct(change, seconds);
    }
    clear_sums();
    use_drift();
}

// Untouched samples are by change, V, above the offset in the mean.
void Reference::correct(const Eigen::Vector4d& change, double seconds) {
    flat_s_ = unseen_s_ = 0;
    drift_.correct(change, (noise_(X, X) + noise_(Y, Y)) / (8 * count_), seconds);
    const double part = 1 - std::exp(-seconds / NOISE);
    take_noise((1 - part) * noise_ + part * (square_ / count_ + LEAST_SIGMA * LEAST_SIGMA * Eigen::Matrix4d::Identity()));
}

// Light of the room that has changed, by change, V, as no object does it.
void Reference::step(const Eigen::Vector4d& change, double scatter) {
    drift_.move(change);
    drift_.restart(scatter * scatter / 4);
}

// Whether light, V, without contact has been constant for so long that it is the room's; until then it may be an approaching object's, and
// the offset follows at the fastest drift.
bool Reference::stays(double total, double scatter, double seconds) {
    if (std::abs(total - flat_at_) > QUIET * scatter + 2 * fastest_ * flat_s_) {
        flat_s_ = 0;
        flat_at_ = total;
    }
    flat_s_ += seconds;
    const bool long_enough = flat_s_ >= FLAT;
    if (long_enough) flat_s_ = 0;
    return long_enough;
}

void Reference::shift(const Eigen::Vector4d& change) {
    drift_.move(change);
    use_drift();
}

}  // namespace tactile::finger
