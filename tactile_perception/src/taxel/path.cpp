// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Velocity from the longest stretch of the past in which it was constant: lines are fitted to ever longer stretches, as long as the
// confidence intervals of their slopes have a point in common (Goldenshluger and Nemirovski 1997; Katkovnik 1999). A start, a stop or a
// reversal is seen within a few frames, and a slow motion is averaged over many.
#include "taxel/path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/median.hpp"

namespace tactile::taxel {
namespace {

using Eigen::Vector3d;

constexpr double WHOLE = 1 + 1e-6;  // of a stretch: a frame at its beginning belongs to it
constexpr double LARGEST = std::numeric_limits<double>::max();

// Standard deviation of the first two coordinates, by the median length of their second differences, in which steady motion has no part;
// without the last one, in which a motion may begin.
double noise_of(const std::vector<Vector3d>& positions) {
    std::vector<double> bends;
    for (std::size_t k = 0; k + 3 < positions.size(); ++k) {
        const double bend = (positions[k + 2] - 2 * positions[k + 1] + positions[k]).head<2>().norm();
        bends.push_back(bend >= 0 ? bend : std::numeric_limits<double>::infinity());
    }
    // A second difference has six times the variance of a position; the median of a Rayleigh distribution is sqrt(2 ln 2).
    return bends.empty() ? 0 : median(std::move(bends)) / std::sqrt(6 * 2 * std::log(2.0));
}

// Sets pose, velocity, sigma and used by the longest steady line through the latest positions.
void fit_line(const std::vector<double>& times, const std::vector<Vector3d>& positions, double bound, PathMotion& found) {
    const Vector3d& last = positions.back();
    found.pose = last;
    found.velocity.setZero();
    found.sigma = LARGEST;
    Vector3d least = Vector3d::Constant(-LARGEST), most = -least, sum = Vector3d::Zero(), moment = sum;
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
        const Vector3d slope = (moment - total / static_cast<double>(n) * sum) / spread;
        const double sigma = found.noise / std::sqrt(spread);
        least = least.cwiseMax((slope.array() - bound * sigma).matrix());
        most = most.cwiseMin((slope.array() + bound * sigma).matrix());
        if (!(least.array() <= most.array()).all()) return;
        found.velocity = slope;
        found.pose = last + (sum - slope * total) / static_cast<double>(n);
        found.sigma = sigma;
        found.used = static_cast<std::ptrdiff_t>(n);
    }
}

}  // namespace

void Path::reset(std::size_t kept) {
    past_.erase(past_.begin(), past_.end() - static_cast<std::ptrdiff_t>(std::min(kept, past_.size())));
}

PathMotion Path::add(double time, const Vector3d& pose, const Eigen::Vector2d& arm, double reach) {
    std::size_t old = 0;
    while (past_.size() - old >= static_cast<std::size_t>(rule_.fewest) && past_[old].time < time - rule_.window * WHOLE) ++old;
    reset(past_.size() - old);
    past_.push_back({time, pose});
    std::vector<double> times;
    std::vector<Vector3d> positions;  // of the contact's middle, and of its edges along a turn
    for (const Frame& one : past_) {
        times.push_back(one.time);
        const double turn = one.pose[2];
        positions.push_back({one.pose[0] - turn * arm[1], one.pose[1] + turn * arm[0], turn * reach});
    }
    PathMotion found;
    found.noise = std::max(noise_of(positions), rule_.least_noise);
    fit_line(times, positions, rule_.bound, found);
    found.speed = found.velocity.norm();
    const auto frames = static_cast<std::ptrdiff_t>(times.size());
    found.lasting = times.back() - times[frames - found.used];
    std::ptrdiff_t before = frames - 1;
    while (before > frames - found.used && found.speed * (times.back() - times[before]) < rule_.evident * found.noise) --before;
    const double expected = found.speed * (times.back() - times[before]);
    const double went = (positions.back() - positions[before]).dot(found.velocity) / std::max(found.speed, 1e-12);
    if (expected >= rule_.evident * found.noise && went < rule_.stopped * expected) found.stopped = frames - 1 - before;
    for (Vector3d* at : {&found.pose, &found.velocity}) {
        const double turn = (*at)[2] / reach;
        *at = {(*at)[0] + turn * arm[1], (*at)[1] - turn * arm[0], turn};
    }
    found.reported.setConstant(std::numeric_limits<double>::quiet_NaN());
    if (frames < rule_.fewest) return found;
    std::ptrdiff_t first = frames - rule_.fewest;
    while (first > 0 && times[first - 1] >= time - rule_.reported * WHOLE) --first;
    double mean = 0, square = 0;
    for (std::ptrdiff_t k = first; k < frames; ++k) mean += times[k] / static_cast<double>(frames - first);
    found.reported.setZero();
    for (std::ptrdiff_t k = first; k < frames; ++k) {
        square += (times[k] - mean) * (times[k] - mean);
        found.reported += (times[k] - mean) * past_[k].pose;
    }
    found.reported /= square;
    return found;
}

}  // namespace tactile::taxel
