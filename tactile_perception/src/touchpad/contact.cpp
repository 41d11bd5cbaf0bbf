// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "common/median.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

// ---- The border. The network was fitted to the true outlines of simulated contacts of random tools (test/benchmark/fit_contact_score.py):
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

// Adds to units, eight times N of them, what numbers (count) that are fed in give them by their weights.
template <std::ptrdiff_t N>
TACTILE_INLINE void feed(const float* fed, std::ptrdiff_t count, const float* weights, Eight (&units)[N]) {
    for (std::ptrdiff_t j = 0; j < count; ++j) {
        for (std::ptrdiff_t i = 0; i < N; ++i, weights += 8) {
            Eight some;
            std::memcpy(&some, weights, sizeof some);
            units[i] += fed[j] * some;
        }
    }
}

// The network's answer, pitches, to the numbers fed in.
TACTILE_INLINE float answer(const BorderNetwork& network, const float* fed) {
    Eight first[FIRST / 8], second[SECOND / 8];
    float units[FIRST], distance = network.bias_3;
    std::memcpy(first, network.biases_1.data(), sizeof first);
    std::memcpy(second, network.biases_2.data(), sizeof second);
    feed(fed, FED, network.weights_1.data(), first);
    std::memcpy(units, first, sizeof units);
    for (float& unit : units) unit = unit > 0 ? unit : 0;
    feed(units, FIRST, network.weights_2.data(), second);
    std::memcpy(units, second, sizeof second);
    for (std::ptrdiff_t j = 0; j < SECOND; ++j) distance += (units[j] > 0 ? units[j] : 0) * network.weights_3[j];
    return distance;
}

TACTILE_WIDE void judge(const BorderNetwork& network, Grid grid, const std::vector<std::uint8_t>& near, const Padded (&maps)[KINDS],
                        float spread, double* found) {
    const Offsets offsets(maps[0].width);
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!near[k]) continue;
        const std::ptrdiff_t at = maps[0].place(grid, k);
        float total = 0, fed[FED];
        fed[FED - 1] = spread;
        for (int way = 0; way < SYMMETRIES; ++way) {
            for (std::ptrdiff_t kind = 0; kind < KINDS; ++kind) {
                for (std::ptrdiff_t j = 0; j < NEXT; ++j) fed[kind * NEXT + j] = maps[kind].values[at + offsets.next[way][j]];
            }
            total += answer(network, fed);
        }
        found[k] = std::clamp(0.5 + total / (2.0 * SYMMETRIES), 0.0, 1.0);
    }
}

// ---- What the dots carry. Errors of the ranges beside an edge move its load to and fro between the dots there and free dots around, but
// hardly change the sum.

constexpr double UNLOADED = 0.3;  // load below which every dot counts as free; chosen
constexpr double LOADED = 0.5;    // load above which a dot counts as loaded; chosen

// Dots around a region whose forces count in full, and from which on they do not count; the share falls evenly between, which leaves less
// noise than a sharp border. Chosen on simulated faces, rings, balls and edges: errors of the force are 2.7 to 2.9 % for all between 2 to 3
// and 4 to 6, 7.0 % with the next dots alone; under glare 8.5 to 9.6 and 12.8 %.
constexpr std::ptrdiff_t FULL = 2, NONE = 6;

// The nearest region (K) of each dot, from 1, of several the first, 0 far from all; and the share (K) of the dot's force that belongs to
// it: 1 in the region, less and less around it.
struct NearRegions {
    std::vector<std::int32_t> region;
    std::vector<double> share;
};

// region (K): of the dots in regions, 0 for others.
NearRegions near_regions(Grid grid, std::vector<std::int32_t> region) {
    NearRegions found{std::move(region), std::vector<double>(grid.size())};
    std::vector<std::ptrdiff_t> border, next;  // dots found in the last step, and in this one
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (found.region[k] > 0) found.share[k] = 1, border.push_back(k);
    }
    std::vector<std::uint8_t> now(grid.size());
    for (std::ptrdiff_t step = 1; step < NONE; ++step, border.swap(next), next.clear()) {
        const double share = std::min(1.0, static_cast<double>(NONE - step) / (NONE - FULL));
        for (const std::ptrdiff_t k : border) {
            beside(grid, k, [&](std::ptrdiff_t j) {
                if (found.region[j] == 0) {
                    found.region[j] = found.region[k], found.share[j] = share, now[j] = 1;
                    next.push_back(j);
                } else if (now[j] && found.region[k] < found.region[j]) {
                    found.region[j] = found.region[k];
                }
            });
        }
        for (const std::ptrdiff_t j : next) now[j] = 0;
    }
    return found;
}

double normal_force(const RegionDots& dots, Vec3 normal) {
    std::vector<std::int32_t> region(dots.grid.size());
    for (std::ptrdiff_t i = 0; i < dots.count; ++i) region[dots.id[i]] = dots.inside[i] ? 1 : dots.touched[i] ? 2 : 0;
    const NearRegions near = near_regions(dots.grid, std::move(region));
    Vec3 total{0, 0, 0};
    for (std::ptrdiff_t k = 0; k < dots.grid.size(); ++k) {
        if (near.region[k] == 1) total = total + vec3_at(dots.force, k);
    }
    return std::max(-dot(normal, total), 0.0);
}

// Median distance of neighbouring dots in the rows.
double pitch_of(const Skin& skin) {
    std::vector<double> apart;
    for (std::ptrdiff_t k = 0; k < skin.grid.size(); ++k) {
        if (k % skin.grid.columns) apart.push_back(length(vec3_at(skin.rest.data(), k) - vec3_at(skin.rest.data(), k - 1)));
    }
    return median(std::move(apart));
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

CarriedLoads carried_loads(Grid grid, const DotLoads& loads) {
    std::vector<std::int32_t> region(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) region[k] = loads.load[k] > LOADED;
    const NearRegions near = near_regions(grid, std::move(region));
    CarriedLoads found{std::vector<double>(3 * grid.size()), {}};
    Vec3 total{0, 0, 0}, moment{0, 0, 0};
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (near.region[k] == 0) continue;
        const Vec3 own = near.share[k] * vec3_at(loads.force.data(), k);
        store(found.force.data(), k, own);
        total = total + own;
        moment = moment + cross(vec3_at(loads.xyz.data(), k), own);
    }
    found.wrench = {total.x, total.y, total.z, moment.x, moment.y, moment.z};
    return found;
}

RegionContact region_contact(const RegionDots& dots, const RegionShape& region, const Nodes& wide, const RestCap& rest, double sigma) {
    std::vector<double> points;
    for (std::ptrdiff_t i = 0; i < dots.count; ++i) {
        if (dots.inside[i]) points.insert(points.end(), dots.places + 3 * i, dots.places + 3 * i + 3);
    }
    const auto count = static_cast<std::ptrdiff_t>(points.size() / 3);
    const double depth = contact_depth(points.data(), count, rest, region.pitch);
    return {contact_point(points.data(), count, region, wide, sigma), depth < 0 ? 0.0 : depth,
            dots.force ? normal_force(dots, region.normal) : NAN};
}

DotClassifier::DotClassifier(Skin skin, Vec3 origin, std::shared_ptr<const BorderNetwork> network, const StickSlipModel& model)
    : membrane_(std::move(skin), origin),
      stick_slip_(membrane_.skin().grid, {origin.x, origin.y, origin.z}, model),
      network_(std::move(network)),
      pitch_(pitch_of(membrane_.skin())) {}

void DotClassifier::set_rest(Skin skin) {
    pitch_ = pitch_of(skin);
    membrane_.set_rest(std::move(skin));
}

DotFrame DotClassifier::classify(const std::int64_t* id, const double* places, std::ptrdiff_t count, double seconds) {
    const Grid grid = membrane_.skin().grid;
    DotFrame found{membrane_.loads(id, places, count),
                   std::vector<double>(grid.size()),
                   {},
                   {std::vector<double>(3 * grid.size()), {}},
                   {},
                   {},
                   {},
                   {}};
    const bool loaded =
        std::any_of(found.loads.load.begin(), found.loads.load.end(), [](double load) { return std::abs(load) >= UNLOADED; });
    if (loaded) found.score = border_scores(*network_, grid, found.loads, pitch_);
    found.state = stick_slip_.update(found.loads, found.score, seconds);
    if (std::find_if(found.state.begin(), found.state.end(), [](std::uint8_t one) { return one != FREE; }) != found.state.end())
        found.carried = carried_loads(grid, found.loads);
    found.ways = stick_slip_.ways(), found.motion = stick_slip_.motion();
    found.slipping = stick_slip_.slipping(), found.objects = stick_slip_.objects();
    return found;
}

}  // namespace tactile
