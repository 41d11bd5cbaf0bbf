// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/dome.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "common/weighted_rows.hpp"

namespace tactile {
namespace {

constexpr int MAX_TERMS = 16;       // of the polynomials
constexpr int MAX_HARMONICS = 100;  // of the mesh's harmonics

// Each constant with its unit, origin and meaning.
constexpr struct DomeLimits {
    double max_spreads = 1.2;         // 1, limit: to which the logs of radius and friction are clamped
    double max_sine = 0.99;           // 1, limit: of the angle from the axis to a press, which is clamped to it
    double min_axis_distance = 1e-9;  // m, numeric: of a press, below which the direction of its meridian is no divisor
} LIMITS;

using Complex = std::complex<double>;

// A displacement on the mesh and its derivatives at a fixed mesh point, side by side. The last one is by the drag: in even fields along the
// meridian, in odd ones across it; two lanes are unused. Sums of modes are float: their error, 1e-8 m, is far below the noise of a marker.
enum FieldNumber { VALUE, BY_SHIFT, BY_DEPTH, BY_RADIUS, BY_FRICTION, BY_DRAG };
using FieldNumbers = Eigen::Matrix<float, 1, LANES>;
using FieldRows = Eigen::Matrix<float, Eigen::Dynamic, LANES, Eigen::RowMajor>;

// Values of basis functions and their derivatives.
template <int SIZE>
struct Basis {
    double value[SIZE], slope[SIZE];
};

// Uniform cubic B-splines at a log depth; first: the first of four levels.
Basis<4> depth_basis(const DomeLibrary& library, double log_depth, int& first) {
    const double share = std::clamp(std::exp(log_depth) / library.depth, 1e-9, 1.0);
    const double level = std::pow(share, 1 / library.power) * library.levels, by_log = level / library.power;
    first = std::min(static_cast<int>(level), library.levels - 1);
    const double f = level - first, g = 1 - f;
    return {{g * g * g / 6, (3 * f * f * f - 6 * f * f + 4) / 6, (-3 * f * f * f + 3 * f * f + 3 * f + 1) / 6, f * f * f / 6},
            {-g * g / 2 * by_log, (3 * f * f - 4 * f) / 2 * by_log, (-3 * f * f + 2 * f + 1) / 2 * by_log, f * f / 2 * by_log}};
}

// Chebyshev polynomials of the shift over its reach.
Basis<MAX_TERMS> shift_basis(const DomeLibrary& library, double shift) {
    const double x = std::clamp(shift / library.reach, -1.0, 1.0);
    Basis<MAX_TERMS> basis{{1, x}, {0, 1 / library.reach}};
    for (int k = 2; k < library.order; ++k) {
        basis.value[k] = 2 * x * basis.value[k - 1] - basis.value[k - 2];
        basis.slope[k] = 2 * x * basis.slope[k - 1] - basis.slope[k - 2] + 2 / library.reach * basis.value[k - 1];
    }
    return basis;
}

Basis<MAX_TERMS> powers(double x, int count) {
    Basis<MAX_TERMS> basis{{1}, {0}};
    for (int k = 1; k < count; ++k) basis.value[k] = basis.value[k - 1] * x, basis.slope[k] = k * basis.value[k - 1];
    return basis;
}

// A press on the mesh: direction of its meridian, distance from the axis, shift of the mesh (see shift_of in mesh.py) and its derivatives
// by that distance and by the log radius, drag along and across the meridian.
struct Meridian {
    double cosine, sine, away, shift, by_away, by_radius, along, across;
};

Meridian meridian_of(const DomeLibrary& library, const double* press) {
    const double away = std::hypot(press[X], press[Y]);
    const double spreads = std::clamp(press[RADIUS], -LIMITS.max_spreads, LIMITS.max_spreads);
    const double radius = library.radius * std::exp(library.radius_spread * spreads);
    const double reach = library.curvature + radius, angle = std::asin(std::min(away / reach, LIMITS.max_sine));
    const double shift = std::tan(angle / 2) / library.disc_scale, half = std::cos(angle / 2);
    // Derivative of the shift by the sine of the angle.
    const double by_sine = shift < library.reach ? 1 / (2 * half * half * library.disc_scale * std::cos(angle)) : 0;
    Meridian meridian{1, 0, away, std::min(shift, library.reach), by_sine / reach, 0, 0, 0};
    meridian.by_radius = -by_sine * away / (reach * reach) * radius * library.radius_spread;
    if (away > 1e-12) meridian.cosine = press[X] / away, meridian.sine = press[Y] / away;
    meridian.along = meridian.cosine * press[DRAG_X] + meridian.sine * press[DRAG_Y];
    meridian.across = meridian.cosine * press[DRAG_Y] - meridian.sine * press[DRAG_X];
    return meridian;
}

// Sums over rows of a table, from the first on, times weights.
TACTILE_WIDE FieldRows weighted(const FloatRows& table, Eigen::Index first, const FieldRows& weights) {
    FieldRows sums(table.cols(), LANES);
    weigh_rows(table.data() + first * table.cols(), weights.rows(), table.cols(), weights.data(), sums.data());
    return sums;
}

// Fields of a press ((rings + 1) 3 (harmonics + 1), LANES). Even ones, mirror symmetric to the meridian plane: the straight press
// with a drag along the meridian; odd ones: by a drag across it.
struct Fields {
    FieldRows even, odd;

    Fields(const DomeLibrary& library, const double* press, const Meridian& meridian) : library_(library) {
        int first;
        depths_ = depth_basis(library, press[DEPTH], first);
        shifts_ = shift_basis(library, meridian.shift);
        radii_ = powers(std::clamp(press[RADIUS], -LIMITS.max_spreads, LIMITS.max_spreads), library.radii);
        const Basis<MAX_TERMS> rough = powers(std::clamp(press[FRICTION], -LIMITS.max_spreads, LIMITS.max_spreads), library.straight);
        const int block = library.order * library.radii;
        FieldRows of_even = FieldRows::Zero(4 * (library.straight + DRAGS) * block, LANES);  // weights of the tables' rows at four levels
        FieldRows of_odd = FieldRows::Zero(4 * DRAGS * block, LANES);
        for (int level = 0, even_row = 0, odd_row = 0; level < 4; ++level) {
            for (int power = 0; power < library.straight; ++power)
                weigh(level, {rough.value[power], rough.slope[power], 0}, of_even, even_row);
            weigh_drags(level, press[FRICTION], meridian.along, of_even, even_row);
            weigh_drags(level, press[FRICTION], meridian.across, of_odd, odd_row);
        }
        even = weighted(library.even_modes, 0, weighted(library.even_table, first * (library.straight + DRAGS) * block, of_even));
        odd = weighted(library.odd_modes, 0, weighted(library.odd_table, first * DRAGS * block, of_odd));
    }

 private:
    const DomeLibrary& library_;
    Basis<4> depths_;
    Basis<MAX_TERMS> shifts_, radii_;

    // Factors on a block (order, radii) of a table, in the value and its derivatives, and in the last two fields.
    struct Shares {
        double value, friction, drag;
    };

    // Factors of a drag: of a sticking tip, and of the correction for a tip that slips, the more the lower the friction.
    void weigh_drags(int level, double friction, double drag, FieldRows& weights, int& row) const {
        const double slips = std::clamp(-friction, 0.0, 1.0), slope = friction < 0 && friction >= -1 ? -1 : 0;
        weigh(level, {drag, 0, 1}, weights, row);
        weigh(level, {drag * slips, drag * slope, slips}, weights, row);
    }

    void weigh(int level, const Shares& by, FieldRows& weights, int& row) const {
        for (int a = 0; a < library_.order; ++a) {
            for (int r = 0; r < library_.radii; ++r, ++row) {
                const double depth = depths_.value[level], shift = shifts_.value[a], radius = radii_.value[r];
                const double at = depth * shift * radius;
                weights(row, VALUE) = static_cast<float>(by.value * at);
                weights(row, BY_SHIFT) = static_cast<float>(by.value * depth * shifts_.slope[a] * radius);
                weights(row, BY_DEPTH) = static_cast<float>(by.value * depths_.slope[level] * shift * radius);
                weights(row, BY_RADIUS) = static_cast<float>(by.value * depth * shift * radii_.slope[r]);
                weights(row, BY_FRICTION) = static_cast<float>(by.friction * at);
                weights(row, BY_DRAG) = static_cast<float>(by.drag * at);
            }
        }
    }
};

// A marker on the mesh of a press: first ring, fraction of the distance to the next ring and one over that distance, cosines and sines of
// its direction; derivatives of distance and direction from the centre by the mesh's shift and by the direction of the meridian.
struct Spot {
    int ring = -1;
    double part = 0, per_width = 0;
    float cosine[MAX_HARMONICS], sine[MAX_HARMONICS];
    double far_by_shift = 0, turn_by_shift = 0, far_by_meridian = 0, turn_by_meridian = 0;
};

// Finds point (3) on the mesh; false if it is unknown or beyond the rim.
TACTILE_INLINE bool find_spot(const DomeLibrary& library, const Meridian& meridian, const double* point, Spot& spot) {
    const double stereographic = (library.curvature + point[2] - library.centre_z) * library.disc_scale;
    const Complex w = Complex(point[0], point[1]) * Complex(meridian.cosine, -meridian.sine) / stereographic;
    const Complex below = 1.0 - meridian.shift * w, under = std::conj(below) / std::norm(below);  // one over it, without checks of range
    const Complex z = (w - meridian.shift) * under;                                               // inverse of the mesh's automorphism
    const double far = std::sqrt(std::norm(z));
    if (!(far < 1)) return false;
    const double* edges = library.edges.data();
    spot.ring = static_cast<int>(std::upper_bound(edges + 1, edges + library.rings, far) - edges) - 1;
    spot.per_width = 1 / std::max(edges[spot.ring + 1] - edges[spot.ring], 1e-12);
    spot.part = (far - edges[spot.ring]) * spot.per_width;
    const Complex step = far > 1e-12 ? z / far : Complex(1, 0);
    Complex wave(1, 0);
    for (int m = 0; m <= library.harmonics; ++m, wave *= step)
        spot.cosine[m] = static_cast<float>(wave.real()), spot.sine[m] = static_cast<float>(wave.imag());
    const Complex by_shift = (w * w - 1.0) * under * under * std::conj(step);
    const Complex by_meridian = Complex(0, -1) * w * (1 - meridian.shift * meridian.shift) * under * under * std::conj(step);
    const double per_far = far > 1e-12 ? 1 / far : 0;
    spot.far_by_shift = by_shift.real(), spot.turn_by_shift = by_shift.imag() * per_far;
    spot.far_by_meridian = by_meridian.real(), spot.turn_by_meridian = by_meridian.imag() * per_far;
    return true;
}

// The fields at a spot, along one axis of the meridian's frame; derivatives of the displacement by distance and direction on the mesh, and
// by drags along the meridian and across it.
struct AtSpot {
    FieldNumbers field;
    double by_far, by_turn, along, across;

    TACTILE_INLINE AtSpot(const DomeLibrary& library, const Fields& fields, const Spot& spot, int axis) {
        const int waves = library.harmonics + 1, start = (spot.ring * 3 + axis) * waves, next = start + 3 * waves;
        // Even displacement in the meridian plane, and odd displacement across it, are cosines.
        const float *of_even = axis == 1 ? spot.sine : spot.cosine, *of_odd = axis == 1 ? spot.cosine : spot.sine;
        FieldNumbers even[2] = {FieldNumbers::Zero(), FieldNumbers::Zero()}, odd[2] = {FieldNumbers::Zero(), FieldNumbers::Zero()};
        float turns[2] = {};
        for (int end = 0; end < 2; ++end) {
            const int row = end ? next : start;
            for (int m = 0; m < waves; ++m) {
                even[end] += fields.even.row(row + m) * of_even[m], odd[end] += fields.odd.row(row + m) * of_odd[m];
                const float turn = static_cast<float>(axis == 1 ? m : -m);
                turns[end] += turn * (fields.even(row + m, VALUE) * of_odd[m] - fields.odd(row + m, VALUE) * of_even[m]);
            }
        }
        const auto part = static_cast<float>(spot.part);
        const FieldNumbers sums[2] = {even[0] + part * (even[1] - even[0]), odd[0] + part * (odd[1] - odd[0])};
        by_far = (even[1][VALUE] + odd[1][VALUE] - even[0][VALUE] - odd[0][VALUE]) * spot.per_width;
        by_turn = turns[0] + spot.part * (turns[1] - turns[0]);
        field = sums[0] + sums[1];
        along = sums[0][BY_DRAG], across = sums[1][BY_DRAG];
    }
};

// Derivatives (PRESS) of a marker's displacement along one axis of the meridian's frame, without those by the rotation of that frame.
TACTILE_INLINE void chain(const Meridian& meridian, const Spot& spot, const AtSpot& at, double* slopes) {
    const double by_shift = at.field[BY_SHIFT] + at.by_far * spot.far_by_shift + at.by_turn * spot.turn_by_shift;
    const double by_meridian =
        at.by_far * spot.far_by_meridian + at.by_turn * spot.turn_by_meridian + at.along * meridian.across - at.across * meridian.along;
    const double away = std::max(meridian.away, LIMITS.min_axis_distance);
    slopes[X] = by_shift * meridian.by_away * meridian.cosine - by_meridian * meridian.sine / away;
    slopes[Y] = by_shift * meridian.by_away * meridian.sine + by_meridian * meridian.cosine / away;
    slopes[DEPTH] = at.field[BY_DEPTH];
    slopes[RADIUS] = at.field[BY_RADIUS] + by_shift * meridian.by_radius;
    slopes[FRICTION] = at.field[BY_FRICTION];
    slopes[DRAG_X] = at.along * meridian.cosine - at.across * meridian.sine;
    slopes[DRAG_Y] = at.along * meridian.sine + at.across * meridian.cosine;
}

}  // namespace

TACTILE_WIDE Eigen::MatrixXd press_dome(const DomeLibrary& library, const Points& points, const Eigen::Matrix<double, PRESS, 1>& press,
                                        Points& moved) {
    const Meridian meridian = meridian_of(library, press.data());
    const Fields fields(library, press.data(), meridian);
    const Eigen::Index count = points.rows();
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> slopes = Eigen::MatrixXd::Zero(count, 3 * PRESS);
    const double away = std::max(meridian.away, LIMITS.min_axis_distance),
                 turn[2] = {-meridian.sine / away, meridian.cosine / away};  // of the meridian, by the position
    Spot spot;
    for (Eigen::Index k = 0; k < count; ++k) {
        if (!find_spot(library, meridian, points.data() + 3 * k, spot)) continue;
        double local[3], steep[3][PRESS], *slope = slopes.data() + 3 * PRESS * k;
        for (int axis = 0; axis < 3; ++axis) {
            const AtSpot at(library, fields, spot, axis);
            local[axis] = at.field[VALUE];
            chain(meridian, spot, at, steep[axis]);
        }
        const double x = meridian.cosine * local[0] - meridian.sine * local[1];
        const double y = meridian.sine * local[0] + meridian.cosine * local[1];
        moved(k, 0) += x, moved(k, 1) += y, moved(k, 2) += local[2];
        for (int number = 0; number < PRESS; ++number, slope += 3) {
            slope[0] = meridian.cosine * steep[0][number] - meridian.sine * steep[1][number];
            slope[1] = meridian.sine * steep[0][number] + meridian.cosine * steep[1][number];
            slope[2] = steep[2][number];
            if (number <= Y) slope[0] -= y * turn[number], slope[1] += x * turn[number];
        }
    }
    return slopes;
}

}  // namespace tactile
