// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace tactile {

constexpr std::size_t MOST_NEIGHBOURS = 32;  // dots that are told apart are a diameter from one another: no more are in reach

// Pairs of places (count, 2), px, that are within reach of each other along both axes; no more than MOST_NEIGHBOURS times count.
std::vector<std::pair<std::int32_t, std::int32_t>> near_pairs(const double* places, std::ptrdiff_t count, double reach);

}  // namespace tactile
