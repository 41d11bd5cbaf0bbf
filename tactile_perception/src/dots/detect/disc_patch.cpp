// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Compression of patches, in whole numbers, which are faster than fractions. The basis consists of functions that are even or odd along
// each axis, so that a patch is first folded to the sums and differences of mirrored pixels, a quarter of a patch for each of the four
// parities.
#include "dots/detect/disc_patch.hpp"

#include <algorithm>
#include <cmath>

#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr int UNITS = 4;    // per grey level: their rounding adds 0.07 grey levels of noise. Chosen
constexpr int MOST = 1023;  // units. Derived: no pixel differs by more from a level; folded four times it still is a 16-bit number

// Sum of the products of two rows. It stays within 32 bits: a row of the basis has a norm of 1, a folded one of 1/2.
std::int32_t product(const std::int16_t* a, const std::int16_t* b, std::ptrdiff_t count) {
    std::int32_t sum = 0;
    for (std::ptrdiff_t k = 0; k < count; ++k) sum += a[k] * b[k];
    return sum;
}

}  // namespace

DiscPatch::DiscPatch(const DiscModel& model)
    : model_(model),
      half_(model.half),
      side_(2 * model.half + 1),
      quarter_(model.half + 1),
      sector_(padded(quarter_ * quarter_)),
      values_(side_ * side_),
      down_(2 * side_ * quarter_),
      folded_(SECTORS * sector_) {}

TACTILE_WIDE void DiscPatch::cut(const Image& image, std::ptrdiff_t column, std::ptrdiff_t row, int level) {
    const bool inside = column >= half_ && column + half_ < image.columns;
    std::int16_t* out = values_.data();
    for (std::ptrdiff_t r = row - half_; r <= row + half_; ++r, out += side_) {
        const std::uint8_t* pixels = image.pixels + std::clamp<std::ptrdiff_t>(r, 0, image.rows - 1) * image.columns;
        if (inside) {
            const std::uint8_t* left = pixels + column - half_;
            for (std::ptrdiff_t c = 0; c < side_; ++c) out[c] = static_cast<std::int16_t>(UNITS * (left[c] - level));
        } else {
            for (std::ptrdiff_t c = 0; c < side_; ++c) {
                const std::uint8_t pixel = pixels[std::clamp<std::ptrdiff_t>(column - half_ + c, 0, image.columns - 1)];
                out[c] = static_cast<std::int16_t>(UNITS * (pixel - level));
            }
        }
    }
}

TACTILE_WIDE void DiscPatch::subtract(double u, double v, double diameter, double amplitude) {
    const double per_diameter = static_cast<double>(model_.profiles - 1) / (model_.largest - model_.smallest);
    const double at = std::clamp((diameter - model_.smallest) * per_diameter + 0.5, 0.0, static_cast<double>(model_.profiles - 1));
    const float* profile = model_.profile + static_cast<std::ptrdiff_t>(at) * model_.profile_length;
    const double reach = std::sqrt(static_cast<double>(model_.profile_length - 1) / model_.per_square), middle = static_cast<double>(half_);
    const auto first = [&](double place) { return static_cast<std::ptrdiff_t>(std::clamp(place + middle - reach, 0.0, 2 * middle + 1)); };
    const auto last = [&](double place) {
        return static_cast<std::ptrdiff_t>(std::clamp(place + middle + reach + 1, 0.0, 2 * middle + 1));
    };
    const auto strength = static_cast<float>(UNITS * amplitude), density = static_cast<float>(model_.per_square);
    const auto most = static_cast<float>(MOST);
    const std::ptrdiff_t left = first(u), right = last(u), bottom = last(v), outermost = model_.profile_length - 1;
    const auto u0 = static_cast<float>(u + middle), v0 = static_cast<float>(v + middle);
    for (std::ptrdiff_t r = first(v); r < bottom; ++r) {
        const float down = static_cast<float>(r) - v0, square = down * down * density + 0.5f;
        std::int16_t* row = values_.data() + r * side_;
        for (std::ptrdiff_t c = left; c < right; ++c) {
            const float across = static_cast<float>(c) - u0;
            const float part = strength * profile[std::min(static_cast<std::ptrdiff_t>(across * across * density + square), outermost)];
            const float rest = std::clamp(static_cast<float>(row[c]) - part, -most, most);
            row[c] = static_cast<std::int16_t>(static_cast<std::int32_t>(rest + most + 0.5f) - MOST);  // to the nearest
        }
    }
}

// Sums and differences of pixels mirrored along v, then along u. The middle row and column are added to themselves; the basis halves them.
TACTILE_WIDE void DiscPatch::fold() {
    std::int16_t *even = down_.data(), *odd = even + side_ * quarter_;
    for (std::ptrdiff_t r = 0; r < quarter_; ++r) {
        const std::int16_t *above = values_.data() + (half_ - r) * side_, *below = values_.data() + (half_ + r) * side_;
        for (std::ptrdiff_t c = 0; c < side_; ++c) {
            even[r * side_ + c] = static_cast<std::int16_t>(below[c] + above[c]);
            odd[r * side_ + c] = static_cast<std::int16_t>(below[c] - above[c]);
        }
    }
    for (std::ptrdiff_t r = 0; r < quarter_; ++r) {
        const std::int16_t *even_middle = even + r * side_ + half_, *odd_middle = odd + r * side_ + half_;
        std::int16_t* out = folded_.data() + r * quarter_;
        for (std::ptrdiff_t c = 0; c < quarter_; ++c) {
            out[c] = static_cast<std::int16_t>(even_middle[c] + even_middle[-c]);
            out[sector_ + c] = static_cast<std::int16_t>(even_middle[c] - even_middle[-c]);
            out[2 * sector_ + c] = static_cast<std::int16_t>(odd_middle[c] + odd_middle[-c]);
            out[3 * sector_ + c] = static_cast<std::int16_t>(odd_middle[c] - odd_middle[-c]);
        }
    }
}

TACTILE_WIDE void DiscPatch::compress(float* out) {
    fold();
    const float scale = 1.0f / (UNITS * BASIS_UNITS);
    std::ptrdiff_t at = 0;
    for (std::ptrdiff_t s = 0; s < SECTORS; ++s) {
        const std::int16_t* folded = folded_.data() + s * sector_;
        for (const std::ptrdiff_t end = at + SECTOR_SIZES[s]; at < end; ++at) {
            out[at] = scale * static_cast<float>(product(folded, model_.basis + at * sector_, sector_));
        }
    }
}

}  // namespace tactile
