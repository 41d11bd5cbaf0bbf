// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace tactile::taxel {

// How a sensing layer lags behind a load (Visintin 1994): it shows 1 - share of it, and share of a held load that stays until the load is
// farther from it than reach, and relative of the load, and then follows at that distance.
struct Play {
    float share, reach, relative;
};

// The hidden part of the load behind what is shown, and the held load, in place, (taxels,) each. Solves the law for the load where the held
// load stays, and where it follows from below or above.
void hide(const float* shown, std::ptrdiff_t taxels, const Play& play, float* held, float* hidden);

}  // namespace tactile::taxel
