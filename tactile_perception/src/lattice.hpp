// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// Rows and columns of dots on a printed grid relative to each other.
struct Lattice {
    bool found = false;
    std::vector<std::int64_t> row, column;  // of each dot; 0 where it is no member
    std::vector<std::uint8_t> member;
    double angle = 0;  // of the rows against u, rad
    double pitch = 0;  // px
};

// Neighbours of dots at places (count, 2), px, all finite, and from these their indices; hint: rad, direction in which rows run: of the
// four possible answers the one within 45 degrees of it.
Lattice find_lattice(const double* places, std::ptrdiff_t count, double hint);

// Indices propagated along links: right, below (count): the neighbour that way, -1 where there is none. Member where links lead to;
// contradictions: links that lead elsewhere than found, and dots in another's place.
struct Indices {
    std::vector<std::int64_t> row, column;
    std::vector<std::uint8_t> member;
    std::ptrdiff_t contradictions = 0;
};
Indices propagate_indices(const std::vector<std::int32_t>& right, const std::vector<std::int32_t>& below);

}  // namespace tactile
