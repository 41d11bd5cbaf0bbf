// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Rejects fits that are not dots. A fit is rejected, too, where dirt, glare or a neighbour may have shifted it: a missed dot does less harm
// than a wrong one.
#include "dots/detect/dot_judge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/median.hpp"
#include "common/pi.hpp"
#include "dots/detect/ground_slopes.hpp"

namespace tactile {
namespace {

constexpr double FAINTEST = 0.2;                         // of the typical contrast. Chosen
constexpr double FARTHEST = 1.4;                         // px from the middle of the patch. Chosen: the model's nodes end at 1 px
constexpr double CELL = 2.5;                             // typical diameters, about a pitch: side of a cell of ground_slopes
constexpr double PLAIN_NOISE = 4.0;                      // residual in standard deviations of a pixel that any dot may have. Chosen
constexpr double PLAIN_TYPICAL = 0.1, PLAIN_OWN = 0.12;  // the same as a share of the typical contrast, and of the dot's own. Chosen
constexpr double USUAL = 1.7, USUAL_MOST = 0.2;          // times the median ratio of residual to contrast, and its bound. Chosen
constexpr double UNUSUAL = 2.5, UNLIKEST = 0.3;          // the same where dots were unlike discs from the start. Chosen
constexpr double SAME_KIND = 1.2;  // times the median ratio when the appearance was measured: bounds the median. Chosen

class Judge {
 public:
    Judge(const Image& image, const std::vector<DotFit>& fits, const DiscModel& model, const DotLook& look, double usual)
        : image_(image), fits_(fits), model_(model), look_(look), usual_(usual), good_(fits.size()) {}

    JudgedDots run() {
        for (std::size_t i = 0; i < fits_.size(); ++i) good_[i] = is_strong(fits_[i]);
        keep_discs();
        JudgedDots judged{{}, false, usual_};
        for (std::size_t i = 0; i < fits_.size(); ++i) {
            const DotFit& fit = fits_[i];
            good_[i] = good_[i] && fit.away() < FARTHEST && is_inside(fit);
            judged.outgrown |= good_[i] && fit.disc.diameter >= model_.largest;
            good_[i] = good_[i] && fit.disc.diameter < model_.largest && fit.single;
        }
        measure(judged.dots);
        return judged;
    }

 private:
    double contrast(const DotFit& fit) const { return look_.contrast < 0 ? -fit.disc.amplitude : fit.disc.amplitude; }

    bool is_strong(const DotFit& fit) const {
        return contrast(fit) > FAINTEST * std::abs(look_.contrast) && fit.disc.diameter > model_.smallest && std::isfinite(fit.variance) &&
               std::isfinite(fit.u() + fit.v() + fit.disc.amplitude + fit.disc.ground);
    }

    bool is_inside(const DotFit& fit) const {
        const double across = std::min(fit.u(), static_cast<double>(image_.columns - 1) - fit.u());
        const double down = std::min(fit.v(), static_cast<double>(image_.rows - 1) - fit.v());
        return std::min(across, down) >= fit.disc.diameter / 2 + model_.blur - 0.5;
    }

    // Keeps fits with a small residual. The limit rises where all dots differ from discs, as after lossy compression, and further if they
    // did when the appearance was measured, as irregularly printed dots do.
    void keep_discs() {
        std::vector<double> ratios;
        for (std::size_t i = 0; i < fits_.size(); ++i) {
            if (good_[i]) ratios.push_back(std::sqrt(fits_[i].variance) / contrast(fits_[i]));
        }
        if (ratios.empty()) return;
        const double now = median(std::move(ratios));
        if (std::isnan(usual_)) usual_ = now;
        const double raised = std::max(std::min(USUAL * now, USUAL_MOST), std::min(UNUSUAL * std::min(now, SAME_KIND * usual_), UNLIKEST));
        const double plain = std::max(PLAIN_NOISE * look_.noise, PLAIN_TYPICAL * std::abs(look_.contrast));
        for (std::size_t i = 0; i < fits_.size(); ++i) {
            const double rest = std::sqrt(fits_[i].variance), own = contrast(fits_[i]);
            good_[i] = good_[i] && (rest < std::max(plain, PLAIN_OWN * own) || rest < raised * own);
        }
    }

    // Positions corrected for the bias by sloping light, which scales dot and ground alike.
    void measure(std::vector<Dot>& dots) const {
        std::vector<double> grounds(fits_.size());
        for (std::size_t i = 0; i < fits_.size(); ++i) grounds[i] = fits_[i].disc.ground + look_.ground;
        const std::vector<GroundSlope> slopes = ground_slopes(fits_, grounds, good_, CELL * look_.typical);
        for (std::size_t i = 0; i < fits_.size(); ++i) {
            if (!good_[i]) continue;
            const DotFit& fit = fits_[i];
            const std::ptrdiff_t size = fit.node.size;
            const std::ptrdiff_t node = (size * model_.phases + std::abs(fit.node.down)) * model_.phases + std::abs(fit.node.across);
            const double lever = model_.levers[2 * size] * grounds[i] / fit.disc.amplitude + model_.levers[2 * size + 1];
            dots.push_back({fit.u() - lever * slopes[i].along_u, fit.v() - lever * slopes[i].along_v,
                            PI / 4 * fit.disc.diameter * fit.disc.diameter,
                            std::sqrt(fit.variance * model_.gains[node]) / std::abs(fit.disc.amplitude)});
        }
    }

    const Image image_;
    const std::vector<DotFit>& fits_;
    const DiscModel& model_;
    const DotLook look_;
    double usual_;
    std::vector<std::uint8_t> good_;
};

}  // namespace

JudgedDots judge_dots(const Image& image, const std::vector<DotFit>& fits, const DiscModel& model, const DotLook& look, double usual) {
    return Judge(image, fits, model, look, usual).run();
}

}  // namespace tactile
