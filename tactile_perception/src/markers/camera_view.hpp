// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Where the pixels of a camera lie in a plane of the sensor's frame.
#pragma once

#include <cstdint>

namespace tactile {

// A camera over the plane z = plane_z, m. focal, middle: px; distortion: k1 k2 p1 p2 k3 (Brown); farthest: square of the normalised radius
// in the image beyond which the lens images nothing; rotation (3, 3): camera from sensor; centre (3), m.
struct CameraPlane {
    double focal[2], middle[2], distortion[5], farthest, rotation[3][3], centre[3], plane_z;
};

// Places seen (count, 3) of pixels uv (count, 2): x, y, m, and the area of a pixel there, m^2; NaN where the camera sees no place.
void back_project(const CameraPlane& camera, const double* uv, std::int64_t count, double* seen);

}  // namespace tactile
