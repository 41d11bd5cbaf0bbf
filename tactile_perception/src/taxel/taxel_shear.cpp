// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The pad's surface as coupled bristles with friction.
//
// An element that is displaced by u, its neighbours by v, feels the traction over shear stiffness t = u + coupling sum(u - v). It follows
// the object while |t| stays within friction times pressure over shear stiffness; beyond that t is cut to that length, and the element
// slips. The displacements are the fixed point of this rule, found by successive over-relaxation.
#include "taxel/taxel_shear.hpp"

#include <algorithm>
#include <cmath>

#include "common/grid.hpp"

namespace tactile {
namespace {

constexpr int SWEEPS = 12;          // most a frame. Chosen: continued in the next one
constexpr float RELAXATION = 1.4f;  // Derived: best for a coupling of 2, whose slowest mode Jacobi's method shrinks by 8/9
constexpr float CONVERGED = 1e-8f;  // m, largest change in a sweep. Chosen: a hundred thousandth of a taxel of 1 mm
constexpr float TINY = 1e-12f;      // m, against a division by zero

// One field of the box with a margin of one element that repeats its border.
class Field {
 public:
    Field(std::ptrdiff_t rows, std::ptrdiff_t columns) : stride(columns + 2), values((rows + 2) * stride), rows_(rows), columns_(columns) {}
    float* row(std::ptrdiff_t r) { return values.data() + (r + 1) * stride + 1; }
    const float* row(std::ptrdiff_t r) const { return values.data() + (r + 1) * stride + 1; }
    void repeat_border() {
        for (std::ptrdiff_t r = 0; r < rows_; ++r) {
            row(r)[-1] = row(r)[0];
            row(r)[columns_] = row(r)[columns_ - 1];
        }
        std::copy(row(0), row(0) + columns_, row(-1));
        std::copy(row(rows_ - 1), row(rows_ - 1) + columns_, row(rows_));
    }
    const std::ptrdiff_t stride;
    std::vector<float> values;

 private:
    const std::ptrdiff_t rows_, columns_;
};

// The box of a contact with what the relaxation needs there.
class Contact {
 public:
    Contact(const ShearPad& pad, const Box& box, const float* drag, const std::uint8_t* touched, const float* pressure, const Shift& shift)
        : rows_(box.rows()),
          columns_(box.columns()),
          coupling_(static_cast<float>(pad.coupling)),
          stiff_(1 + 4 * coupling_),
          carried_{Field(rows_, columns_), Field(rows_, columns_)},
          drag_{carried_[0], carried_[1]},
          limit_(rows_ * columns_) {
        std::vector<float> smooth(rows_ * columns_);
        for (std::ptrdiff_t r = 0; r < rows_; ++r)
            std::copy_n(pressure + (box.top + r) * pad.columns + box.left, columns_, &smooth[r * columns_]);
        limit_ = smooth;
        blur(smooth, rows_, columns_, pad.sharp, Outside::replicated);
        const std::ptrdiff_t plane = pad.rows * pad.columns;
        for (std::ptrdiff_t r = 0; r < rows_; ++r) {
            const double y = pad.pitch * (static_cast<double>(box.top + r) - 0.5 * static_cast<double>(pad.rows - 1));
            for (std::ptrdiff_t c = 0; c < columns_; ++c) {
                const std::ptrdiff_t k = r * columns_ + c, at = (box.top + r) * pad.columns + box.left + c;
                const double x = pad.pitch * (static_cast<double>(box.left + c) - 0.5 * static_cast<double>(pad.columns - 1));
                const bool here = touched[at] != 0;
                carried_[0].row(r)[c] = drag[at] + (here ? static_cast<float>(shift.x - shift.turn * y) : 0);
                carried_[1].row(r)[c] = drag[plane + at] + (here ? static_cast<float>(shift.y + shift.turn * x) : 0);
                const float top = limit_[k] + static_cast<float>(pad.on_top) * (limit_[k] - smooth[k]);
                limit_[k] = here ? std::max(top, 0.0f) * static_cast<float>(pad.limit) : 0;
            }
        }
        for (int axis : {0, 1}) drag_[axis].values = carried_[axis].values;
    }

    void relax() {
        for (int sweep = 0; sweep < SWEEPS; ++sweep) {
            float largest = 0;
            for (int colour : {0, 1}) {
                for (Field& field : drag_) field.repeat_border();
                for (std::ptrdiff_t r = 0; r < rows_; ++r) largest = std::max(largest, relax_row(r, (r + colour) % 2));
            }
            if (!(largest > CONVERGED)) break;
        }
        for (Field& field : drag_) field.repeat_border();
    }

    // Displacement, traction and slip of one element.
    void read(std::ptrdiff_t r, std::ptrdiff_t c, bool here, float (&drag)[2], float (&pull)[2], float (&slip)[2]) const {
        float others[2];
        cut(r, c, others, pull);
        for (int axis : {0, 1}) {
            drag[axis] = (pull[axis] + others[axis]) / stiff_;
            slip[axis] = here ? carried_[axis].row(r)[c] - drag[axis] : 0;
        }
    }

 private:
    // Part of the neighbours, and the traction over shear stiffness, cut to what friction allows; whether it was cut.
    bool cut(std::ptrdiff_t r, std::ptrdiff_t c, float (&others)[2], float (&pull)[2]) const {
        for (int axis : {0, 1}) {
            const Field& field = drag_[axis];
            const float* here = field.row(r) + c;
            others[axis] = coupling_ * (here[-field.stride] + here[field.stride] + here[-1] + here[1]);
            pull[axis] = stiff_ * carried_[axis].row(r)[c] - others[axis];
        }
        const float length = std::sqrt(pull[0] * pull[0] + pull[1] * pull[1]) + TINY, share = limit_[r * columns_ + c] / length;
        if (!(share < 1)) return false;
        for (float& part : pull) part *= share;
        return true;
    }

    float relax_row(std::ptrdiff_t r, std::ptrdiff_t first) {
        float largest = 0;
        for (std::ptrdiff_t c = first; c < columns_; c += 2) {
            float others[2], pull[2];
            const float relaxation = cut(r, c, others, pull) ? RELAXATION : 1;  // what sticks goes where the object goes
            for (int axis : {0, 1}) {
                float& here = drag_[axis].row(r)[c];
                const float change = (pull[axis] + others[axis]) / stiff_ - here;
                here += relaxation * change;
                largest = std::max(largest, std::abs(change));
            }
        }
        return largest;
    }

    const std::ptrdiff_t rows_, columns_;
    const float coupling_, stiff_;
    Field carried_[2], drag_[2];
    std::vector<float> limit_;
};

}  // namespace

Sheared moved(const ShearPad& pad, const float* drag, const std::uint8_t* touched, const float* pressure, const Shift& shift) {
    const std::ptrdiff_t plane = pad.rows * pad.columns;
    Sheared found{std::vector<float>(2 * plane), std::vector<float>(2 * plane), std::vector<float>(2 * plane)};
    const auto margin = std::max<std::ptrdiff_t>(1, std::lround(pad.thickness));
    const Box inside = box_around(touched, pad.rows, pad.columns);
    if (inside.rows() == 0) return found;
    const Box box = inside.grown(margin, pad.rows, pad.columns);
    Contact contact(pad, box, drag, touched, pressure, shift);
    contact.relax();
    for (std::ptrdiff_t r = 0; r < box.rows(); ++r) {
        for (std::ptrdiff_t c = 0; c < box.columns(); ++c) {
            const std::ptrdiff_t at = (box.top + r) * pad.columns + box.left + c;
            float one[3][2];
            contact.read(r, c, touched[at] != 0, one[0], one[1], one[2]);
            for (int axis : {0, 1}) {
                found.drag[axis * plane + at] = one[0][axis];
                found.pull[axis * plane + at] = one[1][axis];
                found.slip[axis * plane + at] = one[2][axis];
            }
        }
    }
    return found;
}

std::vector<float> pressure_of_pull(const float* pull, std::ptrdiff_t rows, std::ptrdiff_t columns, double gain,
                                    const Spread (&spreads)[2]) {
    std::vector<float> found(rows * columns);
    const float *along = pull, *across = pull + rows * columns;
    std::vector<std::uint8_t> pulled(rows * columns);
    for (std::ptrdiff_t k = 0; k < rows * columns; ++k) pulled[k] = along[k] != 0 || across[k] != 0;
    const Box inside = box_around(pulled.data(), rows, columns);
    if (inside.rows() == 0) return found;
    const auto reach = static_cast<std::ptrdiff_t>(std::ceil(4 * std::max(spreads[0].width, spreads[1].width))) + 1;
    const Box box = inside.grown(reach, rows, columns);
    std::vector<float> change(box.rows() * box.columns());
    const auto scale = static_cast<float>(gain);
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        float* out = &change[(r - box.top) * box.columns()] - box.left;
        const float *x = along + r * columns, *y = across + r * columns;
        for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(box.left, 1); c < std::min(box.right, columns - 1); ++c)
            out[c] += scale * (x[c - 1] - x[c + 1]);
        if (r == 0 || r == rows - 1) continue;
        for (std::ptrdiff_t c = box.left; c < box.right; ++c) out[c] += scale * (y[c - columns] - y[c + columns]);
    }
    for (const Spread& spread : spreads) {
        std::vector<float> wide = change;
        blur(wide, box.rows(), box.columns(), spread.width, Outside::zero);
        for (std::ptrdiff_t r = 0; r < box.rows(); ++r) {
            float* out = &found[(box.top + r) * columns + box.left];
            const float* in = &wide[r * box.columns()];
            for (std::ptrdiff_t c = 0; c < box.columns(); ++c) out[c] += static_cast<float>(spread.share) * in[c];
        }
    }
    return found;
}

}  // namespace tactile
