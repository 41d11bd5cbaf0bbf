// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels of the PSD finger; see bindings.cpp, whose length they would exceed.
#include "bindings.hpp"
#include "border.hpp"
#include "finger.hpp"

namespace py = pybind11;
using namespace tactile;
using tactile::border::ANY;
using tactile::border::Input;
using tactile::border::output;
using tactile::border::within;

namespace {

constexpr double LARGEST_VOLTAGE = 1e12;  // V. Chosen: beyond any signal, and squares stay far from overflow

PlaceTable as_table(const Input<double>& table) {
    const py::ssize_t nodes = table.length(0);
    if (nodes < 2 || table.length(1) != nodes || table.length(2) < 3)
        throw py::value_error("table: nodes x nodes values of 3 or more channels are needed, 2 nodes or more");
    return {table.data(), nodes, table.length(2)};
}

py::tuple samples(const py::object& volts, const py::object& offset, const py::object& table, double lit, double least, double saturation,
                  py::ssize_t level) {
    const Input<double> given(volts, "volts", {ANY, 4}), rest(offset, "offset", {4}), values(table, "table", {ANY, ANY, ANY});
    const PlaceTable known = as_table(values);
    FingerLimits limits{{},
                        within(lit, "lit", 0, LARGEST_VOLTAGE),
                        within(least, "least", 0, LARGEST_VOLTAGE),
                        within(saturation, "saturation", 0, LARGEST_VOLTAGE),
                        within(level, "level", 0, static_cast<double>(known.channels - 1))};
    std::copy(rest.data(), rest.data() + 4, limits.offset.begin());
    FingerSamples found;
    {
        py::gil_scoped_release others_run;
        found = finger_samples(given.data(), given.length(), limits, known);
    }
    const py::ssize_t count = given.length();
    const std::vector<bool> saturated(found.saturated.begin(), found.saturated.end());
    return py::make_tuple(output(found.sums, {count, 4}), output(found.place, {count, 2}), output(found.over, {count}),
                          output<bool>(saturated, {count}), found.known, found.lowest, found.highest, found.least_over);
}

py::tuple repeats(const py::object& volts, const py::object& last, const py::object& same, double saturation) {
    const Input<double> given(volts, "volts", {ANY, 4}), before(last, "last", {4}), so_far(same, "same", {4});
    std::vector<double> sample(before.data(), before.data() + 4), counts(so_far.data(), so_far.data() + 4);
    count_repeats(given.data(), given.length(), saturation, sample.data(), counts.data());
    return py::make_tuple(output(sample, {4}), output(counts, {4}));
}

py::tuple contact(const py::object& sums, const py::object& used, const py::object& table, const py::object& noise, double shot) {
    const Input<double> given(sums, "sums", {ANY, 4}), values(table, "table", {ANY, ANY, ANY}), spread(noise, "noise", {4, 4});
    const Input<bool> chosen(used, "used", {given.length()});
    const PlaceTable known = as_table(values);
    within(shot, "shot", 0, LARGEST_VOLTAGE);
    FingerContact found;
    {
        py::gil_scoped_release others_run;
        found =
            finger_contact(given.data(), reinterpret_cast<const std::uint8_t*>(chosen.data()), given.length(), known, spread.data(), shot);
    }
    return py::make_tuple(output(found.sums, {4}), output(found.place, {2}), output(found.normal, {3}), output(found.covariance, {3, 3}),
                          output(found.row, {known.channels}));
}

py::array_t<double> values_at(const py::object& places, const py::object& table) {
    const Input<double> given(places, "places", {ANY, 2}), values(table, "table", {ANY, ANY, ANY});
    const PlaceTable known = as_table(values);
    std::vector<double> found;
    {
        py::gil_scoped_release others_run;
        found = place_values(given.data(), given.length(), known);
    }
    return output(found, {given.length(), known.channels});
}

py::array_t<double> covariance_of_place(const py::object& place, double total, const py::object& noise, double shot) {
    const Input<double> at(place, "place", {2}), spread(noise, "noise", {4, 4});
    const std::array<double, 3> found = place_covariance(at.data()[0], at.data()[1], total, spread.data(), shot);
    return output(std::array<double, 4>{found[0], found[1], found[1], found[2]}, {2, 2});
}

}  // namespace

void tactile::border::bind_finger(py::module_& module) {
    module.def(
        "finger_samples", &samples, py::arg("volts"), py::arg("offset"), py::arg("table"), py::kw_only(), py::arg("lit"), py::arg("least"),
        py::arg("saturation"), py::arg("level"),
        "Of voltages (N, 4) float64, V, less the offset (4,): sums (N, 4), the differences along x and y, the total and the cross term\n"
        "(eq 1); places (N, 2), half widths, NaN where the total is not above lit, V; total above the light at first contact (N,), V: the\n"
        "table's channel level, at least least; whether an output saturates (N,); how many samples are finite; the lowest and the highest\n"
        "total; the lowest total above first contact.");
    module.def("count_repeats", &repeats, py::arg("volts"), py::arg("last"), py::arg("same"), py::kw_only(), py::arg("saturation"),
               "The last of samples (N, 4) float64, V, and for how many each output has been unchanged (4,), 0 for a saturated one; last,\n"
               "same: (4,) the same of the samples before.");
    module.def(
        "finger_contact", &contact, py::arg("sums"), py::arg("used"), py::arg("table"), py::kw_only(), py::arg("noise"), py::arg("shot"),
        "The contact of the mean of those sums (N, 4) float64 that are used (N,) bool: its sums (4,), place (2,), normal (3,), covariance\n"
        "(3, 3) of the normal by the light's noise, and values (channels,) of the table. noise: (4, 4) covariance of a sample's sums, "
        "V^2;\n"
        "shot: V, variance of an output per V of its signal. NaN where none is used or no light is left.");
    module.def(
        "place_values", &values_at, py::arg("places"), py::arg("table"),
        "Values (N, channels) of the table (nodes, nodes, channels) float64, rows along y, at places (N, 2) float64, clipped to -1 to 1.");
    module.def("place_covariance", &covariance_of_place, py::arg("place"), py::arg("total"), py::arg("noise"), py::arg("shot"),
               "Covariance (2, 2), half widths squared, of a place (2,) measured with that total, V: eq 1 to first order.");
}
