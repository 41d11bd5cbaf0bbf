// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// How markers of a deformed sheet appear to a camera, in the plane of the untouched sheet.
#pragma once

namespace tactile {

constexpr int DISC_POINTS = 4;  // of a marker's quadrature

// Shift x and y, m, and growth (log of the ratio of areas) of a point at rest, m, seen from camera_centre (3,), m, as deformed (3, 3) says;
// and their derivatives by deformed (3, 3, 3), unless slopes is null.
void appear(const double deformed[3][3], const double* rest, const double* camera_centre, double* seen, double (*slopes)[3][3]);

// The points of a disc of radius, m, at rest, m: exact to cubic terms.
void disc_points(const double* rest, double radius, double points[DISC_POINTS][2]);

// As appear, of such a disc: the centroid and the area as imaged; deformed (DISC_POINTS, 3, 3) at its points.
void disc_appear(const double (*deformed)[3][3], const double* rest, const double* camera_centre, double radius, double* seen);

}  // namespace tactile
