// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/mechanics.hpp"

#include <algorithm>
#include <utility>

#include "taxel/constants.hpp"

namespace tactile::taxel {

Observation Mechanics::process(const float* pressure, double sigma, const std::uint8_t* full, double stamp, bool can_roll) {
    const ShearPad& pad = tracker.shear.pad();
    const std::ptrdiff_t size = pad.rows * pad.columns, side = std::max(pad.rows, pad.columns);
    Observation found;
    found.surface.resize(size);
    for (std::ptrdiff_t k = 0; k < size; ++k) {  // traction at most doubles or cancels the pressure
        const float bound = std::max(pressure[k], 0.0f);
        found.surface[k] = pressure[k] - std::min(std::max(tracker.traction_pressure[k] / unit_, -bound), bound);
    }
    const std::vector<float> score =
        contact_score(found.surface.data(), full, pad.rows, pad.columns, ScoreRule::of(pad.thickness, side, sigma));
    found.regions = find_regions(score.data(), found.surface.data(), full, pad.rows, pad.columns,
                                 RegionRule::of(pad.thickness, side, pad.pitch));
    if (found.regions.all.empty()) {
        reset();
        return found;
    }
    const std::vector<std::uint8_t>& touched = found.regions.touched;
    if (!known_) {
        double load = 0, count = 0;
        for (std::ptrdiff_t k = 0; k < size; ++k)
            if (touched[k]) load += found.surface[k], ++count;
        const double shear_modulus = pad.stiffness * pad.thickness * pad.pitch;
        unit_ = static_cast<float>(TAXEL.assumed_slide * shear_modulus / (pad.friction * std::max(load / count, 1e-6)));
    }
    std::vector<float> in_pascal = found.surface;
    for (float& value : in_pascal) value *= unit_;
    found.motion = tracker.process({in_pascal.data(), touched.data(), pressure, sigma}, stamp, can_roll);
    return found;
}

}  // namespace tactile::taxel
