// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Length of the light's path in the water, whose colour follows the law of Beer and Lambert.
#include "touchpad/optics/light_path.hpp"

#include <algorithm>
#include <cmath>

namespace tactile {
namespace {

constexpr int LAMPS = 8;  // points that stand for the uniform ring light, to 1e-4 of a length (test_light_path)
constexpr double HALF = 0.70710678118654752440;
constexpr double COSINE[LAMPS] = {1, HALF, 0, -HALF, -1, -HALF, 0, HALF}, SINE[LAMPS] = {0, HALF, 1, HALF, 0, -HALF, -1, -HALF};
constexpr double DARK = 1e-6;  // irradiance by Lambert's cosine that a place turned away from all lamps still has: keeps the means defined

}  // namespace

// Means over the lamps, weighted by irradiance: inverse square of the distance, Lambert's cosine, ambient.
Incidence incidence(const LightPath& path, const Vec3& place, const Vec3& normal, const Vec3& ray) {
    const double up = place.z - path.lamp_z, ambient = std::max(path.ambient, 0.0) + DARK;
    double distance[LAMPS], weight[LAMPS], outward[LAMPS];
    for (int k = 0; k < LAMPS; ++k) {
        const double x = place.x - path.centre.x - path.lamp_radius * COSINE[k];
        const double y = place.y - path.centre.y - path.lamp_radius * SINE[k];
        distance[k] = std::sqrt(x * x + y * y + up * up);
        const double near = 1 / distance[k], cosine = (x * normal.x + y * normal.y + up * normal.z) * near;
        weight[k] = ((cosine > 0 ? cosine : 0) + ambient) * near * near;
        outward[k] = (x * ray.x + y * ray.y + up * ray.z) * near;
    }
    double total = 0, far = 0, along = 0;
    for (int k = 0; k < LAMPS; ++k) {
        total += weight[k];
        far += weight[k] * distance[k];
        along += weight[k] * outward[k];
    }
    const double slant = far / (total * up);
    return {slant, along / (total * up) - slant * ray.z / up, total / LAMPS};
}

// The derivative neglects that of the weights: accurate to 1 %.
Length length_at(const LightPath& path, double z, double upwards, const Incidence& light) {
    const double depth = z - path.window_z, both = 1 / upwards + light.slant;
    return {depth * both, upwards * both + depth * light.change};
}

}  // namespace tactile
