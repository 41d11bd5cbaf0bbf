// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Likelihood of the motions of an object's dots in one frame, in each mode of the object.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "touchpad/stick_slip.hpp"

namespace tactile {

/// Vector k of an array (K, 3).
inline Eigen::Vector3d vector_at(const std::vector<double>& array, std::ptrdiff_t k) {
    return Eigen::Map<const Eigen::Vector3d>(array.data() + 3 * k);
}

/// xyz (K, 3), m: of all dots in the last frame, which was so many seconds ago; touched (K): which are in contact now; noise: of a dot's
/// motion across its ray from origin, m.
struct LastFrame {
    const std::vector<double>& xyz;
    double seconds;
    const std::vector<std::uint8_t>& touched;
    double noise;
    const Eigen::Vector3d& origin;
};

/// The dots of one object that were in contact and seen in the last frame, too. Lengths are in m a frame; a rotation is measured by the
/// displacement at the dots' root mean square distance from their centre. docs/stick_slip.md has the densities.
class ObjectMotion {
 public:
    /// loads: of all dots; dots: those that are judged; object: as of the last frame.
    ObjectMotion(const StickSlipModel& model, Grid grid, const DotLoads& loads, const LastFrame& last,
                 const std::vector<std::ptrdiff_t>& dots, const TouchingObject& object);

    /// Returns the probabilities (N) that the dots slip, and updates the object. odds: predicted probabilities of its modes.
    std::vector<double> explain(TouchingObject& object, const std::array<double, MODES>& odds) const;

 private:
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6>;
    using BothRows = Eigen::Matrix<double, Eigen::Dynamic, 12>;
    // A mode's best twist and its logarithmic evidence, up to a constant of the frame; slips (N): probabilities.
    struct Explanation {
        Twist twist;
        double evidence;
        std::vector<double> slips;
    };
    // Squared residual of a dot's motion across its ray, m^2, and along the normal, in variances.
    struct Residual {
        double across, along;
    };
    Residual residual(const Eigen::VectorXd& left, std::ptrdiff_t i) const;
    Eigen::Vector2d across(const Eigen::VectorXd& left, std::ptrdiff_t i) const { return {left[i], left[count_ + i]}; }
    void weigh(Eigen::VectorXd& weights, std::ptrdiff_t i, double across, double along) const;
    Explanation stick(const Twist& start, const Twist& mean, bool in_part) const;
    Explanation slide(const Twist& mean, double& drift_speed) const;
    double rest_density() const;
    double slip_density(const Eigen::Vector2d& left, std::ptrdiff_t i, double displacement) const;
    double lag_log_probability(const Eigen::Vector2d& left) const;
    double slip_log_likelihood(std::ptrdiff_t i, const Eigen::VectorXd& left) const;
    double aim_density(const Eigen::Vector2d& left, std::ptrdiff_t i) const;
    double depth_density(double along) const;
    double own_share(double variance) const;
    double stick_variance(const Twist& twist) const;
    Twist lowered() const;
    Twist carried_along() const;
    void learn_friction(TouchingObject& object, const std::vector<double>& slips) const;

    StickSlipModel model_;
    std::ptrdiff_t count_;
    double noise_, seconds_, least_, radius_ = 0, friction_, friction_variance_;
    Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
    std::array<Twist, MODES> before_;  // twists in each mode, about this frame's centre
    bool is_new_;
    // Motions moved_ of all dots, m: first along unit vectors a across their rays, then along b, then along their normals. rows_:
    // derivatives by the object's twist; both_rows_: by that and the skin's drift. drag_: unit, across the ray. ratio_: logarithm of a
    // dot's tangential over its normal load; if_slips_, if_sticks_: its logarithmic likelihoods.
    Rows rows_;
    BothRows both_rows_;
    Eigen::VectorXd moved_, ratio_, if_slips_, if_sticks_;
    Eigen::Matrix2Xd drag_;
};

}  // namespace tactile
