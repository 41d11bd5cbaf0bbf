// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/vectors.hpp"

namespace tactile {

// From a ring light through a window to the skin, and back to the camera; metres, sensor frame.
struct LightPath {
    double window_z, lamp_z, lamp_radius, ambient;  // ambient: diffuse share of the irradiance, 0 for Lambert's cosine alone
    Vec3 centre;                                    // of the camera, on the ring's axis
};

// The light that falls on a place: its mean 1 / cos(angle to the z axis), that mean's derivative along the camera's ray, 1/m, and the
// irradiance in units of the lamps' power.
struct Incidence {
    double slant, change, irradiance;
};

// The light on a place with outward unit normal, on the unit ray from the camera's centre.
Incidence incidence(const LightPath& path, const Vec3& place, const Vec3& normal, const Vec3& ray);

// Length in the water, m, to the place and back, and its derivative along the ray.
struct Length {
    double metres, slope;
};

// The length at height z on a ray whose z component is upwards, under the given light.
Length length_at(const LightPath& path, double z, double upwards, const Incidence& light);

}  // namespace tactile
