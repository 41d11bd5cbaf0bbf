// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/near_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tactile {

std::vector<std::pair<std::int32_t, std::int32_t>> near_pairs(const double* positions, std::ptrdiff_t count, double reach) {
    std::vector<std::int32_t> by_u(count);  // each position is compared with those to its right, as far as they are in reach
    std::iota(by_u.begin(), by_u.end(), 0);
    std::stable_sort(by_u.begin(), by_u.end(), [&](std::int32_t i, std::int32_t j) { return positions[2 * i] < positions[2 * j]; });
    std::vector<std::pair<std::int32_t, std::int32_t>> found;
    found.reserve(8 * count);
    for (auto left = by_u.begin(); left != by_u.end(); ++left) {
        const double u = positions[2 * *left], v = positions[2 * *left + 1];
        std::int32_t near[MAX_NEIGHBOURS + 1];  // listed without a branch that would be mispredicted
        std::size_t met = 0;
        for (auto right = left + 1; right != by_u.end() && positions[2 * *right] - u < reach; ++right) {
            near[met] = *right;
            met += (std::abs(positions[2 * *right + 1] - v) < reach) & (met < MAX_NEIGHBOURS);
        }
        for (std::size_t n = 0; n < met; ++n) found.push_back(std::minmax(*left, near[n]));
    }
    return found;
}

}  // namespace tactile
