// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/hysteresis.hpp"

#include "common/wide.hpp"

namespace tactile::taxel {

TACTILE_WIDE void hide(const float* shown, std::ptrdiff_t taxels, const Play& play, float* held, float* hidden) {
    const float share = play.share, reach = play.reach, relative = play.relative;
    const float rest = 1 / (1 - share), rising = 1 / (1 - share * relative), falling = 1 / (1 + share * relative), lag = share * reach;
#pragma GCC ivdep
    for (std::ptrdiff_t k = 0; k < taxels; ++k) {
        const float stays = held[k], between = (shown[k] - share * stays) * rest;
        const float up = shown[k] + lag, down = shown[k] - lag;
        const float free = reach + relative * (between > 0 ? between : 0.0f), off = between - stays;
        const float load = off > free ? up * (up > 0 ? rising : 1.0f) : off < -free ? down * (down > 0 ? falling : 1.0f) : between;
        const float most = reach + relative * (load > 0 ? load : 0.0f), lowest = load - most, highest = load + most;
        held[k] = stays < lowest ? lowest : stays > highest ? highest : stays;
        hidden[k] = load - shown[k];
    }
}

}  // namespace tactile::taxel
