// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact/carried_loads.hpp"

#include <cstdint>

#include "common/vectors.hpp"

namespace tactile {

CarriedLoads carried_loads(Grid grid, const double* places, const double* force, const double* load, double loaded) {
    std::vector<std::uint8_t> carries(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!(load[k] > loaded)) continue;
        around(grid, k, [&](std::ptrdiff_t j) { carries[j] = 1; });
    }
    CarriedLoads found{std::vector<double>(3 * grid.size()), {}};
    Vec3 total{0, 0, 0}, moment{0, 0, 0};
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!carries[k]) continue;
        const Vec3 own = vec3_at(force, k);
        store(found.force.data(), k, own);
        total = total + own;
        moment = moment + cross(vec3_at(places, k), own);
    }
    found.wrench = {total.x, total.y, total.z, moment.x, moment.y, moment.z};
    return found;
}

}  // namespace tactile
