// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels of contact regions: outlines, moments, the contact's point; see bindings.cpp.
#include <algorithm>
#include <limits>

#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "common/all_within.hpp"
#include "common/grid_normals.hpp"
#include "common/outlines.hpp"
#include "common/planar_twist.hpp"
#include "common/point_shapes.hpp"
#include "common/region_moments.hpp"
#include "touchpad/contact/region_contact.hpp"

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

py::array_t<double> surface_points(const py::object& wide, const py::object& places) {
    const Input<double> surface(wide, "wide", {ANY, ANY, 3}), given(places, "places", {ANY, 2});
    const Nodes nodes = wide_surface(surface);
    std::vector<double> found(3 * given.length());
    for (py::ssize_t i = 0; i < given.length(); ++i) {
        store(found.data(), i, surface_point(nodes, given.data()[2 * i], given.data()[2 * i + 1]));
    }
    return output(found, {given.length(), 3});
}

py::array_t<double> normals_of(const py::object& xyz) {
    const Input<double> given(xyz, "xyz", {ANY, ANY, 3});
    std::vector<double> found;
    {
        py::gil_scoped_release others_run;
        found = grid_normals(given.data(), given.length(), given.length(1));
    }
    return output(found, {given.length(), given.length(1), 3});
}

py::tuple loops_output(const Loops& loops) {
    return py::make_tuple(output(loops.places, {static_cast<py::ssize_t>(loops.places.size()) / 2, 2}),
                          output(loops.start, {static_cast<py::ssize_t>(loops.start.size())}),
                          output(loops.region, {static_cast<py::ssize_t>(loops.region.size())}));
}

void check_starts(const Input<std::int64_t>& start, py::ssize_t count) {
    for (py::ssize_t k = 0; k < start.length(); ++k) {
        const bool last = k + 1 == start.length();
        if ((k == 0 && start.data()[k] != 0) || (last ? start.data()[k] != count : start.data()[k] >= start.data()[k + 1]))
            throw py::value_error("start: rising numbers from 0 to the number of vertices are needed");
    }
}

py::tuple contours(const py::object& field, double level) {
    const Input<double> given(field, "field", {ANY, ANY});
    within(given.length() * given.length(1), "field", 1, 100.0 * MOST);
    Loops found;
    {
        py::gil_scoped_release others_run;
        found = find_contours(given.data(), given.length(), given.length(1), level);
    }
    return loops_output(found);
}

py::tuple outlines(const py::object& score, const py::object& wide, double level, double ceiling, int refine) {
    const Input<double> given(score, "score", {ANY, ANY}), surface(wide, "wide", {ANY, ANY, 3});
    const Nodes nodes = wide_surface(surface);
    if (given.length() != nodes.rows - 2 * BEYOND || given.length(1) != nodes.columns - 2 * BEYOND)
        throw py::value_error("score: two nodes less on each side than of wide are needed");
    within(refine, "refine", 1, FINEST);
    within(level, "level", 1e-9, within(ceiling, "ceiling", 0, 1e9));
    Loops found;
    std::vector<double> points;
    RegionMoments moments;
    py::ssize_t regions = 0;
    {
        py::gil_scoped_release others_run;
        found = find_outlines(given.data(), given.length(), given.length(1), level, ceiling, refine);
        points = points_of(found, nodes, refine);
        regions = found.region.empty() ? 0 : found.region.back() + 1;
        moments = region_moments(found, regions, nodes, refine);
    }
    return loops_output(found) + py::make_tuple(output(points, {static_cast<py::ssize_t>(points.size()) / 3, 3}),
                                                output(moments.of, {regions, MOMENTS}), moments.pitch);
}

py::array_t<double> axes(const py::object& sums, const py::object& points, const py::object& start, double pitch) {
    const Input<double> total(sums, "sums", {6}), border(points, "points", {ANY, 3});
    const Input<std::int64_t> first(start, "start", {ANY});
    within(pitch, "pitch", 0, LARGEST_SIZE);
    within(first.length(), "start", 1, 1e9);
    check_starts(first, border.length());
    return output(region_axes(total.data(), border.data(), first.data(), first.length() - 1, pitch), {3});
}

// The contact in a region.
Vec3 vector_of(const py::object& given, const char* name) {
    return vec3_at(Input<double>(given, name, {3}).data(), 0);
}

py::tuple contact_of(const py::object& id, const py::object& places, const py::object& inside, const py::object& touched,
                     const py::object& force, const py::object& border, const py::object& start, const py::object& wide,
                     const py::object& centroid, const py::object& normal, std::ptrdiff_t rows, std::ptrdiff_t columns, double area,
                     double pitch, double sigma, double centre_z, double radius) {
    const Input<std::int64_t> numbers(id, "id", {ANY}), first(start, "start", {ANY});
    const py::ssize_t count = numbers.length();
    const Input<double> dots(places, "places", {count, 3}), sides(border, "border", {ANY, 3}), surface(wide, "wide", {ANY, ANY, 3});
    const Input<bool> members(inside, "inside", {count}), held(touched, "touched", {count});
    const Input<double> pushed(force, "force", {ANY, 3});
    const Grid grid{within<std::ptrdiff_t>(rows, "rows", 1, MOST), within<std::ptrdiff_t>(columns, "columns", 1, MOST)};
    within(grid.size(), "rows * columns", 1, MOST);
    if (pushed.length() != grid.size() && pushed.length() != 0) {
        throw py::value_error("force: a row for each dot of the grid, or none, is needed");
    }
    for (py::ssize_t i = 0; i < count; ++i) within(numbers.data()[i], "id", 0, static_cast<double>(grid.size() - 1));
    within(first.length(), "start", 1, 1e9);
    check_starts(first, sides.length());
    const Nodes nodes = wide_surface(surface);
    const RegionShape shape{vector_of(centroid, "centroid"),
                            vector_of(normal, "normal"),
                            within(area, "area", 0, LARGEST_SIZE),
                            sides.data(),
                            first.data(),
                            first.length() - 1,
                            within(pitch, "pitch", 1 / LARGEST_SIZE, LARGEST_SIZE)};
    const RestCap rest{within(centre_z, "centre_z", -LARGEST_SIZE, LARGEST_SIZE), radius};
    RegionContact found;
    {
        py::gil_scoped_release others_run;
        const double* forces = pushed.length() ? pushed.data() : nullptr;
        found = region_contact({grid, numbers.data(), dots.data(), forces, members.data(), held.data(), count}, shape, nodes, rest, sigma);
    }
    const std::array<double, 3> position{found.place.position.x, found.place.position.y, found.place.position.z};
    const std::array<double, 3> up{found.place.normal.x, found.place.normal.y, found.place.normal.z};
    return py::make_tuple(output(position, {3}), output(found.place.covariance, {3, 3}), output(up, {3}), found.depth, found.force);
}

bool on_a_line(const py::object& points, double thinnest) {
    const Input<double> given(points, "points", {ANY, 3});
    return lie_on_a_line(given.data(), given.length(), within(thinnest, "thinnest", 0, 1));
}

double notch(const py::object& corners) {
    const Input<double> given(corners, "corners", {ANY, 2});
    check_places(given, "corners");
    return deepest_notch(given.data(), given.length());
}

py::tuple twist(const py::object& place, const py::object& velocity, double far) {
    const Input<double> places(place, "place", {ANY, 2}), velocities(velocity, "velocity", {places.length(), 2});
    const PlanarTwist found = planar_twist(places.data(), velocities.data(), places.length(), within(far, "far", 0, LARGEST_SIZE));
    return py::make_tuple(output(found.linear, {2}), found.turn, output(found.centre, {2}));
}

bool none_beyond(const py::object& values, double most) {
    const char* needed = "values: an array of float64 with up to three dimensions is needed";
    if (!py::isinstance<py::array_t<double>>(values) || py::array(values).ndim() > 3) throw py::value_error(needed);
    const auto given = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(values);
    if (!given) throw py::error_already_set();
    return all_within(given.data(), given.size(), most);
}

}  // namespace

void bind_region(py::module_& module) {
    module.def(
        "grid_normals", &normals_of, py::arg("xyz"),
        "Unit normals (rows, columns, 3), out of the sensor, of the surface through xyz (rows, columns, 3), m; NaN without neighbours.");
    module.def(
        "extend_surface", &wide_of, py::arg("xyz"),
        "xyz (rows, columns, 3) with two nodes more on each side (rows + 4, columns + 4, 3), extrapolated linearly from the last two.");
    module.def(
        "surface_points", &surface_points, py::arg("wide"), py::arg("places"),
        "Points (M, 3) at places (M, 2) of (row, column), up to a node off the grid, of the surface wide (rows + 4, columns + 4, 3)\n"
        "through dots, which is extended by two nodes on each side.");
    module.def(
        "find_contours", &contours, py::arg("field"), py::kw_only(), py::arg("level"),
        "Closed polygons along which field (rows, columns) float64 crosses level: vertices (M, 2) of (row, column), the first vertex\n"
        "of each polygon and M, (L + 1,), and its region (L,): each region's outline, then its holes; the largest region first.");
    module.def(
        "find_outlines", &outlines, py::arg("score"), py::arg("wide"), py::kw_only(), py::arg("level"), py::arg("ceiling"),
        py::arg("refine"),
        "The same of score (rows, columns) float64, clipped to 0 and ceiling, with refine steps a node, and the points (M, 3) on the\n"
        "surface wide (rows + 4, columns + 4, 3) through the dots, which is extended by two nodes on each side; moments (R, 10) of the\n"
        "regions without their holes: area, vector area, integrals of x, y, z, and of xx, xy, yy; and the mean distance of neighbouring\n"
        "dots.");
    module.def(
        "region_axes", &axes, py::arg("sums"), py::arg("points"), py::arg("start"), py::kw_only(), py::arg("pitch"),
        "Full lengths of the ellipse of the same moments as a region, and its direction, rad, NaN where it is not significant: from\n"
        "integrals (6,) of 1, x, y, xx, xy, yy, and the points (M, 3) and starts (L + 1,) of its polygons.");
    module.def("region_contact", &contact_of, py::arg("id"), py::arg("places"), py::arg("inside"), py::arg("touched"), py::arg("force"),
               py::arg("border"), py::arg("start"), py::arg("wide"), py::arg("centroid"), py::arg("normal"), py::kw_only(), py::arg("rows"),
               py::arg("columns"), py::arg("area"), py::arg("pitch"), py::arg("sigma"), py::arg("centre_z"), py::arg("radius"),
               "Contact point (3,), m, its covariance (3, 3), m^2, the normal (3,) of the surface wide there, depth, m, and force, N, of a "
               "region\n"
               "whose dots are inside (N,) bool; touched (N,) bool: in this or another one; id (N,) int64, places (N, 3), m, of standard\n"
               "deviation sigma; force (K, 3), N, of carried_loads, or (0, 3); border (M, 3), start (L + 1,): of its polygons. The\n"
               "surface at rest is a sphere's upper half. NaN: unknown.");
    module.def("lie_on_a_line", &on_a_line, py::arg("points"), py::kw_only(), py::arg("thinnest"),
               "Whether the second largest extent of points (N, 3) is less than this share of the largest one.");
    module.def("deepest_notch", &notch, py::arg("corners"),
               "Largest distance of one of a polygon's corners (M, 2) from the side of the convex hull that spans it.");
    module.def("all_within", &none_beyond, py::arg("values"), py::kw_only(), py::arg("most") = std::numeric_limits<double>::max(),
               "Whether no number of values, with up to three dimensions, is NaN or beyond most, by default none that is finite is.");
    module.def("planar_twist", &twist, py::arg("place"), py::arg("velocity"), py::kw_only(), py::arg("far"),
               "Velocity (2,) at the origin, angular velocity, and centre of rotation (2,), NaN for a translation, of velocity (N, 2) at\n"
               "place (N, 2), by least squares; all NaN for coincident or NaN places. far: radii of the places from which a centre counts\n"
               "as that of a translation.");
}

}  // namespace tactile::border
