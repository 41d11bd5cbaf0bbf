// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels of domes.
#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "press/dome_fit.hpp"

namespace tactile::border {
namespace {

// An inflated dome (dome.hpp): the arrays of its library, and its markers.
class DomeArrays {
 public:
    DomeArrays(const py::object& numbers, const py::object& edges, const py::object& even_table, const py::object& odd_table,
               const py::object& even_modes, const py::object& odd_modes, const py::object& points, const py::object& eyes)
        : numbers_(numbers, "numbers", {DOME_NUMBERS}),
          edges_(edges, "edges", {ANY}),
          even_table_(even_table, "even_table", {ANY, STRAIGHT + DRAGS, ANY, ANY, ANY}),
          odd_table_(odd_table, "odd_table", {even_table_.length(0), DRAGS, even_table_.length(2), even_table_.length(3), ANY}),
          even_modes_(even_modes, "even_modes", {even_table_.length(4), edges_.length(), 3, ANY}),
          odd_modes_(odd_modes, "odd_modes", {odd_table_.length(4), edges_.length(), 3, even_modes_.length(3)}),
          points_(points, "points", {ANY, 3}),
          eyes_(eyes, "eyes", {points_.length(), 3}) {
        within(even_table_.length(0), "even_table", 4, 1000);
        within(even_table_.length(2), "even_table", 1, 16);
        within(even_table_.length(3), "even_table", 1, 8);
        within(edges_.length(), "edges", 2, 10000);
        within(even_modes_.length(3), "even_modes", 1, 100);
        for (int k = 0; k < DOME_NUMBERS; ++k) within(numbers_.data()[k], "numbers", k == 1 ? -1e3 : 1e-9, 1e3);
        for (py::ssize_t k = 0; k < edges_.length(); ++k) within(edges_.data()[k], "edges", k ? edges_.data()[k - 1] : 0.0, 1.0);
    }
    DomeLibrary library() const {
        const double* n = numbers_.data();
        return {length(even_table_, 0) - 3,
                length(even_table_, 2),
                length(even_table_, 3),
                length(edges_, 0) - 1,
                length(even_modes_, 3) - 1,
                length(even_table_, 4),
                length(odd_table_, 4),
                n[0],
                n[1],
                n[2],
                n[3],
                n[4],
                n[5],
                n[6],
                n[7],
                edges_.data(),
                even_table_.data(),
                odd_table_.data(),
                even_modes_.data(),
                odd_modes_.data()};
    }
    DomeMarkers markers(double plane_z) const { return {points_.length(), points_.data(), eyes_.data(), plane_z}; }
    py::ssize_t count() const { return points_.length(); }

 private:
    static constexpr int DOME_NUMBERS = 8;
    template <class Array>
    static int length(const Array& array, int axis) {
        return static_cast<int>(array.length(axis));
    }
    const Input<double> numbers_, edges_;
    const Input<float> even_table_, odd_table_, even_modes_, odd_modes_;
    const Input<double> points_, eyes_;
};

constexpr double LARGEST_NUMBER = 1e3;  // of a press: m, and logs. Chosen: far outside any dome
constexpr int MOST_PRESSES = 8;         // Chosen
constexpr int MOST_SHARED = 100;        // Chosen

int presses_in(const Input<double>& presses, const char* name) {
    for (py::ssize_t k = 0; k < presses.length() * PRESS; ++k) within(presses.data()[k], name, -LARGEST_NUMBER, LARGEST_NUMBER);
    return static_cast<int>(within(presses.length(), name, 0, MOST_PRESSES));
}

py::array_t<double> pressed_dome(const py::object& numbers, const py::object& edges, const py::object& even_table,
                                 const py::object& odd_table, const py::object& even_modes, const py::object& odd_modes,
                                 const py::object& points, const py::object& eyes, const py::object& presses) {
    const DomeArrays dome(numbers, edges, even_table, odd_table, even_modes, odd_modes, points, eyes);
    const Input<double> given(presses, "presses", {ANY, PRESS});
    const int count = presses_in(given, "presses");
    std::vector<double> moved(3 * dome.count());
    press_dome(dome.library(), dome.markers(0), given.data(), count, moved.data());
    return rows_of(moved);
}

py::tuple fitted_dome(const py::object& numbers, const py::object& edges, const py::object& even_table, const py::object& odd_table,
                      const py::object& even_modes, const py::object& odd_modes, const py::object& points, const py::object& eyes,
                      double plane_z, const py::object& shift, const py::object& weight, const py::object& shared, const py::object& starts,
                      const py::object& prior) {
    const DomeArrays dome(numbers, edges, even_table, odd_table, even_modes, odd_modes, points, eyes);
    const Input<double> seen(shift, "shift", {dome.count(), 2}), sure(weight, "weight", {dome.count()});
    const Input<double> alike(shared, "shared", {ANY, dome.count()});
    const Input<double> given(starts, "starts", {ANY, PRESS}), known(prior, "prior", {5, PRESS});
    const int count = presses_in(given, "starts");
    for (int k = 0; k < 5 * PRESS; ++k) within(known.data()[k], "prior", k < PRESS ? -1e15 : k < 2 * PRESS ? 0 : -1e15, 1e15);
    for (int k = 0; k < PRESS; ++k) {
        within(known.data()[3 * PRESS + k], "prior", known.data()[2 * PRESS + k], LARGEST_NUMBER);
        within(known.data()[4 * PRESS + k], "prior", 1e-12, 1e15);
    }
    within(plane_z, "plane_z", -LARGEST_NUMBER, LARGEST_NUMBER);
    within(alike.length(), "shared", 0, MOST_SHARED);
    const double* rows = known.data();
    const DomeFit fit = without_gil([&] {
        return fit_dome(dome.library(), dome.markers(plane_z), seen.data(), {sure.data(), alike.data(), static_cast<int>(alike.length())},
                        given.data(), count, {rows, rows + PRESS, rows + 2 * PRESS, rows + 3 * PRESS, rows + 4 * PRESS});
    });
    return py::make_tuple(rows_of(fit.presses, PRESS), output(fit.covariance, {count * PRESS, count * PRESS}), rows_of(fit.left, 2),
                          fit.squares);
}

}  // namespace

void bind_dome(py::module_& module) {
    module.def("press_dome", &pressed_dome, py::kw_only(), py::arg("numbers"), py::arg("edges"), py::arg("even_table"),
               py::arg("odd_table"), py::arg("even_modes"), py::arg("odd_modes"), py::arg("points"), py::arg("eyes"), py::arg("presses"),
               "Displacement (K, 3) float64, m, of a dome's markers at points (K, 3), m, under presses (n, 7) that add up.\n\n"
               "A press: x, y of the tip before a drag, m; log depth, m; logs of its radius and of friction over the library's middle\n"
               "ones, over their spreads; way of the drag, with the skin, over the depth along x and y. The first six arrays are\n"
               "DomeLibrary.arrays.");
    module.def(
        "fit_dome", &fitted_dome, py::kw_only(), py::arg("numbers"), py::arg("edges"), py::arg("even_table"), py::arg("odd_table"),
        py::arg("even_modes"), py::arg("odd_modes"), py::arg("points"), py::arg("eyes"), py::arg("plane_z"), py::arg("shift"),
        py::arg("weight"), py::arg("shared"), py::arg("starts"), py::arg("prior"),
        "Presses (n, 7), as of press_dome, that explain apparent displacements shift (K, 2), m, in the plane at plane_z, m, seen from\n"
        "eyes (K, 3), m; their covariance (7 n, 7 n), the residuals (K, 2), m, and the sum of the weighted squared residuals.\n\n"
        "weight: (K,), 0 for a marker that is not seen; shared: (m, K), rows whose products are taken off the weight matrix of each axis,\n"
        "of an error that markers share; starts: (n, 7); prior: (5, 7): mean, weight, least, most and longest step.");
}

}  // namespace tactile::border
