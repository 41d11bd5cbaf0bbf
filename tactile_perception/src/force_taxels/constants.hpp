// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Constants of force taxels, each with its unit, origin (measured, physical, prior, limit, numeric) and meaning; SlipLimits of slip.hpp,
// which decide of slip, can be set from Python.
#pragma once

#include <cstddef>

namespace tactile::force_taxels {

struct ForceTaxelConstants {
    double min_friction = 0.05, max_friction = 3;  // 1, physical: coefficients of skins on objects; ice to clean rubber
    double min_probability = 1e-3;                 // 1, prior: of each mode, so that a change shows at once
    double max_evidence = 20;                      // nat, numeric: of a frame, against overflow
    double unknown_shear = 1e6;                    // noise variances, prior: of a shear that is not known yet
    double tiny = 1e-12;                           // 1, numeric: a probability or a force, N, against a division by zero
    double step_s = 0.01;                          // s, prior: of the changes that SlipLimits gives
    double logistic = 1.702;                       // 1, numeric: slope of a logistic function within 0.01 of the normal distribution
    double carried = 0.1;                          // 1, physical: part of a force that the elastomer carries to the next taxel
    double no_force = 1e-30;                       // N, numeric: against a division by zero
    double position_variance = 1.0 / 12;           // pitch^2, physical: of a position within a taxel; an even distribution
};
inline constexpr ForceTaxelConstants TAXEL;

}  // namespace tactile::force_taxels
