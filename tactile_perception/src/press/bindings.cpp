// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Presses of sheets and domes for Python, as module _core.press.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "press/dome_method.hpp"
#include "press/marker_field.hpp"
#include "press/region.hpp"
#include "press/sheet_fit.hpp"
#include "press/sheet_membrane.hpp"
#include "press/sheet_method.hpp"
#include "press/sheet_surface.hpp"

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

void bind_markers(py::module_& module) {
    auto view = record<MarkerView>(module, "MarkerView", "A camera that views a plane: src/press/marker_field.hpp.",
                                   {"centre camera_centres [-1e9, 1e9]", "plane_z [-1e9, 1e9]"});
    def(view, "back_project", "x, y, m, of the plane at pixels (N, 3), and m^2 a pixel there; NaN: nowhere.", {"uv (N, 2)"},
        &MarkerView::back_project);
    record<RestRule>(module, "RestRule", "Which markers are untouched: src/press/marker_field.hpp.", {"[1e-12, 1e12]"});
    auto rest = class_of<RestMarkers>(module, "RestMarkers", "Untouched markers from frame to frame: src/press/marker_field.hpp.");
    init(rest, {"count [0, 1000000]", "rule"}, [](std::ptrdiff_t count, const RestRule& rule) { return RestMarkers(count, rule); });
    def(rest, "follow", "Take the dots of a frame.", {"id (N)", "uv (N, 2)", "duv (N, 2)", "area (N)", "stamp_s"},
        [](RestMarkers& one, const Numbers& id, const Rows2& uv, const Rows2& duv, const Eigen::VectorXd& area, double stamp_s) {
            if (id.size() && (id.minCoeff() < 0 || id.maxCoeff() >= one.area().size()))
                refuse("marker ids " + std::to_string(id.minCoeff()) + " to " + std::to_string(id.maxCoeff()) +
                       " are not those of a pattern of " + std::to_string(one.area().size()) + " markers");
            one.follow({id, uv, duv, area}, stamp_s);
        });
    def(rest, "field", "The arrays of a MarkerField, press/field.py.", {"view"}, [](RestMarkers& one, const MarkerView& view) {
        MarkerField found = one.field(view);
        return std::tuple(std::move(found.rest), std::move(found.shift), std::move(found.growth), std::move(found.camera_centre),
                          std::move(found.uv), std::move(found.duv), std::move(found.area));
    });
    get(rest, "uv", "Untouched positions (K, 2), px.", &RestMarkers::uv);
    get(rest, "area", "Untouched areas (K), px^2.", &RestMarkers::area);
    get(rest, "is_view_outdated", "Whether the view must be made again, of these positions.", &RestMarkers::is_view_outdated);
    class_of<PressEstimate>(module, "PressEstimate", "Fields of a TouchEstimate.");
    record<PressOdds>(module, "PressOdds", "Prior of hypotheses: src/press/choice.hpp.", {"[1e-12, 1e12]"});
    auto surface = record<MarkerSurface>(module, "MarkerSurface", "The undeformed surface: src/press/marker_surface.hpp.", {"[0, 1e3]"});
    def(surface, "normal", "Unit normal (3) of the undeformed surface.", {"position (2)"}, &MarkerSurface::normal);
    def(surface, "rest_points", "Positions (K, 3), m, of untouched markers.", {"rest (K, 2)", "camera_centre (K, 3)"},
        &MarkerSurface::rest_points);
    def(surface, "raised_points", "Positions (K, 3), m, of markers on their rays, raised by so much, m.",
        {"rest (K, 2)", "shift (K, 2)", "camera_centre (K, 3)", "raised (K)"}, &MarkerSurface::raised_points);
    class_of<PressRegion>(module, "PressRegion", "Region of contact: src/press/region.hpp.", {"under (N) bool"});
    def(surface, "press_region", "The PressRegion of tips: lowest point, depth and radius, m.",
        {"tips (T=1..1000, 5) [-1e3, 1e3]", "positions (N, 2)", "camera_centre (N, 3)", "max_ratio [0, 1]"},
        [](const MarkerSurface& one, const Rows<5>& tips, const Rows2& positions, const Rows3& camera_centre, double max_ratio) {
            std::vector<ContactDisc> discs;
            for (Eigen::Index k = 0; k < tips.rows(); ++k)
                discs.emplace_back(one, tips.row(k).head<3>(), tips(k, 3), tips(k, 4), max_ratio);
            return press_region(one, discs, positions, camera_centre);
        });
    auto sheet = class_of<SheetSurface>(module, "SheetSurface", "Heights of the markers of a sheet: src/press/sheet_surface.hpp.");
    init(sheet, {"bending (K, K)", "strain (K, K)", "laplacian (K, K)"},
         [](const Eigen::MatrixXd& bending, const Eigen::MatrixXd& strain, const Eigen::MatrixXd& laplacian) {
             return SheetSurface{bending, strain, laplacian};
         });
    def(sheet, "raised", "Heights (K), m, of the markers.", {"rest (K, 2)", "shift (K, 2)", "camera_centre (K, 3)"},
        [](const SheetSurface& one, const Rows2& rest, const Rows2& shift, const Rows3& camera_centre) {
            check_rows("rest", rest.rows(), one.bending.rows());
            return one.raised(rest, shift, camera_centre);
        });
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
    auto table = class_of<SheetTable, std::shared_ptr<SheetTable>>(
        module, "SheetTable", "Simulated presses on a sheet: src/press/sheet_library.hpp.");
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
    auto shifts = record<CameraShifts>(module, "CameraShifts", "Corrections of camera centres and print: src/press/sheet_method.hpp.",
                                       {"camera_centres (G=1..100, 3)", "shifts (G, 2)"});
    def(shifts, "shifted -> (K, 2), (K, 2), (K, 3)", "Rest, shift and camera centres, m, in the frame of the sheet.",
        {"rest (K, 2)", "shift (K, 2)", "camera_centre (K, 3)"},
        [](const CameraShifts& one, const Rows2& rest, const Rows2& shift, const Rows3& camera_centre) {
            MarkerField found = one.shifted({rest, shift, {}, camera_centre, {}, {}, {}});
            return std::tuple(std::move(found.rest), std::move(found.shift), std::move(found.camera_centre));
        });
    record<SheetRules>(module, "SheetRules", "Constants of the sheet method: src/press/sheet_method.hpp.");
    record<SheetDevice>(module, "SheetDevice", "A calibrated sheet: src/press/sheet_method.hpp.", {"tip_radius pitch [1e-9, 1e3]"});
    auto method = class_of<SheetMethod>(module, "SheetMethod", "Contacts on a sheet, frame by frame: src/press/sheet_method.hpp.");
    init(method, {"table", "device", "rules", "templates (S=2..100000, 3) [-10, 10]", "depths [2, 100]"},
         [](const std::shared_ptr<SheetTable>& table, const SheetDevice& device, const SheetRules& rules, const Rows3& templates,
            std::ptrdiff_t depths) {
             return SheetMethod(table, device, rules, SheetTemplates(templates, depths, device.noise.shift, device.noise.growth));
         });
    const Lines field{"rest (K, 2)", "shift (K, 2)", "growth (K)", "camera_centre (K, 3)"};
    def(method, "estimate", "PressEstimates of the contacts of one frame.", field,
        [](SheetMethod& one, const Rows2& rest, const Rows2& shift, const Eigen::VectorXd& growth, const Rows3& camera_centre) {
            return one.estimate({rest, shift, growth, camera_centre, {}, {}, {}});
        });
    def(method, "score", "Match of a field with that of a press, in standard deviations.", field,
        [](SheetMethod& one, const Rows2& rest, const Rows2& shift, const Eigen::VectorXd& growth, const Rows3& camera_centre) {
            return one.score({rest, shift, growth, camera_centre, {}, {}, {}});
        });
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
    record<DomeMarkers>(module, "DomeMarkers", "Untouched markers: src/press/dome.hpp.",
                        {"points camera_centres (N, 3)", "plane_z [-1e3, 1e3]", "smooth (N, 0..100) [-1e6, 1e6]"});
    record<DomeErrors>(module, "DomeErrors", "Errors of displacements: src/press/dome.hpp.",
                       {"still [1e-12, 1e6]", "longest (7) [1e-12, 1e15]", "[0, 1e6]"});
    record<DomePrior>(module, "DomePrior", "What is known of a press: src/press/dome.hpp.",
                      {"drag friction tip_sigma [1e-6, 1e6]", "tip [-1e3, 1e3]", "[0, 1e6]"});
    class_of<DomeFit>(module, "DomeFit", "Presses that explain a frame of a dome: src/press/dome.hpp.");
    auto library = class_of<DomeLibrary, std::shared_ptr<DomeLibrary>>(
        module, "DomeLibrary", "Simulated presses on a dome, of the arrays of press/dome/library.py.");
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
    def(library, "fit", "The DomeFit of presses, from starts, to apparent displacements, m.",
        {"markers", "errors", "prior", "shift (K, 2)", "starts (N=1..2, 7) [-1e3, 1e3]"},
        [](const DomeLibrary& one, const DomeMarkers& markers, const DomeErrors& errors, const DomePrior& prior, const Rows2& shift,
           const DomePresses& starts) {
            check_rows("shift", shift.rows(), markers.points.rows());
            return fit_dome(one, markers, errors, prior, shift, starts);
        });
    record<DomeRules>(module, "DomeRules", "Constants of the dome method: src/press/dome_method.hpp.");
    auto scales = record<DomeScales>(module, "DomeScales", "Scales of fitted numbers: src/press/dome_method.hpp.", {"[-1e6, 1e6]"});
    def(scales, "depth_scale", "Fitted depth over the true one, at a fitted position and depth, m.", {"position (2)", "depth", "shallow"},
        &DomeScales::depth_scale);
    record<DomeDevice>(module, "DomeDevice", "A calibrated dome: src/press/dome_method.hpp.", {"pitch [1e-9, 1e3]"});
    auto method = class_of<DomeMethod>(module, "DomeMethod", "Contacts on a dome, frame by frame: src/press/dome_method.hpp.");
    determine<DomeMethod> = [](const DomeMethod& one, Lengths& of) { of['K'] = one.markers().points.rows(); };
    init(method, {"library", "pushes", "device", "rules", "starts (S=1..10000, 7) [-1e3, 1e3]"},
         [](const std::shared_ptr<DomeLibrary>& shown, const std::shared_ptr<DomeLibrary>& pushes, const DomeDevice& device,
            const DomeRules& rules, const DomePresses& starts) { return DomeMethod(shown, pushes, device, rules, starts); });
    const Lines field{"rest (K, 2)", "shift (K, 2)"};
    def(method, "estimate", "PressEstimates of the contacts of one frame.", field, &DomeMethod::estimate);
    def(method, "find", "Finds the presses of one frame.", field, &DomeMethod::find);
    def(method, "score", "Match of a field with that of a press, in standard deviations.", {"shift (K, 2)"}, &DomeMethod::score);
    def(method, "raised", "Upward displacements (K), m, of the markers under the presses found last; None without.", {},
        &DomeMethod::raised);
}

}  // namespace

static void bind_press(py::module_& parent) {
    py::module_ module = parent.def_submodule("press", "Presses of sheets and domes.");
    bind_markers(module);
    bind_sheet(module);
    bind_dome(module);
}

static const Subject SUBJECT("press", bind_press);

}  // namespace tactile::border
