// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace tactile {

constexpr std::size_t MAX_NEIGHBOURS = 32;  // of a position. Derived: distinct dots are a diameter apart, so fewer are in reach

// Pairs of positions (count, 2), px, that are within reach, px, of each other along both axes; at most MAX_NEIGHBOURS * count.
std::vector<std::pair<std::int32_t, std::int32_t>> near_pairs(const double* positions, std::ptrdiff_t count, double reach);

}  // namespace tactile
