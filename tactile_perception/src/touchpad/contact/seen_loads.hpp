// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "touchpad/contact/dot_loads.hpp"

namespace tactile {

// All dots of the grid: places (K, 3), m, of unseen ones interpolated; whether each is seen (K); loads.
struct SeenLoads {
    std::vector<double> places;
    std::unique_ptr<bool[]> seen;
    Loads loads;
};

// Loads on dots at rest (K, 3), m, of which dots id (count), of the grid, are seen at places (count, 3), m. Where an unseen dot or one of
// its neighbours has a load over `settled`, unseen dots are placed by one step towards the balance, along their rays from origin (3).
// rest_pressure: as for find_loads.
SeenLoads seen_loads(const Membrane& membrane, const std::int64_t* id, const double* places, std::ptrdiff_t count, const double* rest,
                     const double* origin, double rest_pressure, double settled);

}  // namespace tactile
