// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The touchpad for Python: colour to range, the membrane, contact, stick and slip.
#include "bindings/bindings.hpp"

#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "bindings/border.hpp"
#include "touchpad/contact.hpp"
#include "touchpad/contact_point.hpp"
#include "touchpad/stick_slip.hpp"
#include "touchpad/water.hpp"

namespace tactile::border {
namespace {

// ---- Colour to range.

constexpr double LARGEST_RADIUS = 4096;  // px. Chosen: no ring is that large

py::tuple colours(const py::object& image, const py::object& uv, double radius, double ink, double glare) {
    const Input<std::uint8_t> pixels(image, "image", {ANY, ANY, 3});
    const Input<double> places(uv, "uv", {ANY, 2});
    within(radius, "radius", 0, LARGEST_RADIUS);
    const RingColours found = without_gil([&] {
        return ring_colours({pixels.data(), pixels.length(0), pixels.length(1)}, places.data(), places.length(), radius, ink, glare);
    });
    return py::make_tuple(rows_of(found.ratios, 2), row_of(found.brightness), row_of(found.count), row_of(found.patchiness));
}

LightPath as_path(const Input<double>& path) {
    const double* given = path.data();
    return {given[0], given[1], given[2], given[3], {given[4], given[5], given[6]}};
}

py::tuple path_lengths(const py::object& path, const py::object& places, const py::object& normals) {
    const Input<double> light(path, "path", {7}), at(places, "places", {ANY, 3});
    const py::ssize_t count = at.length();
    const Input<double> facing(normals, "normals", {count, 3});
    std::vector<double> metres(count), slopes(count), irradiance(count);
    const LightPath way = as_path(light);
    for (py::ssize_t k = 0; k < count; ++k) {
        const Vec3 place = vec3_at(at.data(), k), away = place - way.centre, ray = (1 / length(away)) * away;
        const Incidence lit = incidence(way, place, vec3_at(facing.data(), k), ray);
        const Length found = length_at(way, place.z, ray.z, lit);
        metres[k] = found.metres, slopes[k] = found.slope, irradiance[k] = lit.irradiance;
    }
    return py::make_tuple(row_of(metres), row_of(slopes), row_of(irradiance));
}

py::tuple lengths_of_colours(const py::object& ratios, const py::object& count, const py::object& patchiness, const py::object& excess,
                             const py::object& excess_sigma, const py::object& colour, std::array<double, 2> constants,
                             std::array<double, 2> absorptions, std::array<double, 4> noise, double disagree, double patchy,
                             double probability, double size) {
    const Input<double> logs(ratios, "ratios", {ANY, 2});
    const py::ssize_t dots = logs.length();
    const Input<std::int64_t> points(count, "count", {dots});
    const Input<double> spread(patchiness, "patchiness", {dots}), bright(excess, "excess", {dots}),
        sigma(excess_sigma, "excess_sigma", {dots}), tints(colour, "colour", {dots, 2});
    const WaterColour water{{constants[0], constants[1]},
                            {within(absorptions[0], "absorptions", 1e-6, 1e6), within(absorptions[1], "absorptions", 1e-6, 1e6)},
                            {noise[0], noise[1], noise[2], noise[3]},
                            within(disagree, "disagree", 1e-6, 1e6),
                            within(patchy, "patchy", 0, 1e6)};
    within(noise[0] * noise[3] - noise[1] * noise[2], "noise", 1e-300, 1e300);
    const Glare glare{within(probability, "probability", 1e-6, 1), within(size, "size", 1e-6, 1e3)};
    const WaterLengths found = without_gil([&] {
        return water_lengths(water, glare, {logs.data(), points.data(), spread.data(), bright.data(), sigma.data(), tints.data(), dots});
    });
    return py::make_tuple(row_of(found.lengths), row_of(found.sigma));
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
    const Grid grid{rows, columns};
    for (py::ssize_t k = 0; rows > 2 && columns > 2 && k < count; ++k) within(numbers.data()[k], "id", 0, rows * columns - 1);
    const WaterRanges found = without_gil([&] {
        return water_ranges(as_path(light), {numbers.data(), along.data(), rest.data(), facing.data(), count, grid}, metres.data(),
                            ring_share);
    });
    return py::make_tuple(row_of(found.ranges), row_of(found.slopes));
}

// ---- The membrane.

constexpr int LARGEST_GRID = 4096;       // dots
constexpr double LARGEST_SIZE = 1e200;   // m, m^2. Chosen: any units
constexpr py::ssize_t MOST = 64 * 1024;  // nodes of a surface

Skin skin_of(const py::object& rest, int rows, int columns, const MembraneMaterial& material) {
    const Grid grid{within(rows, "rows", 3, LARGEST_GRID / 3), within(columns, "columns", 3, LARGEST_GRID / 3)};
    within(grid.size(), "rows * columns", 9, LARGEST_GRID);
    return Skin(grid, Input<double>(rest, "rest", {grid.size(), 3}).data(), material);
}

Vec3 vector_of(const py::object& given, const char* name) {
    return vec3_at(Input<double>(given, name, {3}).data(), 0);
}

// Numbers of dots of a grid.
Input<std::int64_t> numbers_of(const py::object& given, Grid grid) {
    Input<std::int64_t> numbers(given, "id", {ANY});
    for (py::ssize_t i = 0; i < numbers.length(); ++i) within(numbers.data()[i], "id", 0, static_cast<double>(grid.size() - 1));
    return numbers;
}

py::tuple forces_at(const Membrane& membrane, const py::object& xyz) {
    const py::ssize_t size = membrane.skin().grid.size();
    const Input<double> places(xyz, "xyz", {size, 3});
    std::vector<double> force(3 * size), share(3 * size);
    add_forces(membrane.skin(), places.data(), force.data(), share.data());
    return py::make_tuple(rows_of(force), rows_of(share));
}

MembraneState solve(Membrane& membrane, const py::object& rays, const py::object& ranges, const py::object& sigma, const py::object& id) {
    const Input<std::int64_t> numbers = numbers_of(id, membrane.skin().grid);
    const py::ssize_t count = numbers.length();
    const Input<double> along(rays, "rays", {count, 3}), measured(ranges, "ranges", {count}), spread(sigma, "sigma", {count});
    return change(membrane, [&](Membrane& next) {
        next.solve({numbers.data(), along.data(), measured.data(), spread.data(), count});
        return next.state();
    });
}

DotLoads loads_of(const Membrane& membrane, const py::object& id, const py::object& xyz) {
    const Input<std::int64_t> numbers = numbers_of(id, membrane.skin().grid);
    const Input<double> places(xyz, "xyz", {numbers.length(), 3});
    return without_gil([&] { return membrane.loads(numbers.data(), places.data(), numbers.length()); });
}

DotLoads make_loads(const py::object& xyz, const py::object& seen, const py::object& normal, const py::object& force,
                    const py::object& load) {
    const Input<double> places(xyz, "xyz", {ANY, 3});
    const py::ssize_t size = places.length();
    const Input<bool> shown(seen, "seen", {size});
    const Input<double> up(normal, "normal", {size, 3}), pushed(force, "force", {size, 3}), pressed(load, "load", {size});
    return {{places.data(), places.data() + 3 * size},
            {shown.data(), shown.data() + size},
            {up.data(), up.data() + 3 * size},
            {pushed.data(), pushed.data() + 3 * size},
            {pressed.data(), pressed.data() + size}};
}

// ---- Contact.

std::vector<float> weights_of(const py::object& given, const char* name, std::initializer_list<py::ssize_t> shape) {
    const Input<float> weights(given, name, shape);
    py::ssize_t size = 1;
    for (const py::ssize_t length : shape) size *= length;
    return {weights.data(), weights.data() + size};
}

std::shared_ptr<BorderNetwork> make_network(const py::object& weights_1, const py::object& biases_1, const py::object& weights_2,
                                            const py::object& biases_2, const py::object& weights_3, float bias_3) {
    using Net = BorderNetwork;
    return std::make_shared<Net>(
        Net{weights_of(weights_1, "weights_1", {Net::FED, Net::FIRST}), weights_of(biases_1, "biases_1", {Net::FIRST}),
            weights_of(weights_2, "weights_2", {Net::FIRST, Net::SECOND}), weights_of(biases_2, "biases_2", {Net::SECOND}),
            weights_of(weights_3, "weights_3", {Net::SECOND}), bias_3});
}

Grid grid_of(const DotLoads& loads, int rows, int columns) {
    const Grid grid{within(rows, "rows", 3, LARGEST_GRID / 3), within(columns, "columns", 3, LARGEST_GRID / 3)};
    within(grid.size(), "rows * columns", 9, LARGEST_GRID);
    if (loads.load.size() != static_cast<std::size_t>(grid.size())) throw py::value_error("loads: rows * columns dots are needed");
    return grid;
}

py::array_t<std::uint8_t> update(StickSlip& tracker, const DotLoads& loads, const py::object& score, double seconds) {
    const Input<double> given(score, "score", {tracker.size()});
    if (loads.load.size() != static_cast<std::size_t>(tracker.size())) throw py::value_error("loads: those of the grid's dots are needed");
    const auto judge = [&](StickSlip& next) { return next.update(loads, {given.data(), given.data() + given.length()}, seconds); };
    return row_of(change(tracker, judge));
}

Eigen::Vector3d column(Vec3 a) {
    return {a.x, a.y, a.z};
}

// A surface that is extended on each side.
Nodes wide_surface(const Input<double>& given) {
    for (const py::ssize_t axis : {0, 1}) within(given.length(axis), "wide", 2 + 2 * BEYOND, MOST);
    return {given.data(), given.length(), given.length(1), 3};
}

py::tuple contact_of(const py::object& points, const py::object& border, const py::object& start, const py::object& wide,
                     const py::object& centroid, const py::object& normal, double area, double pitch, double sigma, double centre_z,
                     double radius) {
    const Input<double> dots(points, "points", {ANY, 3}), sides(border, "border", {ANY, 3}), surface(wide, "wide", {ANY, ANY, 3});
    const Input<std::int64_t> first(start, "start", {ANY});
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
    const ContactPlace place = contact_point(dots.data(), dots.length(), shape, nodes, sigma);
    const double depth = std::max(contact_depth(dots.data(), dots.length(), rest, pitch), 0.0);  // or NaN
    return py::make_tuple(column(place.position), place.covariance, column(place.normal), depth);
}

void bind_membrane(py::module_& module) {
    py::class_<MembraneModel>(module, "MembraneModel", "What decides about the places of dots: docs/constants.md.")
        .def(py::init())
        .def_readwrite("misfit", &MembraneModel::misfit)
        .def_readwrite("touched", &MembraneModel::touched)
        .def_readwrite("lighter", &MembraneModel::lighter)
        .def_readwrite("heavier", &MembraneModel::heavier)
        .def_readwrite("coupling", &MembraneModel::coupling)
        .def_readwrite("evidence", &MembraneModel::evidence)
        .def_readwrite("most", &MembraneModel::most)
        .def_readwrite("tail", &MembraneModel::tail)
        .def_readwrite("smoothed", &MembraneModel::smoothed)
        .def_readwrite("residual", &MembraneModel::residual)
        .def_readwrite("correlated", &MembraneModel::correlated);
    py::class_<MembraneState>(module, "MembraneState",
                              "The membrane in one frame: all K dots of the grid by number, unseen ones interpolated.")
        .def_property_readonly("xyz", rows(&MembraneState::xyz), "(K, 3) m, sensor frame")
        .def_property_readonly("ranges", row(&MembraneState::ranges), "(K,) m, from the camera's centre")
        .def_property_readonly("touched", row(&MembraneState::touched), "(K,) probability of a load")
        .def_property_readonly("seen", marked(&MembraneState::seen), "(K,) bool")
        .def_readonly("fluid_pressure", &MembraneState::pressure, "Pa");
    py::class_<DotLoads>(module, "DotLoads", "Loads on all K dots of the grid in one frame, by number; unseen dots are interpolated.")
        .def(py::init(&make_loads), py::arg("xyz"), py::arg("seen"), py::arg("normal"), py::arg("force"), py::arg("load"))
        .def_property_readonly("xyz", rows(&DotLoads::xyz), "(K, 3) m, sensor frame")
        .def_property_readonly("seen", marked(&DotLoads::seen), "(K,) bool")
        .def_property_readonly("normal", rows(&DotLoads::normal), "(K, 3) outward")
        .def_property_readonly("force", rows(&DotLoads::force),
                               "(K, 3) N, object on sensor, 0 on the outermost dots, which have no balance")
        .def_property_readonly("load", row(&DotLoads::load),
                               "(K,) normal pressure of the object over the fluid's: 0 free, 1 under a flat face");
    copyable(py::class_<Membrane>(
                 module, "Membrane",
                 "The membrane through the dots of a rows x columns grid with rest positions (K, 3), m, by number; stiffness: shear,\n"
                 "N/m; area_share: of the area term; pressure: of the fluid at rest, Pa; origin: (3,) m, camera centre. It holds the\n"
                 "last frame, can be copied, and is as it was after an exception."))
        .def(py::init([](const py::object& rest, int rows, int columns, double stiffness, double area_share, double pressure,
                         const py::object& origin, const MembraneModel& model) {
                 return Membrane(skin_of(rest, rows, columns, {stiffness, area_share, pressure}), vector_of(origin, "origin"), model);
             }),
             py::arg("rest"), py::kw_only(), py::arg("rows"), py::arg("columns"), py::arg("stiffness"), py::arg("area_share"),
             py::arg("pressure"), py::arg("origin"), py::arg_v("model", MembraneModel(), "MembraneModel()"))
        .def(
            "take_rest", [](Membrane& membrane, const Membrane& other) { membrane.set_rest(other.skin()); }, py::arg("other"),
            "Take another membrane's rest positions, of the same grid; the last frame stays.")
        .def_property_readonly(
            "rest", [](const Membrane& membrane) { return rows_of(membrane.skin().rest); }, "(K, 3) m")
        .def_property_readonly(
            "residual", [](const Membrane& membrane) { return rows_of(membrane.skin().residual); },
            "(K, 3) m^2: the mesh's discretisation error at rest over the pressure")
        .def_property_readonly("scale", &Membrane::scale, "factor on displacements along the rays, as learnt so far")
        .def_property_readonly(
            "state", [](const Membrane& membrane) { return membrane.state(); }, "MembraneState of the last frame")
        .def_property_readonly(
            "started", [](const Membrane& membrane) { return !membrane.state().xyz.empty(); }, "whether there is one")
        .def("reset", &Membrane::reset, py::arg("scale_sigma"),
             "Drop the last frame. scale_sigma: standard deviation of the relative error that all displacements share; 0: there is none.")
        .def("forces", &forces_at, py::arg("xyz"),
             "Elastic force (K, 3), N, on each dot at xyz (K, 3), m, and its share (K, 3), m^2, of the area vectors.")
        .def("solve", &solve, py::arg("rays"), py::arg("ranges"), py::arg("sigma"), py::arg("id"),
             "MembraneState of the next frame, from ranges (N,), m, of dots id (N,) int64 along unit rays (N, 3) from the origin, of "
             "standard\n"
             "deviations sigma (N,), m, NaN: unknown.")
        .def("loads", &loads_of, py::arg("id"), py::arg("xyz"), "DotLoads of the seen dots id (N,) int64 at xyz (N, 3), m.");
}

void bind_classifier(py::module_& module) {
    py::class_<BorderNetwork, std::shared_ptr<BorderNetwork>>(
        module, "BorderNetwork",
        "A network that tells a dot's distance from a contact's border: weights float32 (in, out) and biases of its layers.")
        .def(py::init(&make_network), py::arg("weights_1"), py::arg("biases_1"), py::arg("weights_2"), py::arg("biases_2"),
             py::arg("weights_3"), py::arg("bias_3"))
        .def(
            "scores",
            [](const BorderNetwork& network, const DotLoads& loads, int rows, int columns, double pitch) {
                return row_of(border_scores(network, grid_of(loads, rows, columns), loads, within(pitch, "pitch", 1e-9, 1e9)));
            },
            py::arg("loads"), py::kw_only(), py::arg("rows"), py::arg("columns"), py::arg("pitch"),
            "Scores (K,): half a dot's distance from the border, pitches, plus 1/2, 0 to 1; pitch: m.");
    py::class_<StickSlipModel>(module, "StickSlipModel", "What decides about stick or slip, SI units: docs/stick_slip.md.")
        .def(py::init())
        .def_readwrite("depth_noise", &StickSlipModel::depth_noise)
        .def_readwrite("strain", &StickSlipModel::strain)
        .def_readwrite("creep", &StickSlipModel::creep)
        .def_readwrite("slip", &StickSlipModel::slip)
        .def_readwrite("drift", &StickSlipModel::drift)
        .def_readwrite("acceleration", &StickSlipModel::acceleration)
        .def_readwrite("friction", &StickSlipModel::friction)
        .def_readwrite("friction_spread", &StickSlipModel::friction_spread)
        .def_readwrite("friction_noise", &StickSlipModel::friction_noise)
        .def_readwrite("aim", &StickSlipModel::aim)
        .def_readwrite("rate", &StickSlipModel::rate)
        .def_readwrite("share", &StickSlipModel::share);
    py::class_<TouchingObject>(module, "TouchingObject", "An object that touches. Modes: held, slipping in part, sliding, at rest.")
        .def_readonly("count", &TouchingObject::count, "dots judged, 0 of a new one")
        .def_readonly("odds", &TouchingObject::odds, "(4,), probabilities of the modes")
        .def_readonly("slipping", &TouchingObject::slipping, "(4,), share of the dots that slip in each mode");
    copyable(py::class_<StickSlip>(module, "StickSlip",
                                   "Which dots of a rows x columns grid stick or slip, frame by frame; origin: (3,) m, camera centre."))
        .def(py::init([](int rows, int columns, const py::object& origin, const StickSlipModel& model) {
                 const Grid grid{within(rows, "rows", 1, LARGEST_GRID), within(columns, "columns", 1, LARGEST_GRID)};
                 within(grid.size(), "rows * columns", 1, LARGEST_GRID);
                 return StickSlip(grid, column(vector_of(origin, "origin")), model);
             }),
             py::arg("rows"), py::arg("columns"), py::arg("origin"), py::arg_v("model", StickSlipModel(), "StickSlipModel()"))
        .def("update", &update, py::arg("loads"), py::arg("score"), py::arg("seconds"),
             "States (K,) uint8: 0 free, 1 sticking, 2 slipping, so many seconds after the last frame; score (K,): above 0.5 in contact.")
        .def(
            "ways", [](const StickSlip& one) { return rows_of(one.ways(), 2); },
            "(K, 2) m: way of the object over each dot in the last frame, along x and y; NaN: unknown.")
        .def_property_readonly(
            "slipping", [](const StickSlip& one) { return row_of(one.slipping()); },
            "(K,), probabilities that the dots slip, given that they touch; NaN: unknown")
        .def(
            "motion",
            [](const StickSlip& one) {
                const Eigen::Isometry3d motion = one.motion();
                return py::make_tuple(Eigen::Matrix3d(motion.linear()), Eigen::Vector3d(motion.translation()));
            },
            "Rotation (3, 3) and translation (3,), m, of the largest object that holds dots, since the last frame; NaN: unknown.")
        .def_property_readonly("objects", &StickSlip::objects, "list of TouchingObject, largest first")
        .def_property_readonly("friction", &StickSlip::friction, "coefficient of the object last seen")
        .def_property_readonly("noise", &StickSlip::noise, "m, standard deviation of a dot's motion across its ray");
}

}  // namespace

void bind_touchpad(py::module_& module) {
    bind_membrane(module);
    bind_classifier(module);
    module.def(
        "contact_point", &contact_of, py::arg("points"), py::arg("border"), py::arg("start"), py::arg("wide"), py::arg("centroid"),
        py::arg("normal"), py::kw_only(), py::arg("area"), py::arg("pitch"), py::arg("sigma"), py::arg("centre_z"), py::arg("radius"),
        "Where the object stands in a region whose dots are at points (N, 3), m, of standard deviation sigma: position (3,), m, its\n"
        "covariance (3, 3), normal (3,) of the surface there, and depth, m, NaN: unknown. border (M, 3), start (L + 1,): of the region's\n"
        "polygons. The surface at rest is a sphere's upper half.");
    module.def(
        "ring_colours", &colours, py::arg("image"), py::arg("uv"), py::arg("radius"), py::kw_only(), py::arg("ink"), py::arg("glare"),
        "Background around dots at uv (N, 2) float64, px, in an image (H, W, 3) uint8, blue, green, red, on rings of radius px: ratios\n"
        "(N, 2) ln(blue / red), ln(green / red); brightness (N,) ln(red); count (N,) of 16 ring points used; patchiness (N,). Points with\n"
        "blue below ink or above glare times the ring's upper quartile are left out.");
    module.def(
        "path_lengths", &path_lengths, py::arg("path"), py::arg("places"), py::arg("normals"),
        "Lengths (N,), m, of the light's path in the water to places (N, 3), m, their derivatives (N,) along the camera's rays, and the\n"
        "irradiance (N,) in units of the lamps' power.\n\n"
        "path: (7,) window_z, lamp_z, lamp_radius, m, ambient, and the camera's centre, m; normals: (N, 3), unit, outward.");
    module.def(
        "water_lengths", &lengths_of_colours, py::arg("ratios"), py::arg("count"), py::arg("patchiness"), py::arg("excess"),
        py::arg("excess_sigma"), py::arg("colour"), py::kw_only(), py::arg("constants"), py::arg("absorptions"), py::arg("noise"),
        py::arg("disagree"), py::arg("patchy"), py::arg("probability"), py::arg("size"),
        "Path lengths (N,), m, in the water, and their standard deviations (N,).\n\n"
        "ratios (N, 2), count (N,) int64, patchiness (N,): of ring_colours; excess: (N,) ln of the red light over that expected without\n"
        "glare, with excess_sigma (N,), and colour: (N, 2) ratios of glare over those of scattered light, NaN: unknown; constants,\n"
        "absorptions (1/m), noise (4,): of the water's log ratios; disagree: standard deviations between the ratios, and patchy: times "
        "the\n"
        "noise's variance of a ring point, from which the deviation is wider; probability: of glare; size: standard deviation of red glare "
        "over\n"
        "scattered red.");
    module.def(
        "water_ranges", &ranges, py::arg("path"), py::arg("lengths"), py::kw_only(), py::arg("rays"), py::arg("id"), py::arg("rest_ranges"),
        py::arg("rest_normals"), py::arg("rows"), py::arg("columns"), py::arg("ring_share"),
        "Ranges (N,), m, at which the light's paths have the lengths (N,), m, and the lengths' derivatives (N,) there.\n\n"
        "path: as for path_lengths; rays: (N, 3), unit; id: (N,) int64, of the dots on the grid of rows x columns; rest_ranges (N,), m,\n"
        "rest_normals (N, 3), unit: at rest; ring_share: radius of the ring around a dot whose mean a length is, over the dots' pitch.");
}

}  // namespace tactile::border
