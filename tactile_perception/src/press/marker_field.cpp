// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/marker_field.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tactile {
namespace {

constexpr double UNKNOWN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Rows3 MarkerView::back_project(const Rows2& uv) const {
    Rows3 found(uv.rows(), 3);
    for (Eigen::Index k = 0; k < uv.rows(); ++k) found.row(k) = tactile::back_project(camera, {centre, plane_z}, uv.row(k).data());
    return found;
}

RestMarkers::RestMarkers(Eigen::Index count, const RestRule& rule)
    : rule_(rule),
      uv_(Rows2::Constant(count, 2, UNKNOWN)),
      view_uv_(uv_),
      area_(Eigen::VectorXd::Constant(count, UNKNOWN)),
      samples_(Eigen::VectorXd::Zero(count)),
      stamp_s_(UNKNOWN) {}

void RestMarkers::follow(TrackedMarkers tracks, double stamp_s) {
    const double passed = std::isfinite(stamp_s_) ? std::max(stamp_s - stamp_s_, 0.0) : 0.0;
    const double min_weight = std::min(passed / rule_.area_time_s, 1.0);
    const auto is_same = [&](const Eigen::RowVector2d& change) { return (change.array().abs() <= rule_.untouched_px).all(); };
    for (Eigen::Index n = 0; n < tracks.id.size(); ++n) {
        const Eigen::Index id = tracks.id[n];
        const Eigen::RowVector2d rest = tracks.uv.row(n) - tracks.duv.row(n);
        if (!rest.allFinite()) continue;
        if (!is_same(rest - uv_.row(id))) samples_[id] = 0;
        outdated_ = outdated_ || !is_same(rest - view_uv_.row(id));
        uv_.row(id) = rest;
        if (!is_same(tracks.duv.row(n))) continue;
        const double weight = std::max(1 / ++samples_[id], min_weight);
        area_[id] = samples_[id] == 1 ? tracks.area[n] : area_[id] + weight * (tracks.area[n] - area_[id]);
    }
    stamp_s_ = stamp_s;
    tracks_ = std::move(tracks);
}

MarkerField RestMarkers::field(const MarkerView& view) {
    if (outdated_) view_uv_ = uv_, outdated_ = false;
    const Eigen::Index count = uv_.rows();
    const Rows2 unknown = Rows2::Constant(count, 2, UNKNOWN);
    const Eigen::VectorXd none = Eigen::VectorXd::Constant(count, UNKNOWN);
    MarkerField field{unknown, unknown, none, Rows3::Constant(count, 3, UNKNOWN), unknown, unknown, none};
    const auto& [ids, uv, duv, area] = tracks_;
    const Rows3 now = view.back_project(uv), rest = view.back_project(uv - duv);
    for (Eigen::Index n = 0; n < ids.size(); ++n) {
        const Eigen::Index id = ids[n];
        field.rest.row(id) = rest.row(n).head<2>(), field.shift.row(id) = now.row(n).head<2>() - rest.row(n).head<2>();
        const double growth = std::log(area[n] / area_[id] * (now(n, 2) / rest(n, 2)));
        field.growth[id] = std::isfinite(growth) ? growth : UNKNOWN;
        field.camera_centre.row(id) = view.camera_centres.row(uv(n, 0) > view.seam);
        field.uv.row(id) = uv.row(n), field.duv.row(id) = duv.row(n), field.area[id] = area[n];
    }
    return field;
}

}  // namespace tactile
