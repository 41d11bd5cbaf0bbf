// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/outlines.hpp"

namespace tactile::taxel {

// Outlines of the regions of an array.
struct Outlines {
    Loops loops;                                   // in taxels
    std::vector<double> points;                    // (M, 3) m, of the loops
    std::vector<std::int32_t> label;               // of each loop: the taxels at its inner side
    std::vector<std::array<double, 6>> integrals;  // of 1, x, y, xx, xy, yy within each loop, m; negative for holes
};

// Outlines where score (rows, columns) exceeds level; labels: (rows, columns) of the taxels there; pitch: m.
Outlines outlines_of(const float* score, const std::int32_t* labels, std::ptrdiff_t rows, std::ptrdiff_t columns, double level,
                     double pitch);

}  // namespace tactile::taxel
