// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contacts on a sheet, frame by frame: the presses (one straight, one dragged, or two at once) that best explain the marker field, from a
// coarse position by a matched filter.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "common/fields.hpp"
#include "common/rows.hpp"
#include "press/choice.hpp"
#include "press/marker_field.hpp"
#include "press/sheet_fit.hpp"

namespace tactile {

/// Corrections of camera centres and print: CameraShifts of press/sheet/model.py.
struct CameraShifts {
    Rows3 camera_centres;
    Rows2 shifts;
    Eigen::Vector2d printed = Eigen::Vector2d::Zero();
    double turned = 0;
    TACTILE_FIELDS(camera_centres, shifts, printed, turned)

    /// Number of the camera at a centre, m, which is not corrected.
    Eigen::Index number(const Eigen::RowVector3d& camera_centre) const;
    /// A field with corrected camera centres, in the frame of the sheet.
    MarkerField shifted(MarkerField field) const;
};

/// Constants of PressConstants and SheetConstants in press/constants.py, by their names. Pairs are of position and depth.
struct SheetRules {
    double tip = 0, stands_out = 0, sure = 0, ordinary = 0, strange = 0, unexplained = 0, unseen = 0;
    Eigen::Vector2d floor = Eigen::Vector2d::Zero(), dragged = floor, radius = floor, apart = floor;
    double disc_pitches = 0, max_relative_reach = 0, max_template_shift = 0, max_relative_depth = 0;
    std::ptrdiff_t min_markers = 0;
    PressOdds odds;
    TACTILE_FIELDS(tip, stands_out, sure, ordinary, strange, unexplained, unseen, floor, dragged, radius, apart, disc_pitches,
                   max_relative_reach, max_template_shift, max_relative_depth, min_markers, odds)
};

/// A calibrated sheet: corrections and noise of fields; tip and marker radius and pitch, m; errors of position, m, and of depth over depth;
/// range of calibrated positions and largest depth, m.
struct SheetDevice {
    CameraShifts shifts;
    MarkerNoise noise;
    double tip_radius = 0, marker_radius = 0, place_error = 0, depth_share = 0, deepest = 0;
    Eigen::Vector2d pitch = Eigen::Vector2d::Zero(), lowest = pitch, highest = pitch;
    TACTILE_FIELDS(shifts, noise, tip_radius, marker_radius, place_error, depth_share, deepest, pitch, lowest, highest)
};

/// Matches fields of one marker pattern with the fields of straight presses.
class SheetTemplates {
 public:
    /// presses: (S, 3), m, position and depth; depths: how many of these are at one position; shift, m, growth: deviations of noise.
    SheetTemplates(const Rows3& presses, Eigen::Index depths, double shift, double growth);

    /// Takes a frame; outdated templates, of markers or camera centres that moved by more than max_shift, m, are computed again.
    void match(const SheetTable& table, const MarkerField& field, double max_shift);
    /// The best matching press (1, 6), with its depth scaled to the match.
    Rows6 best(double deepest) const;
    /// That match in standard deviations of the noise or of the residual, whichever is larger.
    double score() const;
    /// The two templates (2, 6) of the second depth whose scaled fields best add up to the field, as if all markers were visible.
    Rows6 best_pair(double deepest);

 private:
    using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    void update(const SheetTable& table, const MarkerField& field, double max_shift);

    Rows3 presses_;
    Eigen::Index depths_, count_ = 0, best_ = 0;
    Eigen::Vector3d sigma_;
    Rows<5> seen_;                            // (K): rest and camera centre of the templates
    FloatRows fields_;                        // (S, 3 K), over sigma; 0 where unknown
    Eigen::VectorXf value_, known_, lengths_;  // (3 K), (3 K) 1 or 0, (S)
    Eigen::VectorXf matches_;                 // (S), products of value and fields
    Eigen::MatrixXd gram_;                    // of the second depth; empty: unknown
};

/// Estimates contacts frame by frame.
class SheetMethod {
 public:
    SheetMethod(std::shared_ptr<const SheetTable> table, SheetDevice device, const SheetRules& rules, SheetTemplates templates);

    /// Contacts of one frame; empty without contact. Two cameras may expose at different times, so that the first frame of a contact is
    /// skipped if no press explains it. Of earlier frames, only the drag and the motion of the second camera's markers are used.
    std::vector<PressEstimate> estimate(const MarkerField& field);
    /// Match of a field with the templates, in standard deviations.
    double score(const MarkerField& field);

 private:
    struct Seen {
        SheetMarkers markers;
        SheetFrame frame;
    };
    Seen seen(const MarkerField& field, const Rows3& motion) const;
    Rows3 motion(const MarkerField& field);
    SheetFit explained(const Seen& seen);
    bool is_sure(const SheetFit& fit, Eigen::Index k) const;
    bool is_seen(const PressEstimate& touch, const MarkerField& field) const;
    PressEstimate touch(const SheetFit& fit, Eigen::Index k) const;
    void centre(const SheetFit& fit, Eigen::Index k, PressEstimate& touch) const;
    Vector6 wrench(const SheetFit& fit, const Eigen::Vector3d& position) const;

    std::shared_ptr<const SheetTable> table_;
    SheetDevice device_;
    SheetRules rules_;
    SheetTemplates templates_;
    Choice<SheetFit> choice_;
    Rows3 before_;  // shift and growth of the last frame
    bool in_contact_ = false;
};

}  // namespace tactile
