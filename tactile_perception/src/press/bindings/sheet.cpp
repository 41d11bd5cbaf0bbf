// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels of sheets.
#include <pybind11/eigen.h>

#include <array>
#include <cmath>

#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "press/sheet_fit.hpp"
#include "press/sheet_membrane.hpp"

namespace tactile::border {
namespace {

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
    for (py::ssize_t k = 1; k < stops.length(); ++k)
        if (stops.data()[k] <= stops.data()[k - 1]) throw py::value_error("depths: each must be larger than the one before");
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
    std::vector<double> fields(count * values, NAN), wrenches(count * PRESS_WRENCH, NAN);
    without_gil([&] { press_sheet(sheet, load, stops.data(), count, fields.data(), wrenches.data()); });
    return py::make_tuple(output(fields, {count, values / 3, 3}), rows_of(wrenches, PRESS_WRENCH));
}

constexpr double LARGEST_PLACE_M = 10;  // m. Chosen: beyond any sheet

SheetTable made_table(const py::object& numbers, const py::object& sizes, const py::object& coefficients, const py::object& shapes) {
    const Input<double> number(numbers, "numbers", {9});
    const Input<std::int64_t> size(sizes, "sizes", {7});
    const Input<float> coefficient(coefficients, "coefficients", {ANY}), shape(shapes, "shapes", {ANY});
    const double* x = number.data();
    const std::int64_t* n = size.data();
    for (int k = 0; k < 8; ++k) within(x[k], "numbers", 1e-6, LARGEST_PLACE_M);
    within(x[8], "numbers", 0, 1);
    for (int k = 0; k < 2; ++k) within(x[2 + k] / x[k], "numbers", 0, 0.9999);  // presses within the clamp
    within(n[0], "sizes", 1, 100), within(n[1], "sizes", 1, 8), within(n[2], "sizes", 1, 1000);
    py::ssize_t count[2] = {};
    for (int c = 0; c < 4; ++c) {
        count[0] += TERMS * n[1] * n[1] * (n[2] + 3) * (within(n[3 + c], "sizes", 0, 10000) + WRENCH_COLUMNS[c]);
        count[1] += n[3 + c] * 3 * (n[0] + 1) * (n[0] + 1);
    }
    if (coefficient.length() != count[0]) throw py::value_error("coefficients: their number and sizes do not agree");
    if (shape.length() != count[1]) throw py::value_error("shapes: their number and sizes do not agree");
    return {{x[0], x[1]}, {x[2], x[3]}, x[4], x[5], x[6], x[7], x[8], n[0], n[1], n[2], {n[3], n[4], n[5], n[6]},
            std::vector<float>(coefficient.data(), coefficient.data() + count[0]),
            std::vector<float>(shape.data(), shape.data() + count[1])};
}

// The arrays of SeenMarkers, checked.
class Markers {
 public:
    Markers(const py::object& rest, const py::object& camera_centre, double radius)
        : rest_(rest, "rest", {ANY, 2}), camera_centre_(camera_centre, "camera_centre", {rest_.length(), 3}),
          radius_(within(radius, "marker_radius", 0, 1)) {
        for (py::ssize_t k = 0; k < 2 * count(); ++k) within(rest_.data()[k], "rest", -LARGEST_PLACE_M, LARGEST_PLACE_M);
    }
    py::ssize_t count() const { return rest_.length(); }
    SeenMarkers with(const double* value, const double* motion) const {
        return {count(), rest_.data(), camera_centre_.data(), value, motion, radius_};
    }

 private:
    const Input<double> rest_, camera_centre_;
    const double radius_;
};

Input<double> some_presses(const py::object& presses) {
    Input<double> given(presses, "presses", {ANY, PRESS_SIZE});
    within(given.length(), "presses", 1, MOST_PRESSES);
    for (py::ssize_t k = 0; k < PRESS_SIZE * given.length(); ++k) within(given.data()[k], "presses", -LARGEST_PLACE_M, LARGEST_PLACE_M);
    return given;
}

PressFit fitted_presses(const SheetTable& table, const py::object& rest, const py::object& camera_centre, const py::object& value,
                        const py::object& motion, const py::object& presses, std::array<double, 6> noise, std::array<double, 2> tip,
                        double marker_radius, bool drags, double near) {
    const Markers markers(rest, camera_centre, marker_radius);
    const Input<double> start = some_presses(presses), values(value, "value", {markers.count(), 3});
    const Input<double> motions(motion, "motion", {markers.count(), 3});
    for (py::ssize_t k = 0; k < 3 * markers.count(); ++k) within(motions.data()[k], "motion", -LARGEST_PLACE_M, LARGEST_PLACE_M);
    for (int k = 0; k < 6; ++k) within(noise[k], "noise", k < 2 ? 1e-12 : 0, 1e6);
    within(tip[0], "tip", -10, 10), within(tip[1], "tip", 1e-6, 10), within(near, "near", 0, LARGEST_PLACE_M);
    return without_gil([&] {
        return fit_presses(table, markers.with(values.data(), motions.data()),
                           {noise[0], noise[1], noise[2], noise[3], noise[4], noise[5]}, {tip[0], tip[1]}, start.data(),
                           static_cast<int>(start.length()), drags, near);
    });
}

py::tuple shown_presses(const SheetTable& table, const py::object& rest, const py::object& camera_centre, const py::object& presses, double mixed,
                        double marker_radius, double near) {
    const Markers markers(rest, camera_centre, marker_radius);
    const Input<double> given = some_presses(presses);
    std::vector<double> shown(3 * markers.count()), deformed(9 * markers.count());
    show_presses(table, markers.with(nullptr, nullptr), given.data(), static_cast<int>(given.length()), within(mixed, "mixed", -10, 10),
                 within(near, "near", 0, LARGEST_PLACE_M), shown.data(), reinterpret_cast<double(*)[3][3]>(deformed.data()));
    return py::make_tuple(rows_of(shown), output(deformed, {markers.count(), 3, 3}));
}

py::array_t<double> shown_field(const py::object& field, const py::object& rest, const py::object& camera_centre, std::array<double, 2> place,
                                std::array<double, 2> half, double scale, double marker_radius) {
    const Input<float> splines(field, "field", {ANY, 3});
    const auto side = static_cast<py::ssize_t>(std::lround(std::sqrt(static_cast<double>(splines.length()))));
    if (side < 4 || side % 2 || side * side != splines.length()) throw py::value_error("field: side * side splines are needed, side even");
    const Markers markers(rest, camera_centre, marker_radius);
    within(scale, "scale", 1e-6, LARGEST_PLACE_M);
    for (int k = 0; k < 2; ++k) within(half[k], "half", scale, LARGEST_PLACE_M), within(place[k], "place", -half[k], half[k]);
    const SheetTable table{{half[0], half[1]}, {half[0], half[1]}, scale, 1, 1, 1, 0, side / 2 - 1, 1, 1, {}, {}, {}};
    std::vector<double> shown(3 * markers.count());
    show_field(table, markers.with(nullptr, nullptr), place.data(), splines.data(), shown.data());
    return rows_of(shown);
}

}  // namespace

void bind_sheet(py::module_& module) {
    module.def(
        "press_sheet", &pressed_sheet, py::arg("value"), py::arg("slope"), py::arg("laplacian"), py::arg("weight"), py::arg("rest"),
        py::arg("depths"), py::kw_only(), py::arg("place"), py::arg("radius"), py::arg("prestretch"), py::arg("bending"),
        py::arg("friction"), py::arg("slides"), py::arg("drag"),
        "Displacements (D, side * side, 3), m, of a clamped sheet and wrenches (D, 9) of a round tip on it, at rising depths (D,), m:\n"
        "force and moment about the tip over shear modulus and thickness, m and m^2, and centre of the pressure relative to the tip, m.\n"
        "NaN from the first depth without equilibrium.\n\n"
        "value, slope, laplacian, weight, rest: of a SheetMesh; place: (2,) m; radius: m; slides: whether all of the contact slides with\n"
        "a traction of drag (2,) times the pressure, else the tip comes straight down with Coulomb friction.");
    module.def("show_field", &shown_field, py::arg("field"), py::arg("rest"), py::arg("camera_centre"), py::kw_only(), py::arg("place"),
               py::arg("half"), py::arg("scale"), py::arg("marker_radius"),
               "Shift, m, and growth (N, 3) of markers on a sheet with splines (side * side, 3), m: see press/sheet/library.py.");
    py::class_<PressFit>(module, "PressFit", "Presses that explain a frame of a sheet: see press/sheet/model.py:Inverse.")
        .def_readonly("state", &PressFit::state, "(6 T,) of the presses, and of two the factor of their interaction")
        .def_readonly("covariance", &PressFit::covariance, "of the state; 0 of what is known")
        .def_readonly("misfit", &PressFit::misfit, "mean squared normalised residual")
        .def_readonly("expected", &PressFit::expected, "what the doubt of drags makes of a misfit of 1")
        .def_readonly("wrenches", &PressFit::wrenches, "(T, 9)");
    copyable(py::class_<SheetTable>(module, "SheetTable",
                                    "Simulated presses on a sheet. numbers: half (2), reach (2), scale, depth, spread, power, widening;\n"
                                    "sizes: n, order, levels, modes of each class (4); coefficients, shapes: see\n"
                                    "src/press/sheet_library.hpp."))
        .def(py::init(&made_table), py::kw_only(), py::arg("numbers"), py::arg("sizes"), py::arg("coefficients"), py::arg("shapes"))
        .def("fit", &fitted_presses, py::arg("rest"), py::arg("camera_centre"), py::arg("value"), py::arg("motion"), py::arg("presses"),
             py::kw_only(), py::arg("noise"), py::arg("tip"), py::arg("marker_radius"), py::arg("drags"), py::arg("near"),
             "The PressFit to a marker field: see press/sheet/model.py.")
        .def("show", &shown_presses, py::arg("rest"), py::arg("camera_centre"), py::arg("presses"), py::kw_only(), py::arg("mixed"),
             py::arg("marker_radius"), py::arg("near"),
             "Shift, m, and growth (N, 3) of markers under presses, and the sheet's deformation there (N, 3, 3): see press/sheet/model.py.");
}

}  // namespace tactile::border
