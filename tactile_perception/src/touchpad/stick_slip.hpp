// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// State of each dot (free, sticking, slipping) from loads and motions, by a model of its object: docs/stick_slip.md.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "common/fields.hpp"
#include "touchpad/membrane.hpp"
#include "touchpad/rigid_motion.hpp"

namespace tactile {

/// State of a dot.
enum DotState : std::uint8_t { FREE, STICKING, SLIPPING };

/// Mode of an object: all its dots stick to it, some, none, or all while it is at rest.
enum Mode : std::uint8_t { HELD, IN_PART, SLIDING, AT_REST, MODES };

/// Constants of the decision between stick and slip; docs/stick_slip.md explains the model.
struct StickSlipModel {
    double depth_noise = 20e-6;    // m, noise of a dot's motion along the skin's normal; measured in simulated frames
    double strain = 0.04;          // share of an object's motion by which sticking dots separate as their loads change
    double creep = 0.04e-3;        // m/s, upper limit of that separation
    double slip = 0.3e-3;          // m/s, lag from which a dot counts as slipping: a definition
    double drift = 0.3e-3;         // m/s, speed at which a sliding object drags the dots along; 0.1 to 0.6 mm/s were observed
    double acceleration = 6e-3;    // m/s^2, of objects
    double friction = 0.3;         // coefficient of an unknown object: dry rubber on most materials
    double friction_spread = 0.5;  // standard deviation of its logarithm, a factor of 1.6
    double friction_noise = 0.15;  // that of the logarithm of a slipping dot's load ratio over the object's friction: load errors at edges
    double aim = 0.3;              // rad, standard deviation of the angle between a slipping dot's lag and its drag: load errors at edges
    double rate = 0.5;             // 1/s, of changes from one mode to the next
    double share = 2.0;            // number of neighbouring dots with common loads and creep, which count as one
    TACTILE_FIELDS(depth_noise, strain, creep, slip, drift, acceleration, friction, friction_spread, friction_noise, aim, rate, share)
};

using Twist = Eigen::Matrix<double, 6, 1>;

/// The estimate of an object in contact after a frame.
///
/// odds: probabilities of the modes; slipping: share of the dots that slip in each mode; twist: in each mode, m and rad a frame about the
/// centre, with w = 2 tan(angle / 2) times the axis (Cayley's form is exact and linear:
/// after - before = v + w x ((before + after) / 2 - centre)); friction, friction_variance: of the logarithm of the coefficient; count:
/// number of judged dots, 0 for a new object; adrift: time for which it has slid, s; drift: speed of the dots below a sliding object, m/s.
struct TouchingObject {
    std::array<double, MODES> odds{0.5, 0.5, 0, 0}, slipping{};
    std::array<Twist, MODES> twist{Twist::Zero(), Twist::Zero(), Twist::Zero(), Twist::Zero()};
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double friction = 0, friction_variance = 0, adrift = 0, drift = 0;
    std::ptrdiff_t count = 0;
    TACTILE_FIELDS(count, odds, slipping)
    bool slides() const { return odds[SLIDING] > 0.5; }
    /// The twist of the likeliest mode in which dots stick to it; NaN if these are too few.
    Twist held_twist() const;
};

/// Decides frame by frame which dots of a grid stick or slip.
class StickSlip {
 public:
    /// origin: the camera's centre, m.
    StickSlip(Grid grid, Eigen::Vector3d origin, StickSlipModel model = {});

    /// Returns the states (K) of the dots in the next frame, which is seconds after the last. score (K): above 0.5 in contact.
    std::vector<std::uint8_t> update(const DotLoads& loads, const std::vector<double>& score, double seconds);

    /// Probabilities (K) that the dots slip, given that they touch; NaN of dots that are free or were not seen in the last two frames.
    const std::vector<double>& slipping() const { return slipping_; }

    /// Probabilities (K) of the dots' states; NaN where slipping is.
    const std::vector<double>& confidence() const { return confidence_; }

    /// The objects in contact, largest first.
    const std::vector<TouchingObject>& objects() const { return objects_; }

    /// Displacements (K, 2) of the objects relative to their dots in the last frame, m, along x and y. In gross slip it follows from the
    /// last frame in which dots stuck, a second ago at most, with a standard deviation of a third. NaN outside of objects, and where too
    /// few dots show the motion, as while the object is lifted and its dots spring back.
    std::vector<double> displacements() const;

    /// Motion in the last frame of the largest object to which enough dots stick, if there is one.
    std::optional<RigidMotion> motion() const;

    std::ptrdiff_t size() const { return grid_.size(); }
    double friction() const;                 // coefficient of the object last seen
    double noise() const { return noise_; }  // m, standard deviation of a dot's motion across its ray, measured while nothing touches

 private:
    TouchingObject continued(const std::vector<std::ptrdiff_t>& dots) const;
    void measure_noise(const DotLoads& loads);

    Grid grid_;
    Eigen::Vector3d origin_;
    StickSlipModel model_;
    double noise_, friction_, friction_variance_, seconds_ = 0;
    std::vector<TouchingObject> objects_;
    std::vector<int> held_;  // number of the object on a dot, from 1; 0: none
    std::vector<double> last_xyz_, moved_, slipping_, confidence_;
    std::vector<std::uint8_t> last_seen_;
};

}  // namespace tactile
