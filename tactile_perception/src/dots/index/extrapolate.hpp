// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// Extends the row and column indices rc (count, 2) of members to more dots at places (count, 2), px, finite; dots inconsistent with their
// neighbours lose membership. pitch: px.
void extrapolate_indices(const double* places, std::ptrdiff_t count, double pitch, std::vector<std::int64_t>& rc,
                         std::vector<std::uint8_t>& member);

}  // namespace tactile
