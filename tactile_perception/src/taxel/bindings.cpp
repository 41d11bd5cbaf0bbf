// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The taxel array's compiled part for Python, as module _core.taxel. Arrays of taxels have R rows and C columns.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "taxel/mechanics.hpp"
#include "taxel/signal.hpp"

namespace tactile::border {
namespace {

using namespace taxel;
using Floats = Array<float>;
using Bytes = const std::uint8_t*;

Sheet sheet(const Floats& values) {
    return {values.length(0), values.length(1), values.vector()};
}

Hysteresis made_hysteresis(const py::object& loop) {
    const auto number = [&](const char* name) { return loop.attr(name).cast<double>(); };
    const auto numbers = [&](const char* name) { return loop.attr(name).cast<std::vector<double>>(); };
    return Hysteresis({number("share"), number("reach"), number("relative"), number("relaxation"), number("at_once"), numbers("late"),
                       numbers("late_s")});
}

void bind_signal(py::module_& module) {
    auto baseline = class_of<Baseline>(module, "Baseline", "Untouched value and noise of each taxel: src/taxel/signal.hpp.");
    determine<Baseline> = [](const Baseline& one, Lengths& of) {
        if (one.values().size()) of['R'] = one.values().rows, of['C'] = one.values().columns;
    };
    get(baseline, "sigma", "standard deviation of a taxel's noise", &Baseline::sigma);
    get(baseline, "values (R, C)", "(0, 0) without any", [](const Baseline& one) { return one.values().values; });
    get(baseline, "looks_pressed", "whether the first frame may have held a contact", &Baseline::looks_pressed);
    init(
        baseline, {"frames [1, 1e300]", "time_constant [1e-300, 1e300]", "start (R, C)", "zeroed"},
        [](double frames, double time_constant, const Floats& start, bool zeroed) {
            return Baseline(frames, time_constant, start.size ? std::optional(sheet(start)) : std::nullopt, zeroed);
        },
        py::array_t<float>(std::vector<py::ssize_t>{0, 0}), false);
    def(baseline, "reset", "The next frame is the new baseline, or, with start, the one from calibration if there is one.", {"start"},
        &Baseline::reset, true);
    def(
        baseline, "change -> (R, C)", "A frame minus the baseline, which a first frame becomes; full_scale: of a taxel, inf: not known.",
        {"frame (R, C)", "full_scale"},
        [](Baseline& one, const Floats& frame, double full_scale) { return one.change(sheet(frame), full_scale); }, INFINITY);
    def(baseline, "follow", "Track with the quiet part of a frame's change, NaN is skipped, interval_s after the last frame.",
        {"change (R, C)", "touched (R, C)", "interval_s [0, 1e30]"}, &Baseline::follow);
    auto dead = class_of<DeadTaxels>(module, "DeadTaxels", "Fills dead taxels and detects more of them: src/taxel/signal.hpp.");
    determine<DeadTaxels> = [](const DeadTaxels& one, Lengths& of) { of['R'] = one.rows(), of['C'] = one.columns(); };
    get(dead, "dead (R, C) bool", "", &DeadTaxels::dead);
    init(dead, {"known (R, C)"},
         [](const Array<bool>& known) { return DeadTaxels(reinterpret_cast<Bytes>(known.data), known.length(0), known.length(1)); });
    def(dead, "repaired -> (R, C)", "The change from the baseline with dead and NaN taxels filled; sigma: its noise.",
        {"change (R, C)", "sigma [0, 1e30]"}, &DeadTaxels::repaired);
    auto hysteresis = class_of<Hysteresis>(module, "Hysteresis", "Undoes a Loop of the sensing layer frame by frame.");
    init(hysteresis, {"loop"}, made_hysteresis);
    def(hysteresis, "reset", "Loads are as shown in the next frame.", {}, &Hysteresis::reset);
    def(hysteresis, "undone -> (R, C)", "The load, Pa, behind the pressure shown, interval_s after the last frame.",
        {"shown (R, C)", "interval_s [0, 1e30]"},
        [](Hysteresis& one, const Floats& shown, double interval) { return one.undone(sheet(shown), interval); });
}

py::object moments_of(const std::array<double, 6>& integrals) {
    const auto& [area, x, y, xx, xy, yy] = integrals;
    const auto made = py::module_::import("tactile_perception.common.surface").attr("Moments");
    return made(area, Eigen::Vector3d(0, 0, area), Eigen::Vector3d(x, y, 0), Eigen::Vector3d(xx, xy, yy));
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
    get(region, "moments", "Moments, without the holes", [](const Region& one) { return moments_of(one.integrals); });
    auto regions =
        class_of<Regions>(module, "Regions", "Regions of an array: src/taxel/region.hpp.", {"labels near (R, C)", "touched (R, C) bool"});
    determine<Regions> = [](const Regions& one, Lengths& of) { of['C'] = one.columns; };
    get(regions, "total", "Moments of all together", [](const Regions& one) {
        std::array<double, 6> sum{};
        for (const Region& region : one.all)
            for (int k = 0; k < 6; ++k) sum[k] += region.integrals[k];
        return moments_of(sum);
    });
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
    def(shear, "reset", "Release all traction.", {}, &S::reset);
    def(shear, "move -> (2, R, C)", "Slip, m, of an object that moves by shift: m, m at the origin, rad. pressure: Pa.",
        {"touched (R, C)", "pressure (R, C)", "shift (3)"}, [](S& one, Bytes touched, const float* pressure, const Eigen::Vector3d& shift) {
            return change(one, [&](S& next) { return next.move(touched, pressure, {shift[0], shift[1], shift[2]}); });
        });
    def(shear, "pressure_of -> (R, C)", "Pressure under the pad that a traction causes by its convergence, in its unit.",
        {"traction (2, R, C)"}, [](const S& one, const float* traction) { return one.pressure_of(traction); });
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
    def(tracker, "reset", "Nothing touches.", {}, &T::reset);
    def(
        tracker, "process", "ObjectMotion in one frame, with touched not empty: PressedPad in src/taxel/tracker.hpp.",
        {"pressure (R, C)", "touched (R, C)", "seen (R, C)", "sigma", "stamp", "can_roll"},
        [](T& one, const float* pressure, Bytes touched, const float* seen, double sigma, double stamp, bool can_roll) {
            return one.process({pressure, touched, seen, sigma}, stamp, can_roll);
        },
        true);
    class_of<Observation>(module, "Observation", "What one frame shows: src/taxel/mechanics.hpp.", {"surface (R, C)"});
    determine<Observation> = [](const Observation& one, Lengths& of) { of['C'] = one.regions.columns; };
    auto mechanics =
        class_of<Mechanics>(module, "Mechanics", "Contact regions and the object's motion in each frame: src/taxel/mechanics.hpp.");
    determine<Mechanics> = [](const Mechanics& one, Lengths& of) { determine<SurfaceShear>(one.tracker.shear, of); };
    init(mechanics, {"pad", "limits", "known"},
         [](const ShearPad& pad, const MotionLimits& limits, bool known) { return Mechanics(pad, limits, known); });
    def(mechanics, "reset", "Nothing touches.", {}, &Mechanics::reset);
    def(mechanics, "process", "Observation of pressure of noise sigma at stamp, s. full: saturated taxels.",
        {"pressure (R, C)", "sigma", "full (R, C)", "stamp", "can_roll"}, &Mechanics::process);
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
