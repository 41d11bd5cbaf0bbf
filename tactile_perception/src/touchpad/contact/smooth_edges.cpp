// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact/smooth_edges.hpp"

#include <algorithm>
#include <cstdint>

#include "common/grid.hpp"

namespace tactile {
namespace {

constexpr double HALF = 0.5;               // score of the border of a contact
constexpr double CHANGE = 0.1;             // of the score. Chosen on simulated and recorded faces and balls: 0.1 to 0.2 are alike
constexpr std::ptrdiff_t SMALL_PATCH = 8;  // dots of a patch that is left as it is: a ball's first dots all stick out. Chosen

}  // namespace

std::vector<double> smooth_edges(Grid grid, const double* score) {
    std::vector<std::uint8_t> touching(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) touching[k] = score[k] > HALF;
    std::vector<std::int32_t> label;
    const auto patches = components(touching.data(), grid.rows, grid.columns, true, label);
    const auto at = [&](std::ptrdiff_t r, std::ptrdiff_t c) -> int {
        return r >= 0 && c >= 0 && r < grid.rows && c < grid.columns && touching[r * grid.columns + c];
    };
    std::vector<double> smooth(score, score + grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        const std::ptrdiff_t r = k / grid.columns, c = k % grid.columns;
        const int next = at(r - 1, c) + at(r + 1, c) + at(r, c - 1) + at(r, c + 1);
        if (touching[k] && next <= 1 && patches[label[k] - 1].count >= SMALL_PATCH) smooth[k] = score[k] - CHANGE;
        if (!touching[k] && next >= 3 && score[k] > 0) smooth[k] = std::min(score[k] + CHANGE, 1.0);
    }
    return smooth;
}

}  // namespace tactile
