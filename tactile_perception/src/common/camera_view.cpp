// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/camera_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactile {
namespace {

constexpr int TURNS = 20;          // of Newton's method, at most. Chosen: lenses take 3 to 5
constexpr double SETTLED = 1e-12;  // last step, normalised. Chosen: far below a thousandth of a pixel
constexpr double FARTHEST_M = 10;  // a place farther out is not one. Chosen: far outside any sensor

// Brown's distortion of a place in the normalised image, and its Jacobian, which is symmetric.
struct Distorted {
    double x, y, along, across, down;

    Distorted(const double* k, const double* place) {
        const double px = place[0], py = place[1], square = px * px + py * py;
        const double swell = 1 + square * (k[0] + square * (k[1] + square * k[4]));
        const double slope = 2 * (k[0] + square * (2 * k[1] + square * 3 * k[4]));
        x = px * swell + 2 * k[2] * px * py + k[3] * (square + 2 * px * px);
        y = py * swell + 2 * k[3] * px * py + k[2] * (square + 2 * py * py);
        along = swell + px * px * slope + 2 * k[2] * py + 6 * k[3] * px;
        down = swell + py * py * slope + 6 * k[2] * py + 2 * k[3] * px;
        across = px * py * slope + 2 * k[2] * px + 2 * k[3] * py;
    }
    double determinant() const { return along * down - across * across; }
};

// The place (2) that Brown's model images at image (2), and the ratio of areas there, image over place; false where there is none.
bool undistort(const double* distortion, const double* image, double* place, double& ratio) {
    place[0] = image[0], place[1] = image[1];
    for (int turn = 0; turn < TURNS; ++turn) {
        const Distorted at(distortion, place);
        ratio = at.determinant();
        const double off_x = image[0] - at.x, off_y = image[1] - at.y;
        const double step_x = (off_x * at.down - off_y * at.across) / ratio, step_y = (off_y * at.along - off_x * at.across) / ratio;
        place[0] += step_x, place[1] += step_y;
        if (std::abs(step_x) + std::abs(step_y) < SETTLED * (1 + std::abs(place[0]) + std::abs(place[1]))) return true;
    }
    return false;
}

// The vector (3), in the sensor's frame, through a pixel (2), as long as it is deep before the camera, and the ratio of areas, normalised
// image with the lens' distortion over without; false where the lens images nothing.
bool ray_of(const Camera& camera, const double* pixel, double* ray, double& ratio) {
    const double image[2] = {(pixel[0] - camera.middle[0]) / camera.focal[0], (pixel[1] - camera.middle[1]) / camera.focal[1]};
    double place[2];
    if (!(image[0] * image[0] + image[1] * image[1] < camera.farthest)) return false;
    if (!undistort(camera.distortion, image, place, ratio)) return false;
    for (int axis = 0; axis < 3; ++axis)
        ray[axis] = place[0] * camera.rotation[0][axis] + place[1] * camera.rotation[1][axis] + camera.rotation[2][axis];
    return true;
}

}  // namespace

void camera_rays(const Camera& camera, const double* uv, std::int64_t count, double* rays) {
    std::fill(rays, rays + 3 * count, std::numeric_limits<double>::quiet_NaN());
    for (std::int64_t k = 0; k < count; ++k) {
        double ray[3], ratio;
        if (!ray_of(camera, uv + 2 * k, ray, ratio)) continue;
        const double length = std::sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]);
        for (int axis = 0; axis < 3; ++axis) rays[3 * k + axis] = ray[axis] / length;
    }
}

void back_project(const Camera& camera, const ViewedPlane& plane, const double* uv, std::int64_t count, double* seen) {
    std::fill(seen, seen + 3 * count, std::numeric_limits<double>::quiet_NaN());
    const double away = plane.z - plane.centre[2];
    for (std::int64_t k = 0; k < count; ++k, uv += 2, seen += 3) {
        double ray[3], ratio;
        if (!ray_of(camera, uv, ray, ratio)) continue;
        const double x = plane.centre[0] + ray[0] * (away / ray[2]), y = plane.centre[1] + ray[1] * (away / ray[2]);
        if (!(std::abs(x) < FARTHEST_M && std::abs(y) < FARTHEST_M)) continue;
        // Jacobian determinants: of the homography from the normalised image to the plane, and of the lens.
        const double area = away * away / std::abs(ray[2] * ray[2] * ray[2]) / std::abs(ratio);
        seen[0] = x, seen[1] = y, seen[2] = area / (camera.focal[0] * camera.focal[1]);
    }
}

}  // namespace tactile
