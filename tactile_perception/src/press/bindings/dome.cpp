// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels of domes.
#include <pybind11/eigen.h>

#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "press/dome.hpp"

namespace tactile::border {
namespace {

constexpr int DOME_NUMBERS = 8;
constexpr double LARGEST_NUMBER = 1e3;  // of a press: m, and logs. Chosen: far outside any dome
constexpr int MOST_PRESSES = 8;         // Chosen
constexpr int MOST_SHARED = 100;        // Chosen
using FixedRows = Eigen::Matrix<double, Eigen::Dynamic, PRESS, Eigen::RowMajor>;

template <class Matrix, class T>
Matrix matrix_of(const Input<T>& input, Eigen::Index rows, Eigen::Index columns) {
    using Rows = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    return Eigen::Map<const Rows>(input.data(), rows, columns);
}

DomeLibrary made_library(const py::object& numbers, const py::object& edges, const py::object& even_table, const py::object& odd_table,
                         const py::object& even_modes, const py::object& odd_modes) {
    const Input<double> number(numbers, "numbers", {DOME_NUMBERS}), edge(edges, "edges", {ANY});
    const Input<float> even(even_table, "even_table", {ANY, ANY, ANY, ANY, ANY});
    const Input<float> odd(odd_table, "odd_table", {even.length(0), DRAGS, even.length(2), even.length(3), ANY});
    const Input<float> evens(even_modes, "even_modes", {even.length(4), edge.length(), 3, ANY});
    const Input<float> odds(odd_modes, "odd_modes", {odd.length(4), edge.length(), 3, evens.length(3)});
    const auto straight = static_cast<int>(within(even.length(1), "even_table", DRAGS + 1, 8)) - DRAGS;
    const auto levels = static_cast<int>(within(even.length(0), "even_table", 4, 1000)) - 3;
    const auto order = static_cast<int>(within(even.length(2), "even_table", 1, 16));
    const auto radii = static_cast<int>(within(even.length(3), "even_table", 1, 8));
    const auto rings = static_cast<int>(within(edge.length(), "edges", 2, 10000)) - 1;
    const auto harmonics = static_cast<int>(within(evens.length(3), "even_modes", 1, 100)) - 1;
    const double* n = number.data();
    for (int k = 0; k < DOME_NUMBERS; ++k) within(n[k], "numbers", k == 1 ? -1e3 : 1e-9, 1e3);
    for (py::ssize_t k = 0; k < edge.length(); ++k) within(edge.data()[k], "edges", k ? edge.data()[k - 1] : 0.0, 1.0);
    const Eigen::Index rows = even.length(0) * order * radii, size = edge.length() * 3 * (harmonics + 1);
    return {levels, order, radii, rings, harmonics, straight, n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7],
            matrix_of<Eigen::VectorXd>(edge, edge.length(), 1),
            matrix_of<FloatRows>(even, rows * (straight + DRAGS), even.length(4)),
            matrix_of<FloatRows>(odd, rows * DRAGS, odd.length(4)),
            matrix_of<FloatRows>(evens, even.length(4), size),
            matrix_of<FloatRows>(odds, odd.length(4), size)};
}

Eigen::VectorXd presses_in(const py::object& presses, const char* name) {
    const Input<double> given(presses, name, {ANY, PRESS});
    within(given.length(), name, 0, MOST_PRESSES);
    for (py::ssize_t k = 0; k < given.length() * PRESS; ++k) within(given.data()[k], name, -LARGEST_NUMBER, LARGEST_NUMBER);
    return matrix_of<Eigen::VectorXd>(given, given.length() * PRESS, 1);
}

Points moved_points(const DomeLibrary& library, const py::object& points, const py::object& presses) {
    const Input<double> place(points, "points", {ANY, 3});
    const Eigen::VectorXd given = presses_in(presses, "presses");
    const Points still = matrix_of<Points>(place, place.length(), 3);
    Points moved = Points::Zero(place.length(), 3);
    for (Eigen::Index p = 0; p < given.size(); p += PRESS) press_dome(library, still, given.segment<PRESS>(p), moved);
    return moved;
}

DomeFit fitted(const DomeLibrary& library, const py::object& points, const py::object& camera_centres, double plane_z, const py::object& shift,
               const py::object& weight, const py::object& shared, const py::object& starts, const py::object& prior) {
    const Input<double> place(points, "points", {ANY, 3}), camera_centre(camera_centres, "camera_centres", {place.length(), 3});
    const Input<double> seen(shift, "shift", {place.length(), 2}), sure(weight, "weight", {place.length()});
    const Input<double> alike(shared, "shared", {ANY, place.length()}), known(prior, "prior", {5, PRESS});
    const Eigen::VectorXd start = presses_in(starts, "starts");
    for (int k = 0; k < 5 * PRESS; ++k) within(known.data()[k], "prior", k < PRESS ? -1e15 : k < 2 * PRESS ? 0 : -1e15, 1e15);
    for (int k = 0; k < PRESS; ++k) {
        within(known.data()[3 * PRESS + k], "prior", known.data()[2 * PRESS + k], LARGEST_NUMBER);
        within(known.data()[4 * PRESS + k], "prior", 1e-12, 1e15);
    }
    const Eigen::Index count = place.length();
    const DomeFrame frame{matrix_of<Points>(place, count, 3), matrix_of<Points>(camera_centre, count, 3),
                          within(plane_z, "plane_z", -LARGEST_NUMBER, LARGEST_NUMBER), matrix_of<Eigen::MatrixXd>(seen, count, 2),
                          matrix_of<Eigen::MatrixXd>(alike, within(alike.length(), "shared", 0, MOST_SHARED), count),
                          matrix_of<Eigen::VectorXd>(sure, count, 1).unaryExpr([](double w) { return w > 0 && w < INFINITY ? w : 0.0; })};
    return without_gil([&] { return fit_dome(library, frame, start, matrix_of<DomePrior>(known, 5, PRESS)); });
}

}  // namespace

void bind_dome(py::module_& module) {
    py::class_<DomeFit>(module, "DomeFit", "Presses that explain a frame of a dome.")
        .def_property_readonly("presses", [](const DomeFit& fit) {
            return FixedRows(Eigen::Map<const FixedRows>(fit.presses.data(), fit.presses.size() / PRESS, PRESS));
        }, "(n, 7)")
        .def_readonly("covariance", &DomeFit::covariance, "(7 n, 7 n); NaN where the markers do not determine them")
        .def_readonly("left", &DomeFit::left, "(K, 2) m, residuals; 0 where not seen");
    copyable(py::class_<DomeLibrary>(module, "DomeLibrary", "Simulated presses on a dome; the arrays are those of press/dome/library.py."))
        .def(py::init(&made_library), py::kw_only(), py::arg("numbers"), py::arg("edges"), py::arg("even_table"), py::arg("odd_table"),
             py::arg("even_modes"), py::arg("odd_modes"))
        .def("moved", &moved_points, py::kw_only(), py::arg("points"), py::arg("presses"),
             "Displacement (K, 3), m, of a dome's markers at points (K, 3), m, under presses (n, 7) that add up.\n\n"
             "A press: x, y of the tip before a drag, m; log depth, m; logs of its radius and of friction over the library's middle\n"
             "ones, over their spreads; way of the drag, with the skin, over the depth along x and y.")
        .def("fit", &fitted, py::kw_only(), py::arg("points"), py::arg("camera_centres"), py::arg("plane_z"), py::arg("shift"), py::arg("weight"),
             py::arg("shared"), py::arg("starts"), py::arg("prior"),
             "The DomeFit of presses, from starts (n, 7), to apparent displacements shift (K, 2), m, in the plane at plane_z, m, seen\n"
             "from camera_centres (K, 3), m. weight: (K,), 0 for a marker that is not seen; shared: (m, K), rows whose products are taken off the\n"
             "weight matrix of each axis; prior: (5, 7), mean, weight (one over variance), least and most of each number, and its longest step.");
}

}  // namespace tactile::border
