// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Pressure of a taxel's change of value, and the load behind it.
#pragma once

#include <cstddef>
#include <vector>

namespace tactile {

// A common curve of all taxels: linear, quadratic, and one that rises fast below the knee.
struct Curve {
    float linear, quadratic, fast, knee;
};

// Pressure (taxels,) of change (taxels,) times by_gain (taxels,): the curve's, odd about 0.
std::vector<float> pressure_of(const float* change, const float* by_gain, std::ptrdiff_t taxels, const Curve& curve);

// How a sensing layer lags behind a load (Visintin 1994): it shows 1 - share of it, and share of a held load that stays until the load is
// farther from it than reach, and relative of the load, and then follows at that distance. Between frames it goes the part crept of its way
// to the load.
struct Loop {
    float share, reach, relative, crept;
};

// The load behind what is shown, and the held load.
struct Undone {
    std::vector<float> load, held;
};

// After pressure (rows, columns) is shown, with the load and the held load (rows, columns) of the last frame, NaN where unknown. Neighbours
// tell together what is hidden, by a Gaussian of standard deviation smooth, taxels.
Undone undone(const float* pressure, const float* last, const float* held, std::ptrdiff_t rows, std::ptrdiff_t columns, const Loop& loop,
              double smooth);

}  // namespace tactile
