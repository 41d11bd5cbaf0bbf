// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Rows and columns of dots on a printed grid, image by image.
//
// Relative rows and columns follow from one image (lattice.hpp). Their origin on the print follows where all printed rows and columns are
// seen. If an outer row is missing, the last certain image shows it where the pattern's irregularity (print, lens, press) excludes a shift
// by a pitch; else no dot has a number.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "common/fields.hpp"
#include "common/rows.hpp"

namespace tactile {

// What decides the numbers, each with its unit and what it is.
struct NumberingLimits {
    double max_turned = 38;       // degrees, limit: of the rows from u; beyond it rows and columns may be exchanged
    double few_linked = 0.7;      // 1, limit: of the dots; with fewer linked, the reason gives their number
    double outer_share = 0.2;     // 1, limit: of the printed length, minimum number of dots of an outer row; fewer are false dots
    double clipped_share = 0.75;  // 1, limit: of the median row, maximum number of dots of an outer row that is dropped if too many are seen
    std::int64_t max_clipped = 2;   // rows, limit: surplus ones that are dropped
    double near = 0.35;             // pitch, limit: within it a dot continues one of the last image; below half a pitch
    double stayed_share = 0.8;      // 1, limit: of the dots, that must continue for the last numbers to be used
    double max_still_motion = 0.2;  // pitch, limit: median motion from the last image up to which less evidence is needed
    double uneven_ratio = 0.5;      // 1, limit: spread of motions at the right numbers over that one row off, below which it is excluded
    double still_ratio = 0.8;       // 1, limit: the same where little moved; an even grid, which shows no difference, has 1
    std::size_t min_moves = 8;      // 1, numeric: motions that give a spread
    std::size_t sample = 20;        // 1, numeric: dots whose nearest ones of the last image give the offset; bounds the time
    std::size_t min_row = 2;        // 1, limit: dots of a row
    // A grid of unknown size
    double on_grid = 0.8;   // 1, limit: of the dots, that form the grid; more are missed or false on no sensor that could be used
    double oblique = 0.34;  // 1, limit: cosine of rows and columns, square within 20 degrees of view; those of hexagons are 60 apart
    double unequal = 2;     // 1, limit: ratio of the pitches
};

// id: row * columns + column of each dot, -1 where not certain; reason: why no dot is numbered; pitch: px, NaN where unknown.
struct GridNumbers {
    std::vector<std::int64_t> id;
    std::string reason;
    double pitch = std::numeric_limits<double>::quiet_NaN();
    TACTILE_FIELDS(id, reason, pitch)
};

constexpr std::int64_t MAX_ROWS = 2000;  // 1, limit: rows, and columns, of a grid; bounds the memory

// A printed grid. is_whole: whether the print has no more rows and columns; else an image of so many may show others.
struct PrintedGrid {
    std::int64_t rows = 0, columns = 0;
    bool is_whole = true;
    std::int64_t count() const { return rows * columns; }
    TACTILE_FIELDS(rows, columns)
};

// Row and column of dots on a printed grid; row 0 on top, column 0 left. Rows may be rotated by up to 38 degrees. Each image is numbered by
// itself; the last certain one, or the first, shows which rows are seen where some are hidden or more come into view.
class GridNumbering {
 public:
    explicit GridNumbering(const PrintedGrid& printed) : printed_(printed) {}
    // Numbers of dots at uv, px, in any order; rows that are no positions get -1.
    GridNumbers number(const Rows2& uv);

 private:
    PrintedGrid printed_;
    std::vector<Rows2> before_;  // px, positions of the printed dots in the last certain image and in the first; NaN: not seen
};

// The grid that dots at uv, px, form, as far as it is seen; without rows and columns where most of them form none.
PrintedGrid find_grid(const Rows2& uv);

}  // namespace tactile
