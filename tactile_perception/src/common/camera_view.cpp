// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/camera_view.hpp"

#include <cmath>
#include <limits>
#include <optional>

#include "common/constants.hpp"

namespace tactile {
namespace {

using Eigen::Matrix2d, Eigen::Vector2d, Eigen::Vector3d;

constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();

// A point of the normalised image without distortion, by Brown's model: where it is imaged, and the Jacobian, which is symmetric.
struct Distorted {
    Vector2d image;
    double along, across, down;

    Distorted(const Eigen::Matrix<double, 5, 1>& k, const Vector2d& point) {
        const double x = point.x(), y = point.y(), square = x * x + y * y;
        const double swell = 1 + square * (k[0] + square * (k[1] + square * k[4]));
        const double slope = 2 * (k[0] + square * (2 * k[1] + square * 3 * k[4]));
        image.x() = x * swell + 2 * k[2] * x * y + k[3] * (square + 2 * x * x);
        image.y() = y * swell + 2 * k[3] * x * y + k[2] * (square + 2 * y * y);
        along = swell + x * x * slope + 2 * k[2] * y + 6 * k[3] * x;
        down = swell + y * y * slope + 6 * k[2] * y + 2 * k[3] * x;
        across = x * y * slope + 2 * k[2] * x + 2 * k[3] * y;
    }
    double determinant() const { return along * down - across * across; }
};

// What a pixel shows: the vector in the sensor's frame, as long as it is deep before the camera, and the ratio of areas, normalised image
// with the distortion over without.
struct Sight {
    Vector3d ray;
    double ratio;
};

// Newton's method; nothing where the lens images nothing.
std::optional<Sight> sight(const Camera& camera, const double* pixel) {
    const Vector2d image((pixel[0] - camera.matrix(0, 2)) / camera.matrix(0, 0), (pixel[1] - camera.matrix(1, 2)) / camera.matrix(1, 1));
    if (!(image.squaredNorm() < camera.farthest)) return {};
    Vector2d point = image;
    for (int step = 0; step < COMMON.max_steps; ++step) {
        const Distorted at(camera.distortion, point);
        const double ratio = at.determinant();
        const Vector2d error = image - at.image;
        const Vector2d change((error.x() * at.down - error.y() * at.across) / ratio,
                              (error.y() * at.along - error.x() * at.across) / ratio);
        point += change;
        if (!(change.lpNorm<1>() < COMMON.converged * (1 + std::abs(point.x()) + std::abs(point.y())))) continue;
        return Sight{point.x() * camera.rotation.row(0) + point.y() * camera.rotation.row(1) + camera.rotation.row(2), ratio};
    }
    return {};
}

}  // namespace

std::vector<double> camera_rays(const Camera& camera, const Array<double>& uv) {
    const std::ptrdiff_t count = uv.length();
    std::vector<double> rays(3 * count, UNKNOWN);
    for (std::int64_t k = 0; k < count; ++k) {
        const std::optional<Sight> seen = sight(camera, uv + 2 * k);
        if (!seen) continue;
        const Vector3d& ray = seen->ray;
        Eigen::Map<Vector3d> unit(&rays[3 * k]);
        unit = ray / std::sqrt(ray.x() * ray.x() + ray.y() * ray.y() + ray.z() * ray.z());
    }
    return rays;
}

Vector3d back_project(const Camera& camera, const ViewedPlane& plane, const double* pixel) {
    const std::optional<Sight> seen = sight(camera, pixel);
    if (!seen) return Vector3d::Constant(UNKNOWN);
    const Vector3d& ray = seen->ray;
    const double away = plane.z - plane.centre.z();
    const Vector2d point = plane.centre.head<2>() + ray.head<2>() * (away / ray.z());
    if (!(point.array().abs() < COMMON.max_coordinate_m).all()) return Vector3d::Constant(UNKNOWN);
    // Jacobian determinants: of the homography from the normalised image to the plane, and of the lens.
    const double area = away * away / std::abs(ray.z() * ray.z() * ray.z()) / std::abs(seen->ratio);
    return {point.x(), point.y(), area / (camera.matrix(0, 0) * camera.matrix(1, 1))};
}

}  // namespace tactile
