// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dots/detect/disc_model.hpp"
#include "dots/detect/image.hpp"

namespace tactile {

// Pixels around a dot, and their projection onto the few dimensions that its fit needs.
class DiscPatch {
 public:
    explicit DiscPatch(const DiscModel& model);

    // Copies the pixels around (column, row), which is inside the image, minus a grey level from 0 to 255; outside the image, the outermost
    // pixels.
    void cut(const Image& image, std::ptrdiff_t column, std::ptrdiff_t row, int level);

    // Subtracts the image of a disc at (u, v), px from the middle pixel; diameter: px; amplitude: grey levels; all finite.
    void subtract(double u, double v, double diameter, double amplitude);

    // Writes the DIMENSIONS coefficients, grey levels.
    void compress(float* out);

    // The same of the pixels around (column, row) as they are in the image; see cut.
    void compress(const Image& image, std::ptrdiff_t column, std::ptrdiff_t row, int level, float* out);

 private:
    // Whether the columns of a patch around one are inside the image.
    bool is_inside(const Image& image, std::ptrdiff_t column) const { return column >= width_ && column + width_ <= image.columns; }
    template <std::ptrdiff_t COUNT, class Row>
    void fold_part(const Row& up, const Row& down, std::ptrdiff_t c, std::int16_t* out) const;
    template <class Row>
    void fold(const Row& up, const Row& down, std::ptrdiff_t r);
    void project(float* out) const;
    // Row r of the patch from the middle pixel to the right, and to the left; the padding follows.
    std::int16_t* right_of(std::ptrdiff_t r) { return values_.data() + 2 * r * width_; }
    std::int16_t* left_of(std::ptrdiff_t r) { return right_of(r) + width_; }

    const DiscModel& model_;
    const std::ptrdiff_t half_, quarter_, width_, sector_;  // width_: of a padded half row; sector_: length of a folded patch
    std::vector<std::int16_t> values_, folded_;
};

}  // namespace tactile
