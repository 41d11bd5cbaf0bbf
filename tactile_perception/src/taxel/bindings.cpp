// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The taxel array's compiled part for Python, as module _core.taxel. Arrays of taxels have R rows and C columns.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "taxel/estimator.hpp"

namespace tactile::border {
namespace {

using namespace taxel;
using Floats = Array<float>;
using Bytes = const std::uint8_t*;

Sheet sheet(const Floats& values) {
    return {values.length(0), values.length(1), values.vector()};
}

// The attributes of tactile_perception.taxel.response.Response and .Loop.
LayerLoop made_loop(const py::object& loop) {
    const auto number = [&](const char* name) { return loop.attr(name).cast<double>(); };
    const auto numbers = [&](const char* name) { return loop.attr(name).cast<std::vector<double>>(); };
    return {number("share"), number("reach"), number("relative"), number("relaxation"), number("at_once"), numbers("late"),
            numbers("late_s")};
}

std::vector<float> optional_floats(const py::object& owner, const char* name, Lengths& lengths) {
    const py::object given = owner.attr(name);
    const Rule rule(std::string(name) + " (R, C)");
    return given.is_none() ? std::vector<float>() : Taken<Floats>(given, &rule, lengths).value.vector();
}

ResponseCurve made_curve(const py::object& response, Lengths& lengths) {
    return {response.attr("scale").cast<std::array<double, 3>>(), response.attr("knee").cast<double>(),
            optional_floats(response, "gain", lengths)};
}

// settings: tactile_perception.taxel.estimator.TaxelSettings.
Estimator made_estimator(const ShearPad& pad, double stiffness, const py::object& settings, const std::vector<std::uint8_t>& dead,
                         bool by_depth, const MotionLimits& limits) {
    Lengths lengths;
    lengths['R'] = pad.rows, lengths['C'] = pad.columns;
    const py::object response = settings.attr("response");
    const auto number = [&](const char* name) {
        return within(settings.attr(name).cast<double>(), name, 1e-300, 1e300);
    };
    SignalSettings signal{number("reference_frames"), number("time_constant")};
    if (std::vector<float> zero = optional_floats(response, "zero", lengths); !zero.empty())
        signal.zero = Sheet{pad.rows, pad.columns, std::move(zero)};
    signal.zeroed = settings.attr("zeroed").cast<bool>();
    signal.dead = dead;
    signal.curve = made_curve(response, lengths);
    signal.loop = made_loop(response.attr("loop"));
    signal.noise_gain = response.attr("loop").attr("noise_gain").cast<double>();
    return Estimator({pad, stiffness, response.attr("known").cast<bool>(), by_depth}, std::move(signal), limits);
}

void bind_signal(py::module_& module) {
    def(module, "response_pressure -> (R, C)", "Pressure of changes of the values by a Response.", {"change (R, C)", "response"},
        [](const Floats& change, const py::object& response) {
            Lengths lengths;
            lengths['R'] = change.length(0), lengths['C'] = change.length(1);
            std::vector<float> pressure = change.vector();
            made_curve(response, lengths).apply(pressure);
            return pressure;
        });
    def(module, "filled -> (R, C)", "Values with missing ones filled by the mean of their neighbours.", {"values (R, C)", "missing (R, C)"},
        [](const Floats& values, const std::vector<std::uint8_t>& missing) {
            std::vector<float> filled = values.vector();
            fill(filled, missing, values.length(0), values.length(1));
            return filled;
        });
    auto hysteresis = class_of<Hysteresis>(module, "Hysteresis", "Undoes a Loop of the sensing layer frame by frame.");
    init(hysteresis, {"loop"}, [](const py::object& loop) { return Hysteresis(made_loop(loop)); });
    def(hysteresis, "undone -> (R, C)", "The load, Pa, behind the pressure shown, interval_s after the last frame.",
        {"shown (R, C)", "interval_s [0, 1e30]"},
        [](Hysteresis& one, const Floats& shown, double interval) { return one.undone(sheet(shown), interval); });
}

void bind_regions(py::module_& module) {
    module.attr("LEVEL") = LEVEL;
    def(module, "contact_score -> (R, C)", "Scores of pressure of noise sigma under a pad of thickness, taxels: src/taxel/region.hpp.",
        {"pressure (R, C)", "full (R, C)", "thickness [1e-6, 1e4]", "sigma"},
        [](const Floats& pressure, Bytes full, double thickness, double sigma) {
            const py::ssize_t rows = pressure.length(0), columns = pressure.length(1);
            return contact_score(pressure, full, rows, columns, ScoreRule::of(thickness, std::max<py::ssize_t>({rows, columns, 1}), sigma));
        });
    auto region =
        class_of<Region>(module, "Region", "One region, of one piece or of several: src/taxel/region.hpp.", {"outlines holes (M, 3)"});
    get(region, "centroid (3)", "m", &Region::centroid);
    auto regions =
        class_of<Regions>(module, "Regions", "Regions of an array: src/taxel/region.hpp.", {"labels near (R, C)", "touched (R, C) bool"});
    determine<Regions> = [](const Regions& one, Lengths& of) { of['C'] = one.columns; };
    def(module, "find_regions", "Regions where score exceeds LEVEL; pitch: m; reach: taxels, pieces nearer to each other are one region.",
        {"score (R, C)", "pressure (R, C)", "full (R, C)", "pitch [1e-9, 1e6]", "reach [0, 1e6]"},
        [](const Floats& score, const float* pressure, Bytes full, double pitch, double reach) {
            const py::ssize_t rows = score.length(0), columns = score.length(1);
            return find_regions(score, pressure, full, rows, columns, RegionRule::of(reach, std::max(rows, columns), pitch));
        });
}

void bind_shear(py::module_& module) {
    record<ShearPad>(module, "Pad", "A pad on an array of taxels: src/taxel/shear.hpp.",
                     {"rows columns [1, 1e4]", "pitch [1e-9, 1e6]", "thickness [1e-6, 1e4]", "stiffness [1e-30, 1e30]", "[0, 1e30]"});
    using S = SurfaceShear;
    auto shear = class_of<S>(module, "SurfaceShear", "Tangential displacement and traction of the surface of a pad: src/taxel/shear.hpp.");
    determine<S> = [](const S& one, Lengths& of) { of['R'] = one.pad().rows, of['C'] = one.pad().columns; };
    get(shear, "force", "(2,) N, of the object", [](const S& one) { return Eigen::Vector2d(one.force().data()); });
    init(shear, {"pad"}, [](const ShearPad& pad) { return S(pad); });
    def(shear, "move -> (2, R, C)", "Slip, m, of an object that moves by shift: m, m at the origin, rad. pressure: Pa.",
        {"touched (R, C)", "pressure (R, C)", "shift (3)"}, [](S& one, Bytes touched, const float* pressure, const Eigen::Vector3d& shift) {
            return change(one, [&](S& next) { return next.move(touched, pressure, {shift[0], shift[1], shift[2]}); });
        });
    def(
        shear, "pressure_centre", "(2,) m, where pressure acts on the pad's surface; friction: (2,) N of the object: src/taxel/shear.hpp.",
        {"pressure (R, C)", "touched (R, C)", "friction"},
        [](const S& one, const float* pressure, Bytes touched, const std::array<double, 2>& friction) {
            return Eigen::Vector2d(one.pressure_centre(pressure, touched, friction).data());
        },
        std::array<double, 2>{});
    def(shear, "traction_pressure -> (R, C)", "Pa: the pressure under the pad that the present traction causes.", {},
        &S::traction_pressure);
}

void bind_motion(py::module_& module) {
    record<MotionLimits>(module, "MotionLimits", "What decides of motion and slip, each with what it is: src/taxel/tracker.hpp.",
                         {"edge [1e-6, 1e6]", "traction curved [1e-9, 1e6]", "[0, 1e6]"});
    class_of<ObjectMotion>(module, "ObjectMotion", "Motion of the object in one frame; NaN where unknown: src/taxel/tracker.hpp.",
                           {"slipping (R, C) bool"});
    determine<ObjectMotion> = [](const ObjectMotion& one, Lengths& of) { of['C'] = one.columns; };
    using T = MotionTracker;
    auto tracker = class_of<T>(module, "MotionTracker", "Tracks all contacts of an array as one rigid object: src/taxel/tracker.hpp.");
    determine<T> = [](const T& one, Lengths& of) { determine<SurfaceShear>(one.shear, of); };
    init(
        tracker, {"pad", "limits"}, [](const ShearPad& pad, const MotionLimits& limits) { return T(pad, limits); }, MotionLimits());
    def(
        tracker, "process", "ObjectMotion in one frame, with touched not empty: PressedPad in src/taxel/tracker.hpp.",
        {"pressure (R, C)", "touched (R, C)", "seen (R, C)", "sigma", "stamp", "can_roll"},
        [](T& one, const float* pressure, Bytes touched, const float* seen, double sigma, double stamp, bool can_roll) {
            return one.process({pressure, touched, seen, sigma}, stamp, can_roll);
        },
        true);
}

void bind_estimator(py::module_& module) {
    record<Grasped>(module, "Grasped", "What is known of the object between two fingers: taxel/wrench.py.");
    class_of<Load>(module, "Load", "What a frame shows of the load: src/taxel/signal.hpp.", {"pressure (R, C)", "full (R, C) bool"});
    determine<Load> = [](const Load& one, Lengths& of) { of['C'] = one.columns; };
    class_of<Contact>(module, "Contact", "Fields of a ContactEstimate.");
    class_of<Sliding>(module, "Sliding", "Motion of the object over the pad: src/taxel/estimator.hpp.", {"x y vx vy (S)"});
    class_of<Points>(module, "Points", "Fields of SurfacePoints.", {"displacement force (K, 3)", "normal_force state (K)"});
    class_of<Found>(module, "Found", "All results of a frame: src/taxel/estimator.hpp.", {"outlines holes (M, 3)", "pressure (R, C)"});
    determine<Found> = [](const Found& one, Lengths& of) { of['C'] = one.columns; };
    auto estimator = class_of<Estimator>(module, "Estimator", "Contact of an array frame by frame: src/taxel/estimator.hpp.");
    determine<Estimator> = [](const Estimator& one, Lengths& of) {
        of['R'] = one.signal.dead.rows(), of['C'] = one.signal.dead.columns();
    };
    init(estimator, {"pad", "stiffness", "settings", "dead (R, C)", "by_depth", "limits"}, made_estimator);
    estimator.def_readwrite("grasped", &Estimator::grasped);
    get(estimator, "sigma", "standard deviation of a taxel's noise", [](const Estimator& one) { return one.signal.baseline.sigma(); });
    get(estimator, "looks_pressed", "whether the first frame may have held a contact",
        [](const Estimator& one) { return one.signal.baseline.looks_pressed(); });
    get(estimator, "dead (R, C) bool", "", [](const Estimator& one) { return one.signal.dead.dead(); });
    def(estimator, "set_reference", "The next frame is the untouched reference.", {}, &Estimator::set_reference);
    def(estimator, "process", "All results of a frame at stamp, s, by a model of the pad; full_scale: of a taxel, inf: not known.",
        {"frame (R, C)", "full_scale", "stamp"}, [](Estimator& one, const Floats& frame, double full_scale, double stamp) {
            return one.process(one.signal.load(sheet(frame), full_scale, stamp));
        });
    def(estimator, "load", "The load in a frame at stamp, s, for a method of its own.", {"frame (R, C)", "full_scale", "stamp"},
        [](Estimator& one, const Floats& frame, double full_scale, double stamp) {
            return one.signal.load(sheet(frame), full_scale, stamp);
        });
    def(estimator, "complete", "All results of a load whose contacts are at regions; centre: m, of the contact and of its pressure.",
        {"load", "regions", "centre (2)"}, [](Estimator& one, const Load& load, const Regions& regions, const Eigen::Vector2d& centre) {
            return one.complete(load, {regions, load.pressure, {}}, centre);
        });
    def(estimator, "points", "Points of a frame; slips: whether there is a slip that is not located.", {"found", "slips"},
        &Estimator::points);
}

}  // namespace

static void bind_taxel(py::module_& parent) {
    py::module_ module = parent.def_submodule("taxel", "The taxel array's compiled part: signal, contact regions, surface shear, motion.");
    bind_signal(module);
    bind_regions(module);
    bind_shear(module);
    bind_motion(module);
    bind_estimator(module);
}

static const Subject SUBJECT("taxel", bind_taxel);

}  // namespace tactile::border
