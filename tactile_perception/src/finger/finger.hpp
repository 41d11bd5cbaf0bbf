// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The PSD finger: batches of voltages in, contacts out. One object holds the state between batches.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "finger/light.hpp"
#include "finger/touch.hpp"

namespace tactile::finger {

using Volts = Eigen::Ref<const Eigen::Matrix4Xd>;  // outputs of samples, V, a column each

struct FingerSettings {
    double radius = 0.016;           // m, outer radius of the cover
    double saturation = 4.9;         // V, at which an output saturates
    double reference_seconds = 0.2;  // s of untouched outputs at the start
    double fastest_drift = 0.1;      // V/s, fastest drift of the total of the untouched outputs
    double threshold = UNKNOWN;      // V, of the total: the published method; NaN: contact by noise and calibration, ambient light followed
    bool each_sample = false;        // a result for each sample, not for each run of them
    TACTILE_FIELDS(radius, saturation, reference_seconds, fastest_drift, threshold, each_sample)
};

// Single samples of a batch.
struct Samples {
    std::vector<std::uint8_t> known;      // the reference is available and the outputs are finite
    std::vector<std::uint8_t> contact;    // something touches
    std::vector<std::uint8_t> saturated;  // an output saturates
    std::vector<std::int64_t> id;         // of the contact, 0 for none
    Eigen::Matrix4Xd sums;                // V, net of ambient light; NaN where not known

    std::ptrdiff_t size() const { return static_cast<std::ptrdiff_t>(id.size()); }
    // (begin, end) of samples with one contact, or with none; unknown samples belong to the run before them.
    std::vector<std::pair<std::ptrdiff_t, std::ptrdiff_t>> runs() const;
};

// The result of some samples; at: the mean of their numbers in the batch.
struct Estimate {
    double at;
    std::optional<Touch> touch;
    TACTILE_FIELDS(at, touch)
};

struct Estimates {
    std::vector<Estimate> estimates;
    bool needs_period = false;  // a single sample of unknown rate that follows no other: it has no result
    TACTILE_FIELDS(estimates, needs_period)
};

// A finger: settings, calibrated model, and the state between batches.
class PsdFinger {
 public:
    PsdFinger(std::shared_ptr<const FingerModel> model, const FingerSettings& settings);
    // Measures the untouched state again, from the next samples.
    void set_reference();
    // Results of a batch whose first sample was taken at stamp_s; period: s, NaN for a single sample of unknown rate. Samples without a
    // reference have no result.
    Estimates estimate(const Volts& volts, double stamp_s, double period);

    // Whether each output has stopped changing.
    std::array<bool, 4> stuck() const;
    const Light& light() const { return light_; }

 private:
    // Samples are missing for some seconds: changes are not followed across the gap, nor contacts across a long one.
    void interrupt(double seconds);
    // States of samples period apart, s.
    Samples detect(const Volts& volts, double period);
    // The contact of the mean of samples begin to end; none where nothing touches.
    std::optional<Touch> touch(const Samples& samples, std::ptrdiff_t begin, std::ptrdiff_t end) const;
    bool is_stuck() const;
    void add(const Eigen::Vector4d& volts, double period, Samples& found);
    Estimate estimate_run(const Samples& samples, std::pair<std::ptrdiff_t, std::ptrdiff_t> run, double stamp_s, double period);

    std::shared_ptr<const FingerModel> model_;
    FingerSettings settings_;
    Light light_;
    std::int64_t id_ = 0;  // of the last contact
    double gap_s_ = 0;     // s of missing samples before the next one
    Eigen::Vector4d last_ = Eigen::Vector4d::Constant(UNKNOWN),
                    same_ = Eigen::Vector4d::Zero();  // outputs, V; samples for which they are so
    CreepCorrection creep_;
    double last_s_ = UNKNOWN, next_s_ = UNKNOWN;  // stamps: of the last batch, of the sample after it
};

}  // namespace tactile::finger
