// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/detect/grown_labels.hpp"

#include <algorithm>
#include <limits>

#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr std::uint16_t TOP = std::numeric_limits<std::uint16_t>::max();

// Of labels in three rows: the highest, and the lowest above 0 less one (TOP where there is none).
TACTILE_WIDE void bounds_of_rows(const std::uint16_t* above, const std::uint16_t* row, const std::uint16_t* below, std::ptrdiff_t columns,
                                 std::uint16_t* __restrict highest, std::uint16_t* __restrict lowest) {
    for (std::ptrdiff_t k = 0; k < columns; ++k) {
        const auto less = [](std::uint16_t label) { return static_cast<std::uint16_t>(label - 1); };  // 0 becomes TOP
        highest[k] = std::max(std::max(above[k], row[k]), below[k]);
        lowest[k] = std::min(std::min(less(above[k]), less(row[k])), less(below[k]));
    }
}

// The label where a pixel and its neighbours in a row have only one. highest, lowest: (columns + 2), with a pixel of ground at each end.
TACTILE_WIDE void only_labels(const std::uint16_t* highest, const std::uint16_t* lowest, std::ptrdiff_t columns,
                              std::uint16_t* __restrict out) {
    for (std::ptrdiff_t k = 0; k < columns; ++k) {
        const std::uint16_t most = std::max(std::max(highest[k], highest[k + 1]), highest[k + 2]);
        const std::uint16_t least = std::min(std::min(lowest[k], lowest[k + 1]), lowest[k + 2]);
        out[k] = static_cast<std::uint16_t>(most - 1) == least ? most : 0;
    }
}

}  // namespace

std::vector<std::uint16_t> grown_labels(const std::uint16_t* labels, std::ptrdiff_t rows, std::ptrdiff_t columns) {
    std::vector<std::uint16_t> grown(rows * columns), highest(columns + 2, 0), lowest(columns + 2, TOP);
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        const std::uint16_t* row = labels + r * columns;
        bounds_of_rows(r > 0 ? row - columns : row, row, r + 1 < rows ? row + columns : row, columns, highest.data() + 1,
                       lowest.data() + 1);
        only_labels(highest.data(), lowest.data(), columns, grown.data() + r * columns);
    }
    return grown;
}

}  // namespace tactile
