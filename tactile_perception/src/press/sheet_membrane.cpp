// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Newton's method for a pressed sheet. Energy per area over shear modulus times thickness: (|a|^2 + |b|^2 + s^-6 / |a x b|^2) / 2 with
// a, b the derivatives of the position by x and y and s the prestretch (incompressible neo-Hookean membrane; Holzapfel, Nonlinear
// Solid Mechanics, 6.5), plus bending (Laplacian)^2 / 2. Contact by penalty, friction by return mapping (Wriggers, Computational Contact
// Mechanics, 5.2 and 10.5).
#include "press/sheet_membrane.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/band_matrix.hpp"

namespace tactile {
namespace {

// Each constant with its unit, origin and meaning.
constexpr struct MembraneConstants {
    double contact_stiffness = 4e7;      // 1/m^3, numeric: penalty of contact; penetration is a few micrometres
    double stick_stiffness = 4e7;        // 1/m^3, numeric: penalty of sticking friction
    double contact_half_width = 10e-6;   // m, numeric: of the transition into contact, which smooths the penalty
    int max_steps = 40;                  // 1, numeric: Newton steps before the load step is halved
    int max_halvings = 6;                // 1, numeric: of a load step
    int max_sliding_steps = 14;          // 1, limit: Newton steps of a tip that slides; if it takes more, the sheet has wrinkled
    int max_sliding_halvings = 3;        // 1, limit: the same of a load step
    int full_steps = 9;                  // 1, numeric: first Newton steps in full length; halving later ones ends cycles of stick and slip
    double max_step = 1.5e-3;            // m, numeric: of Newton's method
    double wrinkle_step = 4e-3;          // m, limit: after a larger Newton step of a tip that slides, the sheet has wrinkled
    double max_last_step = 1e-6;         // m, numeric: a smaller Newton step is the last: far below the noise of a marker
    // After a Newton step of less than reuse_step the next ones reuse its derivatives, among the first reuse_rounds (later ones may cycle),
    // while each is at most reuse_shrinkage times the one before. Then one of less than max_last_step_reused is the last: the force is as
    // exact.
    double reuse_step = 5e-5;            // m, numeric
    double reuse_shrinkage = 0.2;        // 1, numeric
    double max_last_step_reused = 2e-8;  // m, numeric
    int reuse_rounds = 6;                // 1, numeric
} MEMBRANE;

constexpr int POINTS = 4, SPLINES = 9;

using Vector = Eigen::Vector3d;
using Matrix = Eigen::Matrix3d;
using Values = Eigen::Matrix<double, SPLINES, 1>;                         // of an element's splines at a point
using ElementField = Eigen::Matrix<double, SPLINES, 3, Eigen::RowMajor>;  // of an element's splines
// Products of two functions for each pair (i, j) of an element's splines, at 9 i + j; the margin makes whole vectors.
using Products = Eigen::Array<float, 84, 1>;
// Stiffness of an element by the displacement of its splines, by components k and l of force and displacement.
using ElementMatrix = Products[3][3];

// Stress of the membrane's energy by its edges a and b, and the tangent: its derivative of part e by part f.
struct Membrane {
    Vector stress[2];
    Matrix tangent[2][2];

    Membrane(const Vector& a, const Vector& b, double squeeze) {
        const double aa = a.squaredNorm(), bb = b.squaredNorm(), ab = a.dot(b), area = aa * bb - ab * ab;
        const double first = squeeze / (area * area), second = 4 * first / area;
        const Vector by[2] = {bb * a - ab * b, aa * b - ab * a};  // half the derivative of the squared area
        const Matrix one = Matrix::Identity();
        stress[0] = a - first * by[0], stress[1] = b - first * by[1];
        tangent[0][0] = (1 - first * bb) * one + first * b * b.transpose() + second * by[0] * by[0].transpose();
        tangent[1][1] = (1 - first * aa) * one + first * a * a.transpose() + second * by[1] * by[1].transpose();
        tangent[0][1] = first * (ab * one + b * a.transpose() - 2 * a * b.transpose()) + second * by[0] * by[1].transpose();
        tangent[1][0] = tangent[0][1].transpose();
    }
};

// State of a point of the sheet in the last equilibrium: whether the tip held it, and where on the tip.
struct Grip {
    bool on = false;
    Vector anchor = Vector::Zero();
};

// Contact at a point: its force on the tip, the derivative of that by the point's position, its pressure, and its new state.
struct Touch {
    Vector force;
    Matrix tangent;
    double pressure;
    Grip grip;
};

// Friction of a point that the tip holds at grip: sticking as a spring, or slipping at the Coulomb limit.
void hold(const SheetLoad& load, const Grip& grip, const Vector& offset, const Vector& normal, double stiff, Touch& touch) {
    Vector slid = grip.on ? Vector(offset - grip.anchor) : Vector::Zero();
    slid -= slid.dot(normal) * normal;
    const double amount = slid.norm(), limit = load.friction * touch.pressure;
    const bool slips = MEMBRANE.stick_stiffness * amount > limit;
    const double part = slips ? limit / (MEMBRANE.stick_stiffness * amount) : 1.0;
    touch.force += MEMBRANE.stick_stiffness * part * slid;
    touch.grip.anchor = offset - part * slid;
    if (grip.on) touch.tangent += MEMBRANE.stick_stiffness * part * (Matrix::Identity() - normal * normal.transpose());
    const Vector along = slid / std::max(amount, 1e-30);
    if (!slips) return;
    touch.tangent -= MEMBRANE.stick_stiffness * part * along * along.transpose() + load.friction * stiff * along * normal.transpose();
}

// Traction of a point on which the tip slides: drag times the pressure. While the tip and the sheet's shape move, a point of the sheet
// moves to the position of the next one: the slip is along the line on the surface whose projection has the direction of drag.
void slide(const SheetLoad& load, const Vector& normal, double distance, double stiff, Touch& touch) {
    const double ratio = std::hypot(load.drag[0], load.drag[1]), down = std::min(normal[2], -0.1);
    if (!(ratio > 0)) return;
    const double x = load.drag[0] / ratio, y = load.drag[1] / ratio, rise = -(x * normal[0] + y * normal[1]) / down;
    const double length = std::sqrt(1 + rise * rise);
    const Vector tangent(x, y, rise), along = tangent / length;
    touch.force -= ratio * touch.pressure * along;
    const Matrix turn = (Matrix::Identity() - normal * normal.transpose()) / distance;  // of the normal by the position
    const Eigen::RowVector3d steeper = -(tangent.transpose() * turn) / down;            // of rise by the position
    const Matrix swing = (Vector::UnitZ() / length - along * (rise / (length * length))) * steeper;
    touch.tangent += ratio * (stiff * along * normal.transpose() - touch.pressure * swing);
}

// Contact of a point at offset, m, from the tip's centre; false where it is free.
bool touches(const SheetLoad& load, const Grip& grip, const Vector& offset, Touch& touch) {
    const double distance = offset.norm(), depth = load.radius + MEMBRANE.contact_half_width - distance;
    if (!(depth > 0) || !(distance > 0)) return false;
    const Vector normal = offset / distance;
    const double whole = MEMBRANE.contact_stiffness, width = MEMBRANE.contact_half_width;
    const double stiff = whole * std::min(depth / (2 * width), 1.0);
    touch.pressure = depth < 2 * width ? stiff * depth / 2 : whole * (depth - width);
    touch.grip = Grip{true, offset}, touch.force = -touch.pressure * normal;
    const Matrix across = normal * normal.transpose();
    touch.tangent = stiff * across - touch.pressure / distance * (Matrix::Identity() - across);
    if (load.slides)
        slide(load, normal, distance, stiff, touch);
    else
        hold(load, grip, offset, normal, stiff, touch);
    return true;
}

Products product(const Values& a, const Values& b) {
    Products found = Products::Zero();
    for (int i = 0; i < SPLINES; ++i) found.segment<SPLINES>(SPLINES * i) = (a[i] * b).cast<float>().array();
    return found;
}

class Press {
 public:
    Press(const SheetElements& sheet, const SheetLoad& load)
        : sheet_(sheet),
          load_(load),
          squeeze_(std::pow(load.prestretch, -6)),
          side_(sheet.spans + 2),
          inner_(sheet.spans),
          matrix_(3 * inner_ * inner_, 3 * (2 * inner_ + 2) + 2),
          residual_(matrix_.size()),
          u_(3 * side_ * side_, 0.0),
          last_(u_),
          grips_(sheet.spans * sheet.spans * POINTS),
          next_(grips_.size()) {}

    const std::vector<double>& displacement() const { return u_; }
    const double* wrench() const { return wrench_; }

    // Load step to depth from an extrapolated start, or in two halves; false where it does not converge.
    bool reach(double depth, int halvings) {
        const std::vector<double> start = u_;
        const double at = depth_;
        if (at > before_) {
            const double ratio = std::min((depth - at) / (at - before_), 2.0);
            for (std::size_t k = 0; k < u_.size(); ++k) u_[k] += (start[k] - last_[k]) * ratio;
        }
        if (settle(depth)) {
            last_ = start, before_ = at, depth_ = depth;
            return true;
        }
        u_ = start;
        return halvings > 0 && reach((at + depth) / 2, halvings - 1) && reach(depth, halvings - 1);
    }

 private:
    // Newton's method for equilibrium at depth; false where it does not converge.
    bool settle(double depth) {
        bool refactor = true;
        double before = INFINITY;
        for (int turn = 0; turn < (load_.slides ? MEMBRANE.max_sliding_steps : MEMBRANE.max_steps); turn += refactor) {
            balance(depth, refactor);
            if (refactor && !matrix_.factor()) return false;
            matrix_.solve(residual_.data());
            double largest = 0;
            for (const double step : residual_) largest = std::isfinite(step) ? std::max(largest, std::abs(step)) : INFINITY;
            if (!std::isfinite(largest) || (load_.slides && largest > MEMBRANE.wrinkle_step)) return false;
            const double length = std::min(turn < MEMBRANE.full_steps ? 1.0 : 0.5, MEMBRANE.max_step / std::max(largest, 1e-12));
            for (std::ptrdiff_t i = 0; i < inner_; ++i)
                for (std::ptrdiff_t j = 0; j < 3 * inner_; ++j) u_[3 * ((i + 1) * side_ + 1) + j] -= length * residual_[3 * i * inner_ + j];
            if (largest < (refactor ? MEMBRANE.max_last_step : MEMBRANE.max_last_step_reused)) {
                balance(depth, false);  // forces and grips of the last displacement
                grips_ = next_;
                return true;
            }
            refactor = !(turn < MEMBRANE.reuse_rounds && largest < MEMBRANE.reuse_step && largest < MEMBRANE.reuse_shrinkage * before);
            before = largest;
        }
        return false;
    }

    // Residual force and, where wanted, its derivative by the displacement of the splines that are free.
    void balance(double depth, bool derivative) {
        const Vector tip(load_.position[0], load_.position[1], -depth);
        if (derivative) matrix_.clear();
        std::fill(residual_.begin(), residual_.end(), 0.0);
        std::fill(wrench_, wrench_ + PRESS_WRENCH, 0.0);
        double pressed = 0;
        for (std::ptrdiff_t row = 0; row < sheet_.spans; ++row)
            for (std::ptrdiff_t column = 0; column < sheet_.spans; ++column) pressed += add_element(row, column, tip, derivative);
        for (int k = 6; k < PRESS_WRENCH && pressed > 0; ++k) wrench_[k] /= pressed;
    }

    // Returns the pressure times area.
    double add_element(std::ptrdiff_t row, std::ptrdiff_t column, const Vector& tip, bool derivative) {
        const std::ptrdiff_t e = row * sheet_.spans + column;
        ElementField u, force = ElementField::Zero();
        for (int i = 0; i < SPLINES; ++i)
            u.row(i) = Eigen::Map<const Eigen::RowVector3d>(&u_[3 * ((row + i / 3) * side_ + column + i % 3)]);
        ElementMatrix stiffness;
        if (derivative)
            for (auto& part : stiffness) std::fill(part, part + 3, Products::Zero());
        double pressed = 0;
        for (int g = 0; g < POINTS; ++g) {
            add_membrane(e * POINTS + g, u, force, derivative ? stiffness : nullptr);
            pressed += add_contact(e * POINTS + g, u, tip, force, derivative ? stiffness : nullptr);
        }
        scatter(row, column, force, derivative ? stiffness : nullptr);
        return pressed;
    }

    void add_membrane(std::ptrdiff_t point, const ElementField& u, ElementField& force, Products (*stiffness)[3]) {
        const double* slope = sheet_.slope.data() + point * 2 * SPLINES;
        const Eigen::Map<const Values> by[2] = {Eigen::Map<const Values>(slope), Eigen::Map<const Values>(slope + SPLINES)};
        const Eigen::Map<const Values> laplacian(sheet_.laplacian.data() + point * SPLINES);
        const double weight = sheet_.weight[point], bending = weight * load_.bending;
        const Membrane at(Vector::UnitX() + u.transpose() * by[0], Vector::UnitY() + u.transpose() * by[1], squeeze_);
        force += weight * (by[0] * at.stress[0].transpose() + by[1] * at.stress[1].transpose());
        force += bending * laplacian * (laplacian.transpose() * u);
        if (!stiffness) return;
        const Products xx = product(by[0], by[0]), xy = product(by[0], by[1]), yx = product(by[1], by[0]), yy = product(by[1], by[1]);
        const Products curve = static_cast<float>(bending) * product(laplacian, laplacian);
        for (int k = 0; k < 3; ++k) {
            for (int l = 0; l < 3; ++l) {
                const auto share = [&](int e, int f) { return static_cast<float>(weight * at.tangent[e][f](k, l)); };
                stiffness[k][l] += (share(0, 0) * xx + share(0, 1) * xy) + (share(1, 0) * yx + share(1, 1) * yy);
            }
            stiffness[k][k] += curve;
        }
    }

    // Returns the pressure times area.
    double add_contact(std::ptrdiff_t point, const ElementField& u, const Vector& tip, ElementField& force, Products (*stiffness)[3]) {
        const Eigen::Map<const Values> value(sheet_.value.data() + point * SPLINES);
        const double weight = sheet_.weight[point];
        const Vector arm = Vector(sheet_.rest[2 * point], sheet_.rest[2 * point + 1], 0.0) - tip + u.transpose() * value;
        Touch touch;
        next_[point] = Grip{};
        if (!touches(load_, grips_[point], arm - load_.radius * Vector::UnitZ(), touch)) return 0;
        next_[point] = touch.grip;
        Eigen::Map<Eigen::Matrix3d> wrench(wrench_);  // columns: force, moment, centre
        wrench.col(0) -= weight * touch.force, wrench.col(1) -= weight * arm.cross(touch.force);
        wrench.col(2) += weight * touch.pressure * arm;
        force += weight * value * touch.force.transpose();
        if (stiffness) {
            const Products both = product(value, value);
            for (int k = 0; k < 3; ++k)
                for (int l = 0; l < 3; ++l) stiffness[k][l] += static_cast<float>(weight * touch.tangent(k, l)) * both;
        }
        return weight * touch.pressure;
    }

    // Adds an element's forces and stiffness to those of the sheet's free splines.
    void scatter(std::ptrdiff_t row, std::ptrdiff_t column, const ElementField& force, const Products (*stiffness)[3]) {
        std::ptrdiff_t number[SPLINES];
        for (int i = 0; i < SPLINES; ++i) {
            const std::ptrdiff_t a = row + i / 3 - 1, b = column + i % 3 - 1;
            number[i] = a >= 0 && a < inner_ && b >= 0 && b < inner_ ? 3 * (a * inner_ + b) : -1;
        }
        for (int i = 0; i < SPLINES; ++i) {
            for (int k = 0; k < 3 && number[i] >= 0; ++k) {
                residual_[number[i] + k] += force(i, k);
                if (!stiffness) continue;
                float* target = matrix_.row(number[i] + k);
                for (int j = 0; j < SPLINES; ++j)
                    for (int l = 0; l < 3 && number[j] >= 0; ++l) target[number[j] + l] += stiffness[k][l][SPLINES * i + j];
            }
        }
    }

    const SheetElements& sheet_;
    const SheetLoad& load_;
    const double squeeze_;
    std::ptrdiff_t side_, inner_;  // splines, and free ones, along each axis
    BandMatrix matrix_;
    std::vector<double> residual_, u_, last_;
    std::vector<Grip> grips_, next_;
    double depth_ = 0, before_ = 0, wrench_[PRESS_WRENCH] = {};
};

}  // namespace

PressedSheets press_sheet(const SheetElements& sheet, const SheetLoad& load, const std::vector<double>& depths) {
    Press press(sheet, load);
    const std::size_t size = press.displacement().size();
    PressedSheets found{std::vector<double>(depths.size() * size, NAN), std::vector<double>(depths.size() * PRESS_WRENCH, NAN)};
    const int halvings = load.slides ? MEMBRANE.max_sliding_halvings : MEMBRANE.max_halvings;
    for (std::size_t k = 0; k < depths.size() && press.reach(depths[k], halvings); ++k) {
        std::copy_n(press.displacement().data(), size, &found.fields[k * size]);
        std::copy_n(press.wrench(), PRESS_WRENCH, &found.wrenches[k * PRESS_WRENCH]);
    }
    return found;
}

}  // namespace tactile
