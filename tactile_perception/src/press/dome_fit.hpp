// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The presses of a dome that explain a frame: least squares by the method of Levenberg and Marquardt, with the damping of Nielsen (1999,
// Damping parameter in Marquardt's method, IMM-REP-1999-05). Lengths in m.
#pragma once

#include "press/dome.hpp"

namespace tactile {

// The markers of a frame: places on the untouched dome (K, 3), NaN unknown, and their camera_centres (K, 3); height of the viewing plane; apparent
// displacements there (K, 2) and their weights (K), 0 where not seen; and, of an error that markers share, rows (shared, K) whose products
// are taken off the weight matrix of each axis.
struct DomeFrame {
    Points points, camera_centres;
    double plane_z;
    Eigen::MatrixXd shift, shared;
    Eigen::VectorXd weight;
};

// Rows of what is known of each number of a press: mean, weight (one over variance), least and largest value, longest step.
using DomePrior = Eigen::Matrix<double, 5, PRESS>;

struct DomeFit {
    Eigen::VectorXd presses;     // (n PRESS)
    Eigen::MatrixXd covariance;  // (n PRESS, n PRESS); NaN where the markers do not determine them
    Eigen::MatrixXd left;        // (K, 2), residuals; 0 where not seen
    double squares;              // of the weighted residuals, without the prior's
};

// The presses, from starts (n PRESS), that explain a frame.
DomeFit fit_dome(const DomeLibrary& library, const DomeFrame& frame, const Eigen::VectorXd& starts, const DomePrior& prior);

}  // namespace tactile
