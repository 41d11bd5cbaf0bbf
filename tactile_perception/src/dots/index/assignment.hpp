// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace tactile {

// The column of each row, one to one, with the least sum of costs (rows, columns); rows <= columns, costs finite.
std::vector<std::ptrdiff_t> assign_least(const std::vector<double>& cost, std::ptrdiff_t rows, std::ptrdiff_t columns);

// One-to-one links (place, dot) between places and dots (count, 2), px, closer than gate, with the least sum of squares; an unlinked place
// costs the gate squared. Links are sorted by place.
using Link = std::pair<std::ptrdiff_t, std::ptrdiff_t>;
std::vector<Link> link_places(const double* places, std::ptrdiff_t place_count, const double* dots, std::ptrdiff_t dot_count, double gate);

}  // namespace tactile
