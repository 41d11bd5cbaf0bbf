// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/finder.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/median.hpp"
#include "dots/near_pairs.hpp"
#include "dots/peaks.hpp"

namespace tactile {
namespace {

// Fits of all dots of an image. Each is fitted alone first; those with neighbours in their patches again, after the neighbours' images are
// subtracted.

constexpr int FIRST_STEPS = 2;  // from a candidate; a node further is refined at the end

// A candidate and its fit.
struct DotFit {
    double start_u, start_v;     // px, of the candidate
    std::ptrdiff_t column, row;  // middle pixel of its patch
    Disc disc;                   // relative to that pixel; its ground relative to that of the appearance
    DiscNode node;               // of the last step
    bool single = true;          // false: a second fit of another's dot
    double variance = 0;         // of the residual, grey levels^2
    float patch[DIMENSIONS];     // compressed

    double u() const { return static_cast<double>(column) + disc.u; }
    double v() const { return static_cast<double>(row) + disc.v; }
    // px from the middle pixel: the larger of both axes.
    double offset() const { return std::max(std::abs(disc.u), std::abs(disc.v)); }
};

// Fits dots near positions u, v, u, v, ..., px; where dots overlap or are close, each without its neighbours' images.
class Fits {
 public:
    Fits(const Image& image, const DiscModel& model, const DotLook& look, const DotLimits& limits)
        : image_(image), model_(model), look_(look), limits_(limits), patch_(model) {}

    std::vector<DotFit> run(const std::vector<double>& positions) {
        dots_.reserve(positions.size() / 2);
        for (std::size_t i = 0; i < positions.size(); i += 2) add(positions[i], positions[i + 1]);
        find_neighbours();
        mark_doubles();
        subtract_neighbours();
        for (DotFit& dot : dots_) {
            if (!(nearest_node(dot.disc, model_) == dot.node)) fit(dot, 1);
            dot.variance = residual_variance(dot.patch, dot.node, model_);
        }
        return std::move(dots_);
    }

 private:
    // Index of the pixel nearest to a coordinate.
    static std::ptrdiff_t pixel(double coordinate, std::ptrdiff_t count) {
        return coordinate > 0 ? static_cast<std::ptrdiff_t>(std::min(coordinate + 0.5, static_cast<double>(count - 1))) : 0;
    }
    double contrast(const DotFit& dot) const { return look_.contrast < 0 ? -dot.disc.amplitude : dot.disc.amplitude; }
    // Whether a step is shorter than this share of the typical diameter.
    bool is_short(double u, double v, double share) const { return u * u + v * v < share * look_.typical * (share * look_.typical); }

    void cut(const DotFit& dot) { patch_.cut(image_, dot.column, dot.row, look_.ground); }
    void fit(DotFit& dot, int steps) { dot.disc = fit_disc(dot.patch, dot.disc, steps, model_, dot.node); }

    // Fits a dot alone, in the patch around its nearest pixel.
    void add(double u, double v) {
        DotFit dot{};
        dot.start_u = u, dot.start_v = v;
        move(dot, u, v);
        dot.disc = {u - static_cast<double>(dot.column), v - static_cast<double>(dot.row), look_.typical, 0, 0};
        fit(dot, FIRST_STEPS);
        dots_.push_back(dot);
    }

    // Takes the patch around the pixel nearest to (u, v).
    void move(DotFit& dot, double u, double v) {
        dot.column = pixel(u, image_.columns);
        dot.row = pixel(v, image_.rows);
        cut(dot);
        patch_.compress(dot.patch);
    }

    // Lists, for each dot, the dots that may appear in its patch: neighbours_ from first_[i] to first_[i + 1].
    void find_neighbours() {
        std::vector<double> positions;
        for (const DotFit& dot : dots_) positions.push_back(dot.start_u), positions.push_back(dot.start_v);
        const double reach = static_cast<double>(model_.half) + model_.largest / 2 + 2 * model_.blur;
        const auto pairs = near_pairs(positions.data(), static_cast<std::ptrdiff_t>(dots_.size()), reach);
        first_.assign(dots_.size() + 1, 0);
        for (const auto& [i, j] : pairs) ++first_[i + 1], ++first_[j + 1];
        for (std::size_t i = 0; i < dots_.size(); ++i) first_[i + 1] += first_[i];
        neighbours_.resize(2 * pairs.size());
        std::vector<std::int32_t> next(first_.begin(), first_.end() - 1);
        for (const auto& [i, j] : pairs) neighbours_[next[i]++] = j, neighbours_[next[j]++] = i;
    }

    template <class Call>
    void for_each_neighbour(std::size_t i, Call call) const {
        for (std::int32_t k = first_[i]; k < first_[i + 1]; ++k) call(static_cast<std::size_t>(neighbours_[k]));
    }

    // Of two fits of one dot, the first alone is single.
    void mark_doubles() {
        for (std::size_t i = 0; i < dots_.size(); ++i) {
            for_each_neighbour(i, [&](std::size_t j) {
                const DotFit &dot = dots_[i], &other = dots_[j];
                if (j < i && (is_short(dot.start_u - other.start_u, dot.start_v - other.start_v, limits_.same) ||
                              is_short(dot.u() - other.u(), dot.v() - other.v(), limits_.met))) {
                    dots_[i].single = false;
                }
            });
        }
    }

    void subtract(const DotFit& dot, const DotFit& other) {
        const double u = other.u() - static_cast<double>(dot.column), v = other.v() - static_cast<double>(dot.row);
        if (std::isfinite(u + v + other.disc.diameter + other.disc.amplitude))
            patch_.subtract(u, v, other.disc.diameter, other.disc.amplitude);
    }

    // Whether the fit models the image; one that diverged, as under glare, does not.
    bool is_settled(const DotFit& dot) const {
        return dot.single && contrast(dot) > limits_.faintest * std::abs(look_.contrast) && dot.offset() < limits_.farthest &&
               dot.disc.diameter < model_.largest;
    }

    // Fits each dot that has neighbours in its patch one step further without their images, as they are fitted alone.
    void subtract_neighbours() {
        std::vector<std::size_t> changed;
        for (std::size_t i = 0; i < dots_.size(); ++i) {
            if (!dots_[i].single) continue;
            bool any = false;
            for_each_neighbour(i, [&](std::size_t j) {
                const DotFit &dot = dots_[i], &other = dots_[j];
                const double reach = static_cast<double>(model_.half) + other.disc.diameter / 2 + model_.blur;
                if (!is_settled(other) || !(std::abs(static_cast<double>(dot.column) - other.u()) < reach) ||
                    !(std::abs(static_cast<double>(dot.row) - other.v()) < reach)) {
                    return;
                }
                if (!any) cut(dot);
                any = true;
                subtract(dot, other);
            });
            if (!any) continue;
            patch_.compress(dots_[i].patch);
            changed.push_back(i);
        }
        for (const std::size_t i : changed) fit(dots_[i], 1);
    }

    const Image image_;
    const DiscModel& model_;
    const DotLook look_;
    const DotLimits& limits_;
    DiscPatch patch_;
    std::vector<DotFit> dots_;
    std::vector<std::int32_t> first_, neighbours_;
};

// Slopes of the ground from the fitted grounds of neighbouring dots: a slope fitted within each dot's own small patch would cost up to half
// of the position's accuracy.

constexpr double MIN_GROUND = 0.2;      // grey levels: a darker ground gets slope zero
constexpr double MIN_PLANE_DOTS = 3.5;  // dots of a plane: four
constexpr double MIN_SPREAD = 0.02;     // cells^4, determinant of the dots' second moments per dot: less is a line of dots

// Slopes of the ground along u and v, relative to it, per px.
struct GroundSlope {
    double along_u = 0, along_v = 0;
};

// Sums over dots of 1, u, v, ground, uu, uv, vv, u ground, v ground.
using Sums = Eigen::Array<double, 9, 1>;

// The least-squares plane through the dots that were summed; u and v in cells.
GroundSlope plane(const Sums& sums, double cell) {
    if (sums[0] < MIN_PLANE_DOTS) return {};
    const double n = sums[0], u = sums[1] / n, v = sums[2] / n, ground = sums[3] / n;
    const double uu = sums[4] - n * u * u, uv = sums[5] - n * u * v, vv = sums[6] - n * v * v;
    const double ug = sums[7] - n * u * ground, vg = sums[8] - n * v * ground, determinant = uu * vv - uv * uv;
    if (!(determinant > MIN_SPREAD * n * n && ground > MIN_GROUND)) return {};
    const double scale = 1 / (determinant * ground * cell);
    return {(vv * ug - uv * vg) * scale, (uu * vg - uv * ug) * scale};
}

// The slope at each dot, from the grounds of the used dots in its cell, of that side, px, and in the eight cells around; 0 elsewhere.
std::vector<GroundSlope> ground_slopes(const std::vector<DotFit>& dots, const std::vector<double>& grounds,
                                       const std::vector<std::uint8_t>& used, double cell) {
    // the pixel of a dot is inside the image, which bounds the number of cells
    std::ptrdiff_t columns = 1, rows = 1;
    const auto index = [cell](std::ptrdiff_t pixel) { return static_cast<std::ptrdiff_t>(static_cast<double>(pixel) / cell) + 1; };
    for (const DotFit& dot : dots) columns = std::max(columns, index(dot.column) + 2), rows = std::max(rows, index(dot.row) + 2);
    const auto cell_of = [&](const DotFit& dot) { return index(dot.row) * columns + index(dot.column); };
    std::vector<Sums> cells(columns * rows, Sums::Zero());  // with a margin
    for (std::size_t i = 0; i < dots.size(); ++i) {
        if (!used[i]) continue;
        // from the middle of the image, so that differences of sums stay exact enough
        const double u = dots[i].u() / cell - static_cast<double>(columns) / 2, v = dots[i].v() / cell - static_cast<double>(rows) / 2,
                     g = grounds[i];
        const Sums terms{1, u, v, g, u * u, u * v, v * v, u * g, v * g};
        cells[cell_of(dots[i])] += terms;
    }
    std::vector<GroundSlope> slopes(dots.size());
    for (std::size_t i = 0; i < dots.size(); ++i) {
        if (!used[i]) continue;
        Sums around = Sums::Zero();
        const std::ptrdiff_t middle = cell_of(dots[i]);
        for (const std::ptrdiff_t row : {middle - columns, middle, middle + columns}) {
            for (std::ptrdiff_t at = row - 1; at <= row + 1; ++at) around += cells[at];
        }
        slopes[i] = plane(around, cell);
    }
    return slopes;
}

// Rejects fits that are not dots. A fit is rejected, too, where dirt, glare or a neighbour may have shifted it: a missed dot does less harm
// than a wrong one.

constexpr double CELL_SIDE = 2.5;  // typical diameters, about a pitch: side of a cell of ground_slopes

class Judge {
 public:
    Judge(const Image& image, const std::vector<DotFit>& fits, const DiscModel& model, const DotLook& look, const DotLimits& limits)
        : image_(image), fits_(fits), model_(model), look_(look), limits_(limits), good_(fits.size()) {}

    FoundDots run() {
        for (std::size_t i = 0; i < fits_.size(); ++i) good_[i] = is_strong(fits_[i]);
        keep_discs();
        FoundDots found;
        for (std::size_t i = 0; i < fits_.size(); ++i) {
            const DotFit& fit = fits_[i];
            good_[i] = good_[i] && fit.offset() < limits_.farthest && is_inside(fit);
            found.outgrown |= good_[i] && fit.disc.diameter >= model_.largest;
            good_[i] = good_[i] && fit.disc.diameter < model_.largest && fit.single;
        }
        measure(found);
        return found;
    }

 private:
    double contrast(const DotFit& fit) const { return look_.contrast < 0 ? -fit.disc.amplitude : fit.disc.amplitude; }

    bool is_strong(const DotFit& fit) const {
        return contrast(fit) > limits_.faintest * std::abs(look_.contrast) && fit.disc.diameter > model_.smallest &&
               std::isfinite(fit.variance) && std::isfinite(fit.u() + fit.v() + fit.disc.amplitude + fit.disc.ground);
    }

    bool is_inside(const DotFit& fit) const {
        const double across = std::min(fit.u(), static_cast<double>(image_.columns - 1) - fit.u());
        const double down = std::min(fit.v(), static_cast<double>(image_.rows - 1) - fit.v());
        return std::min(across, down) >= fit.disc.diameter / 2 + model_.blur - 0.5;
    }

    // Keeps fits with a small residual. The limit rises where all dots differ from discs, by print or by lossy compression.
    void keep_discs() {
        std::vector<double> ratios;
        for (std::size_t i = 0; i < fits_.size(); ++i) {
            if (good_[i]) ratios.push_back(std::sqrt(fits_[i].variance) / contrast(fits_[i]));
        }
        if (ratios.empty()) return;
        const double share = std::clamp(limits_.usual * median(std::move(ratios)), limits_.plain, limits_.unlikest);
        for (std::size_t i = 0; i < fits_.size(); ++i) {
            good_[i] = good_[i] && std::sqrt(fits_[i].variance) < std::max(limits_.noise * look_.noise, share * contrast(fits_[i]));
        }
    }

    // Positions corrected for the bias by sloping light, which scales dot and ground alike.
    void measure(FoundDots& found) const {
        std::vector<double> grounds(fits_.size());
        for (std::size_t i = 0; i < fits_.size(); ++i) grounds[i] = fits_[i].disc.ground + look_.ground;
        const std::vector<GroundSlope> slopes = ground_slopes(fits_, grounds, good_, CELL_SIDE * look_.typical);
        for (std::size_t i = 0; i < fits_.size(); ++i) {
            if (!good_[i]) continue;
            const DotFit& fit = fits_[i];
            const std::ptrdiff_t size = fit.node.size;
            const std::ptrdiff_t node = (size * model_.phases + std::abs(fit.node.down)) * model_.phases + std::abs(fit.node.across);
            const double lever = model_.levers[2 * size] * grounds[i] / fit.disc.amplitude + model_.levers[2 * size + 1];
            found.add({fit.u() - lever * slopes[i].along_u, fit.v() - lever * slopes[i].along_v,
                            M_PI / 4 * fit.disc.diameter * fit.disc.diameter,
                            std::sqrt(fit.variance * model_.gains[node]) / std::abs(fit.disc.amplitude)});
        }
    }

    const Image image_;
    const std::vector<DotFit>& fits_;
    const DiscModel& model_;
    const DotLook look_;
    const DotLimits& limits_;
    std::vector<std::uint8_t> good_;
};

}  // namespace

DotFinder::DotFinder(std::shared_ptr<const DiscModel> model, const DotLook& look, const DotLimits& limits)
    : model_(std::move(model)), look_(look), limits_(limits) {}

FoundDots DotFinder::find(const Image& image) const {
    std::vector<double> candidates = find_peaks(image, look_);
    const std::vector<DotFit> fits = Fits(image, *model_, look_, limits_).run(candidates);
    FoundDots found = Judge(image, fits, *model_, look_, limits_).run();
    const auto whole = [this](double coordinate) { return (coordinate + 0.5) * look_.step - 0.5; };
    for (double& coordinate : found.uv) coordinate = whole(coordinate);
    for (double& area : found.area) area *= look_.step * look_.step;
    for (double& sigma : found.sigma) sigma *= look_.step;
    std::transform(candidates.begin(), candidates.end(), candidates.begin(), whole);
    found.candidates = std::move(candidates);
    return found;
}

}  // namespace tactile
