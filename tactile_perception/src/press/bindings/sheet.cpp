// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels of sheets.
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

// The arrays of a SheetTable, checked: numbers (half, reach, scale, depth, spread, power, widening), sizes (n, order, levels, modes of each
// class), coefficients, shapes.
class Table {
 public:
    explicit Table(const py::tuple& given)
        : numbers_(part(given, 0), "table", {9}),
          sizes_(part(given, 1), "table", {7}),
          coefficients_(part(given, 2), "table", {ANY}),
          shapes_(part(given, 3), "table", {ANY}) {
        const double* x = numbers_.data();
        const std::int64_t* size = sizes_.data();
        for (int k = 0; k < 8; ++k) within(x[k], "table", 1e-6, LARGEST_PLACE_M);
        within(x[8], "table", 0, 1);
        for (int k = 0; k < 2; ++k) within(x[2 + k] / x[k], "table", 0, 0.9999);  // presses within the clamp
        table_ = {{x[0], x[1]}, {x[2], x[3]},         x[4],          x[5], x[6], x[7], x[8], size[0], size[1], size[2],
                  {},           coefficients_.data(), shapes_.data()};
        within(size[0], "table", 1, 100), within(size[1], "table", 1, 8), within(size[2], "table", 1, 1000);
        py::ssize_t coefficients = 0, shapes = 0;
        for (int c = 0; c < 4; ++c) {
            table_.modes[c] = within(size[3 + c], "table", 0, 10000);
            coefficients += TERMS * size[1] * size[1] * (size[2] + 3) * (size[3 + c] + WRENCH_COLUMNS[c]);
            shapes += size[3 + c] * 3 * (size[0] + 1) * (size[0] + 1);
        }
        if (coefficients_.length() != coefficients || shapes_.length() != shapes) throw py::value_error("table: the sizes do not agree");
    }
    const SheetTable& operator*() const { return table_; }

 private:
    static py::object part(const py::tuple& given, std::size_t k) {
        if (given.size() != 4) throw py::value_error("table: numbers, sizes, coefficients and shapes are needed");
        return given[k];
    }
    const Input<double> numbers_;
    const Input<std::int64_t> sizes_;
    const Input<float> coefficients_, shapes_;
    SheetTable table_;
};

// The arrays of SeenMarkers, checked.
class Markers {
 public:
    Markers(const py::object& rest, const py::object& eye, double radius)
        : rest_(rest, "rest", {ANY, 2}),
          eye_(eye, "eye", {rest_.length(), 3}),
          seen_{rest_.length(), rest_.data(), eye_.data(), nullptr, nullptr, nullptr, within(radius, "marker_radius", 0, 1)} {
        for (py::ssize_t k = 0; k < 2 * rest_.length(); ++k) within(rest_.data()[k], "rest", -LARGEST_PLACE_M, LARGEST_PLACE_M);
    }
    SeenMarkers with(const double* value, const double* sigma, const double* motion) const {
        return {seen_.count, seen_.rest, seen_.eye, value, sigma, motion, seen_.radius};
    }

 private:
    const Input<double> rest_, eye_;
    const SeenMarkers seen_;
};

Input<double> some_presses(const py::object& presses) {
    Input<double> given(presses, "presses", {ANY, PRESS_SIZE});
    within(given.length(), "presses", 1, MOST_PRESSES);
    for (py::ssize_t k = 0; k < PRESS_SIZE * given.length(); ++k) within(given.data()[k], "presses", -LARGEST_PLACE_M, LARGEST_PLACE_M);
    return given;
}

py::tuple fitted_presses(const py::tuple& table, const py::object& rest, const py::object& eye, const py::object& value,
                         const py::object& sigma, const py::object& motion, const py::object& presses, std::array<double, 6> noise,
                         std::array<double, 2> tip, double marker_radius, bool drags, double near) {
    const Table known(table);
    const Markers markers(rest, eye, marker_radius);
    const Input<double> start = some_presses(presses), places(rest, "rest", {ANY, 2});
    const Input<double> values(value, "value", {places.length(), 3}), sigmas(sigma, "sigma", {places.length()});
    const Input<double> motions(motion, "motion", {places.length(), 3});
    for (py::ssize_t k = 0; k < 3 * places.length(); ++k) within(motions.data()[k], "motion", -LARGEST_PLACE_M, LARGEST_PLACE_M);
    for (const double level : noise) within(level, "noise", 0, 1e6);
    within(noise[0], "noise", 1e-12, 1e6), within(noise[1], "noise", 1e-12, 1e6);
    const int count = static_cast<int>(start.length());
    within(tip[0], "tip", -10, 10), within(tip[1], "tip", 1e-6, 10), within(near, "near", 0, LARGEST_PLACE_M);
    const PressFit found = without_gil([&] {
        return fit_presses(*known, markers.with(values.data(), sigmas.data(), motions.data()),
                           {noise[0], noise[1], noise[2], noise[3], noise[4], noise[5]}, {tip[0], tip[1]}, start.data(), count, drags,
                           near);
    });
    const py::ssize_t states = count * PRESS_SIZE + (count > 1), size = found.free.size() - (found.free.back() >= states);
    std::vector<double> covariance(states * states, 0.0);
    for (py::ssize_t k = 0; k < size; ++k)
        for (py::ssize_t l = 0; l < size; ++l)
            covariance[found.free[k] * states + found.free[l]] = found.covariance[k * found.free.size() + l];
    return py::make_tuple(output(std::vector<double>(found.state, found.state + states), {states}), output(covariance, {states, states}),
                          found.misfit,
                          output(std::vector<double>(found.wrench[0], found.wrench[0] + count * WRENCH_SIZE), {count, WRENCH_SIZE}));
}

py::tuple shown_presses(const py::tuple& table, const py::object& rest, const py::object& eye, const py::object& presses, double mixed,
                        double marker_radius, double near) {
    const Table known(table);
    const Markers markers(rest, eye, marker_radius);
    const Input<double> given = some_presses(presses);
    const SeenMarkers seen = markers.with(nullptr, nullptr, nullptr);
    std::vector<double> shown(3 * seen.count), deformed(9 * seen.count);
    show_presses(*known, seen, given.data(), static_cast<int>(given.length()), within(mixed, "mixed", -10, 10),
                 within(near, "near", 0, LARGEST_PLACE_M), shown.data(), reinterpret_cast<double(*)[3][3]>(deformed.data()));
    return py::make_tuple(rows_of(shown), output(deformed, {seen.count, 3, 3}));
}

py::array_t<double> shown_field(const py::object& field, const py::object& rest, const py::object& eye, std::array<double, 2> place,
                                std::array<double, 2> half, double scale, double marker_radius) {
    const Input<float> splines(field, "field", {ANY, 3});
    const auto side = static_cast<py::ssize_t>(std::lround(std::sqrt(static_cast<double>(splines.length()))));
    if (side < 4 || side % 2 || side * side != splines.length()) throw py::value_error("field: side * side splines are needed, side even");
    const Markers markers(rest, eye, marker_radius);
    within(scale, "scale", 1e-6, LARGEST_PLACE_M);
    for (int k = 0; k < 2; ++k) within(half[k], "half", scale, LARGEST_PLACE_M), within(place[k], "place", -half[k], half[k]);
    const SheetTable table{{half[0], half[1]}, {half[0], half[1]}, scale, 1, 1, 1, 0, side / 2 - 1, 1, 1, {}, nullptr, nullptr};
    const SeenMarkers seen = markers.with(nullptr, nullptr, nullptr);
    std::vector<double> shown(3 * seen.count);
    show_field(table, seen, place.data(), splines.data(), shown.data());
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
    module.def("fit_presses", &fitted_presses, py::arg("table"), py::arg("rest"), py::arg("eye"), py::arg("value"), py::arg("sigma"),
               py::arg("motion"), py::arg("presses"), py::kw_only(), py::arg("noise"), py::arg("tip"), py::arg("marker_radius"),
               py::arg("drags"), py::arg("near"), "Presses that explain a marker field: see press/sheet/solver.py.");
    module.def("show_presses", &shown_presses, py::arg("table"), py::arg("rest"), py::arg("eye"), py::arg("presses"), py::kw_only(),
               py::arg("mixed"), py::arg("marker_radius"), py::arg("near"),
               "Shift, m, and growth (N, 3) of markers under presses, and the sheet's deformation there (N, 3, 3): see "
               "press/sheet/solver.py.");
    module.def("show_field", &shown_field, py::arg("field"), py::arg("rest"), py::arg("eye"), py::kw_only(), py::arg("place"),
               py::arg("half"), py::arg("scale"), py::arg("marker_radius"),
               "Shift, m, and growth (N, 3) of markers on a sheet with splines (side * side, 3), m: see press/sheet/projection.py.");
}

}  // namespace tactile::border
