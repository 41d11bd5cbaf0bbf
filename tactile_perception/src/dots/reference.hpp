// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Untouched positions of numbered dots: averaged over the first frames, followed as they drift, held during contact.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace tactile {

// Dots of a frame: distinct ids, finite positions uv, px, and their standard deviations per axis, px.
struct SeenDots {
    std::vector<std::int64_t> id;
    std::vector<double> uv, sigma;
    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(id.size()); }
};

class Reference {
 public:
    // time_constant_s: of drift; frames: untouched frames that are averaged first.
    Reference(double time_constant_s, std::int64_t frames);
    // Drops all positions.
    void reset();
    // Replaces the positions by uv (count, 2), px, of dots id, and forgets earlier contacts; frames: that each position counts as.
    void begin(const std::int64_t* id, const double* uv, const std::int64_t* frames, std::ptrdiff_t count);
    // Displacements (count, 2), px; NaN without a reference position. touched: as known by a later stage, else decided by the dots. Dots
    // that are new get a position where nothing touches.
    std::vector<double> update(const SeenDots& dots, double stamp_s, std::optional<bool> touched);
    // Untouched positions (count, 2), px; NaN where unknown.
    std::vector<double> places(const std::int64_t* id, std::ptrdiff_t count) const;

    const std::vector<std::int64_t>& id() const { return id_; }  // rising
    const std::vector<double>& uv() const { return uv_; }
    bool touched() const { return touched_; }
    bool grown() const { return grown_; }  // whether the last frame added dots

 private:
    void insert(const std::int64_t* id, const double* uv, const std::int64_t* frames, std::ptrdiff_t count);
    void follow(const SeenDots& dots, double stamp_s);
    bool is_touched(const SeenDots& dots, const std::vector<double>& moved, double stamp_s);
    void forget_contact();

    double time_constant_s_;
    std::int64_t frames_, calibrated_ = 0;  // calibrated_: frames that calibrated positions count as
    std::vector<std::int64_t> id_, counts_;
    std::vector<double> uv_;
    double stamp_s_;  // of the last frame, NaN before it
    bool touched_, grown_ = false;
    double largest_, accepted_, since_s_;  // px, of the contact and of its accepted residue; s, since when it is still
    SeenDots still_;                       // where it came to rest
};

}  // namespace tactile
