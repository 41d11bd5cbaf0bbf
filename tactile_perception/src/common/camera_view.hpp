// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Rays through the pixels of a camera, and where they meet a plane of the sensor's frame.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/array.hpp"
#include "common/fields.hpp"

namespace tactile {

/// A pinhole with Brown's distortion of its lens.
struct Camera {
    Eigen::Matrix3d matrix;                  ///< K, px
    Eigen::Matrix<double, 5, 1> distortion;  ///< k1 k2 p1 p2 k3
    Eigen::Matrix3d rotation;                ///< camera from sensor
    double farthest = 0;                     ///< squared normalised radius in the image beyond which the lens images nothing
    TACTILE_FIELDS(matrix, distortion, rotation, farthest)
};

/// The plane at that height, m, of the sensor's frame, seen from a camera's centre, m.
struct ViewedPlane {
    Eigen::Vector3d centre;
    double z;
};

/// Unit vectors (N, 3) in the sensor's frame through pixels uv (N, 2); NaN where the lens images nothing.
std::vector<double> camera_rays(const Camera& camera, const Array<double>& uv);

/// The point of the plane that a pixel shows: x, y, m, and the area of the pixel there, m^2; NaN where there is none.
Eigen::Vector3d back_project(const Camera& camera, const ViewedPlane& plane, const double* pixel);

}  // namespace tactile
