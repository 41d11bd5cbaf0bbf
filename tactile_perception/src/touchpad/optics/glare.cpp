// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Path lengths from three channels: the length, and the share of light that the skin mirrors instead of scattering it.
#include "touchpad/optics/glare.hpp"

#include <algorithm>
#include <cmath>

#include "touchpad/optics/grid_normal.hpp"

namespace tactile {
namespace {

constexpr int POINTS = 16;        // of a ring
constexpr double DISAGREE = 2.5;  // standard deviations between the two ratios above which the length's is widened. Chosen
// Times the noise's variance of a ring point above which blue / red around a ring shows glare or an edge. Chosen.
constexpr double PATCHY = 2.5;
constexpr int STEPS = 5;             // Gauss-Newton steps for the share; chosen: it then changes by less than 1e-4
constexpr double STRONGEST = 1e3;    // colour, beyond which it is unknown. Chosen
constexpr double LARGEST_SHARE = 2;  // chosen: with more, the ring is saturated

// Weighted least squares of the length from two log ratios.
struct Ratios {
    double gain[2];      // of the length from what both ratios fall short of their constants
    double apart[2];     // of the disagreement of both, in standard deviations
    double information;  // about the length, of a whole ring, 1/m^2

    explicit Ratios(const WaterColour& water) {
        const double *n = water.noise, *a = water.absorptions, det = n[0] * n[3] - n[1] * n[2];
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

// The length from what both ratios fall short of their constants, on this share of a ring's points.
Estimate without_glare(const Ratios& ratios, const double* fallen, double points) {
    const double apart = ratios.apart[0] * fallen[0] + ratios.apart[1] * fallen[1];
    return {ratios.gain[0] * fallen[0] + ratios.gain[1] * fallen[1], 1 / (points * ratios.information), apart * std::sqrt(points)};
}

// The most likely length with glare whose share is normally distributed about 0 with the standard deviation size, and the logarithm of the
// evidence for such glare over none (Laplace's approximation). Gauss-Newton steps for the share alone, since the length follows from it,
// with the ratios' disagreement, the excess of brightness ln(1 + share), and the distribution of shares as data.
Estimate with_glare(const Ratios& ratios, const double* colour, const double* fallen, double points, double excess, double sigma,
                    double size, double& evidence) {
    double share = std::clamp(std::expm1(excess), 0.0, LARGEST_SHARE);
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
        share = std::clamp(share - gradient / curvature, 0.0, LARGEST_SHARE);
    }
}

}  // namespace

SkinLight skin_light(const LightPath& path, const double* places, const double* border_normals, std::ptrdiff_t rows,
                     std::ptrdiff_t columns) {
    const std::ptrdiff_t dots = rows * columns;
    SkinLight found{std::vector<double>(dots), std::vector<double>(dots)};
    for (std::ptrdiff_t row = 0; row < rows; ++row) {
        for (std::ptrdiff_t column = 0; column < columns; ++column) {
            const std::ptrdiff_t k = row * columns + column;
            const bool inner = row > 0 && column > 0 && row < rows - 1 && column < columns - 1;
            const Vec3 place = vec3_at(places, k), border = vec3_at(border_normals, k);
            const Vec3 normal = inner ? grid_normal(places + 3 * k, columns, border) : border;
            const Vec3 away = place - path.centre, ray = (1 / length(away)) * away;
            const Incidence light = incidence(path, place, normal, ray);
            found.irradiance[k] = light.irradiance;
            found.lengths[k] = length_at(path, place.z, ray.z, light).metres;
        }
    }
    return found;
}

// A dot has glare or not: the mean and the variance of both estimates, weighted by their probabilities.
WaterLengths water_lengths(const WaterColour& water, const Glare& glare, const DotColours& seen) {
    const Ratios ratios(water);
    const double unlikely = (1 - glare.probability) / glare.probability;
    WaterLengths found{std::vector<double>(seen.dots), std::vector<double>(seen.dots)};
    for (std::ptrdiff_t k = 0; k < seen.dots; ++k) {
        const double fallen[2] = {water.constants[0] - seen.ratios[2 * k], water.constants[1] - seen.ratios[2 * k + 1]};
        const double points = std::max<double>(static_cast<double>(seen.count[k]), 1) / POINTS;
        Estimate best = without_glare(ratios, fallen, points);
        const double* colour = seen.colour + 2 * k;
        const bool known = colour[0] >= 0 && colour[0] <= STRONGEST && colour[1] >= 0 && colour[1] <= STRONGEST;
        if (std::isfinite(seen.excess[k]) && seen.excess_sigma[k] > 0 && known) {
            double evidence;
            const Estimate other = with_glare(ratios, colour, fallen, points, seen.excess[k], seen.excess_sigma[k], glare.size, evidence);
            const double p = 1 / (1 + unlikely * std::exp(-evidence)), apart = other.length - best.length;
            best.variance = (1 - p) * best.variance + p * other.variance + p * (1 - p) * apart * apart;
            best.length += p * apart;
            best.disagreement = (1 - p) * best.disagreement + p * other.disagreement;
        }
        const double widen = std::max(best.disagreement * best.disagreement / (DISAGREE * DISAGREE), 1.0);
        const double patches = std::max(seen.patchiness[k] - PATCHY * POINTS * water.noise[0], 0.0);
        found.lengths[k] = best.length;
        found.sigma[k] = std::sqrt(widen * widen * best.variance + patches / (water.absorptions[0] * water.absorptions[0]));
    }
    return found;
}

}  // namespace tactile
