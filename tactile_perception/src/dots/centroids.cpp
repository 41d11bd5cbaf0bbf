// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// A pixel weighs 0 near the ground around its dot and 1 near the dot's own level, which may slope as the light does. Half way between them
// lies the edge, so that the weights sum up to the area, however blurred it is.
#include "dots/centroids.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/median.hpp"
#include "dots/near_pairs.hpp"

namespace tactile {
namespace {

constexpr double INNER = 0.5, REACH = 1.5, GROUND = 1.7;  // radii of a dot: of its middle part, of its patch, of the ring of ground
constexpr int RING = 32, TURNS = 3;                       // samples of the ground; rings of the middle part
constexpr double TOP = 0.75;                              // rank of the middle part's levels that is a dot's: worn dots have holes
constexpr double LOW = 0.2, HIGH = 0.8;                   // of the way from ground to level, between which a weight rises from 0 to 1
constexpr double OTHER = 0.25;                            // of the rise: what a sample of the ground may be off it, else it is another dot
constexpr double PLATEAU = 0.9, GLARE = 1.3;              // of a dot's level, between which a pixel tells its slope
constexpr double COARSE = 4;                              // px, radius from which every second pixel tells a dot's size
constexpr double FEWEST = 12, STEEPEST = 0.05;            // px of that, and bound of the slope: per px
constexpr double LEAST_LEVEL = 0.5;                       // of the level of the middle part, to which a slope may fall
constexpr double SMALLER = 0.5, LARGER = 1.8;             // times the radius that was given: bounds of a dot's own
constexpr double HIDDEN = 5, LEAST_HIDDEN = 0.02;         // robust deviations of solidity, and of 1, from which a dot is hidden in part
constexpr double OF_SHIFT = 0.2, OF_SHAPE = 0.7;          // errors: of the shift by sloping light; of a radius by missing solidity
constexpr double LEAST_ERROR = 0.006;                     // px, that shapes and light leave which are not modelled; measured on recordings

// Sums over a patch of weights times 1, x, y, x x, y y, x y.
struct Sums {
    double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;

    void add(double weight, double u, double v) {
        n += weight, x += weight * u, y += weight * v;
        xx += weight * u * u, yy += weight * v * v, xy += weight * u * v;
    }
    double area() const { return std::max(n, 1.0); }
    // Of the central second moments, px^4; of an ellipse (area / (4 pi))^2.
    double determinant() const {
        const double a = area(), u = x / a, v = y / a;
        const double uv = xy / a - u * v;
        return std::max((xx / a - u * u) * (yy / a - v * v) - uv * uv, 1e-3);
    }
};

// A dot's level, relative to the rise from the ground, as a plane about a place; variance: about it.
struct Level {
    double mean = 1, along = 0, down = 0, u = 0, v = 0, variance = 0;
    double at(double x, double y) const { return std::max(mean + along * (x - u) + down * (y - v), LEAST_LEVEL); }
};

struct Placed {
    Dot dot;
    double solidity;
};

class Placer {
 public:
    Placer(const Image& image, int sign, const double* places, std::ptrdiff_t count, double diameter, double noise)
        : image_(image), sign_(sign), places_(places), radius_(diameter / 2), noise_(noise), near_(count) {
        for (const auto& [i, j] : near_pairs(places, count, (LARGER * REACH + 1) * radius_)) near_[i].push_back(j), near_[j].push_back(i);
        for (int k = 0; k < RING; ++k) way_[k][0] = std::cos(2 * M_PI * k / RING), way_[k][1] = std::sin(2 * M_PI * k / RING);
    }

    Placed place(std::ptrdiff_t i) {
        which_ = i;
        take(places_[2 * i], places_[2 * i + 1], radius_);
        const std::ptrdiff_t step = radius_ > COARSE ? 2 : 1;
        Sums rough;
        each(step, [&](double x, double y, double rise) { rough.add(ramp(rise), x, y); });
        const double own = std::sqrt(rough.area() * static_cast<double>(step * step) / M_PI);
        take(u_ + rough.x / rough.area(), v_ + rough.y / rough.area(), std::clamp(own, SMALLER * radius_, LARGER * radius_));
        Sums flat, found;
        const Level level = find_level(flat);
        double edge = 0;
        each(1, [&](double x, double y, double rise) {
            const double weight = ramp(rise / level.at(x, y));
            if (weight > 0) found.add(weight, x, y), edge += weight < 1;
        });
        const double area = found.area(), x = found.x / area, y = found.y / area;
        const double shift = OF_SHIFT * std::hypot(x - flat.x / flat.area(), y - flat.y / flat.area());
        const double by_noise =
            std::max(noise_ / amplitude_, std::sqrt(level.variance)) / (HIGH - LOW) * std::sqrt(edge / (2 * M_PI * area));
        return {{u_ + x, v_ + y, area, std::sqrt(by_noise * by_noise + shift * shift + LEAST_ERROR * LEAST_ERROR)},
                area / (4 * M_PI * std::sqrt(found.determinant()))};
    }

 private:
    double grey(std::ptrdiff_t row, std::ptrdiff_t column) const {
        row = std::clamp<std::ptrdiff_t>(row, 0, image_.rows - 1), column = std::clamp<std::ptrdiff_t>(column, 0, image_.columns - 1);
        return sign_ * static_cast<double>(image_.pixels[row * image_.columns + column]);
    }
    double ranked(double away, int turns, double rank) {
        samples_.clear();
        for (int turn = 1; turn <= turns; ++turn) {
            for (int k = 0; k < RING; ++k) {
                const double far = away * turn / turns;
                samples_.push_back(grey(std::lround(v_ + far * way_[k][1]), std::lround(u_ + far * way_[k][0])));
            }
        }
        return smallest(samples_, static_cast<std::ptrdiff_t>(rank * static_cast<double>(samples_.size())));
    }

    // Takes the patch of a dot of that radius about the pixel nearest to (u, v), its ground and its level.
    void take(double u, double v, double radius) {
        u_ = std::clamp<double>(std::round(u), 0, static_cast<double>(image_.columns - 1));
        v_ = std::clamp<double>(std::round(v), 0, static_cast<double>(image_.rows - 1));
        own_radius_ = radius;
        ground_ = ranked(GROUND * radius, 1, 0.5);
        const std::vector<double> ring = samples_;
        amplitude_ = std::max(ranked(INNER * radius, TURNS, TOP) - ground_, 1.0);
        along_ = down_ = 0;
        for (int k = 0; k < RING; ++k) {  // first harmonic, of which a neighbour spoils little
            const double off = std::clamp(ring[k] - ground_, -OTHER * amplitude_, OTHER * amplitude_) * 2 / (RING * GROUND * radius);
            along_ += off * way_[k][0], down_ += off * way_[k][1];
        }
    }

    static double ramp(double rise) { return std::clamp((rise - LOW) / (HIGH - LOW), 0.0, 1.0); }

    // Calls visit(x, y, rise) for each step-th pixel of the patch in a row, and row, that no other dot is nearer to.
    template <class Visit>
    void each(std::ptrdiff_t step, Visit visit) {
        const double reach = REACH * own_radius_, here_u = places_[2 * which_], here_v = places_[2 * which_ + 1];
        const auto row = static_cast<std::ptrdiff_t>(v_), column = static_cast<std::ptrdiff_t>(u_);
        const auto half = static_cast<std::ptrdiff_t>(reach);
        const double scale = 1 / amplitude_;
        for (std::ptrdiff_t y = std::max(-half, -row); y <= std::min(half, image_.rows - 1 - row); y += step) {
            const double v = static_cast<double>(y), level = ground_ + down_ * v;
            double last = std::sqrt(std::max(reach * reach - v * v, 0.0)), first = -last;
            for (const std::ptrdiff_t j : near_[which_]) {  // on our side of the line half way to it
                const double way_u = places_[2 * j] - here_u, way_v = places_[2 * j + 1] - here_v;
                const double left = (way_u * way_u + way_v * way_v) / 2 - (v_ + v - here_v) * way_v, most = left / way_u + here_u - u_;
                if (way_u > 0) last = std::min(last, most);
                if (way_u < 0) first = std::max(first, most);
                if (way_u == 0 && left < 0) last = first - 1;
            }
            const auto from = std::max(static_cast<std::ptrdiff_t>(std::ceil(std::min(first, reach + 1))), -column);
            const auto to = std::min(static_cast<std::ptrdiff_t>(std::floor(std::max(last, -reach - 1))), image_.columns - 1 - column);
            const std::uint8_t* pixel = image_.pixels + (row + y) * image_.columns + column;
            for (std::ptrdiff_t x = from; x <= to; x += step)
                visit(static_cast<double>(x), v, (sign_ * static_cast<double>(pixel[x]) - level - along_ * static_cast<double>(x)) * scale);
        }
    }

    // The plane through a dot's plateau; flat: sums of the weights without it.
    Level find_level(Sums& flat) {
        Sums on;
        double sum = 0, along = 0, down = 0, squares = 0;
        each(1, [&](double x, double y, double rise) {
            if (rise > LOW) flat.add(ramp(rise), x, y);
            if (rise > PLATEAU && rise < GLARE) on.add(1, x, y), sum += rise, along += rise * x, down += rise * y, squares += rise * rise;
        });
        if (on.n < FEWEST) return {};
        const double u = on.x / on.n, v = on.y / on.n, mean = sum / on.n;
        const double uu = on.xx / on.n - u * u, vv = on.yy / on.n - v * v, uv = on.xy / on.n - u * v;
        const double lu = along / on.n - mean * u, lv = down / on.n - mean * v, determinant = std::max(uu * vv - uv * uv, 1e-3);
        const double by_u = std::clamp((vv * lu - uv * lv) / determinant, -STEEPEST, STEEPEST);
        const double by_v = std::clamp((uu * lv - uv * lu) / determinant, -STEEPEST, STEEPEST);
        return {mean, by_u, by_v, u, v, std::max(squares / on.n - mean * mean - by_u * lu - by_v * lv, 0.0)};
    }

    const Image image_;
    const int sign_;
    const double* places_;
    const double radius_, noise_;
    std::vector<std::vector<std::ptrdiff_t>> near_;
    std::vector<double> samples_;
    double way_[RING][2];
    std::ptrdiff_t which_ = 0;
    double u_ = 0, v_ = 0, own_radius_ = 0, ground_ = 0, along_ = 0, down_ = 0, amplitude_ = 1;
};

}  // namespace

// Blur adds its square to both second moments, so that the solidity of a dot falls with its size: by as much as that of most dots.
std::vector<Dot> place_dots(const Image& image, int sign, const double* places, std::ptrdiff_t count, double diameter, double noise) {
    std::vector<Dot> dots;
    if (!count || !image.rows || !image.columns) return dots;
    Placer placer(image, sign, places, count, diameter, noise);
    std::vector<Placed> placed;
    std::vector<double> blurs, missing, sizes;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        placed.push_back(placer.place(i));
        blurs.push_back((1 / placed[i].solidity - 1) * placed[i].dot.area);
    }
    const double blur = std::max(median(blurs), 0.0);
    for (const Placed& one : placed) {
        missing.push_back(1 / (1 + blur / one.dot.area) - one.solidity);
        sizes.push_back(std::abs(missing.back()));
    }
    const double hidden = std::max(HIDDEN * SIGMA_PER_MAD * median(sizes), LEAST_HIDDEN);
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const double radius = std::sqrt(placed[i].dot.area / M_PI), u = placed[i].dot.u, v = placed[i].dot.v;
        const double inside = std::min({u, v, static_cast<double>(image.columns - 1) - u, static_cast<double>(image.rows - 1) - v});
        if (!(missing[i] < hidden && inside > radius + 0.5)) continue;
        dots.push_back(placed[i].dot);
        dots.back().sigma = std::hypot(dots.back().sigma, OF_SHAPE * radius * std::max(missing[i], 0.0));
    }
    return dots;
}

}  // namespace tactile
