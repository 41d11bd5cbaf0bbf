// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Python bindings of the kernels of the PSD finger; see bindings.cpp, whose length they would exceed.
#include <cstring>

#include "bindings/bindings.hpp"
#include "bindings/border.hpp"
#include "psd/finger.hpp"
#include "psd/held_light.hpp"

namespace tactile::border {
namespace {

constexpr double LARGEST_VOLTAGE = 1e12;  // V. Chosen: beyond any signal, and squares stay far from overflow
constexpr double LARGEST_RADIUS = 1e3;    // m. Chosen: beyond any finger
constexpr double LARGEST_PERIOD = 1e6;    // s. Chosen: beyond any sample period

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

// The table of a finger, whose channels have a meaning.
PlaceTable as_finger(const Input<double>& table) {
    const PlaceTable known = as_table(table);
    if (known.channels != FINGER_CHANNELS)
        throw py::value_error("table: " + std::to_string(FINGER_CHANNELS) + " channels are needed, got " + std::to_string(known.channels));
    return known;
}

const std::uint8_t* bytes(const Input<bool>& flags) {
    return reinterpret_cast<const std::uint8_t*>(flags.data());
}

// The state of a contact's light, which Python holds as one array.
HeldState as_held(const Input<double>& numbers) {
    HeldState state;
    std::memcpy(&state, numbers.data(), sizeof(state));
    within(state.bins, "state", 0, RESTS);
    return state;
}

py::object touch(const py::object& sums, const py::object& in_contact, const py::object& saturated, const py::object& table,
                 const py::object& noise, const py::object& loads, const py::object& state, double shot, double cross_volts,
                 double offset_volts, double radius, bool stuck) {
    const Input<double> given(sums, "sums", {ANY, 4}), values(table, "table", {ANY, ANY, ANY}), spread(noise, "noise", {4, 4}),
        terms(loads, "loads", {2, 8}), numbers(state, "state", {HELD_NUMBERS});
    const Input<bool> inside(in_contact, "in_contact", {given.length()}), clipped(saturated, "saturated", {given.length()});
    const HeldState held = as_held(numbers);
    const FingerRules finger{as_finger(values),
                             spread.data(),
                             terms.data(),
                             within(shot, "shot", 0, LARGEST_VOLTAGE),
                             within(cross_volts, "cross_volts", 0, LARGEST_VOLTAGE),
                             within(radius, "radius", 0, LARGEST_RADIUS),
                             held.room,
                             std::hypot(within(offset_volts, "offset_volts", 0, LARGEST_VOLTAGE), shaded_volts(held)),
                             lamp_volts(held, std::sqrt(spread.data()[4 * TOTAL + TOTAL])),
                             stuck};
    FingerTouch found;
    {
        py::gil_scoped_release others_run;
        found = finger_touch(given.data(), bytes(inside), bytes(clipped), given.length(), finger);
    }
    if (found.samples == 0) return py::none();
    return py::make_tuple(output(found.position, {3}), output(found.normal, {3}), found.force, found.depth,
                          output(found.covariance, {3, 3}), found.flags);
}

py::array_t<double> held_numbers(const HeldState& state) {
    py::array_t<double> numbers(HELD_NUMBERS);
    std::memcpy(numbers.mutable_data(), &state, sizeof(state));
    return numbers;
}

py::array_t<double> held_before() {
    return held_numbers(HeldState{});
}

py::array_t<double> held_begin(const py::object& state, const py::object& offset, const py::object& calibrated) {
    const Input<double> numbers(state, "state", {HELD_NUMBERS}), rest(offset, "offset", {4}), then(calibrated, "calibrated", {4});
    HeldState held = as_held(numbers);
    begin_held(held, rest.data(), then.data());
    return held_numbers(held);
}

py::array_t<double> held_interrupt(const py::object& state) {
    const Input<double> numbers(state, "state", {HELD_NUMBERS});
    HeldState held = as_held(numbers);
    interrupt_held(held);
    return held_numbers(held);
}

py::tuple held_follow(const py::object& state, const py::object& sums, const py::object& in_contact, const py::object& saturated,
                      const py::object& table, const py::object& noise, double cross_volts, double period) {
    const Input<double> numbers(state, "state", {HELD_NUMBERS}), given(sums, "sums", {ANY, 4}), values(table, "table", {ANY, ANY, ANY}),
        spread(noise, "noise", {4, 4});
    const Input<bool> inside(in_contact, "in_contact", {given.length()}), clipped(saturated, "saturated", {given.length()});
    const HeldFinger finger{as_finger(values), spread.data(), within(cross_volts, "cross_volts", 0, LARGEST_VOLTAGE),
                            within(period, "period", 0, LARGEST_PERIOD)};
    HeldState held = as_held(numbers);
    py::array_t<double> corrected({given.length(), py::ssize_t{4}});
    std::copy(given.data(), given.data() + corrected.size(), corrected.mutable_data());
    FingerSums shift{};
    bool lasts = false;
    {
        double* changed = corrected.mutable_data();
        py::gil_scoped_release others_run;
        lasts = follow_held(held, changed, bytes(inside), bytes(clipped), given.length(), finger, shift);
    }
    return py::make_tuple(held_numbers(held), corrected, lasts ? py::object(output(unmixed(shift), {4})) : py::none());
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

void bind_finger(py::module_& module) {
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
        "finger_touch", &touch, py::arg("sums"), py::arg("in_contact"), py::arg("saturated"), py::arg("table"), py::arg("noise"),
        py::arg("loads"), py::arg("state"), py::kw_only(), py::arg("shot"), py::arg("cross_volts"), py::arg("offset_volts"),
        py::arg("radius"), py::arg("stuck"),
        "The contact of the mean of those sums (N, 4) float64 that are in contact (N,) bool and not saturated (N,) bool; None where none\n"
        "is in contact. Its position (3,), m, normal (3,), force, N, depth, m, covariance (3, 3) of the position, m^2, and flags. table:\n"
        "with the channels of a finger; noise: (4, 4) covariance of a sample's sums, V^2; loads: (2, 8) coefficients of log N and log m,\n"
        "NaN where not calibrated; state: of the held light; shot: V, variance of an output per V of its signal; cross_volts: V, standard\n"
        "deviation of the cross term of a single contact; offset_volts: V, of the total of the untouched outputs; radius: m; stuck:\n"
        "whether an output has stopped changing. NaN where it cannot be told.");
    module.def("held_before", &held_before,
               "The state of held light before the first contact, an array of numbers for the functions below.");
    module.def(
        "held_begin", &held_begin, py::arg("state"), py::arg("offset"), py::arg("calibrated"),
        "The state as a contact begins on a finger whose untouched outputs are offset (4,) float64, V; calibrated: (4,) float64, V,\n"
        "the same at its calibration.");
    module.def("held_interrupt", &held_interrupt, py::arg("state"), "The state after samples that are missing.");
    module.def(
        "held_follow", &held_follow, py::arg("state"), py::arg("sums"), py::arg("in_contact"), py::arg("saturated"), py::arg("table"),
        py::arg("noise"), py::kw_only(), py::arg("cross_volts"), py::arg("period"),
        "The state after sums (N, 4) float64 of samples period s apart, in contact (N,) bool or not, saturated (N,) bool or not; those\n"
        "sums, where in contact corrected for ambient light that changes meanwhile; and by what (4,), V, the untouched outputs have\n"
        "become brighter if that is certain and lasts, else None. table, noise, cross_volts: as in finger_touch.");
    module.def(
        "place_values", &values_at, py::arg("places"), py::arg("table"),
        "Values (N, channels) of the table (nodes, nodes, channels) float64, rows along y, at places (N, 2) float64, clipped to -1 to 1.");
    module.def("place_covariance", &covariance_of_place, py::arg("place"), py::arg("total"), py::arg("noise"), py::arg("shot"),
               "Covariance (2, 2), half widths squared, of a place (2,) measured with that total, V: eq 1 to first order.");
}

}  // namespace tactile::border
