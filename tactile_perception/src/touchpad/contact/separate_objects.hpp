// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Dots of each separate object that touches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// Numbers of dots.
using Dots = std::vector<std::ptrdiff_t>;

// Dots of each separate object, the largest first: touched dots (K) with up to one free dot between them belong together.
std::vector<Dots> separate_objects(Grid grid, const std::vector<std::uint8_t>& touched);

}  // namespace tactile
