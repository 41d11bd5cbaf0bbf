// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// An object's rigid motion between two frames from the motions of the dots that it touches.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/vectors.hpp"

namespace tactile {

// Translation of the centre, m a frame, and w = 2 tan(angle / 2) times the axis. Cayley's form is exact and linear:
// after - before = v + w x ((before + after) / 2 - centre).
using Twist = std::array<double, 6>;

// Motions of dots from before to after (count, 3), m, on a surface with unit normals (count, 3), seen from origin. across, along: standard
// deviations of a motion across the ray and along the normal, m. The twist's centre is the mean of after.
class DotMotions {
 public:
    DotMotions(const double* before, const double* after, const double* normals, std::ptrdiff_t count, const double* origin, double across,
               double along);

    // Twist by iteratively reweighted least squares, the scale of the residuals reduced from coarse to fine, m. start: twist to begin with
    // and prior that weighs hold dots, null: a fit to all dots. drag (count, 3): tangential load on each dot; one that lags in its
    // direction may slip and loses its weight, one that leads cannot slip and keeps it. weights (count): probability of sticking.
    Twist fit_robust(const Twist* start, const double* drag, const double* weights, double coarse, double fine, double hold) const;

    // What a dot's motion is beyond the twist's: across its ray, and along its normal.
    Vec3 residual(std::ptrdiff_t dot, const Twist& twist) const;
    double normal_residual(std::ptrdiff_t dot, const Twist& twist) const;
    Vec3 centre() const { return centre_; }

 private:
    Twist fit(const std::vector<double>& carried, const std::vector<double>& touching, const Twist& expected, double hold,
              double turn) const;

    std::ptrdiff_t count_;
    double share_, along_;
    Vec3 centre_{0, 0, 0};
    std::vector<Vec3> ray_, moved_, offset_, normal_;
};

}  // namespace tactile
