// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Newton's method for a pressed sheet. Energy per area over shear modulus times thickness: (|a|^2 + |b|^2 + s^-6 / |a x b|^2) / 2 with
// a, b the derivatives of the position by x and y and s the prestretch (incompressible neo-Hookean membrane; Holzapfel, Nonlinear
// Solid Mechanics, 6.5), plus bending (Laplacian)^2 / 2. Contact by penalty, friction by return mapping (Wriggers, Computational Contact
// Mechanics, 5.2 and 10.5).
#include "press/sheet_membrane.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "common/band_matrix.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr double STIFF = 4e7;                            // 1/m^3, penalty stiffness of contact: penetration is a few micrometres
constexpr double STICK = 4e7;                            // 1/m^3, penalty stiffness of sticking friction. Chosen: as STIFF
constexpr double SOFT = 10e-6;                           // m: half width of the transition into contact, which smooths the penalty. Chosen
constexpr int SLIDING_STEPS = 14, SLIDING_HALVINGS = 3;  // of a tip that slides: where it takes more, the sheet has wrinkled. Chosen
constexpr int STEPS = 40;                                // Newton steps at most, before the load step is halved. Chosen
constexpr int WHOLE = 9;           // first Newton steps in full length; later ones are halved, which ends cycles of stick and slip. Chosen
constexpr int HALVINGS = 6;        // of a load step, at most. Chosen
constexpr double SETTLED = 1e-6;   // m: largest last Newton step. Chosen: far below the noise of a marker
constexpr double NEAR = 5e-5;      // m: after a smaller Newton step the next ones take the same derivative ...
constexpr int EARLY = 6;           // ... among the first so many ones (later ones may cycle) ...
constexpr double SHRINKS = 0.2;    // ... as long as each is at most this part of the one before ...
constexpr double FINAL = 2e-8;     // m: ... down to this, which tells the force as exactly as a Newton step of SETTLED. Chosen
constexpr double STRIDE = 1.5e-3;  // m: limit of a Newton step. Chosen
constexpr double LOST = 4e-3;      // m: after a larger Newton step of a tip that slides, the sheet has wrinkled. Chosen

constexpr int POINTS = 4, SPLINES = 9;

double dot(const double* a, const double* b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Stress (2, 3) and tangent (2, 3, 2, 3) of the membrane's energy by its edges a and b (2, 3).
void membrane(const double edges[2][3], double squeeze, double stress[2][3], double tangent[2][3][2][3]) {
    const double *a = edges[0], *b = edges[1];
    const double aa = dot(a, a), bb = dot(b, b), ab = dot(a, b), area = aa * bb - ab * ab;
    const double first = squeeze / (area * area), second = 2 * first / area;
    double by[2][3];  // half the derivative of the squared area
    for (int k = 0; k < 3; ++k) by[0][k] = bb * a[k] - ab * b[k], by[1][k] = aa * b[k] - ab * a[k];
    for (int e = 0; e < 2; ++e)
        for (int k = 0; k < 3; ++k) stress[e][k] = edges[e][k] - first * by[e][k];
    for (int k = 0; k < 3; ++k) {
        for (int l = 0; l < 3; ++l) {
            const double one = k == l ? 1.0 : 0.0;
            tangent[0][k][0][l] = one - first * (bb * one - b[k] * b[l]) + 2 * second * by[0][k] * by[0][l];
            tangent[1][k][1][l] = one - first * (aa * one - a[k] * a[l]) + 2 * second * by[1][k] * by[1][l];
            tangent[0][k][1][l] = -first * (2 * a[k] * b[l] - b[k] * a[l] - ab * one) + 2 * second * by[0][k] * by[1][l];
            tangent[1][l][0][k] = tangent[0][k][1][l];
        }
    }
}

// What a point of the sheet remembers of the last equilibrium: whether it was held, and where on the tip.
struct Grip {
    bool on = false;
    double anchor[3] = {0, 0, 0};
};

// Contact at a point: its force on the tip, the derivative of that by the point's position, its pressure, and what it will remember.
struct Touch {
    double force[3], tangent[3][3], pressure;
    Grip grip;
};

// Friction of a point that the tip holds at grip: sticking as a spring, or slipping at the Coulomb limit.
void hold(const SheetLoad& load, const Grip& grip, const double* offset, const double* normal, double pressure, double stiff,
          Touch& touch) {
    double slid[3] = {0, 0, 0}, along[3];
    for (int k = 0; k < 3 && grip.on; ++k) slid[k] = offset[k] - grip.anchor[k];
    const double out = dot(slid, normal);
    for (int k = 0; k < 3; ++k) slid[k] -= out * normal[k];
    const double amount = std::sqrt(dot(slid, slid)), limit = load.friction * pressure;
    const bool slips = STICK * amount > limit;
    const double part = slips ? limit / (STICK * amount) : 1.0;
    for (int k = 0; k < 3; ++k) {
        along[k] = slid[k] / std::max(amount, 1e-30);
        touch.force[k] += STICK * part * slid[k];
        touch.grip.anchor[k] = offset[k] - part * slid[k];
    }
    for (int k = 0; k < 3; ++k) {
        for (int l = 0; l < 3; ++l) {
            const double flat = (k == l ? 1.0 : 0.0) - normal[k] * normal[l];
            if (grip.on) touch.tangent[k][l] += STICK * part * flat;
            if (slips) touch.tangent[k][l] -= STICK * part * along[k] * along[l] + load.friction * stiff * along[k] * normal[l];
        }
    }
}

// Traction of a point on which the tip slides: drag times the pressure. While the tip moves on and the sheet's shape with it, a point of
// the sheet comes to where the next one was: the slip is along the line on the surface that is seen from above in the direction of drag.
void slide(const SheetLoad& load, const double* normal, double distance, double pressure, double stiff, Touch& touch) {
    const double ratio = std::hypot(load.drag[0], load.drag[1]), down = std::min(normal[2], -0.1);
    if (!(ratio > 0)) return;
    const double x = load.drag[0] / ratio, y = load.drag[1] / ratio, rise = -(x * normal[0] + y * normal[1]) / down;
    const double length = std::sqrt(1 + rise * rise), along[3] = {x / length, y / length, rise / length};
    for (int k = 0; k < 3; ++k) touch.force[k] -= ratio * pressure * along[k];
    for (int l = 0; l < 3; ++l) {
        double turn[3];  // of the normal by the position
        for (int k = 0; k < 3; ++k) turn[k] = ((k == l ? 1.0 : 0.0) - normal[k] * normal[l]) / distance;
        const double steeper = -(x * turn[0] + y * turn[1] + rise * turn[2]) / down;  // of rise by the position
        const double flatter = -steeper * rise / (length * length);
        const double swing[3] = {along[0] * flatter, along[1] * flatter, along[2] * flatter + steeper / length};
        for (int k = 0; k < 3; ++k) touch.tangent[k][l] += ratio * (stiff * along[k] * normal[l] - pressure * swing[k]);
    }
}

// Contact of a point at offset (3,), m, from the tip's centre; false where it is free.
bool touches(const SheetLoad& load, const Grip& grip, const double* offset, Touch& touch) {
    const double distance = std::sqrt(dot(offset, offset)), depth = load.radius + SOFT - distance;
    if (!(depth > 0) || !(distance > 0)) return false;
    const double normal[3] = {offset[0] / distance, offset[1] / distance, offset[2] / distance};
    const double stiff = STIFF * std::min(depth / (2 * SOFT), 1.0);
    const double pressure = depth < 2 * SOFT ? stiff * depth / 2 : STIFF * (depth - SOFT);
    touch.grip = Grip{true, {offset[0], offset[1], offset[2]}}, touch.pressure = pressure;
    for (int k = 0; k < 3; ++k) {
        touch.force[k] = -pressure * normal[k];
        for (int l = 0; l < 3; ++l) {
            const double across = normal[k] * normal[l];
            touch.tangent[k][l] = stiff * across - pressure / distance * ((k == l ? 1.0 : 0.0) - across);
        }
    }
    if (load.slides)
        slide(load, normal, distance, pressure, stiff, touch);
    else
        hold(load, grip, offset, normal, pressure, stiff, touch);
    return true;
}

// Products of two functions for each pair (i, j) of an element's splines, at 9 i + j; the margin makes whole vectors.
constexpr int PAIRS = 84;
using Products = float[PAIRS];
// Stiffness of an element by the displacement of its splines, by components k and l of force and displacement.
using ElementMatrix = Products[3][3];

TACTILE_INLINE void multiply(const double* a, const double* b, Products& product) {
    for (int i = 0; i < SPLINES; ++i)
        for (int j = 0; j < SPLINES; ++j) product[SPLINES * i + j] = static_cast<float>(a[i] * b[j]);
}

TACTILE_INLINE void add_multiple(float share, const Products& product, Products& sum) {
    for (int m = 0; m < PAIRS; ++m) sum[m] += share * product[m];
}

// Splines at a point: derivatives by x and y, and Laplacian, (SPLINES,) each.
struct PointSplines {
    const double *by_x, *by_y, *laplacian;
};

// Adds the stiffness of the membrane (tangent (2, 3, 2, 3)) and of its bending at a point with this weight.
TACTILE_WIDE void add_stiffness(const PointSplines& at, double weight, const double tangent[2][3][2][3], double bending,
                                Products (*stiffness)[3]) {
    Products xx = {}, xy = {}, yx = {}, yy = {}, curve = {};
    multiply(at.by_x, at.by_x, xx), multiply(at.by_x, at.by_y, xy), multiply(at.by_y, at.by_x, yx), multiply(at.by_y, at.by_y, yy);
    multiply(at.laplacian, at.laplacian, curve);
    for (int k = 0; k < 3; ++k) {
        for (int l = 0; l < 3; ++l) {
            float share[4];
            for (int e = 0; e < 4; ++e) share[e] = static_cast<float>(weight * tangent[e / 2][k][e % 2][l]);
            float* sum = stiffness[k][l];
            for (int m = 0; m < PAIRS; ++m) sum[m] += (share[0] * xx[m] + share[1] * xy[m]) + (share[2] * yx[m] + share[3] * yy[m]);
        }
        add_multiple(static_cast<float>(bending), curve, stiffness[k][k]);
    }
}

// Adds the stiffness of contact (tangent (3, 3)) at a point with this weight and values (SPLINES,) of the splines.
TACTILE_WIDE void add_contact_stiffness(const double* value, double weight, const double tangent[3][3], Products (*stiffness)[3]) {
    Products both = {};
    multiply(value, value, both);
    for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) add_multiple(static_cast<float>(weight * tangent[k][l]), both, stiffness[k][l]);
}

class Press {
 public:
    Press(const SheetElements& sheet, const SheetLoad& load)
        : sheet_(sheet),
          load_(load),
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
            const double way = std::min((depth - at) / (at - before_), 2.0);
            for (std::size_t k = 0; k < u_.size(); ++k) u_[k] += (start[k] - last_[k]) * way;
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
        bool anew = true;
        double before = INFINITY;
        for (int turn = 0; turn < (load_.slides ? SLIDING_STEPS : STEPS); turn += anew) {
            balance(depth, anew);
            if (anew && !matrix_.factor()) return false;
            matrix_.solve(residual_.data());
            double largest = 0;
            for (const double step : residual_) largest = std::isfinite(step) ? std::max(largest, std::abs(step)) : INFINITY;
            if (!std::isfinite(largest) || (load_.slides && largest > LOST)) return false;
            const double length = std::min(turn < WHOLE ? 1.0 : 0.5, STRIDE / std::max(largest, 1e-12));
            for (std::ptrdiff_t i = 0; i < inner_; ++i)
                for (std::ptrdiff_t j = 0; j < 3 * inner_; ++j) u_[3 * ((i + 1) * side_ + 1) + j] -= length * residual_[3 * i * inner_ + j];
            if (largest < (anew ? SETTLED : FINAL)) {
                balance(depth, false);  // forces and grips of the last displacement
                grips_ = next_;
                return true;
            }
            anew = !(turn < EARLY && largest < NEAR && largest < SHRINKS * before);
            before = largest;
        }
        return false;
    }

    // Residual force and, where wanted, its derivative by the displacement of the splines that are free.
    void balance(double depth, bool derivative) {
        const double tip[3] = {load_.place[0], load_.place[1], -depth};
        if (derivative) matrix_.clear();
        std::fill(residual_.begin(), residual_.end(), 0.0);
        std::fill(wrench_, wrench_ + PRESS_WRENCH, 0.0);
        double pressed = 0;
        for (std::ptrdiff_t row = 0; row < sheet_.spans; ++row)
            for (std::ptrdiff_t column = 0; column < sheet_.spans; ++column) pressed += add_element(row, column, tip, derivative);
        for (int k = 6; k < PRESS_WRENCH && pressed > 0; ++k) wrench_[k] /= pressed;
    }

    // Returns the pressure times area.
    double add_element(std::ptrdiff_t row, std::ptrdiff_t column, const double* tip, bool derivative) {
        const std::ptrdiff_t e = row * sheet_.spans + column;
        double u[SPLINES][3], force[SPLINES][3] = {}, pressed = 0;
        for (int i = 0; i < SPLINES; ++i) std::memcpy(u[i], &u_[3 * ((row + i / 3) * side_ + column + i % 3)], sizeof(u[i]));
        ElementMatrix stiffness;
        if (derivative) std::memset(stiffness, 0, sizeof(stiffness));
        for (int g = 0; g < POINTS; ++g) {
            add_membrane(e * POINTS + g, u, force, derivative ? stiffness : nullptr);
            pressed += add_contact(e * POINTS + g, u, tip, force, derivative ? stiffness : nullptr);
        }
        scatter(row, column, force, derivative ? stiffness : nullptr);
        return pressed;
    }

    void add_membrane(std::ptrdiff_t point, const double (*u)[3], double (*force)[3], Products (*stiffness)[3]) {
        const double *by_x = sheet_.slope + point * 2 * SPLINES, *by_y = by_x + SPLINES, *laplacian = sheet_.laplacian + point * SPLINES;
        const double weight = sheet_.weight[point], bending = weight * load_.bending;
        double edges[2][3] = {{1, 0, 0}, {0, 1, 0}}, bend[3] = {}, stress[2][3], tangent[2][3][2][3];
        for (int i = 0; i < SPLINES; ++i) {
            for (int k = 0; k < 3; ++k) {
                edges[0][k] += by_x[i] * u[i][k], edges[1][k] += by_y[i] * u[i][k];
                bend[k] += bending * laplacian[i] * u[i][k];
            }
        }
        membrane(edges, load_.squeeze, stress, tangent);
        for (int i = 0; i < SPLINES; ++i)
            for (int k = 0; k < 3; ++k) force[i][k] += weight * (by_x[i] * stress[0][k] + by_y[i] * stress[1][k]) + bend[k] * laplacian[i];
        if (stiffness) add_stiffness({by_x, by_y, laplacian}, weight, tangent, bending, stiffness);
    }

    // Returns the pressure times area.
    double add_contact(std::ptrdiff_t point, const double (*u)[3], const double* tip, double (*force)[3], Products (*stiffness)[3]) {
        const double *value = sheet_.value + point * SPLINES, *rest = sheet_.rest + 2 * point, weight = sheet_.weight[point];
        double offset[3] = {rest[0] - tip[0], rest[1] - tip[1], -tip[2]};  // from the tip
        for (int i = 0; i < SPLINES; ++i)
            for (int k = 0; k < 3; ++k) offset[k] += value[i] * u[i][k];
        const double arm[3] = {offset[0], offset[1], offset[2]};
        offset[2] -= load_.radius;  // from its centre
        Touch touch;
        next_[point] = Grip{};
        if (!touches(load_, grips_[point], offset, touch)) return 0;
        next_[point] = touch.grip;
        const double* push = touch.force;
        const double moment[3] = {arm[1] * push[2] - arm[2] * push[1], arm[2] * push[0] - arm[0] * push[2],
                                  arm[0] * push[1] - arm[1] * push[0]};
        for (int k = 0; k < 3; ++k) wrench_[k] -= weight * push[k], wrench_[3 + k] -= weight * moment[k];
        for (int k = 0; k < 3; ++k) wrench_[6 + k] += weight * touch.pressure * arm[k];
        for (int i = 0; i < SPLINES; ++i)
            for (int k = 0; k < 3; ++k) force[i][k] += weight * value[i] * push[k];
        if (stiffness) add_contact_stiffness(value, weight, touch.tangent, stiffness);
        return weight * touch.pressure;
    }

    // Adds an element's forces and stiffness to those of the sheet's free splines.
    void scatter(std::ptrdiff_t row, std::ptrdiff_t column, const double (*force)[3], const Products (*stiffness)[3]) {
        std::ptrdiff_t number[SPLINES];
        for (int i = 0; i < SPLINES; ++i) {
            const std::ptrdiff_t a = row + i / 3 - 1, b = column + i % 3 - 1;
            number[i] = a >= 0 && a < inner_ && b >= 0 && b < inner_ ? 3 * (a * inner_ + b) : -1;
        }
        for (int i = 0; i < SPLINES; ++i) {
            for (int k = 0; k < 3 && number[i] >= 0; ++k) {
                residual_[number[i] + k] += force[i][k];
                if (!stiffness) continue;
                float* target = matrix_.row(number[i] + k);
                for (int j = 0; j < SPLINES; ++j)
                    for (int l = 0; l < 3 && number[j] >= 0; ++l) target[number[j] + l] += stiffness[k][l][SPLINES * i + j];
            }
        }
    }

    const SheetElements& sheet_;
    const SheetLoad& load_;
    std::ptrdiff_t side_, inner_;  // splines, and free ones, along each axis
    BandMatrix matrix_;
    std::vector<double> residual_, u_, last_;
    std::vector<Grip> grips_, next_;
    double depth_ = 0, before_ = 0, wrench_[PRESS_WRENCH] = {};
};

}  // namespace

void press_sheet(const SheetElements& sheet, const SheetLoad& load, const double* depths, std::ptrdiff_t count, double* fields,
                 double* wrenches) {
    Press press(sheet, load);
    for (std::ptrdiff_t k = 0; k < count && press.reach(depths[k], load.slides ? SLIDING_HALVINGS : HALVINGS); ++k) {
        const std::vector<double>& field = press.displacement();
        std::copy(field.begin(), field.end(), fields + k * static_cast<std::ptrdiff_t>(field.size()));
        std::copy(press.wrench(), press.wrench() + PRESS_WRENCH, wrenches + PRESS_WRENCH * k);
    }
}

}  // namespace tactile
