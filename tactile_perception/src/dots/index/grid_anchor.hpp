// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// Dots with relative or printed rows and columns: places (count, 2), px; rc (count, 2).
struct IndexedDots {
    std::vector<double> places;
    std::vector<std::int64_t> rc;
    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(rc.size() / 2); }
};

// A printed grid and its image, px; width and height are 0 where unknown.
struct GridView {
    std::int64_t printed[2];  // rows, columns
    double pitch, width, height;
};

enum class AnchorFault { NONE, TOO_FEW, ANOTHER_PATTERN, DISAGREEMENT, AMBIGUOUS };

// What to add to relative rows and columns. With a fault: its axis, 0 for rows or 1 for columns, and the number of rows or columns seen.
struct Anchor {
    std::int64_t offset[2];
    AnchorFault fault;
    int axis;
    std::int64_t seen;
};

// Origin of a lattice of dots on the printed grid. before: dots of the last indexed frame, printed rows and columns; empty for none.
Anchor anchor_lattice(const IndexedDots& dots, const IndexedDots& before, const GridView& view);

}  // namespace tactile
