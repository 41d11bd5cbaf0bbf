// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/peaks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr double MIN_HALVED_DIAMETER = 5.0;  // px: dots from this diameter on are searched in an image of half the size
// Lowest peak: of the contrast, which admits a small dot in a third of the light; of the noise; grey levels.
constexpr double MIN_CONTRAST_SHARE = 0.14, MIN_NOISE_SIGMAS = 2.0, MIN_HEIGHT = 2.0;
constexpr double SMOOTHING = 0.4, MAX_SMOOTHING = 5;  // diameters, and px, over which the image is smoothed to each side
constexpr double GROUND_HALF_SIDE = 1.1;              // diameters, to each side, of the square around

// Sums of step x step pixels, in rows with margins, into which the outermost ones are repeated.
struct Sums {
    std::ptrdiff_t rows, columns, margin, stride;
    std::vector<std::int32_t> values;
    // The left end of a row, or of the nearest one.
    const std::int32_t* row(std::ptrdiff_t r) const { return values.data() + std::clamp<std::ptrdiff_t>(r, 0, rows - 1) * stride; }
};

TACTILE_WIDE Sums sums_of(const Image& image, std::ptrdiff_t step, std::ptrdiff_t margin) {
    Sums found{image.rows / step, image.columns / step, margin, image.columns / step + 2 * margin, {}};
    found.values.resize(found.rows * found.stride);
    for (std::ptrdiff_t r = 0; r < found.rows; ++r) {
        std::int32_t *out = found.values.data() + r * found.stride, *inner = out + margin;
        const std::uint8_t *pixels = image.pixels + r * step * image.columns, *below = pixels + image.columns;
        for (std::ptrdiff_t c = 0; c < found.columns; ++c)
            inner[c] = step == 1 ? pixels[c] : pixels[2 * c] + pixels[2 * c + 1] + below[2 * c] + below[2 * c + 1];
        std::fill_n(out, margin, *inner);
        std::fill_n(inner + found.columns, margin, inner[found.columns - 1]);
    }
    return found;
}

// Weights of a Gaussian from its middle outwards.
std::vector<float> gaussian(std::ptrdiff_t half) {
    const double sigma = 0.3 * static_cast<double>(half) + 0.5;
    std::vector<float> weights;
    for (std::ptrdiff_t k = 0; k <= half; ++k) weights.push_back(static_cast<float>(std::exp(-0.5 * k * k / (sigma * sigma))));
    float total = -weights[0];
    for (const float weight : weights) total += 2 * weight;
    for (float& weight : weights) weight /= total;
    return weights;
}

// How far each smoothed pixel (rows, columns) is above the square around it, times sign.
TACTILE_WIDE std::vector<float> relief(const Sums& sums, std::ptrdiff_t half, std::ptrdiff_t reach, float sign) {
    const std::vector<float> weights = gaussian(half);
    const float share = sign / static_cast<float>((2 * reach + 1) * (2 * reach + 1));
    std::vector<float> found(sums.rows * sums.columns), smooth(sums.stride);
    std::vector<std::uint32_t> square(sums.stride), before(sums.stride + 1);  // of each column; of the columns before, which may overflow
    for (std::ptrdiff_t r = -reach; r < reach; ++r) {
        for (std::ptrdiff_t c = 0; c < sums.stride; ++c) square[c] += sums.row(r)[c];
    }
    for (std::ptrdiff_t r = 0; r < sums.rows; ++r) {
        const std::int32_t *enters = sums.row(r + reach), *leaves = sums.row(r - reach);
        for (std::ptrdiff_t c = 0; c < sums.stride; ++c) square[c] += enters[c], smooth[c] = 0;
        for (std::ptrdiff_t c = 0; c < sums.stride; ++c) before[c + 1] = before[c] + square[c];
        for (std::ptrdiff_t c = 0; c < sums.stride; ++c) square[c] -= leaves[c];
        for (std::ptrdiff_t k = 0; k <= half; ++k) {
            const std::int32_t *up = sums.row(r - k), *down = sums.row(r + k);
            const float weight = k ? weights[k] : weights[0] / 2;
            for (std::ptrdiff_t c = 0; c < sums.stride; ++c) smooth[c] += weight * static_cast<float>(up[c] + down[c]);
        }
        float* out = found.data() + r * sums.columns;
        const std::uint32_t *first = before.data() + sums.margin - reach, *last = first + 2 * reach + 1;
        for (std::ptrdiff_t c = 0; c < sums.columns; ++c)
            out[c] = -share * static_cast<float>(static_cast<std::int32_t>(last[c] - first[c]));
        for (std::ptrdiff_t k = 0; k <= half; ++k) {
            const float *left = smooth.data() + sums.margin - k, *right = left + 2 * k, weight = sign * (k ? weights[k] : weights[0] / 2);
            for (std::ptrdiff_t c = 0; c < sums.columns; ++c) out[c] += weight * (left[c] + right[c]);
        }
    }
    return found;
}

// Marks what is above lowest and not below its eight neighbours; row: of the relief, not an outermost one.
TACTILE_WIDE void mark_peaks(const float* row, std::ptrdiff_t columns, float lowest, std::uint8_t* peak) {
    const float *up = row - columns, *down = row + columns;
    for (std::ptrdiff_t c = 1; c < columns - 1; ++c) {
        const float above = std::max(std::max(up[c - 1], up[c]), up[c + 1]), below = std::max(std::max(down[c - 1], down[c]), down[c + 1]);
        peak[c] = row[c] > lowest && row[c] >= std::max(std::max(above, below), std::max(row[c - 1], row[c + 1]));
    }
}

}  // namespace

std::vector<double> find_peaks(const Image& image, const DotLook& look) {
    const std::ptrdiff_t step = look.typical >= MIN_HALVED_DIAMETER ? 2 : 1;
    const double across = look.typical / static_cast<double>(step), level = static_cast<double>(step * step);  // px; a grey level
    const auto half = static_cast<std::ptrdiff_t>(std::clamp(SMOOTHING * across, 1.0, MAX_SMOOTHING));
    const auto reach = static_cast<std::ptrdiff_t>(GROUND_HALF_SIDE * across) + 1;
    const double lowest =
        std::max({MIN_CONTRAST_SHARE * std::abs(look.contrast), MIN_NOISE_SIGMAS * look.noise / static_cast<double>(step), MIN_HEIGHT});
    std::vector<double> found;
    if (image.rows < 3 * step || image.columns < 3 * step) return found;
    const Sums sums = sums_of(image, step, std::max(half, reach));
    const std::vector<float> heights = relief(sums, half, reach, look.contrast < 0 ? -1 : 1);
    std::vector<std::uint8_t> peak(sums.columns);
    for (std::ptrdiff_t r = 1; r + 1 < sums.rows; ++r) {
        const float* row = heights.data() + r * sums.columns;
        mark_peaks(row, sums.columns, static_cast<float>(lowest * level), peak.data());
        for (auto at = peak.begin(); (at = std::find(at, peak.end(), 1)) != peak.end(); ++at) {
            const float* top = row + (at - peak.begin());
            const auto add = [&](std::ptrdiff_t pixel, std::ptrdiff_t next) {  // the vertex of the parabola through three neighbours
                const double rise = top[next] - top[-next], bend = std::max(2.0 * *top - top[next] - top[-next], level);
                found.push_back((static_cast<double>(pixel) + std::clamp(rise / (2 * bend), -1.0, 1.0) + 0.5) * static_cast<double>(step) -
                                0.5);
            };
            add(top - row, 1), add(r, sums.columns);
        }
    }
    return found;
}

}  // namespace tactile
