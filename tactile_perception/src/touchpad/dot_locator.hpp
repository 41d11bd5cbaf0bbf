// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Positions of a touchpad's dots, frame by frame: ranges by the colours around them, regularised by the membrane's balance of forces.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/array.hpp"
#include "common/camera_view.hpp"
#include "common/fields.hpp"
#include "touchpad/membrane.hpp"
#include "touchpad/water.hpp"

namespace tactile {

/// Light and water of a pad. path: of light_path; colour: of the water; ring: radius, px, and ring_share: over the pitch of the dots;
/// ink, glare: levels of ring_colours; cap_z, cap_radius: centre and radius of the sphere of the undeformed skin, m.
struct PadWater {
    Eigen::Matrix<double, 7, 1> path;
    WaterColour colour;
    double ring = 0, ring_share = 0, ink = 0, glare = 0, cap_z = 0, cap_radius = 0;
    TACTILE_FIELDS(path, colour, ring, ring_share, ink, glare, cap_z, cap_radius)
};

/// Glare of a pad. colour: blue/red and green/red of the glare over those of the scattered light, or of that before the water has dyed it
/// if the glare is dry (1, else 0: it passes the water); field: coefficients of ln(red) minus ln(irradiance) over the image; kind: how
/// likely and how large; red: absorption of red over that of blue minus that of red; shading: standard deviation of ln(red) by errors of
/// the surface's shape; min_ratio: of colours.
struct PadGlare {
    Eigen::Vector2d colour;
    Eigen::Matrix<double, 7, 1> field;
    Glare kind;
    double dry = 0, red = 0, shading = 0, min_ratio = 0;
    TACTILE_FIELDS(colour, field, kind, dry, red, shading, min_ratio)
};

/// Positions (N, 3), m, NaN: unknown. is_lit_otherwise: whether the mean of all ranges has changed as no press changes it; is_known:
/// whether any range is.
struct LocatedDots {
    std::vector<double> xyz;
    bool is_lit_otherwise = false, is_known = false;
    TACTILE_FIELDS(xyz, is_lit_otherwise, is_known)
};

/// Locates the dots of a touchpad, frame by frame.
class DotLocator {
 public:
    /// rest (K, 3), m: positions of the untouched dots, NaN where unknown; the membrane's are all known.
    DotLocator(const Camera& camera, const Membrane& membrane, std::vector<double> rest);

    /// Replaces the positions of the untouched dots, after drift of the reference.
    void set_rest(const Membrane& membrane, std::vector<double> rest);

    /// Takes another water and glare, if there is any, and drops the last frame. scale_sigma: see Membrane::reset.
    void set_water(const PadWater& water, const std::optional<PadGlare>& glare, double scale_sigma);

    /// Positions of the dots id (N) at uv (N, 2), px, in an image (rows, columns, 3).
    LocatedDots locate(const Array<std::uint8_t>& image, const Array<double>& uv, const std::vector<std::int64_t>& id);

    const Membrane& membrane() const { return membrane_; }

 private:
    struct Light {
        std::vector<double> lengths, irradiance;  // K
    };
    void set_light();
    Light light_on(const std::vector<double>& positions) const;
    void add_glare(const std::vector<double>& brightness, const std::vector<double>& rays, const std::vector<std::int64_t>& id,
                   DotColours& seen) const;

    Camera camera_;
    Membrane membrane_;
    std::vector<double> rest_, rest_ranges_, rest_normals_, rest_lengths_;  // K each; lengths only of a pad with glare
    std::optional<PadWater> water_;
    std::optional<PadGlare> glare_;
};

}  // namespace tactile
