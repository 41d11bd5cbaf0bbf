// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The pad's surface as coupled bristles with friction.
//
// An element that is displaced by u, its neighbours by v, feels the traction over shear stiffness t = u + coupling sum(u - v). It follows
// the object while |t| stays within friction times pressure over shear stiffness; beyond that t is cut to that length, and the element
// slips. The displacements are the fixed point of this rule, found by successive over-relaxation.
#include "taxel/shear.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "common/grid.hpp"
#include "common/wide.hpp"
#include "taxel/constants.hpp"

namespace tactile::taxel {
namespace {

constexpr float TINY = 1e-12f;  // m, against a division by zero

// Pressure under a bonded layer (linear elasticity, Poisson ratios of 0.3 to 0.49, which hardly matter) by traction on it, over that of a
// thin layer (thickness times convergence of traction), as a function of wave number times thickness: within 0.03 two Gaussians.
struct Spread {
    double share, width;  // width over thickness
};
constexpr Spread SPREADS[] = {{0.47, 0.62}, {0.53, 1.85}};

// One field of the box with a margin of one element that repeats its border. Even and odd columns of a row stand apart: the relaxation
// takes every other element, and finds those side by side.
class Field {
 public:
    Field(std::ptrdiff_t rows, std::ptrdiff_t columns)
        : rows_(rows), columns_(columns), length_(columns / 2 + 2), values_((rows + 2) * 2 * length_) {}
    // Columns odd, odd + 2, ... of a row; -1 is the column left of the first one.
    float* half(std::ptrdiff_t r, std::ptrdiff_t odd) { return values_.data() + (2 * (r + 1) + odd) * length_ + 1; }
    const float* half(std::ptrdiff_t r, std::ptrdiff_t odd) const { return values_.data() + (2 * (r + 1) + odd) * length_ + 1; }
    float& at(std::ptrdiff_t r, std::ptrdiff_t c) { return half(r, c % 2)[c / 2]; }
    void repeat_border() {
        for (std::ptrdiff_t r = 0; r < rows_; ++r) {
            half(r, 1)[-1] = at(r, 0);
            at(r, columns_) = at(r, columns_ - 1);
        }
        std::copy_n(half(0, 0) - 1, 2 * length_, half(-1, 0) - 1);
        std::copy_n(half(rows_ - 1, 0) - 1, 2 * length_, half(rows_, 0) - 1);
    }

 private:
    std::ptrdiff_t rows_, columns_, length_;
    std::vector<float> values_;
};

// What presses on the pad: images of what touches and of pressure; limit: displacement over pressure up to which friction holds.
struct Pressed {
    const std::uint8_t* touched;
    const float* pressure;
    double limit;
};

// The box of a contact with what the relaxation needs there.
class Contact {
 public:
    Contact(const ShearPad& pad, const Box& box, const float* drag, const Pressed& load, const Shift& shift)
        : rows_(box.rows()),
          columns_(box.columns()),
          coupling_(static_cast<float>(TAXEL.coupling * pad.thickness * pad.thickness)),
          stiff_(1 + 4 * coupling_),
          carried_{Field(rows_, columns_), Field(rows_, columns_)},
          drag_{carried_[0], carried_[1]},
          limit_(rows_, columns_) {
        constexpr auto ON_TOP = static_cast<float>(2 * TAXEL.flattening / (TAXEL.unsharp_width * TAXEL.unsharp_width));
        std::vector<float> smooth(rows_ * columns_);
        for (std::ptrdiff_t r = 0; r < rows_; ++r)
            std::copy_n(load.pressure + (box.top + r) * pad.columns + box.left, columns_, &smooth[r * columns_]);
        const std::vector<float> seen = smooth;
        blur(smooth, rows_, columns_, TAXEL.unsharp_width * pad.thickness, Outside::replicated);
        const std::ptrdiff_t plane = pad.rows * pad.columns;
        for (std::ptrdiff_t r = 0; r < rows_; ++r) {
            const double y = pad.pitch * (static_cast<double>(box.top + r) - 0.5 * static_cast<double>(pad.rows - 1));
            for (std::ptrdiff_t c = 0; c < columns_; ++c) {
                const std::ptrdiff_t k = r * columns_ + c, at = (box.top + r) * pad.columns + box.left + c;
                const double x = pad.pitch * (static_cast<double>(box.left + c) - 0.5 * static_cast<double>(pad.columns - 1));
                const bool here = load.touched[at] != 0;
                carried_[0].at(r, c) = drag[at] + (here ? static_cast<float>(shift.x - shift.turn * y) : 0);
                carried_[1].at(r, c) = drag[plane + at] + (here ? static_cast<float>(shift.y + shift.turn * x) : 0);
                const float top = seen[k] + ON_TOP * (seen[k] - smooth[k]);
                limit_.at(r, c) = here ? std::max(top, 0.0f) * static_cast<float>(load.limit) : 0;
            }
        }
        for (int axis : {0, 1}) drag_[axis] = carried_[axis];
    }

    void relax() {
        bool moves = true;
        for (int sweep = 0; sweep < TAXEL.shear_sweeps && moves; ++sweep) {
            moves = false;
            for (int colour : {0, 1}) {
                for (Field& field : drag_) field.repeat_border();
                for (std::ptrdiff_t r = 0; r < rows_; ++r) moves |= relax_row(r, (r + colour) % 2);
            }
        }
        for (Field& field : drag_) field.repeat_border();
    }

    // Displacement, traction and slip along both axes of every other element of a row: in[6] of (columns + 1 - odd) / 2.
    TACTILE_WIDE void read(std::ptrdiff_t r, std::ptrdiff_t odd, float* const (&in)[6]) const {
        const Line x = line(0, r, odd), y = line(1, r, odd);
        const float* limit = limit_.half(r, odd);
        float *drag_x = in[0], *drag_y = in[1], *pull_x = in[2], *pull_y = in[3], *slip_x = in[4], *slip_y = in[5];
#pragma GCC ivdep
        for (std::ptrdiff_t k = 0; k < (columns_ + 1 - odd) / 2; ++k) {
            const Traction traction = tractions(x, y, limit, k);
            pull_x[k] = traction.pull[0];
            pull_y[k] = traction.pull[1];
            drag_x[k] = (traction.pull[0] + traction.others[0]) / stiff_;
            drag_y[k] = (traction.pull[1] + traction.others[1]) / stiff_;
            slip_x[k] = x.carried[k] - drag_x[k];
            slip_y[k] = y.carried[k] - drag_y[k];
        }
    }

 private:
    // Every other element of a row, its neighbours, and where it is if it sticks; along one axis.
    struct Line {
        const float *here, *above, *below, *left, *right, *carried;
    };
    Line line(int axis, std::ptrdiff_t r, std::ptrdiff_t odd) const {
        const Field& field = drag_[axis];
        const float* between = field.half(r, 1 - odd) + odd;
        return {field.half(r, odd), field.half(r - 1, odd), field.half(r + 1, odd), between - 1, between, carried_[axis].half(r, odd)};
    }

    // Part of the neighbours, and the traction over shear stiffness, cut to what friction allows; whether it was cut.
    struct Traction {
        float others[2], pull[2];
        bool cut;
    };
    TACTILE_INLINE Traction tractions(const Line& x, const Line& y, const float* limit, std::ptrdiff_t k) const {
        const float along = coupling_ * (x.above[k] + x.below[k] + x.left[k] + x.right[k]);
        const float across = coupling_ * (y.above[k] + y.below[k] + y.left[k] + y.right[k]);
        const float pull_x = stiff_ * x.carried[k] - along, pull_y = stiff_ * y.carried[k] - across;
        const float share = limit[k] / (std::sqrt(pull_x * pull_x + pull_y * pull_y) + TINY);
        const float left = share < 1 ? share : 1;
        return {{along, across}, {left * pull_x, left * pull_y}, share < 1};
    }

    // Whether any element still moves.
    TACTILE_WIDE bool relax_row(std::ptrdiff_t r, std::ptrdiff_t odd) {
        const std::ptrdiff_t count = (columns_ + 1 - odd) / 2;
        const Line x = line(0, r, odd), y = line(1, r, odd);
        const float* limit = limit_.half(r, odd);
        float *drag_x = drag_[0].half(r, odd), *drag_y = drag_[1].half(r, odd);
        int moves = 0;
#pragma GCC ivdep
        for (std::ptrdiff_t k = 0; k < count; ++k) {
            const Traction traction = tractions(x, y, limit, k);
            const float relaxation = traction.cut ? TAXEL.relaxation : 1;  // elements that stick follow the object
            const float change_x = (traction.pull[0] + traction.others[0]) / stiff_ - x.here[k];
            const float change_y = (traction.pull[1] + traction.others[1]) / stiff_ - y.here[k];
            drag_x[k] = x.here[k] + relaxation * change_x;
            drag_y[k] = y.here[k] + relaxation * change_y;
            moves |= (std::abs(change_x) > TAXEL.shear_step) | (std::abs(change_y) > TAXEL.shear_step);
        }
        return moves != 0;
    }

    const std::ptrdiff_t rows_, columns_;
    const float coupling_, stiff_;
    Field carried_[2], drag_[2], limit_;
};

}  // namespace

SurfaceShear::SurfaceShear(const ShearPad& pad) : pad_(pad) {
    reset();
}

void SurfaceShear::reset() {
    drag_.assign(2 * pad_.rows * pad_.columns, 0);
    pull_ = drag_;
}

std::vector<float> SurfaceShear::move(const std::uint8_t* touched, const float* pressure, const Shift& shift) {
    const std::ptrdiff_t plane = pad_.rows * pad_.columns;
    std::vector<float> drag(2 * plane), pull(2 * plane), slip(2 * plane);
    const Box inside = box_around(touched, pad_.rows, pad_.columns);
    if (inside.rows() > 0) {
        const Box box = inside.grown(std::max<std::ptrdiff_t>(1, std::lround(pad_.thickness)), pad_.rows, pad_.columns);
        Contact contact(pad_, box, drag_.data(), {touched, pressure, pad_.friction / pad_.stiffness}, shift);
        contact.relax();
        const std::ptrdiff_t length = box.columns() / 2 + 1;
        std::vector<float> half(6 * length);
        float* in[6];
        for (int k = 0; k < 6; ++k) in[k] = &half[k * length];
        for (std::ptrdiff_t r = 0; r < box.rows(); ++r) {
            for (std::ptrdiff_t odd : {0, 1}) {
                contact.read(r, odd, in);
                const std::ptrdiff_t first = (box.top + r) * pad_.columns + box.left + odd;
                for (std::ptrdiff_t k = 0; k < (box.columns() + 1 - odd) / 2; ++k) {
                    const std::ptrdiff_t at = first + 2 * k;
                    for (int axis : {0, 1}) {
                        drag[axis * plane + at] = in[axis][k];
                        pull[axis * plane + at] = in[2 + axis][k];
                        slip[axis * plane + at] = touched[at] ? in[4 + axis][k] : 0;
                    }
                }
            }
        }
    }
    drag_ = std::move(drag);
    pull_ = std::move(pull);
    return slip;
}

std::array<double, 2> SurfaceShear::force() const {
    const auto middle = pull_.begin() + pad_.rows * pad_.columns;
    const double unit = pad_.stiffness * pad_.pitch * pad_.pitch;
    return {unit * std::accumulate(pull_.begin(), middle, 0.0), unit * std::accumulate(middle, pull_.end(), 0.0)};
}

std::vector<float> SurfaceShear::traction_pressure() const {
    return pressure_of(pull_.data(), pad_.stiffness);
}

std::vector<float> SurfaceShear::pressure_of(const float* traction, double unit) const {
    const std::ptrdiff_t rows = pad_.rows, columns = pad_.columns;
    std::vector<float> found(rows * columns);
    const float *along = traction, *across = traction + rows * columns;
    std::vector<std::uint8_t> pulled(rows * columns);
    for (std::ptrdiff_t k = 0; k < rows * columns; ++k) pulled[k] = (along[k] != 0) | (across[k] != 0);
    const Box inside = box_around(pulled.data(), rows, columns);
    if (inside.rows() == 0) return found;
    const Box box = inside.grown(static_cast<std::ptrdiff_t>(std::ceil(4 * SPREADS[1].width * pad_.thickness)) + 1, rows, columns);
    std::vector<float> change(box.rows() * box.columns());
    const auto scale = static_cast<float>(0.5 * pad_.thickness * unit);
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        float* out = &change[(r - box.top) * box.columns()] - box.left;
        const float *x = along + r * columns, *y = across + r * columns;
        for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(box.left, 1); c < std::min(box.right, columns - 1); ++c)
            out[c] += scale * (x[c - 1] - x[c + 1]);
        if (r == 0 || r == rows - 1) continue;
        for (std::ptrdiff_t c = box.left; c < box.right; ++c) out[c] += scale * (y[c - columns] - y[c + columns]);
    }
    for (const Spread& spread : SPREADS) {
        std::vector<float> wide = change;
        blur(wide, box.rows(), box.columns(), spread.width * pad_.thickness, Outside::zero);
        for (std::ptrdiff_t r = 0; r < box.rows(); ++r) {
            float* out = &found[(box.top + r) * columns + box.left];
            const float* in = &wide[r * box.columns()];
            for (std::ptrdiff_t c = 0; c < box.columns(); ++c) out[c] += static_cast<float>(spread.share) * in[c];
        }
    }
    return found;
}

std::array<double, 2> SurfaceShear::pressure_centre(const float* pressure, const std::uint8_t* touched,
                                                    const std::array<double, 2>& friction) const {
    const std::ptrdiff_t rows = pad_.rows, columns = pad_.columns, plane = rows * columns;
    const double area = pad_.pitch * pad_.pitch;
    const std::array<double, 2> unknown{NAN, NAN};
    std::array<double, 3> sums{};  // N, and it times x and y, N m
    const auto add = [&](std::ptrdiff_t k, double value) {
        const double force = value * area;
        sums[0] += force;
        sums[1] += force * pad_.pitch * (static_cast<double>(k % columns) - 0.5 * static_cast<double>(columns - 1));
        sums[2] += force * pad_.pitch * (static_cast<double>(k / columns) - 0.5 * static_cast<double>(rows - 1));
    };
    const auto reach = std::min<std::ptrdiff_t>(std::lrint(TAXEL.surroundings * pad_.thickness), std::max(rows, columns));
    const auto near = spread_mask(touched, rows, columns, reach);
    for (std::ptrdiff_t k = 0; k < plane; ++k)
        if (near[k]) add(k, pressure[k]);
    const double load = sums[0];
    if (!(load > 0)) return unknown;
    if (!(std::hypot(friction[0], friction[1]) > TAXEL.min_friction * load)) return {sums[1] / load, sums[2] / load};
    const auto count = static_cast<double>(std::count_if(touched, touched + plane, [](std::uint8_t one) { return one != 0; }));
    std::vector<float> even(2 * plane);
    for (std::ptrdiff_t k = 0; k < plane; ++k)
        for (int axis : {0, 1}) even[axis * plane + k] = touched[k] ? static_cast<float>(friction[axis] / (count * area)) : 0;
    const std::vector<float> caused = pressure_of(even.data());
    for (std::ptrdiff_t k = 0; k < plane; ++k)
        if (!touched[k] && caused[k] < 0 && !(pressure[k] > -TAXEL.unseen_tension * caused[k])) add(k, caused[k]);
    if (!(sums[0] > 0)) return unknown;
    const double thickness = pad_.thickness * pad_.pitch;
    return {(sums[1] - thickness * friction[0]) / sums[0], (sums[2] - thickness * friction[1]) / sums[0]};
}

}  // namespace tactile::taxel
