// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels that rooms share: surfaces, outlines, points, cameras.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "common/camera_view.hpp"
#include "common/nearest.hpp"
#include "common/outlines.hpp"
#include "common/region_moments.hpp"

namespace tactile::border {
namespace {

auto outlines(const Array<double>& score, const Array<double>& wide, double level, double ceiling, int refine) {
    const Nodes nodes{wide, wide.length(0), wide.length(1), 3};
    Loops found = find_outlines(score, score.length(0), score.length(1), within(level, "level", 1e-9, ceiling), ceiling, refine);
    RegionMoments moments = region_moments(found, found.region.empty() ? 0 : found.region.back() + 1, nodes, refine);
    std::vector<double> points = points_of(found, nodes, refine);
    return std::tuple(std::move(found.vertices), std::move(found.start), std::move(found.region), std::move(points), std::move(moments.of),
                      moments.pitch);
}

const Camera& checked_camera(const Camera& camera) {
    for (const int focal : {0, 1}) within(camera.matrix(focal, focal), "matrix", 1e-9, 1e9);
    return camera;
}

}  // namespace

static void bind_common(py::module_& parent) {
    using Doubles = Array<double>;
    py::module_ module = parent.def_submodule("common", "What sensors share: surfaces, outlines, points, cameras.");
    def(
        module, "extend_surface -> (R+4, C+4, 3)", "The surface with two nodes more on each side, extrapolated linearly from the last two.",
        [](const Doubles& xyz) { return extended(xyz, xyz.length(0), xyz.length(1)); }, "xyz (R=2..65536, C=2..65536, 3)");
    def(
        module, "grid_normals -> (R, C, 3)",
        "Unit normals of the surface through points, z upwards, by differences of neighbours, one-sided next to a gap (NaN).",
        [](const Doubles& xyz) { return grid_normals(xyz, xyz.length(0), xyz.length(1)); }, "xyz (R, C, 3)");
    def(
        module, "nearest_points -> (M, L), (M, L)",
        "Distances and indices of the nearest points to each query, by rising distance; infinite and N where there are fewer points.",
        [](const Doubles& points, const Doubles& queries, py::ssize_t count) {
            return members<2>(nearest_points(points, points.length(), queries, queries.length(), count));
        },
        "points (N, 2) [-1e12, 1e12]", "queries (M, 2) [-1e12, 1e12]", "count L [1, 65536]");
    def(module, "find_outlines -> (M, 2), (L), (P), (M, 3), (Q, 10), pitch",
        "Closed polygons along which the score, clipped to 0 and ceiling, crosses level, with refine steps a node: vertices of (row, "
        "column);\n"
        "the first vertex of each polygon, and M; the region of each polygon: each region's outline, then its holes, the largest region "
        "first;\n"
        "the vertices on the surface wide; moments of the regions without their holes: area, vector area, integrals of x, y, z, and of\n"
        "xx, xy, yy; and the mean distance of neighbouring dots.",
        outlines, "score (R, C)", "wide (R+4, C+4, 3)", py::kw_only(), "level", "ceiling [0, 1e9]", "refine [1, 16]");
    def(
        module, "region_axes",
        "Full lengths of the ellipse of the same moments as a region, and its direction, rad, NaN where it is not significant: from\n"
        "integrals of 1, x, y, xx, xy, yy, and the points and starts of its polygons.",
        [](const Doubles& sums, const Doubles& points, const Array<std::int64_t>& start, double pitch) {
            check_starts(start, points.length());
            return Eigen::Vector3d(region_axes(sums, points, start, start.length() - 1, pitch).data());
        },
        "sums (6)", "points (M, 3)", "start (L=1..1000000000)", py::kw_only(), "pitch [0, 1e200]");
    auto camera = record(module, "Camera", "A pinhole with the distortion of its lens.",
                         field("matrix (3, 3) [-1e9, 1e9]", &Camera::matrix), field("distortion (5) [-1e9, 1e9]", &Camera::distortion),
                         field("rotation (3, 3) [-2, 2]", &Camera::rotation), field("farthest [0, inf]", &Camera::farthest));
    def(
        camera, "rays -> (N, 3)", "Unit vectors in the sensor frame through pixels; NaN where the lens images nothing.",
        [](const Camera& one, const Doubles& uv) { return camera_rays(checked_camera(one), uv, uv.length()); }, "uv (N, 2)");
    def(
        camera, "back_project -> (N, 3)",
        "x, y, m, where pixels lie in the plane at plane_z, m, seen from centre, m, and the area of a pixel there, m^2; NaN: nowhere.",
        [](const Camera& one, const Doubles& uv, const Eigen::Vector3d& centre, double plane_z) {
            return back_project(checked_camera(one), {centre, plane_z}, uv, uv.length());
        },
        "uv (N, 2)", py::kw_only(), "centre (3) [-1e9, 1e9]", "plane_z [-1e9, 1e9]");
}

static const Subject SUBJECT("common", bind_common);

}  // namespace tactile::border
