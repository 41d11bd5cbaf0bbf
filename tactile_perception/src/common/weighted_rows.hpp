// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Weighted sums of the rows of a table, for a few weights a row: a product of Eigen would copy the table first, which takes longer.
#pragma once

#include <cstddef>
#include <cstring>

#include "common/wide.hpp"

namespace tactile {

constexpr std::ptrdiff_t LANES = 8;  // weights of a row, and sums of a column, that one instruction handles

template <int COLUMNS>
TACTILE_INLINE void add_up_rows(const float* table, std::ptrdiff_t rows, std::ptrdiff_t stride, const float* weights, float* sums) {
    typedef float Values __attribute__((vector_size(LANES * sizeof(float))));
    Values sum[COLUMNS] = {};
    for (std::ptrdiff_t row = 0; row < rows; ++row, table += stride, weights += LANES) {
        Values weight;
        std::memcpy(&weight, weights, sizeof weight);
        for (int k = 0; k < COLUMNS; ++k) sum[k] += weight * table[k];
    }
    std::memcpy(sums, sum, sizeof sum);
}

// Sums (columns, LANES) over the rows of a table (rows, columns), times weights (rows, LANES).
TACTILE_INLINE void weigh_rows(const float* table, std::ptrdiff_t rows, std::ptrdiff_t columns, const float* weights, float* sums) {
    constexpr int AT_ONCE = 6;  // as many sums as both kinds of processors have registers for
    std::ptrdiff_t column = 0;
    for (; column + AT_ONCE <= columns; column += AT_ONCE)
        add_up_rows<AT_ONCE>(table + column, rows, columns, weights, sums + column * LANES);
    for (; column < columns; ++column) add_up_rows<1>(table + column, rows, columns, weights, sums + column * LANES);
}

}  // namespace tactile
