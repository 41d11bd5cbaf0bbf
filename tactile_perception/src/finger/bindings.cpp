// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The PSD finger for Python, as module _core.finger.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "finger/finger.hpp"

namespace tactile::border {
namespace {

using namespace finger;

constexpr double MAX_STAMP_S = 1e12;

// The attributes of tactile_perception.finger.model.FingerModel that a running finger needs.
std::shared_ptr<const FingerModel> as_model(const py::object& given) {
    static_assert(CHANNELS == 13);
    Lengths lengths;
    const Lines lines{"table (N=2..1000000, N, 13)", "cross_volts [0, 1e9]"};
    auto model = std::make_shared<FingerModel>(from_attributes<FingerModel>(given, lines, lengths));
    model->nodes = lengths['N'];
    const Rule rule("room (4)");
    const py::object room = given.attr("room"), creep = given.attr("creep");
    model->room.setConstant(UNKNOWN);
    if (!room.is_none()) model->room = Taken<Eigen::Vector4d>(room, &rule, lengths).get();
    if (!creep.is_none()) {
        model->creep = from_attributes<Creep>(creep, {"share [0, 1]", "seconds [1e-9, 1e9]"}, lengths);
        model->creep.measured = true;
    }
    return model;
}

// Voltages (N, 4), float32 or float64, as a column a sample.
Eigen::Matrix4Xd as_volts(const py::object& given) try {
    Lengths lengths;
    const Rule rule("volts (N=1..1000000000000, 4)");
    if (py::isinstance<py::array_t<float>>(given)) {
        const Taken<const float*> volts(given, &rule, lengths);
        return Eigen::Map<const Eigen::Matrix4Xf>(volts.get(), 4, lengths['N']).cast<double>();
    }
    const Taken<const double*> volts(given, &rule, lengths);
    return Eigen::Map<const Eigen::Matrix4Xd>(volts.get(), 4, lengths['N']);
} catch (const py::error_already_set& error) {
    refuse(py::str(error.value()), "BadFrame");
}

Estimates estimate(PsdFinger& finger, const py::object& volts, double stamp_s, double period) {
    const Eigen::Matrix4Xd given = as_volts(volts);
    if (!(std::isnan(period) && given.cols() == 1) && !(period >= 1e-9 && period <= 1e9))
        refuse("sample_period is " + std::to_string(period) + " s; it must be positive and finite (NaN only for a single sample)",
               "BadFrame");
    if (!(std::abs(stamp_s) <= MAX_STAMP_S))
        refuse("stamp_s is " + std::to_string(stamp_s) + " s; it must be a time in seconds", "BadFrame");
    return without_gil([&] { return change(finger, [&](PsdFinger& next) { return next.estimate(given, stamp_s, period); }); });
}

}  // namespace

static void bind_finger(py::module_& parent) {
    py::module_ module = parent.def_submodule("finger", "The PSD finger: batches of voltages in, contacts out.");
    for (const auto& [name, flag] : {std::pair("OUT_OF_RANGE", OUT_OF_RANGE), {"AMBIGUOUS", AMBIGUOUS}, {"SATURATED", SATURATED}})
        module.attr(name) = static_cast<int>(flag);
    class_of<Touch>(module, "Touch", "One contact; NaN where not known: src/finger/touch.hpp.");
    class_of<Estimate>(module, "Estimate",
                       "The result of some samples, at the mean of their numbers in the batch; touch: None without one.");
    class_of<Estimates>(module, "Estimates", "The results of a batch: src/finger/finger.hpp.");
    def(module, "centroid_covariance", "Covariance (2, 2) of a centroid, half widths squared: src/finger/touch.hpp.",
        {"spot (2)", "total", "noise (4, 4)"}, centroid_covariance);
    record<FingerSettings>(module, "FingerSettings", "Settings of a finger: src/finger/finger.hpp.",
                           {"radius saturation reference_seconds fastest_drift threshold [1e-9, 1e9]"});  // products are far from overflow
    auto finger =
        class_of<PsdFinger>(module, "PsdFinger",
                            "A PSD finger: voltages of its four outputs, in batches of any size, to contacts. It holds the state\n"
                            "between batches, and is unchanged after an exception. model: finger.model.FingerModel.");
    get(finger, "stuck", "[4] whether an output has stopped changing", &PsdFinger::stuck);
    get(finger, "ready", "whether the reference is measured", [](const PsdFinger& one) { return one.light().ready(); });
    get(finger, "offset", "(4,) V, of the untouched outputs", [](const PsdFinger& one) { return one.light().offset(); });
    get(finger, "sigma", "V, of the total without contact", [](const PsdFinger& one) { return one.light().sigma(); });
    const auto made = [](const py::object& model, const FingerSettings& settings) { return PsdFinger(as_model(model), settings); };
    init(finger, {"model", "settings"}, made, FingerSettings());
    def(finger, "estimate",
        "Estimates of voltages (N, 4), V, from stamp_s on, period s apart: src/finger/finger.hpp. Raises BadFrame for what cannot be.",
        {"volts", "stamp_s", "period"}, estimate);
    def(finger, "set_reference", "Measure the untouched state again, from the next samples.", {}, &PsdFinger::set_reference);
}

static const Subject SUBJECT("finger", bind_finger);

}  // namespace tactile::border
