// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/fields.hpp"

namespace tactile {

// Relative row and column indices of dots on a printed grid.
struct Lattice {
    bool found = false;
    std::vector<std::int64_t> rc;  // row and column of each dot; 0 if it is not a member
    std::vector<std::uint8_t> member;
    double angle = 0;  // of the rows from u, rad
    double pitch = 0;  // px
    TACTILE_FIELDS(found, rc, member, angle, pitch)
};

// Finds neighbours and indices of dots at positions (count, 2), px, all finite, by links and, over gaps, by extrapolation. Of the
// four possible directions of rows, the one within 45 degrees of u is returned.
Lattice find_lattice(const double* positions, std::ptrdiff_t count);

}  // namespace tactile
