// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact/seen_loads.hpp"

#include <algorithm>
#include <cmath>

#include "common/vectors.hpp"
#include "touchpad/membrane/holes.hpp"
#include "touchpad/membrane/settled_holes.hpp"

namespace tactile {
namespace {

// Whether an unseen dot or a neighbour of one has a load over most.
bool unseen_are_loaded(Grid grid, const bool* seen, const std::vector<double>& load, double most) {
    bool any = false;
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!seen[k]) around(grid, k, [&](std::ptrdiff_t j) { any |= std::abs(load[j]) > most; });
    }
    return any;
}

}  // namespace

SeenLoads seen_loads(const Membrane& membrane, const std::int64_t* id, const double* places, std::ptrdiff_t count, const double* rest,
                     const double* origin, double rest_pressure, double settled) {
    const std::ptrdiff_t size = membrane.grid.size();
    SeenLoads found{std::vector<double>(3 * size), std::unique_ptr<bool[]>(new bool[size]()), {}};
    std::vector<double>& all = found.places;  // displacements first
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        found.seen[id[i]] = true;
        store(all.data(), id[i], vec3_at(places, i) - vec3_at(rest, id[i]));
    }
    fill_holes(all.data(), found.seen.get(), membrane.grid.rows, membrane.grid.columns, 3);
    for (std::ptrdiff_t k = 0; k < size; ++k) store(all.data(), k, vec3_at(rest, k) + vec3_at(all.data(), k));
    found.loads = find_loads(membrane, all.data(), rest_pressure);
    if (unseen_are_loaded(membrane.grid, found.seen.get(), found.loads.load, settled)) {
        all = settle_holes(membrane, all.data(), found.loads.load.data(), found.seen.get(), origin, rest_pressure);
        found.loads = find_loads(membrane, all.data(), rest_pressure);
    }
    return found;
}

}  // namespace tactile
