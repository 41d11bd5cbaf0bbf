// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Fits of all dots of an image. Each is fitted alone first; those with neighbours in their patches again, after the neighbours' images are
// subtracted.
#include "dots/detect/dot_fits.hpp"

#include <algorithm>
#include <cmath>

#include "dots/detect/disc_patch.hpp"
#include "dots/index/neighbours.hpp"

namespace tactile {
namespace {

constexpr int FIRST_STEPS = 2;       // from a candidate. Chosen: a node further is refined at the end
constexpr double OFF_CENTRE = 0.9;   // px from the middle pixel beyond which a dot gets a new patch. Chosen; the nodes end at 1 px
constexpr double UNLIKE = 1.6;       // residual over contrast of an off-centre fit; no neighbour causes more, so more means no dot. Chosen
constexpr double CROWDED = 2.0;      // px over the diameter: dots nearer than this keep their patch, as fits may have moved to a neighbour
constexpr double SAME = 0.4;         // of the typical diameter: nearer candidates belong to one dot. Chosen
constexpr double MET = 0.15;         // of the typical diameter: fits that converge to within this distance belong to one dot. Chosen
constexpr double GAP = 1.5;          // px, gap between edges below which dots are fitted in turns from the start. Chosen
constexpr double RUN_OFF = 1.5;      // px from the patch's centre: a fit further away has diverged. Chosen
constexpr int ROUNDS = 5;            // of fits in turns. Chosen
constexpr double BELIEVABLE = 0.15;  // of the typical contrast: the images of fainter dots are not subtracted. Chosen

class Fits {
 public:
    Fits(const Image& image, const DiscModel& model, const DotLook& look) : image_(image), model_(model), look_(look), patch_(model) {}

    std::vector<DotFit> run(const double* places, std::ptrdiff_t count) {
        dots_.reserve(count);
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            if (std::isfinite(places[2 * i]) && std::isfinite(places[2 * i + 1])) begin(places[2 * i], places[2 * i + 1]);
        }
        find_neighbours();
        recentre();
        take_doubles();
        take_turns();
        subtract_neighbours();
        for (DotFit& dot : dots_) {
            if (!(nearest_node(dot.disc, model_) == dot.node)) fit(dot, 1);
            dot.variance = residual_variance(dot.patch, dot.node, model_);
        }
        return std::move(dots_);
    }

 private:
    // Index of the pixel nearest to a place, the first for NaN.
    static std::ptrdiff_t pixel(double place, std::ptrdiff_t count) {
        return place > 0 ? static_cast<std::ptrdiff_t>(std::min(place + 0.5, static_cast<double>(count - 1))) : 0;
    }
    double contrast(const DotFit& dot) const { return look_.contrast < 0 ? -dot.disc.amplitude : dot.disc.amplitude; }
    // px between the candidates.
    double began_apart(const DotFit& a, const DotFit& b) const { return std::hypot(a.start_u - b.start_u, a.start_v - b.start_v); }

    void cut(const DotFit& dot) { patch_.cut(image_, dot.column, dot.row, look_.ground); }
    void fit(DotFit& dot, int steps) { dot.disc = fit_disc(dot.patch, dot.disc, steps, model_, dot.node); }

    // Fits a dot alone, in the patch around its nearest pixel.
    void begin(double u, double v) {
        DotFit dot{};
        dot.start_u = u, dot.start_v = v;
        move(dot, u, v);
        dot.disc = {u - static_cast<double>(dot.column), v - static_cast<double>(dot.row), look_.typical, 0, 0};
        fit(dot, FIRST_STEPS);
        if (dot.away() > OFF_CENTRE) {
            const double most = UNLIKE * std::max(contrast(dot), 0.0);
            if (residual_variance(dot.patch, dot.node, model_) > most * most) return;
        }
        dots_.push_back(dot);
    }

    // Takes the patch around the pixel nearest to (u, v).
    void move(DotFit& dot, double u, double v) {
        dot.column = pixel(u, image_.columns);
        dot.row = pixel(v, image_.rows);
        patch_.compress(image_, dot.column, dot.row, look_.ground, dot.patch);
    }

    // Lists, for each dot, the dots that may appear in its patch: neighbours_ from first_[i] to first_[i + 1].
    void find_neighbours() {
        std::vector<double> places;
        for (const DotFit& dot : dots_) places.push_back(dot.start_u), places.push_back(dot.start_v);
        const double reach = static_cast<double>(model_.half) + model_.largest / 2 + 2 * model_.blur;
        const auto pairs = near_pairs(places.data(), static_cast<std::ptrdiff_t>(dots_.size()), reach);
        first_.assign(dots_.size() + 1, 0);
        for (const auto& [i, j] : pairs) ++first_[i + 1], ++first_[j + 1];
        for (std::size_t i = 0; i < dots_.size(); ++i) first_[i + 1] += first_[i];
        neighbours_.resize(2 * pairs.size());
        std::vector<std::int32_t> next(first_.begin(), first_.end() - 1);
        for (const auto& [i, j] : pairs) neighbours_[next[i]++] = j, neighbours_[next[j]++] = i;
    }

    template <class Call>
    void for_neighbours(std::size_t i, Call call) const {
        for (std::int32_t k = first_[i]; k < first_[i + 1]; ++k) call(static_cast<std::size_t>(neighbours_[k]));
    }

    // Fits off-centre dots again in patches around their fitted positions.
    void recentre() {
        for (std::size_t i = 0; i < dots_.size(); ++i) {
            DotFit& dot = dots_[i];
            if (!(dot.away() > OFF_CENTRE) || !(contrast(dot) > 0)) continue;
            bool crowded = false;
            for_neighbours(i, [&](std::size_t j) { crowded |= began_apart(dot, dots_[j]) < look_.typical + CROWDED; });
            if (crowded) continue;
            const double u = dot.u(), v = dot.v();
            move(dot, u, v);
            dot.disc.u = u - static_cast<double>(dot.column), dot.disc.v = v - static_cast<double>(dot.row);
            fit(dot, FIRST_STEPS);
        }
    }

    // Of two fits of one dot, the first alone is single.
    void take_doubles() {
        for (std::size_t i = 0; i < dots_.size(); ++i) {
            for_neighbours(i, [&](std::size_t j) {
                const DotFit &dot = dots_[i], &other = dots_[j];
                if (j < i && (began_apart(dot, other) < SAME * look_.typical ||
                              std::hypot(dot.u() - other.u(), dot.v() - other.v()) < MET * look_.typical)) {
                    dots_[i].single = false;
                }
            });
        }
    }

    bool is_solid(const DotFit& dot) const { return dot.single && contrast(dot) > BELIEVABLE * std::abs(look_.contrast); }

    // Fits overlapping dots in alternation from their candidates, each without the others' images.
    void take_turns() {
        overlaps_.assign(dots_.size(), 0);
        std::vector<std::pair<std::size_t, std::size_t>> pairs;
        for (std::size_t i = 0; i < dots_.size(); ++i) {
            if (!is_solid(dots_[i])) continue;
            for_neighbours(i, [&](std::size_t j) {
                if (!is_solid(dots_[j]) || began_apart(dots_[i], dots_[j]) >= look_.typical + GAP) return;
                pairs.emplace_back(i, j);
                overlaps_[i] = 1;
            });
        }
        for (std::size_t i = 0; i < dots_.size(); ++i) {
            DotFit& dot = dots_[i];
            if (!overlaps_[i]) continue;
            dot.disc.u = dot.start_u - static_cast<double>(dot.column), dot.disc.v = dot.start_v - static_cast<double>(dot.row);
            dot.disc.diameter = look_.typical;
        }
        for (int round = 0; round < ROUNDS; ++round) fit_without(pairs);
    }

    // Fits the first dots of pairs, sorted, one step further without the images of the second as they are now.
    void fit_without(const std::vector<std::pair<std::size_t, std::size_t>>& pairs) {
        std::vector<DotFit> fitted;
        for (std::size_t k = 0; k < pairs.size();) {
            DotFit dot = dots_[pairs[k].first];
            cut(dot);
            for (const std::size_t i = pairs[k].first; k < pairs.size() && pairs[k].first == i; ++k) subtract(dot, dots_[pairs[k].second]);
            patch_.compress(dot.patch);
            fit(dot, 1);
            fitted.push_back(dot);
        }
        std::size_t next = 0;
        for (std::size_t k = 0; k < pairs.size(); ++k) {
            if (k == 0 || pairs[k].first != pairs[k - 1].first) dots_[pairs[k].first] = fitted[next++];
        }
    }

    void subtract(const DotFit& dot, const DotFit& other) {
        const double u = other.u() - static_cast<double>(dot.column), v = other.v() - static_cast<double>(dot.row);
        if (std::isfinite(u + v + other.disc.diameter + other.disc.amplitude))
            patch_.subtract(u, v, other.disc.diameter, other.disc.amplitude);
    }

    // Whether the fit models the image; one that diverged without an overlapping neighbour, as under glare, does not.
    bool is_settled(std::size_t j) const {
        const DotFit& dot = dots_[j];
        return is_solid(dot) && (overlaps_[j] || (dot.away() < RUN_OFF && dot.disc.diameter < model_.largest));
    }

    // Fits each dot that has neighbours in its patch one step further without their images.
    void subtract_neighbours() {
        std::vector<std::uint8_t> settled(dots_.size());
        for (std::size_t j = 0; j < dots_.size(); ++j) settled[j] = is_settled(j);
        std::vector<std::pair<std::size_t, std::size_t>> pairs;
        for (std::size_t i = 0; i < dots_.size(); ++i) {
            const DotFit& dot = dots_[i];
            if (!dot.single) continue;
            for_neighbours(i, [&](std::size_t j) {
                const double reach = static_cast<double>(model_.half) + dots_[j].disc.diameter / 2 + model_.blur;
                const bool seen = std::abs(static_cast<double>(dot.column) - dots_[j].u()) < reach &&
                                  std::abs(static_cast<double>(dot.row) - dots_[j].v()) < reach;
                if (settled[j] && seen) pairs.emplace_back(i, j);
            });
        }
        fit_without(pairs);
    }

    const Image image_;
    const DiscModel& model_;
    const DotLook look_;
    DiscPatch patch_;
    std::vector<DotFit> dots_;
    std::vector<std::int32_t> first_, neighbours_;
    std::vector<std::uint8_t> overlaps_;
};

}  // namespace

double DotFit::away() const {
    return std::max(std::abs(disc.u), std::abs(disc.v));
}

std::vector<DotFit> fit_dots(const Image& image, const double* places, std::ptrdiff_t count, const DiscModel& model, const DotLook& look) {
    if (image.rows == 0 || image.columns == 0) return {};
    return Fits(image, model, look).run(places, count);
}

}  // namespace tactile
