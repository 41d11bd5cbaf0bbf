// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The taxel array's compiled part for Python, as module _core.taxel. Arrays of taxels have R rows and C columns.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "taxel/mechanics.hpp"
#include "taxel/signal.hpp"

namespace tactile::taxel {

using border::Lengths;

inline void determine(const SurfaceShear& shear, Lengths& of) {
    of['R'] = shear.pad().rows, of['C'] = shear.pad().columns;
}
inline void determine(const MotionTracker& tracker, Lengths& of) {
    determine(tracker.shear, of);
}
inline void determine(const Mechanics& mechanics, Lengths& of) {
    determine(mechanics.tracker.shear, of);
}
inline void determine(const DeadTaxels& taxels, Lengths& of) {
    of['R'] = taxels.rows(), of['C'] = taxels.columns();
}
inline void determine(const Baseline& baseline, Lengths& of) {
    if (baseline.values().size()) of['R'] = baseline.values().rows, of['C'] = baseline.values().columns;
}
inline void determine(const Regions& regions, Lengths& of) {
    of['C'] = regions.columns;
}
inline void determine(const ObjectMotion& motion, Lengths& of) {
    of['C'] = motion.columns;
}
inline void determine(const Observation& seen, Lengths& of) {
    of['C'] = seen.regions.columns;
}

}  // namespace tactile::taxel

namespace tactile::border {
namespace {

using namespace taxel;
using Floats = Array<float>;
using Bytes = const std::uint8_t*;

Sheet sheet(const Floats& values) {
    return {values.length(0), values.length(1), values.vector()};
}

// ---- Signal.

Baseline made_baseline(double frames, double time_constant, const py::object& start, bool zeroed) {
    if (!(frames >= 1 && time_constant > 0))
        refuse("BadArgument", "baseline: need frames >= 1 and a positive time constant, got " + std::to_string(frames) + ", " +
                                  std::to_string(time_constant));
    if (start.is_none()) return {frames, time_constant, std::nullopt, zeroed};
    Lengths lengths;
    const Rule rule("start (R, C)");
    return {frames, time_constant, sheet(Taken<Floats>(start, &rule, lengths).get()), zeroed};
}

Hysteresis made_hysteresis(const py::object& loop) {
    const auto number = [&](const char* name) { return loop.attr(name).cast<double>(); };
    const auto numbers = [&](const char* name) { return loop.attr(name).cast<std::vector<double>>(); };
    return Hysteresis({number("share"), number("reach"), number("relative"), number("relaxation"), number("at_once"), numbers("late"),
                       numbers("late_s")});
}

py::object values_of(const Baseline& baseline) {
    const Sheet& sheet = baseline.values();
    return sheet.size() ? py::array_t<float>({sheet.rows, sheet.columns}, sheet.values.data()) : py::object(py::none());
}

void bind_signal(py::module_& module) {
    auto baseline = class_of<Baseline>(
        module, "Baseline", "Untouched value and noise of each taxel: src/taxel/signal.hpp. Raises BadArgument for numbers out of range.",
        get("sigma", &Baseline::sigma, "standard deviation of a taxel's noise"), get("values", values_of, "(R, C), None without any"),
        get("looks_pressed", &Baseline::looks_pressed, "whether the first frame may have held a contact"));
    init(baseline, made_baseline, "frames", "time_constant", py::arg("start") = py::none(), py::arg("zeroed") = false);
    def(baseline, "reset", "The next frame is the new baseline, or, with start, the one from calibration if there is one.",
        &Baseline::reset, py::arg("start") = true);
    def(
        baseline, "change -> (R, C)", "A frame minus the baseline, which a first frame becomes; full_scale: of a taxel, inf: not known.",
        [](Baseline& one, const Floats& frame, double full_scale) { return one.change(sheet(frame), full_scale); }, "frame (R, C)",
        py::arg("full_scale") = INFINITY);
    def(baseline, "follow", "Track with the quiet part of a frame's change, NaN is skipped, interval_s after the last frame.",
        &Baseline::follow, "change (R, C)", "touched (R, C)", "interval_s [0, 1e30]");
    auto dead = class_of<DeadTaxels>(module, "DeadTaxels", "Fills dead taxels and detects more of them: src/taxel/signal.hpp.",
                                     get("dead (R, C) bool", &DeadTaxels::dead));
    init(
        dead, [](const Array<bool>& known) { return DeadTaxels(reinterpret_cast<Bytes>(known.data), known.length(0), known.length(1)); },
        "known (R, C)");
    def(dead, "repaired -> (R, C)", "The change from the baseline with dead and NaN taxels filled; sigma: its noise.",
        &DeadTaxels::repaired, "change (R, C)", "sigma [0, 1e30]");
    auto hysteresis = class_of<Hysteresis>(module, "Hysteresis", "Undoes a Loop of the sensing layer frame by frame.");
    init(hysteresis, made_hysteresis, "loop");
    def(hysteresis, "reset", "Loads are as shown in the next frame.", &Hysteresis::reset);
    def(
        hysteresis, "undone -> (R, C)", "The load, Pa, behind the pressure shown, interval_s after the last frame.",
        [](Hysteresis& one, const Floats& shown, double interval) { return one.undone(sheet(shown), interval); }, "shown (R, C)",
        "interval_s [0, 1e30]");
}

// ---- Regions.

std::vector<float> score_of(const Floats& pressure, Bytes full, double thickness, double sigma) {
    const py::ssize_t rows = pressure.length(0), columns = pressure.length(1);
    return contact_score(pressure, full, rows, columns, ScoreRule::of(thickness, std::max<py::ssize_t>({rows, columns, 1}), sigma));
}

Regions regions_of(const Floats& score, const float* pressure, Bytes full, double pitch, double reach) {
    const py::ssize_t rows = score.length(0), columns = score.length(1);
    return find_regions(score, pressure, full, rows, columns, RegionRule::of(reach, std::max(rows, columns), pitch));
}

py::object moments_of(const std::array<double, 6>& integrals) {
    const auto& [area, x, y, xx, xy, yy] = integrals;
    const auto made = py::module_::import("tactile_perception.common.surface").attr("Moments");
    return made(area, Eigen::Vector3d(0, 0, area), Eigen::Vector3d(x, y, 0), Eigen::Vector3d(xx, xy, yy));
}

py::object total_of(const Regions& regions) {
    std::array<double, 6> sum{};
    for (const Region& region : regions.all)
        for (int k = 0; k < 6; ++k) sum[k] += region.integrals[k];
    return moments_of(sum);
}

py::list polygons(const std::vector<std::vector<double>>& loops) {
    py::list found;
    for (const auto& loop : loops) found.append(py::array_t<double>({loop.size() / 3, std::size_t{3}}, loop.data()));
    return found;
}

void bind_regions(py::module_& module) {
    module.attr("LEVEL") = LEVEL;
    def(module, "contact_score -> (R, C)",
        "Contact scores, 0 to 1, above LEVEL in contact, of pressure of noise sigma under a pad of thickness, taxels. full: saturated "
        "taxels.",
        score_of, "pressure (R, C)", "full (R, C)", "thickness [1e-6, 1e4]", "sigma");
    using R = Region;
    class_of<R>(module, "Region", "One region, of one piece or of several: src/taxel/region.hpp.", get("label", &R::label),
                get(
                    "outlines", [](const R& one) { return polygons(one.outlines); }, "of its pieces, (M, 3) m each"),
                get(
                    "holes", [](const R& one) { return polygons(one.holes); }, "in them, (M, 3) m each"),
                get(
                    "moments", [](const R& one) { return moments_of(one.integrals); }, "Moments, without the holes"),
                get("count", &R::count, "of taxels"), get("force", &R::force, "in the pressure's unit times m^2"), get("peak", &R::peak),
                get("at_edge", &R::at_edge), get("saturated", &R::saturated));
    using All = Regions;
    class_of<All>(module, "Regions", "Regions of an array: src/taxel/region.hpp.", get("all", &All::all, "Region, largest first"),
                  get("total", total_of, "Moments of all together"), get("labels (R, C)", &All::labels, "0 outside"),
                  get("near (R, C)", &All::near, "labels with the taxels around"), get("touched (R, C) bool", &All::touched),
                  get("broken", &All::broken, "whether the image has more pieces than fingers make"));
    def(module, "find_regions",
        "Regions where score exceeds LEVEL, with their share of pressure. full: saturated taxels; pitch: m; reach: taxels, pieces nearer "
        "to\n"
        "each other are one region.",
        regions_of, "score (R, C)", "pressure (R, C)", "full (R, C)", "pitch [1e-9, 1e6]", "reach [0, 1e6]");
}

// ---- Shear and motion.

void bind_shear(py::module_& module) {
    using P = ShearPad;
    record(module, "Pad", "A pad on an array of taxels: src/taxel/shear.hpp.", field("rows [1, 1e4]", &P::rows),
           field("columns [1, 1e4]", &P::columns), field("pitch [1e-9, 1e6]", &P::pitch, "m"),
           field("thickness [1e-6, 1e4]", &P::thickness, "taxels"), field("stiffness [1e-30, 1e30]", &P::stiffness, "Pa/m"),
           field("friction [0, 1e30]", &P::friction));
    using S = SurfaceShear;
    auto shear =
        class_of<S>(module, "SurfaceShear",
                    "Tangential displacement and traction of the surface of a pad: coupled bristles (the paper's virtual cantilevers),\n"
                    "held by the pad's shear stiffness, that follow the object up to friction times pressure.",
                    get("force", [](const S& one) { return Eigen::Vector2d(one.force().data()); }, "(2,) N, of the object"));
    init(shear, [](const P& pad) { return S(pad); }, "pad");
    def(shear, "reset", "Release all traction.", &S::reset);
    def(
        shear, "move -> (2, R, C)", "Slip, m, of an object that moves by shift: m, m at the origin, rad. pressure: Pa.",
        [](S& one, Bytes touched, const float* pressure, const Eigen::Vector3d& shift) {
            return change(one, [&](S& next) { return next.move(touched, pressure, {shift[0], shift[1], shift[2]}); });
        },
        "touched (R, C)", "pressure (R, C)", "shift (3)");
    def(
        shear, "pressure_of -> (R, C)", "Pressure under the pad that a traction causes by its convergence, in its unit.",
        [](const S& one, const float* traction) { return one.pressure_of(traction); }, "traction (2, R, C)");
    def(
        shear, "pressure_centre",
        "(2,) m, where pressure acts on the pad's surface, of which pressure, Pa, acts on the taxels under touched and around; friction:\n"
        "(2,) N of the object. NaN without load, and for more friction than it can hold.",
        [](const S& one, const float* pressure, Bytes touched, const std::array<double, 2>& friction) {
            return Eigen::Vector2d(one.pressure_centre(pressure, touched, friction).data());
        },
        "pressure (R, C)", "touched (R, C)", py::arg("friction") = std::array<double, 2>{});
    def(shear, "traction_pressure -> (R, C)", "Pa: the pressure under the pad that the present traction causes.", &S::traction_pressure);
}

void bind_motion(py::module_& module) {
    using L = MotionLimits;
    record(module, "MotionLimits", "What decides of motion and slip, each with what it is: src/taxel/tracker.hpp.",
           field("edge [1e-6, 1e6]", &L::edge), field("key_moved [0, 1e6]", &L::key_moved), field("load_s [0, 1e6]", &L::load_s),
           field("load_change [0, 1e6]", &L::load_change), field("bound [0, 1e6]", &L::bound), field("begins [0, 1e6]", &L::begins),
           field("creep [0, 1e6]", &L::creep), field("lag [0, 1e6]", &L::lag), field("traction [1e-9, 1e6]", &L::traction),
           field("curved [1e-9, 1e6]", &L::curved));
    using M = ObjectMotion;
    class_of<M>(module, "ObjectMotion", "Motion of the object in one frame, at the sensor's origin; NaN where unknown.",
                get("linear (2)", &M::linear, "m/s"), get("turn", &M::turn, "rad/s"), get("slipping (R, C) bool", &M::slipping),
                get("step (2)", &M::step, "m, since the last frame"), get("step_turn", &M::step_turn, "rad, since the last frame"),
                get("unseen", &M::unseen, "probability that an object that slips is not seen to"),
                get("step_covariance (3, 3)", &M::step_covariance, "of step and step_turn"),
                get("velocity_covariance (3, 3)", &M::velocity_covariance, "of linear and turn"));
    using T = MotionTracker;
    auto tracker = class_of<T>(module, "MotionTracker", "Tracks all contacts of an array as one rigid object.", get("shear", &T::shear),
                               get("lead (2)", &T::lead, "m, by which traction moves the border of the picture"));
    init(tracker, [](const ShearPad& pad, const L& limits) { return T(pad, limits); }, "pad", py::arg_v("limits", L{}, "MotionLimits()"));
    def(tracker, "reset", "Nothing touches.", &T::reset);
    def(
        tracker, "process",
        "ObjectMotion in one frame at stamp, s, with pressure, Pa, without the part that traction causes, and touched, not empty; seen: "
        "the\n"
        "pressure with that part, of noise sigma; can_roll: whether the object can roll over the pad.",
        [](T& one, const float* pressure, Bytes touched, const float* seen, double sigma, double stamp, bool can_roll) {
            return one.process({pressure, touched, seen, sigma}, stamp, can_roll);
        },
        "pressure (R, C)", "touched (R, C)", "seen (R, C)", "sigma", "stamp", py::arg("can_roll") = true);
    class_of<Observation>(module, "Observation", "What one frame shows.", get("regions", &Observation::regions),
                          get("surface (R, C)", &Observation::surface, "pressure without the part that traction causes"),
                          get("motion", &Observation::motion, "ObjectMotion, None where nothing touches"));
    auto mechanics =
        class_of<Mechanics>(module, "Mechanics", "Contact regions and the object's motion in each frame: src/taxel/mechanics.hpp.",
                            get("tracker", &Mechanics::tracker));
    init(
        mechanics, [](const ShearPad& pad, const L& limits, bool known) { return Mechanics(pad, limits, known); }, "pad", "limits",
        "known");
    def(mechanics, "reset", "Nothing touches.", &Mechanics::reset);
    def(mechanics, "process",
        "Observation of pressure of noise sigma at stamp, s. full: saturated taxels; can_roll: whether the object can roll over the pad.",
        &Mechanics::process, "pressure (R, C)", "sigma", "full (R, C)", "stamp", "can_roll");
}

}  // namespace

static void bind_taxel(py::module_& parent) {
    py::module_ module = parent.def_submodule("taxel", "The taxel array's compiled part: signal, contact regions, surface shear, motion.");
    bind_signal(module);
    bind_regions(module);
    bind_shear(module);
    bind_motion(module);
}

static const Subject SUBJECT("taxel", bind_taxel);

}  // namespace tactile::border
