// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/median.hpp"

namespace tactile::taxel {

// Velocity from the longest stretch of the past in which it was constant: lines are fitted to ever longer stretches, as long as the
// confidence intervals of their slopes have a point in common (Goldenshluger and Nemirovski 1997; Katkovnik 1999). A start, a stop or a
// reversal is seen within a few frames, and a slow motion is averaged over many.
namespace {

using Eigen::Vector3d;

constexpr double WHOLE = 1 + 1e-6;         // of a stretch: a frame at its beginning belongs to it
constexpr double NOISE_S = 1;              // s, over which the noise is measured: it changes with the load
constexpr double BENDS_PER_FREEDOM = 2.3;  // third differences overlap: so many are worth one that stands alone
constexpr double PRIOR_FREEDOMS = 4;       // as if so many had been seen before the first: noises of contacts differ by a factor of two
constexpr double BEND_VARIANCE = 20;       // of a third difference over that of a position

// The longest steady stretch of the latest positions: a line through them.
struct Line {
    Vector3d position, velocity, sigma;  // at its end
    std::size_t used = 1;                // positions
    double spread = 0;                   // s^2, sum of the squares of their times about the mean
};

Line longest_line(const std::vector<double>& times, const std::vector<Vector3d>& positions, const Vector3d& noise, double bound) {
    const Vector3d& last = positions.back();
    Line found{last, Vector3d::Zero(), Vector3d::Constant(std::numeric_limits<double>::infinity())};
    Vector3d most = found.sigma, least = -most, sum = Vector3d::Zero(), moment = sum;
    double total = 0, square = 0;  // of the times before the last one
    const std::size_t count = times.size();
    for (std::size_t n = 1; n <= count; ++n) {
        const double time = times[count - n] - times.back();
        const Vector3d off = positions[count - n] - last;
        total += time;
        square += time * time;
        sum += off;
        moment += time * off;
        const double spread = square - total * total / static_cast<double>(n);
        if (!(spread > 0)) continue;
        const Vector3d slope = (moment - total / static_cast<double>(n) * sum) / spread, sigma = noise / std::sqrt(spread);
        least = least.cwiseMax(slope - bound * sigma);
        most = most.cwiseMin(slope + bound * sigma);
        if (!(least.array() <= most.array()).all()) break;
        found = {last + (sum - slope * total) / static_cast<double>(n), slope, sigma, n, spread};
    }
    return found;
}

}  // namespace

// Standard deviation of each path, by the median size of third differences of measured poses, in which a steady acceleration has no part;
// without the last pose, with which a motion may begin. NaN before there is any.
Vector3d Path::measured_noise(const std::vector<Vector3d>& positions, double unit) {
    const double time = past_.back().time;
    const std::size_t n = positions.size();
    if (n > 4 && std::all_of(past_.end() - 5, past_.end() - 1, [](const Pose& one) { return one.measured; }))
        bends_.emplace_back(time, (positions[n - 2] - 3 * positions[n - 3] + 3 * positions[n - 4] - positions[n - 5]) / unit);
    while (!bends_.empty() && bends_.front().first < time - NOISE_S * WHOLE) bends_.pop_front();
    Vector3d noise = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    for (int k = 0; k < 3 && !bends_.empty(); ++k) {
        std::vector<double> sizes;
        for (const auto& bend : bends_) sizes.push_back(std::abs(bend.second[k]));
        noise[k] = std::max(unit * SIGMA_PER_MAD * median(std::move(sizes)) / std::sqrt(BEND_VARIANCE), rule_.least_noise);
    }
    return noise;
}

// Probability of a motion from the velocity along each path: it has Cauchy's distribution with a motion, few of which are fast, and
// Student's without one, since the noise is known from few frames.
double Path::probability(const Vector3d& velocity, const Vector3d& sigma) const {
    const double freedoms = PRIOR_FREEDOMS + static_cast<double>(bends_.size()) / BENDS_PER_FREEDOM;
    double log_odds = std::log(rule_.odds);
    for (int k = 0; k < 3; ++k) {
        const double still = sigma[k] * sigma[k] + rule_.creep * rule_.creep, moving = still + rule_.slip_speed * rule_.slip_speed;
        const double square = velocity[k] * velocity[k];
        log_odds += 0.5 * (freedoms + 1) * std::log1p(square / (freedoms * still));
        log_odds -= std::log1p(square / moving) + 0.5 * std::log(moving / still);
    }
    return 1 / (1 + std::exp(-log_odds));
}

PathMotion Path::add(const Pose& now, double unit, const Eigen::Vector2d& arm, double reach) {
    std::size_t old = 0;
    while (old < past_.size() && past_[old].time < now.time - rule_.window * WHOLE) ++old;
    past_.erase(past_.begin(), past_.begin() + static_cast<std::ptrdiff_t>(old));
    past_.push_back(now);
    std::vector<double> times;
    std::vector<Vector3d> positions;  // along the paths
    for (const Pose& one : past_) {
        times.push_back(one.time);
        const double turn = one.pose[2];
        positions.push_back({one.pose[0] - turn * arm[1], one.pose[1] + turn * arm[0], turn * reach});
    }
    PathMotion found;
    found.pose = now.pose;
    for (Vector3d* one : {&found.velocity, &found.velocity_sigma, &found.hidden, &found.bend, &found.bend_sigma})
        one->setConstant(std::numeric_limits<double>::quiet_NaN());
    const Vector3d noise = measured_noise(positions, unit);
    if (!noise.allFinite()) return found;
    const Line line = longest_line(times, positions, noise, rule_.bound);
    const std::size_t last = times.size() - 1, first = times.size() - line.used, half = (first + last) / 2;
    found.probability = probability(line.velocity, line.sigma);
    found.duration = now.time - times[first];
    found.displacement = line.velocity.norm() * found.duration;
    found.velocity_sigma = line.sigma, found.spread = line.spread;
    const auto at_origin = [&](const Vector3d& paths) -> Vector3d {
        const double turn = paths[2] / reach;
        return {paths[0] + turn * arm[1], paths[1] - turn * arm[0], turn};
    };
    found.pose = at_origin(line.position), found.velocity = at_origin(line.velocity);
    found.hidden = (now.rest - past_[first].rest) / found.duration;
    found.bend.setZero(), found.bend_sigma.setZero();
    if (half == first) return found;
    const double early = times[half] - times[first], late = now.time - times[half];
    found.bend = (now.pose - past_[half].pose) / late - (past_[half].pose - past_[first].pose) / early;
    found.bend_sigma = noise * std::sqrt(2 / (early * early) + 2 / (late * late) + 2 / (early * late));
    return found;
}

}  // namespace tactile::taxel
