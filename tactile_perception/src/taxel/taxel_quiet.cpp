// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/taxel_quiet.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/grid.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

// The frame's values, counts and quiet taxels, from those before; found.quiet: marks what is near a touched taxel.
TACTILE_WIDE void follow(const float* change, std::ptrdiff_t taxels, float frames, float gain, Followed& found) {
    float *values = found.values.data(), *count = found.count.data();
    std::uint8_t* quiet = found.quiet.data();
#pragma GCC ivdep
    for (std::ptrdiff_t k = 0; k < taxels; ++k) quiet[k] = (quiet[k] == 0) & (std::abs(change[k]) <= std::numeric_limits<float>::max());
#pragma GCC ivdep
    for (std::ptrdiff_t k = 0; k < taxels; ++k) {
        const float seen = count[k] + static_cast<float>(quiet[k]);
        const float moved = values[k] + change[k] * (seen <= frames ? 1 / seen : gain);
        count[k] = seen;
        values[k] = quiet[k] ? moved : values[k];
    }
}

// Marks what changes by more than pressed, and adds it to responded.
TACTILE_WIDE void respond(const float* change, std::ptrdiff_t taxels, float pressed, std::uint8_t* responded, std::uint8_t* loud) {
#pragma GCC ivdep
    for (std::ptrdiff_t k = 0; k < taxels; ++k) {
        loud[k] = change[k] > pressed;
        responded[k] |= loud[k];
    }
}

}  // namespace

Followed follow_quiet(const float* values, const float* count, const float* change, const std::uint8_t* touched, std::ptrdiff_t rows,
                      std::ptrdiff_t columns, std::ptrdiff_t around, double frames, float gain) {
    const std::ptrdiff_t taxels = rows * columns;
    Followed found{{values, values + taxels}, {count, count + taxels}, spread_mask(touched, rows, columns, around)};
    follow(change, taxels, static_cast<float>(frames), gain, found);
    return found;
}

Responding responding(const float* change, const std::uint8_t* responded, std::ptrdiff_t rows, std::ptrdiff_t columns, float pressed,
                      float part) {
    const std::ptrdiff_t taxels = rows * columns;
    Responding found{{responded, responded + taxels}, std::vector<std::uint8_t>(taxels)};
    std::vector<std::uint8_t> loud(taxels);
    respond(change, taxels, pressed, found.responded.data(), loud.data());
    const Box box = box_around(loud.data(), rows, columns);
    // The lesser of two neighbours; 0 unless both respond.
    const auto lesser = [&](std::ptrdiff_t a, std::ptrdiff_t b) { return loud[a] && loud[b] ? std::min(change[a], change[b]) : 0.0f; };
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        for (std::ptrdiff_t c = box.left; c < box.right; ++c) {
            const std::ptrdiff_t k = r * columns + c;
            if (found.responded[k]) continue;
            const float down = r > 0 && r + 1 < rows ? lesser(k - columns, k + columns) : 0.0f;
            const float across = c > 0 && c + 1 < columns ? lesser(k - 1, k + 1) : 0.0f;
            const float least = std::max(down, across);
            found.silent[k] = least > 0 && change[k] < part * least;
        }
    }
    return found;
}

}  // namespace tactile
