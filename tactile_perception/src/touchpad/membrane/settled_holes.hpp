// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// places (K, 3) with unseen dots moved along their rays from origin by one Gauss-Newton step towards the balance around them; load (K): of
// the dots over the fluid's pressure, Pa.
std::vector<double> settle_holes(const Membrane& membrane, const double* places, const double* load, const bool* seen, const double* origin,
                                 double pressure);

}  // namespace tactile
