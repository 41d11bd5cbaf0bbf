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

constexpr double HALF = 0.5;  // score, and load over the fluid's pressure, of the border of a contact
// Load of a single dot in contact, unless no dot carries more, and with that of the dots around it: five times the noise's; chosen.
constexpr double SINGLE = 1.5;
constexpr double LINE = 1.2;  // of the full load of narrow contacts; chosen on simulated prisms, rings and balls
// Largest height above the face of a dot in contact on an object's rounded edge, pitches, and its growth by load and rise: a free dot that
// stands high is far from the edge and carries little of its load. The skin leaves a ball without a kink, of little rise: then the height
// may be twice as large. Chosen on simulated sharp and round faces, rings and balls.
constexpr double EDGE_HEIGHT = 0.04, HEIGHT_BY_LOAD = 0.12, KINK = 0.2;
constexpr std::size_t SMALLEST_PATCH = 8;  // dots; chosen: two more than a paraboloid has coefficients
constexpr int ROUNDS = 4;                  // of reweighting; chosen
constexpr double FINEST = 1e-5;            // m, smallest scale of the residuals; chosen, about the noise of a position
constexpr double RIDGE = 1e-6;             // of the normal equations; chosen
constexpr int TERMS = 6;                   // 1, x, y, x^2, x y, y^2

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

// A paraboloid, fitted robustly to the places of a patch's dots.
class Face {
 public:
    // points (N, 3), m; normal: of any length, the direction of heights; neighbours (N): number of other points of the patch beside each.
    // Points with many of them, and low points, weigh more.
    Face(const std::vector<double>& points, Vec3 normal, const std::vector<int>& neighbours)
        : up_(1 / length(normal) * normal), along_(1 / std::hypot(up_.x, up_.z) * Vec3{up_.z, 0, -up_.x}), across_(cross(up_, along_)) {
        const std::size_t count = neighbours.size();
        for (std::size_t i = 0; i < count; ++i) middle_ = middle_ + 1.0 / count * vec3_at(points.data(), i);
        for (std::size_t i = 0; i < count; ++i) {
            const Vec3 off = vec3_at(points.data(), i) - middle_;
            reach_ = std::max({reach_, std::abs(dot(off, along_)), std::abs(dot(off, across_))});
        }
        std::vector<double> weight(count);
        for (std::size_t i = 0; i < count; ++i) weight[i] = std::pow(std::clamp((neighbours[i] - 3) / 5.0, 0.05, 1.0), 2);
        for (int round = 0; round < ROUNDS && fit(points, weight); ++round) reweight(points, weight);
    }

    // Height of a place, m, above the face; NaN where the fit is singular.
    double height(Vec3 place) const {
        double of[TERMS], above = terms(place, of);
        for (int j = 0; j < TERMS; ++j) above -= shape_[j] * of[j];
        return above;
    }

 private:
    // Writes the paraboloid's terms at a place. Returns its height above the middle, m.
    double terms(Vec3 place, double* of) const {
        const Vec3 off = place - middle_;
        const double u = dot(off, along_) / reach_, v = dot(off, across_) / reach_, all[TERMS] = {1, u, v, u * u, u * v, v * v};
        std::copy(all, all + TERMS, of);
        return dot(off, up_);
    }

    // Fits the paraboloid to the weighted points; false where that is singular.
    bool fit(const std::vector<double>& points, const std::vector<double>& weight) {
        SmallSystem<TERMS> system(RIDGE);
        double of[TERMS];
        for (std::size_t i = 0; i < weight.size(); ++i) {
            const double height = terms(vec3_at(points.data(), i), of);
            system.add(of, height, weight[i]);
        }
        const bool solved = system.solve(shape_);
        if (!solved) std::fill(shape_, shape_ + TERMS, NAN);
        return solved;
    }

    // High dots may be beyond the edge and lose weight sooner; low dots are only noisy.
    void reweight(const std::vector<double>& points, std::vector<double>& weight) const {
        const std::size_t count = weight.size();
        std::vector<double> residual(count), sizes(count);
        for (std::size_t i = 0; i < count; ++i) {
            residual[i] = height(vec3_at(points.data(), i));
            sizes[i] = std::abs(residual[i]);
        }
        std::nth_element(sizes.begin(), sizes.begin() + count / 2, sizes.end());
        const double scale = std::max(SIGMA_PER_MAD * sizes[count / 2], FINEST);
        for (std::size_t i = 0; i < count; ++i) {
            const double square = residual[i] * residual[i] / (scale * scale);
            weight[i] = residual[i] > 0 ? 1 / ((1 + square) * (1 + square)) : 1 / (1 + square / 4);
        }
    }

    const Vec3 up_, along_, across_;
    Vec3 middle_{0, 0, 0};
    double reach_ = 0, shape_[TERMS] = {};  // m, of the farthest point from the middle; coefficients of the terms, m
};

// How surely a dot of a patch lies on its face, 0 to 1, by its height and by how steeply the free skin beside it rises from it; 1 for a dot
// without free ones beside it.
double on_face(const Face& face, Grid grid, std::ptrdiff_t k, const double* places, double load, const std::vector<std::uint8_t>& loaded,
               double pitch) {
    const Vec3 place = vec3_at(places, k);
    const double height = face.height(place);
    bool at_edge = false;
    double rise = 0;
    beside(grid, k, [&](std::ptrdiff_t j) {
        if (loaded[j]) return;
        const Vec3 free = vec3_at(places, j);
        at_edge = true;
        rise = std::max(rise, (face.height(free) - height) / length(free - place));
    });
    if (!at_edge) return 1;
    const double largest = pitch * (EDGE_HEIGHT * (1 + std::max(0.0, 1 - rise / KINK)) + HEIGHT_BY_LOAD * load * rise);
    return std::clamp(1 - height / (2 * largest), 0.0, 1.0);
}

}  // namespace

void drop_single_dots(Grid grid, const double* load, std::vector<double>& score) {
    std::vector<std::ptrdiff_t> single;
    double least = 0;  // SINGLE, or the largest load
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (load[k] > least) least = std::min(load[k], SINGLE);
    }
    for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
        if (!(score[k] > HALF)) continue;
        int others = 0;
        double net = load[k];
        beside(grid, k, [&](std::ptrdiff_t j) { others += score[j] > HALF, net += load[j]; });
        if (others == 0 && !(load[k] >= least && net > SINGLE)) single.push_back(k);
    }
    for (const std::ptrdiff_t k : single) score[k] = HALF;
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
        Vec3 normal{0, 0, 0};
        for (std::ptrdiff_t k = 0; k < grid.size(); ++k) {
            if (patch[k] != number) continue;
            member.push_back(k);
            points.insert(points.end(), places + 3 * k, places + 3 * k + 3);
            normal = normal + vec3_at(normals, k);
            neighbours.push_back(0);
            beside(grid, k, [&](std::ptrdiff_t j) { neighbours.back() += loaded[j]; });
        }
        if (member.size() < SMALLEST_PATCH) continue;
        const Face face(points, normal, neighbours);
        for (const std::ptrdiff_t k : member) {
            const double sure = on_face(face, grid, k, places, load[k], loaded, pitch);
            if (sure < score[k]) score[k] = sure;
        }
    }
    drop_single_dots(grid, load, score);
    return score;
}

}  // namespace tactile
