// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/near_pairs.hpp"

#include <algorithm>
#include <cmath>

namespace tactile {
namespace {

// Pairs of near image positions: each position is compared with those in its cell of a grid and in the eight cells around it.

constexpr double MOST_CELLS = 1 << 20;  // bounds the memory. Chosen

// A grid of square cells over the positions; each cell heads a linked list of the positions put into it.
class Cells {
 public:
    Cells(const double* places, std::ptrdiff_t count, double side) : cell_(count, -1), next_(count, -1) {
        const Bounds bounds(places, count);
        side = std::max(side, std::sqrt((bounds.wide() + side) * (bounds.high() + side) / MOST_CELLS));
        columns_ = static_cast<std::ptrdiff_t>(bounds.wide() / side) + 3;  // a margin, so that each cell has eight neighbours
        first_.assign(columns_ * (static_cast<std::ptrdiff_t>(bounds.high() / side) + 3), -1);
        for (std::ptrdiff_t i = 0; i < count; ++i) cell_[i] = bounds.cell(places + 2 * i, side, columns_);
    }

    void put(std::int32_t i) {
        next_[i] = first_[cell_[i]];
        first_[cell_[i]] = i;
    }

    // Calls call(j) for each position j that was put into the cell of position i or into one of its eight neighbours.
    template <class Call>
    void around(std::ptrdiff_t i, Call call) const {
        for (const std::ptrdiff_t row : {-columns_, std::ptrdiff_t{0}, columns_}) {
            for (std::ptrdiff_t column = -1; column <= 1; ++column) {
                for (std::int32_t j = first_[cell_[i] + row + column]; j >= 0; j = next_[j]) call(j);
            }
        }
    }

 private:
    std::ptrdiff_t columns_;
    std::vector<std::ptrdiff_t> cell_;
    std::vector<std::int32_t> next_, first_;
};

}  // namespace

Bounds::Bounds(const double* places, std::ptrdiff_t count) : left(0), right(0), top(0), bottom(0) {
    if (count) left = right = places[0], top = bottom = places[1];
    for (const double *at = places, *end = places + 2 * count; at != end; at += 2) {
        left = std::min(left, at[0]), right = std::max(right, at[0]), top = std::min(top, at[1]), bottom = std::max(bottom, at[1]);
    }
}

std::vector<std::pair<std::int32_t, std::int32_t>> near_pairs(const double* places, std::ptrdiff_t count, double reach) {
    std::vector<std::pair<std::int32_t, std::int32_t>> found;
    found.reserve(8 * count);
    Cells cells(places, count, reach);
    for (std::int32_t i = 0; i < count; ++i) {
        std::int32_t near[MOST_NEIGHBOURS + 1];  // listed without a branch that would be mispredicted
        std::size_t met = 0;
        cells.around(i, [&](std::int32_t j) {
            near[met] = j;
            met += (std::abs(places[2 * i] - places[2 * j]) < reach) & (std::abs(places[2 * i + 1] - places[2 * j + 1]) < reach) &
                   (met < MOST_NEIGHBOURS);
        });
        for (std::size_t n = 0; n < met; ++n) found.emplace_back(near[n], i);
        cells.put(i);
    }
    return found;
}

}  // namespace tactile
