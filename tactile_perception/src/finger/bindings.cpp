// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The PSD finger for Python, as module _core.finger.
#include "bindings/bindings.hpp"

#include "bindings/border.hpp"
#include "finger/finger.hpp"

namespace tactile::border {
namespace {

using namespace finger;

constexpr double MIN_SETTING = 1e-9, MAX_SETTING = 1e9;  // s and V: beyond any sensor, and products stay far from overflow
constexpr double MAX_STAMP_S = 1e12;

double setting(double value, const char* name, double least = MIN_SETTING) {
    if (value >= least && value <= MAX_SETTING) return value;
    refuse("BadArgument", std::string("PSD finger: ") + name + " is " + std::to_string(value) + "; it must be positive and finite");
}

FingerSettings made_settings(double radius, double saturation, double reference_seconds, double fastest_drift, double threshold,
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
    Attributes of{given};
    static_assert(CHANNELS == 13);
    const auto kept = of.take<Array<double>>("table (N=2..1000000, N, 13)"), loads = of.take<Array<double>>("load_terms (2, 8)");
    auto model = std::make_shared<FingerModel>();
    model->table = kept.get().vector(), model->nodes = kept.get().length();
    model->load_terms = Eigen::Map<const Eigen::Matrix<double, 2, 8, Eigen::RowMajor>>(loads.get().data);
    model->cross_volts = of.take<double>("cross_volts [0, 1e9]").get();
    model->room.setConstant(UNKNOWN);
    if (!given.attr("room").is_none()) model->room = of.take<Eigen::Vector4d>("room (4)").get();
    if (Attributes creep{given.attr("creep")}; !creep.owner.is_none())
        model->creep = {creep.take<double>("share [0, 1]").get(), creep.take<double>("seconds [1e-9, 1e9]").get(), true};
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
} catch (const py::value_error& error) {
    refuse("BadFrame", error.what());
}

void check_period(double period) {
    if (period >= MIN_SETTING && period <= MAX_SETTING) return;
    refuse("BadFrame", "sample_period is " + std::to_string(period) + " s; it must be positive and finite (NaN only for a single sample)");
}

Estimates estimate(PsdFinger& finger, const py::object& volts, double stamp_s, double period) {
    const Eigen::Matrix4Xd given = as_volts(volts);
    if (!(std::isnan(period) && given.cols() == 1)) check_period(period);
    if (!(std::abs(stamp_s) <= MAX_STAMP_S))
        refuse("BadFrame", "stamp_s is " + std::to_string(stamp_s) + " s; it must be a time in seconds");
    return without_gil([&] { return change(finger, [&](PsdFinger& next) { return next.estimate(given, stamp_s, period); }); });
}

}  // namespace

static void bind_finger(py::module_& parent) {
    py::module_ module = parent.def_submodule("finger", "The PSD finger: batches of voltages in, contacts out.");
    module.attr("OUT_OF_RANGE") = static_cast<int>(OUT_OF_RANGE);
    module.attr("AMBIGUOUS") = static_cast<int>(AMBIGUOUS);
    module.attr("SATURATED") = static_cast<int>(SATURATED);
    class_of<Touch>(module, "Touch", "One contact; NaN where not known: src/finger/touch.hpp.", get("id", &Touch::id),
                    get("position (3)", &Touch::position, "m"), get("normal (3)", &Touch::normal, "outward"),
                    get("force", &Touch::force, "N"), get("depth", &Touch::depth, "m"),
                    get("position_covariance (3, 3)", &Touch::covariance, "m^2"),
                    get("flags", &Touch::flags, "sum of OUT_OF_RANGE, AMBIGUOUS, SATURATED"));
    class_of<Estimate>(module, "Estimate", "The result of some samples.", get("at", &Estimate::at, "mean of their numbers in the batch"),
                       get("touch", &Estimate::touch, "Touch, or None where nothing touches"));
    class_of<Estimates>(
        module, "Estimates", "The results of a batch.", get("estimates", &Estimates::estimates, "list of Estimate"),
        get("needs_period", &Estimates::needs_period, "a single sample of unknown rate follows no other: it has no result"));
    def(module, "centroid_covariance",
        "Covariance (2, 2), half widths squared, of a centroid that is measured with that total, V (eq 1 to first order). noise:\n"
        "covariance of the sums, V^2.",
        centroid_covariance, "spot (2)", "total", "noise (4, 4)");
    const FingerSettings usual;
    auto settings = class_of<FingerSettings>(
        module, "FingerSettings",
        "Settings of a finger: src/finger/finger.hpp. Raises BadArgument for a number that is not positive and finite.",
        get("radius", &FingerSettings::radius, "m"));
    init(settings, made_settings, py::kw_only(), py::arg("radius") = usual.radius, py::arg("saturation") = usual.saturation,
         py::arg("reference_seconds") = usual.reference_seconds, py::arg("fastest_drift") = usual.fastest_drift,
         py::arg("threshold") = usual.threshold, py::arg("each_sample") = usual.each_sample);
    auto finger = class_of<PsdFinger>(
        module, "PsdFinger",
        "A PSD finger: voltages of its four outputs, in batches of any size, to contacts. It holds the state between batches, can be\n"
        "copied, and is unchanged after an exception. model: FingerModel.",
        get("stuck", &PsdFinger::stuck, "[4] whether an output has stopped changing"),
        get(
            "ready", [](const PsdFinger& one) { return one.light().ready(); }, "whether the reference is measured"),
        get(
            "offset", [](const PsdFinger& one) { return one.light().offset(); }, "(4,) V, of the untouched outputs"),
        get("sigma", [](const PsdFinger& one) { return one.light().sigma(); }, "V, standard deviation of the total without contact"));
    init(
        finger, [](const py::object& model, const FingerSettings& settings) { return PsdFinger(as_model(model), settings); }, "model",
        py::arg_v("settings", usual, "FingerSettings()"));
    def(finger, "estimate",
        "Estimates of a batch of voltages (N, 4), V, whose first sample was taken at stamp_s, s; period: s between samples, NaN for a "
        "single\n"
        "sample of unknown rate. One result for each run of samples with one contact or with none, or for each sample; none for samples\n"
        "without a reference. Raises BadFrame for another shape or an invalid period or stamp.",
        estimate, "volts", "stamp_s", "period");
    def(finger, "set_reference", "Measure the untouched state again, from the next samples.", &PsdFinger::set_reference);
}

static const Subject SUBJECT("finger", bind_finger);

}  // namespace tactile::border
