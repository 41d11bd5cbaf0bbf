// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Compression of patches. The basis consists of functions that are even or odd along each axis, so that a patch is first folded to the sums
// and differences of mirrored pixels, a quarter of a patch for each of the four parities.
#include "disc_patch.hpp"

#include <algorithm>
#include <cmath>

namespace tactile {

DiscPatch::DiscPatch(const DiscModel& model)
    : model_(model),
      half_(model.half),
      side_(2 * model.half + 1),
      quarter_(model.half + 1),
      sector_(padded(quarter_ * quarter_)),
      values_(side_ * side_),
      across_(2 * side_ * quarter_),
      folded_(SECTORS * sector_) {}

void DiscPatch::cut(const Image& image, std::ptrdiff_t column, std::ptrdiff_t row, float level) {
    const bool inside = column >= half_ && column + half_ < image.columns;
    float* out = values_.data();
    for (std::ptrdiff_t r = row - half_; r <= row + half_; ++r, out += side_) {
        const std::uint8_t* pixels = image.pixels + std::clamp<std::ptrdiff_t>(r, 0, image.rows - 1) * image.columns;
        const std::uint8_t* left = pixels + column - half_;
        if (inside) {
            for (std::ptrdiff_t c = 0; c < side_; ++c) out[c] = static_cast<float>(left[c]) - level;
        } else {
            for (std::ptrdiff_t c = 0; c < side_; ++c) {
                out[c] = static_cast<float>(pixels[std::clamp<std::ptrdiff_t>(column - half_ + c, 0, image.columns - 1)]) - level;
            }
        }
    }
}

void DiscPatch::subtract(double u, double v, double diameter, double amplitude) {
    const double per_diameter = static_cast<double>(model_.profiles - 1) / (model_.largest - model_.smallest);
    const double at = std::clamp((diameter - model_.smallest) * per_diameter + 0.5, 0.0, static_cast<double>(model_.profiles - 1));
    const float* profile = model_.profile + static_cast<std::ptrdiff_t>(at) * model_.profile_length;
    const double reach = std::sqrt(static_cast<double>(model_.profile_length - 1) / model_.per_square), middle = static_cast<double>(half_);
    const auto first = [&](double place) { return static_cast<std::ptrdiff_t>(std::clamp(place + middle - reach, 0.0, 2 * middle + 1)); };
    const auto last = [&](double place) {
        return static_cast<std::ptrdiff_t>(std::clamp(place + middle + reach + 1, 0.0, 2 * middle + 1));
    };
    const auto strength = static_cast<float>(amplitude), density = static_cast<float>(model_.per_square);
    const std::ptrdiff_t left = first(u), right = last(u), bottom = last(v), outermost = model_.profile_length - 1;
    const auto u0 = static_cast<float>(u + middle), v0 = static_cast<float>(v + middle);
    for (std::ptrdiff_t r = first(v); r < bottom; ++r) {
        const float down = static_cast<float>(r) - v0, square = down * down * density + 0.5f;
        float* row = values_.data() + r * side_;
        for (std::ptrdiff_t c = left; c < right; ++c) {
            const float across = static_cast<float>(c) - u0;
            row[c] -= strength * profile[std::min(static_cast<std::ptrdiff_t>(across * across * density + square), outermost)];
        }
    }
}

// Sums and differences of pixels mirrored along u, then along v. The middle column and row are added to themselves; the basis halves them.
void DiscPatch::fold() {
    float *even = across_.data(), *odd = even + side_ * quarter_;
    for (std::ptrdiff_t r = 0; r < side_; ++r) {
        const float* middle = values_.data() + r * side_ + half_;
        for (std::ptrdiff_t c = 0; c < quarter_; ++c) {
            even[r * quarter_ + c] = middle[c] + middle[-c];
            odd[r * quarter_ + c] = middle[c] - middle[-c];
        }
    }
    for (std::ptrdiff_t r = 0; r < quarter_; ++r) {
        const std::ptrdiff_t up = (half_ - r) * quarter_, down = (half_ + r) * quarter_;
        float* out = folded_.data() + r * quarter_;
        for (std::ptrdiff_t c = 0; c < quarter_; ++c) {
            out[c] = even[down + c] + even[up + c];
            out[sector_ + c] = odd[down + c] + odd[up + c];
            out[2 * sector_ + c] = even[down + c] - even[up + c];
            out[3 * sector_ + c] = odd[down + c] - odd[up + c];
        }
    }
}

void DiscPatch::compress(float* out) {
    fold();
    std::ptrdiff_t at = 0;
    for (std::ptrdiff_t s = 0; s < SECTORS; ++s) {
        const float* folded = folded_.data() + s * sector_;
        for (const std::ptrdiff_t end = at + SECTOR_SIZES[s]; at < end; ++at)
            out[at] = product(folded, model_.basis + at * sector_, sector_);
    }
}

}  // namespace tactile
