// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Constants of what rooms share, each with its unit, origin (measured, physical, prior, limit, numeric) and meaning.
#pragma once

namespace tactile {

struct CommonConstants {
    double outline_sigma = 0.3;     // pitch, measured: standard deviation of an outline
    double outline_length = 1;      // pitch, measured: correlation length of the errors of an outline
    double direction_sigmas = 3;    // 1, limit: difference of the variances of a region with a direction (about 10 degrees uncertainty)
    double min_persistent_s = 0.02;  // s, limit: a contact that starts or ends may show as several regions for a shorter time
    double max_gap_s = 0.1;          // s, limit: that a contact keeps its id without being seen: one or two frames may miss it
    int min_split = 4;               // 1, limit: dots or taxels of a region that splits off; noise at a border makes smaller ones
    double slope_step = 0.01;       // node, numeric: of finite differences on a surface
    int max_steps = 20;             // 1, numeric: of Newton's method for a pixel; lenses take 3 to 5
    double converged = 1e-12;       // 1, numeric: last step, normalised; far below a thousandth of a pixel
    double max_coordinate_m = 10;   // m, limit: a point farther out is far outside any sensor
};
inline constexpr CommonConstants COMMON;

}  // namespace tactile
