// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Displacement of the markers of an inflated dome that a round tip presses, from a library of simulated presses, made by
// tactile_perception/press/dome/library.py; and the presses that explain a frame. Lengths in m.
#pragma once

#include <Eigen/Core>

#include "common/rows.hpp"

namespace tactile {

// Numbers of a press: x, y of the tip before a drag; log depth; log of the radius over the library's middle one, over its spread; number of
// friction, see FRICTIONS in library.py; way of the drag, with the skin, over the depth along x and y.
constexpr int PRESS = 7;
enum PressNumber { X, Y, DEPTH, RADIUS, FRICTION, DRAG_X, DRAG_Y };
constexpr int DRAGS = 2;  // of a tip that sticks, and what one that rubs shows more

using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Points = Rows3;

// Of the dome: radius and height of the centre, m, and mechanics.py:disc_scale; largest shift of the mesh; deepest press, m; grading of
// depths; radius of the middle tip, m, and spread of its log.
struct DomePlan {
    double curvature = 0, centre_z = 0, disc_scale = 0, reach = 0, depth = 0, power = 0, radius = 0, radius_spread = 0;
};

// Coefficients of presses over modes, and the modes: even (mirror symmetric to the meridian plane) and odd.
struct DomeLibrary : DomePlan {
    int levels = 0, order = 0, radii = 0, rings = 0, harmonics = 0;
    int straight = 0;       // powers of the number of friction of a straight press
    Eigen::VectorXd edges;  // (rings + 1), radii of the rings in the unit disc
    FloatRows even_table;   // ((levels + 3) (straight + DRAGS) order radii, even): straight presses, and drags along the meridian
    FloatRows odd_table;    // ((levels + 3) DRAGS order radii, odd): drags across the meridian
    FloatRows even_modes;   // (even, (rings + 1) 3 (harmonics + 1))
    FloatRows odd_modes;    // (odd, (rings + 1) 3 (harmonics + 1))
};

// Adds the displacement (K, 3) of points (K, 3) on the untouched dome under a press, and returns its slopes (K, PRESS 3) by the numbers of
// the press; on the axis the direction of the meridian has none. A point that is NaN does not move.
Eigen::MatrixXd press_dome(const DomeLibrary& library, const Points& points, const Eigen::Matrix<double, PRESS, 1>& press, Points& moved);

constexpr int MAX_DOME_PRESSES = 2;  // of one fit

// The untouched markers: places on the dome (K, 3), NaN unknown, and their cameras' centres (K, 3); height of the viewing plane.
struct DomeMarkers {
    Points points, camera_centres;
    double plane_z = 0;
};

// What a frame shows: apparent displacements in the viewing plane (K, 2) and their weights (K), 0 where not seen; and, of an error that
// markers share, columns (K, shared) whose products are taken off the weight matrix of each axis.
struct DomeFrame {
    Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> shift;
    Eigen::VectorXd weight;
    Eigen::MatrixXd shared;
};

// What is known of each number of a press: mean, weight (one over variance), range, and longest step.
struct PressPrior {
    using Numbers = Eigen::Matrix<double, PRESS, 1>;
    Numbers mean = Numbers::Zero(), weight = mean, lowest = mean, highest = mean, longest = mean;
};

struct DomeFit {
    Eigen::VectorXd presses;     // (n PRESS)
    Eigen::MatrixXd covariance;  // (n PRESS, n PRESS); NaN where the markers do not determine them
    Eigen::MatrixXd residual;    // (K, 2); 0 where not seen
};

// The presses, from starts (n PRESS), that explain a frame.
DomeFit fit_dome(const DomeLibrary& library, const DomeMarkers& markers, const DomeFrame& frame, const Eigen::VectorXd& starts,
                 const PressPrior& prior);

}  // namespace tactile
