// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace tactile {

// The rectangle around places (count, 2), px.
struct Bounds {
    double left, right, top, bottom;
    Bounds(const double* places, std::ptrdiff_t count);
    double wide() const { return right - left; }
    double high() const { return bottom - top; }
    // Number of a place's cell, of that side, px, row by row; the rectangle has a margin of a cell.
    std::ptrdiff_t cell(const double* place, double side, std::ptrdiff_t columns) const {
        return (static_cast<std::ptrdiff_t>((place[1] - top) / side) + 1) * columns +
               static_cast<std::ptrdiff_t>((place[0] - left) / side) + 1;
    }
};

constexpr std::size_t MOST_NEIGHBOURS = 32;  // of a position. Derived: distinct dots are a diameter apart, so fewer are in reach

// Pairs of places (count, 2), px, that are within reach, px, of each other along both axes; at most MOST_NEIGHBOURS * count.
std::vector<std::pair<std::int32_t, std::int32_t>> near_pairs(const double* places, std::ptrdiff_t count, double reach);

}  // namespace tactile
