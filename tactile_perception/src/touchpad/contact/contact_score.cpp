// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// A dot is in contact if it carries the load that a dot in contact carries there, and if it lies on the object's face: free dots beside an
// edge carry a part of its line load, but stand out above the face.
#include "touchpad/contact/contact_score.hpp"

#include <algorithm>
#include <cmath>

#include "common/grid.hpp"
#include "common/median.hpp"
#include "common/small_systems.hpp"
#include "common/vectors.hpp"

namespace tactile {
namespace {

constexpr double HALF = 0.5;               // score, and load over the fluid's pressure, of the border of a contact
constexpr double LINE = 1.2;               // of the full load of narrow contacts; chosen on simulated prisms, rings and balls
constexpr double EDGE_HEIGHT = 0.1;        // pitches, height above the face of a dot in contact on an object's rounded edge; chosen
constexpr std::size_t SMALLEST_PATCH = 8;  // dots; chosen: two more than a paraboloid has coefficients
constexpr int ROUNDS = 4;                  // of reweighting; chosen
constexpr double FINEST = 1e-5;            // m, smallest scale of the residuals; chosen, about the noise of a position
constexpr double RIDGE = 1e-6;             // of the normal equations; chosen
constexpr int TERMS = 6;                   // 1, x, y, x^2, x y, y^2

// Calls visit with each existing neighbour of dot k.
template <class Visit>
void beside(Grid grid, std::ptrdiff_t k, Visit visit) {
    const std::ptrdiff_t row = k / grid.columns, column = k % grid.columns;
    for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(row - 1, 0); r <= std::min(row + 1, grid.rows - 1); ++r) {
        for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(column - 1, 0); c <= std::min(column + 1, grid.columns - 1); ++c) {
            if (r * grid.columns + c != k) visit(r * grid.columns + c);
        }
    }
}

// Load as a share of that in full contact, 0 to 1. Full contact is 1 under a flat face and 2 to 4 under a ball or an edge: inside a patch
// it is at most 1, at its border the mean of the loaded neighbours, weighted by their loads because dots beside an edge carry only a
// spread part of its load; to the power of LINE where no dot inside a patch is near: of an edge between two rows, both carry half the load,
// and neither touches.
std::vector<double> load_share(Grid grid, const double* load) {
    std::vector<std::uint8_t> inside(grid.size());
    std::vector<double> share(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        int loaded = 0;
        beside(grid, k, [&](std::ptrdiff_t j) { loaded += load[j] > HALF; });
        inside[k] = loaded == 8;
    }
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        double sum = 0, squares = 0;
        bool near = inside[k] && load[k] > HALF;
        beside(grid, k, [&](std::ptrdiff_t j) {
            if (load[j] > HALF) near |= inside[j], sum += load[j], squares += load[j] * load[j];
        });
        double full = inside[k] || sum == 0 ? 1.0 : std::max(squares / sum, 1.0);
        if (!near) full = std::pow(full, LINE);
        share[k] = std::clamp(load[k] / full, 0.0, 1.0);
        if (!(share[k] >= 0)) share[k] = 0;  // of a load that is NaN
    }
    return share;
}

// Sets the score of isolated dots above 0.5 to 0.5: a single dot is an error of its range.
void drop_single_dots(Grid grid, std::vector<double>& score) {
    std::vector<std::ptrdiff_t> single;
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!(score[k] > HALF)) continue;
        int others = 0;
        beside(grid, k, [&](std::ptrdiff_t j) { others += score[j] > HALF; });
        if (others == 0) single.push_back(k);
    }
    for (const std::ptrdiff_t k : single) score[k] = HALF;
}

}  // namespace

std::vector<double> heights_over_face(const std::vector<double>& points, const double* mean_normal, const std::vector<int>& neighbours) {
    const std::size_t count = neighbours.size();
    const Vec3 up = 1 / length(vec3_at(mean_normal, 0)) * vec3_at(mean_normal, 0);
    const Vec3 along = 1 / std::hypot(up.x, up.z) * Vec3{up.z, 0, -up.x}, across = cross(up, along);
    Vec3 middle{0, 0, 0};
    for (std::size_t i = 0; i < count; ++i) middle = middle + 1.0 / count * vec3_at(points.data(), i);
    std::vector<double> x(count), y(count), residual(count), weight(count), sizes(count), terms(TERMS * count);
    double reach = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3 off = vec3_at(points.data(), i) - middle;
        x[i] = dot(off, along), y[i] = dot(off, across), residual[i] = dot(off, up);
        reach = std::max({reach, std::abs(x[i]), std::abs(y[i])});
        weight[i] = std::pow(std::clamp((neighbours[i] - 3) / 5.0, 0.05, 1.0), 2);
    }
    const std::vector<double> height = residual;
    for (std::size_t i = 0; i < count; ++i) {
        const double u = x[i] / reach, v = y[i] / reach, of[TERMS] = {1, u, v, u * u, u * v, v * v};
        std::copy(of, of + TERMS, terms.data() + TERMS * i);
    }
    for (int round = 0; round < ROUNDS; ++round) {
        SmallSystem<TERMS> fit(RIDGE);
        for (std::size_t i = 0; i < count; ++i) fit.add(terms.data() + TERMS * i, height[i], weight[i]);
        double found[TERMS];
        if (!fit.solve(found)) return std::vector<double>(count, NAN);
        for (std::size_t i = 0; i < count; ++i) {
            residual[i] = height[i];
            for (int j = 0; j < TERMS; ++j) residual[i] -= found[j] * terms[TERMS * i + j];
            sizes[i] = std::abs(residual[i]);
        }
        std::nth_element(sizes.begin(), sizes.begin() + count / 2, sizes.end());
        const double scale = std::max(SIGMA_PER_MAD * sizes[count / 2], FINEST);
        for (std::size_t i = 0; i < count; ++i) {  // high dots may be beyond the edge and lose weight sooner; low dots are only noisy
            const double square = residual[i] * residual[i] / (scale * scale);
            weight[i] = residual[i] > 0 ? 1 / ((1 + square) * (1 + square)) : 1 / (1 + square / 4);
        }
    }
    return residual;
}

std::vector<double> contact_score(Grid grid, const double* load, const double* places, const double* normals, double pitch) {
    std::vector<double> score = load_share(grid, load);
    std::vector<std::uint8_t> loaded(grid.size());
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) loaded[k] = score[k] > HALF;
    std::vector<std::int32_t> patch;
    const auto count = static_cast<std::int32_t>(components(loaded.data(), grid.rows, grid.columns, true, patch).size());
    for (std::int32_t number = 1; number <= count; ++number) {
        std::vector<std::ptrdiff_t> member;
        std::vector<double> points;
        std::vector<int> neighbours;
        double normal[3] = {0, 0, 0};
        for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
            if (patch[k] != number) continue;
            member.push_back(k);
            points.insert(points.end(), places + 3 * k, places + 3 * k + 3);
            add_to(normal, 0, vec3_at(normals, k));
            neighbours.push_back(0);
            beside(grid, k, [&](std::ptrdiff_t j) { neighbours.back() += loaded[j]; });
        }
        if (member.size() < SMALLEST_PATCH) continue;
        const std::vector<double> heights = heights_over_face(points, normal, neighbours);
        for (std::size_t i = 0; i < member.size(); ++i) {
            const double face = std::clamp(1 - heights[i] / (2 * EDGE_HEIGHT * pitch), 0.0, 1.0);
            if (face < score[member[i]]) score[member[i]] = face;
        }
    }
    drop_single_dots(grid, score);
    return score;
}

}  // namespace tactile
