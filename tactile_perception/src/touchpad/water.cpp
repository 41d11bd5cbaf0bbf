// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/water.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/wide.hpp"

namespace tactile {

namespace {

constexpr int LAMPS = 8;  // points that stand for the uniform ring light, to 1e-4 of a length (test_light_path)
constexpr double HALF = 0.70710678118654752440;
constexpr double COSINE[LAMPS] = {1, HALF, 0, -HALF, -1, -HALF, 0, HALF}, SINE[LAMPS] = {0, HALF, 1, HALF, 0, -HALF, -1, -HALF};
constexpr double DARK = 1e-6;  // minimum irradiance by Lambert's cosine, of a surface turned away from all lamps: keeps the means defined

}  // namespace

// Means over the lamps, weighted by irradiance: inverse square of the distance, Lambert's cosine, ambient.
TACTILE_WIDE Incidence incidence(const LightPath& path, const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                                 const Eigen::Vector3d& ray) {
    const double *at = position.data(), *centre = path.centre.data(), *n = normal.data(), *r = ray.data();
    const double up = at[2] - path.lamp_z, ambient = std::max(path.ambient, 0.0) + DARK;
    double distance[LAMPS], weight[LAMPS], outward[LAMPS];
    for (int k = 0; k < LAMPS; ++k) {
        const double x = at[0] - centre[0] - path.lamp_radius * COSINE[k];
        const double y = at[1] - centre[1] - path.lamp_radius * SINE[k];
        distance[k] = std::sqrt(x * x + y * y + up * up);
        const double near = 1 / distance[k], cosine = (x * n[0] + y * n[1] + up * n[2]) * near;
        weight[k] = ((cosine > 0 ? cosine : 0) + ambient) * near * near;
        outward[k] = (x * r[0] + y * r[1] + up * r[2]) * near;
    }
    double total = 0, far = 0, along = 0;
    for (int k = 0; k < LAMPS; ++k) {
        total += weight[k];
        far += weight[k] * distance[k];
        along += weight[k] * outward[k];
    }
    const double slant = far / (total * up);
    return {slant, along / (total * up) - slant * r[2] / up, total / LAMPS};
}

// The derivative neglects that of the weights: accurate to 1 %.
Length length_at(const LightPath& path, double z, double upwards, const Incidence& light) {
    const double depth = z - path.window_z, both = 1 / upwards + light.slant;
    return {depth * both, upwards * both + depth * light.change};
}

std::tuple<std::vector<double>, std::vector<double>, std::vector<double>> path_lengths(const LightPath& path,
                                                                                       const Array<double>& positions,
                                                                                       const double* normals) {
    std::vector<double> lengths, slopes, irradiance;
    for (std::ptrdiff_t k = 0; k < positions.length(); ++k) {
        const Eigen::Vector3d position = vec3_at(positions, k), away = position - path.centre, ray = away.normalized();
        const Incidence light = incidence(path, position, vec3_at(normals, k), ray);
        const Length found = length_at(path, position.z(), ray.z(), light);
        lengths.push_back(found.metres), slopes.push_back(found.slope), irradiance.push_back(light.irradiance);
    }
    return {std::move(lengths), std::move(slopes), std::move(irradiance)};
}

namespace {

constexpr int MIN_POINTS = 4;            // for a colour
constexpr int SATURATED = 9 * 254;       // sum of nine pixels of red, the brightest channel in red water
constexpr double NOISE_FLOOR = 9 * 0.5;  // sum of nine pixels below which a channel has no information
constexpr double FAR = 16384;            // px, to which positions are clipped; no image is that large
constexpr double NONE = std::numeric_limits<double>::quiet_NaN();

using OnRing = double[RING_POINTS];
using Sums = std::int16_t[RING_POINTS];  // of nine pixels each, or other small numbers

// Cosine and sine of the angle of each point of a ring.
struct Circle {
    OnRing cosine, sine;
    Circle() {
        for (int p = 0; p < RING_POINTS; ++p)
            cosine[p] = std::cos(2 * M_PI * p / RING_POINTS), sine[p] = std::sin(2 * M_PI * p / RING_POINTS);
    }
};

// Sums of 3 x 3 pixels around each point of a ring: blue, green, red; pixels outside of the image are black.
struct RingSums {
    Sums of[3];
};

// The three rows of three inner pixels from pixel on: eight values of a row at once, and the ninth.
TACTILE_INLINE void add_inner(const std::uint8_t* pixel, std::ptrdiff_t stride, int p, RingSums& sums) {
    typedef std::uint8_t Bytes __attribute__((vector_size(8)));
    typedef std::uint16_t Wide __attribute__((vector_size(16)));
    Wide total{};
    int last = 0;
    for (int row = 0; row < 3; ++row, pixel += stride) {
        Bytes some;
        std::memcpy(&some, pixel, sizeof some);
        total += __builtin_convertvector(some, Wide), last += pixel[8];
    }
    sums.of[0][p] = static_cast<std::int16_t>(total[0] + total[3] + total[6]);
    sums.of[1][p] = static_cast<std::int16_t>(total[1] + total[4] + total[7]);
    sums.of[2][p] = static_cast<std::int16_t>(total[2] + total[5] + last);
}

// Loads the pixels of a ring into the cache, while another one is read.
TACTILE_INLINE void fetch(const ColourImage& image, const double* centre, double radius, const Circle& circle) {
    const double x = std::clamp(centre[0], 0.0, image.columns - 1.0), y = std::clamp(centre[1], 0.0, image.rows - 1.0);
    for (int p = 0; p < RING_POINTS; ++p) {
        const std::ptrdiff_t row = std::lrint(y + radius * circle.sine[p]), column = std::lrint(x + radius * circle.cosine[p]);
        for (int r = -1; r < 2; ++r) __builtin_prefetch(image.pixels + 3 * ((row + r) * image.columns + column));
    }
}

TACTILE_INLINE void add_up(const ColourImage& image, const double* centre, double radius, const Circle& circle, RingSums& sums) {
    const double x = std::clamp(centre[0], -FAR, FAR), y = std::clamp(centre[1], -FAR, FAR);
    for (int p = 0; p < RING_POINTS; ++p) {
        const std::ptrdiff_t row = std::lrint(y + radius * circle.sine[p]), column = std::lrint(x + radius * circle.cosine[p]);
        const std::ptrdiff_t left = std::max<std::ptrdiff_t>(column - 1, 0), right = std::min(column + 2, image.columns);
        const std::ptrdiff_t top = std::max<std::ptrdiff_t>(row - 1, 0), bottom = std::min(row + 2, image.rows);
        const std::uint8_t* pixel = image.pixels + 3 * (top * image.columns + left);
        if (bottom - top == 3 && right - left == 3) {
            add_inner(pixel, 3 * image.columns, p, sums);
            continue;
        }
        for (Sums& channel : sums.of) channel[p] = 0;
        for (std::ptrdiff_t r = top; r < bottom; ++r, pixel += 3 * image.columns) {
            for (std::ptrdiff_t c = 0; c < 3 * (right - left); ++c) sums.of[c % 3][p] += pixel[c];
        }
    }
}

// The upper quartile: the largest value that at most three quarters are smaller than.
TACTILE_INLINE int upper_quartile(const Sums& values) {
    Sums smaller{};
    for (int q = 0; q < RING_POINTS; ++q) {
        for (int p = 0; p < RING_POINTS; ++p) smaller[p] += values[q] < values[p];
    }
    int found = 0;
    for (int p = 0; p < RING_POINTS; ++p) found = std::max<int>(found, smaller[p] <= 3 * RING_POINTS / 4 ? values[p] : 0);
    return found;
}

// Relative variance of blue / red over the points kept (1, others 0), without its mean and first harmonic (Fourier series).
TACTILE_INLINE double patchiness(const RingSums& sums, const Sums& keep, int count, const Circle& circle) {
    OnRing uneven;
    double mean = 0, square = 0, first = 0, second = 0;
    for (int p = 0; p < RING_POINTS; ++p) {
        uneven[p] = keep[p] * (static_cast<double>(sums.of[0][p]) / std::max<double>(sums.of[2][p], 1));
        mean += uneven[p];
    }
    mean = std::max(mean / std::max(count, 1), 1e-6);
    for (int p = 0; p < RING_POINTS; ++p) {
        const double off = keep[p] * (uneven[p] / mean - 1.0);
        square += off * off, first += off * circle.cosine[p], second += off * circle.sine[p];
    }
    return square / RING_POINTS - (first * first + second * second) * 2 / (RING_POINTS * RING_POINTS);
}

}  // namespace

TACTILE_WIDE RingColours ring_colours(const Array<std::uint8_t>& pixels, const Array<double>& centres, double radius, double ink,
                                      double glare) {
    const ColourImage image{pixels, pixels.length(0), pixels.length(1)};
    const std::ptrdiff_t count = centres.length();
    RingColours found{std::vector<double>(2 * count, NONE), std::vector<double>(count, NONE), std::vector<std::int64_t>(count, 0),
                      std::vector<double>(count, 0)};
    const auto is_finite = [&](std::ptrdiff_t k) { return std::isfinite(centres[2 * k]) && std::isfinite(centres[2 * k + 1]); };
    const Circle circle;
    RingSums sums;
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        if (k + 1 < count && is_finite(k + 1)) fetch(image, centres + 2 * (k + 1), radius, circle);
        if (!is_finite(k)) continue;
        add_up(image, centres + 2 * k, radius, circle, sums);
        const double level = upper_quartile(sums.of[0]);
        Sums keep;  // 1 of a point that is neither ink nor glare nor saturated
        int used = 0, total[3] = {};
        for (int p = 0; p < RING_POINTS; ++p) {
            keep[p] = (sums.of[0][p] > ink * level) & (sums.of[0][p] < glare * level) & (sums.of[2][p] < SATURATED);
            used += keep[p];
            for (int channel = 0; channel < 3; ++channel) total[channel] += keep[p] * sums.of[channel][p];
        }
        found.count[k] = used;
        found.patchiness[k] = patchiness(sums, keep, used, circle);
        if (used < MIN_POINTS || !(std::min({total[0], total[1], total[2]}) > NOISE_FLOOR * used)) continue;
        found.brightness[k] = std::log(static_cast<double>(total[2]) / (9 * used));
        found.ratios[2 * k] = std::log(static_cast<double>(total[0]) / total[2]);
        found.ratios[2 * k + 1] = std::log(static_cast<double>(total[1]) / total[2]);
    }
    return found;
}

namespace {

constexpr int STEPS = 5;            // Gauss-Newton steps for the share, which then changes by less than 1e-4
constexpr double MAX_COLOUR = 1e3;  // beyond which a colour is unknown
constexpr double MAX_SHARE = 2;     // with a larger one the ring is saturated

// Weighted least squares of the length from two log ratios.
struct Ratios {
    double gain[2];      // of the length from what both ratios fall short of their constants
    double apart[2];     // of the disagreement of both, in standard deviations
    double information;  // about the length, of a whole ring, 1/m^2

    explicit Ratios(const WaterColour& water) {
        const double *n = water.noise.data(), *a = water.absorptions.data(), det = n[0] * n[3] - n[1] * n[2];
        const double weight[2] = {(n[3] * a[0] - n[1] * a[1]) / det, (n[0] * a[1] - n[2] * a[0]) / det};
        information = a[0] * weight[0] + a[1] * weight[1];
        const double scale = std::sqrt(1 / (det * information));
        for (int c = 0; c < 2; ++c) gain[c] = weight[c] / information;
        apart[0] = a[1] * scale;
        apart[1] = -a[0] * scale;
    }
};

// What a share of glare adds to a log ratio, ln((1 + colour share) / (1 + share)), and its derivative.
double tint(double colour, double share) {
    return std::log((1 + colour * share) / (1 + share));
}
double tint_slope(double colour, double share) {
    return colour / (1 + colour * share) - 1 / (1 + share);
}

struct Estimate {
    double length, variance, disagreement;  // m, m^2, standard deviations
};

// Of a dot that may have glare: colour of the glare, what both ratios fall short of their constants, share of the ring's points that is
// used, and the excess of brightness with its standard deviation.
struct GlaringDot {
    const double *colour, *fallen;
    double points, excess, sigma;
};

// The length from what both ratios fall short of their constants, on this share of a ring's points.
Estimate without_glare(const Ratios& ratios, const double* fallen, double points) {
    const double apart = ratios.apart[0] * fallen[0] + ratios.apart[1] * fallen[1];
    return {ratios.gain[0] * fallen[0] + ratios.gain[1] * fallen[1], 1 / (points * ratios.information), apart * std::sqrt(points)};
}

// The most likely length with glare whose share is normally distributed about 0 with the standard deviation size, and the logarithm of the
// evidence for such glare over none (Laplace's approximation). Gauss-Newton steps for the share alone, since the length follows from it,
// with the ratios' disagreement, the excess of brightness ln(1 + share), and the distribution of shares as data.
Estimate with_glare(const Ratios& ratios, const GlaringDot& dot, double size, double& evidence) {
    const auto [colour, fallen, points, excess, sigma] = dot;
    double share = std::clamp(std::expm1(excess), 0.0, MAX_SHARE);
    for (int step = 0;; ++step) {
        double scattered[2], slope[2];
        for (int c = 0; c < 2; ++c) {
            scattered[c] = fallen[c] + tint(colour[c], share);
            slope[c] = tint_slope(colour[c], share);
        }
        Estimate found = without_glare(ratios, scattered, points);
        const double by_ratios = (ratios.apart[0] * slope[0] + ratios.apart[1] * slope[1]) * std::sqrt(points);
        const double brighter = (excess - std::log1p(share)) / sigma, by_brightness = -1 / ((1 + share) * sigma), usual = share / size;
        const double curvature = by_ratios * by_ratios + by_brightness * by_brightness + 1 / (size * size);
        if (step == STEPS) {
            const double pull = ratios.gain[0] * slope[0] + ratios.gain[1] * slope[1];
            const double none = without_glare(ratios, fallen, points).disagreement, dark = excess / sigma;
            evidence = (none * none + dark * dark - found.disagreement * found.disagreement - brighter * brighter - usual * usual) / 2 +
                       std::log(2 / (size * std::sqrt(curvature)));
            found.variance += pull * pull / curvature;
            return found;
        }
        const double gradient = found.disagreement * by_ratios + brighter * by_brightness + usual / size;
        share = std::clamp(share - gradient / curvature, 0.0, MAX_SHARE);
    }
}

}  // namespace

// A dot has glare or not: the mean and the variance of both estimates, weighted by their probabilities.
WaterLengths water_lengths(const WaterColour& water, const Glare& glare, const DotColours& seen) {
    const Ratios ratios(water);
    const double unlikely = (1 - glare.probability) / glare.probability;
    const std::ptrdiff_t dots = seen.ratios.rows();
    WaterLengths found{std::vector<double>(dots), std::vector<double>(dots)};
    for (std::ptrdiff_t k = 0; k < dots; ++k) {
        const double fallen[2] = {water.constants[0] - seen.ratios(k, 0), water.constants[1] - seen.ratios(k, 1)};
        const double points = std::max<double>(static_cast<double>(seen.count[k]), 1) / RING_POINTS;
        Estimate best = without_glare(ratios, fallen, points);
        const double* colour = seen.colour.data() + 2 * k;
        const bool known = colour[0] >= 0 && colour[0] <= MAX_COLOUR && colour[1] >= 0 && colour[1] <= MAX_COLOUR;
        if (std::isfinite(seen.excess[k]) && seen.excess_sigma[k] > 0 && known) {
            double evidence;
            const Estimate other = with_glare(ratios, {colour, fallen, points, seen.excess[k], seen.excess_sigma[k]}, glare.size, evidence);
            const double p = 1 / (1 + unlikely * std::exp(-evidence)), apart = other.length - best.length;
            best.variance = (1 - p) * best.variance + p * other.variance + p * (1 - p) * apart * apart;
            best.length += p * apart;
            best.disagreement = (1 - p) * best.disagreement + p * other.disagreement;
        }
        const double widen = std::max(best.disagreement * best.disagreement / (water.disagree * water.disagree), 1.0);
        const double patches = std::max(seen.patchiness[k] - water.patchy * RING_POINTS * water.noise[0], 0.0);
        found.lengths[k] = best.length;
        found.sigma[k] = std::sqrt(widen * widen * best.variance + patches / (water.absorptions[0] * water.absorptions[0]));
    }
    return found;
}

namespace {

// Binomial mean over the known ones of the 3 x 3 values (K) around each dot; NaN without any.
std::vector<double> smooth(Grid grid, const std::vector<double>& values) {
    std::vector<double> out(values.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        double sum = 0, weight = 0;
        around(grid, k, [&](std::ptrdiff_t j) {
            const bool row = j / grid.columns == k / grid.columns, column = j % grid.columns == k % grid.columns;
            const double share = (row ? 0.5 : 0.25) * (column ? 0.5 : 0.25);
            if (std::isfinite(values[j])) sum += share * values[j], weight += share;
        });
        out[k] = weight > 0 ? sum / weight : NONE;
    }
    return out;
}

// The surface through the dots.
class Surface {
 public:
    // ranges: N, m, a first estimate. Only their changes since rest are smoothed, since derivatives amplify noise.
    Surface(const LightPath& path, const SeenDots& dots, Grid grid, const std::vector<double>& ranges)
        : dots_(dots), grid_(grid), flat_(grid.rows < 3 || grid.columns < 3) {
        if (flat_) return;
        change_.assign(grid.size(), NONE);
        for (std::ptrdiff_t k = 0; k < dots.id.size(); ++k) change_[dots.id[k]] = ranges[k] - dots.rest_ranges[k];
        change_ = smooth(grid, change_);
        positions_.assign(3 * change_.size(), NONE);
        for (std::ptrdiff_t k = 0; k < dots.id.size(); ++k) {
            const double change = change_[dots.id[k]], range = dots.rest_ranges[k] + (std::isfinite(change) ? change : 0);
            store(positions_.data(), dots.id[k], path.centre + range * vec3_at(dots.rays.data(), k));
        }
    }

    // Laplacian of the change of the ranges since rest at dot k, m per pitch squared; 0 at the border and where a neighbour is missing.
    double curvature(std::ptrdiff_t k) const {
        if (!inner(k)) return 0;
        const double* here = change_.data() + dots_.id[k];
        const double sum = here[-grid_.columns] + here[grid_.columns] + here[-1] + here[1] - 4 * here[0];
        return std::isfinite(sum) ? sum : 0;
    }

    // Unit normal, z up, at dot k: cross product of central differences; that at rest at the border and where a neighbour is missing.
    Eigen::Vector3d normal(std::ptrdiff_t k) const {
        const Eigen::Vector3d rest = vec3_at(dots_.rest_normals.data(), k);
        if (!inner(k)) return rest;
        const double* here = positions_.data() + 3 * dots_.id[k];
        const Eigen::Vector3d right = vec3_at(here, 1) - vec3_at(here, -1);
        const Eigen::Vector3d down = vec3_at(here, grid_.columns) - vec3_at(here, -grid_.columns);
        const Eigen::Vector3d out = right.cross(down), unit = std::copysign(1 / out.norm(), out.z()) * out;
        return unit.allFinite() ? unit : rest;
    }

 private:
    bool inner(std::ptrdiff_t k) const { return !flat_ && grid_.inner(dots_.id[k] / grid_.columns, dots_.id[k] % grid_.columns); }

    const SeenDots& dots_;
    const Grid grid_;
    bool flat_;
    std::vector<double> change_, positions_;
};

// One Newton step along a ray from range start to the range at which the path has that length.
Length march(const LightPath& path, double length, const Eigen::Vector3d& ray, double start, const Eigen::Vector3d& normal) {
    const Eigen::Vector3d position = path.centre + start * ray;
    const Length here = length_at(path, position.z(), ray.z(), incidence(path, position, normal, ray));
    return {start + (length - here.metres) / here.slope, here.slope};
}

}  // namespace

WaterRanges water_ranges(const LightPath& path, const SeenDots& dots, Grid grid, const double* lengths, double ring_share) {
    const std::ptrdiff_t count = dots.id.size();
    std::vector<double> first(count);
    for (std::ptrdiff_t k = 0; k < dots.id.size(); ++k)
        first[k] = march(path, lengths[k], vec3_at(dots.rays.data(), k), dots.rest_ranges[k], vec3_at(dots.rest_normals.data(), k)).metres;
    const Surface surface(path, dots, grid, first);
    WaterRanges found{std::vector<double>(count), std::vector<double>(count)};
    for (std::ptrdiff_t k = 0; k < dots.id.size(); ++k) {
        const Length second = march(path, lengths[k], vec3_at(dots.rays.data(), k), first[k], surface.normal(k));
        // The mean over a ring of radius r differs from the value at its centre by r^2 / 4 times the Laplacian, to second order.
        found.ranges[k] = second.metres - surface.curvature(k) * ring_share * ring_share / 4;
        found.slopes[k] = second.slope;
    }
    return found;
}

}  // namespace tactile
