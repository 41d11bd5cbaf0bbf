// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The PSD finger for Python, as module _core.finger.
#include "bindings/bindings.hpp"

#include <pybind11/eigen.h>

#include "bindings/border.hpp"
#include "finger/finger.hpp"

namespace tactile::border {
namespace {

using finger::CHANNELS;
using finger::Creep;
using finger::Estimate;
using finger::Estimates;
using finger::FingerModel;
using finger::FingerSettings;
using finger::PsdFinger;
using finger::Touch;

constexpr double LEAST = 1e-9, LARGEST = 1e9;  // of settings, s and V. Chosen: beyond any sensor, and products stay far from overflow
constexpr double LATEST = 1e12;                // s, of a stamp. Chosen

double setting(double value, const char* name, double least = LEAST) {
    if (value >= least && value <= LARGEST) return value;
    refuse("BadArgument", std::string("PSD finger: ") + name + " is " + std::to_string(value) + "; it must be positive and finite");
}

FingerSettings make_settings(double radius, double saturation, double reference_seconds, double fastest_drift, double threshold,
                             bool each_sample) {
    return {setting(radius, "radius"),
            setting(saturation, "saturation"),
            setting(reference_seconds, "reference_seconds"),
            setting(fastest_drift, "fastest_drift"),
            std::isnan(threshold) ? threshold : setting(threshold, "threshold"),
            each_sample};
}

// The attributes of tactile_perception.finger.model.FingerModel that a running finger needs.
std::shared_ptr<const FingerModel> as_model(const py::object& given) {
    const Input<double> table(given.attr("table"), "table", {ANY, ANY, CHANNELS}), loads(given.attr("load_terms"), "load_terms", {2, 8});
    const py::ssize_t nodes = table.length(0);
    if (nodes < 2 || table.length(1) != nodes) throw py::value_error("table: nodes x nodes values are needed, 2 nodes or more");
    auto model = std::make_shared<FingerModel>();
    model->table.assign(table.data(), table.data() + nodes * nodes * CHANNELS);
    model->nodes = nodes;
    model->load_terms = Eigen::Map<const Eigen::Matrix<double, 2, 8, Eigen::RowMajor>>(loads.data());
    model->cross_volts = within(given.attr("cross_volts").cast<double>(), "cross_volts", 0, LARGEST);
    model->room.setConstant(finger::UNKNOWN);
    if (const py::object room = given.attr("room"); !room.is_none())
        model->room = Eigen::Map<const Eigen::Vector4d>(Input<double>(room, "room", {4}).data());
    if (const py::object creep = given.attr("creep"); !creep.is_none())
        model->creep = {within(creep.attr("share").cast<double>(), "creep.share", 0, 1),
                        within(creep.attr("seconds").cast<double>(), "creep.seconds", LEAST, LARGEST), true};
    return model;
}

// Voltages (N, 4), float32 or float64, as a column a sample.
Eigen::Matrix4Xd as_volts(const py::object& given) try {
    if (py::isinstance<py::array>(given) && py::len(given.attr("shape")) == 2 && py::len(given) == 0)
        throw py::value_error("volts: the shape " + std::string(py::str(given.attr("shape"))) + " has no samples");
    if (py::isinstance<py::array_t<float>>(given)) {
        const Input<float> volts(given, "volts", {ANY, 4});
        return Eigen::Map<const Eigen::Matrix4Xf>(volts.data(), 4, volts.length()).cast<double>();
    }
    const Input<double> volts(given, "volts", {ANY, 4});
    return Eigen::Map<const Eigen::Matrix4Xd>(volts.data(), 4, volts.length());
} catch (const py::value_error& error) {
    refuse("BadFrame", error.what());
}

void check_period(double period) {
    if (period >= LEAST && period <= LARGEST) return;
    refuse("BadFrame", "sample_period is " + std::to_string(period) + " s; it must be positive and finite (NaN only for a single sample)");
}

Estimates estimate(PsdFinger& finger, const py::object& volts, double stamp_s, double period) {
    const Eigen::Matrix4Xd given = as_volts(volts);
    if (!(std::isnan(period) && given.cols() == 1)) check_period(period);
    if (!(std::abs(stamp_s) <= LATEST)) refuse("BadFrame", "stamp_s is " + std::to_string(stamp_s) + " s; it must be a time");
    return change(finger, [&](PsdFinger& next) { return next.estimate(given, stamp_s, period); });
}

Eigen::Matrix2d covariance_of_centroid(const py::object& place, double total, const py::object& noise) {
    const Input<double> at(place, "place", {2}), sums(noise, "noise", {4, 4});
    const Eigen::Map<const Eigen::Matrix4d> spread(sums.data());
    return finger::centroid_covariance(Eigen::Map<const Eigen::Vector2d>(at.data()), total, spread);
}

void bind_results(py::module_& module) {
    py::class_<Touch>(module, "Touch", "One contact. NaN: not known.")
        .def_readonly("id", &Touch::id, "constant while the contact lasts, from 1 on")
        .def_readonly("position", &Touch::position, "(3,) m")
        .def_readonly("normal", &Touch::normal, "(3,) unit vector, outwards")
        .def_readonly("force", &Touch::force, "N, NaN where not calibrated")
        .def_readonly("depth", &Touch::depth, "m, NaN where not calibrated")
        .def_readonly("position_covariance", &Touch::covariance, "(3, 3) of the position, m^2")
        .def_readonly("flags", &Touch::flags, "sum of OUT_OF_RANGE, AMBIGUOUS, SATURATED");
    py::class_<Estimate>(module, "Estimate", "The result of some samples.")
        .def_readonly("at", &Estimate::at, "mean of their numbers in the batch")
        .def_readonly("touch", &Estimate::touch, "Touch, or None where nothing touches");
    py::class_<Estimates>(module, "Estimates", "The results of a batch.")
        .def_readonly("estimates", &Estimates::estimates, "list of Estimate")
        .def_readonly("needs_period", &Estimates::needs_period, "a single sample of unknown rate follows no other: it has no result");
}

}  // namespace

void bind_finger(py::module_& parent) {
    py::module_ module = parent.def_submodule("finger", "The PSD finger: batches of voltages in, contacts out.");
    module.attr("OUT_OF_RANGE") = static_cast<int>(finger::OUT_OF_RANGE);
    module.attr("AMBIGUOUS") = static_cast<int>(finger::AMBIGUOUS);
    module.attr("SATURATED") = static_cast<int>(finger::SATURATED);
    bind_results(module);
    module.def(
        "centroid_covariance", &covariance_of_centroid, py::arg("place"), py::arg("total"), py::arg("noise"),
        "Covariance (2, 2), half widths squared, of a centroid (2,) that is measured with that total, V (eq 1 to first order). noise:\n"
        "(4, 4) covariance of the sums, V^2.");
    const FingerSettings usual;
    py::class_<FingerSettings>(
        module, "FingerSettings",
        "Settings of a finger. radius: m, outer radius of the cover; saturation: V, at which an output saturates; "
        "reference_seconds: s, that\n"
        "the untouched outputs are measured for; fastest_drift: V/s, of their total; threshold: V, of the published "
        "method, NaN for contact\n"
        "by noise and calibration; each_sample: a result for each sample. Raises BadArgument for a number that is not positive and finite.")
        .def(py::init(&make_settings), py::kw_only(), py::arg("radius") = usual.radius, py::arg("saturation") = usual.saturation,
             py::arg("reference_seconds") = usual.reference_seconds, py::arg("fastest_drift") = usual.fastest_drift,
             py::arg("threshold") = usual.threshold, py::arg("each_sample") = usual.each_sample)
        .def_readonly("radius", &FingerSettings::radius, "m");
    copyable(py::class_<PsdFinger>(
                 module, "PsdFinger",
                 "A PSD finger: voltages of its four outputs, in batches of any size, to contacts. It holds what a batch hands to the\n"
                 "next, can be copied, and is as it was after an exception. model: FingerModel."))
        .def(py::init([](const py::object& model, const FingerSettings& settings) { return PsdFinger(as_model(model), settings); }),
             py::arg("model"), py::arg_v("settings", usual, "FingerSettings()"))
        .def(
            "estimate", &estimate, py::arg("volts"), py::arg("stamp_s"), py::arg("period"),
            "Estimates of a batch of voltages (N, 4), V, whose first sample was taken at stamp_s, s; period: s between samples, NaN for a\n"
            "single sample of unknown rate. One result for each run of samples with one contact or with none, or for each sample; none "
            "for\n"
            "samples without a reference. Raises BadFrame for another shape or a period or stamp that is none.")
        .def("set_reference", &PsdFinger::set_reference, "Measure the untouched state again from the next samples.")
        .def_property_readonly("stuck", &PsdFinger::stuck, "[4] whether an output has stopped changing")
        .def_property_readonly(
            "ready", [](const PsdFinger& one) { return one.light().ready(); }, "whether the reference is measured")
        .def_property_readonly(
            "offset", [](const PsdFinger& one) { return one.light().offset(); }, "(4,) V, of the untouched outputs")
        .def_property_readonly(
            "sigma", [](const PsdFinger& one) { return one.light().sigma(); }, "V, of the total at rest");
}

}  // namespace tactile::border
