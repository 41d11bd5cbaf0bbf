// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contacts on a dome, frame by frame: the one or two presses, straight or dragged, that best explain a frame, from the best match in a
// table of starts.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "common/fields.hpp"
#include "common/rows.hpp"
#include "press/choice.hpp"
#include "press/dome.hpp"
#include "press/marker_surface.hpp"

namespace tactile {

/// Constants of PressConstants and DomeConstants in press/constants.py, by their names.
struct DomeRules {
    double stands_out = 0, quieter = 0, sure = 0, faint = 0, ordinary = 0, unexplained = 0, added = 0, scaled = 0, apart = 0;
    double max_relative_reach = 0, max_relative_depth = 0, shallow = 0;
    double slope_share = 0, slope_base = 0, contact_gap = 0, centre_error = 0;
    Eigen::Vector2d not_linear = Eigen::Vector2d::Zero();
    std::ptrdiff_t min_markers = 0;
    PressOdds odds;
    TACTILE_FIELDS(stands_out, quieter, sure, faint, ordinary, unexplained, added, scaled, apart, max_relative_reach, max_relative_depth,
                   shallow, slope_share, slope_base, contact_gap, centre_error, not_linear, min_markers, odds)
};

/// Scales of fitted positions and depths, and their errors: DomeCalibration in press/dome/model.py; reach, m: of the library.
struct DomeScales {
    double wider = 1, deeper = 1, deeper_far = 1, deeper_shallow = 0;
    double place_error = 0, depth_share = 0, deepest = 0, farthest = 0, quiet = 0, reach = 0;
    TACTILE_FIELDS(wider, deeper, deeper_far, deeper_shallow, place_error, depth_share, deepest, farthest, quiet, reach)

    /// Fitted depth over the true one at a position, m, for a fitted depth, m; shallow: see DomeRules.
    double depth_scale(const Eigen::Vector2d& position, double depth, double shallow) const;
};

/// A calibrated dome; pitch: m, of the markers; straight, dragged, two: priors of presses.
struct DomeDevice {
    DomeMarkers markers;
    DomeErrors errors;
    MarkerSurface surface;
    DomeScales scales;
    DomePrior straight, dragged, two;
    double pitch = 0;
    TACTILE_FIELDS(markers, errors, surface, scales, straight, dragged, two, pitch)
};

/// Matches fields of one marker pattern with the fields of starts.
class DomeStarts {
 public:
    /// min_distance: m, between two starts.
    DomeStarts(const DomeLibrary& library, const DomeMarkers& markers, DomePresses starts, double min_distance);

    /// Takes apparent displacements (K, 2), m; NaN: not visible.
    void match(const Rows2& shift);
    /// Match of the best start over a standard deviation of noise, m.
    double score(double still) const { return (matches_.array() / sizes_.array().sqrt()).maxCoeff() / still; }
    /// The start with the smallest squared residual, or the press of the last frame if its residual is smaller.
    DomePresses one(const Rows2& shift, const std::optional<DomeFit>& last) const;
    /// The two starts whose sum has the smallest squared residual.
    DomePresses two() const;

 private:
    DomePresses starts_;
    FloatRows fields_;            // (S, 2 K), far more accurate than the noise of markers, and half as much to read as doubles
    Eigen::VectorXd sizes_;       // (S), m^2, squares of the fields
    Eigen::MatrixXd pair_sizes_;  // (S, S), m^2, of sums of two; 0 of those that are no pair
    Eigen::VectorXd matches_;     // (S), m^2, products of the fields with that of the frame
};

/// Estimates contacts frame by frame. Drags and pairs of presses may start from the last frame's solution.
class DomeMethod {
 public:
    DomeMethod(std::shared_ptr<const DomeLibrary> library, std::shared_ptr<const DomeLibrary> pushes, DomeDevice device,
               const DomeRules& rules, const DomePresses& starts);

    /// Contacts of one frame; empty without contact, and if the markers move too little to determine a position.
    std::vector<PressEstimate> estimate(const Rows2& rest, const Rows2& shift);
    /// Match of a field with that of a press, in standard deviations.
    double score(const Rows2& shift);
    /// Finds the presses of one frame.
    void find(const Rows2& rest, const Rows2& shift);
    /// Upward displacements (K), m, of the markers under the presses found last; none without contact.
    std::optional<Eigen::VectorXd> raised() const;

    const DomeMarkers& markers() const { return device_.markers; }

 private:
    struct Others {
        double sunk = 0;
        Eigen::Vector2d slopes = Eigen::Vector2d::Zero();
    };
    struct Tip;
    bool is_spread(const Rows2& rest, const Rows2& shift) const;
    DomeFit solve(const Rows2& shift, const DomePresses& starts, const DomePrior& prior) const;
    DomeFit explained(const Rows2& shift, Eigen::Index seen);
    void doubt(DomeFit& found, const Rows2& shift, Eigen::Index seen) const;
    PressEstimate touch(Eigen::Index number) const;
    Others by_others(Eigen::Index number, double radius) const;
    Eigen::Vector3d centre(Eigen::Index number, double radius, const Eigen::Vector2d& slopes) const;
    Vector6 wrench(const Eigen::Vector3d& lowest, double radius) const;
    double cap_height(const Eigen::Vector2d& position) const;
    double touch_height(const Eigen::Vector2d& position, double radius) const;

    std::shared_ptr<const DomeLibrary> library_, pushes_;
    DomeDevice device_;
    DomeRules rules_;
    DomeStarts starts_;
    Choice<DomeFit> choice_;
    std::optional<DomeFit> found_;
};

}  // namespace tactile
