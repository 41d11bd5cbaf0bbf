// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Loads on the dots of a membrane, over the fluid's pressure, and the probability that a dot carries one: a mixture of free dots (load
// about 0) and touched ones (about the fluid's pressure or more), with coupled neighbours.
#pragma once

#include <cstddef>
#include <vector>

#include "touchpad/membrane/membrane_forces.hpp"

namespace tactile {

// What an object does to the dots: normals (K, 3) of the membrane, force (K, 3), N, on each dot, and load (K), its normal pressure. Both
// are 0 on the outermost dots, which have no balance.
struct Loads {
    std::vector<double> normal, force, load;
};

// Loads at places (K, 3), m. The fluid's pressure is that at which most inner dots are free, at least a tenth of rest_pressure, Pa.
Loads find_loads(const Membrane& membrane, const double* places, double rest_pressure);

// Log likelihood ratio, touched over free, of a load. misfit: standard deviation of a free dot's load; variance: from measurement errors.
double log_likelihood_ratio(double load, double misfit, double variance);

// Weight of a load that is touched with some probability, and the weight times the load's residual from its expected value.
struct Expectation {
    double weight, pull;
};
Expectation expectation(double load, double touched, double misfit);

// Replaces the probabilities touched (K) by those that the log likelihood ratios gain (K) and the neighbours' last ones say.
void update_probabilities(Grid grid, const double* gain, double* touched);

// Sets touched (K) to 0 in connected patches whose summed log likelihood ratios gain (K) are not significant.
void drop_weak_patches(Grid grid, const double* gain, double* touched);

}  // namespace tactile
