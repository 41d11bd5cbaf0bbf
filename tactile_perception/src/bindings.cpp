// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels. Each function checks its arguments (border.hpp), releases the GIL, and returns new arrays.
#include "bindings.hpp"

#include <array>

#include "border.hpp"
#include "sheet_membrane.hpp"

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
    tactile::border::bind_contact(module);
    tactile::border::bind_dome(module);
    tactile::border::bind_finger(module);
    tactile::border::bind_taxels(module);
    tactile::border::bind_water(module);
}
