// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dome.hpp"

#include <algorithm>
#include <cmath>

namespace tactile {
namespace {

constexpr double BEYOND = 1.2;   // times the spread: logs of radius and friction are clamped to it. Chosen
constexpr double STEP = 1e-3;    // of the finite differences: logs, and shares of the largest shift. Chosen
constexpr int MOST_TERMS = 16;   // of the polynomials
constexpr double WIDEST = 0.99;  // sine of the angle of a touch: a place farther out is taken there

using Complex = std::complex<double>;

// Uniform cubic B-splines at a log depth: the first of four levels, and their weights.
int depth_weights(const DomeLibrary& library, double log_depth, double* weights) {
    const double share = std::clamp(std::exp(log_depth) / library.depth, 1e-9, 1.0);
    const double level = std::pow(share, 1 / library.power) * library.levels;
    const int first = std::min(static_cast<int>(level), library.levels - 1);
    const double f = level - first, g = 1 - f;
    weights[0] = g * g * g / 6;
    weights[1] = (3 * f * f * f - 6 * f * f + 4) / 6;
    weights[2] = (-3 * f * f * f + 3 * f * f + 3 * f + 1) / 6;
    weights[3] = f * f * f / 6;
    return first;
}

// The library interpolated at one shift, depth, radius and friction: weights of the even modes for a straight press and for friction
// along the meridian, and of the odd modes for friction across it.
struct Mixed {
    std::vector<double> straight, along, across;
};

void add_block(const double* table, const double* over_shift, const double* over_radius, const DomeLibrary& library, int count,
               double share, std::vector<double>& sum) {
    for (int a = 0; a < library.order; ++a) {
        for (int r = 0; r < library.radii; ++r, table += count) {
            const double amount = share * over_shift[a] * over_radius[r];
            for (int m = 0; m < count; ++m) sum[m] += amount * table[m];
        }
    }
}

Mixed mix(const DomeLibrary& library, double shift, double log_depth, double radius, double friction) {
    double depths[4], over_radius[MOST_TERMS], over_shift[MOST_TERMS];
    const int first = depth_weights(library, log_depth, depths);
    const double size = std::clamp(radius, -BEYOND, BEYOND), rough = std::clamp(friction, -BEYOND, BEYOND);
    const double angle = std::acos(std::clamp(shift / library.reach, -1.0, 1.0));
    for (int k = 0; k < library.order; ++k) over_shift[k] = std::cos(k * angle);  // Chebyshev
    for (int k = 0; k < library.radii; ++k) over_radius[k] = k ? over_radius[k - 1] * size : 1;
    Mixed mixed{std::vector<double>(library.even, 0.0), std::vector<double>(library.even, 0.0), std::vector<double>(library.odd, 0.0)};
    const std::size_t even_block = static_cast<std::size_t>(library.order) * library.radii * library.even;
    const std::size_t odd_block = static_cast<std::size_t>(library.order) * library.radii * library.odd;
    for (int level = 0; level < 4; ++level) {
        const double* table = library.even_table + (first + level) * (STRAIGHT + 1) * even_block;
        double share = depths[level];
        for (int power = 0; power < STRAIGHT; ++power, share *= rough, table += even_block)
            add_block(table, over_shift, over_radius, library, library.even, share, mixed.straight);
        add_block(table, over_shift, over_radius, library, library.even, depths[level], mixed.along);
        table = library.odd_table + (first + level) * odd_block;
        add_block(table, over_shift, over_radius, library, library.odd, depths[level], mixed.across);
    }
    return mixed;
}

// Sum of modes (count, size) with weights.
std::vector<double> sum_modes(const double* modes, const std::vector<double>& weights, std::size_t size) {
    std::vector<double> sum(size, 0.0);
    for (const double weight : weights) {
        for (std::size_t k = 0; k < size; ++k) sum[k] += weight * modes[k];
        modes += size;
    }
    return sum;
}

std::size_t field_size(const DomeLibrary& library) {
    return static_cast<std::size_t>(library.rings + 1) * 3 * (library.harmonics + 1);
}

// The field of a mixture: the straight press with friction along and across the meridian.
DomeField field_of(const DomeLibrary& library, const Mixed& mixed, double along, double across) {
    std::vector<double> even = mixed.straight, odd = mixed.across;
    for (std::size_t m = 0; m < even.size(); ++m) even[m] += along * mixed.along[m];
    for (double& weight : odd) weight *= across;
    return {sum_modes(library.even_modes, even, field_size(library)), sum_modes(library.odd_modes, odd, field_size(library))};
}

// (after - before) / step.
void subtract(std::vector<double>& after, const std::vector<double>& before, double step) {
    for (std::size_t m = 0; m < after.size(); ++m) after[m] = (after[m] - before[m]) / step;
}

DomeField difference(const DomeLibrary& library, Mixed after, const Mixed& before, double step, const Meridian& meridian) {
    subtract(after.straight, before.straight, step);
    subtract(after.along, before.along, step);
    subtract(after.across, before.across, step);
    return field_of(library, after, meridian.along, meridian.across);
}

}  // namespace

void DomeField::add(double share, const DomeField& other) {
    for (std::size_t k = 0; k < even.size(); ++k) even[k] += share * other.even[k];
    for (std::size_t k = 0; k < odd.size(); ++k) odd[k] += share * other.odd[k];
}

Meridian meridian_of(const DomeLibrary& library, const double* press) {
    const double away = std::hypot(press[X], press[Y]);
    const double radius = library.radius * std::exp(library.radius_spread * std::clamp(press[RADIUS], -BEYOND, BEYOND));
    const double angle = std::asin(std::min(away / (library.curvature + radius), WIDEST));
    Meridian meridian{1, 0, std::min(std::tan(angle / 2) / library.disc_scale, library.reach), 0, 0};
    if (away > 1e-12) meridian.cosine = press[X] / away, meridian.sine = press[Y] / away;
    meridian.along = meridian.cosine * press[DRAG_X] + meridian.sine * press[DRAG_Y];
    meridian.across = meridian.cosine * press[DRAG_Y] - meridian.sine * press[DRAG_X];
    return meridian;
}

DomeField field_of(const DomeLibrary& library, const double* press, const Meridian& meridian) {
    return field_of(library, mix(library, meridian.shift, press[DEPTH], press[RADIUS], press[FRICTION]), meridian.along, meridian.across);
}

PressFields fields_of(const DomeLibrary& library, const double* press, const Meridian& meridian) {
    const double shift = meridian.shift, depth = press[DEPTH], radius = press[RADIUS], friction = press[FRICTION];
    const double farther = STEP * library.reach * (shift > 0.5 * library.reach ? -1 : 1);
    const Mixed at = mix(library, shift, depth, radius, friction);
    PressFields fields;
    fields.value = field_of(library, at, meridian.along, meridian.across);
    fields.by_shift = difference(library, mix(library, shift + farther, depth, radius, friction), at, farther, meridian);
    fields.by_depth = difference(library, mix(library, shift, depth - STEP, radius, friction), at, -STEP, meridian);
    fields.by_radius = difference(library, mix(library, shift, depth, radius + STEP, friction), at, STEP, meridian);
    fields.by_friction = difference(library, mix(library, shift, depth, radius, friction + STEP), at, STEP, meridian);
    const std::vector<double> none(field_size(library), 0.0);
    fields.by_along = {sum_modes(library.even_modes, at.along, field_size(library)), none};
    fields.by_across = {none, sum_modes(library.odd_modes, at.across, field_size(library))};
    return fields;
}

OnMesh::OnMesh(const DomeLibrary& library, const DomeMarkers& markers, const Meridian& meridian)
    : ring(markers.count, -1), part(markers.count), cosine(markers.count * (library.harmonics + 1)), sine(cosine.size()) {
    const Complex turn(meridian.cosine, -meridian.sine);
    for (std::int64_t k = 0; k < markers.count; ++k) {
        const double* point = markers.points + 3 * k;
        const double stereographic = (library.curvature + point[2] - library.centre_z) * library.disc_scale;
        const Complex w = Complex(point[0], point[1]) * turn / stereographic;
        const Complex z = (w - meridian.shift) / (1.0 - meridian.shift * w);  // inverse of the mesh's automorphism
        const double radius = std::abs(z);
        if (!(radius < 1)) continue;
        const int low = static_cast<int>(std::upper_bound(library.edges + 1, library.edges + library.rings, radius) - library.edges) - 1;
        ring[k] = low;
        part[k] = (radius - library.edges[low]) / std::max(library.edges[low + 1] - library.edges[low], 1e-12);
        const Complex step = radius > 1e-12 ? z / radius : Complex(1, 0);
        Complex wave(1, 0);
        for (int m = 0; m <= library.harmonics; ++m, wave *= step) {
            cosine[k * (library.harmonics + 1) + m] = wave.real();
            sine[k * (library.harmonics + 1) + m] = wave.imag();
        }
    }
}

void add_displacement(const DomeLibrary& library, const OnMesh& at, const Meridian& meridian, const DomeField& field, double share,
                      double* moved) {
    const int waves = library.harmonics + 1, per_ring = 3 * waves;
    for (std::size_t k = 0; k < at.ring.size(); ++k, moved += 3) {
        if (at.ring[k] < 0) continue;
        const double *cosine = &at.cosine[k * waves], *sine = &at.sine[k * waves], part = at.part[k];
        const double* even = &field.even[static_cast<std::size_t>(at.ring[k]) * per_ring];
        const double* odd = &field.odd[static_cast<std::size_t>(at.ring[k]) * per_ring];
        double sum[3] = {0, 0, 0};
        for (int axis = 0; axis < 3; ++axis, even += waves, odd += waves) {
            const double *of_even = axis == 1 ? sine : cosine, *of_odd = axis == 1 ? cosine : sine;
            for (int m = 0; m < waves; ++m) {
                sum[axis] += (even[m] + part * (even[m + per_ring] - even[m])) * of_even[m];
                sum[axis] += (odd[m] + part * (odd[m + per_ring] - odd[m])) * of_odd[m];
            }
        }
        moved[0] += share * (meridian.cosine * sum[0] - meridian.sine * sum[1]);
        moved[1] += share * (meridian.sine * sum[0] + meridian.cosine * sum[1]);
        moved[2] += share * sum[2];
    }
}

void press_dome(const DomeLibrary& library, const DomeMarkers& markers, const double* presses, int n, double* moved) {
    std::fill(moved, moved + 3 * markers.count, 0.0);
    for (int p = 0; p < n; ++p) {
        const double* press = presses + p * PRESS;
        const Meridian meridian = meridian_of(library, press);
        add_displacement(library, OnMesh(library, markers, meridian), meridian, field_of(library, press, meridian), 1, moved);
    }
}

}  // namespace tactile
