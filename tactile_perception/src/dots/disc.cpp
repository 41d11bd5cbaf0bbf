// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/disc.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/lanes.hpp"

namespace tactile {
namespace {

// Compression of patches, in whole numbers, which are faster than fractions. The basis consists of functions that are even or odd along
// each axis, so that a patch is first folded to the sums and differences of mirrored pixels, a quarter of a patch for each of the four
// parities.

constexpr std::int16_t UNITS = 4;  // per grey level: their rounding adds 0.07 grey levels of noise. Chosen
constexpr int MOST = 1023;         // units. Derived: no pixel differs by more from a level; folded four times it still is a 16-bit number

constexpr std::ptrdiff_t ROWS = 4;  // of the basis that a loop handles at once; all sectors have a multiple of them

// Sums of the products of a folded patch with ROWS rows of the basis, one after the other. They stay within 32 bits: a row of the basis has
// a norm of 1, a folded one of 1/2.
TACTILE_INLINE std::array<std::int32_t, ROWS> products(const std::int16_t* folded, const std::int16_t* basis, std::ptrdiff_t count) {
    const std::int16_t *b = basis + count, *c = b + count, *d = c + count;
    std::int32_t sums[ROWS] = {};
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        sums[0] += folded[k] * basis[k];
        sums[1] += folded[k] * b[k];
        sums[2] += folded[k] * c[k];
        sums[3] += folded[k] * d[k];
    }
    return {sums[0], sums[1], sums[2], sums[3]};
}

// A row of pixels as they are in an image, from the middle one of a patch on, minus a grey level.
struct SeenRow {
    const std::uint8_t* middle;
    std::int16_t level;
    template <std::ptrdiff_t COUNT>
    TACTILE_INLINE Shorts<COUNT> right(std::ptrdiff_t c) const {
        return UNITS * (Shorts<COUNT>::of_pixels(middle + c) - level);
    }
    template <std::ptrdiff_t COUNT>
    TACTILE_INLINE Shorts<COUNT> left(std::ptrdiff_t c) const {
        return UNITS * (Shorts<COUNT>::of_pixels_back(middle - c) - level);
    }
};

// A row of a patch that was cut out.
struct CutRow {
    const std::int16_t *values, *mirrored;
    template <std::ptrdiff_t COUNT>
    TACTILE_INLINE Shorts<COUNT> right(std::ptrdiff_t c) const {
        return Shorts<COUNT>(values + c);
    }
    template <std::ptrdiff_t COUNT>
    TACTILE_INLINE Shorts<COUNT> left(std::ptrdiff_t c) const {
        return Shorts<COUNT>(mirrored + c);
    }
};

// Row r of a patch around a row of the image; of rows outside of the image, the outermost one.
TACTILE_INLINE const std::uint8_t* row_of(const Image& image, std::ptrdiff_t r) {
    return image.pixels + std::clamp<std::ptrdiff_t>(r, 0, image.rows - 1) * image.columns;
}

// Maximum-likelihood fit of one blurred disc to a compressed patch. At each node of the model, the weighted least-squares estimate of the
// differences from the node is a matrix applied to the patch.

constexpr double LONGEST = 0.7, LONGEST_DIAMETER = 1.5;  // px, longest step of a position and of the diameter. Chosen
constexpr double NOTHING = 1e-12;                        // grey levels, prevents division by zero

// The whole number nearest to a coordinate, from least to most; least for NaN.
int nearest(double place, int least, int most) {
    if (!(place > least)) return least;
    return place < most ? least + static_cast<int>(place - least + 0.5) : most;
}

// A patch mirrored into the quadrant where across and down are positive, and the node's tables there.
class Quadrant {
 public:
    Quadrant(const float* patch, const DiscNode& node, const DiscModel& model)
        : along_u(node.across < 0 ? -1 : 1), along_v(node.down < 0 ? -1 : 1) {
        const float signs[SECTORS] = {1, along_u, along_v, along_u * along_v};
        std::ptrdiff_t at = 0;
        for (std::ptrdiff_t s = 0; s < SECTORS; ++s) {
            for (const std::ptrdiff_t end = at + SECTOR_SIZES[s]; at < end; ++at) values[at] = signs[s] * patch[at];
        }
        index = (node.size * model.phases + std::abs(node.down)) * model.phases + std::abs(node.across);
    }
    // Product of the patch with a row of a table.
    double times(const float* row) const { return product(values, row, DIMENSIONS); }
    float values[DIMENSIONS];
    const float along_u, along_v;
    std::ptrdiff_t index;  // of the node
};

}  // namespace

DiscPatch::DiscPatch(const DiscModel& model)
    : model_(model),
      half_(model.half),
      quarter_(model.half + 1),
      width_(padded(quarter_)),
      sector_(padded(quarter_ * quarter_)),
      values_((2 * half_ + 1) * 2 * width_),
      folded_(SECTORS * (sector_ + width_)) {}

TACTILE_WIDE void DiscPatch::cut(const Image& image, std::ptrdiff_t column, std::ptrdiff_t row, int level) {
    for (std::ptrdiff_t r = 0; r <= 2 * half_; ++r) {
        const std::uint8_t* pixels = row_of(image, row - half_ + r);
        std::int16_t *right = right_of(r), *left = left_of(r);
        if (is_inside(image, column)) {
            const SeenRow seen{pixels + column, static_cast<std::int16_t>(level)};
            for (std::ptrdiff_t c = 0; c < width_; c += EIGHT) {
                seen.right<EIGHT>(c).store(right + c);
                seen.left<EIGHT>(c).store(left + c);
            }
        } else {
            const auto at = [&](std::ptrdiff_t c) { return pixels[std::clamp<std::ptrdiff_t>(c, 0, image.columns - 1)]; };
            for (std::ptrdiff_t c = 0; c < width_; ++c) {
                right[c] = static_cast<std::int16_t>(UNITS * (at(column + c) - level));
                left[c] = static_cast<std::int16_t>(UNITS * (at(column - c) - level));
            }
        }
    }
}

TACTILE_WIDE void DiscPatch::subtract(double u, double v, double diameter, double amplitude) {
    const double per_diameter = static_cast<double>(model_.profiles - 1) / (model_.largest - model_.smallest);
    const double at = std::clamp((diameter - model_.smallest) * per_diameter + 0.5, 0.0, static_cast<double>(model_.profiles - 1));
    const float* profile = model_.profile.data() + static_cast<std::ptrdiff_t>(at) * model_.profile_length;
    const double reach = std::sqrt(static_cast<double>(model_.profile_length - 1) / model_.per_square),
                 most_away = static_cast<double>(half_);
    const auto first = [&](double place) { return static_cast<std::ptrdiff_t>(std::clamp(place - reach, 0.0, most_away + 1)); };
    const auto last = [&](double place) { return static_cast<std::ptrdiff_t>(std::clamp(place + reach + 1, 0.0, most_away + 1)); };
    const auto strength = static_cast<float>(UNITS * amplitude), density = static_cast<float>(model_.per_square);
    const auto most = static_cast<float>(MOST);
    const std::ptrdiff_t outermost = model_.profile_length - 1;
    // From a part of a row, from the middle on, on the side where the disc is at this distance, which is negative on the other one.
    const auto subtract_from = [&](std::int16_t* part, double away, float square) {
        const auto middle = static_cast<float>(away);
        const std::ptrdiff_t end = last(away);
        for (std::ptrdiff_t c = first(away); c < end; ++c) {
            const float across = static_cast<float>(c) - middle;
            const float image = strength * profile[std::min(static_cast<std::ptrdiff_t>(across * across * density + square), outermost)];
            const float rest = std::clamp(static_cast<float>(part[c]) - image, -most, most);
            part[c] = static_cast<std::int16_t>(static_cast<std::int32_t>(rest + most + 0.5f) - MOST);  // to the nearest
        }
    };
    for (std::ptrdiff_t r = 0; r <= 2 * half_; ++r) {
        const auto down = static_cast<float>(static_cast<double>(r - half_) - v);
        if (!(std::abs(down) < reach + 1)) continue;
        const float square = down * down * density + 0.5f;
        subtract_from(right_of(r), u, square);
        subtract_from(left_of(r), -u, square);
    }
}

// Sums and differences of pixels mirrored along v and along u. The middle row and column are added to themselves; the basis halves them.
// What follows a row in the padding is overwritten by the next row, or multiplied by zeros of the basis.
template <std::ptrdiff_t COUNT, class Row>
TACTILE_INLINE void DiscPatch::fold_part(const Row& up, const Row& down, std::ptrdiff_t c, std::int16_t* out) const {
    const std::ptrdiff_t next = sector_ + width_;  // sector
    const Shorts<COUNT> above = up.template right<COUNT>(c), below = down.template right<COUNT>(c);
    const Shorts<COUNT> above_left = up.template left<COUNT>(c), below_left = down.template left<COUNT>(c);
    const Shorts<COUNT> even = below + above, odd = below - above, even_left = below_left + above_left, odd_left = below_left - above_left;
    (even + even_left).store(out + c);
    (even - even_left).store(out + next + c);
    (odd + odd_left).store(out + 2 * next + c);
    (odd - odd_left).store(out + 3 * next + c);
}

template <class Row>
TACTILE_INLINE void DiscPatch::fold(const Row& up, const Row& down, std::ptrdiff_t r) {
    std::int16_t* out = folded_.data() + r * quarter_;
    std::ptrdiff_t c = 0;
    for (; c + SIXTEEN <= width_; c += SIXTEEN) fold_part<SIXTEEN>(up, down, c, out);
    if (c < width_) fold_part<EIGHT>(up, down, c, out);
}

TACTILE_INLINE void DiscPatch::project(float* out) const {
    const float scale = 1.0f / (UNITS * BASIS_UNITS);
    std::ptrdiff_t at = 0;
    for (std::ptrdiff_t s = 0; s < SECTORS; ++s) {
        const std::int16_t* folded = folded_.data() + s * (sector_ + width_);
        for (const std::ptrdiff_t end = at + SECTOR_SIZES[s]; at < end; at += ROWS) {
            const auto sums = products(folded, model_.basis.data() + at * sector_, sector_);
            for (std::ptrdiff_t k = 0; k < ROWS; ++k) out[at + k] = scale * static_cast<float>(sums[k]);
        }
    }
}

TACTILE_WIDE void DiscPatch::compress(float* out) {
    for (std::ptrdiff_t r = 0; r < quarter_; ++r) {
        fold(CutRow{right_of(half_ - r), left_of(half_ - r)}, CutRow{right_of(half_ + r), left_of(half_ + r)}, r);
    }
    project(out);
}

TACTILE_WIDE void DiscPatch::compress(const Image& image, std::ptrdiff_t column, std::ptrdiff_t row, int level, float* out) {
    if (!is_inside(image, column)) {
        cut(image, column, row, level);
        return compress(out);
    }
    const auto zero = static_cast<std::int16_t>(level);
    for (std::ptrdiff_t r = 0; r < quarter_; ++r) {
        fold(SeenRow{row_of(image, row - r) + column, zero}, SeenRow{row_of(image, row + r) + column, zero}, r);
    }
    project(out);
}

DiscNode nearest_node(const Disc& disc, const DiscModel& model) {
    const auto farthest = static_cast<int>(model.phases - 1), last = static_cast<int>(model.diameters - 1);
    const double per_diameter = last / (model.largest - model.smallest);
    return {nearest((disc.diameter - model.smallest) * per_diameter, 0, last), nearest(disc.v * farthest, -farthest, farthest),
            nearest(disc.u * farthest, -farthest, farthest)};
}

TACTILE_WIDE Disc estimate(const float* patch, const DiscNode& node, const DiscModel& model) {
    const Quadrant quadrant(patch, node, model);
    const float* rows = model.estimators.data() + quadrant.index * ESTIMATES * DIMENSIONS;
    double answer[ESTIMATES];
    for (std::ptrdiff_t k = 0; k < ESTIMATES; ++k) answer[k] = quadrant.times(rows + k * DIMENSIONS);
    const double inverse = 1 / (answer[3] + NOTHING), phase = 1 / static_cast<double>(model.phases - 1);
    const double spacing = (model.largest - model.smallest) / static_cast<double>(model.diameters - 1);
    return {node.across * phase + quadrant.along_u * std::clamp(answer[0] * inverse, -LONGEST, LONGEST),
            node.down * phase + quadrant.along_v * std::clamp(answer[1] * inverse, -LONGEST, LONGEST),
            model.smallest + node.size * spacing + std::clamp(answer[2] * inverse, -LONGEST_DIAMETER, LONGEST_DIAMETER), answer[3],
            answer[4]};
}

Disc fit_disc(const float* patch, Disc start, int steps, const DiscModel& model, DiscNode& node) {
    node = nearest_node(start, model);
    Disc disc = estimate(patch, node, model);
    for (int step = 1; step < steps; ++step) {
        const DiscNode next = nearest_node(disc, model);
        if (next == node) break;  // at the same node, a step repeats the last one
        node = next;
        disc = estimate(patch, node, model);
    }
    return disc;
}

TACTILE_WIDE double residual_variance(const float* patch, const DiscNode& node, const DiscModel& model) {
    const Quadrant quadrant(patch, node, model);
    double rest = quadrant.times(quadrant.values);
    for (std::ptrdiff_t mode = 0; mode < MODES; ++mode) {
        const double part = quadrant.times(model.modes.data() + (quadrant.index * MODES + mode) * DIMENSIONS);
        rest -= part * part;
    }
    return std::max(rest, 0.0) / static_cast<double>(DIMENSIONS - MODES);
}

}  // namespace tactile
