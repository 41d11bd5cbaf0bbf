// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/taxel_response.hpp"

#include <cmath>

#include "common/grid.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

// The load that is hidden after a frame; NaN stays.
TACTILE_WIDE void hide(const float* pressure, const float* last, const float* before, std::ptrdiff_t taxels, float width, float crept,
                       float* hidden) {
#pragma GCC ivdep
    for (std::ptrdiff_t k = 0; k < taxels; ++k) {
        const float gone = before[k] * crept;
        // Once for what creeps out of the layer, once for what the load seems to have changed by it.
        const float value = before[k] + (pressure[k] - last[k]) - gone - gone;
        const float bounded = value > width ? width : value;
        hidden[k] = bounded < -width ? -width : bounded;
    }
}

TACTILE_WIDE void add(const float* values, std::ptrdiff_t taxels, float* to) {
    for (std::ptrdiff_t k = 0; k < taxels; ++k) to[k] = values[k] + to[k];
}

}  // namespace

TACTILE_WIDE std::vector<float> pressure_of(const float* change, const float* by_gain, std::ptrdiff_t taxels, const Curve& curve) {
    std::vector<float> found(taxels);
    float* out = found.data();
    const float linear = curve.linear, quadratic = curve.quadratic, fast = curve.fast * curve.knee, knee = curve.knee;
    if (quadratic == 0 && fast == 0) {
        for (std::ptrdiff_t k = 0; k < taxels; ++k) out[k] = change[k] * by_gain[k] * linear;
        return found;
    }
    for (std::ptrdiff_t k = 0; k < taxels; ++k) {
        const float value = change[k] * by_gain[k], size = std::abs(value);
        out[k] = value * (linear + quadratic * size + fast / (size + knee));
    }
    return found;
}

Undone undone(const float* pressure, const float* last, const float* hidden, std::ptrdiff_t rows, std::ptrdiff_t columns, float width,
              float crept, double smooth) {
    Undone found{std::vector<float>(rows * columns), std::vector<float>(rows * columns)};
    hide(pressure, last, hidden, rows * columns, width, crept, found.hidden.data());
    found.load = found.hidden;
    blur(found.load, rows, columns, smooth, Outside::replicated);
    add(pressure, rows * columns, found.load.data());
    return found;
}

}  // namespace tactile
