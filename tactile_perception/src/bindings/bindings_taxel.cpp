// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the taxel array's kernels, in the manner of bindings.cpp.
#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "bindings/taxel_bounds.hpp"
#include "taxel/taxel_load.hpp"
#include "taxel/taxel_quiet.hpp"
#include "taxel/taxel_regions.hpp"
#include "taxel/taxel_response.hpp"
#include "taxel/taxel_score.hpp"
#include "taxel/taxel_shear.hpp"

namespace tactile::border {
namespace {

constexpr double MOST_HELD = 0.999;  // of a load, that a sensing layer hides. Derived: what it shows is divided by the rest

py::array_t<float> score_of_taxels(const py::object& pressure, const py::object& full, double smooth, int reach, double least, double share,
                                   double ramp) {
    const Input<float> given(pressure, "pressure", {ANY, ANY});
    const Input<bool> saturated(full, "full", {given.length(0), given.length(1)});
    within(smooth, "smooth", 1e-3, MOST_TAXELS);
    within(reach, "reach", 1, MOST_TAXELS);
    within(least, "least", 1e-30, 1e30);
    const ScoreRule rule{smooth, reach, static_cast<float>(least), static_cast<float>(within(share, "share", 0.1, 1)),
                         static_cast<float>(within(ramp, "ramp", 0, MOST_TAXELS))};
    std::vector<float> found;
    {
        py::gil_scoped_release others_run;
        found = taxel_score(given.data(), marks(saturated), given.length(0), given.length(1), rule);
    }
    return kept(std::move(found), {given.length(0), given.length(1)});
}

py::tuple regions_of_taxels(const py::object& score, const py::object& pressure, double level, double pitch, int most, int around) {
    const Input<float> scores(score, "score", {ANY, ANY}), pressed(pressure, "pressure", {scores.length(0), scores.length(1)});
    const py::ssize_t rows = scores.length(0), columns = scores.length(1);
    within(rows, "score", 1, MOST_TAXELS);
    within(columns, "score", 1, MOST_TAXELS);
    const TaxelRule rule{rows,
                         columns,
                         within(level, "level", 1e-6, 1e6),
                         within(pitch, "pitch", 1e-9, LONGEST),
                         within(most, "most", 1, LONGEST),
                         within(around, "around", 0, MOST_TAXELS)};
    TaxelRegions found;
    {
        py::gil_scoped_release others_run;
        found = taxel_regions(scores.data(), pressed.data(), rule);
    }
    std::vector<double> table;
    for (const TaxelRegion& one : found.regions) {
        for (const std::ptrdiff_t number :
             {static_cast<std::ptrdiff_t>(one.label), one.count, one.box.top, one.box.left, one.box.bottom, one.box.right})
            table.push_back(static_cast<double>(number));
        table.insert(table.end(), {one.force, one.peak});
        table.insert(table.end(), one.sums.begin(), one.sums.end());
    }
    const auto vertices = static_cast<py::ssize_t>(found.points.size()) / 3;
    return py::make_tuple(kept(std::move(found.labels), {rows, columns}), kept(std::move(found.near), {rows, columns}), found.broken,
                          output(table, {static_cast<py::ssize_t>(found.regions.size()), 14}), output(found.loops.places, {vertices, 2}),
                          output(found.points, {vertices, 3}),
                          output(found.loops.start, {static_cast<py::ssize_t>(found.loops.start.size())}),
                          output(found.loops.region, {static_cast<py::ssize_t>(found.loops.region.size())}));
}

py::tuple follow_taxels(const py::object& values, const py::object& count, const py::object& change, const py::object& touched, int around,
                        double frames, double gain) {
    const Input<float> untouched(values, "values", {ANY, ANY});
    const py::ssize_t rows = untouched.length(0), columns = untouched.length(1);
    const Input<float> counted(count, "count", {rows, columns}), changed(change, "change", {rows, columns});
    const Input<bool> contact(touched, "touched", {rows, columns});
    within(around, "around", 0, MOST_TAXELS);
    within(frames, "frames", 1, 1e9);
    within(gain, "gain", 0, 1);
    Followed found;
    {
        py::gil_scoped_release others_run;
        found = follow_quiet(untouched.data(), counted.data(), changed.data(), marks(contact), rows, columns, around, frames,
                             static_cast<float>(gain));
    }
    return py::make_tuple(kept(std::move(found.values), {rows, columns}), kept(std::move(found.count), {rows, columns}),
                          mask_of(found.quiet, rows, columns));
}

py::tuple responding_taxels(const py::object& change, const py::object& responded, double pressed, double part) {
    const Input<float> changed(change, "change", {ANY, ANY});
    const py::ssize_t rows = changed.length(0), columns = changed.length(1);
    const Input<bool> earlier(responded, "responded", {rows, columns});
    within(pressed, "pressed", 0, 1e30);
    within(part, "part", 0, 1);
    Responding found;
    {
        py::gil_scoped_release others_run;
        found = responding(changed.data(), marks(earlier), rows, columns, static_cast<float>(pressed), static_cast<float>(part));
    }
    return py::make_tuple(mask_of(found.responded, rows, columns), mask_of(found.silent, rows, columns));
}

py::array_t<float> pressure_of_taxels(const py::object& change, const py::object& by_gain, const std::array<double, 3>& scale,
                                      double knee) {
    const Input<float> changed(change, "change", {ANY, ANY});
    const py::ssize_t rows = changed.length(0), columns = changed.length(1);
    const Input<float> gain(by_gain, "by_gain", {rows, columns});
    for (const double number : scale) within(number, "scale", 0, 1e30);
    within(knee, "knee", 1e-30, 1e30);
    const Curve curve{static_cast<float>(scale[0]), static_cast<float>(scale[1]), static_cast<float>(scale[2]), static_cast<float>(knee)};
    std::vector<float> found;
    {
        py::gil_scoped_release others_run;
        found = pressure_of(changed.data(), gain.data(), rows * columns, curve);
    }
    return kept(std::move(found), {rows, columns});
}

py::tuple undo_hysteresis(const py::object& pressure, const py::object& last, const py::object& held, double share, double reach,
                          double relative, double crept, double smooth) {
    const Input<float> shown(pressure, "pressure", {ANY, ANY});
    const py::ssize_t rows = shown.length(0), columns = shown.length(1);
    const Input<float> before(last, "last", {rows, columns}), stuck(held, "held", {rows, columns});
    within(rows, "pressure", 1, MOST_TAXELS);
    within(columns, "pressure", 1, MOST_TAXELS);
    within(share, "share", 0, MOST_HELD);
    within(reach, "reach", 0, 1e30);
    within(relative, "relative", 0, 1);
    within(crept, "crept", 0, 1);
    within(smooth, "smooth", 1e-3, MOST_TAXELS);
    const Loop loop{static_cast<float>(share), static_cast<float>(reach), static_cast<float>(relative), static_cast<float>(crept)};
    Undone found;
    {
        py::gil_scoped_release others_run;
        found = undone(shown.data(), before.data(), stuck.data(), rows, columns, loop, smooth);
    }
    return py::make_tuple(kept(std::move(found.load), {rows, columns}), kept(std::move(found.held), {rows, columns}));
}

py::tuple load_of_taxels(const py::object& pressure, const py::object& touched, int around) {
    const Input<float> pressed(pressure, "pressure", {ANY, ANY});
    const Input<bool> contact(touched, "touched", {pressed.length(0), pressed.length(1)});
    within(around, "around", 0, MOST_TAXELS);
    std::array<double, 4> found;
    {
        py::gil_scoped_release others_run;
        found = load_of(pressed.data(), marks(contact), pressed.length(0), pressed.length(1), around);
    }
    return py::make_tuple(found[0], found[1], found[2], static_cast<py::ssize_t>(found[3]));
}

double spread_of_taxels(const py::object& pressure, const py::object& touched, const py::object& direction) {
    const Input<float> pressed(pressure, "pressure", {ANY, ANY});
    const Input<bool> contact(touched, "touched", {pressed.length(0), pressed.length(1)});
    const Input<double> along(direction, "direction", {2});
    py::gil_scoped_release others_run;
    return spread_along(pressed.data(), marks(contact), pressed.length(0), pressed.length(1), {along.data()[0], along.data()[1]});
}

py::array_t<float> taxels_without_traction(const py::object& pressure, const py::object& traction, double unit) {
    const Input<float> pressed(pressure, "pressure", {ANY, ANY});
    const Input<float> pulled(traction, "traction", {pressed.length(0), pressed.length(1)});
    within(unit, "unit", 1e-30, 1e30);
    std::vector<float> found;
    {
        py::gil_scoped_release others_run;
        found = without_traction(pressed.data(), pulled.data(), pressed.length(0) * pressed.length(1), static_cast<float>(unit));
    }
    return kept(std::move(found), {pressed.length(0), pressed.length(1)});
}

}  // namespace

void bind_taxels(py::module_& module) {
    module.def(
        "taxel_score", &score_of_taxels, py::arg("pressure"), py::arg("full"), py::kw_only(), py::arg("smooth"), py::arg("reach"),
        py::arg("least"), py::arg("share"), py::arg("ramp"),
        "Contact scores (rows, columns) float32, 0 to 1, above 0.5 in contact, of pressure (rows, columns) float32.\n\n"
        "full: (rows, columns) bool, taxels that are saturated; smooth: taxels, of the Gaussian against noise;\n"
        "reach: taxels, thickness of the pad; least: level of pressure that counts;\n"
        "share: pressure at a flat face's border over the level inside; ramp: taxels, the same of a curved face over the level's slope.");
    module.def(
        "taxel_regions", &regions_of_taxels, py::arg("score"), py::arg("pressure"), py::kw_only(), py::arg("level"), py::arg("pitch"),
        py::arg("most"), py::arg("around"),
        "Regions where score (rows, columns) float32 exceeds level, at most so many, with the load of pressure (rows, columns) float32 in\n"
        "them and in the taxels around: labels (rows, columns) int32, 0 outside; the same, extended to the taxels around; whether there\n"
        "are more regions; a table (R, 14): label, taxels, top, left, bottom, right, force, peak, integrals of 1, x, y, xx, xy, yy; and "
        "the\n"
        "outlines: vertices (M, 2) of (row, column) and (M, 3) m, first vertices and M (L + 1,), regions (L,).");
    module.def(
        "taxel_follow", &follow_taxels, py::arg("values"), py::arg("count"), py::arg("change"), py::arg("touched"), py::kw_only(),
        py::arg("around"), py::arg("frames"), py::arg("gain"),
        "Untouched values (rows, columns) float32 that follow the quiet part of change (rows, columns) float32 from them: the number of\n"
        "quiet frames of each taxel, count, float32, and which are quiet, bool: finite, and none touched (rows, columns) bool within "
        "around\n"
        "taxels. They are the mean of the first frames quiet frames, and then follow by the part gain.");
    module.def(
        "taxel_responding", &responding_taxels, py::arg("change"), py::arg("responded"), py::kw_only(), py::arg("pressed"), py::arg("part"),
        "Which taxels have responded, (rows, columns) bool, by a change (rows, columns) float32 over pressed or in earlier frames,\n"
        "responded, bool; and which of the others are silent, bool: below part of both neighbours that respond, along a row or a column.");
    module.def(
        "taxel_pressure", &pressure_of_taxels, py::arg("change"), py::arg("by_gain"), py::kw_only(), py::arg("scale"), py::arg("knee"),
        "Pressure (rows, columns) float32 of values c, change times by_gain, (rows, columns) float32: scale[0] c + scale[1] c |c| +\n"
        "scale[2] c knee / (|c| + knee).");
    module.def(
        "taxel_undone", &undo_hysteresis, py::arg("pressure"), py::arg("last"), py::arg("held"), py::kw_only(), py::arg("share"),
        py::arg("reach"), py::arg("relative"), py::arg("crept"), py::arg("smooth"),
        "The load (rows, columns) float32 behind pressure (rows, columns) float32 that a sensing layer shows, and the held load after\n"
        "the load last and held (rows, columns) float32 of the last frame, NaN where unknown. share, from 0 to 0.999: of the held load\n"
        "in what is shown; reach, in the pressure's unit, and relative, of the load, from 0 to 1: farthest distance of load and held\n"
        "load; crept: part of the way to the load that the held load goes between frames; smooth: taxels, of the Gaussian by which\n"
        "neighbours tell together what is hidden.");
    module.def(
        "taxel_load", &load_of_taxels, py::arg("pressure"), py::arg("touched"), py::kw_only(), py::arg("around"),
        "Sum, its mean row and column, of pressure (rows, columns) float32 over the touched (rows, columns) bool taxels and those within\n"
        "around taxels of them along both axes, and the number of these; the means are NaN unless the sum is positive.");
    module.def("taxel_spread", &spread_of_taxels, py::arg("pressure"), py::arg("touched"), py::arg("direction"),
               "Variance of the places of pressure (rows, columns) float32 along a direction (2,) float64 over that of the touched (rows, "
               "columns)\n"
               "bool; NaN without load or width.");
    module.def("taxel_without_traction", &taxels_without_traction, py::arg("pressure"), py::arg("traction"), py::kw_only(), py::arg("unit"),
               "pressure (rows, columns) float32 without traction, float32, over unit, which at most doubles or cancels it.");
}

}  // namespace tactile::border
