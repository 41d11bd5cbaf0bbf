// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/taxel_traction.hpp"

#include <algorithm>
#include <cmath>

#include "common/jacobi.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr double SMOOTH = 0.5;      // taxels, of the Gaussian against noise before slopes are taken. Chosen
constexpr double LEAST = 1e-9;      // of the largest eigenvalue, from which a combination of the terms is told
constexpr int TERMS = 7, WIDE = 8;  // of a taxel; and the place of one more, so that they fill registers
constexpr int TOLD = 4;

using Values = std::vector<float>;

// Differences along columns, or rows, of values (rows, columns): one-sided at the border.
Values slopes(const Values& values, std::ptrdiff_t rows, std::ptrdiff_t columns, bool down) {
    Values found(values.size());
    const std::ptrdiff_t length = down ? rows : columns, step = down ? columns : 1;
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        for (std::ptrdiff_t c = 0; c < columns; ++c) {
            const std::ptrdiff_t at = down ? r : c, k = r * columns + c, before = at > 0 ? step : 0, after = at + 1 < length ? step : 0;
            const float difference = values[k + after] - values[k - before];
            found[k] = before && after ? 0.5f * difference : difference;
        }
    }
    return found;
}

// Pressure by the convergence of a traction that falls by slope per taxel.
Values caused(const Values& slope, std::ptrdiff_t rows, std::ptrdiff_t columns, double thickness, const Spread (&spreads)[2]) {
    Values found(slope.size());
    for (const Spread& spread : spreads) {
        Values wide = slope;
        blur(wide, rows, columns, spread.width, Outside::zero);
        const auto share = static_cast<float>(-spread.share * thickness);
        for (std::size_t k = 0; k < found.size(); ++k) found[k] += share * wide[k];
    }
    return found;
}

// Sums of the products of the terms (count, WIDE).
TACTILE_WIDE void add_products(const float* terms, std::ptrdiff_t count, double (&sums)[TERMS][WIDE]) {
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        double here[WIDE];
        for (int j = 0; j < WIDE; ++j) here[j] = terms[WIDE * k + j];
        for (int i = 0; i < TERMS; ++i) {
            for (int j = 0; j < WIDE; ++j) sums[i][j] += here[i] * here[j];
        }
    }
}

// The first rows of the pseudoinverse of the symmetric matrix.
void invert(double (&matrix)[TERMS][TERMS], double (&inverse)[TOLD][TERMS]) {
    double axes[TERMS][TERMS], largest = 0;
    diagonalise(matrix, axes);
    for (int k = 0; k < TERMS; ++k) largest = std::max(largest, std::abs(matrix[k][k]));
    for (int i = 0; i < TOLD; ++i) {
        for (int j = 0; j < TERMS; ++j) {
            inverse[i][j] = 0;
            for (int k = 0; k < TERMS; ++k) {
                if (std::abs(matrix[k][k]) > LEAST * largest) inverse[i][j] += axes[i][k] * axes[j][k] / matrix[k][k];
            }
        }
    }
}

// terms (rows, columns, WIDE) of a picture before a motion in its box.
Values terms_of(const Values& before, const std::vector<std::uint8_t>& touched, const Box& box, double thickness,
                const Spread (&spreads)[2]) {
    const std::ptrdiff_t rows = box.rows(), columns = box.columns();
    double level = 0, row = 0, column = 0, count = 0;
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        for (std::ptrdiff_t c = 0; c < columns; ++c) {
            if (!touched[r * columns + c]) continue;
            level += before[r * columns + c];
            row += static_cast<double>(r);
            column += static_cast<double>(c);
            ++count;
        }
    }
    Values smooth = before, even(before.size());
    for (std::size_t k = 0; k < even.size(); ++k) even[k] = touched[k] ? static_cast<float>(level / count) : 0;
    blur(smooth, rows, columns, SMOOTH, Outside::replicated);
    blur(even, rows, columns, SMOOTH, Outside::replicated);
    const Values across = slopes(smooth, rows, columns, false), down = slopes(smooth, rows, columns, true);
    const Values along_x = caused(slopes(even, rows, columns, false), rows, columns, thickness, spreads);
    const Values along_y = caused(slopes(even, rows, columns, true), rows, columns, thickness, spreads);
    Values terms(WIDE * before.size());
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
        const auto y = static_cast<float>(static_cast<double>(r) - row / count);
        for (std::ptrdiff_t c = 0; c < columns; ++c) {
            const auto x = static_cast<float>(static_cast<double>(c) - column / count);
            const std::ptrdiff_t k = r * columns + c;
            const float here[WIDE] = {-across[k],
                                      -down[k],
                                      along_x[k],
                                      along_y[k],
                                      y * across[k] - x * down[k],
                                      std::sqrt(across[k] * across[k] + down[k] * down[k]),
                                      before[k],
                                      0};
            std::copy(here, here + WIDE, terms.data() + WIDE * k);
        }
    }
    return terms;
}

}  // namespace

TractionFit traction_fit(const float* before, const std::uint8_t* touched, std::ptrdiff_t rows, std::ptrdiff_t columns,
                         std::ptrdiff_t reach, double thickness, const Spread (&spreads)[2]) {
    TractionFit found;
    const Box inside = box_around(touched, rows, columns);
    if (inside.rows() == 0) return found;
    const Box box = found.box = inside.grown(reach, rows, columns);
    Values near;
    std::vector<std::uint8_t> contact;
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        near.insert(near.end(), before + r * columns + box.left, before + r * columns + box.right);
        contact.insert(contact.end(), touched + r * columns + box.left, touched + r * columns + box.right);
    }
    const Values terms = terms_of(near, contact, box, thickness, spreads);
    double sums[TERMS][WIDE] = {}, normal[TERMS][TERMS], inverse[TOLD][TERMS];
    add_products(terms.data(), box.rows() * box.columns(), sums);
    for (int i = 0; i < TERMS; ++i) std::copy(sums[i], sums[i] + TERMS, normal[i]);
    invert(normal, inverse);
    found.share.resize(TOLD * near.size());
    double squares[TOLD] = {};
    for (std::size_t k = 0; k < near.size(); ++k) {
        for (int i = 0; i < TOLD; ++i) {
            double share = 0;
            for (int j = 0; j < TERMS; ++j) share += inverse[i][j] * terms[WIDE * k + j];
            found.share[TOLD * k + i] = static_cast<float>(share);
            squares[i] += share * share;
        }
    }
    found.square = std::max(squares[2], squares[3]);
    return found;
}

TACTILE_WIDE std::array<double, 4> traction_seen(const float* share, const Box& box, const float* pressure, const float* before,
                                                 std::ptrdiff_t columns) {
    double sums[TOLD] = {};
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        for (std::ptrdiff_t c = box.left; c < box.right; ++c, share += TOLD) {
            const float change = pressure[r * columns + c] - before[r * columns + c];
            for (int i = 0; i < TOLD; ++i) sums[i] += share[i] * change;
        }
    }
    return {sums[0], sums[1], sums[2], sums[3]};
}

}  // namespace tactile
