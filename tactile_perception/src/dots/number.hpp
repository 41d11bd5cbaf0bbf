// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Row and column of dots on a printed grid: relative ones by links and, over gaps, by extrapolation; then their origin on the print.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace tactile {

struct GridNumbers {
    std::vector<std::int64_t> id;  // row * columns + column, -1 where not certain
    std::string reason;            // empty, or why no dot is numbered
    double pitch;                  // px, NaN where unknown
};

// Numbers the dots of each frame anew. The last certain frame tells which rows are seen where some are hidden or more come into view.
class GridNumbering {
 public:
    GridNumbering(std::int64_t rows, std::int64_t columns);
    // Dots at places (count, 2), px, finite.
    GridNumbers number(const double* places, std::ptrdiff_t count);
    // Takes dots with these numbers, row * columns + column or -1, as the last certain frame.
    void remember(const double* places, const std::int64_t* id, std::ptrdiff_t count);

    std::int64_t count() const { return printed_[0] * printed_[1]; }  // of printed dots

 private:
    GridNumbers numbered(const double* places, std::ptrdiff_t count) const;

    std::int64_t printed_[2];  // rows, columns
    std::vector<double> before_places_;
    std::vector<std::int64_t> before_rc_;
};

}  // namespace tactile
