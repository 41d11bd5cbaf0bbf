// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// How well the motions of an object's dots in one frame agree with each mode in which it may move.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "touchpad/stick_slip.hpp"

namespace tactile {

inline Eigen::Vector3d vector_at(const std::vector<double>& array, std::ptrdiff_t k) {
    return Eigen::Map<const Eigen::Vector3d>(array.data() + 3 * k);
}

// The dots of one object that were in contact and seen in the last frame too. All lengths are m a frame; a turn counts as the way that it
// makes at the dots' root mean square distance from their centre. docs/stick_slip.md has the densities.
class ObjectMotion {
 public:
    // last_xyz (K, 3), m: in the last frame; noise: m, of a dot's motion across its ray; dots: those judged; touched (K); object: before.
    ObjectMotion(const StickSlipModel& model, Grid grid, const DotLoads& loads, const std::vector<double>& last_xyz,
                 const Eigen::Vector3d& origin, double noise, const std::vector<std::ptrdiff_t>& dots,
                 const std::vector<std::uint8_t>& touched, const TouchingObject& object, double seconds);

    // Probabilities (N) that the dots slip; updates the object, of whose modes odds are the probabilities before the frame is seen.
    std::vector<double> explain(TouchingObject& object, const std::array<double, MODES>& odds) const;

 private:
    // A dot's motion: moved, m, along a and b, unit, across its ray, and along its normal: rows of the object's twist and of the skin's
    // drift. drag: unit, across the ray; ratio: logarithm of its tangential over its normal load.
    struct Dot {
        Eigen::Matrix<double, 3, 6> rows;
        Eigen::Matrix<double, 2, 6> along_normal, along_skin;
        Eigen::Vector3d moved;
        Eigen::Vector2d drag;
        double ratio;
    };
    // A mode's best twist and its logarithmic evidence, up to a constant of the frame; slips (N): probabilities.
    struct Explanation {
        Twist twist;
        double evidence;
        std::vector<double> slips;
    };
    Explanation stick(const Twist& start, const Twist& mean, bool in_part) const;
    Explanation slide(const Twist& mean, double& drift_speed) const;
    double still() const;
    double slip_density(const Eigen::Vector2d& left, const Dot& dot, double way) const;
    double lags(const Eigen::Vector2d& left) const;
    double slipping(const Dot& dot, const Twist& twist) const;
    double off_aim(const Eigen::Vector2d& left, const Dot& dot) const;
    double ratio_if_slips(const Dot& dot) const;
    double ratio_if_sticks(const Dot& dot) const;
    double own_part(double variance) const;
    double stick_variance(const Twist& twist) const;
    Twist lowered() const;
    Twist carried_along() const;
    void learn_friction(TouchingObject& object, const std::vector<double>& slips) const;
    double count() const { return static_cast<double>(dots_.size()); }

    StickSlipModel model_;
    double noise_, seconds_, least_, radius_ = 0, friction_, friction_variance_;
    Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
    std::array<Twist, MODES> before_;  // twists in each mode, about this frame's centre
    bool is_new_;
    std::vector<Dot> dots_;
};

}  // namespace tactile
