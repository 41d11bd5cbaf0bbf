// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// From the values of taxels to what loads them: untouched values and noise, dead taxels, hysteresis of the sensing layer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "common/fields.hpp"

namespace tactile::taxel {

// Values (rows, columns) of an array, in row-major order.
struct Sheet {
    std::ptrdiff_t rows = 0, columns = 0;
    std::vector<float> values{};
    std::ptrdiff_t size() const { return static_cast<std::ptrdiff_t>(values.size()); }
};

// Untouched value and noise of each taxel: averaged, tracked as they drift.
class Baseline {
 public:
    // frames: averaged; time_constant: s, of drift after that; start: untouched values, if known; zeroed: a first frame most of whose values
    // are 0 is of a sensor that subtracts its untouched values itself.
    Baseline(double frames, double time_constant, std::optional<Sheet> start, bool zeroed);
    // The next frame is the new baseline, or, with start, the known one if there is one.
    void reset(bool start);
    // A frame minus the baseline. A first frame becomes the baseline if there is none.
    std::vector<float> change(const Sheet& frame, double full_scale);
    // Track with the quiet part of a change, interval s after the last frame; touched: (rows, columns).
    void follow(const std::vector<float>& change, const std::uint8_t* touched, double interval);
    // Standard deviation of a taxel's noise, at least that of rounding; before two frames have shown it, the spread of the last change.
    double sigma() const;
    // The untouched values, of no size before the first frame.
    const Sheet& values() const { return values_; }
    // Whether the first frame may have held a contact.
    bool looks_pressed() const { return looks_pressed_; }

 private:
    std::vector<float> steps(const std::vector<float>& change);
    void update_noise(const std::vector<float>& residuals);

    double frames_, time_constant_;
    std::optional<Sheet> start_;
    bool zeroed_, takes_zeros_ = false, settled_ = false, looks_pressed_ = false;
    Sheet values_{};
    std::vector<float> count_{}, last_{};
    double spread_ = 0;  // of the taxels' last change, while the noise is not known
    double variance_ = 0;
    std::ptrdiff_t noise_count_ = 0, frame_ = 0;
};

// Fills missing values (rows, columns) by the mean of their neighbours, from the rim of a gap inwards; by 0 where all are missing.
void fill(std::vector<float>& values, std::vector<std::uint8_t> missing, std::ptrdiff_t rows, std::ptrdiff_t columns);

// Fills dead taxels, and detects those that are silent between two pressed neighbours along a row or a column.
class DeadTaxels {
 public:
    // known: (rows, columns), dead from the start.
    DeadTaxels(std::vector<std::uint8_t> known, std::ptrdiff_t rows, std::ptrdiff_t columns);
    // A change from the baseline with dead and NaN taxels filled; sigma: its noise.
    std::vector<float> repaired(const std::vector<float>& change, double sigma);
    const std::vector<std::uint8_t>& dead() const { return dead_; }
    std::ptrdiff_t rows() const { return rows_; }
    std::ptrdiff_t columns() const { return columns_; }

 private:
    void detect(const std::vector<float>& change, float loud);

    std::ptrdiff_t rows_, columns_;
    std::vector<std::uint8_t> dead_, silent_, responded_;
};

// How a sensing layer shows a load: see Loop in response.py.
struct LayerLoop {
    double share = 0, reach = 0, relative = 0, relaxation = 1, at_once = 1;
    std::vector<double> late{}, late_s{};
};

// Undoes a loop frame by frame.
class Hysteresis {
 public:
    explicit Hysteresis(LayerLoop loop) : loop_(std::move(loop)) {}
    // Loads are as shown in the next frame.
    void reset() { load_.clear(); }
    // The load, Pa, behind the pressure shown (rows, columns), interval s after the last frame.
    std::vector<float> undone(Sheet shown, double interval);

 private:
    LayerLoop loop_;
    std::vector<float> load_{}, held_{};
    std::vector<std::vector<float>> late_{};
};

// Pressure of a change of value: see Response in response.py.
struct ResponseCurve {
    std::array<double, 3> scale{1, 0, 0};
    double knee = 1;
    std::vector<float> gain{};  // (rows, columns), empty for none

    // The pressure (rows, columns) of changes of the values, in place.
    void apply(std::vector<float>& change) const;
    // Pressure per unit of value at a change of value.
    double slope(double value) const;
};

struct SignalSettings {
    double frames, time_constant;        // of the baseline
    std::optional<Sheet> zero{};         // untouched values, if known
    bool zeroed = false;                 // see Baseline
    std::vector<std::uint8_t> dead{};    // (rows, columns), known ones
    ResponseCurve curve{};
    LayerLoop loop{};
    double noise_gain = 1;  // of undoing the loop
};

// What a frame shows of the load.
struct Load {
    std::vector<float> change;        // (rows, columns) of the values, from the baseline
    std::vector<float> pressure;      // (rows, columns) Pa, if the response is known
    double noise;                     // standard deviation of the pressure
    std::vector<std::uint8_t> full;   // (rows, columns), saturated taxels
    double stamp, interval;           // s, of the frame, and since the one before; 0 for the first one
    std::ptrdiff_t columns;
    TACTILE_FIELDS(pressure, noise, full)
};

// From values to pressure, frame by frame.
class Signal {
 public:
    Signal(SignalSettings settings, std::ptrdiff_t rows, std::ptrdiff_t columns);
    // The next frame is the untouched reference.
    void set_reference();
    // The load in a frame at stamp, s; full_scale: of a taxel, infinite if it is not known.
    Load load(const Sheet& frame, double full_scale, double stamp);
    // Track the baseline with the quiet part of the last load; touched: (rows, columns).
    void follow(const Load& load, const std::uint8_t* touched) { baseline.follow(load.change, touched, load.interval); }

    Baseline baseline;
    DeadTaxels dead;

 private:
    ResponseCurve curve_;
    Hysteresis hysteresis_;
    double noise_gain_, stamp_ = -std::numeric_limits<double>::infinity();
};

}  // namespace tactile::taxel
