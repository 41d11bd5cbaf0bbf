// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels that follow touches, and tell their region and the depths of markers.
#include <algorithm>
#include <array>

#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "press/sheet_depths.hpp"
#include "press/touch_filter.hpp"
#include "press/touch_region.hpp"

namespace tactile::border {
namespace {

constexpr py::ssize_t MOST_TOUCHES = 1000;  // of one frame. Chosen: beyond any method's, and their pairing stays quick

py::tuple followed_touches(const py::object& states, const py::object& covariances, const py::object& values, const py::object& spreads,
                           double elapsed, double acceleration, double gate) {
    const Input<double> state(states, "states", {ANY, STATE});
    const Input<double> covariance(covariances, "covariances", {state.length(), STATE, STATE});
    const Input<double> value(values, "values", {ANY, MEASURED});
    const Input<double> spread(spreads, "spreads", {value.length(), MEASURED, MEASURED});
    within(state.length(), "states", 0, MOST_TOUCHES), within(value.length(), "values", 0, MOST_TOUCHES);
    const TouchMotion motion{within(elapsed, "elapsed", 0, 1e10), within(acceleration, "acceleration", 0, 1e6),
                             within(gate, "gate", 1e-6, 1e6)};
    std::vector<TouchState> touches(state.length());
    for (py::ssize_t k = 0; k < state.length(); ++k) {
        std::copy_n(state.data() + STATE * k, STATE, touches[k].state.begin());
        std::copy_n(covariance.data() + STATE * STATE * k, STATE * STATE, touches[k].covariance.begin());
    }
    std::vector<TouchMeasurement> measured(value.length());
    for (py::ssize_t k = 0; k < value.length(); ++k) {
        std::copy_n(value.data() + MEASURED * k, MEASURED, measured[k].value.begin());
        std::copy_n(spread.data() + MEASURED * MEASURED * k, MEASURED * MEASURED, measured[k].covariance.begin());
    }
    std::vector<std::ptrdiff_t> continued;
    {
        py::gil_scoped_release others_run;
        continued = follow_touches(touches, measured, motion);
    }
    py::array_t<double> now({state.length(), static_cast<py::ssize_t>(STATE)});
    py::array_t<double> sure({state.length(), static_cast<py::ssize_t>(STATE), static_cast<py::ssize_t>(STATE)});
    for (py::ssize_t k = 0; k < state.length(); ++k) {
        std::copy(touches[k].state.begin(), touches[k].state.end(), now.mutable_data() + STATE * k);
        std::copy(touches[k].covariance.begin(), touches[k].covariance.end(), sure.mutable_data() + STATE * STATE * k);
    }
    return py::make_tuple(now, sure, output(std::vector<std::int64_t>(continued.begin(), continued.end()), {value.length()}));
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
    MarkersUnder found;
    {
        py::gil_scoped_release others_run;
        for (py::ssize_t k = 0; k < count; ++k) {
            const double* tip = given.data() + 5 * k;
            discs.push_back(contact_disc(skin, {{tip[0], tip[1], tip[2]}, tip[3], tip[4]}));
            disc_outline(discs[k], outlines.data() + CORNERS * 3 * k);
            const double disc[] = {discs[k].centre.x, discs[k].centre.y, discs[k].centre.z, discs[k].normal.x,
                                   discs[k].normal.y, discs[k].normal.z, discs[k].radius};
            std::copy_n(disc, 7, numbers.begin() + 7 * k);
        }
        found = markers_under(discs, {rests.length(), rests.data(), shifts.data(), eyes.data(), within(plane, "plane", -100, 100)});
    }
    const auto seen = static_cast<py::ssize_t>(found.id.size());
    return py::make_tuple(output(found.id, {seen}), output(found.under, {seen}), output(numbers, {count, 7}),
                          output(outlines, {count, CORNERS, 3}));
}

constexpr py::ssize_t MOST_MARKERS = 4000;  // of a sheet. Chosen: their matrices have 128 MB each

py::array_t<double> depths_of_sheet(const py::object& bending, const py::object& strain, const py::object& slope,
                                    const py::object& shifts) {
    const Input<double> slopes(slope, "slope", {ANY, 2});
    const py::ssize_t markers = within(slopes.length(), "slope", 0, MOST_MARKERS);
    const Input<double> bends(bending, "bending", {markers, markers}), strains(strain, "strain", {markers, markers});
    const Input<double> moved(shifts, "shifts", {ANY, markers, 2});
    py::array_t<double> depths({moved.length(), markers});
    double* found = depths.mutable_data();
    {
        py::gil_scoped_release others_run;
        sheet_depths({markers, bends.data(), strains.data()}, slopes.data(), moved.data(), moved.length(), found);
    }
    return depths;
}

}  // namespace

void bind_touches(py::module_& module) {
    module.def(
        "follow_touches", &followed_touches, py::arg("states"), py::arg("covariances"), py::arg("values"), py::arg("spreads"),
        py::kw_only(), py::arg("elapsed"), py::arg("acceleration"), py::arg("gate"),
        "States (T, 8) and covariances (T, 8, 8) of touches in the next frame, after elapsed s, with the measured places and depths\n"
        "values (E, 4), m, and their covariances spreads (E, 4, 4); and the touch that each continues (E,), -1 for none within gate.");
    module.def(
        "touch_region", &found_region, py::arg("tips"), py::arg("rest"), py::arg("shift"), py::arg("eye"), py::kw_only(), py::arg("size"),
        py::arg("rim_radius"), py::arg("height"), py::arg("plane"),
        "Numbers (N,) of the markers seen and whether each is under a tip (N,); contact discs (T, 7), centre, normal and radius, and\n"
        "their outlines (T, 36, 3), m, of round tips (T, 5): lowest point, depth and radius, m.\n\n"
        "rest, shift, eye: of a MarkerField; size, or rim_radius and height: of the sheet or dome; plane: height of the viewing plane.");
    module.def(
        "sheet_depths", &depths_of_sheet, py::arg("bending"), py::arg("strain"), py::arg("slope"), py::arg("shifts"),
        "Depths (M, K), m, of a sheet's markers by M displacements (M, K, 2), m, in the image; slope (K, 2) of their rays; bending and\n"
        "strain (K, K) of a SheetSurface. NaN where the equations have no solution.");
}

}  // namespace tactile::border
