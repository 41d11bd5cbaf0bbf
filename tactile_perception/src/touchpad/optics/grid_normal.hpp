// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>

#include "touchpad/optics/light_path.hpp"

namespace tactile {

// Unit normal, z up, at an inner place of a grid of places (x, y, z each) with that many columns: cross product of central differences;
// otherwise where a neighbour is missing.
inline Vec3 grid_normal(const double* here, std::ptrdiff_t columns, Vec3 otherwise) {
    const Vec3 right = vec3_at(here, 1) - vec3_at(here, -1), down = vec3_at(here, columns) - vec3_at(here, -columns);
    const Vec3 out = cross(right, down), unit = std::copysign(1 / length(out), out.z) * out;
    return std::isfinite(unit.x) && std::isfinite(unit.y) && std::isfinite(unit.z) ? unit : otherwise;
}

}  // namespace tactile
