// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Colour of the bright background around each dot: means over the points of a ring that lie neither on ink nor on glare.
#include "touchpad/optics/ring_colour.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/lanes.hpp"
#include "common/pi.hpp"

namespace tactile {
namespace {

constexpr int POINTS = 16;       // on a ring, each the sum of 3 x 3 pixels. Chosen
constexpr int LEAST_POINTS = 4;  // for a colour. Chosen
// A point with blue below or above these shares of its ring's upper quartile is ink or glare (white light raises blue, the weakest channel
// in red water, first). Chosen: shading across the flank of a dent stays between them.
constexpr double INK = 0.75, GLARE = 1.2;
constexpr int SATURATED = 9 * 254;       // sum of nine pixels of red, the brightest channel in red water
constexpr double NOISE_FLOOR = 9 * 0.5;  // sum of nine pixels below which a channel has no information. Chosen
constexpr double FAR = 16384;            // px. Places are clipped to this; no image is that large
constexpr std::ptrdiff_t AHEAD = 3;      // dots whose pixels are fetched from memory before they are needed. Chosen: of 1, 2, 3, 7
constexpr double NONE = std::numeric_limits<double>::quiet_NaN();

using Sums = std::array<std::array<int, POINTS>, 3>;  // of 3 x 3 pixels: blue, green, red at each point
using OnRing = std::array<double, POINTS>;

// Offsets of the points from the dot's centre.
struct Ring {
    OnRing across, down, cosine, sine;
    explicit Ring(double radius) {
        for (int p = 0; p < POINTS; ++p) {
            cosine[p] = std::cos(2 * PI * p / POINTS);
            sine[p] = std::sin(2 * PI * p / POINTS);
            across[p] = radius * cosine[p];
            down[p] = radius * sine[p];
        }
    }
};

// The nearest whole number to one from -FAR - LARGEST_RADIUS up.
TACTILE_INLINE std::ptrdiff_t nearest(double value) {
    constexpr std::ptrdiff_t FLOOR = 1 << 16;  // makes the number positive, so that the conversion rounds down
    return static_cast<std::ptrdiff_t>(value + (FLOOR + 0.5)) - FLOOR;
}

// Whether sixteen numbers from the pixel before (row, column) on are inside the image, and so those of the rows above and below.
TACTILE_INLINE bool is_inside(const ColourImage& image, std::ptrdiff_t row, std::ptrdiff_t column) {
    return row > 0 && column > 0 && row + 1 < image.rows && column + 5 <= image.columns;
}

// Adds up the 3 x 3 pixels around (row, column); pixels outside of the image are black.
std::array<int, 3> sum_at_border(const ColourImage& image, std::ptrdiff_t row, std::ptrdiff_t column) {
    std::array<int, 3> total{};
    const std::ptrdiff_t top = std::max<std::ptrdiff_t>(row - 1, 0), bottom = std::min(row + 2, image.rows);
    const std::ptrdiff_t left = std::max<std::ptrdiff_t>(column - 1, 0), right = std::min(column + 2, image.columns);
    for (std::ptrdiff_t r = top; r < bottom; ++r) {
        for (std::ptrdiff_t c = left; c < right; ++c) {
            for (int channel = 0; channel < 3; ++channel) total[channel] += image.pixels[3 * (r * image.columns + c) + channel];
        }
    }
    return total;
}

// The same inside the image, from the first number of the row above on: first down the columns of numbers, then across the pixels.
TACTILE_INLINE std::array<int, 3> sum_of_nine(const std::uint8_t* above, std::ptrdiff_t stride) {
    const Sixteen down = Sixteen(above) + Sixteen(above + stride) + Sixteen(above + 2 * stride);
    const std::uint64_t even = down.even.first_four(), odd = down.odd.first_four();  // numbers 0, 2, 4, 6, and 1, 3, 5, 7
    const std::uint64_t sides = even + (odd >> 16) + (even >> 48), middle = odd + (even >> 32) + (odd >> 48);
    return {static_cast<int>(sides & 0xffff), static_cast<int>(middle & 0xffff),
            static_cast<int>(sides >> 16 & 0xffff) + down.even.values[4]};
}

// The pixels nearest to the points of a ring.
struct RingPixels {
    std::ptrdiff_t rows[POINTS], columns[POINTS];
};

// Those of the ring around a place (u, v), which are fetched into the cache.
TACTILE_INLINE void fetch(const ColourImage& image, const double* place, const Ring& ring, RingPixels& pixels) {
    const double u = place[0] >= -FAR ? std::min(place[0], FAR) : -FAR,
                 v = place[1] >= -FAR ? std::min(place[1], FAR) : -FAR;  // also of NaN
    for (int p = 0; p < POINTS; ++p) {
        const std::ptrdiff_t row = nearest(v + ring.down[p]), column = nearest(u + ring.across[p]);
        pixels.rows[p] = row, pixels.columns[p] = column;
        if (!is_inside(image, row, column)) continue;
        for (std::ptrdiff_t r = -1; r <= 1; ++r) __builtin_prefetch(image.pixels + 3 * ((row + r) * image.columns + column - 1));
    }
}

// Sums of 3 x 3 pixels at each point of a ring.
TACTILE_INLINE void sum_on_ring(const ColourImage& image, const RingPixels& pixels, Sums& sums) {
    const std::ptrdiff_t stride = 3 * image.columns;
    for (int p = 0; p < POINTS; ++p) {
        const std::ptrdiff_t row = pixels.rows[p], column = pixels.columns[p];
        const std::array<int, 3> nine = is_inside(image, row, column)
                                            ? sum_of_nine(image.pixels + (row - 1) * stride + 3 * (column - 1), stride)
                                            : sum_at_border(image, row, column);
        for (int channel = 0; channel < 3; ++channel) sums[channel][p] = nine[channel];
    }
}

// The upper quartile: the largest number that at most three quarters of all fall short of.
TACTILE_INLINE int upper_quartile(const std::array<int, POINTS>& numbers) {
    std::array<int, POINTS> less{};
    for (int q = 0; q < POINTS; ++q) {
        for (int p = 0; p < POINTS; ++p) less[p] += numbers[q] < numbers[p];
    }
    int found = 0;
    for (int p = 0; p < POINTS; ++p) found = std::max(found, less[p] <= 3 * POINTS / 4 ? numbers[p] : 0);
    return found;
}

// Which points are neither ink nor glare nor saturated: 1, others 0.
TACTILE_INLINE std::array<int, POINTS> background(const Sums& sums) {
    const double level = upper_quartile(sums[0]);
    const auto least = static_cast<int>(INK * level), most = static_cast<int>(std::ceil(GLARE * level));
    std::array<int, POINTS> keep;
    for (int p = 0; p < POINTS; ++p) keep[p] = (sums[0][p] > least) & (sums[0][p] < most) & (sums[2][p] < SATURATED);
    return keep;
}

// Sum over the points, four of them at once.
TACTILE_INLINE double sum_of(const Four (&numbers)[POINTS / FOUR]) {
    static_assert(POINTS == 4 * FOUR);
    double parts[FOUR];
    ((numbers[0] + numbers[1]) + (numbers[2] + numbers[3])).store(parts);
    return (parts[0] + parts[1]) + (parts[2] + parts[3]);
}

// Relative variance of blue / red over the points kept, without its mean and first harmonic (Fourier series).
TACTILE_INLINE double patchiness(const Sums& sums, const std::array<int, POINTS>& keep, int count, const Ring& ring) {
    OnRing blue, red, kept;
    for (int p = 0; p < POINTS; ++p) blue[p] = sums[0][p], red[p] = std::max(sums[2][p], 1), kept[p] = keep[p];
    Four uneven[POINTS / FOUR], square[POINTS / FOUR], even[POINTS / FOUR], odd[POINTS / FOUR];
    for (int k = 0, p = 0; p < POINTS; ++k, p += FOUR) uneven[k] = Four(&kept[p]) * (Four(&blue[p]) / Four(&red[p]));
    const double mean = std::max(sum_of(uneven) / std::max(count, 1), 1e-6);
    for (int k = 0, p = 0; p < POINTS; ++k, p += FOUR) {
        const Four off = Four(&kept[p]) * (uneven[k] / mean - 1.0);
        square[k] = off * off;
        even[k] = off * Four(&ring.cosine[p]);
        odd[k] = off * Four(&ring.sine[p]);
    }
    const double first = sum_of(even), second = sum_of(odd);
    return sum_of(square) / POINTS - (first * first + second * second) * 2 / (POINTS * POINTS);
}

}  // namespace

TACTILE_WIDE RingColours ring_colours(const ColourImage& image, const double* places, std::ptrdiff_t count, double radius) {
    RingColours found{std::vector<double>(2 * count, NONE), std::vector<double>(count, NONE), std::vector<std::int64_t>(count, 0),
                      std::vector<double>(count, 0)};
    const Ring ring(radius);
    Sums sums;
    RingPixels pixels[AHEAD + 1];  // of this dot and of the next ones, which are on their way from memory meanwhile
    for (std::ptrdiff_t k = 0; k < std::min(AHEAD, count); ++k) fetch(image, places + 2 * k, ring, pixels[k]);
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        if (k + AHEAD < count) fetch(image, places + 2 * (k + AHEAD), ring, pixels[(k + AHEAD) % (AHEAD + 1)]);
        if (!std::isfinite(places[2 * k]) || !std::isfinite(places[2 * k + 1])) continue;
        sum_on_ring(image, pixels[k % (AHEAD + 1)], sums);
        const auto keep = background(sums);
        int used = 0, total[3] = {0, 0, 0};
        for (int p = 0; p < POINTS; ++p) {
            used += keep[p];
            for (int channel = 0; channel < 3; ++channel) total[channel] += -keep[p] & sums[channel][p];
        }
        found.count[k] = used;
        found.patchiness[k] = patchiness(sums, keep, used, ring);
        if (used < LEAST_POINTS || !(std::min({total[0], total[1], total[2]}) > NOISE_FLOOR * used)) continue;
        const double red = total[2];
        found.brightness[k] = std::log(red / (9 * used));
        found.ratios[2 * k] = std::log(total[0] / red);
        found.ratios[2 * k + 1] = std::log(total[1] / red);
    }
    return found;
}

}  // namespace tactile
