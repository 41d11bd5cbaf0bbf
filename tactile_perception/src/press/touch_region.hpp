// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/vectors.hpp"

namespace tactile {

// A clamped skin: a sheet of this size, m, or, where that is 0, a dome of height over a round rim, m.
struct ClampedSkin {
    double size[2], rim_radius, height;
};

// A round tip: its lowest point, how far it is pressed in, and its radius, m.
struct RoundTip {
    Vec3 place;
    double depth, radius;
};

// The disc in which a tip and the skin touch: centre and radius, m, and unit normal, outwards.
struct ContactDisc {
    Vec3 centre, normal;
    double radius;
};

// Contact radius a, m, of a round tip on a taut membrane clamped at a distance of clearance, m. Within a the membrane follows the tip (a
// paraboloid, slope a / tip_radius at its edge); outside it solves Laplace's equation, so depth is logarithmic in the distance:
// depth = a^2 / tip_radius (1/2 + ln(clearance / a)).
double contact_radius(double depth, double tip_radius, double clearance);

// Conformal radius, m, of the clamped area at a place: radius of the circular membrane that is as compliant in its centre. A disc's is
// (R^2 - r^2) / R; a rectangle's is approximated from those of its two strips.
double clearance(const ClampedSkin& skin, double x, double y);

ContactDisc contact_disc(const ClampedSkin& skin, const RoundTip& tip);

constexpr int CORNERS = 36;  // of an outline: the polygon has 0.5 % less area than the disc

// Writes the corners of a disc's outline (CORNERS, 3), m.
void disc_outline(const ContactDisc& disc, double* outline);

// Apparent markers (count): untouched positions and shifts (count, 2), m, in the viewing plane at height plane, m, and eyes (count, 3), m.
struct ViewedMarkers {
    std::ptrdiff_t count;
    const double *rest, *shift, *eye;
    double plane;
};

// Numbers of the markers that are seen, and whether each appears under one of the discs.
struct MarkersUnder {
    std::vector<std::int64_t> id;
    std::vector<std::uint8_t> under;
};
MarkersUnder markers_under(const std::vector<ContactDisc>& discs, const ViewedMarkers& markers);

}  // namespace tactile
