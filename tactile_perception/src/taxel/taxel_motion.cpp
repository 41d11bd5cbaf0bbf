// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/taxel_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/steady_motion.hpp"

namespace tactile {
namespace {

constexpr double WHOLE = 1 + 1e-6;  // of a stretch: a frame at its beginning belongs to it

// Slopes of a line through the frames from first on.
std::array<double, 3> line(const std::vector<PastFrame>& past, std::size_t first) {
    double mean = 0, square = 0;
    std::array<double, 3> slope{};
    for (std::size_t k = first; k < past.size(); ++k) mean += past[k][0];
    mean /= static_cast<double>(past.size() - first);
    for (std::size_t k = first; k < past.size(); ++k) {
        const double off = past[k][0] - mean;
        square += off * off;
        for (int axis = 0; axis < 3; ++axis) slope[axis] += off * past[k][1 + axis];
    }
    for (double& one : slope) one /= square;
    return slope;
}

}  // namespace

ObjectMotion object_motion(const PastFrame* past, std::ptrdiff_t count, const PastFrame& now, const FollowRule& rule) {
    ObjectMotion found;
    const PastFrame* end = past + count;
    while (end - past >= rule.fewest && past[0][0] < now[0] - rule.window * WHOLE) ++past;
    found.past.assign(past, end);
    found.past.push_back(now);
    std::vector<double> times, places;  // of the contact's middle, and of its edges along a turn
    for (const PastFrame& one : found.past) {
        times.push_back(one[0]);
        places.insert(places.end(), {one[1] - one[3] * rule.arm[1], one[2] + one[3] * rule.arm[0], one[3] * rule.reach});
    }
    const auto frames = static_cast<std::ptrdiff_t>(times.size());
    found.noise = std::max(noise_of_places(places.data(), frames), rule.least);
    const SteadyMotion steady = steady_motion(times.data(), places.data(), frames, found.noise, rule.bound);
    const auto at_origin = [&](const std::array<double, 3>& at) {
        const double turn = at[2] / rule.reach;
        return std::array<double, 3>{at[0] + turn * rule.arm[1], at[1] - turn * rule.arm[0], turn};
    };
    found.place = at_origin(steady.place);
    found.velocity = at_origin(steady.velocity);
    found.used = steady.used;
    found.sigma = steady.sigma;
    found.lasting = times.back() - times[frames - steady.used];
    for (const double part : steady.velocity) found.speed += part * part;
    found.speed = std::sqrt(found.speed);
    if (frames > rule.latest) {
        found.expected = found.speed * (times.back() - times[frames - 1 - rule.latest]);
        for (int axis = 0; axis < 3; ++axis)
            found.went += (places[3 * (frames - 1) + axis] - places[3 * (frames - 1 - rule.latest) + axis]) * steady.velocity[axis];
        found.went /= std::max(found.speed, 1e-12);
    }
    found.reported.fill(std::numeric_limits<double>::quiet_NaN());
    if (frames < rule.fewest) return found;
    std::ptrdiff_t first = frames - rule.fewest;
    while (first > 0 && times[first - 1] >= now[0] - rule.reported * WHOLE) --first;
    found.reported = line(found.past, first);
    return found;
}

}  // namespace tactile
