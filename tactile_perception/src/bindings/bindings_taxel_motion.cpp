// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels that follow an object on a taxel array, in the manner of bindings.cpp.
#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "bindings/taxel_bounds.hpp"
#include "taxel/taxel_load.hpp"
#include "taxel/taxel_motion.hpp"
#include "taxel/taxel_registration.hpp"
#include "taxel/taxel_shear.hpp"
#include "taxel/taxel_traction.hpp"

namespace tactile::border {
namespace {

py::tuple edges_of_taxels(const py::object& pressure, double scale, double steep, int rim, int most) {
    const Input<float> given(pressure, "pressure", {ANY, ANY});
    within(scale, "scale", 0, 1e30);
    within(steep, "steep", 1e-6, 1e6);
    within(rim, "rim", 0, MOST_TAXELS);
    within(most, "most", 1, LONGEST);
    Edges found;
    {
        py::gil_scoped_release others_run;
        found = edges_of({given.data(), given.length(0), given.length(1), static_cast<float>(scale)}, steep, rim, most);
    }
    const auto used = static_cast<py::ssize_t>(found.value.size());
    return py::make_tuple(output(found.place, {used, 2}), output(found.value, {used}), output(found.slopes, {used, 4}),
                          output(std::vector<double>(found.normal.begin(), found.normal.end()), {4, 4}),
                          output(std::vector<double>(found.middle.begin(), found.middle.end()), {2}), found.reach, found.count);
}

py::tuple register_taxels(const py::object& pressure, const py::object& place, const py::object& value, const py::object& slopes,
                          const py::object& middle, double reach, double scale, bool turns, const py::object& guess) {
    const Input<float> given(pressure, "pressure", {ANY, ANY});
    const Input<double> at(place, "place", {ANY, 2}), there(value, "value", {at.length()}), sloping(slopes, "slopes", {at.length(), 4});
    const Input<double> centre(middle, "middle", {2}), start(guess, "guess", {4});
    within(reach, "reach", 1e-6, LONGEST);
    within(scale, "scale", 0, 1e30);
    within(given.length(0), "pressure", 1, MOST_TAXELS);
    within(given.length(1), "pressure", 1, MOST_TAXELS);
    Registered found;
    {
        py::gil_scoped_release others_run;
        const double *m = centre.data(), *g = start.data();
        found = registered({given.data(), given.length(0), given.length(1), static_cast<float>(scale)}, at.data(), there.data(),
                           sloping.data(), at.length(), {m[0], m[1]}, reach, turns, {g[0], g[1], g[2], g[3]});
    }
    return py::make_tuple(output(std::vector<double>(found.fit.begin(), found.fit.end()), {4}), found.spread, found.inliers);
}

py::tuple move_taxels(const py::object& drag, const py::object& touched, const py::object& pressure, const py::object& shift, double pitch,
                      double thickness, double coupling, double limit, double on_top, double sharp) {
    const Input<float> dragged(drag, "drag", {2, ANY, ANY});
    const py::ssize_t rows = dragged.length(1), columns = dragged.length(2);
    const Input<bool> contact(touched, "touched", {rows, columns});
    const Input<float> pressed(pressure, "pressure", {rows, columns});
    const Input<double> motion(shift, "shift", {3});
    within(pitch, "pitch", 1e-9, LONGEST);
    within(thickness, "thickness", 0, MOST_TAXELS);
    within(sharp, "sharp", 1e-3, MOST_TAXELS);
    for (const double number : {coupling, limit, on_top}) within(number, "coupling, limit, on_top", 0, 1e30);
    Sheared found;
    {
        py::gil_scoped_release others_run;
        const double* m = motion.data();
        found = moved({rows, columns, pitch, thickness, coupling, limit, on_top, sharp}, dragged.data(),
                      reinterpret_cast<const std::uint8_t*>(contact.data()), pressed.data(), {m[0], m[1], m[2]});
    }
    return py::make_tuple(kept(std::move(found.drag), {2, rows, columns}), kept(std::move(found.pull), {2, rows, columns}),
                          kept(std::move(found.slip), {2, rows, columns}),
                          output(std::vector<double>{found.pulled[0], found.pulled[1]}, {2}));
}

Spread spread_of(const double* row) {
    return {row[0], within(row[1], "spreads", 1e-3, MOST_TAXELS)};
}

py::array_t<float> pull_of_taxels(const py::object& pull, double gain, const py::object& spreads) {
    const Input<float> pulled(pull, "pull", {2, ANY, ANY});
    const Input<double> wide(spreads, "spreads", {2, 2});
    within(gain, "gain", -1e30, 1e30);
    const Spread both[2] = {spread_of(wide.data()), spread_of(wide.data() + 2)};
    std::vector<float> found;
    {
        py::gil_scoped_release others_run;
        found = pressure_of_pull(pulled.data(), pulled.length(1), pulled.length(2), gain, both);
    }
    return kept(std::move(found), {pulled.length(1), pulled.length(2)});
}

py::array_t<bool> lagging_taxels(const std::vector<py::object>& slips, const py::object& touched, const py::object& motion, double pitch,
                                 double part) {
    const Input<bool> contact(touched, "touched", {ANY, ANY});
    const py::ssize_t rows = contact.length(0), columns = contact.length(1);
    const Input<double> moved(motion, "motion", {3});
    within(pitch, "pitch", 1e-9, LONGEST);
    within(part, "part", 0, 1);
    std::vector<Input<float>> each;
    std::vector<const float*> data;
    for (const py::object& slip : slips) each.emplace_back(slip, "slips", std::initializer_list<py::ssize_t>{2, rows, columns});
    for (const Input<float>& one : each) data.push_back(one.data());
    std::vector<std::uint8_t> found;
    {
        py::gil_scoped_release others_run;
        const double* m = moved.data();
        found = lagging(data, marks(contact), rows, columns, pitch, {m[0], m[1], m[2]}, part);
    }
    return mask_of(found, rows, columns);
}

py::tuple fit_traction(const py::object& before, const py::object& touched, int reach, double thickness, const py::object& spreads) {
    const Input<float> picture(before, "before", {ANY, ANY});
    const py::ssize_t rows = picture.length(0), columns = picture.length(1);
    const Input<bool> contact(touched, "touched", {rows, columns});
    const Input<double> wide(spreads, "spreads", {2, 2});
    within(reach, "reach", 0, MOST_TAXELS);
    within(thickness, "thickness", 0, MOST_TAXELS);
    const Spread both[2] = {spread_of(wide.data()), spread_of(wide.data() + 2)};
    TractionFit found;
    {
        py::gil_scoped_release others_run;
        found = traction_fit(picture.data(), marks(contact), rows, columns, reach, thickness, both);
    }
    return py::make_tuple(kept(std::move(found.share), {found.box.rows(), found.box.columns(), 4}), found.box.top, found.box.left,
                          found.square);
}

py::tuple traction_of_taxels(const py::object& share, const py::object& pressure, const py::object& before, py::ssize_t top,
                             py::ssize_t left) {
    const Input<float> shares(share, "share", {ANY, ANY, 4}), pressed(pressure, "pressure", {ANY, ANY});
    const py::ssize_t rows = pressed.length(0), columns = pressed.length(1);
    const Input<float> picture(before, "before", {rows, columns});
    within(shares.length(0), "share", 0, static_cast<double>(rows));
    within(shares.length(1), "share", 0, static_cast<double>(columns));
    within(top, "top", 0, static_cast<double>(rows - shares.length(0)));
    within(left, "left", 0, static_cast<double>(columns - shares.length(1)));
    std::array<double, 4> found;
    {
        py::gil_scoped_release others_run;
        found = traction_seen(shares.data(), {top, left, top + shares.length(0), left + shares.length(1)}, pressed.data(), picture.data(),
                              columns);
    }
    return py::make_tuple(found[0], found[1], found[2], found[3]);
}

py::tuple motion_of_object(const py::object& past, const py::object& now, double window, double reported, int fewest, int latest,
                           const std::array<double, 2>& arm, double reach, double least, double bound) {
    const Input<double> frames(past, "past", {ANY, 4}), last(now, "now", {4});
    within(window, "window", 0, LONGEST);
    within(reported, "reported", 0, LONGEST);
    within(fewest, "fewest", 2, LONGEST);
    within(latest, "latest", 1, LONGEST);
    within(reach, "reach", 1e-12, LONGEST);
    within(least, "least", 0, 1e30);
    within(bound, "bound", 0, 1e30);
    ObjectMotion found;
    {
        py::gil_scoped_release others_run;
        std::vector<PastFrame> earlier(frames.length());
        for (std::size_t k = 0; k < earlier.size(); ++k) std::copy_n(frames.data() + 4 * k, 4, earlier[k].begin());
        PastFrame here;
        std::copy_n(last.data(), 4, here.begin());
        found = object_motion(earlier.data(), frames.length(), here, {window, reported, fewest, latest, arm, reach, least, bound});
    }
    py::array_t<double> held({static_cast<py::ssize_t>(found.past.size()), py::ssize_t{4}});
    std::copy_n(found.past[0].data(), 4 * found.past.size(), held.mutable_data());
    return py::make_tuple(held, output(found.place, {3}), output(found.velocity, {3}), output(found.reported, {3}), found.noise,
                          found.speed, found.sigma, found.lasting, found.used, found.expected, found.went);
}

}  // namespace

void bind_taxel_motion(py::module_& module) {
    module.def(
        "taxel_edges", &edges_of_taxels, py::arg("pressure"), py::kw_only(), py::arg("scale"), py::arg("steep"), py::arg("rim"),
        py::arg("most"),
        "Edge taxels of the image that is positive pressure (rows, columns) float32 times scale: places (M, 2) row and column, values "
        "(M,), slopes (M, 4) by shift along\n"
        "columns and rows, turn times reach, growth; and of all edge taxels, also those left out: sums of products of the slopes (4, 4),\n"
        "middle (2,) row and column, reach, taxels, and their number. steep: 1/taxel, least slope; rim: taxels at the array's border\n"
        "that are ignored; most: about how many are used.");
    module.def(
        "taxel_register", &register_taxels, py::arg("pressure"), py::arg("place"), py::arg("value"), py::arg("slopes"), py::arg("middle"),
        py::arg("reach"), py::kw_only(), py::arg("scale"), py::arg("turns"), py::arg("guess"),
        "Motion of edges (taxel_edges) to the image that is positive pressure (rows, columns) float32 times scale: fit (4,) shift along "
        "columns and rows, turn times reach,\n"
        "growth, taxels; standard deviation of the residuals; share of inliers. turns: whether a turn is fitted; guess: (4,) to begin "
        "with.");
    module.def(
        "taxel_move", &move_taxels, py::arg("drag"), py::arg("touched"), py::arg("pressure"), py::arg("shift"), py::kw_only(),
        py::arg("pitch"), py::arg("thickness"), py::arg("coupling"), py::arg("limit"), py::arg("on_top"), py::arg("sharp"),
        "Displacement of the pad's surface, traction over shear stiffness, and slip, (2, rows, columns) float32 m each, and sums (2,) of "
        "the\n"
        "traction, after an object moved by shift (3,): m, m at the origin, rad. drag: displacement before; touched: (rows, columns) bool; "
        "pressure: (rows, "
        "columns)\n"
        "float32 Pa; pitch: m; thickness: taxels; coupling: of neighbours; limit: m/Pa, friction over shear stiffness; on_top, sharp: "
        "share\n"
        "and width, taxels, of the unsharp mask that gives the pressure on the pad's surface.");
    module.def(
        "taxel_pull_pressure", &pull_of_taxels, py::arg("pull"), py::kw_only(), py::arg("gain"), py::arg("spreads"),
        "Pressure (rows, columns) float32 under a pad by the convergence of pull (2, rows, columns) float32, times gain; spreads: (2, 2)\n"
        "share and width, taxels, of each Gaussian that spreads it.");
    module.def("taxel_lagging", &lagging_taxels, py::arg("slips"), py::arg("touched"), py::arg("motion"), py::kw_only(), py::arg("pitch"),
               py::arg("part"),
               "Touched (rows, columns) bool taxels where slips, a list of (2, rows, columns) float32 m, sum up to more than part of the "
               "object's\n"
               "motion (3,), m at the origin and rad; pitch: m.");
    module.def(
        "taxel_traction_fit", &fit_traction, py::arg("before"), py::arg("touched"), py::kw_only(), py::arg("reach"), py::arg("thickness"),
        py::arg("spreads"),
        "Least squares of a picture by one before (rows, columns) float32: by its slopes, the pressure of an even traction under the\n"
        "touched (rows, columns) bool, turn, growth and load, within reach taxels of the touched. The share (R, C, 4) float32 of each\n"
        "change of a taxel in the shift along columns and rows, taxels, and in the traction along both, over pressure; the first row and\n"
        "column of these taxels; and the variance of the traction for noise of 1. thickness: taxels, of the pad; spreads: (2, 2) share\n"
        "and width, taxels, of each Gaussian that spreads the pressure that traction causes.");
    module.def(
        "taxel_traction", &traction_of_taxels, py::arg("share"), py::arg("pressure"), py::arg("before"), py::kw_only(), py::arg("top"),
        py::arg("left"),
        "Shift along columns and rows, taxels, and traction along both, over pressure, of pressure (rows, columns) float32 since the\n"
        "picture before, by the share (R, C, 4) float32 of taxel_traction_fit, whose first taxel is at top, left.");
    module.def(
        "taxel_motion", &motion_of_object, py::arg("past"), py::arg("now"), py::kw_only(), py::arg("window"), py::arg("reported"),
        py::arg("fewest"), py::arg("latest"), py::arg("arm"), py::arg("reach"), py::arg("least"), py::arg("bound"),
        "Motion of an object now (4,) float64, s, and m, m, rad at the origin, after past (N, 4) at rising times: the past within window,\n"
        "s, and now (M, 4), fewest frames at least; its place without noise, its velocity and the one that is reported, (3,) each, that\n"
        "over the last reported, s, NaN with fewer than fewest frames; standard deviation of a place, m, at least least; speed of the\n"
        "contact, m/s, standard deviation, s and frames of the longest stretch in which the velocity was constant; the way, m, of the\n"
        "latest frames by that speed, and as it was. arm: (2,) m, of the contact's middle; reach: m, of its edges; bound: standard\n"
        "deviations by which velocities of ever longer stretches may differ.");
}

}  // namespace tactile::border
