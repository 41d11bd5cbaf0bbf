// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels of a touchpad's membrane and contact; see bindings.cpp, whose length they would exceed.
#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "common/rigid_motion.hpp"
#include "common/vectors.hpp"
#include "touchpad/contact/carried_loads.hpp"
#include "touchpad/contact/contact_score.hpp"
#include "touchpad/contact/dot_loads.hpp"
#include "touchpad/contact/edge_distance.hpp"
#include "touchpad/contact/seen_loads.hpp"
#include "touchpad/contact/stick_slip.hpp"
#include "touchpad/membrane/membrane_forces.hpp"
#include "touchpad/membrane/membrane_frame.hpp"
#include "touchpad/membrane/membrane_solver.hpp"

namespace tactile::border {
namespace {

// The touchpad's membrane.
constexpr int LARGEST_GRID = 4096;  // dots. Chosen for memory: the response to the ranges is a dense matrix

Grid grid_of(const Input<double>& dots, const char* name, int rows, int columns) {
    const Grid grid{within(rows, "rows", 3, LARGEST_GRID / 3), within(columns, "columns", 3, LARGEST_GRID / 3)};
    within(grid.size(), "rows * columns", 9, LARGEST_GRID);
    if (dots.length() != grid.size()) throw py::value_error(std::string(name) + ": a row for each of rows * columns dots is needed");
    return grid;
}

// A membrane and the arrays that it points to.
struct GivenMembrane {
    Input<double> triangles, residual;
    Membrane membrane;
    GivenMembrane(const py::object& triangles_, const py::object& residual_, Grid grid)
        : triangles(triangles_, "triangles", {grid.rows - 1, 16, grid.padded_cells()}),
          residual(residual_, "residual", {grid.size(), 3}),
          membrane{grid, triangles.data(), residual.data()} {}
};

py::array_t<double> at_rest(const py::object& rest, int rows, int columns, double stiffness, double area_share) {
    const Input<double> given(rest, "rest", {ANY, 3});
    const Grid grid = grid_of(given, "rest", rows, columns);
    return output(membrane_at_rest(grid, given.data(), stiffness, area_share), {grid.rows - 1, 16, grid.padded_cells()});
}

py::tuple forces(const py::object& places, const py::object& triangles, int rows, int columns) {
    const Input<double> given(places, "places", {ANY, 3});
    const Grid grid = grid_of(given, "places", rows, columns);
    const Input<double> weights(triangles, "triangles", {grid.rows - 1, 16, grid.padded_cells()});
    std::vector<double> force(3 * grid.size()), share(3 * grid.size());
    {
        py::gil_scoped_release others_run;
        add_forces(grid, weights.data(), given.data(), force.data(), share.data());
    }
    return py::make_tuple(output(force, {grid.size(), 3}), output(share, {grid.size(), 3}));
}

py::array_t<double> slopes(const py::object& places, const py::object& rays, const py::object& triangles, const py::object& residual,
                           int rows, int columns, double pressure) {
    const Input<double> given(places, "places", {ANY, 3});
    const Grid grid = grid_of(given, "places", rows, columns);
    const Input<double> along(rays, "rays", {grid.size(), 3});
    const GivenMembrane of(triangles, residual, grid);
    const Balance balance = find_balance(of.membrane, given.data(), pressure);
    return output(find_slopes(of.membrane, given.data(), along.data(), pressure, balance), {grid.size(), 9});
}

py::tuple loads(const py::object& id, const py::object& places, const py::object& rest, const py::object& triangles,
                const py::object& residual, const py::object& origin, int rows, int columns, double rest_pressure, double settled) {
    const Input<double> still(rest, "rest", {ANY, 3});
    const Grid grid = grid_of(still, "rest", rows, columns);
    const Input<std::int64_t> numbers(id, "id", {ANY});
    const Input<double> given(places, "places", {numbers.length(), 3}), centre(origin, "origin", {3});
    for (py::ssize_t i = 0; i < numbers.length(); ++i) within(numbers.data()[i], "id", 0, static_cast<double>(grid.size() - 1));
    const GivenMembrane of(triangles, residual, grid);
    SeenLoads found;
    {
        py::gil_scoped_release others_run;
        found =
            seen_loads(of.membrane, numbers.data(), given.data(), numbers.length(), still.data(), centre.data(), rest_pressure, settled);
    }
    py::array_t<bool> seen(grid.size());
    std::copy_n(found.seen.get(), grid.size(), seen.mutable_data());
    return py::make_tuple(output(found.places, {grid.size(), 3}), seen, output(found.loads.normal, {grid.size(), 3}),
                          output(found.loads.force, {grid.size(), 3}), output(found.loads.load, {grid.size()}));
}

py::tuple carried(const py::object& places, const py::object& force, const py::object& load, int rows, int columns, double loaded) {
    const Input<double> given(places, "places", {ANY, 3});
    const Grid grid = grid_of(given, "places", rows, columns);
    const Input<double> pushed(force, "force", {grid.size(), 3}), pressed(load, "load", {grid.size()});
    const CarriedLoads found = carried_loads(grid, given.data(), pushed.data(), pressed.data(), loaded);
    return py::make_tuple(output(found.force, {grid.size(), 3}), output(found.wrench, {6}));
}

py::tuple membrane_solution(const py::object& rays, const py::object& ranges, const py::object& sigma, const py::object& id,
                            const py::object& rest, const py::object& places, const py::object& touched, const py::object& triangles,
                            const py::object& residual, const py::object& response, const py::object& origin, int rows, int columns,
                            double pressure, double scale, bool fresh) {
    const Input<double> before(places, "places", {ANY, 3});
    const Grid grid = grid_of(before, "places", rows, columns);
    const py::ssize_t size = grid.size();
    const Input<double> along(rays, "rays", {ANY, 3}), measured(ranges, "ranges", {along.length()}),
        spread(sigma, "sigma", {along.length()}), still(rest, "rest", {size, 3}), held(touched, "touched", {size}),
        centre(origin, "origin", {3});
    const Input<std::int64_t> numbers(id, "id", {along.length()});
    for (py::ssize_t i = 0; i < numbers.length(); ++i) within(numbers.data()[i], "id", 0, static_cast<double>(size - 1));
    const py::ssize_t inner = (grid.rows - 2) * (grid.columns - 2);
    const Input<float> told(response, "response", {inner, inner});
    const GivenMembrane of(triangles, residual, grid);
    WholeFrame frame;
    MembraneSolution found;
    std::vector<double> xyz(3 * size);
    {
        py::gil_scoped_release others_run;
        const SeenRanges seen{numbers.data(), along.data(), measured.data(), spread.data(), along.length()};
        frame = whole_frame(grid, centre.data(), still.data(), before.data(), seen, scale);
        found =
            solve_membrane(of.membrane, {centre.data(), frame.rays.data(), frame.measured.data(), frame.weight.data(), frame.last.data(),
                                         fresh ? nullptr : held.data(), told.data(), frame.displaced.data(), pressure});
        const Vec3 from = vec3_at(centre.data(), 0);
        for (py::ssize_t k = 0; k < size; ++k) store(xyz.data(), k, from + found.ranges[k] * vec3_at(frame.rays.data(), k));
    }
    return py::make_tuple(output(xyz, {size, 3}), output(found.ranges, {size}), output(found.touched, {size}), found.pressure,
                          output(frame.seen, {size}), output(found.weight, {size}), output(frame.rays, {size, 3}),
                          output(frame.displaced, {size}), output(found.moved, {size}), found.lifted);
}

py::tuple leaning(const py::object& places, const py::object& rays, const py::object& touched, const py::object& moved,
                  const py::object& triangles, const py::object& residual, int rows, int columns, double pressure, double lifted,
                  double step, double spread, double scale) {
    const Input<double> given(places, "places", {ANY, 3});
    const Grid grid = grid_of(given, "places", rows, columns);
    const Input<double> along(rays, "rays", {grid.size(), 3}), held(touched, "touched", {grid.size()}),
        change(moved, "moved", {grid.size()});
    const GivenMembrane of(triangles, residual, grid);
    Leaning found;
    {
        py::gil_scoped_release others_run;
        found = scale_leaning(of.membrane, given.data(), along.data(), held.data(), change.data(), pressure, lifted, step, spread, scale);
    }
    return py::make_tuple(found.curvature, found.gradient);
}

// The touchpad's contact.
py::array_t<double> score(const py::object& load, const py::object& places, const py::object& normals, int rows, int columns,
                          double pitch) {
    const Input<double> given(places, "places", {ANY, 3});
    const Grid grid = grid_of(given, "places", rows, columns);
    const Input<double> carried(load, "load", {grid.size()}), up(normals, "normals", {grid.size(), 3});
    within(pitch, "pitch", 1e-9, 1e9);
    std::vector<double> found;
    {
        py::gil_scoped_release others_run;
        found = contact_score(grid, carried.data(), given.data(), up.data(), pitch);
    }
    return output(found, {grid.size()});
}

py::array_t<double> with_edges(const py::object& score, const py::object& load, const py::object& places, const py::object& normals,
                               int rows, int columns, double pitch) {
    const Input<double> given(places, "places", {ANY, 3});
    const Grid grid = grid_of(given, "places", rows, columns);
    const Input<double> likely(score, "score", {grid.size()}), carried(load, "load", {grid.size()}),
        up(normals, "normals", {grid.size(), 3});
    within(pitch, "pitch", 1e-9, 1e9);
    std::vector<double> found;
    {
        py::gil_scoped_release others_run;
        found = edge_distance(grid, likely.data(), carried.data(), given.data(), up.data(), pitch);
    }
    return output(found, {grid.size()});
}

// Objects as rows of numbers: friction, whether moves, gross, still, slipping, twist, centre, whether rests, lively, slid, drift, whether
// lost.
constexpr py::ssize_t OBJECT = 27;

int frames_of(double number) {
    return number >= 0 ? static_cast<int>(std::min(number, 1e6)) : 0;
}

std::vector<TouchingObject> objects_of(const Input<double>& rows) {
    std::vector<TouchingObject> objects(rows.length());
    for (py::ssize_t k = 0; k < rows.length(); ++k) {
        const double* row = rows.data() + k * OBJECT;
        TouchingObject& thing = objects[k];
        thing.friction = row[0], thing.moves = row[1] > 0, thing.gross = row[2] > 0, thing.slipping = row[4];
        thing.still = frames_of(row[3]), thing.slid = frames_of(row[16]);
        std::copy(row + 5, row + 11, thing.twist.begin());
        thing.centre = vec3_at(row + 11, 0), thing.rests = row[14] > 0, thing.lively = row[15];
        std::copy(row + 17, row + 26, thing.drift.begin());
        thing.lost = row[26] > 0;
    }
    return objects;
}

py::array_t<double> rows_of(const std::vector<TouchingObject>& objects) {
    std::vector<double> rows(objects.size() * OBJECT);
    for (std::size_t k = 0; k < objects.size(); ++k) {
        double* row = &rows[k * OBJECT];
        const TouchingObject& thing = objects[k];
        row[0] = thing.friction, row[1] = thing.moves, row[2] = thing.gross, row[3] = thing.still, row[4] = thing.slipping;
        std::copy(thing.twist.begin(), thing.twist.end(), row + 5);
        store(row + 11, 0, thing.centre), row[14] = thing.rests, row[15] = thing.lively, row[16] = thing.slid;
        std::copy(thing.drift.begin(), thing.drift.end(), row + 17);
        row[26] = thing.lost;
    }
    return output(rows, {static_cast<py::ssize_t>(objects.size()), OBJECT});
}

py::tuple states(const py::tuple& last, const py::tuple& now, const py::object& held, const py::object& objects, const py::object& origin,
                 int rows, int columns, double tolerance, double noise, double depth_noise, double friction) {
    if (last.size() != 3) throw py::value_error("last: places, seen and score are needed");
    if (now.size() != 5) throw py::value_error("now: places, score, seen, normals and force are needed");
    const Input<double> places(now[0], "places", {ANY, 3});
    const Grid grid = grid_of(places, "places", rows, columns);
    const Input<double> before(last[0], "last_places", {grid.size(), 3});
    const Input<bool> last_seen(last[1], "last_seen", {grid.size()}), seen(now[2], "seen", {grid.size()});
    const Input<double> last_score(last[2], "last_score", {grid.size()}), score(now[1], "score", {grid.size()});
    const Input<double> normals(now[3], "normals", {grid.size(), 3}), force(now[4], "force", {grid.size(), 3});
    const Input<double> known(objects, "objects", {ANY, OBJECT}), centre(origin, "origin", {3});
    const Input<std::int64_t> holders(held, "held", {grid.size()});
    StickSlipMemory memory{within(tolerance, "tolerance", 1e-12, 1),
                           within(noise, "noise", 1e-12, 1),
                           within(depth_noise, "depth_noise", 1e-12, 1),
                           friction,
                           objects_of(known),
                           std::vector<std::int64_t>(holders.data(), holders.data() + grid.size())};
    for (const std::int64_t number : memory.held) within(number, "held", 0, static_cast<double>(known.length()));
    std::vector<std::uint8_t> found;
    {
        py::gil_scoped_release others_run;
        found = stick_slip(grid, {before.data(), last_seen.data(), last_score.data()},
                           {places.data(), score.data(), seen.data(), normals.data(), force.data()}, centre.data(), memory);
    }
    return py::make_tuple(output(found, {grid.size()}), output(memory.held, {grid.size()}), rows_of(memory.objects), memory.depth_noise,
                          memory.friction);
}

constexpr double LARGEST_OF_POINTS = 1e60;  // m, m^-2. Chosen: the product of a weight and four such numbers does not overflow

py::tuple motion(const py::object& before, const py::object& after, const py::object& weights, int steps) {
    const Input<double> from(before, "before", {ANY, 3}), to(after, "after", {from.length(), 3}), base(weights, "weights", {from.length()});
    for (py::ssize_t k = 0; k < 3 * from.length(); ++k) {
        within(from.data()[k], "before", -LARGEST_OF_POINTS, LARGEST_OF_POINTS);
        within(to.data()[k], "after", -LARGEST_OF_POINTS, LARGEST_OF_POINTS);
    }
    for (py::ssize_t k = 0; k < from.length(); ++k) within(base.data()[k], "weights", 0, LARGEST_OF_POINTS);
    within(steps, "steps", 0, 1000);
    RigidMotion found;
    {
        py::gil_scoped_release others_run;
        found = rigid_motion(from.data(), to.data(), base.data(), from.length(), steps);
    }
    return py::make_tuple(output(found.rotation, {3, 3}), output(found.translation, {3}), output(found.residuals, {from.length(), 3}),
                          output(found.weights, {from.length()}), static_cast<int>(found.open));
}

}  // namespace

void bind_contact(py::module_& module) {
    module.def("membrane_at_rest", &at_rest, py::arg("rest"), py::kw_only(), py::arg("rows"), py::arg("columns"), py::arg("stiffness"),
               py::arg("area_share"),
               "Triangles float64 of a membrane with rest positions (K, 3) float64, m, and shear stiffness, N/m, four a cell: weights\n"
               "of the springs opposite to their corners, N/m, and factor of the area term of the energy, which has the share area_share.");
    module.def("membrane_forces", &forces, py::arg("places"), py::arg("triangles"), py::kw_only(), py::arg("rows"), py::arg("columns"),
               "Elastic force (K, 3), N, on each dot at places (K, 3) float64, m, and its share (K, 3), m^2, of the area vectors.");
    module.def(
        "membrane_slopes", &slopes, py::arg("places"), py::arg("rays"), py::arg("triangles"), py::arg("residual"), py::kw_only(),
        py::arg("rows"), py::arg("columns"), py::arg("pressure"),
        "Derivatives (K, 9), 1/m, of each dot's normal load over the pressure, Pa, at places (K, 3), m, by movements of the 3 x 3 dots\n"
        "around it, row by row, along their unit rays (K, 3); residual (K, 3), m^2: out of balance at rest. Outermost dots: 0.");
    module.def(
        "membrane_loads", &loads, py::arg("id"), py::arg("places"), py::arg("rest"), py::arg("triangles"), py::arg("residual"),
        py::arg("origin"), py::kw_only(), py::arg("rows"), py::arg("columns"), py::arg("rest_pressure"), py::arg("settled"),
        "Of all dots of the grid: places (K, 3), m, seen (K,) bool, normals (K, 3), force of the object (K, 3), N, and load (K,), its "
        "normal\n"
        "pressure over the fluid's; from places (N, 3), m, of the seen dots id (N,) int64, and their rest (K, 3), m. Unseen dots are\n"
        "interpolated; where they or their neighbours have a load over settled, they are placed by one step towards the balance along "
        "their\n"
        "rays from origin (3,), m.");
    module.def("carried_loads", &carried, py::arg("places"), py::arg("force"), py::arg("load"), py::kw_only(), py::arg("rows"),
               py::arg("columns"), py::arg("loaded"),
               "Force (K, 3), N, on dots at places (K, 3), m, that carry a load (K,), over loaded, and a share of it on dots around, 0 on "
               "others, of\n"
               "the force (K, 3) on all; and its wrench (6,), N and N m, about the origin.");
    module.def(
        "solve_membrane", &membrane_solution, py::arg("rays"), py::arg("ranges"), py::arg("sigma"), py::arg("id"), py::arg("rest"),
        py::arg("places"), py::arg("touched"), py::arg("triangles"), py::arg("residual"), py::arg("response"), py::arg("origin"),
        py::kw_only(), py::arg("rows"), py::arg("columns"), py::arg("pressure"), py::arg("scale"), py::arg("fresh"),
        "Places (K, 3) and ranges (K,), m, probabilities of a load (K,) and pressure, Pa; seen (K,) bool; weights (K,), 1/m^2, without\n"
        "outliers; unit rays (K, 3); displaced (K,), m, measured ranges less those at rest; the response of ranges (K,) and pressure to\n"
        "displaced. From ranges (N,), m, of dots id (N,) int64 along unit rays (N, 3) from origin (3,), of standard deviations sigma\n"
        "(N,), NaN: unknown; rest, places (K, 3), m: at rest and, as touched and pressure, of the last frame; fresh: there is none;\n"
        "scale: factor on displaced; response (I, I) float32: information about each inner dot's load (columns) from the range of one\n"
        "(rows) at unit weight.");
    module.def(
        "scale_leaning", &leaning, py::arg("places"), py::arg("rays"), py::arg("touched"), py::arg("moved"), py::arg("triangles"),
        py::arg("residual"), py::kw_only(), py::arg("rows"), py::arg("columns"), py::arg("pressure"), py::arg("lifted"), py::arg("step"),
        py::arg("spread"), py::arg("scale"),
        "Weighted sums over free dots of r'^2 and r r': r, residual force along the surface over the pressure, r', its derivative by\n"
        "the scale. Places, rays, touched, pressure, scale: of solve_membrane; moved, lifted: its response; step: of the finite\n"
        "difference; spread: of a free dot's residual.");
    module.def(
        "contact_score", &score, py::arg("load"), py::arg("places"), py::arg("normals"), py::kw_only(), py::arg("rows"), py::arg("columns"),
        py::arg("pitch"),
        "Score (K,) of each dot, 0 free to 1 well inside, above 0.5 in contact, from loads (K,) float64 over the fluid's pressure, places\n"
        "(K, 3), m, and normals (K, 3) of the surface; pitch: of the dots, m.");
    module.def(
        "edge_distance", &with_edges, py::arg("score"), py::arg("load"), py::arg("places"), py::arg("normals"), py::kw_only(),
        py::arg("rows"), py::arg("columns"), py::arg("pitch"),
        "Scores (K,) float64: half the distance of each dot from a contact's border, pitches, plus 1/2, 0 to 1; 0 where score (K,), of\n"
        "contact_score, says that no contact is near. Loads, places, normals and pitch: of contact_score.");
    module.def(
        "stick_slip", &states, py::arg("last"), py::arg("now"), py::arg("held"), py::arg("objects"), py::arg("origin"), py::kw_only(),
        py::arg("rows"), py::arg("columns"), py::arg("tolerance"), py::arg("noise"), py::arg("depth_noise"), py::arg("friction"),
        "States (K,) uint8 of dots, the object that holds each (K,) int64, from 1, what is known of the objects (O, 27), noise along\n"
        "the normal and friction. last: places (K, 3), m, seen (K,) bool and scores (K,) of the last frame; now: places, scores, seen, "
        "normals\n"
        "and force (K, 3); held, objects: of the last frame; see stick_slip.StickSlipTracker.");
    module.def(
        "rigid_motion", &motion, py::arg("before"), py::arg("after"), py::arg("weights"), py::kw_only(), py::arg("steps"),
        "Rotation (3, 3) and translation (3,), m, of points before to after (N, 3), m, by least squares with weights (N,); residuals\n"
        "(N, 3), m; the weights used (N,); and why the points leave the motion open: 0 they do not, 1 less than three have a weight, "
        "those\n"
        "before (2) or after (3) are at one place, or on a line (4, 5), 6 after is a mirror image of before.\n\n"
        "steps: 0, or most rounds of reweighting (Tukey's biweight) for the motion that most points share; weights are then 1 / variance "
        "of\n"
        "a coordinate of after - before, m^-2, and those used are 0 for points that do not share the motion.");
}

}  // namespace tactile::border
