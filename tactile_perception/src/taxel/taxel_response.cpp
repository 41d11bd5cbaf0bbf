// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/taxel_response.hpp"

#include <cmath>

#include "common/grid.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

// What is hidden of the load, and the held load after this frame. Solves the law for the load where the held load stays, and where it
// follows from below or above; NaN stays for its frame.
TACTILE_WIDE void hide(const float* pressure, const float* last, const float* before, std::ptrdiff_t taxels, const Loop& loop,
                       float* hidden, float* held) {
    const float share = loop.share, reach = loop.reach, relative = loop.relative, crept = loop.crept;
    const float rest = 1 / (1 - share), rising = 1 / (1 - share * relative), falling = 1 / (1 + share * relative), lag = share * reach;
#pragma GCC ivdep
    for (std::ptrdiff_t k = 0; k < taxels; ++k) {
        const float shown = pressure[k], crawled = before[k] + crept * (last[k] - before[k]);
        const float stays = crawled == crawled ? crawled : shown;
        const float between = (shown - share * stays) * rest;
        const float above = (shown + lag) * (shown + lag > 0 ? rising : 1.0f), below = (shown - lag) * (shown - lag > 0 ? falling : 1.0f);
        const float free = reach + relative * (between > 0 ? between : 0.0f), off = between - stays;
        const float load = off > free ? above : off < -free ? below : between;
        const float most = reach + relative * (load > 0 ? load : 0.0f);
        const float lowest = load - most, highest = load + most;
        held[k] = stays < lowest ? lowest : stays > highest ? highest : stays;
        hidden[k] = load - shown;
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

Undone undone(const float* pressure, const float* last, const float* held, std::ptrdiff_t rows, std::ptrdiff_t columns, const Loop& loop,
              double smooth) {
    Undone found{std::vector<float>(rows * columns), std::vector<float>(rows * columns)};
    hide(pressure, last, held, rows * columns, loop, found.load.data(), found.held.data());
    blur(found.load, rows, columns, smooth, Outside::replicated);
    add(pressure, rows * columns, found.load.data());
    return found;
}

}  // namespace tactile
