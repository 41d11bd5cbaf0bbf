// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The load of a contact: where it acts, how it is spread, without what traction causes; and where a contact slips.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "taxel/taxel_shear.hpp"

namespace tactile {

// Sum, mean row and column, of pressure (rows, columns) over the touched taxels (rows, columns) and those within around of them along both
// axes, and the number of these taxels; the means are NaN unless the sum is positive.
std::array<double, 4> load_of(const float* pressure, const std::uint8_t* touched, std::ptrdiff_t rows, std::ptrdiff_t columns,
                              std::ptrdiff_t around);

// Variance of the places of positive pressure (rows, columns) along a direction (column, row), over that of the touched taxels; NaN
// without load or width.
double spread_along(const float* pressure, const std::uint8_t* touched, std::ptrdiff_t rows, std::ptrdiff_t columns,
                    const std::array<double, 2>& direction);

// pressure (taxels,) without traction's part of it, traction (taxels,) over unit, which at most doubles or cancels a pressure.
std::vector<float> without_traction(const float* pressure, const float* traction, std::ptrdiff_t taxels, float unit);

// Touched taxels whose slips (2, rows, columns) m, one each frame, sum up to more than part of the object's motion there.
std::vector<std::uint8_t> lagging(const std::vector<const float*>& slips, const std::uint8_t* touched, std::ptrdiff_t rows,
                                  std::ptrdiff_t columns, double pitch, const Shift& motion, double part);

}  // namespace tactile
