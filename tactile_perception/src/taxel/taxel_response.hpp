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

// What a layer with play hides of a load (Visintin 1994), and the load.
struct Undone {
    std::vector<float> load, hidden;
};

// After pressure (rows, columns) followed last, with hidden (rows, columns). What is hidden grows with each change up to width, half of the
// loop's; of that before, the part crept is gone; neighbours tell it together, by a Gaussian of standard deviation smooth, taxels.
Undone undone(const float* pressure, const float* last, const float* hidden, std::ptrdiff_t rows, std::ptrdiff_t columns, float width,
              float crept, double smooth);

}  // namespace tactile
