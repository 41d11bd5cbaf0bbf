// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Rays through the pixels of a camera, and where they meet a plane of the sensor's frame.
#pragma once

#include <cstdint>

namespace tactile {

// focal, middle: px; distortion: k1 k2 p1 p2 k3 (Brown); farthest: square of the normalised radius in the image beyond which the lens
// images nothing; rotation (3, 3): camera from sensor.
struct Camera {
    double focal[2], middle[2], distortion[5], farthest, rotation[3][3];
};

// The plane z = z of the sensor's frame, seen from a camera's centre (3); m.
struct ViewedPlane {
    double centre[3], z;
};

// Unit vectors (count, 3) in the sensor's frame through pixels uv (count, 2); NaN where the lens images nothing.
void camera_rays(const Camera& camera, const double* uv, std::int64_t count, double* rays);

// Places seen (count, 3) of pixels uv (count, 2): x, y, m, and the area of a pixel there, m^2; NaN where the camera sees no place.
void back_project(const Camera& camera, const ViewedPlane& plane, const double* uv, std::int64_t count, double* seen);

}  // namespace tactile
