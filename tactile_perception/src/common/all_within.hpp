// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace tactile {

// Whether none of the values (count) is NaN or beyond most.
bool all_within(const double* values, std::ptrdiff_t count, double most);

}  // namespace tactile
