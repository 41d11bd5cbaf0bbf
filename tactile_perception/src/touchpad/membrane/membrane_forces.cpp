// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Forces of a neo-Hookean membrane. The energy of a triangle of area A (A0 at rest) is G/2 (tr C + a (A0/A)^2) A0. Both terms act along the
// triangle's edges: the first is a spring of weight G/2 times the cotangent at rest of the angle opposite to the edge (the cotangent
// Laplacian of Pinkall and Polthier 1993), the second one of weight -G a/2 (A0/A)^3 times the cotangent now. Each cell is cut along both
// diagonals, so that each triangle counts half and no direction is preferred.
#include "touchpad/membrane/membrane_forces.hpp"

#include "common/vectors.hpp"

namespace tactile {
namespace {

// Calls visit(t, a, b, c) with the number and the corners of each triangle.
template <class Visit>
void each_triangle(Grid grid, Visit visit) {
    std::ptrdiff_t t = 0;
    for (std::ptrdiff_t row = 0; row + 1 < grid.rows; ++row) {
        for (std::ptrdiff_t column = 0; column + 1 < grid.columns; ++column) {
            const std::ptrdiff_t a = row * grid.columns + column, b = a + 1, c = a + grid.columns, d = c + 1;
            visit(t++, a, b, c);
            visit(t++, b, d, c);
            visit(t++, a, b, d);
            visit(t++, a, d, c);
        }
    }
}

// A triangle's sides from its first corner, doubled area vector, and the products from which the cotangents follow: that of the angle at a
// corner is the product of the two sides there over the doubled area.
struct Triangle {
    Vec3 u, v, doubled;
    double square;  // of the doubled area
    double at[3];   // products of the sides at each corner
    Triangle(const double* places, std::ptrdiff_t a, std::ptrdiff_t b, std::ptrdiff_t c) {
        const Vec3 origin = vec3_at(places, a);
        u = vec3_at(places, b) - origin;
        v = vec3_at(places, c) - origin;
        doubled = cross(u, v);
        square = dot(doubled, doubled);
        at[0] = dot(u, v);
        at[1] = dot(u, u) - at[0];
        at[2] = dot(v, v) - at[0];
    }
};

// Weights of the edges opposite to the corners, N/m: springs less the area term. of: the triangle's four numbers.
inline void tensions(const double* of, const Triangle& triangle, double* tension) {
    const double rate = of[3] / (triangle.square * triangle.square);
    for (int k = 0; k < 3; ++k) tension[k] = of[k] - rate * triangle.at[k];
}

// Slot of dot `to` in the stencil of dot `from`.
inline int slot(Grid grid, std::ptrdiff_t from, std::ptrdiff_t to) {
    const std::ptrdiff_t step = to - from;
    const std::ptrdiff_t down = step > 1 ? 1 : step < -1 ? -1 : 0;
    return static_cast<int>(3 * (down + 1) + step - down * grid.columns + 1);
}

// Adds the derivatives of the normal forces at the corners of one triangle, by movements of its corners along their rays.
// With V the triangle's area vector, n its normal, E_k the edge opposite to corner k, N_k the dot's normal, s = G a/2 (A0/A)^3 / 2:
// the area term's force is s n x E_k / 2, the fluid's p V / 6, and corner j along its ray r_j changes V by E_j x r_j / 2.
void add_slopes(Grid grid, const double* of, const Triangle& triangle, const std::ptrdiff_t* corner, const double* rays,
                const double* normals, double pressure, double* slopes) {
    const Vec3 edge[3] = {triangle.v - triangle.u, {-triangle.v.x, -triangle.v.y, -triangle.v.z}, triangle.u};
    const double doubled = std::sqrt(triangle.square), area = doubled / 2;
    const Vec3 n = 1 / doubled * triangle.doubled;
    const double stiffening = of[3] / (triangle.square * triangle.square) * doubled * 2;
    Vec3 ray[3], change[3];
    for (int j = 0; j < 3; ++j) {
        ray[j] = vec3_at(rays, corner[j]);
        change[j] = 0.5 * cross(edge[j], ray[j]);
    }
    for (int k = 0; k < 3; ++k) {
        const Vec3 up = vec3_at(normals, corner[k]), turned = 0.5 * cross(edge[k], up), tilt = cross(up, n);
        // three from the derivative of 1/A^3, the fourth from the rotation of the triangle's normal
        const Vec3 lever = stiffening / area * (turned - 4 * dot(turned, n) * n) + pressure / 6 * up;
        const int before = (k + 2) % 3, after = (k + 1) % 3;
        double by[3];
        for (int j = 0; j < 3; ++j) by[j] = dot(lever, change[j]);
        by[before] += stiffening / 2 * dot(ray[before], tilt) + of[after] * dot(up, ray[before]);
        by[after] += of[before] * dot(up, ray[after]) - stiffening / 2 * dot(ray[after], tilt);
        by[k] -= (of[before] + of[after]) * dot(up, ray[k]);
        for (int j = 0; j < 3; ++j) slopes[9 * corner[k] + slot(grid, corner[k], corner[j])] += by[j];
    }
}

}  // namespace

std::vector<double> membrane_at_rest(Grid grid, const double* rest, double stiffness, double area_share) {
    std::vector<double> triangles(4 * grid.triangles());
    each_triangle(grid, [&](std::ptrdiff_t t, std::ptrdiff_t a, std::ptrdiff_t b, std::ptrdiff_t c) {
        const Triangle triangle(rest, a, b, c);
        const double doubled = std::sqrt(triangle.square);
        for (int k = 0; k < 3; ++k) triangles[4 * t + k] = stiffness / 4 * triangle.at[k] / doubled;
        // G a/4 (A0/A)^3 over the doubled area, times its square's square: A0 = doubled / 2
        triangles[4 * t + 3] = stiffness * area_share / 4 * triangle.square * doubled;
    });
    return triangles;
}

void add_forces(Grid grid, const double* triangles, const double* places, double* force, double* share) {
    each_triangle(grid, [&](std::ptrdiff_t t, std::ptrdiff_t a, std::ptrdiff_t b, std::ptrdiff_t c) {
        const Triangle triangle(places, a, b, c);
        double tension[3];
        tensions(triangles + 4 * t, triangle, tension);
        const Vec3 ab = tension[2] * triangle.u, ac = tension[1] * triangle.v, bc = tension[0] * (triangle.v - triangle.u);
        add_to(force, a, ab + ac);
        add_to(force, b, bc - ab);
        add_to(force, c, Vec3{-ac.x - bc.x, -ac.y - bc.y, -ac.z - bc.z});
        const Vec3 third = 1.0 / 12 * triangle.doubled;  // a third of half of a triangle; the vector is twice the area
        add_to(share, a, third);
        add_to(share, b, third);
        add_to(share, c, third);
    });
}

Balance find_balance(const Membrane& membrane, const double* places, double pressure) {
    const Grid grid = membrane.grid;
    const std::ptrdiff_t size = grid.size();
    std::vector<double> force(3 * size), share(3 * size);
    add_forces(grid, membrane.triangles, places, force.data(), share.data());
    Balance found{std::vector<double>(3 * size), std::vector<double>(size), std::vector<double>(size), std::vector<double>(size)};
    for (std::ptrdiff_t k = 0; k < size; ++k) {
        const Vec3 part = vec3_at(share.data(), k), pushed = part - vec3_at(membrane.residual, k);
        found.area[k] = length(part);
        const Vec3 normal = 1 / found.area[k] * part;
        store(found.normal.data(), k, normal);
        if (!grid.inner(k / grid.columns, k % grid.columns)) continue;
        const double scale = 1 / (pressure * found.area[k]);
        found.by_pressure[k] = scale * dot(pushed, normal);
        found.load[k] = scale * dot(vec3_at(force.data(), k), normal) + pressure * found.by_pressure[k];
    }
    return found;
}

std::vector<double> find_slopes(const Membrane& membrane, const double* places, const double* rays, double pressure, const Balance& balance,
                                const std::uint8_t* wanted) {
    const Grid grid = membrane.grid;
    std::vector<double> slopes(9 * grid.size());
    each_triangle(grid, [&](std::ptrdiff_t t, std::ptrdiff_t a, std::ptrdiff_t b, std::ptrdiff_t c) {
        if (wanted && !wanted[a] && !wanted[b] && !wanted[c]) return;
        const std::ptrdiff_t corner[3] = {a, b, c};
        add_slopes(grid, membrane.triangles + 4 * t, Triangle(places, a, b, c), corner, rays, balance.normal.data(), pressure,
                   slopes.data());
    });
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        const double scale = grid.inner(k / grid.columns, k % grid.columns) ? 1 / (pressure * balance.area[k]) : 0.0;
        for (int j = 0; j < 9; ++j) slopes[9 * k + j] *= scale;
    }
    return slopes;
}

}  // namespace tactile
