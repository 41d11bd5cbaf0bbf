// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dots/detect/disc_model.hpp"

namespace tactile {

// A disc: centre, px from the patch's middle pixel; diameter, px; amplitude (disc minus ground) and ground, grey levels.
struct Disc {
    double u, v, diameter, amplitude, ground;
};

// A node of linearisation; across and down are negative in the mirrored quadrants.
struct DiscNode {
    int size, down, across;
    bool operator==(const DiscNode& other) const { return size == other.size && down == other.down && across == other.across; }
};

// The node nearest to a disc; its numbers may be NaN.
DiscNode nearest_node(const Disc& disc, const DiscModel& model);

// One Gauss-Newton step: the weighted least-squares disc, linearised at the node, in a compressed patch (DIMENSIONS).
Disc estimate(const float* patch, const DiscNode& node, const DiscModel& model);

// Up to `steps` steps, fewer where the node stays; node: the one of the last step.
Disc fit_disc(const float* patch, Disc start, int steps, const DiscModel& model, DiscNode& node);

// Variance of the pixels, grey levels^2, not explained by the disc at this node, sloping ground, ellipticity and blur, none of which
// shifts positions.
double residual_variance(const float* patch, const DiscNode& node, const DiscModel& model);

}  // namespace tactile
