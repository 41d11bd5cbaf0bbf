// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels that rooms share: surfaces, outlines, points, cameras, rigid motions; see bindings/bindings.cpp.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "common/camera_view.hpp"
#include "common/nearest.hpp"
#include "common/outlines.hpp"
#include "common/region_moments.hpp"

namespace tactile::border {
namespace {

constexpr double LARGEST_SIZE = 1e200;   // m, m^2. Chosen: any units
constexpr int FINEST = 16;               // steps a node
constexpr py::ssize_t MOST = 64 * 1024;  // nodes of a grid

// Surfaces and outlines.
Nodes wide_surface(const Input<double>& given) {
    within(given.length(), "wide", 2 + 2 * BEYOND, MOST);
    within(given.length(1), "wide", 2 + 2 * BEYOND, MOST);
    return {given.data(), given.length(), given.length(1), 3};
}

py::array_t<double> wide_of(const py::object& xyz) {
    const Input<double> given(xyz, "xyz", {ANY, ANY, 3});
    for (const py::ssize_t axis : {0, 1}) within(given.length(axis), "xyz", 2, MOST);
    return output(extended(given.data(), given.length(), given.length(1)), {given.length() + 2 * BEYOND, given.length(1) + 2 * BEYOND, 3});
}

py::tuple outlines(const py::object& score, const py::object& wide, double level, double ceiling, int refine) {
    const Input<double> given(score, "score", {ANY, ANY}), surface(wide, "wide", {ANY, ANY, 3});
    const Nodes nodes = wide_surface(surface);
    if (given.length() != nodes.rows - 2 * BEYOND || given.length(1) != nodes.columns - 2 * BEYOND)
        throw py::value_error("score: two nodes less on each side than of wide are needed");
    within(refine, "refine", 1, FINEST);
    within(level, "level", 1e-9, within(ceiling, "ceiling", 0, 1e9));
    const Loops found = without_gil([&] { return find_outlines(given.data(), given.length(), given.length(1), level, ceiling, refine); });
    const RegionMoments moments = region_moments(found, found.region.empty() ? 0 : found.region.back() + 1, nodes, refine);
    return py::make_tuple(rows_of(found.places, 2), row_of(found.start), row_of(found.region), rows_of(points_of(found, nodes, refine)),
                          rows_of(moments.of, MOMENTS), moments.pitch);
}

py::array_t<double> axes(const py::object& sums, const py::object& points, const py::object& start, double pitch) {
    const Input<double> total(sums, "sums", {6}), border(points, "points", {ANY, 3});
    const Input<std::int64_t> first(start, "start", {ANY});
    within(pitch, "pitch", 0, LARGEST_SIZE);
    within(first.length(), "start", 1, 1e9);
    check_starts(first, border.length());
    return output(region_axes(total.data(), border.data(), first.data(), first.length() - 1, pitch), {3});
}

py::tuple nearest(const py::object& points, const py::object& queries, py::ssize_t count) {
    const Input<double> among(points, "points", {ANY, 2}), from(queries, "queries", {ANY, 2});
    within(count, "count", 1, MOST);
    check_places(among, "points");
    check_places(from, "queries");
    const Nearest found = without_gil([&] { return nearest_points(among.data(), among.length(), from.data(), from.length(), count); });
    return py::make_tuple(output(found.distance, {from.length(), count}), output(found.index, {from.length(), count}));
}

// Cameras and rigid motions.
// px, and m: numbers of a camera. Chosen: beyond any camera, and squares stay far from overflow.
constexpr double LARGEST_OF_CAMERA = 1e9;

Camera as_camera(const py::object& matrix, const py::object& distortion, const py::object& rotation, double farthest) {
    const Input<double> lens(matrix, "matrix", {3, 3}), bends(distortion, "distortion", {5}), turn(rotation, "rotation", {3, 3});
    const double* k = lens.data();
    for (const int focal : {0, 4}) within(k[focal], "matrix", 1 / LARGEST_OF_CAMERA, LARGEST_OF_CAMERA);
    for (const int middle : {2, 5}) within(k[middle], "matrix", -LARGEST_OF_CAMERA, LARGEST_OF_CAMERA);
    Camera camera{{k[0], k[4]}, {k[2], k[5]}, {}, within(farthest, "farthest", 0, INFINITY), {}};
    for (int i = 0; i < 5; ++i) camera.distortion[i] = within(bends.data()[i], "distortion", -LARGEST_OF_CAMERA, LARGEST_OF_CAMERA);
    for (int i = 0; i < 9; ++i) camera.rotation[i / 3][i % 3] = within(turn.data()[i], "rotation", -2, 2);
    return camera;
}

py::array_t<double> rays_through(const py::object& uv, const py::object& matrix, const py::object& distortion, const py::object& rotation,
                                 double farthest) {
    const Input<double> pixels(uv, "uv", {ANY, 2});
    const Camera camera = as_camera(matrix, distortion, rotation, farthest);
    std::vector<double> rays(3 * pixels.length());
    camera_rays(camera, pixels.data(), pixels.length(), rays.data());
    return rows_of(rays);
}

py::array_t<double> back_projected(const py::object& uv, const py::object& matrix, const py::object& distortion, const py::object& rotation,
                                   const py::object& centre, double farthest, double plane_z) {
    const Input<double> pixels(uv, "uv", {ANY, 2}), place(centre, "centre", {3});
    const Camera camera = as_camera(matrix, distortion, rotation, farthest);
    ViewedPlane plane{{}, within(plane_z, "plane_z", -LARGEST_OF_CAMERA, LARGEST_OF_CAMERA)};
    for (int i = 0; i < 3; ++i) plane.centre[i] = within(place.data()[i], "centre", -LARGEST_OF_CAMERA, LARGEST_OF_CAMERA);
    std::vector<double> seen(3 * pixels.length());
    back_project(camera, plane, pixels.data(), pixels.length(), seen.data());
    return rows_of(seen);
}

}  // namespace

void bind_common(py::module_& module) {
    module.def(
        "extend_surface", &wide_of, py::arg("xyz"),
        "xyz (rows, columns, 3) with two nodes more on each side (rows + 4, columns + 4, 3), extrapolated linearly from the last two.");
    module.def("nearest_points", &nearest, py::arg("points"), py::arg("queries"), py::arg("count"),
               "Distances (M, count) and indices (M, count) of the nearest of points (N, 2) to each of queries (M, 2), by rising distance;\n"
               "infinite and N where there are fewer points.");
    module.def(
        "find_outlines", &outlines, py::arg("score"), py::arg("wide"), py::kw_only(), py::arg("level"), py::arg("ceiling"),
        py::arg("refine"),
        "Closed polygons along which score (rows, columns) float64, clipped to 0 and ceiling, crosses level, with refine steps a node:\n"
        "vertices (M, 2) of (row, column), the first vertex of each polygon and M, (L + 1,), and its region (L,): each region's outline,\n"
        "then its holes; the largest region first. The points (M, 3) on the\n"
        "surface wide (rows + 4, columns + 4, 3) through the dots, which is extended by two nodes on each side; moments (R, 10) of the\n"
        "regions without their holes: area, vector area, integrals of x, y, z, and of xx, xy, yy; and the mean distance of neighbouring\n"
        "dots.");
    module.def(
        "region_axes", &axes, py::arg("sums"), py::arg("points"), py::arg("start"), py::kw_only(), py::arg("pitch"),
        "Full lengths of the ellipse of the same moments as a region, and its direction, rad, NaN where it is not significant: from\n"
        "integrals (6,) of 1, x, y, xx, xy, yy, and the points (M, 3) and starts (L + 1,) of its polygons.");
    module.def(
        "camera_rays", &rays_through, py::arg("uv"), py::kw_only(), py::arg("matrix"), py::arg("distortion"), py::arg("rotation"),
        py::arg("farthest"),
        "Unit vectors (N, 3) in the sensor frame through pixels uv (N, 2); NaN: the lens images nothing there.\n\n"
        "matrix: (3, 3) K, px; distortion: (5,) k1 k2 p1 p2 k3; rotation: (3, 3), camera from sensor; farthest: square of the normalised\n"
        "radius in the image beyond which the lens images nothing.");
    module.def(
        "back_project", &back_projected, py::arg("uv"), py::kw_only(), py::arg("matrix"), py::arg("distortion"), py::arg("rotation"),
        py::arg("centre"), py::arg("farthest"), py::arg("plane_z"),
        "(N, 3): x, y, m, where pixels uv (N, 2) lie in the plane at plane_z, m, and the area of a pixel there, m^2; NaN: nowhere.\n\n"
        "centre: (3,) m; the other arguments: as for camera_rays.");
}

}  // namespace tactile::border
