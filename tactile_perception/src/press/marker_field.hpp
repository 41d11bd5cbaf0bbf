// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// From the tracks of a frame to the apparent displacements of all markers of a pattern: press/field.py.
#pragma once

#include <Eigen/Core>
#include <limits>

#include "common/camera_view.hpp"
#include "common/rows.hpp"

namespace tactile {

/// A camera that views the plane at plane_z, m, of the sensor's frame. Markers beyond the column seam, px, of an image that is stitched
/// from two cameras are seen from the second of camera_centres (2, 3), m; centre: m, from which positions are projected onto the plane.
struct MarkerView {
    Camera camera;
    Eigen::Vector3d centre;
    double plane_z = 0, seam = std::numeric_limits<double>::max();
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> camera_centres;
    TACTILE_FIELDS(camera, centre, plane_z, seam, camera_centres)

    /// Points of the plane (N, 3) seen at pixels uv (N, 2): x, y, m, and the area of a pixel there, m^2; NaN where there is none.
    Rows3 back_project(const Rows2& uv) const;
};

/// The K markers of a pattern in one frame, as in press/field.py; NaN where not visible.
struct MarkerField {
    Rows2 rest, shift;
    Eigen::VectorXd growth;
    Rows3 camera_centre;
    Rows2 uv, duv;
    Eigen::VectorXd area;

    /// Mask (K) of the markers with a known displacement.
    auto seen() const { return shift.array().isFinite().rowwise().all(); }
};

/// Dots of a frame (N): number of the marker, position and displacement in the image, px, and area, px^2.
struct TrackedMarkers {
    Numbers id;
    Rows2 uv, duv;
    Eigen::VectorXd area;
};

/// Displacement, px, within which a marker is untouched and a reference the same; time constant, s, of the mean area.
struct RestRule {
    double untouched_px = 0, area_time_s = 0;
    TACTILE_FIELDS(untouched_px, area_time_s)
};

/// Untouched positions and areas of the K markers of a pattern after a frame.
class RestMarkers {
 public:
    RestMarkers(Eigen::Index count, const RestRule& rule);
    /// Takes the dots of the frame at stamp_s, s, whose numbers are below K. Areas of markers that hardly move are averaged.
    void follow(TrackedMarkers tracks, double stamp_s);
    /// Whether a reference moved since the view was made, or has none.
    bool is_view_outdated() const { return outdated_; }
    /// The field of the frame. The view is that of the present references if it was outdated.
    MarkerField field(const MarkerView& view);

    const Rows2& uv() const { return uv_; }               // (K, 2), px; NaN: not yet seen
    const Eigen::VectorXd& area() const { return area_; }  // (K), px^2; NaN: unknown

 private:
    RestRule rule_;
    Rows2 uv_, view_uv_;  // view_uv: references for which the view was made
    Eigen::VectorXd area_, samples_;
    double stamp_s_;
    bool outdated_ = true;
    TrackedMarkers tracks_;
};

}  // namespace tactile
