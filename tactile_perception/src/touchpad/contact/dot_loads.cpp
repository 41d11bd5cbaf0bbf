// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact/dot_loads.hpp"

#include <algorithm>
#include <cmath>

#include "common/grid.hpp"
#include "common/median.hpp"
#include "common/vectors.hpp"

namespace tactile {
namespace {

// A touched dot's load is most likely 1.1; its standard deviation below and above that: 1 under a face, hardly less anywhere, but 2 to 4
// under a ball or an edge. Chosen on simulated faces, rings, balls and edges.
constexpr double TOUCHED = 1.1, LIGHTER = 0.4, HEAVIER = 1.0;
constexpr double COUPLING = 4.0;  // log odds of a dot among touched neighbours (minus that: among free ones). Chosen
constexpr double SURE = 30.0;     // largest log odds. Chosen
// Log likelihood ratio that a patch must exceed (e^-18: noise in about one of 10^7 dots), and the most that one dot contributes: three
// dots are needed.
constexpr double EVIDENCE = 18.0, LARGEST_GAIN = 7.5;
constexpr double PRESSURE_ROUNDS[] = {0.3, 0.1, 0.06};  // scale of a free dot's load in each round; chosen, to the discretisation error
constexpr double LEAST_PRESSURE = 0.1;                  // of the rest pressure; chosen

double touched_spread(double load) {
    return load < TOUCHED ? LIGHTER : HEAVIER;
}

// Robust mean of the pressures wanted, at which each inner dot would be free: from their median, by reweighting.
double fluid_pressure(const std::vector<double>& wanted, double least) {
    double pressure = std::max(least, smallest(wanted, static_cast<std::ptrdiff_t>(wanted.size() / 2)));
    for (const double misfit : PRESSURE_ROUNDS) {
        double total = 0, sum = 0;
        for (const double value : wanted) {
            const double off = (value / pressure - 1) / misfit, weight = 1 / ((1 + off * off) * (1 + off * off));
            total += weight, sum += weight * value;
        }
        pressure = std::max(least, sum / total);
    }
    return pressure;
}

}  // namespace

Loads find_loads(const Membrane& membrane, const double* places, double rest_pressure) {
    const Grid grid = membrane.grid;
    Loads found{std::vector<double>(3 * grid.size()), std::vector<double>(3 * grid.size()), std::vector<double>(grid.size())};
    std::vector<double> elastic(3 * grid.size()), share(3 * grid.size()), wanted;
    add_forces(grid, membrane.triangles, places, elastic.data(), share.data());
    const auto each_inner = [&](auto visit) {
        for (std::ptrdiff_t row = 1; row + 1 < grid.rows; ++row) {
            for (std::ptrdiff_t k = row * grid.columns + 1; k + 1 < (row + 1) * grid.columns; ++k) {
                const Vec3 area = vec3_at(share.data(), k);
                visit(k, area, area - vec3_at(membrane.residual, k), vec3_at(elastic.data(), k));
            }
        }
    };
    each_inner([&](std::ptrdiff_t, Vec3 area, Vec3 pushed, Vec3 pull) {
        const double pressure = -dot(pull, area) / dot(pushed, area);
        if (std::isfinite(pressure)) wanted.push_back(pressure);
    });
    const double pressure = wanted.empty() ? rest_pressure : fluid_pressure(wanted, LEAST_PRESSURE * rest_pressure);
    each_inner([&](std::ptrdiff_t k, Vec3 area, Vec3 pushed, Vec3 pull) {
        const Vec3 left = pressure * pushed + pull;  // what the object balances
        store(found.force.data(), k, -1.0 * left);
        found.load[k] = dot(left, area) / (pressure * dot(area, area));
    });
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        const Vec3 area = vec3_at(share.data(), k);
        store(found.normal.data(), k, 1 / length(area) * area);
    }
    return found;
}

double log_likelihood_ratio(double load, double misfit, double variance) {
    const double narrow = misfit * misfit + variance, off = load - TOUCHED, spread = touched_spread(load);
    // the two halves of the touched loads' distribution meet at its mode: their mean width normalises it
    const double width = (std::sqrt(LIGHTER * LIGHTER + variance) + std::sqrt(HEAVIER * HEAVIER + variance)) / 2;
    return (load * load / narrow - off * off / (spread * spread + variance) + std::log(narrow / (width * width))) / 2;
}

Expectation expectation(double load, double touched, double misfit) {
    const double spread = touched_spread(load), free = (1 - touched) / (misfit * misfit), held = touched / (spread * spread);
    return {free + held, (free + held) * load - held * TOUCHED};
}

void update_probabilities(Grid grid, const double* gain, double* touched) {
    const std::vector<double> last(touched, touched + grid.size());
    for (std::ptrdiff_t row = 0; row < grid.rows; ++row) {
        for (std::ptrdiff_t column = 0; column < grid.columns; ++column) {
            const std::ptrdiff_t k = row * grid.columns + column;
            touched[k] = 0;
            if (!grid.inner(row, column)) continue;
            const double beside = (last[k - 1] + last[k + 1] + last[k - grid.columns] + last[k + grid.columns]) / 4;
            touched[k] = 1 / (1 + std::exp(-std::clamp(gain[k] + COUPLING * (2 * beside - 1), -SURE, SURE)));
        }
    }
}

void drop_weak_patches(Grid grid, const double* gain, double* touched) {
    std::vector<std::uint8_t> held(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) held[k] = touched[k] > 0.5;
    std::vector<std::int32_t> patch;
    std::vector<double> evidence(1 + components(held.data(), grid.rows, grid.columns, true, patch).size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) evidence[patch[k]] += std::min(gain[k], LARGEST_GAIN);
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (evidence.size() == 1 || (patch[k] > 0 && !(evidence[patch[k]] > EVIDENCE))) touched[k] = 0;
    }
}

}  // namespace tactile
