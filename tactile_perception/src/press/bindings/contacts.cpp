// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contacts from frame to frame, their region, and the depths of markers, for Python.
#include "bindings/bindings.hpp"

#include <pybind11/eigen.h>

#include <algorithm>
#include <array>

#include "bindings/border.hpp"
#include "press/contact_tracker.hpp"
#include "press/sheet_view.hpp"
#include "press/touch_region.hpp"

namespace tactile::border {
namespace {

constexpr py::ssize_t MOST_TOUCHES = 1000;  // of one frame. Chosen: beyond any method's, and their pairing stays quick

constexpr double LARGEST = 1e6;            // of positions, m, and of their covariances. Chosen: far outside any sensor

std::vector<press::Track> updated(press::ContactTracker& tracker, const py::object& values, const py::object& spreads, double elapsed) {
    const Input<double> value(values, "values", {ANY, press::MEASURED});
    const Input<double> spread(spreads, "spreads", {value.length(), press::MEASURED, press::MEASURED});
    within(value.length(), "values", 0, MOST_TOUCHES), within(elapsed, "elapsed", 0, 1e10);
    std::vector<press::Measurement> measured(value.length());
    for (py::ssize_t k = 0; k < value.length(); ++k) {
        measured[k].value = Eigen::Map<const Eigen::Vector4d>(value.data() + press::MEASURED * k);
        measured[k].covariance = Eigen::Map<const Eigen::Matrix4d>(spread.data() + press::MEASURED * press::MEASURED * k);
        if (!(measured[k].value.cwiseAbs().maxCoeff() <= LARGEST)) throw py::value_error("values: finite positions and depths are needed");
        if (!(measured[k].covariance.cwiseAbs().maxCoeff() <= LARGEST)) throw py::value_error("spreads: finite covariances are needed");
    }
    return change(tracker, [&](press::ContactTracker& next) { return next.update(measured, elapsed); });
}

void bind_tracker(py::module_& module) {
    py::class_<press::Track>(module, "Track", "A contact that is followed.")
        .def_readonly("id", &press::Track::id, "its number, from 1 on, never given again")
        .def_readonly("state", &press::Track::state, "(8,) position and depth, m, and their velocities")
        .def_readonly("covariance", &press::Track::covariance, "(8, 8) of the state");
    copyable(py::class_<press::ContactTracker>(
        module, "ContactTracker",
                                      "Contacts from frame to frame: numbers that stay, and a Kalman filter for each with constant velocity\n"
                                      "and white acceleration. acceleration: m/s^2, standard deviation; gate: squared Mahalanobis distance,\n"
                                      "largest of a measurement that continues a contact; speed: m/s, standard deviation of a new contact's\n"
                                      "velocity; most_missed: consecutive frames after which a contact has ended."))
        .def(py::init([](double acceleration, double gate, double speed, int most_missed) {
                 return press::ContactTracker({within(acceleration, "acceleration", 0, 1e6), within(gate, "gate", 1e-6, 1e6),
                                               within(speed, "speed", 0, 1e6), within(most_missed, "most_missed", 0, 1e9)});
             }),
             py::kw_only(), py::arg("acceleration"), py::arg("gate"), py::arg("speed"), py::arg("most_missed"))
        .def("update", &updated, py::arg("values"), py::arg("spreads"), py::arg("elapsed"),
             "The Track of each of E measurements, after elapsed s: positions and depths values (E, 4), m, with covariances spreads\n"
             "(E, 4, 4). Raises ValueError, and stays as it was, for numbers that are not finite.")
        .def("reset", &press::ContactTracker::reset, "End all contacts; their numbers are not given again.");
}

py::tuple found_region(const py::object& tips, const py::object& rest, const py::object& shift, const py::object& eye,
                       std::array<double, 2> size, double rim_radius, double height, double plane) {
    const Input<double> given(tips, "tips", {ANY, 5}), rests(rest, "rest", {ANY, 2});
    const Input<double> shifts(shift, "shift", {rests.length(), 2}), eyes(eye, "eye", {rests.length(), 3});
    within(given.length(), "tips", 0, MOST_TOUCHES);
    const ClampedSkin skin{{within(size[0], "size", 0, 100), within(size[1], "size", 0, 100)},
                           within(rim_radius, "rim_radius", 0, 100),
                           within(height, "height", 0, 100)};
    if (!(std::min(size[0], size[1]) > 0) && !(std::min(rim_radius, height) > 0)) throw py::value_error("size: or rim_radius and height");
    const py::ssize_t count = given.length();
    std::vector<ContactDisc> discs;
    std::vector<double> outlines(count * CORNERS * 3), numbers(count * 7);
    for (py::ssize_t k = 0; k < count; ++k) {
        const double* tip = given.data() + 5 * k;
        discs.push_back(contact_disc(skin, {{tip[0], tip[1], tip[2]}, tip[3], tip[4]}));
        disc_outline(discs[k], outlines.data() + CORNERS * 3 * k);
        const double disc[] = {discs[k].centre.x, discs[k].centre.y, discs[k].centre.z, discs[k].normal.x,
                               discs[k].normal.y, discs[k].normal.z, discs[k].radius};
        std::copy_n(disc, 7, numbers.begin() + 7 * k);
    }
    const MarkersUnder found =
        markers_under(discs, {rests.length(), rests.data(), shifts.data(), eyes.data(), within(plane, "plane", -100, 100)});
    return py::make_tuple(row_of(found.id), row_of(found.under), rows_of(numbers, 7), output(outlines, {count, CORNERS, 3}));
}

constexpr py::ssize_t MOST_MARKERS = 4000;  // of a sheet. Chosen: their matrices have 128 MB each

Eigen::VectorXd depths_of_sheet(const py::object& bending, const py::object& strain, const py::object& slope, const py::object& shift) {
    const Input<double> slopes(slope, "slope", {ANY, 2});
    const py::ssize_t markers = within(slopes.length(), "slope", 0, MOST_MARKERS);
    const Input<double> bends(bending, "bending", {markers, markers}), strains(strain, "strain", {markers, markers});
    const Input<double> moved(shift, "shift", {markers, 2});
    const auto map = [markers](const Input<double>& of, py::ssize_t columns) {
        return Eigen::Map<const Rows>(of.data(), markers, columns);
    };
    const SheetEnergies sheet{map(bends, markers), map(strains, markers)};
    return without_gil([&] { return sheet_depths(sheet, map(slopes, 2), map(moved, 2)); });
}

}  // namespace

void bind_touches(py::module_& module) {
    bind_tracker(module);
    module.def(
        "touch_region", &found_region, py::arg("tips"), py::arg("rest"), py::arg("shift"), py::arg("eye"), py::kw_only(), py::arg("size"),
        py::arg("rim_radius"), py::arg("height"), py::arg("plane"),
        "Numbers (N,) of the markers seen and whether each is under a tip (N,); contact discs (T, 7), centre, normal and radius, and\n"
        "their outlines (T, 36, 3), m, of round tips (T, 5): lowest point, depth and radius, m.\n\n"
        "rest, shift, eye: of a MarkerField; size, or rim_radius and height: of the sheet or dome; plane: height of the viewing plane.");
    module.def("sheet_depths", &depths_of_sheet, py::arg("bending"), py::arg("strain"), py::arg("slope"), py::arg("shift"),
               "Depths (K,), m, of a sheet's markers by displacements (K, 2), m, in the image; slope (K, 2) of their rays; bending and\n"
               "strain (K, K) of a SheetSurface. NaN where the equations have no solution.");
}

}  // namespace tactile::border
