// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The touchpad for Python: colour to range, the membrane, contact, stick and slip.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "touchpad/contact.hpp"
#include "touchpad/contact_point.hpp"
#include "touchpad/dot_classifier.hpp"
#include "touchpad/dot_locator.hpp"
#include "touchpad/stick_slip.hpp"
#include "touchpad/water.hpp"

namespace tactile::border {
namespace {

using Doubles = Array<double>;
using Integers = Array<std::int64_t>;

constexpr int MAX_DOTS = 4096;  // 64 x 64; no printed pad has more

Grid grid_of(std::ptrdiff_t rows, std::ptrdiff_t columns, int smallest = 3) {
    const Grid grid{within(rows, "rows", smallest, MAX_DOTS / smallest), within(columns, "columns", smallest, MAX_DOTS / smallest)};
    within(grid.size(), "rows * columns", smallest * smallest, MAX_DOTS);
    return grid;
}

template <class Ids>
const Ids& checked_id(const Ids& id, const Grid& grid) {
    for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(id.size()); ++i) within(id[i], "id", 0, grid.size() - 1);
    return id;
}

const std::vector<double>& checked_rest(const Membrane& membrane, const std::vector<double>& rest) {
    check_rows("rest", static_cast<py::ssize_t>(rest.size() / 3), membrane.skin().grid.size());
    return rest;
}

const DotLoads& checked_size(const DotLoads& loads, py::ssize_t needed) {
    check_rows("loads", static_cast<py::ssize_t>(loads.load.size()), needed);
    return loads;
}

const WaterColour& checked_noise(const WaterColour& water) {
    within(water.noise[0] * water.noise[3] - water.noise[1] * water.noise[2], "noise", 1e-300, 1e300);
    return water;
}

void bind_water(py::module_& module) {
    class_of<RingColours>(module, "RingColours", "Background around dots: src/touchpad/water.hpp.", {"ratios (N, 2)"});
    def(module, "ring_colours", "RingColours in an image, blue, green, red, on rings of radius px, between the levels ink and glare.",
        {"image (H, W, 3)", "uv (N, 2)", "radius [0, 4096]", "ink", "glare"}, ring_colours);
    def(module, "path_lengths -> (N), (N), (N)",
        "Lengths, m, of the light's path in the water to points of the skin, m, their derivatives along the camera's rays, and the\n"
        "irradiance in units of the lamps' power. path: window_z, lamp_z, lamp_radius, m, ambient, and the camera's centre, m.",
        {"path (7)", "positions (N, 3)", "normals (N, 3)"}, [](const double* path, const Doubles& positions, const double* normals) {
            return path_lengths(light_path(path), positions, normals);
        });
    record<DotColours>(module, "SeenColours", "What is measured at N dots: src/touchpad/water.hpp.");
    record<WaterColour>(module, "WaterColour", "The colour of the water.", {"absorptions disagree [1e-6, 1e6]", "patchy [0, 1e6]"});
    record<Glare>(module, "Glare", "Light that the skin mirrors.", {"probability [1e-6, 1]", "size [1e-6, 1e3]"});
    class_of<WaterLengths>(module, "WaterLengths", "Path lengths (N), m, in the water, and their standard deviations.");
    def(module, "water_lengths", "WaterLengths of colours.", {"seen", "water", "glare"},
        [](const DotColours& seen, const WaterColour& water, const Glare& glare) {
            return water_lengths(checked_noise(water), glare, seen);
        });
    record<SeenDots>(module, "SeenDots", "N dots of a grid, seen and at rest; lengths in m.");
    class_of<WaterRanges>(module, "WaterRanges", "Ranges (N), m, and the derivatives of the light's path length there.");
    def(module, "water_ranges",
        "WaterRanges of path lengths, m; ring_share: radius of the ring whose mean a length is, over the dots' pitch.",
        {"path (7)", "dots", "rows [0, 4096]", "columns [0, 4096]", "lengths (N)", "ring_share [0, 10]"},
        [](const double* path, const SeenDots& dots, std::ptrdiff_t rows, std::ptrdiff_t columns, const Doubles& lengths, double share) {
            check_rows("lengths", lengths.length(), dots.id.size());
            if (rows > 2 && columns > 2) checked_id(dots.id, {rows, columns});
            return water_ranges(light_path(path), dots, {rows, columns}, lengths, share);
        });
}

void bind_membrane(py::module_& module) {
    record<MembraneModel>(module, "MembraneModel", "Constants of the positions and loads of dots: docs/constants.md.", {"[0, 1e200]"});
    record<MembraneMaterial>(module, "SkinMaterial", "What the skin is made of: N/m shear stiffness, share of the area, Pa at rest.");
    class_of<MembraneState>(module, "MembraneState",
                            "All K dots of the grid in one frame, unseen ones interpolated: src/touchpad/membrane.hpp.",
                            {"xyz (K, 3)", "seen (K) bool"});
    record<DotLoads>(module, "DotLoads", "Loads on all K dots of the grid in one frame: src/touchpad/membrane.hpp.",
                     {"xyz normal force (K, 3)", "seen (K) bool", "load (K)"});
    auto membrane =
        class_of<Membrane>(module, "Membrane",
                           "The membrane through the dots of a grid with rest positions, m, by number; origin: m, camera centre.\n"
                           "It holds the last frame.");
    determine<Membrane> = [](const Membrane& one, Lengths& of) { of['K'] = one.skin().grid.size(); };
    get(membrane, "rest (K, 3)", "m", [](const Membrane& one) { return one.skin().rest; });
    get(membrane, "residual (K, 3)", "m^2, of the mesh at rest, over the pressure",
        [](const Membrane& one) { return one.skin().residual; });
    get(membrane, "scale", "factor on displacements along the rays, as learnt so far", &Membrane::scale);
    get(membrane, "state", "MembraneState of the last frame", &Membrane::state);
    init(
        membrane, {"rest (N, 3)", "rows", "columns", "material", "origin (3)", "model"},
        [](const Doubles& rest, int rows, int columns, const MembraneMaterial& material, const Eigen::Vector3d& origin,
           const MembraneModel& model) {
            check_rows("rest", rest.length(), grid_of(rows, columns).size());
            return Membrane(Skin({rows, columns}, rest, material), origin, model);
        },
        MembraneModel());
    def(membrane, "take_rest", "Take another membrane's rest positions, of the same grid; the last frame stays.", {"other"},
        [](Membrane& one, const Membrane& other) { one.set_rest(other.skin()); });
    def(membrane, "reset", "Drop the last frame. scale_sigma: of the relative error that all displacements share, 0: there is none.",
        {"scale_sigma"}, &Membrane::reset);
    def(membrane, "forces -> (K, 3), (K, 3)", "Elastic force, N, on each dot at xyz, m, and its share, m^2, of the area vectors.",
        {"xyz (K, 3)"}, [](const Membrane& one, const Doubles& xyz) {
            std::tuple<std::vector<double>, std::vector<double>> found{xyz.size, xyz.size};
            add_forces(one.skin(), xyz, std::get<0>(found).data(), std::get<1>(found).data());
            return found;
        });
    def(membrane, "solve", "MembraneState of the next frame, from ranges of dots id along unit rays, and their standard deviations, m.",
        {"rays (N, 3)", "ranges (N)", "sigma (N)", "id (N)"},
        [](Membrane& one, const double* rays, const double* ranges, const double* sigma, const std::vector<std::int64_t>& id) {
            checked_id(id, one.skin().grid);
            const SeenRanges seen{id.data(), rays, ranges, sigma, static_cast<std::ptrdiff_t>(id.size())};
            return one.solve(seen);
        });
    def(membrane, "loads", "DotLoads of the seen dots id at xyz, m.", {"id (N)", "xyz (N, 3)"},
        [](const Membrane& one, const std::vector<std::int64_t>& id, const double* xyz) {
            return one.loads(checked_id(id, one.skin().grid).data(), xyz, static_cast<std::ptrdiff_t>(id.size()));
        });
    record<PadWater>(module, "PadWater", "Light and water of a pad: src/touchpad/dot_locator.hpp.",
                     {"ring [0, 4096]", "ring_share [0, 10]"});
    record<PadGlare>(module, "PadGlare", "Glare of a pad: src/touchpad/dot_locator.hpp.", {"min_ratio [1e-6, 1]"});
    class_of<LocatedDots>(module, "LocatedDots", "Positions of the dots of one frame: src/touchpad/dot_locator.hpp.", {"xyz (N, 3)"});
    auto locator = class_of<DotLocator>(module, "DotLocator",
                                        "Locates the dots of a touchpad, frame by frame. rest: m, of the untouched dots, NaN: unknown.");
    init(locator, {"camera", "membrane", "rest (K, 3)"},
         [](const Camera& camera, const Membrane& membrane, const std::vector<double>& rest) {
             return DotLocator(camera, membrane, checked_rest(membrane, rest));
         });
    def(locator, "take_rest", "Take other positions of the untouched dots.", {"membrane", "rest (K, 3)"},
        [](DotLocator& one, const Membrane& membrane, const std::vector<double>& rest) {
            one.set_rest(membrane, checked_rest(membrane, rest));
        });
    def(locator, "take_water", "Take another water and glare, None for none, and drop the last frame; scale_sigma: see Membrane.reset.",
        {"water", "glare", "scale_sigma"}, [](DotLocator& one, const PadWater& water, const std::optional<PadGlare>& glare, double sigma) {
            checked_noise(water.colour);
            one.set_water(water, glare, sigma);
        });
    def(locator, "locate", "LocatedDots id at uv, px, in an image, blue, green, red.", {"image (H, W, 3)", "uv (N, 2)", "id (N)"},
        [](DotLocator& one, const Array<std::uint8_t>& image, const Doubles& uv, const std::vector<std::int64_t>& id) {
            return one.locate(image, uv, checked_id(id, one.membrane().skin().grid));
        });
}

void bind_contact(py::module_& module) {
    record<RegionShape>(module, "RegionShape", "A region of dots: src/touchpad/contact_point.hpp.",
                        {"area [0, 1e200]", "pitch [1e-200, 1e200]"});
    record<RestCap>(module, "RestCap", "The surface at rest: a sphere's upper half, m.", {"centre_z [-1e200, 1e200]"});
    class_of<ContactPosition>(module, "ContactPosition", "Where the object stands: src/touchpad/contact_point.hpp.");
    def(module, "contact_point", "ContactPosition in a region of dots at points, m. border, start: of the region's polygons.",
        {"points (N, 3)", "border (M, 3)", "start (L=1..1000000000)", "wide (R=6..65536, C=6..65536, 3)", "region", "rest"},
        [](const Doubles& points, const Doubles& border, const Integers& start, const Doubles& wide, const RegionShape& region,
           const RestCap& rest) {
            check_starts(start, border.length());
            const RegionBorder polygons{border, start, start.length() - 1};
            ContactPosition contact = contact_point(points, points.length(), region, polygons, nodes_of(wide));
            contact.depth = std::max(contact_depth(points, points.length(), rest, region.pitch), 0.0);  // or NaN
            return contact;
        });
    using Net = BorderNetwork;
    static_assert(Net::INPUTS == 51 && Net::FIRST == 48 && Net::SECOND == 16);
    auto network =
        record<Net>(module, "BorderNetwork", "A network that estimates a dot's distance from a border: src/touchpad/contact.hpp.",
                    {"weights_1 (51, 48)", "biases_1 (48)", "weights_2 (48, 16)", "biases_2 (16)", "weights_3 (16)"});
    def(network, "scores -> (K)", "Half a dot's distance from the border, pitches, plus 1/2, 0 to 1; pitch: m.",
        {"loads", "rows", "columns", "pitch [1e-9, 1e9]"}, [](const Net& one, const DotLoads& loads, int rows, int columns, double pitch) {
            return border_scores(one, {rows, columns}, checked_size(loads, grid_of(rows, columns).size()), pitch);
        });
    record<StickSlipModel>(module, "StickSlipModel", "Constants of stick or slip, SI units: docs/stick_slip.md.", {"[0, 1e200]"});
    class_of<TouchingObject>(module, "TouchingObject", "An object in contact: src/touchpad/stick_slip.hpp.");
    auto tracker = class_of<StickSlip>(module, "StickSlip", "Which dots of a grid stick or slip: src/touchpad/stick_slip.hpp.");
    determine<StickSlip> = [](const StickSlip& one, Lengths& of) { of['K'] = one.size(); };
    get(tracker, "slipping (K)", "probability that a dot slips, given that it touches; NaN: unknown", &StickSlip::slipping);
    get(tracker, "confidence (K)", "probability of each dot's state; NaN: unknown", &StickSlip::confidence);
    get(tracker, "objects", "list of TouchingObject, largest first", &StickSlip::objects);
    get(tracker, "friction", "coefficient of the object last seen", &StickSlip::friction);
    get(tracker, "noise", "m, standard deviation of a dot's motion across its ray", &StickSlip::noise);
    init(
        tracker, {"rows", "columns", "origin (3)", "model"},
        [](int rows, int columns, const Eigen::Vector3d& origin, const StickSlipModel& model) {
            return StickSlip(grid_of(rows, columns, 1), origin, model);
        },
        StickSlipModel());
    def(tracker, "update -> (K)",
        "States: 0 free, 1 sticking, 2 slipping, so many seconds after the last frame; score: over 0.5 in contact.",
        {"loads", "score (K)", "seconds"}, [](StickSlip& one, const DotLoads& loads, const std::vector<double>& score, double seconds) {
            checked_size(loads, one.size());
            return change(one, [&](StickSlip& next) { return next.update(loads, score, seconds); });
        });
    def(tracker, "displacements -> (K, 2)", "m: displacement of the object over each dot in the last frame, along x and y; NaN: unknown.",
        {}, &StickSlip::displacements);
    record<RigidMotion>(module, "RigidMotion", "The motion q = rotation @ p + translation, m.");
    def(module, "fit_rigid",
        "RigidMotion from points p to q, m, by least squares (Kabsch 1976); None if they do not determine it: fewer than three, or\n"
        "collinear.",
        {"p (N, 3)", "q (N, 3)"}, [](const Doubles& p, const double* q) { return fit_rigid(p, q, p.length()); });
    auto reference =
        class_of<StickingReference>(module, "StickingReference", "Dots that have stuck since a start: src/touchpad/rigid_motion.hpp.");
    init(reference, {}, [] { return StickingReference(); });
    def(reference, "corrected", "RigidMotion of an object since the last frame, by dots at xyz, m, that stick to it.",
        {"xyz (K, 3)", "sticks (K)", "motion"},
        [](StickingReference& one, const std::vector<double>& xyz, const std::vector<std::uint8_t>& sticks, const RigidMotion& motion) {
            return one.corrected(xyz, sticks, motion);
        });
    class_of<ClassifiedDots>(module, "ClassifiedDots", "States of the dots of one frame: src/touchpad/dot_classifier.hpp.",
                             {"displacements (N, 2)", "xyz force (K, 3)"});
    auto classifier = class_of<DotClassifier>(module, "DotClassifier", "Classifies the dots of a touchpad, frame by frame.");
    init(classifier, {"membrane", "network", "model"},
         [](const Membrane& membrane, const BorderNetwork& network, const StickSlipModel& model) {
             return DotClassifier(membrane, network, model);
         });
    def(classifier, "take_rest", "Take another membrane's rest positions, of the same grid.", {"other"}, &DotClassifier::set_rest);
    def(classifier, "classify",
        "ClassifiedDots of the seen dots id at xyz, m, so many seconds after the last frame; None if all positions are collinear.",
        {"id (N)", "xyz (N, 3)", "seconds"},
        [](DotClassifier& one, const std::vector<std::int64_t>& id, const Doubles& xyz, double seconds) {
            checked_id(id, one.membrane().skin().grid);
            const bool is_line = id.size() > 2 && are_collinear(xyz, xyz.length());
            return is_line ? std::nullopt : std::optional(one.classify(id, xyz, seconds));
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
