// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Colour of the bright background around each dot: means over the points of a ring that lie neither on ink nor on glare.
#include "ring_colour.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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
constexpr double PI = 3.14159265358979323846;
constexpr double NONE = std::numeric_limits<double>::quiet_NaN();

using Sums = std::array<std::array<double, POINTS>, 3>;  // of 3 x 3 pixels: blue, green, red at each point
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

// Adds up the 3 x 3 pixels around (row, column); pixels outside of the image are black.
void sum_of_nine(const ColourImage& image, std::ptrdiff_t row, std::ptrdiff_t column, int point, Sums& sums) {
    int total[3] = {0, 0, 0};
    const std::ptrdiff_t top = std::max<std::ptrdiff_t>(row - 1, 0), bottom = std::min(row + 2, image.rows);
    const std::ptrdiff_t left = std::max<std::ptrdiff_t>(column - 1, 0), right = std::min(column + 2, image.columns);
    for (std::ptrdiff_t r = top; r < bottom; ++r) {
        const std::uint8_t* pixel = image.pixels + 3 * (r * image.columns + left);
        for (std::ptrdiff_t c = left; c < right; ++c, pixel += 3) {
            total[0] += pixel[0];
            total[1] += pixel[1];
            total[2] += pixel[2];
        }
    }
    for (int channel = 0; channel < 3; ++channel) sums[channel][point] = total[channel];
}

// The points that are neither ink nor glare nor saturated.
std::array<bool, POINTS> background(const Sums& sums) {
    OnRing sorted = sums[0];
    std::nth_element(sorted.begin(), sorted.begin() + 3 * POINTS / 4, sorted.end());
    const double level = sorted[3 * POINTS / 4];
    std::array<bool, POINTS> keep;
    for (int p = 0; p < POINTS; ++p) keep[p] = sums[0][p] > INK * level && sums[0][p] < GLARE * level && sums[2][p] < SATURATED;
    return keep;
}

// Relative variance of blue / red over the points kept, without its mean and first harmonic (Fourier series).
double patchiness(const Sums& sums, const std::array<bool, POINTS>& keep, int count, const Ring& ring) {
    OnRing uneven{};
    double mean = 0;
    for (int p = 0; p < POINTS; ++p) {
        if (keep[p]) mean += uneven[p] = sums[0][p] / std::max(sums[2][p], 1.0);
    }
    mean = std::max(mean / std::max(count, 1), 1e-6);
    double square = 0, even = 0, odd = 0;
    for (int p = 0; p < POINTS; ++p) {
        const double off = keep[p] ? uneven[p] / mean - 1 : 0;
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
        for (int p = 0; p < POINTS; ++p) sum_of_nine(image, nearest(v + ring.down[p]), nearest(u + ring.across[p]), p, sums);
        const auto keep = background(sums);
        int used = 0;
        double mean[3] = {0, 0, 0};
        for (int p = 0; p < POINTS; ++p) {
            if (!keep[p]) continue;
            ++used;
            for (int channel = 0; channel < 3; ++channel) mean[channel] += sums[channel][p];
        }
        found.count[k] = used;
        found.patchiness[k] = patchiness(sums, keep, used, ring);
        for (double& channel : mean) channel /= std::max(used, 1);
        if (used < LEAST_POINTS || !(std::min({mean[0], mean[1], mean[2]}) > NOISE_FLOOR)) continue;
        found.brightness[k] = std::log(mean[2] / 9);
        found.ratios[2 * k] = std::log(mean[0] / mean[2]);
        found.ratios[2 * k + 1] = std::log(mean[1] / mean[2]);
    }
    return found;
}

}  // namespace tactile
