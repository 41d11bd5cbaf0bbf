// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace tactile {

// Sets the ids (count), row * columns + column or -1, of dots at places (count, 2), px, to -1 where a step to a neighbour on the grid is
// unlike those around it, at both ends of such a step and next to them, and where all steps of a dot deviate.
void reject_outliers(std::int64_t* id, const double* places, std::ptrdiff_t count, std::ptrdiff_t rows, std::ptrdiff_t columns);

}  // namespace tactile
