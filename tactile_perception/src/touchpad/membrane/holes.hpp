// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Values of unseen dots on the printed grid.
#pragma once

#include <cstddef>

namespace tactile {

// values (rows * columns, count): where known is false, each is replaced by the mean of its up to eight neighbours, as a soap film spans a
// hole (Laplace's equation); unknown neighbours weigh half. All are 0 where nothing is known.
void fill_holes(double* values, const bool* known, std::ptrdiff_t rows, std::ptrdiff_t columns, std::ptrdiff_t count);

}  // namespace tactile
