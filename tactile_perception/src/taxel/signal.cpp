// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/signal.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/grid.hpp"
#include "common/median.hpp"
#include "taxel/constants.hpp"

namespace tactile::taxel {
namespace {

// Range of a frame after a median of 3 x 3, borders repeated; NaN counts as 0.
double smooth_range(const Sheet& frame) {
    float low = std::numeric_limits<float>::max(), high = -low;
    float around[9];
    for (std::ptrdiff_t r = 0; r < frame.rows; ++r) {
        for (std::ptrdiff_t c = 0; c < frame.columns; ++c) {
            float* next = around;
            for (std::ptrdiff_t y = r - 1; y <= r + 1; ++y)
                for (std::ptrdiff_t x = c - 1; x <= c + 1; ++x) {
                    const float value = frame.values[std::clamp<std::ptrdiff_t>(y, 0, frame.rows - 1) * frame.columns +
                                                     std::clamp<std::ptrdiff_t>(x, 0, frame.columns - 1)];
                    *next++ = std::isfinite(value) ? value : 0;
                }
            std::nth_element(around, around + 4, around + 9);
            low = std::min(low, around[4]), high = std::max(high, around[4]);
        }
    }
    return static_cast<double>(high) - low;
}

// Finite values minus their median.
std::vector<float> about_median(std::vector<float> values) {
    values.erase(std::remove_if(values.begin(), values.end(), [](float value) { return !std::isfinite(value); }), values.end());
    if (values.empty()) return values;
    const auto middle = static_cast<float>(median({values.begin(), values.end()}));
    for (float& value : values) value -= middle;
    return values;
}

// Standard deviation of residuals, by the median of the sizes of up to noise_sample of them; 0 of none.
double deviation(const std::vector<float>& residuals) {
    if (residuals.empty()) return 0;
    std::vector<float> sizes;
    for (std::size_t k = 0; k < residuals.size(); k += 1 + residuals.size() / TAXEL.noise_sample) sizes.push_back(std::abs(residuals[k]));
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return SIGMA_PER_MAD * *middle;
}

}  // namespace

Baseline::Baseline(double frames, double time_constant, std::optional<Sheet> start, bool zeroed)
    : frames_(frames), time_constant_(time_constant), start_(std::move(start)), zeroed_(zeroed) {
    reset(true);
}

void Baseline::reset(bool start) {
    values_ = start && start_ ? *start_ : Sheet{};
    count_.assign(values_.values.size(), 1);
    takes_zeros_ = zeroed_ && start;
    last_.clear();
    variance_ = 0;
    noise_count_ = frame_ = 0;
    settled_ = looks_pressed_ = false;
}

std::vector<float> Baseline::change(const Sheet& frame, double full_scale) {
    if (!values_.size()) {
        values_ = frame;
        count_.assign(frame.values.size(), 1);
        if (takes_zeros_ && 2 * std::count(frame.values.begin(), frame.values.end(), 0.0f) > frame.size())
            std::fill(values_.values.begin(), values_.values.end(), 0.0f);
        else
            looks_pressed_ = smooth_range(frame) > TAXEL.max_offset_range * full_scale;
    }
    std::vector<float> change(frame.values.size());
    for (std::size_t k = 0; k < change.size(); ++k) {
        if (std::isnan(values_.values[k])) values_.values[k] = frame.values[k];
        change[k] = frame.values[k] - values_.values[k];
    }
    if (!noise_count_) spread_ = deviation(about_median(change));
    return change;
}

void Baseline::follow(const std::vector<float>& change, const std::uint8_t* touched, double interval) {
    const auto busy = spread_mask(touched, values_.rows, values_.columns, TAXEL.quiet_margin);
    const bool looks = noise_count_ < TAXEL.noise_frames || frame_ % TAXEL.noise_interval == 0;
    const auto drift = static_cast<float>(std::min(interval / time_constant_, 1 / frames_));
    std::vector<float> settled;
    for (std::ptrdiff_t k = 0; k < values_.size(); ++k) {
        if (busy[k] || !std::isfinite(change[k])) continue;
        count_[k] += 1;
        values_.values[k] += change[k] * (count_[k] <= frames_ ? 1 / count_[k] : drift);
        if (looks && count_[k] > TAXEL.min_quiet_frames) settled.push_back(change[k]);
    }
    if (looks) {
        settled_ = settled_ || !settled.empty();
        update_noise(settled_ ? std::move(settled) : steps(change));
    }
    ++frame_;
}

// Noise from the difference of two frames, without its median. Used at the start, where strong noise looks like contact everywhere and no
// taxel is quiet.
std::vector<float> Baseline::steps(const std::vector<float>& change) {
    const std::vector<float> last = std::exchange(last_, change);
    std::vector<float> steps(last.size());
    for (std::size_t k = 0; k < last.size(); ++k) steps[k] = (change[k] - last[k]) * static_cast<float>(std::sqrt(0.5));
    return about_median(std::move(steps));
}

// Averages the noise with that of residuals.
void Baseline::update_noise(const std::vector<float>& residuals) {
    if (residuals.empty()) return;
    const double sigma = deviation(residuals), keep = static_cast<double>(noise_count_);
    variance_ = (variance_ * keep + sigma * sigma) / (keep + 1);
    noise_count_ = std::min(noise_count_ + 1, TAXEL.noise_frames);
}

double Baseline::sigma() const {
    return std::max(TAXEL.rounding_sigma, noise_count_ ? std::sqrt(variance_) : spread_);
}

void fill(std::vector<float>& values, std::vector<std::uint8_t> missing, std::ptrdiff_t rows, std::ptrdiff_t columns) {
    std::vector<std::ptrdiff_t> gaps;
    for (std::ptrdiff_t k = 0; k < rows * columns; ++k)
        if (missing[k]) gaps.push_back(k), values[k] = 0;
    while (!gaps.empty()) {
        std::vector<std::ptrdiff_t> left;
        std::vector<std::pair<std::ptrdiff_t, float>> found;
        for (const std::ptrdiff_t k : gaps) {
            float total = 0, count = 0;
            for (std::ptrdiff_t y = std::max<std::ptrdiff_t>(k / columns - 1, 0); y <= std::min(k / columns + 1, rows - 1); ++y)
                for (std::ptrdiff_t x = std::max<std::ptrdiff_t>(k % columns - 1, 0); x <= std::min(k % columns + 1, columns - 1); ++x)
                    if (!missing[y * columns + x]) total += values[y * columns + x], ++count;
            if (count > 0)
                found.emplace_back(k, total / count);
            else
                left.push_back(k);
        }
        if (found.empty()) return;
        for (const auto& [k, value] : found) values[k] = value, missing[k] = 0;
        gaps = std::move(left);
    }
}

DeadTaxels::DeadTaxels(std::vector<std::uint8_t> known, std::ptrdiff_t rows, std::ptrdiff_t columns)
    : rows_(rows), columns_(columns), dead_(std::move(known)), silent_(rows * columns), responded_(rows * columns) {}

std::vector<float> DeadTaxels::repaired(const std::vector<float>& change, double sigma) {
    const auto loud = static_cast<float>(TAXEL.pressed_sigmas * sigma);
    bool any = false;
    for (std::size_t k = 0; k < dead_.size(); ++k)
        if (change[k] > loud) any = responded_[k] = 1;
    if (any) detect(change, loud);
    std::vector<float> values = change;
    std::vector<std::uint8_t> missing = dead_;
    for (std::size_t k = 0; k < missing.size(); ++k) missing[k] |= std::isnan(change[k]);
    fill(values, std::move(missing), rows_, columns_);
    return values;
}

// Counts the frames in which a taxel that never responded is silent.
void DeadTaxels::detect(const std::vector<float>& change, float loud) {
    const auto pressed = [&](std::ptrdiff_t k) { return change[k] > loud ? change[k] : 0.0f; };
    for (std::ptrdiff_t r = 0; r < rows_; ++r) {
        for (std::ptrdiff_t c = 0; c < columns_; ++c) {
            const std::ptrdiff_t k = r * columns_ + c;
            if (responded_[k]) continue;
            float between = 0;
            if (r > 0 && r + 1 < rows_) between = std::min(pressed(k - columns_), pressed(k + columns_));
            if (c > 0 && c + 1 < columns_) between = std::max(between, std::min(pressed(k - 1), pressed(k + 1)));
            if (between > 0 && change[k] < TAXEL.silent_share * between && silent_[k] < TAXEL.silent_frames) ++silent_[k];
            if (silent_[k] >= TAXEL.silent_frames) dead_[k] = 1;
        }
    }
}

std::vector<float> Hysteresis::undone(Sheet shown, double interval) {
    if (loop_.share == 0 && loop_.late.empty()) return std::move(shown.values);
    if (load_.size() != shown.values.size()) {
        load_ = held_ = shown.values;
        late_.assign(loop_.late.size(), shown.values);
    }
    const auto gone = [&](double time) { return static_cast<float>(-std::expm1(-interval / time)); };
    const float at_once = static_cast<float>(loop_.at_once), crept = gone(loop_.relaxation);
    const float share = static_cast<float>(loop_.share), reach = static_cast<float>(loop_.reach),
                relative = static_cast<float>(loop_.relative);
    std::vector<float> early = std::move(shown.values), hidden(early.size());
    for (std::size_t part = 0; part < late_.size(); ++part) {
        const float followed = gone(loop_.late_s[part]), weight = static_cast<float>(loop_.late[part]);
        for (std::size_t k = 0; k < early.size(); ++k) {
            late_[part][k] += (load_[k] - late_[part][k]) * followed;
            early[k] -= late_[part][k] * weight;
        }
    }
    for (std::size_t k = 0; k < early.size(); ++k) {
        const float seen = early[k] /= at_once, held = held_[k] + (load_[k] - held_[k]) * crept;
        // The load of which a layer with that held load shows this: where the held load stays, or follows from below or above.
        const float up = seen + share * reach, down = seen - share * reach;
        const float rising = std::max(up, up / (1 - share * relative)), falling = std::min(down, down / (1 + share * relative));
        const float load = std::min(std::max((seen - share * held) / (1 - share), falling), rising);
        const float most = reach + relative * std::max(load, 0.0f);
        held_[k] = std::min(std::max(held, load - most), load + most);
        hidden[k] = load - seen;
    }
    // Neighbours show together what is hidden, so that it adds little noise.
    blur(hidden, shown.rows, shown.columns, TAXEL.hidden_width, Outside::replicated);
    for (std::size_t k = 0; k < early.size(); ++k) load_[k] = early[k] + hidden[k];
    return load_;
}

void ResponseCurve::apply(std::vector<float>& change) const {
    const auto first = static_cast<float>(scale[0]), second = static_cast<float>(scale[1]), third = static_cast<float>(scale[2]);
    const auto bend = static_cast<float>(knee);
    const bool is_straight = second == 0 && third == 0;
    for (std::size_t k = 0; k < change.size(); ++k) {
        const float value = gain.empty() ? change[k] : change[k] / gain[k], size = std::abs(value);
        change[k] = is_straight ? first * value : value * (first + second * size + third * bend / (size + bend));
    }
}

double ResponseCurve::slope(double value) const {
    const double size = std::abs(value);
    return scale[0] + 2 * scale[1] * size + scale[2] * std::pow(knee / (size + knee), 2);
}

Signal::Signal(SignalSettings settings, std::ptrdiff_t rows, std::ptrdiff_t columns)
    : baseline(settings.frames, settings.time_constant, std::move(settings.zero), settings.zeroed),
      dead(std::move(settings.dead), rows, columns),
      curve_(std::move(settings.curve)),
      hysteresis_(std::move(settings.loop)),
      noise_gain_(settings.noise_gain) {}

void Signal::set_reference() {
    baseline.reset(false);
    hysteresis_.reset();
}

Load Signal::load(const Sheet& frame, double full_scale, double stamp) {
    Load found{baseline.change(frame, full_scale), {}, 0, std::vector<std::uint8_t>(frame.values.size()), stamp, 0, frame.columns};
    found.interval = std::isfinite(stamp_) ? stamp - stamp_ : 0;
    stamp_ = stamp;
    const double sigma = baseline.sigma();
    found.pressure = dead.repaired(found.change, sigma);
    curve_.apply(found.pressure);
    found.pressure = hysteresis_.undone({frame.rows, frame.columns, std::move(found.pressure)}, found.interval);
    found.noise = sigma * curve_.slope(TAXEL.slope_sigmas * sigma) * noise_gain_;
    const auto full = static_cast<float>(TAXEL.saturation * full_scale);
    for (std::size_t k = 0; k < found.full.size(); ++k) found.full[k] = frame.values[k] >= full;
    return found;
}

}  // namespace tactile::taxel
