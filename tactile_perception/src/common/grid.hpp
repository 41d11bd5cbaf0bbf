// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Filters and connected components on images of taxels, row by row in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// A rectangle of rows and columns; the ends are excluded.
struct Box {
    std::ptrdiff_t top, left, bottom, right;
    std::ptrdiff_t rows() const { return bottom - top; }
    std::ptrdiff_t columns() const { return right - left; }
    Box grown(std::ptrdiff_t margin, std::ptrdiff_t image_rows, std::ptrdiff_t image_columns) const;
};

// The smallest box around what is not zero; empty without any.
Box box_around(const std::uint8_t* mask, std::ptrdiff_t rows, std::ptrdiff_t columns);

enum class Outside { replicated, zero };

// values (rows, columns), blurred in place by a Gaussian of standard deviation sigma, taxels, cut at four of them.
void blur(std::vector<float>& values, std::ptrdiff_t rows, std::ptrdiff_t columns, double sigma, Outside outside);

// values (rows, columns), each replaced in place by the largest within reach taxels along both axes.
void spread_largest(std::vector<float>& values, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t reach);

// Marks what is within reach taxels, along both axes, of what is not zero in mask (rows, columns).
std::vector<std::uint8_t> spread_mask(const std::uint8_t* mask, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t reach);

// One connected component.
struct Component {
    Box box;
    std::ptrdiff_t count;
};

// labels (rows, columns): 0 where mask is 0, else 1 + the number of the connected component, by edges, or by edges and corners.
std::vector<Component> components(const std::uint8_t* mask, std::ptrdiff_t rows, std::ptrdiff_t columns, bool by_corners,
                                  std::vector<std::int32_t>& labels);

}  // namespace tactile
