// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "force_taxels/slip.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "force_taxels/constants.hpp"

namespace tactile::force_taxels {

namespace {

double square(double x) {
    return x * x;
}
// Within 3e-6 of the exponential function for |x| < 700, and without a call, so that the compiler computes several at once.
inline double quick_exp(double x) {
    constexpr double SHIFT = 0x1.8p52;  // the lowest bits of a number plus this are its integer part
    const double doublings = x * (1 / M_LN2), shifted = doublings + SHIFT, part = (doublings - (shifted - SHIFT)) * M_LN2;
    const double series = 1 + part * (1 + part * (1.0 / 2 + part * (1.0 / 6 + part * (1.0 / 24 + part / 120))));
    std::int64_t exponent, bits;
    std::memcpy(&exponent, &shifted, sizeof exponent);
    std::memcpy(&bits, &series, sizeof bits);
    bits += static_cast<std::int64_t>(static_cast<std::uint64_t>(exponent) << 52);
    double result;
    std::memcpy(&result, &bits, sizeof result);
    return result;
}
double normal_below(double deviations) {
    return 1 / (1 + quick_exp(-TAXEL.logistic * std::clamp(deviations, -TAXEL.max_evidence, TAXEL.max_evidence)));
}
double probability(double x) {
    return std::clamp(x, TAXEL.min_probability, 1 - TAXEL.min_probability);
}

}  // namespace

SlipFilter::SlipFilter(std::vector<double> tilt, const SlipLimits& limits)
    : limits_(limits), tilt_(std::move(tilt)), taxels_(tilt_.size()) {
    for (int k = 0; k < COEFFICIENTS; ++k) {
        coefficient_[k] = TAXEL.min_friction * std::pow(TAXEL.max_friction / TAXEL.min_friction, k / (COEFFICIENTS - 1.0));
        prior_[k] = -0.5 * square(std::log(coefficient_[k] / limits.median) / std::log(limits.factor));
    }
    set_weights(prior_);
    prior_ = log_;
}

void SlipFilter::reset() {
    std::fill(taxels_.begin(), taxels_.end(), Taxel{});
    moving = 0.5;
}

double SlipFilter::friction() const {
    double sum = 0;
    for (int k = 0; k < COEFFICIENTS; ++k) sum += weight_[k] * coefficient_[k];
    return sum;
}

double SlipFilter::friction_sigma() const {
    double sum = 0;
    const double mean = friction();
    for (int k = 0; k < COEFFICIENTS; ++k) sum += weight_[k] * square(coefficient_[k] - mean);
    return std::sqrt(sum);
}

void SlipFilter::set_weights(const Coefficients& log) {
    const double largest = *std::max_element(log.begin(), log.end());
    double sum = 0;
    for (const double one : log) sum += std::exp(one - largest);
    for (int k = 0; k < COEFFICIENTS; ++k) {
        log_[k] = log[k] - largest - std::log(sum);
        weight_[k] = std::exp(log_[k]);
    }
}

std::vector<double> SlipFilter::update(const TaxelForces& frame, double interval) {
    std::vector<double> found(taxels_.size(), 0.0);
    std::vector<Reading> readings;
    bool was_touched = false;
    for (std::ptrdiff_t k = 0; k < count(); ++k) {
        was_touched = was_touched || taxels_[k].touched;
        taxels_[k].touched = taxels_[k].touched && frame.touched[k];
        if (!frame.touched[k]) continue;
        Reading& one = readings.emplace_back();
        one.taxel = &taxels_[k];
        read(frame, k, one);
    }
    if (readings.empty()) {
        if (!was_touched) return found;
        Coefficients mixed;
        for (int k = 0; k < COEFFICIENTS; ++k)
            mixed[k] = std::log((1 - limits_.forgotten) * weight_[k] + limits_.forgotten * std::exp(prior_[k]));
        set_weights(mixed);
        reset();
        return found;
    }
    for (Reading& one : readings) {
        rate_ratio(one);
        predict(one, interval);
    }
    weigh(readings, interval);
    learn(readings, interval);
    for (const Reading& one : readings) {
        one.taxel->press = one.press;
        one.taxel->touched = true;
        found[one.taxel - taxels_.data()] = moving * one.taxel->slips;
    }
    return found;
}

void SlipFilter::read(const TaxelForces& frame, std::ptrdiff_t k, Reading& one) const {
    const double *force = frame.force + 3 * k, *noise = frame.noise + 3 * k, *offset = frame.offset + 3 * k;
    one.shear = {force[0], force[1]};
    one.press = std::max(force[2], TAXEL.tiny);
    one.noise = 0.5 * (noise[0] + noise[1]);
    one.press_noise = noise[2];
    one.ratio = std::hypot(force[0], force[1]) / one.press;
    const double across = one.noise + 0.5 * (offset[0] + offset[1]), along = noise[2] + offset[2];
    one.sigma = std::sqrt((across + square(one.ratio) * along) / square(one.press) + square(limits_.skewed) + square(tilt_[k]));
    one.is_first = !one.taxel->touched;
    one.counts = frame.is_new[k] && !one.is_first;
}

// Coulomb: a taxel slips where the ratio of its shear to its pressure is the coefficient of friction, and sticks below it. A load whose
// ratio has grown would have begun to slip at the coefficients that it has passed.
void SlipFilter::rate_ratio(Reading& one) const {
    const auto& [x, y] = one.taxel->shear[LOAD];
    const double before = std::min(one.ratio, std::hypot(x, y) / std::max(one.taxel->press, TAXEL.tiny));
    // Each magnitude of a ratio is as likely.
    const double spread = std::max(one.ratio, TAXEL.min_friction) * std::log(TAXEL.max_friction / TAXEL.min_friction);
    double cone = TAXEL.tiny, sticks = TAXEL.tiny, stuck = TAXEL.tiny;
    const bool has_grown = before < one.ratio;
    for (int k = 0; k < COEFFICIENTS; ++k) {
        const double sigma = std::sqrt(square(one.sigma) + square(limits_.uneven * coefficient_[k]));
        const double beyond = (coefficient_[k] - one.ratio) / sigma, below = normal_below(beyond);
        one.cone[k] = quick_exp(-0.5 * std::min(square(beyond), 2 * TAXEL.max_evidence)) / (sigma * std::sqrt(2 * M_PI));
        one.below[k] = below / spread;
        cone += weight_[k] * one.cone[k];
        sticks += weight_[k] * below;
        if (has_grown) stuck += weight_[k] * normal_below((coefficient_[k] - before) / sigma);
    }
    one.on_cone = cone / (cone + sticks / spread);
    one.begins = one.is_first || !has_grown ? 0 : 1 - sticks / stuck;
}

// Mixes the filters of the modes, predicts the reading by each, and corrects them with it.
void SlipFilter::predict(Reading& one, double interval) {
    Taxel& taxel = *one.taxel;
    const double load_variance = square(friction() * one.press / limits_.load_s);
    if (one.is_first) {
        taxel.shear.fill(one.shear);
        taxel.variance.fill(TAXEL.unknown_shear * one.noise);
        taxel.rate = {}, taxel.rate_variance = load_variance, taxel.rate_with_shear = 0;
        taxel.slips = limits_.unchanged, taxel.press = one.press;
    }
    const double change = std::min(limits_.changes * interval, 0.5), stop = std::min(limits_.stops * interval, 0.5);
    const double begins = std::max(one.begins, change * one.on_cone), slips = taxel.slips, on = limits_.same * slips * one.on_cone;
    const std::array<Modes, MODES> steps{Modes{1 - change, change * (1 - on), change * on},
                                         Modes{stop, (1 - stop) * (1 - begins), (1 - stop) * begins},
                                         Modes{stop, (1 - stop) * change, (1 - stop) * (1 - change)}};
    const Modes before{1 - moving, moving * (1 - slips), moving * slips};
    std::array<Vector, MODES> mean{};
    Modes variance{};
    double is_load = 0;  // probability that a load continues
    for (int to = 0; to < MODES; ++to) {
        Modes share;
        one.arriving[to] = TAXEL.tiny;
        for (int from = 0; from < MODES; ++from) one.arriving[to] += share[from] = before[from] * steps[from][to];
        for (int from = 0; from < MODES; ++from)
            for (int axis = 0; axis < 2; ++axis) mean[to][axis] += share[from] / one.arriving[to] * taxel.shear[from][axis];
        for (int from = 0; from < MODES; ++from)
            for (int axis = 0; axis < 2; ++axis)
                variance[to] += 0.5 * share[from] / one.arriving[to] *
                                (taxel.variance[from] + square(taxel.shear[from][axis] - mean[to][axis]));
        if (to == LOAD) is_load = share[LOAD] / one.arriving[LOAD];
    }
    Vector rate;
    double rate_variance = is_load * taxel.rate_variance + (1 - is_load) * load_variance, with = is_load * taxel.rate_with_shear;
    for (int axis = 0; axis < 2; ++axis) {
        rate[axis] = is_load * taxel.rate[axis];
        rate_variance += 0.5 * is_load * (1 - is_load) * square(taxel.rate[axis]);
        mean[LOAD][axis] += rate[axis] * interval;
        // At the cone, shear is in proportion to pressure.
        mean[SLIP][axis] *= std::clamp(one.press / std::max(taxel.press, TAXEL.tiny), 0.5, 2.0);
    }
    const double size = square(one.shear[0]) + square(one.shear[1]), frames = interval / TAXEL.step_s;
    variance[REST] += square(limits_.creep) * frames * one.noise;
    variance[LOAD] += interval * (2 * with + interval * rate_variance);
    variance[SLIP] += square(limits_.texture) * frames * size + square(one.ratio) * one.press_noise;
    with += interval * rate_variance;
    rate_variance += load_variance * interval / limits_.steady_s;
    const bool corrects = one.counts || one.is_first;
    double largest = -INFINITY;
    for (int mode = 0; mode < MODES; ++mode) {
        const double total = variance[mode] + one.noise, gain = corrects ? variance[mode] / total : 0;
        const Vector error{one.shear[0] - mean[mode][0], one.shear[1] - mean[mode][1]};
        one.likelihood[mode] = -0.5 * (square(error[0]) + square(error[1])) / total - std::log(total);
        largest = std::max(largest, one.likelihood[mode]);
        for (int axis = 0; axis < 2; ++axis) taxel.shear[mode][axis] = mean[mode][axis] + gain * error[axis];
        taxel.variance[mode] = (1 - gain) * variance[mode];
        if (mode != LOAD) continue;
        const double rate_gain = corrects ? with / total : 0;
        for (int axis = 0; axis < 2; ++axis) taxel.rate[axis] = rate[axis] + rate_gain * error[axis];
        taxel.rate_variance = rate_variance - rate_gain * with;
        taxel.rate_with_shear = (1 - gain) * with;
    }
    for (double& each : one.likelihood) each = std::exp(each - largest) + limits_.outlier;
}

// Whether the object moves, by all taxels, and which of them slip.
void SlipFilter::weigh(std::vector<Reading>& readings, double interval) {
    const double change = std::min(limits_.changes * interval, 0.5), stop = std::min(limits_.stops * interval, 0.5);
    const double kept = std::min(interval / limits_.texture_s, 1.0), half = std::pow(0.5, kept);
    const double prior = moving * (1 - stop) + (1 - moving) * change;
    double evidence = 0;
    for (Reading& one : readings) {
        auto& [rest, load, slip] = one.likelihood;
        slip = ((1 - limits_.unchanged) * slip + limits_.unchanged * rest) * std::pow(one.on_cone, kept);
        load *= std::pow(1 - one.on_cone, kept);
        one.slips = probability(one.arriving[SLIP] / (one.arriving[LOAD] + one.arriving[SLIP]));
        const double moves = one.slips * slip + (1 - one.slips) * load;
        if (one.counts) evidence += std::log(moves / (rest * half));
        one.slips *= slip / moves;
    }
    const double odds = std::log(prior / (1 - prior)) + std::clamp(evidence, -TAXEL.max_evidence, TAXEL.max_evidence);
    moving = probability(1 / (1 + std::exp(-odds)));
    for (const Reading& one : readings)
        if (one.counts) one.taxel->slips += moving * (one.slips - one.taxel->slips);
}

// At rest the forces are those of the frames before: they say nothing new of friction.
void SlipFilter::learn(const std::vector<Reading>& readings, double interval) {
    const double share = std::min(interval / limits_.texture_s, 1.0) * moving;
    Coefficients log = log_;
    constexpr std::size_t TOGETHER = 16;  // likelihoods of which one logarithm is taken, without underflow
    for (std::size_t first = 0; first < readings.size(); first += TOGETHER) {
        Coefficients product;
        product.fill(1);
        for (std::size_t k = first; k < std::min(first + TOGETHER, readings.size()); ++k) {
            const Reading& one = readings[k];
            for (int c = 0; c < COEFFICIENTS; ++c) product[c] *= one.slips * one.cone[c] + (1 - one.slips) * one.below[c] + limits_.outlier;
        }
        for (int c = 0; c < COEFFICIENTS; ++c) log[c] += share * std::log(product[c]);
    }
    set_weights(log);
}

}  // namespace tactile::force_taxels
