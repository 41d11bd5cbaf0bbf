// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "common/median.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

// The network was fitted to the true outlines of simulated contacts of random tools (test/benchmark/fit_contact_score.py):
// to the loads and the skin's bends within two dots, and to the spread of all loads, which is small where glare leaves the ranges little
// weight and the balance places the dots. Its mean over the grid's eight symmetries does not depend on how the grid is turned.

constexpr std::ptrdiff_t REACH = BorderNetwork::REACH, NEXT = BorderNetwork::NEXT, KINDS = BorderNetwork::KINDS, FED = BorderNetwork::FED;
constexpr std::ptrdiff_t FIRST = BorderNetwork::FIRST, SECOND = BorderNetwork::SECOND;
constexpr int SYMMETRIES = 8;
constexpr double NEAR = 0.3;  // load from which a dot and those beside it are judged: noise makes less. Chosen, as are the limits below
constexpr double LIGHTEST = -1, HEAVIEST = 4, STEEPEST = 0.5, LEAST_SPREAD = 0.02, MOST_SPREAD = 0.06;
constexpr float BEND_SCALE = 4, SPREAD_SCALE = 20;

float limited(double value, double least, double most) {
    return static_cast<float>(value > least ? std::min(value, most) : value <= least ? least : 0);  // 0 of NaN
}

// Values (rows, columns) with REACH zeros around them.
struct Padded {
    std::ptrdiff_t width;
    std::vector<float> values;
    explicit Padded(Grid grid) : width(grid.columns + 2 * REACH), values((grid.rows + 2 * REACH) * width) {}
    std::ptrdiff_t place(Grid grid, std::ptrdiff_t k) const { return (k / grid.columns + REACH) * width + k % grid.columns + REACH; }
};

// How far the four dots next to an inner dot stand out of its tangent plane, pitches.
double bend(Grid grid, std::ptrdiff_t k, const double* places, const double* normals, double pitch) {
    const Vec3 here = vec3_at(places, k), beside = vec3_at(places, k - 1) + vec3_at(places, k + 1) + vec3_at(places, k - grid.columns) +
                                                   vec3_at(places, k + grid.columns);
    return dot(beside - 4.0 * here, vec3_at(normals, k)) / pitch;
}

// Median size of the loads (K), limited; NaN counts as 0.
float spread_of(Grid grid, const double* load) {
    std::vector<double> sizes(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) sizes[k] = std::isnan(load[k]) ? 0.0 : std::abs(load[k]);
    return limited(median(std::move(sizes)), LEAST_SPREAD, MOST_SPREAD);
}

// Offsets in padded values of what is fed in, for each symmetry of the square.
struct Offsets {
    std::ptrdiff_t next[SYMMETRIES][NEXT];
    explicit Offsets(std::ptrdiff_t width) {
        for (int way = 0; way < SYMMETRIES; ++way) {
            std::ptrdiff_t* offset = next[way];
            for (std::ptrdiff_t row = -REACH; row <= REACH; ++row) {
                for (std::ptrdiff_t column = -REACH; column <= REACH; ++column) {
                    const std::ptrdiff_t down = (way & 1) ? -row : row, across = (way & 2) ? -column : column;
                    *offset++ = (way & 4) ? across * width + down : down * width + across;
                }
            }
        }
    }
};

typedef float Eight __attribute__((vector_size(8 * sizeof(float))));

constexpr int PAIR = 2;  // symmetries that are judged at once: each weight is read once for both

// Adds to units, eight times N of them of each of the pair, what numbers (count) that are fed in give them by their weights.
template <std::ptrdiff_t N>
TACTILE_INLINE void feed(const float* const (&fed)[PAIR], std::ptrdiff_t count, const float* weights, Eight (&units)[PAIR][N]) {
    for (std::ptrdiff_t j = 0; j < count; ++j) {
        for (std::ptrdiff_t i = 0; i < N; ++i, weights += 8) {
            Eight some;
            std::memcpy(&some, weights, sizeof some);
            for (int one = 0; one < PAIR; ++one) units[one][i] += fed[one][j] * some;
        }
    }
}

// The sum of the network's answers, pitches, to the numbers fed in by a pair.
TACTILE_INLINE float answers(const BorderNetwork& network, const float (&fed)[PAIR][FED]) {
    Eight first[PAIR][FIRST / 8], second[PAIR][SECOND / 8];
    float units[PAIR][FIRST], total = 0;
    for (int one = 0; one < PAIR; ++one) {
        std::memcpy(first[one], network.biases_1.data(), sizeof first[one]);
        std::memcpy(second[one], network.biases_2.data(), sizeof second[one]);
    }
    feed({fed[0], fed[1]}, FED, network.weights_1.data(), first);
    std::memcpy(units, first, sizeof units);
    for (float(&of_one)[FIRST] : units) {
        for (float& unit : of_one) unit = unit > 0 ? unit : 0;
    }
    feed({units[0], units[1]}, FIRST, network.weights_2.data(), second);
    for (int one = 0; one < PAIR; ++one) {
        float distance = network.bias_3, last[SECOND];
        std::memcpy(last, second[one], sizeof last);
        for (std::ptrdiff_t j = 0; j < SECOND; ++j) distance += (last[j] > 0 ? last[j] : 0) * network.weights_3[j];
        total += distance;
    }
    return total;
}

TACTILE_WIDE void judge(const BorderNetwork& network, Grid grid, const std::vector<std::uint8_t>& near, const Padded (&maps)[KINDS],
                        float spread, double* found) {
    const Offsets offsets(maps[0].width);
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!near[k]) continue;
        const std::ptrdiff_t at = maps[0].place(grid, k);
        float total = 0, fed[PAIR][FED];
        for (int way = 0; way < SYMMETRIES; ++way) {
            float* here = fed[way % PAIR];
            for (std::ptrdiff_t kind = 0; kind < KINDS; ++kind) {
                for (std::ptrdiff_t j = 0; j < NEXT; ++j) *here++ = maps[kind].values[at + offsets.next[way][j]];
            }
            *here = spread;
            if (way % PAIR == PAIR - 1) total += answers(network, fed);
        }
        found[k] = std::clamp(0.5 + total / (2.0 * SYMMETRIES), 0.0, 1.0);
    }
}

}  // namespace

std::vector<double> border_scores(const BorderNetwork& network, Grid grid, const DotLoads& loads, double pitch) {
    std::vector<double> found(grid.size());
    std::vector<std::uint8_t> near(grid.size());
    Padded maps[KINDS] = {Padded(grid), Padded(grid)};
    bool any = false;
    each_dot(grid, [&](std::ptrdiff_t k, bool inner) {
        const std::ptrdiff_t at = maps[0].place(grid, k);
        maps[0].values[at] = limited(loads.load[k], LIGHTEST, HEAVIEST);
        if (inner)
            maps[1].values[at] = BEND_SCALE * limited(bend(grid, k, loads.xyz.data(), loads.normal.data(), pitch), -STEEPEST, STEEPEST);
        if (!(loads.load[k] > NEAR)) return;
        any = true;
        around(grid, k, [&](std::ptrdiff_t j) { near[j] = 1; });
    });
    if (any) judge(network, grid, near, maps, SPREAD_SCALE * spread_of(grid, loads.load.data()), found.data());
    return found;
}

}  // namespace tactile
