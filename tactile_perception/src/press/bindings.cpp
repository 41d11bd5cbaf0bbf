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

using Doubles = Array<double>;
using Floats = Array<float>;

// Side of a square of so many elements.
py::ssize_t side_of(const char* name, py::ssize_t size, py::ssize_t smallest) {
    const py::ssize_t side = std::lround(std::sqrt(static_cast<double>(size)));
    check_rows(name, size, std::max(side, smallest) * std::max(side, smallest));
    return within(side, name, smallest, 1000);
}

// mesh: of press/sheet/mechanics.py.
auto pressed_sheet(const py::object& mesh, const SheetLoad& load, const std::vector<double>& depths) {
    Lengths lengths;
    const Lines lines{"value laplacian (E, 4, 9)", "slope (E, 4, 2, 9)", "weight (E, 4)", "rest (E, 4, 2)"};
    auto sheet = from_attributes<SheetElements>(mesh, lines, lengths);
    sheet.spans = side_of("weight", lengths['E'], 2);
    if (std::adjacent_find(depths.begin(), depths.end(), std::greater_equal<>()) != depths.end())
        refuse("depths: each must be larger than the one before");
    PressedSheets found = without_gil([&] { return press_sheet(sheet, load, depths); });
    return std::tuple(std::move(found.fields), std::move(found.wrenches));
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

Rows3 shown_field(const Floats& field, const SheetMarkers& markers, std::array<double, 2> position, std::array<double, 2> half,
                  double scale) {
    SheetTable table{};
    table.scale = scale, table.n = side_of("field", field.length(), 4) / 2 - 1;
    if (field.length() % 2) refuse("field: a square of an even side is needed");
    for (int k = 0; k < 2; ++k) {
        table.half[k] = within(half[k], "half", scale, 10);
        within(position[k], "position", -half[k], half[k]);
    }
    return show_field(table, markers, position.data(), field);
}

void bind_sheet(py::module_& module) {
    record<SheetLoad>(module, "SheetLoad", "A round tip that presses straight down: src/press/sheet_membrane.hpp.",
                      {"radius [1e-6, 1]", "prestretch [1, 3]", "bending [0, 1]", "friction [0, 10]", "drag (2) [-10, 10]"});
    def(module, "press_sheet -> (D, S, 3), (D, 9)",
        "Displacements, m, of the splines of a clamped sheet and wrenches of a round tip on it, at rising depths, m: force and moment "
        "about\nthe tip over shear modulus and thickness, and centre of the pressure from the tip, m. NaN from the first depth without "
        "one.",
        {"mesh", "load", "depths (D)"}, pressed_sheet);
    record<SheetMarkers>(module, "SheetMarkers", "Untouched markers: src/press/sheet_fit.hpp.",
                         {"rest (N, 2) [-10, 10]", "radius [0, 1]", "near [0, 10]"});
    record<SheetFrame>(module, "SheetFrame", "What the markers show: src/press/sheet_fit.hpp.", {"motion (N, 3) [-10, 10]"});
    record<MarkerNoise>(module, "MarkerNoise", "Standard deviations: src/press/sheet_fit.hpp.", {"shift growth [1e-12, 1e6]", "[0, 1e6]"});
    record<SheetPrior>(module, "SheetPrior", "What is known before a fit: src/press/sheet_fit.hpp.",
                       {"log_radius [-10, 10]", "sigma [1e-6, 10]"});
    class_of<SheetFit>(module, "SheetFit", "Presses that explain a frame of a sheet: src/press/sheet_fit.hpp.");
    class_of<ShownMarkers>(module, "ShownMarkers",
                           "Shift, m, and growth (N, 3) of markers, and the sheet there (N, 9): src/press/sheet_fit.hpp.");
    record<SheetPlan>(module, "SheetPlan", "What a table of presses on a sheet covers: src/press/sheet_library.hpp.",
                      {"widening [0, 1]", "n [1, 100]", "order [1, 8]", "levels [1, 1000]", "half reach (2) [1e-6, 10]", "[1e-6, 10]"});
    auto table = class_of<SheetTable>(module, "SheetTable", "Simulated presses on a sheet: src/press/sheet_library.hpp.");
    init(table, {"plan", "modes (4) [0, 10000]", "coefficients (P)", "shapes (Q)"}, made_table);
    def(table, "fit", "The SheetFit to a frame, from presses start.", {"markers", "frame", "noise", "prior", "start (T=1..2, 6) [-10, 10]"},
        [](const SheetTable& one, const SheetMarkers& markers, const SheetFrame& frame, const MarkerNoise& noise, const SheetPrior& prior,
           const Rows6& start) {
            check_rows("value", frame.value.rows(), markers.rest.rows());
            return fit_presses(one, markers, frame, noise, prior, start);
        });
    def(table, "show", "ShownMarkers under presses.", {"markers", "presses (T=1..2, 6) [-10, 10]", "interaction [-10, 10]"}, show_presses);
    def(module, "show_field", "Shift, m, and growth (N, 3) of markers on a sheet with splines, m: see press/sheet/library.py.",
        {"field (S, 3)", "markers", "position", "half", "scale [1e-6, 10]"}, shown_field);
}

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

void bind_dome(py::module_& module) {
    record<DomePlan>(module, "DomePlan", "Numbers of a dome and of the presses of a library: src/press/dome.hpp.",
                     {"centre_z [-1e3, 1e3]", "[1e-9, 1e3]"});
    record<DomeMarkers>(module, "DomeMarkers", "Untouched markers: src/press/dome.hpp.", {"plane_z [-1e3, 1e3]"});
    record<DomeFrame>(module, "DomeFrame", "What the markers show: src/press/dome.hpp.", {"weight (N) [0, 1e300]", "shared (N, 0..100)"});
    record<PressPrior>(module, "PressPrior", "What is known of each number of a press: src/press/dome.hpp.",
                       {"mean lowest (7) [-1e15, 1e15]", "weight (7) [0, 1e15]", "longest (7) [1e-12, 1e15]"});
    class_of<DomeFit>(module, "DomeFit", "Presses that explain a frame of a dome: src/press/dome.hpp.");
    auto library = class_of<DomeLibrary>(module, "DomeLibrary", "Simulated presses on a dome, of the arrays of press/dome/library.py.");
    init(library,
         {"plan", "edges (R=2..10000)", "even_table (L=4..1000, 3..8, O=1..16, T=1..8, E)", "odd_table (L, 2, O, T, D)",
          "even_modes (E, R, 3, H=1..100)", "odd_modes (D, R, 3, H)"},
         made_library);
    def(library, "moved", "Displacement (K, 3), m, of a dome's markers at points, m, under presses that add up: src/press/dome.hpp.",
        {"points (K, 3)", "presses (N, 7) [-1e3, 1e3]"}, [](const DomeLibrary& one, const Points& points, const DomePresses& presses) {
            Points moved = Points::Zero(points.rows(), 3);
            for (Eigen::Index k = 0; k < presses.rows(); ++k) press_dome(one, points, presses.row(k).transpose(), moved);
            return moved;
        });
    def(library, "fit", "The DomeFit of presses, from starts, to a frame.", {"markers", "frame", "prior", "starts (N=1..2, 7) [-1e3, 1e3]"},
        [](const DomeLibrary& one, const DomeMarkers& markers, const DomeFrame& frame, const PressPrior& prior, const DomePresses& starts) {
            check_rows("shift", frame.shift.rows(), markers.points.rows());
            for (int k = 0; k < PRESS; ++k) within(prior.highest[k], "highest", prior.lowest[k], 1e3);
            return fit_dome(one, markers, frame, prior, starts);
        });
}

}  // namespace

static void bind_press(py::module_& parent) {
    py::module_ module = parent.def_submodule("press", "Presses of sheets and domes.");
    bind_sheet(module);
    bind_dome(module);
}

static const Subject SUBJECT("press", bind_press);

}  // namespace tactile::border
