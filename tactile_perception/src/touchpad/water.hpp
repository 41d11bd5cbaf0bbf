// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Ranges of dots from the colour around them: absorption in the water along the light's path (Beer and Lambert), with glare.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <tuple>
#include <vector>

#include "common/array.hpp"
#include "common/fields.hpp"
#include "common/rows.hpp"
#include "common/vectors.hpp"
#include "dots/image.hpp"
#include "touchpad/membrane_forces.hpp"

namespace tactile {

constexpr int RING_POINTS = 16;  // on the ring around a dot, each the sum of 3 x 3 pixels

/// From a ring light through a window to the skin, and back to the camera; metres, sensor frame.
struct LightPath {
    double window_z, lamp_z, lamp_radius, ambient;  // ambient: diffuse share of the irradiance, 0 for Lambert's cosine alone
    Eigen::Vector3d centre;                                    // of the camera, on the ring's axis
};

/// The path of window_z, lamp_z, lamp_radius, ambient, and the camera's centre.
inline LightPath light_path(const double* numbers) {
    return {numbers[0], numbers[1], numbers[2], numbers[3], {numbers[4], numbers[5], numbers[6]}};
}

/// The light on a position: its mean 1 / cos(angle to the z axis), that mean's derivative along the camera's ray, 1/m, and the irradiance
/// in units of the lamps' power.
struct Incidence {
    double slant, change, irradiance;
};

/// Returns the light on a position with outward unit normal, on the unit ray from the camera's centre.
Incidence incidence(const LightPath& path, const Eigen::Vector3d& position, const Eigen::Vector3d& normal, const Eigen::Vector3d& ray);

/// Length in the water, m, to the position and back, and its derivative along the ray.
struct Length {
    double metres, slope;
};

/// Returns the length at height z on a ray whose z component is upwards, under the given light.
Length length_at(const LightPath& path, double z, double upwards, const Incidence& light);

/// Lengths (N), m, to positions (N, 3) on the skin with unit outward normals (N, 3), their derivatives (N) along the camera's rays, and the
/// irradiance (N) in units of the lamps' power.
std::tuple<std::vector<double>, std::vector<double>, std::vector<double>> path_lengths(const LightPath& path,
                                                                                       const Array<double>& positions,
                                                                                       const double* normals);

/// Colour of the background around each of N dots; NaN where it cannot be read.
struct RingColours {
    std::vector<double> ratios;       // N x 2: ln(blue / red), ln(green / red)
    std::vector<double> brightness;   // N: ln(red), red in grey levels
    std::vector<std::int64_t> count;  // N: ring points used, of 16
    std::vector<double> patchiness;   // N: relative variance of blue / red around the ring without its mean and first harmonic
    TACTILE_FIELDS(ratios, brightness, count, patchiness)
};

/// Returns the colours on rings of the given radius, px, around N dots with centres (N, 2), px, in an image (rows, columns, 3). A point
/// with blue below or above the shares ink and glare of its ring's upper quartile is left out (white light raises blue, the weakest
/// channel in red water, first).
RingColours ring_colours(const Array<std::uint8_t>& image, const Array<double>& centres, double radius, double ink, double glare);

/// The colour of the water: the ratios blue/red and green/red are exp(constant - absorption * length), and the covariance of their
/// logarithms is noise. disagree: standard deviations between the two ratios above which that of the length is increased; patchy: noise
/// variances of a ring point above which blue / red around a ring shows glare or an edge.
struct WaterColour {
    Eigen::Vector2d constants, absorptions;
    Eigen::Vector4d noise;
    double disagree = 0, patchy = 0;
    TACTILE_FIELDS(constants, absorptions, noise, disagree, patchy)
};

/// What is measured at N dots.
struct DotColours {
    Rows2 ratios;                          ///< logarithms, of ring_colours
    Numbers count;                         ///< points of the ring used, of 16
    Eigen::VectorXd patchiness;            ///< of ring_colours
    Eigen::VectorXd excess, excess_sigma;  ///< ln of the red light over that expected without glare, NaN where unknown; its deviation
    Rows2 colour;                          ///< blue/red and green/red of glare over those of the scattered light
    TACTILE_FIELDS(ratios, count, patchiness, excess, excess_sigma, colour)
};

/// Glare: light that the skin reflects like a mirror. Its share is its red light over the scattered red light.
struct Glare {
    double probability = 0;  // of a dot to have glare, before it is measured
    double size = 0;         // standard deviation of the shares
    TACTILE_FIELDS(probability, size)
};

/// Path lengths (N) and their standard deviations (N), m. Dots whose excess or colour is unknown count as free of glare.
struct WaterLengths {
    std::vector<double> lengths, sigma;
    TACTILE_FIELDS(lengths, sigma)
};

WaterLengths water_lengths(const WaterColour& water, const Glare& glare, const DotColours& seen);

/// N dots of a grid.
struct SeenDots {
    Numbers id;                   ///< row * columns + column
    Rows3 rays;                   ///< unit, from the camera's centre
    Eigen::VectorXd rest_ranges;  ///< m, untouched
    Rows3 rest_normals;           ///< unit, outward
    TACTILE_FIELDS(id, rays, rest_ranges, rest_normals)
};

/// Ranges of dots, and the derivatives of the light's path length by the range.
struct WaterRanges {
    std::vector<double> ranges, slopes;  // N, m; N
    TACTILE_FIELDS(ranges, slopes)
};

/// Returns the ranges at which the light's paths have the given lengths (N), m. A length is the mean over a ring around the dot; its radius
/// over the dots' pitch is ring_share. Without a grid (rows or columns below 3) the surface keeps its normals at rest.
WaterRanges water_ranges(const LightPath& path, const SeenDots& dots, Grid grid, const double* lengths, double ring_share);

}  // namespace tactile
