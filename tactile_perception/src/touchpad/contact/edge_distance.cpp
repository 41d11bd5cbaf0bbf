// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// A network of two hidden layers (rectified linear units) tells a dot's distance from the border: from the loads, the scores and the skin's
// bends within two dots, and from the spread of all loads, which is small where glare leaves the ranges little weight and the balance
// places the dots. It was fitted to the true outlines of simulated contacts of random tools (test/benchmark/fit_contact_score.py). Its mean
// over the grid's eight symmetries does not depend on how the grid is turned.
#include "touchpad/contact/edge_distance.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

#include "common/median.hpp"
#include "common/vectors.hpp"
#include "common/wide.hpp"
#include "touchpad/contact/contact_score.hpp"
#include "touchpad/contact/edge_weights.hpp"

namespace tactile {
namespace {

constexpr std::ptrdiff_t REACH = 2, SIDE = 2 * REACH + 1, NEXT = SIDE * SIDE;                    // dots, of what is fed in around each
constexpr std::ptrdiff_t KINDS = 3, MAPPED = KINDS * NEXT, FED = MAPPED + 1;                     // loads, scores, bends; and the spread
constexpr std::ptrdiff_t FIRST = std::size(edge::BIASES_1), SECOND = std::size(edge::BIASES_2);  // units of the hidden layers
constexpr int SYMMETRIES = 8;
constexpr double HALF = 0.5;   // score of the border of a contact
constexpr double NEAR = 0.25;  // score from which a dot and those beside it are judged. Chosen, as are the limits below
constexpr double LIGHTEST = -1, HEAVIEST = 4, STEEPEST = 0.5, LEAST_SPREAD = 0.02, MOST_SPREAD = 0.06;
constexpr float BEND_SCALE = 4, SPREAD_SCALE = 20;
// Weights of a parabola's least squares through five points, in its middle, from there outwards (Savitzky and Golay 1964).
constexpr double PARABOLA[] = {17.0 / 35, 12.0 / 35, -3.0 / 35};
static_assert(std::size(edge::WEIGHTS_1) == FED * FIRST && std::size(edge::WEIGHTS_2) == FIRST * SECOND);

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

// The network's answer, pitches, to the numbers fed in.
TACTILE_INLINE float answer(const float* fed) {
    float first[FIRST], second[SECOND], distance = edge::BIASES_3[0];
    std::copy(edge::BIASES_1, edge::BIASES_1 + FIRST, first);
    std::copy(edge::BIASES_2, edge::BIASES_2 + SECOND, second);
    for (std::ptrdiff_t j = 0; j < FED; ++j) {
        for (std::ptrdiff_t i = 0; i < FIRST; ++i) first[i] += fed[j] * edge::WEIGHTS_1[j * FIRST + i];
    }
    for (std::ptrdiff_t j = 0; j < FIRST; ++j) {
        const float unit = first[j] > 0 ? first[j] : 0;
        for (std::ptrdiff_t i = 0; i < SECOND; ++i) second[i] += unit * edge::WEIGHTS_2[j * SECOND + i];
    }
    for (std::ptrdiff_t j = 0; j < SECOND; ++j) distance += (second[j] > 0 ? second[j] : 0) * edge::WEIGHTS_3[j];
    return distance;
}

TACTILE_WIDE void judge(Grid grid, const std::vector<std::uint8_t>& near, const Padded (&maps)[KINDS], float spread, double* found) {
    const Offsets offsets(maps[0].width);
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!near[k]) continue;
        const std::ptrdiff_t at = maps[0].place(grid, k);
        float total = 0, fed[FED];
        fed[MAPPED] = spread;
        for (int way = 0; way < SYMMETRIES; ++way) {
            for (std::ptrdiff_t kind = 0; kind < KINDS; ++kind) {
                for (std::ptrdiff_t j = 0; j < NEXT; ++j) fed[kind * NEXT + j] = maps[kind].values[at + offsets.next[way][j]];
            }
            total += answer(fed);
        }
        found[k] = std::clamp(HALF + total / (2.0 * SYMMETRIES), 0.0, 1.0);
    }
}

// A dot that alone sticks out of a straight border, with five touching dots in the row behind it and none beside or in front of it: its
// distance is at most that of a parabola along the border, fitted to it and to two dots on each side. Others stay as they are.
void smooth_single_dots(Grid grid, std::vector<double>& found) {
    const std::vector<double> told = found;
    constexpr std::ptrdiff_t WAYS[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};  // inwards
    each_dot(grid, [&](std::ptrdiff_t k, bool inner) {
        if (!inner || !(told[k] > HALF)) return;
        for (const auto& way : WAYS) {
            const auto at = [&](std::ptrdiff_t inwards, std::ptrdiff_t aside) {
                const std::ptrdiff_t row = k / grid.columns + inwards * way[0] + aside * way[1];
                const std::ptrdiff_t column = k % grid.columns + inwards * way[1] + aside * way[0];
                return row < 0 || column < 0 || row >= grid.rows || column >= grid.columns ? 0.0 : told[row * grid.columns + column];
            };
            bool sticks_out = at(0, -1) <= HALF && at(0, 1) <= HALF;
            for (std::ptrdiff_t aside = -2; aside <= 2; ++aside) sticks_out = sticks_out && at(1, aside) > HALF;
            for (std::ptrdiff_t aside = -1; aside <= 1; ++aside) sticks_out = sticks_out && at(-1, aside) <= HALF;
            if (!sticks_out) continue;
            const double along = PARABOLA[0] * told[k] + PARABOLA[1] * (at(0, -1) + at(0, 1)) + PARABOLA[2] * (at(0, -2) + at(0, 2));
            found[k] = std::max(0.0, std::min(told[k], along));
        }
    });
}

}  // namespace

std::vector<double> edge_distance(Grid grid, const double* score, const double* load, const double* places, const double* normals,
                                  double pitch) {
    std::vector<double> found(grid.size());
    std::vector<std::uint8_t> near(grid.size());
    bool any = false;
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!(score[k] > NEAR)) continue;
        any = true;
        around(grid, k, [&](std::ptrdiff_t j) { near[j] = 1; });
    }
    if (!any) return found;
    Padded maps[KINDS] = {Padded(grid), Padded(grid), Padded(grid)};
    each_dot(grid, [&](std::ptrdiff_t k, bool inner) {
        const std::ptrdiff_t at = maps[0].place(grid, k);
        maps[0].values[at] = limited(load[k], LIGHTEST, HEAVIEST);
        maps[1].values[at] = limited(score[k], 0, 1);
        if (inner) maps[2].values[at] = BEND_SCALE * limited(bend(grid, k, places, normals, pitch), -STEEPEST, STEEPEST);
    });
    judge(grid, near, maps, SPREAD_SCALE * spread_of(grid, load), found.data());
    smooth_single_dots(grid, found);
    drop_single_dots(grid, load, found);
    return found;
}

}  // namespace tactile
