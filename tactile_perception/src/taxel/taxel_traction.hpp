// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/grid.hpp"
#include "taxel/taxel_shear.hpp"

namespace tactile {

// Least squares of a picture by one before a motion: its slopes, the pressure of an even traction, turn, growth and load.
struct TractionFit {
    Box box{0, 0, 0, 0};
    std::vector<float> share;  // (rows of the box, columns, 4): of a taxel's change in the shift along columns and rows, taxels, and in the
                               // traction along both, over pressure
    double square = 0;         // of a traction's standard deviation, for noise of 1 in each taxel
};

// reach: taxels around the touched ones, (rows, columns), that are fitted; thickness: taxels, of the pad; spreads: of the pressure that
// traction causes, taxels.
TractionFit traction_fit(const float* before, const std::uint8_t* touched, std::ptrdiff_t rows, std::ptrdiff_t columns,
                         std::ptrdiff_t reach, double thickness, const Spread (&spreads)[2]);

// Shift and traction of pressure (rows, columns of the array) since the picture before; share: of the fit, in its box.
std::array<double, 4> traction_seen(const float* share, const Box& box, const float* pressure, const float* before, std::ptrdiff_t columns);

}  // namespace tactile
