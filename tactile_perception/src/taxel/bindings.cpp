// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The taxel array's compiled part for Python, as module _core.taxel.
#include "bindings/bindings.hpp"

#include <pybind11/eigen.h>

#include "bindings/border.hpp"
#include "taxel/motion.hpp"
#include "taxel/region.hpp"
#include "taxel/shear.hpp"
#include "taxel/signal.hpp"

namespace tactile::border {
namespace {

using taxel::Keyframe;
using taxel::Picture;
using taxel::Registration;
using taxel::SurfaceShear;

constexpr double MOST_TAXELS = 1e4, LONGEST = 1e6, LARGEST_NUMBER = 1e30;  // of a side; taxels, of a width: far beyond any array

py::array_t<float> contact_score(const py::object& pressure, const py::object& full, double smooth, int reach, double least, double share,
                                 double ramp) {
    const Input<float> given(pressure, "pressure", {ANY, ANY});
    const Input<bool> saturated(full, "full", {given.length(0), given.length(1)});
    const taxel::ScoreRule rule{within(smooth, "smooth", 1e-3, MOST_TAXELS), within(reach, "reach", 1, MOST_TAXELS),
                                static_cast<float>(within(least, "least", 1e-30, LARGEST_NUMBER)),
                                static_cast<float>(within(share, "share", 0.1, 1)),
                                static_cast<float>(within(ramp, "ramp", 0, MOST_TAXELS))};
    auto found = without_gil([&] { return taxel::contact_score(given.data(), marks(saturated), given.length(0), given.length(1), rule); });
    return kept(std::move(found), {given.length(0), given.length(1)});
}

taxel::Regions find_regions(const py::object& score, const py::object& pressure, const py::object& full, double level, int reach,
                            int around, int most, double least, double pitch) {
    const Input<float> given(score, "score", {ANY, ANY});
    const py::ssize_t rows = given.length(0), columns = given.length(1);
    const Input<float> pressed(pressure, "pressure", {rows, columns});
    const Input<bool> saturated(full, "full", {rows, columns});
    const taxel::RegionRule rule{within(level, "level", 1e-6, LONGEST), within(reach, "reach", 0, MOST_TAXELS),
                                 within(around, "around", 0, MOST_TAXELS), within(most, "most", 1, LONGEST),
                                 within(least, "least", 0, LONGEST), within(pitch, "pitch", 1e-9, LONGEST)};
    return without_gil([&] { return taxel::find_regions(given.data(), pressed.data(), marks(saturated), rows, columns, rule); });
}

py::object moments_of(const taxel::Region& region) {
    const auto& [area, x, y, xx, xy, yy] = region.integrals;
    const std::vector<double> vector{0, 0, area}, first{x, y, 0}, second{xx, xy, yy};
    return py::module_::import("tactile_perception.common.surface").attr("Moments")(area, row_of(vector), row_of(first), row_of(second));
}

py::list polygons(const std::vector<std::vector<double>>& loops) {
    py::list found;
    for (const auto& loop : loops) found.append(rows_of(loop));
    return found;
}

taxel::Path make_path(double window, double reported, double least_noise, double bound) {
    return taxel::Path({within(window, "window", 0, LONGEST), within(reported, "reported", 0, LONGEST),
                        within(least_noise, "least_noise", 0, LARGEST_NUMBER), within(bound, "bound", 0, LARGEST_NUMBER)});
}

taxel::PathMotion add(taxel::Path& path, double time, const py::object& pose, const py::object& arm, double reach) {
    const Input<double> at(pose, "pose", {3}), middle(arm, "arm", {2});
    within(time, "time", -1e12, 1e12);
    within(reach, "reach", 1e-12, LONGEST);
    return change(path, [&](taxel::Path& next) {
        return next.add(time, Eigen::Map<const Eigen::Vector3d>(at.data()), Eigen::Map<const Eigen::Vector2d>(middle.data()), reach);
    });
}

Picture picture_of(const Input<float>& pressure, double scale) {
    within(pressure.length(0), "pressure", 1, MOST_TAXELS);
    within(pressure.length(1), "pressure", 1, MOST_TAXELS);
    return {pressure.data(), pressure.length(0), pressure.length(1), static_cast<float>(within(scale, "scale", 0, LARGEST_NUMBER))};
}

Keyframe make_keyframe(const py::object& pressure, double scale, double steep) {
    const Input<float> given(pressure, "pressure", {ANY, ANY});
    const Picture picture = picture_of(given, scale);
    within(steep, "steep", 1e-6, LONGEST);
    return without_gil([&] { return Keyframe(picture, steep); });
}

Registration motion(const Keyframe& key, const py::object& pressure, double scale, bool turns, const py::object& guess) {
    const Input<float> given(pressure, "pressure", {ANY, ANY});
    const Input<double> start(guess, "guess", {4});
    const Picture picture = picture_of(given, scale);
    return without_gil([&] { return key.motion(picture, turns, Eigen::Map<const Eigen::Vector4d>(start.data())); });
}

SurfaceShear make_shear(int rows, int columns, double pitch, double thickness, double stiffness) {
    within(rows, "rows", 1, MOST_TAXELS);
    within(columns, "columns", 1, MOST_TAXELS);
    return SurfaceShear({rows, columns, within(pitch, "pitch", 1e-9, LONGEST), within(thickness, "thickness", 1e-6, MOST_TAXELS),
                         within(stiffness, "stiffness", 1e-30, LARGEST_NUMBER)});
}

py::array_t<float> move(SurfaceShear& shear, const py::object& touched, const py::object& pressure, const py::object& shift,
                        double friction) {
    const py::ssize_t rows = shear.pad().rows, columns = shear.pad().columns;
    const Input<bool> contact(touched, "touched", {rows, columns});
    const Input<float> pressed(pressure, "pressure", {rows, columns});
    const Input<double> way(shift, "shift", {3});
    within(friction, "friction", 0, LARGEST_NUMBER);
    auto slip = change(shear, [&](SurfaceShear& next) {
        return next.move(marks(contact), pressed.data(), {way.data()[0], way.data()[1], way.data()[2]}, friction);
    });
    return kept(std::move(slip), {2, rows, columns});
}

py::array_t<float> pressure_of(const SurfaceShear& shear, const py::object& traction) {
    const Input<float> given(traction, "traction", {2, shear.pad().rows, shear.pad().columns});
    auto found = without_gil([&] { return shear.pressure_of(given.data()); });
    return kept(std::move(found), {shear.pad().rows, shear.pad().columns});
}

taxel::Sheet sheet(const py::object& values, const char* name, py::ssize_t rows = ANY, py::ssize_t columns = ANY) {
    const Input<float> given(values, name, {rows, columns});
    return {given.length(0), given.length(1), {given.data(), given.data() + given.length(0) * given.length(1)}};
}

taxel::Baseline make_baseline(double frames, double time_constant, const py::object& start, bool zeroed) {
    if (!(frames >= 1 && time_constant > 0))
        refuse("BadArgument", "baseline: need frames >= 1 and a positive time constant, got " + std::to_string(frames) + ", " +
                                  std::to_string(time_constant));
    return {frames, time_constant, start.is_none() ? std::nullopt : std::optional(sheet(start, "start")), zeroed};
}

void follow(taxel::Baseline& baseline, const py::object& change, const py::object& touched, double interval) {
    const taxel::Sheet& values = baseline.values();
    const Input<float> given(change, "change", {values.rows, values.columns});
    const Input<bool> contact(touched, "touched", {values.rows, values.columns});
    baseline.follow(given.data(), marks(contact), within(interval, "interval", 0, LARGEST_NUMBER));
}

void bind_signal(py::module_& module) {
    using taxel::Baseline, taxel::DeadTaxels, taxel::Hysteresis;
    const auto shaped = [](const taxel::Sheet& of) -> py::object {
        if (!of.size()) return py::none();
        return output(of.values, {of.rows, of.columns});
    };
    copyable(py::class_<Baseline>(
                 module, "Baseline",
                 "Untouched value and noise of each taxel: averaged, tracked as they drift, tared on request.\n\n"
                 "frames: number of quiet frames that are averaged; time_constant: s, of drift after that, tracked only where no taxel\n"
                 "nearby is touched, so that a persistent contact stays; start: (rows, columns) float32 from calibration, None to use the\n"
                 "first frame; zeroed: a first frame most of whose values are 0 is of a sensor that subtracts its untouched values itself,\n"
                 "so that they are 0. Raises BadArgument for frames below 1 or a time constant that is not positive."))
        .def(py::init(&make_baseline), py::arg("frames"), py::arg("time_constant"), py::arg("start") = py::none(),
             py::arg("zeroed") = false)
        .def("reset", &Baseline::reset, py::arg("start") = true,
             "The next frame is the new baseline, or, with start, the one from calibration if there is one.")
        .def(
            "change",
            [](Baseline& one, const py::object& frame, double full_scale) {
                const bool first = !one.values().size();
                const taxel::Sheet given = sheet(frame, "frame", first ? ANY : one.values().rows, first ? ANY : one.values().columns);
                return kept(one.change(given, full_scale), {given.rows, given.columns});
            },
            py::arg("frame"), py::arg("full_scale") = std::numeric_limits<double>::infinity(),
            "frame (rows, columns) float32 minus the baseline; a first frame becomes the baseline if there is none. full_scale: of a\n"
            "taxel, inf where it is not known.")
        .def("follow", &follow, py::arg("change"), py::arg("touched"), py::arg("interval_s"),
             "Track with the quiet part of a frame's change (rows, columns) float32, NaN is skipped, interval_s after the last frame;\n"
             "touched: (rows, columns) bool.")
        .def_property_readonly("sigma", &Baseline::sigma,
                               "Standard deviation of a taxel's noise, at least that of rounding; before two frames have\n"
                               "shown it, the spread of the last change.")
        .def_property_readonly(
            "values", [=](const Baseline& one) { return shaped(one.values()); }, "(rows, columns) untouched values, None without any")
        .def_property_readonly("looks_pressed", &Baseline::looks_pressed, "whether the first frame may have held a contact");
    copyable(py::class_<DeadTaxels>(module, "DeadTaxels",
                                    "Fills dead taxels and detects those that are silent between two pressed neighbours along a row or a "
                                    "column.\n\nknown: (rows, columns) bool, dead from the start."))
        .def(py::init([](const py::object& known) {
                 const Input<bool> given(known, "known", {ANY, ANY});
                 return DeadTaxels(marks(given), given.length(0), given.length(1));
             }),
             py::arg("known"))
        .def(
            "repaired",
            [](DeadTaxels& one, const py::object& change, double sigma) {
                const Input<float> given(change, "change", {one.rows(), one.columns()});
                return kept(one.repaired(given.data(), within(sigma, "sigma", 0, LARGEST_NUMBER)), {one.rows(), one.columns()});
            },
            py::arg("change"), py::arg("sigma"),
            "change (rows, columns) float32 from the baseline with dead and NaN taxels filled by the mean of live neighbours; sigma: its "
            "noise.")
        .def_property_readonly(
            "dead", [](const DeadTaxels& one) { return mask(one.dead()).attr("reshape")(one.rows(), one.columns()); },
            "(rows, columns) bool");
    copyable(py::class_<Hysteresis>(module, "Hysteresis", "Undoes a Loop of the sensing layer frame by frame."))
        .def(py::init([](const py::object& loop) {
                 const auto number = [&](const char* name) { return loop.attr(name).cast<double>(); };
                 return Hysteresis({number("share"), number("reach"), number("relative"), number("relaxation"), number("at_once"),
                                    loop.attr("late").cast<std::vector<double>>(), loop.attr("late_s").cast<std::vector<double>>()});
             }),
             py::arg("loop"))
        .def("reset", &Hysteresis::reset, "Loads are as shown in the next frame.")
        .def(
            "undone",
            [](Hysteresis& one, const py::object& shown, double interval) {
                const taxel::Sheet given = sheet(shown, "shown");
                return kept(one.undone(given, within(interval, "interval", 0, LARGEST_NUMBER)), {given.rows, given.columns});
            },
            py::arg("shown"), py::arg("interval_s"),
            "The load (rows, columns) Pa behind the pressure shown (rows, columns) float32, interval_s after the last frame.");
}

}  // namespace

void bind_taxel(py::module_& parent) {
    py::module_ module = parent.def_submodule("taxel", "The taxel array's compiled part: contact score, registration, surface shear.");
    bind_signal(module);
    module.def("contact_score", &contact_score, py::arg("pressure"), py::arg("full"), py::kw_only(), py::arg("smooth"), py::arg("reach"),
               py::arg("least"), py::arg("share"), py::arg("ramp"),
               "Contact scores (rows, columns) float32, 0 to 1, above 0.5 in contact, of pressure (rows, columns) float32.\n\n"
               "full: (rows, columns) bool, taxels that are saturated; smooth: taxels, of the Gaussian against noise;\n"
               "reach: taxels, thickness of the pad; least: level of pressure that counts;\n"
               "share: pressure at a flat face's border over the level inside; ramp: taxels, the same of a curved face over the level's "
               "slope.");
    using taxel::Region, taxel::Regions;
    py::class_<Region>(module, "Region", "One region, of one piece or of several.")
        .def_readonly("label", &Region::label)
        .def_property_readonly(
            "outlines", [](const Region& one) { return polygons(one.outlines); }, "of its pieces, (M, 3) m each")
        .def_property_readonly(
            "holes", [](const Region& one) { return polygons(one.holes); }, "in them, (M, 3) m each")
        .def_property_readonly("moments", &moments_of, "Moments, without the holes")
        .def_readonly("count", &Region::count, "of taxels")
        .def_readonly("force", &Region::force, "sum of pressure times area over them and those around, in the pressure's unit times m^2")
        .def_readonly("peak", &Region::peak, "largest pressure there")
        .def_readonly("at_edge", &Region::at_edge, "whether any of its taxels is at the array's border")
        .def_readonly("saturated", &Region::saturated, "whether any of its taxels is saturated");
    py::class_<Regions>(module, "Regions", "Regions of an array.")
        .def_readonly("all", &Regions::all, "Region, largest first")
        .def_property_readonly(
            "labels", [](const Regions& one) { return row_of(one.labels); }, "(rows * columns,) 0 outside")
        .def_property_readonly(
            "near", [](const Regions& one) { return row_of(one.near); }, "(rows * columns,) the same with the taxels around")
        .def_readonly("broken", &Regions::broken, "whether the image has more than most pieces");
    module.def("find_regions", &find_regions, py::arg("score"), py::arg("pressure"), py::arg("full"), py::kw_only(), py::arg("level"),
               py::arg("reach"), py::arg("around"), py::arg("most"), py::arg("least"), py::arg("pitch"),
               "Regions where score (rows, columns) float32 exceeds level, with their share of pressure (rows, columns) float32.\n\n"
               "full: (rows, columns) bool, taxels that are saturated; reach: taxels, pieces within twice of it are one region;\n"
               "around: taxels that share a region's load; most: regions, of more the largest pieces remain; least: taxels, area of\n"
               "a piece; pitch: m.");
    using taxel::PathMotion;
    py::class_<PathMotion>(module, "PathMotion", "Motion of an object in the last of its frames, at the origin: m, m, rad and per s.")
        .def_readonly("pose", &PathMotion::pose, "(3,) without noise")
        .def_readonly("velocity", &PathMotion::velocity, "(3,) over the longest stretch in which it was constant")
        .def_readonly("reported", &PathMotion::reported, "(3,) velocity over the reported stretch, NaN with too few frames")
        .def_readonly("noise", &PathMotion::noise, "m, standard deviation of a position")
        .def_readonly("speed", &PathMotion::speed, "m/s, of the contact's middle and edges together")
        .def_readonly("sigma", &PathMotion::sigma, "m/s, its standard deviation")
        .def_readonly("lasting", &PathMotion::lasting, "s, of the constant velocity")
        .def_readonly("used", &PathMotion::used, "its frames");
    copyable(py::class_<taxel::Path>(
                 module, "Path",
                 "Pose of an object in its last frames. window, reported: s, longest stretch of a steady motion, and that of\n"
                 "the reported velocity; least_noise: m, of a position; bound: standard deviations by which velocities of ever\n"
                 "longer stretches may differ. It can be copied, and is as it was after an exception."))
        .def(py::init(&make_path), py::kw_only(), py::arg("window"), py::arg("reported"), py::arg("least_noise"), py::arg("bound"))
        .def("reset", &taxel::Path::reset, "Drop all frames.")
        .def("add", &add, py::arg("time"), py::arg("pose"), py::arg("arm"), py::arg("reach"),
             "PathMotion after a frame at time, s, with pose (3,): m, m at the origin, rad. arm: (2,) m, of the contact's middle;\n"
             "reach: m, of its edges from there.");
    py::class_<Registration>(module, "Registration", "A motion from a keyframe to a later image.")
        .def_readonly("fit", &Registration::fit, "(4,) taxels: shift along columns and rows, turn times reach, growth")
        .def_readonly("spread", &Registration::spread, "standard deviation of the image's residuals");
    copyable(
        py::class_<Keyframe>(module, "Keyframe",
                             "Edge taxels of the image that is positive pressure (rows, columns) float32 times scale, where its slope "
                             "exceeds steep, 1/taxel; none at the array's border."))
        .def(py::init(&make_keyframe), py::arg("pressure"), py::kw_only(), py::arg("scale"), py::arg("steep"))
        .def("motion", &motion, py::arg("pressure"), py::kw_only(), py::arg("scale"), py::arg("turns"), py::arg("guess"),
             "Registration of the edges with the image by pressure and scale; turns: whether a turn is fitted; guess: (4,) to begin with.")
        .def_readonly("normal", &Keyframe::normal,
                      "(4, 4) sum over the edge taxels of the products of their slopes by the motions of a fit")
        .def_readonly("middle", &Keyframe::middle, "(2,) column and row, mean of the edge taxels")
        .def_readonly("reach", &Keyframe::reach, "taxels from middle, within which most of them lie")
        .def_property_readonly("count", &Keyframe::count, "number of edge taxels");
    copyable(
        py::class_<SurfaceShear>(
            module, "SurfaceShear",
            "Tangential displacement and traction of the surface of a pad on rows x columns taxels, pitch m apart: coupled bristles\n"
            "(the paper's virtual cantilevers), held by the pad's shear stiffness, that follow the object up to friction times pressure.\n"
            "Coupling makes the rim of a contact slip first. thickness: taxels; stiffness: Pa/m. It can be copied, and is as it was\n"
            "after an exception."))
        .def(py::init(&make_shear), py::kw_only(), py::arg("rows"), py::arg("columns"), py::arg("pitch"), py::arg("thickness"),
             py::arg("stiffness"))
        .def("reset", &SurfaceShear::reset, "Release all traction.")
        .def("move", &move, py::arg("touched"), py::arg("pressure"), py::arg("shift"), py::arg("friction"),
             "Slip (2, rows, columns) float32 m of an object that moves by shift (3,): m, m at the origin, rad. touched: (rows, columns) "
             "bool;\npressure: (rows, columns) float32 Pa; friction: coefficient.")
        .def("pressure_of", &pressure_of, py::arg("traction"),
             "Pressure (rows, columns) float32 under the pad that a traction (2, rows, columns) float32 causes by its convergence, in its "
             "unit.")
        .def(
            "traction_pressure",
            [](const SurfaceShear& shear) {
                return kept(shear.traction_pressure(), {shear.pad().rows, shear.pad().columns});
            },
            "(rows, columns) float32 Pa: the pressure under the pad that the present traction causes.")
        .def_property_readonly(
            "force", [](const SurfaceShear& shear) { return output(shear.force(), {2}); },
            "(2,) N that the object exerts along the surface.");
}

}  // namespace tactile::border
