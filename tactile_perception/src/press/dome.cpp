// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "press/dome.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstring>
#include <type_traits>
#include <vector>

#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr double BEYOND = 1.2;   // times the spread: logs of radius and friction are clamped to it. Chosen
constexpr int MOST_TERMS = 16;   // of the polynomials
constexpr int MOST_WAVES = 100;  // of the mesh's harmonics
constexpr std::size_t SPAN = 8;  // numbers of a field that are summed at once, in registers. Chosen
constexpr double WIDEST = 0.99;  // sine of the angle of a touch: a place farther out is taken there

using Complex = std::complex<double>;
typedef float Span __attribute__((vector_size(SPAN * sizeof(float))));

TACTILE_INLINE float value_of(float number) {
    return number;
}
TACTILE_INLINE float value_of(const Span& numbers) {
    return numbers[0];
}

// Sums of modes are float: their error, 1e-8 m, is far below the noise of a marker.
// A displacement on the mesh and its slopes at a fixed place there, side by side. The last is that by drags: of even fields along the
// meridian, of odd ones across it.
enum FieldNumber { VALUE, BY_SHIFT, BY_DEPTH, BY_RADIUS, BY_FRICTION, BY_DRAG, FIELDS };

// Values of a basis and their slopes.
template <int MOST>
struct Basis {
    double value[MOST], slope[MOST];
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
Basis<MOST_TERMS> shift_basis(const DomeLibrary& library, double shift) {
    const double x = std::clamp(shift / library.reach, -1.0, 1.0);
    Basis<MOST_TERMS> basis{{1, x}, {0, 1 / library.reach}};
    for (int k = 2; k < library.order; ++k) {
        basis.value[k] = 2 * x * basis.value[k - 1] - basis.value[k - 2];
        basis.slope[k] = 2 * x * basis.slope[k - 1] - basis.slope[k - 2] + 2 / library.reach * basis.value[k - 1];
    }
    return basis;
}

Basis<MOST_TERMS> powers(double x, int count) {
    Basis<MOST_TERMS> basis{{1}, {0}};
    for (int k = 1; k < count; ++k) basis.value[k] = basis.value[k - 1] * x, basis.slope[k] = k * basis.value[k - 1];
    return basis;
}

// WIDTH of the sums of sum_rows, from `first` on.
template <typename Numbers, std::size_t WIDTH>
TACTILE_INLINE void sum_columns(const float* rows, int count, std::size_t size, const float* weights, float* sums, std::size_t first) {
    constexpr std::size_t STRIDE = sizeof(Numbers) / sizeof(float);
    Numbers sum[WIDTH] = {}, weight;
    for (int m = 0; m < count; ++m) {
        std::memcpy(&weight, weights + m * STRIDE, sizeof weight);
        for (std::size_t k = 0; k < WIDTH; ++k) sum[k] += rows[m * size + first + k] * weight;
    }
    std::memcpy(sums + first * STRIDE, sum, sizeof sum);
}

// sums (size) of Numbers, one or SPAN floats side by side, = rows (count, size), transposed, times weights (count) of Numbers.
template <typename Numbers>
TACTILE_INLINE void sum_rows(const float* rows, int count, std::size_t size, const float* weights, float* sums) {
    std::size_t first = 0;
    for (; first + SPAN <= size; first += SPAN) sum_columns<Numbers, SPAN>(rows, count, size, weights, sums, first);
    for (; first < size; ++first) sum_columns<Numbers, 1>(rows, count, size, weights, sums, first);
}

// The touch of a press on the mesh: direction of the meridian, distance from the axis, shift of the mesh (see shift_of in mesh.py) and its
// slopes by that distance and by the log radius, drag along and across the meridian.
struct Meridian {
    double cosine, sine, away, shift, by_away, by_radius, along, across;
};

Meridian meridian_of(const DomeLibrary& library, const double* press) {
    const double away = std::hypot(press[X], press[Y]);
    const double radius = library.radius * std::exp(library.radius_spread * std::clamp(press[RADIUS], -BEYOND, BEYOND));
    const double reach = library.curvature + radius, angle = std::asin(std::min(away / reach, WIDEST));
    const double shift = std::tan(angle / 2) / library.disc_scale, half = std::cos(angle / 2);
    // Slope of the shift by the sine of the angle.
    const double by_sine = shift < library.reach ? 1 / (2 * half * half * library.disc_scale * std::cos(angle)) : 0;
    Meridian meridian{1, 0, away, std::min(shift, library.reach), by_sine / reach, 0, 0, 0};
    meridian.by_radius = -by_sine * away / (reach * reach) * radius * library.radius_spread;
    if (away > 1e-12) meridian.cosine = press[X] / away, meridian.sine = press[Y] / away;
    meridian.along = meridian.cosine * press[DRAG_X] + meridian.sine * press[DRAG_Y];
    meridian.across = meridian.cosine * press[DRAG_Y] - meridian.sine * press[DRAG_X];
    return meridian;
}

// Fields of a press (rings + 1, 3, harmonics + 1), COUNT numbers each: 1, the displacement alone, or FIELDS. Even ones, mirror symmetric to
// the meridian plane: the straight press with a drag along the meridian; odd ones: by a drag across it.
template <int COUNT>
struct Fields {
    using Numbers = std::conditional_t<COUNT == 1, float, Span>;
    static constexpr int STRIDE = sizeof(Numbers) / sizeof(float);
    std::vector<float> even, odd;

    TACTILE_INLINE Fields(const DomeLibrary& library, const double* press, const Meridian& meridian) {
        int first;
        depths_ = depth_basis(library, press[DEPTH], first);
        shifts_ = shift_basis(library, meridian.shift);
        radii_ = powers(std::clamp(press[RADIUS], -BEYOND, BEYOND), library.radii);
        const Basis<MOST_TERMS> rough = powers(std::clamp(press[FRICTION], -BEYOND, BEYOND), STRAIGHT);
        const std::size_t block = static_cast<std::size_t>(library.order) * library.radii;
        std::vector<float> of_even, of_odd;  // weights (rows, STRIDE) of the rows of the tables at four levels
        of_even.reserve(4 * (STRAIGHT + DRAGS) * block * STRIDE), of_odd.reserve(4 * DRAGS * block * STRIDE);
        for (int level = 0; level < 4; ++level) {
            for (int power = 0; power < STRAIGHT; ++power)
                add_weights(library, level, {rough.value[power], rough.slope[power], 0}, of_even);
            add_drags(library, level, press[FRICTION], meridian.along, of_even);
            add_drags(library, level, press[FRICTION], meridian.across, of_odd);
        }
        even = summed(library, library.even_table + first * (STRAIGHT + DRAGS) * block * library.even, of_even, library.even_modes,
                      library.even);
        odd = summed(library, library.odd_table + first * DRAGS * block * library.odd, of_odd, library.odd_modes, library.odd);
    }

 private:
    Basis<4> depths_;
    Basis<MOST_TERMS> shifts_, radii_;

    // Shares of a block (order, radii) of a table in the value and its slopes, and in the last two fields.
    struct Shares {
        double value, friction, drag;
    };

    // Shares of a drag by way of a tip that sticks, and of what it shows more as far as it rubs: the less friction, the more.
    void add_drags(const DomeLibrary& library, int level, double friction, double way, std::vector<float>& weights) {
        const double rubs = std::clamp(-friction, 0.0, 1.0), slope = friction < 0 && friction > -1 ? -1 : 0;
        add_weights(library, level, {way, 0, 1}, weights);
        add_weights(library, level, {way * rubs, way * slope, rubs}, weights);
    }

    void add_weights(const DomeLibrary& library, int level, const Shares& by, std::vector<float>& weights) {
        for (int a = 0; a < library.order; ++a) {
            for (int r = 0; r < library.radii; ++r) {
                const double depth = depths_.value[level], shift = shifts_.value[a], radius = radii_.value[r];
                const double at = depth * shift * radius;
                const double of[FIELDS] = {by.value * at,
                                           by.value * depth * shifts_.slope[a] * radius,
                                           by.value * depths_.slope[level] * shift * radius,
                                           by.value * depth * shift * radii_.slope[r],
                                           by.friction * at,
                                           by.drag * at};
                for (int c = 0; c < STRIDE; ++c) weights.push_back(c < FIELDS ? static_cast<float>(of[c]) : 0.0f);
            }
        }
    }

    // Fields from rows of a table (rows, count) with weights (rows, STRIDE), the amplitudes of count modes.
    TACTILE_INLINE static std::vector<float> summed(const DomeLibrary& library, const float* table, const std::vector<float>& weights,
                                                    const float* modes, int count) {
        const std::size_t size = static_cast<std::size_t>(library.rings + 1) * 3 * (library.harmonics + 1);
        std::vector<float> amplitudes(static_cast<std::size_t>(count) * STRIDE), fields(size * STRIDE);
        sum_rows<Numbers>(table, static_cast<int>(weights.size() / STRIDE), count, weights.data(), amplitudes.data());
        sum_rows<Numbers>(modes, count, size, amplitudes.data(), fields.data());
        return fields;
    }
};

// A marker on the mesh of a touch: z in the unit disc, first ring, part of the way to the next and one over their distance, cosines and
// sines; slopes of distance and direction from the centre by the mesh's shift and by the direction of the meridian.
struct Spot {
    int ring = -1;
    double part = 0, per_width = 0;
    float cosine[MOST_WAVES], sine[MOST_WAVES];
    double far_by_shift = 0, turn_by_shift = 0, far_by_meridian = 0, turn_by_meridian = 0;
};

// Finds point (3) on the mesh; false where it is unknown or beyond the rim.
TACTILE_INLINE bool find_spot(const DomeLibrary& library, const Meridian& meridian, const double* point, Spot& spot) {
    const double stereographic = (library.curvature + point[2] - library.centre_z) * library.disc_scale;
    const Complex w = Complex(point[0], point[1]) * Complex(meridian.cosine, -meridian.sine) / stereographic;
    const Complex below = 1.0 - meridian.shift * w, under = std::conj(below) / std::norm(below);  // one over it, without checks of range
    const Complex z = (w - meridian.shift) * under;                                               // inverse of the mesh's automorphism
    const double far = std::sqrt(std::norm(z));
    if (!(far < 1)) return false;
    spot.ring = static_cast<int>(std::upper_bound(library.edges + 1, library.edges + library.rings, far) - library.edges) - 1;
    spot.per_width = 1 / std::max(library.edges[spot.ring + 1] - library.edges[spot.ring], 1e-12);
    spot.part = (far - library.edges[spot.ring]) * spot.per_width;
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

// The fields at a spot, along one axis of the meridian's frame; slopes of the displacement by distance and direction on the mesh.
template <int COUNT>
struct AtSpot {
    double field[COUNT], by_far, by_turn;
    double along = 0, across = 0;  // COUNT FIELDS: by drags along the meridian and across it

    TACTILE_INLINE AtSpot(const DomeLibrary& library, const Fields<COUNT>& fields, const Spot& spot, int axis) {
        using Numbers = typename Fields<COUNT>::Numbers;
        constexpr int STRIDE = Fields<COUNT>::STRIDE;
        const int waves = library.harmonics + 1, start = (spot.ring * 3 + axis) * waves * STRIDE, next = 3 * waves * STRIDE;
        const float *even = fields.even.data() + start, *odd = fields.odd.data() + start;
        // Even displacement in the meridian plane, and odd displacement across it, are cosines.
        const float *of_even = axis == 1 ? spot.sine : spot.cosine, *of_odd = axis == 1 ? spot.cosine : spot.sine;
        const float turn_even = axis == 1 ? 1 : -1;
        Numbers low[2] = {}, high[2] = {};
        float turn_low = 0, turn_high = 0;
        for (int m = 0; m < waves; ++m, even += STRIDE, odd += STRIDE) {
            Numbers here[2], outer[2];
            std::memcpy(&here[0], even, sizeof(Numbers)), std::memcpy(&outer[0], even + next, sizeof(Numbers));
            std::memcpy(&here[1], odd, sizeof(Numbers)), std::memcpy(&outer[1], odd + next, sizeof(Numbers));
            low[0] += here[0] * of_even[m], high[0] += outer[0] * of_even[m];
            low[1] += here[1] * of_odd[m], high[1] += outer[1] * of_odd[m];
            const float turn = static_cast<float>(m) * turn_even;
            turn_low += turn * (even[0] * of_odd[m] - odd[0] * of_even[m]);
            turn_high += turn * (even[next] * of_odd[m] - odd[next] * of_even[m]);
        }
        const auto part = static_cast<float>(spot.part);
        const Numbers of[2] = {low[0] + part * (high[0] - low[0]), low[1] + part * (high[1] - low[1])};
        by_far = (value_of(high[0]) + value_of(high[1]) - value_of(low[0]) - value_of(low[1])) * spot.per_width;
        by_turn = turn_low + spot.part * (turn_high - turn_low);
        if constexpr (COUNT == 1) {
            field[VALUE] = of[0] + of[1];
        } else {
            for (int c = 0; c < COUNT; ++c) field[c] = of[0][c] + of[1][c];
            along = of[0][int{BY_DRAG}], across = of[1][int{BY_DRAG}];
        }
    }
};

// Slopes (PRESS) of a marker's displacement along one axis of the meridian's frame, but for the turn of that frame.
TACTILE_INLINE void chain(const Meridian& meridian, const Spot& spot, const AtSpot<FIELDS>& at, double* slopes) {
    const double by_shift = at.field[BY_SHIFT] + at.by_far * spot.far_by_shift + at.by_turn * spot.turn_by_shift;
    const double by_meridian =
        at.by_far * spot.far_by_meridian + at.by_turn * spot.turn_by_meridian + at.along * meridian.across - at.across * meridian.along;
    slopes[X] = by_shift * meridian.by_away * meridian.cosine - by_meridian * meridian.sine / meridian.away;
    slopes[Y] = by_shift * meridian.by_away * meridian.sine + by_meridian * meridian.cosine / meridian.away;
    slopes[DEPTH] = at.field[BY_DEPTH];
    slopes[RADIUS] = at.field[BY_RADIUS] + by_shift * meridian.by_radius;
    slopes[FRICTION] = at.field[BY_FRICTION];
    slopes[DRAG_X] = at.along * meridian.cosine - at.across * meridian.sine;
    slopes[DRAG_Y] = at.along * meridian.sine + at.across * meridian.cosine;
}

}  // namespace

TACTILE_WIDE void press_dome(const DomeLibrary& library, const DomeMarkers& markers, const double* presses, int n, double* moved) {
    std::fill(moved, moved + 3 * markers.count, 0.0);
    for (int p = 0; p < n; ++p) {
        const Meridian meridian = meridian_of(library, presses + p * PRESS);
        const Fields<1> fields(library, presses + p * PRESS, meridian);
        Spot spot;
        for (std::int64_t k = 0; k < markers.count; ++k) {
            if (!find_spot(library, meridian, markers.points + 3 * k, spot)) continue;
            double local[3];
            for (int axis = 0; axis < 3; ++axis) local[axis] = AtSpot<1>(library, fields, spot, axis).field[VALUE];
            moved[3 * k] += meridian.cosine * local[0] - meridian.sine * local[1];
            moved[3 * k + 1] += meridian.sine * local[0] + meridian.cosine * local[1];
            moved[3 * k + 2] += local[2];
        }
    }
}

TACTILE_WIDE void press_dome_with_slopes(const DomeLibrary& library, const DomeMarkers& markers, const double* press, double* moved,
                                         double* slopes) {
    const Meridian meridian = meridian_of(library, press);
    const Fields<FIELDS> fields(library, press, meridian);
    std::fill(slopes, slopes + 3 * PRESS * markers.count, 0.0);
    Spot spot;
    for (std::int64_t k = 0; k < markers.count; ++k, slopes += 3 * PRESS) {
        if (!find_spot(library, meridian, markers.points + 3 * k, spot)) continue;
        double local[3], steep[3][PRESS];
        for (int axis = 0; axis < 3; ++axis) {
            const AtSpot<FIELDS> at(library, fields, spot, axis);
            local[axis] = at.field[VALUE];
            chain(meridian, spot, at, steep[axis]);
        }
        const double x = meridian.cosine * local[0] - meridian.sine * local[1];
        const double y = meridian.sine * local[0] + meridian.cosine * local[1];
        moved[3 * k] += x, moved[3 * k + 1] += y, moved[3 * k + 2] += local[2];
        for (int number = 0; number < PRESS; ++number) {
            slopes[3 * number] = meridian.cosine * steep[0][number] - meridian.sine * steep[1][number];
            slopes[3 * number + 1] = meridian.sine * steep[0][number] + meridian.cosine * steep[1][number];
            slopes[3 * number + 2] = steep[2][number];
        }
        const double turn_x = -meridian.sine / meridian.away, turn_y = meridian.cosine / meridian.away;  // of the frame, by the place
        slopes[3 * X] -= y * turn_x, slopes[3 * X + 1] += x * turn_x;
        slopes[3 * Y] -= y * turn_y, slopes[3 * Y + 1] += x * turn_y;
    }
}

}  // namespace tactile
