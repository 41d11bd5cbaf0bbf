// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// What one frame tells about all dots of a membrane, from the dots that it shows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// Dots seen in a frame: id (N), on the grid; unit rays (N, 3); ranges (N), m, and their standard deviations sigma (N), m, NaN where
// unknown.
struct SeenRanges {
    const std::int64_t* id;
    const double *rays, *ranges, *sigma;
    std::ptrdiff_t count;
};

// All dots of the grid. rays (K, 3): unit; measured (K), m, with weight (K), 1/m^2, 0 where unknown; displaced (K), m: what is measured
// less the range at rest, 0 where unknown; last (K), m: ranges in the last frame; seen (K).
struct WholeFrame {
    std::vector<double> rays, measured, weight, displaced, last;
    std::vector<bool> seen;
};

// origin (3), m: of the rays; rest and last_places (K, 3), m: at rest and in the last frame; scale: factor on what is measured less the
// range at rest. Unseen dots keep their direction of the last frame, plus the motion of their neighbours.
WholeFrame whole_frame(Grid grid, const double* origin, const double* rest, const double* last_places, const SeenRanges& seen,
                       double scale);

// How the forces along the surface lean on a common scale of the displacements. With the residual r (K, 3) of the forces along the surface
// over the pressure at free dots, each weighted by 1 / (1 + r^2 / (2 spread)^2)^2, and its derivative r' by the scale: curvature, the sum
// of r'^2, and gradient, that of r r'.
struct Leaning {
    double curvature, gradient;
};

// places (K, 3), m; pressure, Pa; rays (K, 3); touched (K): probability of a load; moved (K), m, and lifted, Pa: change of ranges and
// pressure if all displacements doubled; step: share of that in the finite difference; spread: of a free dot's residual; scale: as of
// whole_frame.
Leaning scale_leaning(const Membrane& membrane, const double* places, const double* rays, const double* touched, const double* moved,
                      double pressure, double lifted, double step, double spread, double scale);

}  // namespace tactile
