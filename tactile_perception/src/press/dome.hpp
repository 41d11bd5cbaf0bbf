// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Displacement of the markers of an inflated dome that a round tip presses, from a library of simulated presses, made by
// tactile_perception/press/dome/library.py; and the presses that explain a frame. Lengths in m.
#pragma once

#include <Eigen/Core>

#include "common/fields.hpp"
#include "common/rows.hpp"
#include "press/choice.hpp"

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

/// The undeformed markers: positions on the dome (K, 3), NaN where unknown, and their cameras' centres (K, 3); height of the viewing plane;
/// smooth functions of their positions (K, M), orthogonal and of unit RMS, which the error of a sum of two fields is made of.
struct DomeMarkers {
    Points points, camera_centres;
    double plane_z = 0;
    Eigen::MatrixXd smooth;
    TACTILE_FIELDS(points, camera_centres, plane_z, smooth)
};

/// Standard deviations of displacements per axis: still, m, of an untouched marker; share: model error over a marker's displacement; top:
/// over the largest displacement. alike: factor on the model error, because errors of neighbouring markers are similar. not_linear: error
/// of a marker's displacement over that by a drag, which is linearised. longest: step of each parameter of a press.
struct DomeErrors {
    double still = 0, share = 0, top = 0, alike = 1, not_linear = 0;
    Eigen::Matrix<double, PRESS, 1> longest = Eigen::Matrix<double, PRESS, 1>::Zero();
    TACTILE_FIELDS(still, share, top, alike, not_linear, longest)
};

/// Prior of a press. drag: standard deviation of the displacement of the drag over the depth; friction: of the friction number; tip,
/// tip_sigma: mean and standard deviation of the log radius over the library's spread; together: RMS error of the sum of the presses'
/// fields over the largest displacement, 0 for one; rougher, wider: true standard deviations of friction number and log radius, which
/// covariances include if they are larger than those of the fit.
struct DomePrior {
    double drag = 0, friction = 0, tip = 0, tip_sigma = 0, together = 0, rougher = 0, wider = 0;
    TACTILE_FIELDS(drag, friction, tip, tip_sigma, together, rougher, wider)
};

/// Presses that explain a frame.
struct DomeFit {
    DomePresses presses;
    Eigen::MatrixXd covariance;  // (n PRESS, n PRESS), of one press in proportion to the misfit; NaN where the markers do not determine it
    double misfit = 0;           // mean squared residual over its variance
    double expected = 1;         // that with the error of linearised drags, over 1
    double radius_sigma = 0;     // of the first press, if friction and tip are as the fit assumes
    Rows2 shown;                 // (K, 2), m, fitted apparent displacements; NaN if not visible
    TipRadius radius() const { return {presses(0, RADIUS), radius_sigma}; }
    TACTILE_FIELDS(presses, covariance, misfit, expected, radius_sigma, shown)
};

/// Fits presses, from starts, to the apparent displacements (K, 2), m, of the markers, NaN where not visible.
DomeFit fit_dome(const DomeLibrary& library, const DomeMarkers& markers, const DomeErrors& errors, const DomePrior& prior,
                 const Rows2& shift, const DomePresses& starts);

}  // namespace tactile
