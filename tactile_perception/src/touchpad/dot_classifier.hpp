// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// States of the dots of one frame, forces on them, and the motion of the object, by the membrane's balance of forces.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/fields.hpp"
#include "touchpad/contact.hpp"
#include "touchpad/membrane.hpp"
#include "touchpad/rigid_motion.hpp"
#include "touchpad/stick_slip.hpp"

namespace tactile {

/// Of the N seen dots: states, scores, above 0.5 in contact, confidence, the probability of the state, NaN: unknown, displacements (N, 2),
/// m, of the object over each dot since the last frame, along x and y, NaN: unknown. Of all K dots: positions xyz (K, 3), m, states,
/// scores, and forces (K, 3), N. wrench (6): N and N m, at the origin. motion: of the object since the last frame, if known.
struct ClassifiedDots {
    std::vector<std::uint8_t> state, all_states;
    std::vector<double> score, confidence, displacements, xyz, all_scores, force, wrench;
    std::vector<TouchingObject> objects;
    std::optional<RigidMotion> motion;
    TACTILE_FIELDS(state, all_states, score, confidence, displacements, xyz, all_scores, force, wrench, objects, motion)
};

/// Classifies the dots of a touchpad, frame by frame: a network decides about contact from a dot's load and the curvature of the skin
/// around it; a dot in contact either sticks to the object or lags behind it, that is, slips.
class DotClassifier {
 public:
    DotClassifier(Membrane membrane, BorderNetwork network, const StickSlipModel& model);

    /// Replaces the undeformed membrane, after drift of the reference.
    void set_rest(const Membrane& other);

    /// Classifies the seen dots id (count) at positions (count, 3), m, so many seconds after the last frame.
    ClassifiedDots classify(const std::vector<std::int64_t>& id, const double* positions, double seconds);

    const Membrane& membrane() const { return membrane_; }

 private:
    std::optional<RigidMotion> motion(const DotLoads& loads, const std::vector<std::uint8_t>& states);

    Membrane membrane_;
    BorderNetwork network_;
    StickSlip dots_;
    StickingReference reference_;
    double pitch_;
};

}  // namespace tactile
