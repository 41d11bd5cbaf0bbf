// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Bounds of the arguments of the taxel array's kernels.
#pragma once

namespace tactile::border {

constexpr double MOST_TAXELS = 1e4, LONGEST = 1e6;  // of a side; taxels, of a width. Chosen: far beyond any array

}  // namespace tactile::border
