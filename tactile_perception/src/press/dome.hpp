// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Displacement of the markers of an inflated dome that a round tip presses, from a library of simulated presses, made by
// tactile_perception/press/dome/library.py; and the presses that explain a frame. Lengths in m.
#pragma once

#include <Eigen/Core>

#include "common/fields.hpp"
#include "common/rows.hpp"

namespace tactile {

/// Parameters of a press: x, y of the tip before a drag; log depth; log of the radius over the library's middle one, over its spread;
/// friction, as the number of FRICTIONS in library.py; displacement of the drag, with the skin, over the depth along x and y.
constexpr int PRESS = 7;
enum PressNumber { X, Y, DEPTH, RADIUS, FRICTION, DRAG_X, DRAG_Y };
constexpr int DRAGS = 2;  // of a tip that sticks, and the correction for one that slips

using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Points = Rows3;

/// Range of a library: radius and height of the centre of the dome, m, and mechanics.py:disc_scale; maximum shift of the mesh; maximum
/// depth, m; grading of depths; radius of the middle tip, m, and spread of its log.
struct DomePlan {
    double curvature = 0, centre_z = 0, disc_scale = 0, reach = 0, depth = 0, power = 0, radius = 0, radius_spread = 0;
    TACTILE_FIELDS(curvature, centre_z, disc_scale, reach, depth, power, radius, radius_spread)
};

/// Coefficients of presses over modes, and the modes: even (mirror symmetric to the meridian plane) and odd.
struct DomeLibrary : DomePlan {
    int levels = 0, order = 0, radii = 0, rings = 0, harmonics = 0;
    int straight = 0;       // powers of the friction of a straight press
    Eigen::VectorXd edges;  // (rings + 1), radii of the rings in the unit disc
    FloatRows even_table;   // ((levels + 3) (straight + DRAGS) order radii, even): straight presses, and drags along the meridian
    FloatRows odd_table;    // ((levels + 3) DRAGS order radii, odd): drags across the meridian
    FloatRows even_modes;   // (even, (rings + 1) 3 (harmonics + 1))
    FloatRows odd_modes;    // (odd, (rings + 1) 3 (harmonics + 1))
};

/// Adds the displacement (K, 3) of points (K, 3) on the undeformed dome under a press, and returns its derivatives (K, PRESS 3) by the
/// parameters of the press; on the axis the direction of the meridian has none. A point that is NaN does not move.
Eigen::MatrixXd press_dome(const DomeLibrary& library, const Points& points, const Eigen::Matrix<double, PRESS, 1>& press, Points& moved);

using DomePresses = Rows<PRESS>;
constexpr int MAX_DOME_PRESSES = 2;  // of one fit

/// The undeformed markers: positions on the dome (K, 3), NaN where unknown, and their cameras' centres (K, 3); height of the viewing plane.
struct DomeMarkers {
    Points points, camera_centres;
    double plane_z = 0;
    TACTILE_FIELDS(points, camera_centres, plane_z)
};

/// The measurements of a frame: apparent displacements in the viewing plane (K, 2) and their weights (K), 0 for hidden markers. The outer
/// products of the columns shared (K, shared), of errors common to the markers, are subtracted from the weight matrix of each axis.
struct DomeFrame {
    Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> shift;
    Eigen::VectorXd weight;
    Eigen::MatrixXd shared;
    TACTILE_FIELDS(shift, weight, shared)
};

/// Prior of each parameter of a press: mean, weight (one over variance), range, and maximum step.
struct PressPrior {
    using Numbers = Eigen::Matrix<double, PRESS, 1>;
    Numbers mean = Numbers::Zero(), weight = mean, lowest = mean, highest = mean, longest = mean;
    TACTILE_FIELDS(mean, weight, lowest, highest, longest)
};

/// Presses that explain a frame.
struct DomeFit {
    DomePresses presses;
    Eigen::MatrixXd covariance;  // (n PRESS, n PRESS); NaN where the markers do not determine it
    Eigen::MatrixXd residual;    // (K, 2); 0 for hidden markers
    TACTILE_FIELDS(presses, covariance, residual)
};

/// Fits presses to a frame, from starts.
DomeFit fit_dome(const DomeLibrary& library, const DomeMarkers& markers, const DomeFrame& frame, const PressPrior& prior,
                 const DomePresses& starts);

}  // namespace tactile
