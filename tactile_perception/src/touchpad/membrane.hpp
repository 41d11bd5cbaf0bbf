// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The membrane of a touchpad: ranges of its dots from measurements and the balance of forces, and the loads of an object on the dots.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "common/band_matrix.hpp"
#include "common/fields.hpp"
#include "common/vectors.hpp"
#include "touchpad/membrane_forces.hpp"

namespace tactile {

/// Dots seen in a frame: id (N), on the grid; unit rays (N, 3); ranges (N), m, and their standard deviations sigma (N), m, NaN where
/// unknown.
struct SeenRanges {
    const std::int64_t* id;
    const double *rays, *ranges, *sigma;
    std::ptrdiff_t count;
};

/// All K dots in a frame, unseen ones interpolated: xyz (K, 3) and ranges (K), m; touched (K): probability of a load; fluid_pressure,
/// Pa; seen (K).
struct MembraneState {
    std::vector<double> xyz, ranges, touched;
    double fluid_pressure = std::numeric_limits<double>::quiet_NaN();
    std::vector<std::uint8_t> seen;
    TACTILE_FIELDS(xyz, ranges, touched, fluid_pressure, seen)
};

/// Loads of an object on all K dots: xyz (K, 3), m, and seen (K) as above; normal (K, 3), outward; force (K, 3), N; load (K): the object's
/// normal pressure over the fluid's, 0 without contact, 1 under a flat face.
struct DotLoads {
    std::vector<double> xyz;
    std::vector<std::uint8_t> seen;
    std::vector<double> normal, force, load;
    TACTILE_FIELDS(xyz, seen, normal, force, load)
};

/// Constants of the positions and loads of dots. docs/constants.md has the effect of halving and doubling them.
struct MembraneModel {
    double misfit = 0.2;       // standard deviation of a free dot's load: discretisation of the mesh
    double touched = 1.1;      // most likely load of a touched dot: that under a flat face
    double lighter = 0.4;      // standard deviation of a touched dot's load below that
    double heavier = 1.0;      // and above it; balls and edges press with 2 to 4
    double coupling = 4.0;     // log odds of a dot among touched neighbours, minus that among free ones
    double evidence = 18.0;    // log likelihood ratio from which a patch is touched: one false patch in about 10^7 dots
    double most = 7.5;         // maximum contribution of one dot to it, so that a patch needs three dots
    double tail = 4.0;         // standard deviations of a range beyond which it loses weight
    double smoothed = 18.0;    // factor by which the balance around a dot reduces the variance of its load due to range errors
    double residual = 0.2;     // standard deviation of a free dot's tangential residual over the pressure, apart from the scale error
    double correlated = 50.0;  // number of dots and frames over which that residual is correlated
    TACTILE_FIELDS(misfit, touched, lighter, heavier, coupling, evidence, most, tail, smoothed, residual, correlated)
};

/// Estimates positions and loads of the dots of a touchpad, frame by frame.
class Membrane {
 public:
    /// skin: the undeformed membrane; origin: the camera's centre, m.
    Membrane(Skin skin, const Eigen::Vector3d& origin, const MembraneModel& model = {})
        : skin_(std::move(skin)), origin_(origin), model_(model), matrix_(skin_.grid.size(), 2 * skin_.grid.columns + 2) {}

    const Skin& skin() const { return skin_; }
    const MembraneState& state() const { return state_; }
    const Eigen::Vector3d& origin() const { return origin_; }
    double scale() const { return 1 + scale_error_; }

    /// Replaces the undeformed membrane, after drift of the reference. The last frame is kept.
    void set_rest(Skin skin) { skin_ = std::move(skin); }

    /// Drops the last frame. scale_sigma: standard deviation of the relative error that all displacements share; 0 if there is none.
    void reset(double scale_sigma) {
        state_ = {};
        scale_error_ = 0, scale_precision_ = scale_sigma > 0 ? 1 / (scale_sigma * scale_sigma) : std::numeric_limits<double>::infinity();
    }

    /// Returns the state in the next frame.
    const MembraneState& solve(const SeenRanges& seen);

    /// Returns the loads if the seen dots id (count) are at positions (count, 3), m.
    DotLoads loads(const std::int64_t* id, const double* positions, std::ptrdiff_t count) const;

 private:
    template <class Lean>
    void learn_scale(const std::vector<double>& displaced, Lean lean);

    Skin skin_;
    Eigen::Vector3d origin_;
    MembraneModel model_;
    MembraneState state_;
    double scale_error_ = 0, scale_precision_ = std::numeric_limits<double>::infinity();
    BandMatrix matrix_;  // memory of solve
};

}  // namespace tactile
