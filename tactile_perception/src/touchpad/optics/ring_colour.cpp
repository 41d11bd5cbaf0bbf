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
constexpr double SATURATED = 9 * 254;    // sum of nine pixels of red, the brightest channel in red water
constexpr double NOISE_FLOOR = 9 * 0.5;  // sum of nine pixels below which a channel has no information. Chosen
constexpr double FAR = 16384;            // px. Places are clipped to this; no image is that large
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
std::ptrdiff_t nearest(double value) {
    constexpr std::ptrdiff_t FLOOR = 1 << 16;  // makes the number positive, so that the conversion rounds down
    return static_cast<std::ptrdiff_t>(value + (FLOOR + 0.5)) - FLOOR;
}

// Whether the 3 x 3 pixels around (row, column) are all inside the image.
bool is_inside(const ColourImage& image, std::ptrdiff_t row, std::ptrdiff_t column) {
    return row > 0 && column > 0 && row + 1 < image.rows && column + 1 < image.columns;
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

// The same inside the image, from the first number of the row above on: first down the nine columns of numbers, then across the pixels.
std::array<int, 3> sum_of_nine(const std::uint8_t* above, std::ptrdiff_t stride) {
    const std::uint8_t *here = above + stride, *below = here + stride;
    std::int16_t down[EIGHT];
    (Eight::of_pixels(above) + Eight::of_pixels(here) + Eight::of_pixels(below)).store(down);
    return {down[0] + down[3] + down[6], down[1] + down[4] + down[7], down[2] + down[5] + above[8] + here[8] + below[8]};
}

// Sums of 3 x 3 pixels at each point of a ring around (u, v).
void sum_on_ring(const ColourImage& image, double u, double v, const Ring& ring, Sums& sums) {
    const std::ptrdiff_t stride = 3 * image.columns;
    std::ptrdiff_t rows[POINTS], columns[POINTS];
    for (int p = 0; p < POINTS; ++p) {
        rows[p] = nearest(v + ring.down[p]), columns[p] = nearest(u + ring.across[p]);
        if (!is_inside(image, rows[p], columns[p])) continue;
        for (std::ptrdiff_t r = -1; r <= 1; ++r) __builtin_prefetch(image.pixels + (rows[p] + r) * stride + 3 * (columns[p] - 1));
    }
    for (int p = 0; p < POINTS; ++p) {
        const std::array<int, 3> nine = is_inside(image, rows[p], columns[p])
                                            ? sum_of_nine(image.pixels + (rows[p] - 1) * stride + 3 * (columns[p] - 1), stride)
                                            : sum_at_border(image, rows[p], columns[p]);
        for (int channel = 0; channel < 3; ++channel) sums[channel][p] = nine[channel];
    }
}

// The upper quartile: the largest number that at most three quarters of all fall short of.
int upper_quartile(const std::array<int, POINTS>& numbers) {
    std::array<int, POINTS> less{};
    for (int q = 0; q < POINTS; ++q) {
        for (int p = 0; p < POINTS; ++p) less[p] += numbers[q] < numbers[p];
    }
    int found = 0;
    for (int p = 0; p < POINTS; ++p) found = std::max(found, less[p] <= 3 * POINTS / 4 ? numbers[p] : 0);
    return found;
}

// Which points are neither ink nor glare nor saturated: 1, others 0.
std::array<int, POINTS> background(const Sums& sums) {
    const double level = upper_quartile(sums[0]), least = INK * level, most = GLARE * level;
    std::array<int, POINTS> keep;
    for (int p = 0; p < POINTS; ++p) keep[p] = (sums[0][p] > least) & (sums[0][p] < most) & (sums[2][p] < SATURATED);
    return keep;
}

// Relative variance of blue / red over the points kept, without its mean and first harmonic (Fourier series).
double patchiness(const Sums& sums, const std::array<int, POINTS>& keep, int count, const Ring& ring) {
    OnRing uneven;
    double mean = 0;
    for (int p = 0; p < POINTS; ++p) uneven[p] = keep[p] * (static_cast<double>(sums[0][p]) / std::max(sums[2][p], 1));
    for (const double each : uneven) mean += each;
    mean = std::max(mean / std::max(count, 1), 1e-6);
    double square = 0, even = 0, odd = 0;
    for (int p = 0; p < POINTS; ++p) {
        const double off = keep[p] * (uneven[p] / mean - 1);
        square += off * off;
        even += off * ring.cosine[p];
        odd += off * ring.sine[p];
    }
    return square / POINTS - (even * even + odd * odd) * 2 / (POINTS * POINTS);
}

}  // namespace

RingColours ring_colours(const ColourImage& image, const double* places, std::ptrdiff_t count, double radius) {
    RingColours found{std::vector<double>(2 * count, NONE), std::vector<double>(count, NONE), std::vector<std::int64_t>(count, 0),
                      std::vector<double>(count, 0)};
    const Ring ring(radius);
    Sums sums;
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        if (!std::isfinite(places[2 * k]) || !std::isfinite(places[2 * k + 1])) continue;
        const double u = std::clamp(places[2 * k], -FAR, FAR), v = std::clamp(places[2 * k + 1], -FAR, FAR);
        sum_on_ring(image, u, v, ring, sums);
        const auto keep = background(sums);
        int used = 0, total[3] = {0, 0, 0};
        for (int p = 0; p < POINTS; ++p) {
            used += keep[p];
            for (int channel = 0; channel < 3; ++channel) total[channel] += keep[p] * sums[channel][p];
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
