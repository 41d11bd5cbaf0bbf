// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/all_within.hpp"

#include <cmath>
#include <cstdint>

#include "common/wide.hpp"

namespace tactile {

TACTILE_WIDE bool all_within(const double* values, std::ptrdiff_t count, double most) {
    std::int64_t within = 0;  // counted: a loop without branches
    for (std::ptrdiff_t k = 0; k < count; ++k) within += std::abs(values[k]) <= most;
    return within == count;
}

}  // namespace tactile
