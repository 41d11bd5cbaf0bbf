// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Displacement of the markers of an inflated dome that a round tip presses, from a library of simulated presses, made by
// tactile_perception/press/dome/library.py. Lengths in m.
#pragma once

#include <cstdint>

namespace tactile {

// Numbers of a press: x, y of the tip before a drag; log depth; log of the radius over the library's middle one, over its spread; number of
// friction, see friction_of in library.py; way of the drag, with the skin, over the depth along x and y.
constexpr int PRESS = 7;
enum PressNumber { X, Y, DEPTH, RADIUS, FRICTION, DRAG_X, DRAG_Y };
constexpr int DRAGS = 2;     // of a tip that sticks, and what one that rubs shows more
constexpr int STRAIGHT = 4;  // powers of the number of friction of a straight press

// Coefficients of presses over modes, and the modes: even (mirror symmetric to the meridian plane) and odd.
struct DomeLibrary {
    int levels, order, radii, rings, harmonics, even, odd;
    double curvature, centre_z, disc_scale;             // of the dome: radius and height of the centre, m; see disc_scale in mesh.py
    double reach, depth, power, radius, radius_spread;  // largest shift of the mesh; deepest press; grading of depths; middle tip
    const double* edges;                                // (rings + 1), radii of the rings in the unit disc
    const float* even_table;  // (levels + 3, STRAIGHT + DRAGS, order, radii, even): straight presses, and drags along the meridian
    const float* odd_table;   // (levels + 3, DRAGS, order, radii, odd): drags across the meridian
    const float* even_modes;  // (even, rings + 1, 3, harmonics + 1)
    const float* odd_modes;   // (odd, rings + 1, 3, harmonics + 1)
};

// Markers of the dome: K places on the untouched dome (K, 3), NaN unknown, and their eyes (K, 3); height of the viewing plane.
struct DomeMarkers {
    std::int64_t count;
    const double* points;
    const double* eyes;
    double plane_z;
};

// Displacements (K, 3) of the markers under n presses (n, PRESS); those of several presses add up.
void press_dome(const DomeLibrary& library, const DomeMarkers& markers, const double* presses, int n, double* moved);

// Adds the displacement (K, 3) under a press, and writes its slopes (K, PRESS, 3) by the numbers of the press, whose place must not be on
// the axis: there the direction of the meridian has no slope.
void press_dome_with_slopes(const DomeLibrary& library, const DomeMarkers& markers, const double* press, double* moved, double* slopes);

}  // namespace tactile
