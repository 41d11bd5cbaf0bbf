// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The touchpad for Python: colour to range, the membrane, contact, stick and slip.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "touchpad/contact.hpp"
#include "touchpad/contact_point.hpp"
#include "touchpad/stick_slip.hpp"
#include "touchpad/water.hpp"

namespace tactile::border {

inline void determine(const Membrane& membrane, Lengths& of) {
    of['K'] = membrane.skin().grid.size();
}
inline void determine(const StickSlip& tracker, Lengths& of) {
    of['K'] = tracker.size();
}

namespace {

using Doubles = Array<double>;
using Integers = Array<std::int64_t>;

// ---- Colour to range.

auto colours(const Array<std::uint8_t>& image, const Doubles& uv, double radius, double ink, double glare) {
    return members<4>(ring_colours({image, image.length(0), image.length(1)}, uv, uv.length(), radius, ink, glare));
}

auto lengths_of_colours(const DotColours& seen, const WaterColour& water, const Glare& glare) {
    within(water.noise[0] * water.noise[3] - water.noise[1] * water.noise[2], "noise", 1e-300, 1e300);
    return members<2>(water_lengths(water, glare, seen));
}

auto ranges(const double* path, const Doubles& lengths, const SeenDots& dots, std::array<py::ssize_t, 2> shape, double ring_share) {
    check_rows("lengths", lengths.length(), dots.id.size());
    for (const py::ssize_t side : shape) within(side, "shape", 0, 4096);
    const Grid grid{shape[0], shape[1]};
    for (py::ssize_t k = 0; shape[0] > 2 && shape[1] > 2 && k < dots.id.size(); ++k) within(dots.id[k], "id", 0, grid.size() - 1);
    return members<2>(water_ranges(light_path(path), dots, grid, lengths, ring_share));
}

void bind_water(py::module_& module) {
    using S = DotColours;
    record(module, "SeenColours", "What is measured at N dots.", field("ratios (N, 2)", &S::ratios), field("count (N)", &S::count),
           field("patchiness (N)", &S::patchiness), field("excess (N)", &S::excess), field("excess_sigma (N)", &S::excess_sigma),
           field("colour (N, 2)", &S::colour));
    using W = WaterColour;
    record(module, "WaterColour", "The colour of the water.", field("constants (2)", &W::constants),
           field("absorptions (2) [1e-6, 1e6]", &W::absorptions, "1/m"), field("noise (4)", &W::noise),
           field("disagree [1e-6, 1e6]", &W::disagree), field("patchy [0, 1e6]", &W::patchy));
    record(module, "Glare", "Light that the skin mirrors.", field("probability [1e-6, 1]", &Glare::probability),
           field("size [1e-6, 1e3]", &Glare::size));
    record(module, "SeenDots", "N dots of a grid, seen and at rest; lengths in m.", field("id (N)", &SeenDots::id),
           field("rays (N, 3)", &SeenDots::rays), field("rest_ranges (N)", &SeenDots::rest_ranges),
           field("rest_normals (N, 3)", &SeenDots::rest_normals));
    def(module, "ring_colours -> (N, 2), (N), (N), (N)",
        "Background around dots in an image, blue, green, red, on rings of radius px: ratios ln(blue / red), ln(green / red); brightness\n"
        "ln(red); number of 16 ring points used; patchiness. Points with blue below ink or above glare times the ring's upper quartile\n"
        "are left out.",
        colours, "image (H, W, 3)", "uv (N, 2)", "radius [0, 4096]", py::kw_only(), "ink", "glare");
    def(
        module, "path_lengths -> (N), (N), (N)",
        "Lengths, m, of the light's path in the water to points of the skin, m, their derivatives along the camera's rays, and the\n"
        "irradiance in units of the lamps' power. path: window_z, lamp_z, lamp_radius, m, ambient, and the camera's centre, m.",
        [](const double* path, const Doubles& positions, const double* normals) {
            return path_lengths(light_path(path), positions, normals);
        },
        "path (7)", "positions (N, 3)", "normals (N, 3)");
    def(module, "water_lengths -> (N), (N)", "Path lengths, m, in the water, and their standard deviations.", lengths_of_colours, "seen",
        "water", "glare");
    def(module, "water_ranges -> (N), (N)",
        "Ranges, m, at which the light's paths have the lengths, m, and the lengths' derivatives there. path: as of path_lengths; shape:\n"
        "rows and columns of the grid; ring_share: radius of the ring around a dot whose mean a length is, over the dots' pitch.",
        ranges, "path (7)", "lengths (N)", "dots", py::kw_only(), "shape", "ring_share [0, 10]");
}

// ---- The membrane.

constexpr int MAX_DOTS = 4096;  // 64 x 64; no printed pad has more

Grid grid_of(py::ssize_t rows, py::ssize_t columns, int smallest) {
    const Grid grid{within(rows, "rows", smallest, MAX_DOTS / smallest), within(columns, "columns", smallest, MAX_DOTS / smallest)};
    within(grid.size(), "rows * columns", smallest * smallest, MAX_DOTS);
    return grid;
}

const Integers& checked_id(const Integers& id, const Membrane& membrane) {
    for (py::ssize_t i = 0; i < id.length(); ++i) within(id[i], "id", 0, static_cast<double>(membrane.skin().grid.size() - 1));
    return id;
}

Membrane made_membrane(const Doubles& rest, int rows, int columns, const MembraneMaterial& material, const double* origin,
                       const MembraneModel& model) {
    const Grid grid = grid_of(rows, columns, 3);
    check_rows("rest", rest.length(), grid.size());
    return {Skin(grid, rest, material), vec3_at(origin, 0), model};
}

auto forces_at(const Membrane& membrane, const Doubles& xyz) {
    std::tuple<std::vector<double>, std::vector<double>> found{xyz.size, xyz.size};
    add_forces(membrane.skin(), xyz, std::get<0>(found).data(), std::get<1>(found).data());
    return found;
}

MembraneState solve(Membrane& membrane, const double* rays, const double* ranges, const double* sigma, const Integers& id) {
    return change(membrane, [&](Membrane& next) { return next.solve({checked_id(id, next), rays, ranges, sigma, id.length()}); });
}

DotLoads made_loads(const Doubles& xyz, const std::uint8_t* seen, const Doubles& normal, const Doubles& force, const Doubles& load) {
    return {xyz.vector(), {seen, seen + load.size}, normal.vector(), force.vector(), load.vector()};
}

void bind_membrane(py::module_& module) {
    using M = MembraneModel;
    record(module, "MembraneModel", "Constants of the positions and loads of dots: docs/constants.md.",
           field("misfit [0, 1e200]", &M::misfit),
           field("touched [0, 1e200]", &M::touched), field("lighter [0, 1e200]", &M::lighter), field("heavier [0, 1e200]", &M::heavier),
           field("coupling [0, 1e200]", &M::coupling), field("evidence [0, 1e200]", &M::evidence), field("most [0, 1e200]", &M::most),
           field("tail [0, 1e200]", &M::tail), field("smoothed [0, 1e200]", &M::smoothed), field("residual [0, 1e200]", &M::residual),
           field("correlated [0, 1e200]", &M::correlated));
    record(module, "SkinMaterial", "What the skin is made of.", field("stiffness", &MembraneMaterial::stiffness, "N/m, shear"),
           field("area_share", &MembraneMaterial::area_share), field("pressure", &MembraneMaterial::pressure, "Pa"));
    using S = MembraneState;
    class_of<S>(module, "MembraneState", "The membrane in one frame: all K dots of the grid by number, unseen ones interpolated.",
                get("xyz (K, 3)", &S::xyz, "m"), get("ranges (K)", &S::ranges, "m"), get("touched (K)", &S::touched, "probability"),
                get("seen (K) bool", &S::seen), get("fluid_pressure", &S::pressure, "Pa"));
    using L = DotLoads;
    auto loads = class_of<L>(module, "DotLoads", "Loads on all K dots of the grid in one frame, by number: src/touchpad/membrane.hpp.",
                             get("xyz (K, 3)", &L::xyz, "m"), get("seen (K) bool", &L::seen), get("normal (K, 3)", &L::normal),
                             get("force (K, 3)", &L::force, "N"), get("load (K)", &L::load, "over the fluid's pressure"));
    init(loads, made_loads, "xyz (K, 3)", "seen (K)", "normal (K, 3)", "force (K, 3)", "load (K)");
    auto membrane = class_of<Membrane>(
        module, "Membrane",
        "The membrane through the dots of a grid with rest positions, m, by number; origin: m, camera centre. It holds the last frame,\n"
        "can be copied, and is as it was after an exception.",
        get(
            "rest (K, 3)", [](const Membrane& one) { return one.skin().rest; }, "m"),
        get(
            "residual (K, 3)", [](const Membrane& one) { return one.skin().residual; }, "m^2, of the mesh at rest, over the pressure"),
        get("scale", &Membrane::scale, "factor on displacements along the rays, as learnt so far"), get("state", &Membrane::state),
        get("started", [](const Membrane& one) { return !one.state().xyz.empty(); }, "whether there is a last frame"));
    init(membrane, made_membrane, "rest (N, 3)", py::kw_only(), "rows", "columns", "material", "origin (3)",
         py::arg_v("model", M(), "MembraneModel()"));
    def(
        membrane, "take_rest", "Take another membrane's rest positions, of the same grid; the last frame stays.",
        [](Membrane& one, const Membrane& other) { one.set_rest(other.skin()); }, "other");
    def(membrane, "reset", "Drop the last frame. scale_sigma: of the relative error that all displacements share, 0: there is none.",
        &Membrane::reset, "scale_sigma");
    def(membrane, "forces -> (K, 3), (K, 3)", "Elastic force, N, on each dot at xyz, m, and its share, m^2, of the area vectors.",
        forces_at, "xyz (K, 3)");
    def(membrane, "solve", "MembraneState of the next frame, from ranges of dots id along unit rays, and their standard deviations, m.",
        solve, "rays (N, 3)", "ranges (N)", "sigma (N)", "id (N)");
    def(
        membrane, "loads", "DotLoads of the seen dots id at xyz, m.",
        [](const Membrane& one, const Integers& id, const double* xyz) { return one.loads(checked_id(id, one), xyz, id.length()); },
        "id (N)", "xyz (N, 3)");
}

// ---- Contact.

auto contact_of(const Doubles& points, const Doubles& border, const Integers& start, const Doubles& wide, const RegionShape& region,
                const RestCap& rest) {
    check_starts(start, border.length());
    const Nodes nodes{wide, wide.length(0), wide.length(1), 3};
    ContactPosition contact = contact_point(points, points.length(), region, {border, start, start.length() - 1}, nodes);
    const double depth = std::max(contact_depth(points, points.length(), rest, region.pitch), 0.0);  // or NaN
    return std::tuple(std::move(contact.position), std::move(contact.covariance), std::move(contact.normal), depth);
}

void check_size(const DotLoads& loads, py::ssize_t needed) {
    check_rows("loads", static_cast<py::ssize_t>(loads.load.size()), needed);
}

std::vector<double> scores(const BorderNetwork& network, const DotLoads& loads, int rows, int columns, double pitch) {
    const Grid grid = grid_of(rows, columns, 3);
    check_size(loads, grid.size());
    return border_scores(network, grid, loads, pitch);
}

std::vector<std::uint8_t> update(StickSlip& tracker, const DotLoads& loads, const Doubles& score, double seconds) {
    check_size(loads, tracker.size());
    return change(tracker, [&](StickSlip& next) { return next.update(loads, score.vector(), seconds); });
}

void bind_contact(py::module_& module) {
    using R = RegionShape;
    record(module, "RegionShape", "A region of dots.", field("centroid (3)", &R::centroid, "m"), field("normal (3)", &R::normal),
           field("area [0, 1e200]", &R::area, "m^2"), field("pitch [1e-200, 1e200]", &R::pitch, "m"), field("sigma", &R::sigma, "m"));
    record(module, "RestCap", "The surface at rest: a sphere's upper half.", field("centre_z [-1e200, 1e200]", &RestCap::centre_z, "m"),
           field("radius", &RestCap::radius, "m"));
    def(module, "contact_point",
        "Where the object stands in a region whose dots are at points, m: position (3,), m, its covariance (3, 3), normal (3,) of the\n"
        "surface there, and depth, m, NaN: unknown. border, start: of the region's polygons; rest: of the surface.",
        contact_of, "points (N, 3)", "border (M, 3)", "start (L=1..1000000000)", "wide (R=6..65536, C=6..65536, 3)", "region", "rest");
    def(
        module, "contact_forces -> (K, 3), (6)", "Forces, N, of the object on all dots of a grid, and their wrench, N and N m, at the origin.",
        [](const DotLoads& loads, int rows, int columns) {
            const Grid grid = grid_of(rows, columns, 3);
            check_size(loads, grid.size());
            return members<2>(contact_forces(loads, grid));
        },
        "loads", py::kw_only(), "rows", "columns");
    using Net = BorderNetwork;
    using Floats = Array<float>;
    auto network = class_of<Net, std::shared_ptr<Net>>(module, "BorderNetwork", "A network that estimates a dot's distance from a border.");
    init(
        network,
        [](const Floats& w1, const Floats& b1, const Floats& w2, const Floats& b2, const Floats& w3, float b3) {
            return std::make_shared<Net>(Net{w1.vector(), b1.vector(), w2.vector(), b2.vector(), w3.vector(), b3});
        },
        "weights_1 (51, 48)", "biases_1 (48)", "weights_2 (48, 16)", "biases_2 (16)", "weights_3 (16)", "bias_3");
    static_assert(Net::INPUTS == 51 && Net::FIRST == 48 && Net::SECOND == 16);
    def(network, "scores -> (K)", "Half a dot's distance from the border, pitches, plus 1/2, 0 to 1; pitch: m.", scores, "loads",
        py::kw_only(), "rows", "columns", "pitch [1e-9, 1e9]");
    using M = StickSlipModel;
    record(module, "StickSlipModel", "Constants of stick or slip, SI units: docs/stick_slip.md.",
           field("depth_noise [0, 1e200]", &M::depth_noise), field("strain [0, 1e200]", &M::strain), field("creep [0, 1e200]", &M::creep),
           field("slip [0, 1e200]", &M::slip), field("drift [0, 1e200]", &M::drift), field("acceleration [0, 1e200]", &M::acceleration),
           field("friction [0, 1e200]", &M::friction), field("friction_spread [0, 1e200]", &M::friction_spread),
           field("friction_noise [0, 1e200]", &M::friction_noise), field("aim [0, 1e200]", &M::aim), field("rate [0, 1e200]", &M::rate),
           field("share [0, 1e200]", &M::share));
    using T = TouchingObject;
    class_of<T>(module, "TouchingObject", "An object in contact. Modes: held, partly held, sliding, at rest.",
                get("count", &T::count, "dots judged, 0 of a new one"), get("odds (4)", &T::odds, "of the modes"),
                get("slipping (4)", &T::slipping, "share of the dots that slip in each mode"));
    auto tracker =
        class_of<StickSlip>(module, "StickSlip", "Which dots of a grid stick or slip, frame by frame; origin: m, camera centre.",
                            get("slipping (K)", &StickSlip::slipping, "probability that a dot slips, given that it touches; NaN: unknown"),
                            get("confidence (K)", &StickSlip::confidence, "probability of each dot's state; NaN: unknown"),
                            get("objects", &StickSlip::objects, "list of TouchingObject, largest first"),
                            get("friction", &StickSlip::friction, "coefficient of the object last seen"),
                            get("noise", &StickSlip::noise, "m, standard deviation of a dot's motion across its ray"));
    init(
        tracker,
        [](int rows, int columns, const Eigen::Vector3d& origin, const M& model) {
            return StickSlip(grid_of(rows, columns, 1), origin, model);
        },
        "rows", "columns", "origin (3)", py::arg_v("model", M(), "StickSlipModel()"));
    def(tracker, "update -> (K)",
        "States: 0 free, 1 sticking, 2 slipping, so many seconds after the last frame; score: over 0.5 in contact.", update, "loads",
        "score (K)", "seconds");
    def(tracker, "displacements -> (K, 2)", "m: displacement of the object over each dot in the last frame, along x and y; NaN: unknown.",
        &StickSlip::displacements);
    def(tracker, "motion", "Rotation and translation, m, of the largest object that holds dots, since the last frame; NaN: unknown.",
        [](const StickSlip& one) {
            const Eigen::Isometry3d motion = one.motion();
            return std::tuple(Eigen::Matrix3d(motion.linear()), Eigen::Vector3d(motion.translation()));
        });
}

}  // namespace

static void bind_touchpad(py::module_& parent) {
    py::module_ module = parent.def_submodule("touchpad", "The touchpad: colour to range, the membrane, contact, stick and slip.");
    module.attr("MAX_DOTS") = MAX_DOTS, module.attr("RING_POINTS") = RING_POINTS, module.attr("ZERO_WEIGHT_STEPS") = ZERO_WEIGHT_STEPS;
    bind_water(module);
    bind_membrane(module);
    bind_contact(module);
}

static const Subject SUBJECT("touchpad", bind_touchpad);

}  // namespace tactile::border
