// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The presses of a dome that explain a frame: least squares by the method of Levenberg and Marquardt, with the damping of Nielsen (1999,
// Damping parameter in Marquardt's method, IMM-REP-1999-05). Lengths in m.
#pragma once

#include <vector>

#include "press/dome.hpp"

namespace tactile {

// Prior knowledge: mean and weight (one over variance) of each number of a press; least and largest value; longest step. (PRESS) each.
struct DomePrior {
    const double *mean, *weight, *least, *most, *limit;
};

// How far markers' apparent displacements are trusted: weights (K), 0 where not seen; and, of an error that markers share, rows (shared, K)
// whose products are taken off the weight matrix of each axis.
struct DomeWeights {
    const double* weight;
    const double* rows;
    int shared;
};

struct DomeFit {
    std::vector<double> presses;     // (n, PRESS)
    std::vector<double> covariance;  // (n PRESS, n PRESS); NaN where the markers do not determine them
    std::vector<double> left;        // (K, 2), residuals; 0 where not seen
    double squares = 0;              // of the weighted residuals, without the prior's
};

// The n presses, from starts (n, PRESS), that explain apparent displacements shift (K, 2), m.
DomeFit fit_dome(const DomeLibrary& library, const DomeMarkers& markers, const double* shift, const DomeWeights& weights,
                 const double* starts, int n, const DomePrior& prior);

}  // namespace tactile
