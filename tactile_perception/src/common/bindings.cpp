// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels that rooms share: surfaces, outlines, points, cameras.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "common/camera_view.hpp"
#include "common/contact_tracker.hpp"
#include "common/nearest.hpp"
#include "common/outlines.hpp"
#include "common/region_moments.hpp"

namespace tactile::border {

// The points of a cloud, with the fields that tactile_perception.common.messages describes: the last one holds the state.
static std::vector<float> packed_points(const std::array<const double*, 4>& vectors, const double* normal_force,
                                        const Array<std::uint8_t>& state) {
    std::vector<float> packed(14 * state.size);
    float* next = packed.data();
    for (std::ptrdiff_t k = 0; k < state.size; ++k) {
        for (const double* vector : vectors) {
            for (std::ptrdiff_t axis = 0; axis < 3; ++axis) *next++ = static_cast<float>(vector[3 * k + axis]);
        }
        *next++ = static_cast<float>(normal_force[k]);
        std::memcpy(next++, &state.data[k], 1);
    }
    return packed;
}

static void bind_tracker(py::module_& module) {
    def(module, "may_continue", "Whether a contact may continue: src/common/contact_tracker.hpp.", {"seen_s", "last_s", "stamp_s"},
        may_continue);
    auto contact = class_of<TrackedContact>(module, "TrackedContact", "A contact in one frame: src/common/contact_tracker.hpp.");
    get(contact, "is_persistent", "whether it has been there for longer than a transient", &TrackedContact::is_persistent);
    auto tracker = class_of<ContactTracker>(module, "ContactTracker", "Contacts from frame to frame: src/common/contact_tracker.hpp.");
    init(tracker, {}, [] { return ContactTracker(); });
    def(tracker, "reset", "All regions are new contacts; ids are not reused.", {}, &ContactTracker::reset);
    using Labels = py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>;
    def(tracker, "assign",
        "The contact of each region, a label and Moments, in their order. labels: of each dot or taxel, 0 outside of the regions; reach: m.",
        {"labels", "regions", "reach", "stamp_s"},
        [](ContactTracker& one, const Labels& labels, const py::list& regions, double reach, double stamp) {
            std::vector<TrackedRegion> found;
            for (const py::handle& given : regions) {
                const auto [label, moments] = given.cast<std::pair<std::int32_t, py::object>>();
                found.push_back({label, moments.attr("centroid").cast<Eigen::Vector3d>(), moments.attr("area").cast<double>()});
            }
            return one.assign({labels.data(), labels.data() + labels.size()}, found, reach, stamp);
        });
}

static void bind_common(py::module_& parent) {
    using Doubles = Array<double>;
    py::module_ module = parent.def_submodule("common", "What sensors share: surfaces, outlines, points, cameras.");
    def(module, "extend_surface -> (R+4, C+4, 3)", "The surface with two nodes more on each side: src/common/dot_surface.hpp.",
        {"xyz (R=2..65536, C=2..65536, 3)"}, extended);
    def(module, "grid_normals -> (R, C, 3)", "Unit normals of the surface through points, z upwards; NaN without neighbours.",
        {"xyz (R, C, 3)"}, grid_normals);
    def(module, "nearest_points -> (M, L), (M, L)",
        "Distances and indices of the nearest points to each query, by rising distance; infinite and N where there are fewer.",
        {"points (N, 2) [-1e12, 1e12]", "queries (M, 2) [-1e12, 1e12]", "count L [1, 65536]"},
        [](const Doubles& points, const Doubles& queries, std::ptrdiff_t count) {
            Nearest found = nearest_points(points, points.length(), queries, queries.length(), count);
            return std::tuple(std::move(found.distance), std::move(found.index));
        });
    def(module, "pack_points -> (N, 14)", "Points of a cloud: x, y, z of each vector, normal_force; state, a byte.",
        {"xyz (N, 3)", "normal (N, 3)", "displacement (N, 3)", "force (N, 3)", "normal_force (N)", "state (N)"},
        [](const double* xyz, const double* normal, const double* displacement, const double* force, const double* normal_force,
           const Array<std::uint8_t>& state) { return packed_points({xyz, normal, displacement, force}, normal_force, state); });
    class_of<RegionOutlines>(module, "RegionOutlines", "Polygons, with their points and moments: src/common/region_moments.hpp.",
                             {"vertices (M, 2)", "points (M, 3)", "moments (Q, 10)"});
    def(module, "find_outlines", "RegionOutlines of the regions where score, clipped to 0 and 1, is above level, with refine steps a node.",
        {"score (R, C)", "wide (R+4, C+4, 3)", "level [1e-9, 1]", "refine [1, 16]"}, outline_regions);
    def(module, "region_axes", "Lengths, m, and direction, rad, of the ellipse of the same moments: src/common/region_moments.hpp.",
        {"sums (6)", "points (M, 3)", "start (L=1..1000000000)", "pitch [0, 1e200]"},
        [](const Doubles& sums, const Doubles& points, const Array<std::int64_t>& start, double pitch) {
            check_starts(start, points.length());
            return region_axes(sums, points, start, pitch);
        });
    auto camera = record<Camera>(module, "Camera", "A pinhole with the distortion of its lens: src/common/camera_view.hpp.",
                                 {"matrix distortion [-1e9, 1e9]", "rotation [-2, 2]", "farthest [0, inf]"});
    def(camera, "rays -> (N, 3)", "Unit vectors in the sensor frame through pixels; NaN where the lens images nothing.", {"uv (N, 2)"},
        camera_rays);
    bind_tracker(module);
}

static const Subject SUBJECT("common", bind_common);

}  // namespace tactile::border
