// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels. Each function checks its arguments (border.hpp), releases the GIL, and returns new arrays.
#include "bindings.hpp"

#include <array>

#include "border.hpp"
#include "ring_colour.hpp"
#include "sheet_membrane.hpp"
#include "water_ranges.hpp"

namespace py = pybind11;
using namespace tactile;
using tactile::border::ANY;
using tactile::border::Input;
using tactile::border::output;
using tactile::border::within;

namespace {

// Sheets.

py::tuple pressed_sheet(const py::object& value, const py::object& slope, const py::object& laplacian, const py::object& weight,
                        const py::object& rest, const py::object& depths, std::array<double, 2> place, double radius, double prestretch,
                        double bending, double friction, bool slides, std::array<double, 2> drag) {
    const Input<double> weights(weight, "weight", {ANY, 4});
    const auto spans = static_cast<py::ssize_t>(std::lround(std::sqrt(static_cast<double>(weights.length()))));
    if (spans < 2 || spans > 100 || spans * spans != weights.length()) throw py::value_error("weight: spans * spans elements are needed");
    const py::ssize_t elements = weights.length(), values = 3 * (spans + 2) * (spans + 2);
    const Input<double> values_(value, "value", {elements, 4, 9}), slopes(slope, "slope", {elements, 4, 2, 9});
    const Input<double> laplacians(laplacian, "laplacian", {elements, 4, 9}), rests(rest, "rest", {elements, 4, 2});
    const Input<double> stops(depths, "depths", {ANY});
    const SheetElements sheet{spans, values_.data(), slopes.data(), laplacians.data(), weights.data(), rests.data()};
    within(prestretch, "prestretch", 1, 3);
    const SheetLoad load{{place[0], place[1]},
                         within(radius, "radius", 1e-6, 1),
                         std::pow(prestretch, -6),
                         within(bending, "bending", 0, 1),
                         within(friction, "friction", 0, 10),
                         slides,
                         {within(drag[0], "drag", -10, 10), within(drag[1], "drag", -10, 10)}};
    const py::ssize_t count = stops.length();
    std::vector<double> fields(count * values, NAN), wrenches(count * 6, NAN);
    {
        py::gil_scoped_release others_run;
        press_sheet(sheet, load, stops.data(), count, fields.data(), wrenches.data());
    }
    return py::make_tuple(output(fields, {count, values / 3, 3}), output(wrenches, {count, 6}));
}

// Colour and range at the dots of a touchpad.
constexpr double LARGEST_RADIUS = 4096;  // px. Chosen: no ring is that large

py::tuple colours(const py::object& image, const py::object& uv, double radius) {
    const Input<std::uint8_t> pixels(image, "image", {ANY, ANY, 3});
    const Input<double> places(uv, "uv", {ANY, 2});
    within(radius, "radius", 0, LARGEST_RADIUS);
    RingColours found;
    {
        py::gil_scoped_release others_run;
        found = ring_colours({pixels.data(), pixels.length(0), pixels.length(1)}, places.data(), places.length(), radius);
    }
    const py::ssize_t count = places.length();
    return py::make_tuple(output(found.ratios, {count, 2}), output(found.brightness, {count}), output(found.count, {count}),
                          output(found.patchiness, {count}));
}

LightPath as_path(const Input<double>& path) {
    const double* given = path.data();
    return {given[0], given[1], given[2], given[3], {given[4], given[5], given[6]}};
}

py::tuple path_lengths(const py::object& path, const py::object& places, const py::object& normals, const py::object& rays) {
    const Input<double> light(path, "path", {7}), at(places, "places", {ANY, 3});
    const py::ssize_t count = at.length();
    const Input<double> facing(normals, "normals", {count, 3}), along(rays, "rays", {count, 3});
    std::vector<double> metres(count), slopes(count);
    {
        py::gil_scoped_release others_run;
        const LightPath way = as_path(light);
        for (py::ssize_t k = 0; k < count; ++k) {
            const Vector place = vector_at(at.data(), k), ray = vector_at(along.data(), k);
            const Length found = length_at(way, place[2], ray[2], incidence(way, place, vector_at(facing.data(), k), ray));
            metres[k] = found.metres;
            slopes[k] = found.slope;
        }
    }
    return py::make_tuple(output(metres, {count}), output(slopes, {count}));
}

py::tuple ranges(const py::object& path, const py::object& lengths, const py::object& rays, const py::object& id,
                 const py::object& rest_ranges, const py::object& rest_normals, py::ssize_t rows, py::ssize_t columns, double ring_share) {
    const Input<double> light(path, "path", {7}), metres(lengths, "lengths", {ANY});
    const py::ssize_t count = metres.length();
    const Input<double> along(rays, "rays", {count, 3}), rest(rest_ranges, "rest_ranges", {count}),
        facing(rest_normals, "rest_normals", {count, 3});
    const Input<std::int64_t> numbers(id, "id", {count});
    within(rows, "rows", 0, 4096);
    within(columns, "columns", 0, 4096);
    within(ring_share, "ring_share", 0, 10);
    const bool grid = rows > 2 && columns > 2;
    for (py::ssize_t k = 0; grid && k < count; ++k) within(numbers.data()[k], "id", 0, rows * columns - 1);
    WaterRanges found;
    {
        py::gil_scoped_release others_run;
        found = water_ranges(as_path(light), {numbers.data(), along.data(), rest.data(), facing.data(), count, rows, columns},
                             metres.data(), ring_share);
    }
    return py::make_tuple(output(found.ranges, {count}), output(found.slopes, {count}));
}

}  // namespace

PYBIND11_MODULE(_core, module) {
    module.doc() = "Compiled kernels of tactile_perception: arrays in, arrays out. A wrong argument raises ValueError with its name.";
    tactile::border::bind_dots(module);
    module.def(
        "press_sheet", &pressed_sheet, py::arg("value"), py::arg("slope"), py::arg("laplacian"), py::arg("weight"), py::arg("rest"),
        py::arg("depths"), py::kw_only(), py::arg("place"), py::arg("radius"), py::arg("prestretch"), py::arg("bending"),
        py::arg("friction"), py::arg("slides"), py::arg("drag"),
        "Displacements (D, side * side, 3), m, of a clamped sheet and wrenches (D, 6) over shear modulus and thickness, m and m^2, of\n"
        "a round tip on it, moments about the tip, at rising depths (D,), m; NaN from the first without equilibrium.\n\n"
        "value, slope, laplacian, weight, rest: of a SheetMesh; place: (2,) m; radius: m; slides: whether all of the contact slides with\n"
        "a traction of drag (2,) times the pressure, else the tip comes straight down with Coulomb friction.");
    module.def(
        "ring_colours", &colours, py::arg("image"), py::arg("uv"), py::arg("radius"),
        "Background around dots at uv (N, 2) float64, px, in an image (H, W, 3) uint8, blue, green, red, on rings of radius px: ratios\n"
        "(N, 2) ln(blue / red), ln(green / red); brightness (N,) ln(red); count (N,) of 16 ring points used; patchiness (N,).");
    module.def(
        "path_lengths", &path_lengths, py::arg("path"), py::arg("places"), py::arg("normals"), py::arg("rays"),
        "Lengths (N,), m, of the light's path in the water to places (N, 3), m, and their derivatives (N,) along unit rays (N, 3).\n\n"
        "path: (7,) window_z, lamp_z, lamp_radius, m, ambient, and the camera's centre, m; normals: (N, 3), unit, outward.");
    module.def(
        "water_ranges", &ranges, py::arg("path"), py::arg("lengths"), py::kw_only(), py::arg("rays"), py::arg("id"), py::arg("rest_ranges"),
        py::arg("rest_normals"), py::arg("rows"), py::arg("columns"), py::arg("ring_share"),
        "Ranges (N,), m, at which the light's paths have the lengths (N,), m, and the lengths' derivatives (N,) there.\n\n"
        "path: as for path_lengths; rays: (N, 3), unit; id: (N,) int64, of the dots on the grid of rows x columns; rest_ranges (N,), m,\n"
        "rest_normals (N, 3), unit: at rest; ring_share: radius of the ring around a dot whose mean a length is, over the dots' pitch.");
    tactile::border::bind_contact(module);
    tactile::border::bind_dome(module);
    tactile::border::bind_finger(module);
    tactile::border::bind_taxels(module);
}
