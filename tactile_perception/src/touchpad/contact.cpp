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

// The network was fitted to the true outlines of simulated contacts of random tools (test/benchmark/fit_contact_score.py). Its inputs are
// the loads and the skin's bends within two dots, and the spread of all loads, which is small where glare gives the ranges little weight
// and the balance of forces determines the positions. The mean over the grid's eight symmetries does not depend on the orientation of the
// grid.

constexpr std::ptrdiff_t RADIUS = BorderNetwork::RADIUS, NEIGHBOURS = BorderNetwork::NEIGHBOURS, MAPS = BorderNetwork::MAPS,
                         INPUTS = BorderNetwork::INPUTS;
constexpr std::ptrdiff_t FIRST = BorderNetwork::FIRST, SECOND = BorderNetwork::SECOND;
constexpr int SYMMETRIES = 8;
constexpr double MIN_LOAD = 0.3;  // load from which a dot and its neighbours are scored; noise is lower
// Limits of the inputs: load, bend in pitches, spread of the loads.
constexpr double LOWEST_LOAD = -1, HIGHEST_LOAD = 4, MAX_BEND = 0.5, MIN_SPREAD = 0.02, MAX_SPREAD = 0.06;
constexpr float BEND_SCALE = 4, SPREAD_SCALE = 20;

float limited(double value, double lowest, double highest) {
    return static_cast<float>(value > lowest ? std::min(value, highest) : value <= lowest ? lowest : 0);  // 0 of NaN
}

// Values (rows, columns) with RADIUS zeros around them.
struct Padded {
    std::ptrdiff_t width;
    std::vector<float> values;
    explicit Padded(Grid grid) : width(grid.columns + 2 * RADIUS), values((grid.rows + 2 * RADIUS) * width) {}
    std::ptrdiff_t index(Grid grid, std::ptrdiff_t k) const { return (k / grid.columns + RADIUS) * width + k % grid.columns + RADIUS; }
};

// Sum of the distances of the four adjacent dots from an inner dot's tangent plane, pitches.
double bend(Grid grid, std::ptrdiff_t k, const double* positions, const double* normals, double pitch) {
    const Eigen::Vector3d across = vec3_at(positions, k - 1) + vec3_at(positions, k + 1);
    const Eigen::Vector3d down = vec3_at(positions, k - grid.columns) + vec3_at(positions, k + grid.columns);
    return (across + down - 4.0 * vec3_at(positions, k)).dot(vec3_at(normals, k)) / pitch;
}

// Median size of the loads (K), limited; NaN counts as 0.
float spread_of(Grid grid, const double* load) {
    std::vector<double> sizes(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) sizes[k] = std::isnan(load[k]) ? 0.0 : std::abs(load[k]);
    return limited(median(std::move(sizes)), MIN_SPREAD, MAX_SPREAD);
}

// Offsets of the inputs in the padded values, for each symmetry of the square.
struct Offsets {
    std::ptrdiff_t next[SYMMETRIES][NEIGHBOURS];
    explicit Offsets(std::ptrdiff_t width) {
        for (int symmetry = 0; symmetry < SYMMETRIES; ++symmetry) {
            std::ptrdiff_t* offset = next[symmetry];
            for (std::ptrdiff_t row = -RADIUS; row <= RADIUS; ++row) {
                for (std::ptrdiff_t column = -RADIUS; column <= RADIUS; ++column) {
                    const std::ptrdiff_t down = (symmetry & 1) ? -row : row, across = (symmetry & 2) ? -column : column;
                    *offset++ = (symmetry & 4) ? across * width + down : down * width + across;
                }
            }
        }
    }
};

typedef float Eight __attribute__((vector_size(8 * sizeof(float))));

constexpr int PAIR = 2;  // symmetries that are computed at once: each weight is read once for both

// Adds the weighted inputs (count) of a pair to its units, 8 N each.
template <std::ptrdiff_t N>
TACTILE_INLINE void feed(const float* const (&inputs)[PAIR], std::ptrdiff_t count, const float* weights, Eight (&units)[PAIR][N]) {
    for (std::ptrdiff_t j = 0; j < count; ++j) {
        for (std::ptrdiff_t i = 0; i < N; ++i, weights += 8) {
            Eight some;
            std::memcpy(&some, weights, sizeof some);
            for (int one = 0; one < PAIR; ++one) units[one][i] += inputs[one][j] * some;
        }
    }
}

// Sum of the distances, in pitches, that the network estimates for a pair of inputs.
TACTILE_INLINE float distance_sum(const BorderNetwork& network, const float (&inputs)[PAIR][INPUTS]) {
    Eight first[PAIR][FIRST / 8], second[PAIR][SECOND / 8];
    float units[PAIR][FIRST], total = 0;
    for (int one = 0; one < PAIR; ++one) {
        std::memcpy(first[one], network.biases_1.data(), sizeof first[one]);
        std::memcpy(second[one], network.biases_2.data(), sizeof second[one]);
    }
    feed({inputs[0], inputs[1]}, INPUTS, network.weights_1.data(), first);
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

TACTILE_WIDE void score_dots(const BorderNetwork& network, Grid grid, const std::vector<std::uint8_t>& near, const Padded (&maps)[MAPS],
                             float spread, double* found) {
    const Offsets offsets(maps[0].width);
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!near[k]) continue;
        const std::ptrdiff_t at = maps[0].index(grid, k);
        float total = 0, inputs[PAIR][INPUTS];
        for (int symmetry = 0; symmetry < SYMMETRIES; ++symmetry) {
            float* here = inputs[symmetry % PAIR];
            for (std::ptrdiff_t map = 0; map < MAPS; ++map) {
                for (std::ptrdiff_t j = 0; j < NEIGHBOURS; ++j) *here++ = maps[map].values[at + offsets.next[symmetry][j]];
            }
            *here = spread;
            if (symmetry % PAIR == PAIR - 1) total += distance_sum(network, inputs);
        }
        found[k] = std::clamp(0.5 + total / (2.0 * SYMMETRIES), 0.0, 1.0);
    }
}

}  // namespace

std::vector<double> border_scores(const BorderNetwork& network, Grid grid, const DotLoads& loads, double pitch) {
    std::vector<double> found(grid.size());
    std::vector<std::uint8_t> near(grid.size());
    Padded maps[MAPS] = {Padded(grid), Padded(grid)};
    bool any = false;
    each_dot(grid, [&](std::ptrdiff_t k, bool inner) {
        const std::ptrdiff_t at = maps[0].index(grid, k);
        maps[0].values[at] = limited(loads.load[k], LOWEST_LOAD, HIGHEST_LOAD);
        if (inner)
            maps[1].values[at] = BEND_SCALE * limited(bend(grid, k, loads.xyz.data(), loads.normal.data(), pitch), -MAX_BEND, MAX_BEND);
        if (!(loads.load[k] > MIN_LOAD)) return;
        any = true;
        around(grid, k, [&](std::ptrdiff_t j) { near[j] = 1; });
    });
    if (any) score_dots(network, grid, near, maps, SPREAD_SCALE * spread_of(grid, loads.load.data()), found.data());
    return found;
}

namespace {

constexpr double LOADED = 0.5;  // a dot with a larger load is loaded: its force counts in full

// Steps (K) along rows, columns and diagonals from each dot to the nearest loaded one, ZERO_WEIGHT_STEPS at most.
std::vector<int> steps_to_load(const DotLoads& loads, Grid grid) {
    std::vector<int> steps(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) steps[k] = loads.load[k] > LOADED ? 0 : ZERO_WEIGHT_STEPS;
    for (int step = 1; step < ZERO_WEIGHT_STEPS; ++step) {
        for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
            if (steps[k] == step - 1) around(grid, k, [&](std::ptrdiff_t near) { steps[near] = std::min(steps[near], step); });
        }
    }
    return steps;
}

}  // namespace

ContactForces contact_forces(const DotLoads& loads, Grid grid) {
    ContactForces found{std::vector<double>(3 * grid.size()), std::vector<double>(6)};
    const std::vector<int> steps = steps_to_load(loads, grid);
    Eigen::Vector3d total = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        const double weight = std::min(1.0, static_cast<double>(ZERO_WEIGHT_STEPS - steps[k]) / (ZERO_WEIGHT_STEPS - FULL_WEIGHT_STEPS));
        const Eigen::Vector3d force = weight * vec3_at(loads.force.data(), k);
        store(found.force.data(), k, force);
        total += force, moment += vec3_at(loads.xyz.data(), k).cross(force);
    }
    store(found.wrench.data(), 0, total);
    store(found.wrench.data(), 1, moment);
    return found;
}

}  // namespace tactile
