// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Presses of sheets and domes for Python, as module _core.press.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "press/dome.hpp"
#include "press/sheet_fit.hpp"
#include "press/sheet_membrane.hpp"

namespace tactile::border {
namespace {

// ---- Sheets.

// Side of a square of so many elements.
py::ssize_t side_of(const char* name, py::ssize_t size, py::ssize_t smallest) {
    const py::ssize_t side = std::lround(std::sqrt(static_cast<double>(size)));
    check_rows(name, size, std::max(side, smallest) * std::max(side, smallest));
    return within(side, name, smallest, 1000);
}

using Doubles = Array<double>;
using Floats = Array<float>;

// mesh: of press/sheet/mechanics.py.
auto pressed_sheet(const py::object& mesh, const SheetLoad& load, const Doubles& depths) {
    Attributes of{mesh};
    const auto weight = of.take<Doubles>("weight (E, 4)"), value = of.take<Doubles>("value (E, 4, 9)");
    const auto slope = of.take<Doubles>("slope (E, 4, 2, 9)"), laplacian = of.take<Doubles>("laplacian (E, 4, 9)");
    const auto rest = of.take<Doubles>("rest (E, 4, 2)");
    const py::ssize_t spans = side_of("weight", of.lengths['E'], 2), count = depths.length(), size = count * (spans + 2) * (spans + 2) * 3;
    for (py::ssize_t k = 1; k < count; ++k)
        if (depths[k] <= depths[k - 1]) throw py::value_error("depths: each must be larger than the one before");
    const SheetElements sheet{spans, value.get(), slope.get(), laplacian.get(), weight.get(), rest.get()};
    std::tuple found{std::vector<double>(size, NAN), std::vector<double>(count * PRESS_WRENCH, NAN)};
    without_gil([&] { press_sheet(sheet, load, depths, count, std::get<0>(found).data(), std::get<1>(found).data()); });
    return found;
}

SheetTable made_table(const SheetPlan& plan, const std::int64_t* modes, const Floats& coefficients, const Floats& shapes) {
    for (int k = 0; k < 2; ++k) within(plan.reach[k] / plan.half[k], "reach", 0, 0.9999);  // presses within the clamp
    SheetTable table{plan, {}, coefficients.vector(), shapes.vector()};
    py::ssize_t count[2] = {};
    for (int c = 0; c < 4; ++c) {
        table.modes[c] = modes[c];
        count[0] += TERMS * plan.order * plan.order * (plan.levels + 3) * (modes[c] + WRENCH_COLUMNS[c]);
        count[1] += modes[c] * 3 * (plan.n + 1) * (plan.n + 1);
    }
    check_rows("coefficients", coefficients.length(), count[0]), check_rows("shapes", shapes.length(), count[1]);
    return table;
}

SheetFit fitted_sheet(const SheetTable& table, const SheetMarkers& markers, const SheetFrame& frame, const MarkerNoise& noise,
                      const SheetPrior& prior, const Rows6& start) {
    check_rows("value", frame.value.rows(), markers.rest.rows());
    return fit_presses(table, markers, frame, noise, prior, start);
}

Rows3 shown_field(const Floats& field, const SheetMarkers& markers, std::array<double, 2> position, std::array<double, 2> half,
                  double scale) {
    SheetTable table{};
    table.scale = scale, table.n = side_of("field", field.length(), 4) / 2 - 1;
    if (field.length() % 2) throw py::value_error("field: a square of an even side is needed");
    for (int k = 0; k < 2; ++k) {
        table.half[k] = within(half[k], "half", scale, 10);
        within(position[k], "position", -half[k], half[k]);
    }
    return show_field(table, markers, position.data(), field);
}

void bind_sheet(py::module_& module) {
    using L = SheetLoad;
    record(module, "SheetLoad", "A round tip that presses straight down: src/press/sheet_membrane.hpp.",
           field("position (2)", &L::position, "m"),
           field("radius [1e-6, 1]", &L::radius, "m"), field("prestretch [1, 3]", &L::prestretch),
           field("bending [0, 1]", &L::bending, "m^2, over shear modulus and thickness"),
           field("friction [0, 10]", &L::friction, "coefficient"), field("slides", &L::slides),
           field("drag (2) [-10, 10]", &L::drag, "traction over pressure"));
    def(module, "press_sheet -> (D, S, 3), (D, 9)",
        "Displacements, m, of the splines of a clamped sheet and wrenches of a round tip on it, at rising depths, m: force and moment "
        "about\n"
        "the tip over shear modulus and thickness, m and m^2, and centre of the pressure relative to the tip, m. NaN from the first depth\n"
        "without equilibrium.",
        pressed_sheet, "mesh", "load", "depths (D)");
    using M = SheetMarkers;
    record(module, "SheetMarkers", "Untouched markers. Nearer than near to a press they are discs, farther away points.",
           field("rest (N, 2) [-10, 10]", &M::rest, "m"), field("camera_centre (N, 3)", &M::camera_centre, "m"),
           field("radius [0, 1]", &M::radius, "m"), field("near [0, 10]", &M::near, "m"));
    record(module, "SheetFrame", "What the markers show.", field("value (N, 3)", &SheetFrame::value, "shift, m, and growth; NaN: unknown"),
           field("motion (N, 3) [-10, 10]", &SheetFrame::motion, "of value, of markers seen at another moment"));
    using N = MarkerNoise;
    record(module, "MarkerNoise", "Standard deviations: src/press/sheet_fit.hpp.",
           field("shift [1e-12, 1e6]", &N::shift, "m, of an untouched marker"), field("growth [1e-12, 1e6]", &N::growth, "likewise"),
           field("share_shift [0, 1e6]", &N::share_shift), field("share_growth [0, 1e6]", &N::share_growth, "1/m"),
           field("depth_shift [0, 1e6]", &N::depth_shift), field("depth_growth [0, 1e6]", &N::depth_growth, "1/m"));
    record(module, "SheetPrior", "What is known before a fit.",
           field("log_radius [-10, 10]", &SheetPrior::log_radius, "mean of the log of the tip's radius over the middle one"),
           field("sigma [1e-6, 10]", &SheetPrior::sigma, "its standard deviation"),
           field("drags", &SheetPrior::drags, "whether drags are unknown, else 0"));
    using F = SheetFit;
    class_of<F>(module, "SheetFit", "Presses that explain a frame of a sheet: src/press/sheet_fit.hpp.",
                get("presses (T, 6)", &F::presses, "x, y, depth, log radius, drag x, drag y"), get("interaction", &F::interaction),
                get("covariance", &F::covariance), get("misfit", &F::misfit), get("expected", &F::expected),
                get("wrenches (T, 9)", &F::wrenches));
    using S = SheetPlan;
    record(module, "SheetPlan", "What a table of presses on a sheet covers: see src/press/sheet_library.hpp.",
           field("half (2) [1e-6, 10]", &S::half, "m"), field("reach (2) [1e-6, 10]", &S::reach, "m"),
           field("scale [1e-6, 10]", &S::scale, "m"), field("depth [1e-6, 10]", &S::depth, "m"),
           field("spread [1e-6, 10]", &S::spread, "largest log radius"), field("power [1e-6, 10]", &S::power, "grading of depths"),
           field("widening [0, 1]", &S::widening, "before steep slopes"), field("n [1, 100]", &S::n, "half the spans of the mesh"),
           field("order [1, 8]", &S::order, "of the polynomials"), field("levels [1, 1000]", &S::levels, "of depth"));
    auto table = class_of<SheetTable>(module, "SheetTable", "Simulated presses on a sheet: see src/press/sheet_library.hpp.");
    init(table, made_table, "plan", py::kw_only(), "modes (4) [0, 10000]", "coefficients (P)", "shapes (Q)");
    def(table, "fit", "The SheetFit to a frame, from presses start: see press/sheet/model.py.", fitted_sheet, "markers", "frame", "noise",
        "prior", "start (T=1..2, 6) [-10, 10]");
    def(
        table, "show",
        "Shift, m, and growth (N, 3) of markers under presses; the sheet there (N, 9): displacement, m, and its derivatives.",
        [](const SheetTable& one, const SheetMarkers& markers, const Rows6& presses, double interaction) {
            return members<2>(show_presses(one, markers, presses, within(interaction, "interaction", -10, 10)));
        },
        "markers", "presses (T=1..2, 6) [-10, 10]", py::arg("interaction") = 0.0);
    def(module, "show_field", "Shift, m, and growth (N, 3) of markers on a sheet with splines, m: see press/sheet/library.py.", shown_field,
        "field (S, 3)", "markers", py::kw_only(), "position", "half", "scale [1e-6, 10]");
}

// ---- Domes.

using DomePresses = Rows<PRESS>;

DomeLibrary made_library(const DomePlan& plan, const Eigen::VectorXd& edges, const Floats& even_table, const Floats& odd_table,
                         const Floats& even_modes, const Floats& odd_modes) {
    DomeLibrary library;
    static_cast<DomePlan&>(library) = plan;
    library.straight = static_cast<int>(even_table.length(1)) - DRAGS, library.levels = static_cast<int>(even_table.length(0)) - 3;
    library.order = static_cast<int>(even_table.length(2)), library.radii = static_cast<int>(even_table.length(3));
    library.rings = static_cast<int>(edges.size()) - 1, library.harmonics = static_cast<int>(even_modes.length(3)) - 1;
    for (py::ssize_t k = 0; k < edges.size(); ++k) within(edges[k], "edges", k ? edges[k - 1] : 0.0, 1.0);
    const auto table = [](const Floats& values, Eigen::Index columns) {
        return FloatRows(Eigen::Map<const FloatRows>(values, columns ? values.size / columns : 0, columns));
    };
    library.edges = edges;
    library.even_table = table(even_table, even_table.length(4)), library.odd_table = table(odd_table, odd_table.length(4));
    const Eigen::Index size = edges.size() * 3 * even_modes.length(3);
    library.even_modes = table(even_modes, size), library.odd_modes = table(odd_modes, size);
    return library;
}

Points moved_points(const DomeLibrary& library, const Points& points, const DomePresses& presses) {
    Points moved = Points::Zero(points.rows(), 3);
    for (Eigen::Index k = 0; k < presses.rows(); ++k) press_dome(library, points, presses.row(k).transpose(), moved);
    return moved;
}

DomeFit fitted_dome(const DomeLibrary& library, const DomeMarkers& markers, const DomeFrame& frame, const PressPrior& prior,
                    const DomePresses& starts) {
    check_rows("shift", frame.shift.rows(), markers.points.rows());
    for (int k = 0; k < PRESS; ++k) within(prior.highest[k], "highest", prior.lowest[k], 1e3);
    return fit_dome(library, markers, frame, Eigen::Map<const Eigen::VectorXd>(starts.data(), starts.size()), prior);
}

void bind_dome(py::module_& module) {
    using P = DomePlan;
    record(module, "DomePlan", "Numbers of a dome and of the presses of a library: see src/press/dome.hpp.",
           field("curvature [1e-9, 1e3]", &P::curvature, "m"), field("centre_z [-1e3, 1e3]", &P::centre_z, "m"),
           field("disc_scale [1e-9, 1e3]", &P::disc_scale, "see press/dome/mechanics.py"),
           field("reach [1e-9, 1e3]", &P::reach, "largest shift of the mesh"), field("depth [1e-9, 1e3]", &P::depth, "m"),
           field("power [1e-9, 1e3]", &P::power, "grading of depths"), field("radius [1e-9, 1e3]", &P::radius, "m, of the middle tip"),
           field("radius_spread [1e-9, 1e3]", &P::radius_spread, "of log radii"));
    record(module, "DomeMarkers", "Untouched markers.", field("points (K, 3)", &DomeMarkers::points, "m; NaN: unknown"),
           field("camera_centres (K, 3)", &DomeMarkers::camera_centres, "m"),
           field("plane_z [-1e3, 1e3]", &DomeMarkers::plane_z, "m, of the viewing plane"));
    record(module, "DomeFrame", "What the markers show.",
           field("shift (K, 2)", &DomeFrame::shift, "m, apparent displacement in the viewing plane"),
           field("weight (K) [0, 1e300]", &DomeFrame::weight, "0 where not seen"),
           field("shared (K, 0..100)", &DomeFrame::shared, "columns whose products are taken off the weight matrix of each axis"));
    using K = PressPrior;
    record(module, "PressPrior", "What is known of each number of a press, (7,) each.", field("mean (7) [-1e15, 1e15]", &K::mean),
           field("weight (7) [0, 1e15]", &K::weight, "one over the variance"), field("lowest (7) [-1e15, 1e15]", &K::lowest),
           field("highest (7)", &K::highest), field("longest (7) [1e-12, 1e15]", &K::longest, "step"));
    const auto presses_of = [](const DomeFit& fit) {
        return DomePresses(Eigen::Map<const DomePresses>(fit.presses.data(), fit.presses.size() / PRESS, PRESS));
    };
    class_of<DomeFit>(module, "DomeFit", "Presses that explain a frame of a dome: src/press/dome.hpp.", get("presses (N, 7)", presses_of),
                      get("covariance", &DomeFit::covariance), get("residual (K, 2)", &DomeFit::residual, "m"));
    auto library = class_of<DomeLibrary>(module, "DomeLibrary", "Simulated presses on a dome, of the arrays of press/dome/library.py.");
    init(library, made_library, "plan", py::kw_only(), "edges (R=2..10000)", "even_table (L=4..1000, 3..8, O=1..16, T=1..8, E)",
         "odd_table (L, 2, O, T, D)", "even_modes (E, R, 3, H=1..100)", "odd_modes (D, R, 3, H)");
    def(library, "moved",
        "Displacement (K, 3), m, of a dome's markers at points, m, under presses that add up.\n\n"
        "A press: x, y of the tip before a drag, m; log depth, m; logs of its radius and of friction over the library's middle ones, over\n"
        "their spreads; displacement of the drag, with the skin, over the depth along x and y.",
        moved_points, py::kw_only(), "points (K, 3)", "presses (N, 7) [-1e3, 1e3]");
    def(library, "fit", "The DomeFit of presses, from starts, to a frame.", fitted_dome, "markers", "frame", "prior",
        "starts (N=1..2, 7) [-1e3, 1e3]");
}

}  // namespace

static void bind_press(py::module_& parent) {
    py::module_ module = parent.def_submodule("press", "Presses of sheets and domes.");
    bind_sheet(module);
    bind_dome(module);
}

static const Subject SUBJECT("press", bind_press);

}  // namespace tactile::border
