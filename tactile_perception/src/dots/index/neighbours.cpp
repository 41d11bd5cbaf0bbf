// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Pairs of near image positions: each position is compared with those in its cell of a grid and in the eight cells around it.
#include "dots/index/neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace tactile {
namespace {

constexpr double MOST_CELLS = 1 << 20;  // bounds the memory. Chosen

// A grid of square cells over the positions; each cell heads a linked list of the positions put into it.
class Cells {
 public:
    Cells(const double* places, std::ptrdiff_t count, double side) : cell_(count, -1), next_(count, -1) {
        double low[2] = {0, 0}, high[2] = {0, 0};
        bool any = false;
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            for (int axis = 0; axis < 2; ++axis) {
                low[axis] = any ? std::min(low[axis], places[2 * i + axis]) : places[2 * i + axis];
                high[axis] = any ? std::max(high[axis], places[2 * i + axis]) : places[2 * i + axis];
            }
            any = true;
        }
        side = std::max(side, std::sqrt((high[0] - low[0] + side) * (high[1] - low[1] + side) / MOST_CELLS));
        columns_ = static_cast<std::ptrdiff_t>((high[0] - low[0]) / side) + 3;  // a margin, so that each cell has eight neighbours
        first_.assign(columns_ * (static_cast<std::ptrdiff_t>((high[1] - low[1]) / side) + 3), -1);
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            const auto column = static_cast<std::ptrdiff_t>((places[2 * i] - low[0]) / side);
            cell_[i] = (static_cast<std::ptrdiff_t>((places[2 * i + 1] - low[1]) / side) + 1) * columns_ + column + 1;
        }
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

// In the order of u, places farther to the left or right than the farthest of the nearest so far need no look.
std::vector<Neighbour> nearest_others(const double* places, std::ptrdiff_t count, std::ptrdiff_t wanted) {
    const double never = std::numeric_limits<double>::infinity();
    std::vector<Neighbour> found(count * wanted, Neighbour{-1, never});
    std::vector<std::ptrdiff_t> order(count);
    std::iota(order.begin(), order.end(), std::ptrdiff_t{0});
    std::sort(order.begin(), order.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) { return places[2 * a] < places[2 * b]; });
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        const double u = places[2 * order[k]], v = places[2 * order[k] + 1];
        Neighbour* nearest = found.data() + order[k] * wanted;
        const auto compare = [&](std::ptrdiff_t other) {  // false where all beyond are farther
            const double across = places[2 * order[other]] - u;
            if (!(std::abs(across) < nearest[wanted - 1].distance)) return false;
            const double distance = std::hypot(across, places[2 * order[other] + 1] - v);
            std::ptrdiff_t at = wanted;
            while (at > 0 && distance < nearest[at - 1].distance) --at;
            if (at < wanted) {
                std::copy_backward(nearest + at, nearest + wanted - 1, nearest + wanted);
                nearest[at] = {order[other], distance};
            }
            return true;
        };
        bool left = true, right = true;
        for (std::ptrdiff_t step = 1; left || right; ++step) {
            left = left && k - step >= 0 && compare(k - step);
            right = right && k + step < count && compare(k + step);
        }
    }
    return found;
}

}  // namespace tactile
