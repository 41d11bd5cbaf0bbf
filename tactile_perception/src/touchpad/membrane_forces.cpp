// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Forces of a neo-Hookean membrane. The energy of a triangle of area A (A0 at rest) is G/2 (tr C + a (A0/A)^2) A0. Both terms act along the
// triangle's edges: the first is a spring of weight G/2 times the cotangent at rest of the angle opposite to the edge (the cotangent
// Laplacian of Pinkall and Polthier 1993), the second one of weight -G a/2 (A0/A)^3 times the cotangent now. Each cell is cut along both
// diagonals, so that each triangle counts half and no direction is preferred.
// Four cells of a row are calculated at once.
#include "touchpad/membrane_forces.hpp"

#include <algorithm>

#include "common/lanes.hpp"
#include "common/vectors.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

// Corners of a cell: first row and column, then across, down, both. Its triangles have these corners.
constexpr int CORNERS = 4, TRIANGLES = 4;
constexpr int OF_TRIANGLE[TRIANGLES][3] = {{0, 1, 2}, {1, 3, 2}, {0, 1, 3}, {0, 3, 2}};

// A vector of numbers, or of several at once. Not Eigen's: its functions would not become a part of those that are TACTILE_WIDE.
template <class Number>
struct Vector {
    Number x, y, z;

    TACTILE_INLINE friend Vector operator+(const Vector& a, const Vector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    TACTILE_INLINE friend Vector operator-(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    TACTILE_INLINE friend Vector operator*(const Number& s, const Vector& a) { return {s * a.x, s * a.y, s * a.z}; }
    TACTILE_INLINE friend Number dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    TACTILE_INLINE friend Vector cross(const Vector& a, const Vector& b) {
        return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    }
};
using FourVectors = Vector<Four>;

// An array (K, 3) of a grid's dots, one coordinate after the other, so that those of neighbours in a row are read at once. Zeros follow
// each row.
class Columns {
 public:
    Columns(Grid grid, const double* array) : stride_(grid.columns + FOUR), plane_(grid.rows * stride_), values_(3 * plane_) {
        for (std::ptrdiff_t row = 0; row < grid.rows; ++row) {
            for (std::ptrdiff_t column = 0; column < grid.columns; ++column) {
                for (int axis = 0; axis < 3; ++axis) {
                    values_[axis * plane_ + row * stride_ + column] = array[3 * (row * grid.columns + column) + axis];
                }
            }
        }
    }
    // Of this corner of four cells in a row, from the cell in this row and column.
    TACTILE_INLINE FourVectors at(std::ptrdiff_t row, std::ptrdiff_t column, int corner) const {
        const double* first = values_.data() + (row + corner / 2) * stride_ + column + corner % 2;
        return {Four(first), Four(first + plane_), Four(first + 2 * plane_)};
    }

 private:
    const std::ptrdiff_t stride_, plane_;
    std::vector<double> values_;
};

struct DotColumns {
    Columns positions, rays, normals;
};

// Sums, at the dots of two rows of a grid, of what the cells around them contribute to each of several numbers. What comes from the cells
// right of a dot and from those left of it is summed apart: so no sum is needed again before it is stored.
class CellSums {
 public:
    CellSums(Grid grid, std::ptrdiff_t numbers)
        : last_(grid.columns - 1), stride_(grid.padded_cells() + 1), size_(2 * numbers * stride_), values_(2 * size_) {}

    // Adds to a number at this corner of four cells in a row.
    TACTILE_INLINE void add(std::ptrdiff_t number, std::ptrdiff_t row, std::ptrdiff_t column, int corner, const Four& value) {
        double* sum = values_.data() + (row + corner / 2) % 2 * size_ + (2 * number + corner % 2) * stride_ + column + 1;
        (Four(sum) + value).store(sum);
    }
    // The sum of a number at a dot whose cells all have been added.
    TACTILE_INLINE double sum(std::ptrdiff_t number, std::ptrdiff_t row, std::ptrdiff_t column) const {
        const double *right = values_.data() + row % 2 * size_ + 2 * number * stride_ + column + 1, *left = right + stride_ - 1;
        return (column < last_ ? *right : 0.0) + *left;
    }
    // Forgets a row, for the next but one.
    void clear(std::ptrdiff_t row) { std::fill_n(values_.begin() + row % 2 * size_, size_, 0.0); }

 private:
    const std::ptrdiff_t last_, stride_, size_;  // stride_: a zero, then the cells of a row
    std::vector<double> values_;
};

// A triangle's sides from its first corner, doubled area vector, and the products from which the cotangents follow: that of the angle at a
// corner is the product of the two sides there over the doubled area.
template <class Number>
struct Triangle {
    Vector<Number> u, v, doubled;
    Number square;  // of the doubled area
    Number at[3];   // products of the sides at each corner
    TACTILE_INLINE Triangle(const Vector<Number>& a, const Vector<Number>& b, const Vector<Number>& c)
        : u(b - a), v(c - a), doubled(cross(u, v)), square(dot(doubled, doubled)) {
        at[0] = dot(u, v);
        at[1] = dot(u, u) - at[0];
        at[2] = dot(v, v) - at[0];
    }
};

// The triangles' numbers of four cells in a row, from the cell in this row and column.
class Springs {
 public:
    TACTILE_INLINE Springs(const Skin& skin, std::ptrdiff_t row, std::ptrdiff_t column)
        : stride_(skin.grid.padded_cells()), numbers_(skin.triangles.data() + row * 4 * TRIANGLES * stride_ + column) {}
    // Weight of the spring opposite to a corner of triangle t.
    TACTILE_INLINE Four weight(int t, int corner) const { return Four(numbers_ + (4 * t + corner) * stride_); }
    // Factor of the area term of triangle t over the fourth power of the doubled area.
    TACTILE_INLINE Four rate(int t, const Four& square) const { return Four(numbers_ + (4 * t + 3) * stride_) / (square * square); }

 private:
    const std::ptrdiff_t stride_;
    const double* numbers_;
};

// Adds the elastic forces and the shares of the area vectors of four cells in a row to sums 0 to 2 and 3 to 5.
TACTILE_INLINE void add_cells(const Springs& springs, const Columns& where, std::ptrdiff_t row, std::ptrdiff_t column, CellSums& sums) {
    FourVectors corner[CORNERS], pull[CORNERS] = {}, area[CORNERS] = {};
    for (int k = 0; k < CORNERS; ++k) corner[k] = where.at(row, column, k);
    for (int t = 0; t < TRIANGLES; ++t) {
        const int a = OF_TRIANGLE[t][0], b = OF_TRIANGLE[t][1], c = OF_TRIANGLE[t][2];
        const Triangle<Four> triangle(corner[a], corner[b], corner[c]);
        const Four rate = springs.rate(t, triangle.square);
        Four tension[3];
        for (int k = 0; k < 3; ++k) tension[k] = springs.weight(t, k) - rate * triangle.at[k];
        const FourVectors ab = tension[2] * triangle.u, ac = tension[1] * triangle.v, bc = tension[0] * (triangle.v - triangle.u);
        pull[a] = pull[a] + (ab + ac);
        pull[b] = pull[b] + (bc - ab);
        pull[c] = pull[c] - (ac + bc);
        const FourVectors third = 1.0 / 12 * triangle.doubled;  // a third of half of a triangle; the vector is twice the area
        for (const int k : {a, b, c}) area[k] = area[k] + third;
    }
    for (int k = 0; k < CORNERS; ++k) {
        const Four all[6] = {pull[k].x, pull[k].y, pull[k].z, area[k].x, area[k].y, area[k].z};
        for (int number = 0; number < 6; ++number) sums.add(number, row, column, k, all[number]);
    }
}

// Slot of a corner of a cell in the stencil of another.
constexpr int slot(int from, int to) {
    return 3 * (to / 2 - from / 2 + 1) + to % 2 - from % 2 + 1;
}

// Adds the derivatives of the normal forces of the dots of four cells in a row, by movements along their rays, to the sum of each slot.
// In a triangle, with V its area vector, n its normal, E_k the edge opposite to corner k, N_k the dot's normal, s = G a/2 (A0/A)^3 / 2:
// the area term's force is s n x E_k / 2, the fluid's p V / 6, and corner j along its ray r_j changes V by E_j x r_j / 2.
// The rate is s / (4 A); the doubled area vector is 2 A n.
TACTILE_INLINE void add_slopes(const Springs& springs, const DotColumns& dots, double pressure, std::ptrdiff_t row, std::ptrdiff_t column,
                               CellSums& sums) {
    FourVectors position[CORNERS], ray[CORNERS], normal[CORNERS];
    for (int k = 0; k < CORNERS; ++k) {
        position[k] = dots.positions.at(row, column, k), ray[k] = dots.rays.at(row, column, k), normal[k] = dots.normals.at(row, column, k);
    }
    Four slopes[CORNERS][CORNERS];
    for (int t = 0; t < TRIANGLES; ++t) {
        const int* corner = OF_TRIANGLE[t];
        const Triangle<Four> triangle(position[corner[0]], position[corner[1]], position[corner[2]]);
        const FourVectors edge[3] = {triangle.v - triangle.u, Four(-1.0) * triangle.v, triangle.u}, &doubled = triangle.doubled;
        const Four rate = springs.rate(t, triangle.square), inverse = 4.0 / triangle.square;
        FourVectors change[3];
        for (int j = 0; j < 3; ++j) change[j] = 0.5 * cross(edge[j], ray[corner[j]]);
        for (int k = 0; k < 3; ++k) {
            const int before = (k + 2) % 3, after = (k + 1) % 3;
            const FourVectors &up = normal[corner[k]], &ahead = ray[corner[after]], &behind = ray[corner[before]];
            const FourVectors turned = 0.5 * cross(edge[k], up), tilt = cross(up, doubled);
            // three from the derivative of 1/A^3, the fourth from the rotation of the triangle's normal
            const FourVectors lever = 4.0 * rate * (turned - inverse * dot(turned, doubled) * doubled) + pressure / 6 * up;
            Four by[3];
            for (int j = 0; j < 3; ++j) by[j] = dot(lever, change[j]);
            by[before] += rate * dot(behind, tilt) + springs.weight(t, after) * dot(up, behind);
            by[after] += springs.weight(t, before) * dot(up, ahead) - rate * dot(ahead, tilt);
            by[k] -= (springs.weight(t, before) + springs.weight(t, after)) * dot(up, ray[corner[k]]);
            for (int j = 0; j < 3; ++j) slopes[corner[k]][corner[j]] += by[j];
        }
    }
    for (int from = 0; from < CORNERS; ++from) {
        for (int to = 0; to < CORNERS; ++to) sums.add(slot(from, to), row, column, from, slopes[from][to]);
    }
}

}  // namespace

Skin::Skin(Grid grid_, const double* rest_, const MembraneMaterial& material)
    : grid(grid_),
      pressure(material.pressure),
      rest(rest_, rest_ + 3 * grid.size()),
      triangles(grid.triangle_numbers()),
      residual(rest.size()) {
    const std::ptrdiff_t stride = grid.padded_cells();
    for (std::ptrdiff_t row = 0; row + 1 < grid.rows; ++row) {
        for (std::ptrdiff_t column = 0; column + 1 < grid.columns; ++column) {
            for (int t = 0; t < TRIANGLES; ++t) {
                const auto corner = [&](int k) {
                    const int which = OF_TRIANGLE[t][k];
                    const double* at = rest_ + 3 * ((row + which / 2) * grid.columns + column + which % 2);
                    return Vector<double>{at[0], at[1], at[2]};
                };
                const Triangle<double> triangle(corner(0), corner(1), corner(2));
                const double doubled = std::sqrt(triangle.square);
                double* numbers = triangles.data() + (row * TRIANGLES + t) * 4 * stride + column;
                for (int k = 0; k < 3; ++k) numbers[k * stride] = material.stiffness / 4 * triangle.at[k] / doubled;
                // G a/4 (A0/A)^3 over the doubled area, times its square's square: A0 = doubled / 2
                numbers[3 * stride] = material.stiffness * material.area_share / 4 * triangle.square * doubled;
            }
        }
    }
    std::vector<double> elastic(rest.size());
    add_forces(*this, rest_, elastic.data(), residual.data());
    for (std::size_t k = 0; k < residual.size(); ++k) residual[k] += elastic[k] / pressure;
}

TACTILE_WIDE void add_forces(const Skin& skin, const double* positions, double* force, double* share) {
    const Grid grid = skin.grid;
    const Columns where(grid, positions);
    CellSums sums(grid, 6);
    for (std::ptrdiff_t row = 0; row < grid.rows; ++row) {
        for (std::ptrdiff_t column = 0; row + 1 < grid.rows && column + 1 < grid.columns; column += FOUR) {
            add_cells(Springs(skin, row, column), where, row, column, sums);
        }
        for (std::ptrdiff_t column = 0; column < grid.columns; ++column, force += 3, share += 3) {
            for (int axis = 0; axis < 3; ++axis) {
                force[axis] += sums.sum(axis, row, column);
                share[axis] += sums.sum(3 + axis, row, column);
            }
        }
        sums.clear(row);
    }
}

Balance find_balance(const Skin& skin, const double* positions, double pressure) {
    const Grid grid = skin.grid;
    const std::ptrdiff_t size = grid.size();
    std::vector<double> share(3 * size);
    Balance found{std::vector<double>(3 * size), std::vector<double>(3 * size), std::vector<double>(size), std::vector<double>(size),
                  std::vector<double>(size)};
    add_forces(skin, positions, found.elastic.data(), share.data());
    each_dot(grid, [&](std::ptrdiff_t k, bool inner) {
        const Eigen::Vector3d part = vec3_at(share.data(), k), pushed = part - vec3_at(skin.residual.data(), k);
        found.area[k] = part.norm();
        const Eigen::Vector3d normal = 1 / found.area[k] * part;
        store(found.normal.data(), k, normal);
        if (!inner) return;
        const double scale = 1 / (pressure * found.area[k]);
        found.by_pressure[k] = scale * pushed.dot(normal);
        found.load[k] = scale * vec3_at(found.elastic.data(), k).dot(normal) + pressure * found.by_pressure[k];
    });
    return found;
}

TACTILE_WIDE std::vector<double> find_slopes(const Skin& skin, const double* positions, const double* rays, double pressure,
                                             const Balance& balance) {
    const Grid grid = skin.grid;
    const DotColumns dots{{grid, positions}, {grid, rays}, {grid, balance.normal.data()}};
    CellSums sums(grid, 9);
    std::vector<double> found(9 * grid.size());
    for (std::ptrdiff_t row = 0; row + 1 < grid.rows; ++row) {
        for (std::ptrdiff_t column = 0; column + 1 < grid.columns; column += FOUR) {
            add_slopes(Springs(skin, row, column), dots, pressure, row, column, sums);
        }
        for (std::ptrdiff_t column = 1; row > 0 && column + 1 < grid.columns; ++column) {
            const std::ptrdiff_t k = row * grid.columns + column;
            const double scale = 1 / (pressure * balance.area[k]);
            for (int j = 0; j < 9; ++j) found[9 * k + j] = scale * sums.sum(j, row, column);
        }
        sums.clear(row);
    }
    return found;
}

}  // namespace tactile
