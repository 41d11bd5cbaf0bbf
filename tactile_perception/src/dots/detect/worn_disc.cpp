// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Subpixel positions of worn discs: Gauss-Newton with Tukey's biweight, which rejects missing ink and dirt.
#include "dots/detect/worn_disc.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/cholesky.hpp"
#include "common/median.hpp"
#include "dots/detect/disc_model.hpp"

namespace tactile {
namespace {

constexpr int STEPS = 8;                         // iterations at most. Chosen
constexpr double SETTLED = 0.01;                 // px, median step at convergence. Chosen: a third of MODEL
constexpr float EDGE = 0.9f;                     // px, half width of the soft edge. Chosen: slightly over that of an averaged sharp edge
constexpr float TUKEY = 3.0f;                    // standard deviations beyond which a pixel has no weight. Chosen: wear is common
constexpr double SPREAD = 0.1;                   // relative standard deviation of diameters, prior. Chosen: print and pressing
constexpr double TEXTURE = 15.0;                 // correlated pixels of texture, by which the prior's weight is multiplied. Chosen
constexpr double FARTHEST = 0.45;                // radii, bound of the shift from the detection. Chosen
constexpr double SMALLEST = 0.6, LARGEST = 1.5;  // bounds of the radius over the typical one. Chosen
constexpr double LONGEST = 1.0, LONGEST_SIZE = 0.15;  // px and typical radii, longest step. Chosen
constexpr double BLOCK = 1.5;                         // radii, side of the block over which residuals of wear correlate. Chosen
constexpr std::size_t EVERY = 4;                      // discs, of which one tells that correlation: bounds the time. Chosen
constexpr double RIDGE = 1e-3;                        // grey levels squared per unit squared: keeps flat patches solvable
constexpr double UNSEEN = 1.6;                        // factor of the standard deviation: chips shift an edge without residual (measured)
constexpr double MODEL = 0.03;                        // px, error of the edge model. Chosen
constexpr float LEAST_VARIANCE = 1e-6f;               // grey levels^2

constexpr std::size_t LEVELS = 4, UNKNOWNS = 7;  // ground, its slopes, amplitude; and u, v, radius
using Matrix = std::array<std::array<double, UNKNOWNS>, UNKNOWNS>;
using Vector = std::array<double, UNKNOWNS>;

// Normal equations of the first n unknowns, solved by Cholesky's method; NaN where they cannot be.
class Equations {
 public:
    Equations(const Matrix& matrix, std::size_t n)
        : n_(static_cast<int>(n)), factor_(matrix), solvable_(factorise(factor_[0].data(), n_, UNKNOWNS, LEAST_PIVOT)) {}
    Vector solve(Vector right) const {
        if (!solvable_) right.fill(std::numeric_limits<double>::quiet_NaN());
        substitute(factor_[0].data(), n_, UNKNOWNS, right.data());
        std::fill(right.begin() + n_, right.end(), 0.0);
        return right;
    }

 private:
    const int n_;
    Matrix factor_;
    const bool solvable_;
};

double bounded(double value, double most) {
    return std::isnan(value) ? 0 : std::clamp(value, -most, most);
}

struct State {
    std::ptrdiff_t column, row;  // of the patch's middle pixel
    double start_u, start_v;     // px from it
    double u, v, radius;
    double own = 0;  // variance of the centre along an axis by independent pixels, over STEPS
};

class Fitter {
 public:
    Fitter(const FloatImage& image, double radius, double ring)
        : image_(image), unit_(radius), ring_(ring), half_(static_cast<std::ptrdiff_t>(std::ceil(ring * radius + 2))) {
        const std::size_t most = padded((2 * half_ + 1) * (2 * half_ + 1));
        for (auto* values : {&x_, &y_, &value_, &window_, &weight_, &rest_, &weighted_}) values->resize(most);
        pixel_.resize(most);
        for (auto& column : columns_) column.resize(most);
    }

    std::vector<WornDisc> run(const double* places, std::ptrdiff_t count) {
        std::vector<State> discs;
        for (std::ptrdiff_t i = 0; i < count; ++i) discs.push_back(begin(places[2 * i], places[2 * i + 1]));
        std::vector<double> moved(count), radii(count), correlated;
        for (int step = 0; step < STEPS && count > 0; ++step) {
            std::transform(discs.begin(), discs.end(), radii.begin(), [](const State& disc) { return disc.radius; });
            const double typical = median(radii);
            correlated.clear();
            for (std::size_t i = 0; i < discs.size(); ++i) {
                moved[i] = advance(discs[i], typical);
                if (i % EVERY > 0) continue;
                const double pixels = correlated_pixels();
                if (std::isfinite(pixels)) correlated.push_back(pixels);
            }
            if (median(moved) < SETTLED) break;
        }
        const double pixels = correlated.empty() ? 1 : std::max(median(correlated), 1.0);
        std::vector<WornDisc> found;
        for (const State& disc : discs) {
            found.push_back({static_cast<double>(disc.column) + disc.u, static_cast<double>(disc.row) + disc.v, disc.radius,
                             std::sqrt(UNSEEN * UNSEEN * std::max(disc.own, 0.0) * pixels + MODEL * MODEL)});
        }
        return found;
    }

 private:
    State begin(double u, double v) const {
        const auto pixel = [](double place, std::ptrdiff_t count) {
            return static_cast<std::ptrdiff_t>(std::clamp(place + 0.5, 0.0, static_cast<double>(count - 1)));
        };
        State disc{pixel(u, image_.columns), pixel(v, image_.rows), 0, 0, 0, 0, unit_};
        disc.u = disc.start_u = bounded(u - static_cast<double>(disc.column), static_cast<double>(half_));
        disc.v = disc.start_v = bounded(v - static_cast<double>(disc.row), static_cast<double>(half_));
        return disc;
    }

    // Collects the pixels of disc and ring, row by row.
    void collect(const State& disc, double typical) {
        const double outer = ring_ * typical + 0.5;
        count_ = 0;
        for (std::ptrdiff_t down = -half_; down <= half_; ++down) {
            const double y = static_cast<double>(down) - disc.v, square = outer * outer - y * y;
            if (!(square > 0)) continue;
            const double reach = std::sqrt(square), middle = static_cast<double>(half_);
            const auto first = static_cast<std::ptrdiff_t>(std::ceil(std::max(disc.u - reach, -middle)));
            const auto last = static_cast<std::ptrdiff_t>(std::floor(std::min(disc.u + reach, middle)));
            const float* row = image_.pixels + std::clamp<std::ptrdiff_t>(disc.row + down, 0, image_.rows - 1) * image_.columns;
            for (std::ptrdiff_t across = first; across <= last; ++across, ++count_) {
                x_[count_] = static_cast<float>(static_cast<double>(across) - disc.u);
                y_[count_] = static_cast<float>(y);
                pixel_[count_] = static_cast<std::int32_t>((down + half_) * (2 * half_ + 1) + across + half_);
                value_[count_] = row[std::clamp<std::ptrdiff_t>(disc.column + across, 0, image_.columns - 1)];
            }
        }
        lanes_ = padded(count_);
        for (std::ptrdiff_t k = count_; k < lanes_; ++k) x_[k] = y_[k] = value_[k] = 0;
    }

    // Columns of the model: ground, its slopes, disc, and the disc's derivatives by position and radius.
    void model(const State& disc, double typical) {
        const auto outer = static_cast<float>(ring_ * typical + 0.5), radius = static_cast<float>(disc.radius),
                   unit = static_cast<float>(1 / unit_);
        for (std::ptrdiff_t k = 0; k < lanes_; ++k) {
            const float away = std::sqrt(x_[k] * x_[k] + y_[k] * y_[k]) + 1e-3f;
            const float up = std::min(std::max((radius - away) / (2 * EDGE) + 0.5f, 0.0f), 1.0f);
            const float edge = 6 * up * (1 - up) / (2 * EDGE);
            columns_[0][k] = 1;
            columns_[1][k] = x_[k] * unit;
            columns_[2][k] = y_[k] * unit;
            columns_[3][k] = up * up * (3 - 2 * up);
            columns_[4][k] = edge * x_[k] / away;
            columns_[5][k] = edge * y_[k] / away;
            columns_[6][k] = edge;
            window_[k] = std::min(std::max(outer - away, 0.0f), 1.0f);
        }
        for (std::ptrdiff_t k = count_; k < lanes_; ++k) window_[k] = 0;
    }

    // Weighted products of the first n columns, with a ridge, and of them with values.
    void square(std::size_t n, const std::vector<float>& weight, const std::vector<float>& values, Matrix& matrix, Vector& right) {
        for (std::size_t i = 0; i < n; ++i) {
            for (std::ptrdiff_t k = 0; k < lanes_; ++k) weighted_[k] = weight[k] * columns_[i][k];
            for (std::size_t j = 0; j <= i; ++j) matrix[i][j] = matrix[j][i] = product(weighted_.data(), columns_[j].data(), lanes_);
            matrix[i][i] += RIDGE;
            right[i] = product(weighted_.data(), values.data(), lanes_);
        }
    }

    // One Gauss-Newton step; returns the shift, px.
    double advance(State& disc, double typical) {
        collect(disc, typical);
        model(disc, typical);
        Matrix matrix{};
        Vector right{};
        square(LEVELS, window_, value_, matrix, right);
        const Vector level = Equations(matrix, LEVELS).solve(right);
        const double raw = residuals(level);
        const auto amplitude = static_cast<float>(std::max(std::abs(level[3]), 1e-3));
        for (std::size_t i = LEVELS; i < UNKNOWNS; ++i) {
            for (std::ptrdiff_t k = 0; k < lanes_; ++k) columns_[i][k] *= amplitude;
        }
        square(UNKNOWNS, weight_, rest_, matrix, right);
        const double prior = TEXTURE * raw / (SPREAD * SPREAD * unit_ * unit_);
        matrix[6][6] += prior;
        right[6] += prior * (typical - disc.radius);
        const Equations equations(matrix, UNKNOWNS);
        disc.own = raw * (equations.solve(unit(4))[4] + equations.solve(unit(5))[5]) / 2;
        return move(disc, equations.solve(right));
    }

    static Vector unit(std::size_t i) {
        Vector vector{};
        vector[i] = 1;
        return vector;
    }

    // Residuals of the level, and Tukey's weights; returns the variance of the pixels.
    double residuals(const Vector& level) {
        float shape[LEVELS];
        std::transform(level.begin(), level.begin() + LEVELS, shape, [](double part) { return static_cast<float>(part); });
        for (std::ptrdiff_t k = 0; k < lanes_; ++k) {
            rest_[k] = value_[k] - shape[0] - shape[1] * columns_[1][k] - shape[2] * columns_[2][k] - shape[3] * columns_[3][k];
            weighted_[k] = window_[k] * rest_[k];
        }
        double pixels = 0;
        for (std::ptrdiff_t k = 0; k < count_; ++k) pixels += window_[k];
        const auto raw =
            std::max(product(weighted_.data(), rest_.data(), lanes_) / static_cast<float>(std::max(pixels - 7, 1.0)), LEAST_VARIANCE);
        const float bound = 1 / (TUKEY * TUKEY * raw);
        for (std::ptrdiff_t k = 0; k < lanes_; ++k) {
            const float left = std::min(std::max(1 - rest_[k] * rest_[k] * bound, 0.0f), 1.0f);
            weight_[k] = window_[k] * left * left;
        }
        raw_ = raw;
        return raw;
    }

    double move(State& disc, const Vector& step) const {
        const double reach = FARTHEST * unit_, u = disc.u, v = disc.v;
        disc.u = disc.start_u + bounded(u + bounded(step[4], LONGEST) - disc.start_u, reach);
        disc.v = disc.start_v + bounded(v + bounded(step[5], LONGEST) - disc.start_v, reach);
        disc.radius = std::clamp(disc.radius + bounded(step[6], LONGEST_SIZE * unit_), SMALLEST * unit_, LARGEST * unit_);
        return std::hypot(disc.u - u, disc.v - v);
    }

    // Number of correlated pixels of the last step: squared sums of residuals over blocks, over those of independent ones.
    double correlated_pixels() const {
        const std::ptrdiff_t side = 2 * half_ + 1;
        std::vector<double> sums(side * side), counts(side * side);
        for (std::ptrdiff_t k = 0; k < count_; ++k) {
            if (!(window_[k] > 0.5f)) continue;
            sums[pixel_[k]] = rest_[k];
            counts[pixel_[k]] = 1;
        }
        for (auto* values : {&sums, &counts}) {
            add_blocks(*values, side, side, 1);
            add_blocks(*values, side, 1, side);
        }
        double squares = 0, pixels = 0;
        for (std::ptrdiff_t k = 0; k < side * side; ++k) squares += sums[k] * sums[k], pixels += counts[k];
        return squares / std::max(pixels * raw_, 1e-30);
    }

    // Replaces values, in lines at a distance `line` of elements at a distance `step`, by their sums over the width of a block.
    void add_blocks(std::vector<double>& values, std::ptrdiff_t side, std::ptrdiff_t line, std::ptrdiff_t step) const {
        const auto reach = static_cast<std::ptrdiff_t>(BLOCK * unit_ / 2);
        std::vector<double> before(side + 1);
        for (std::ptrdiff_t k = 0; k < side; ++k) {
            double* first = values.data() + k * line;
            for (std::ptrdiff_t i = 0; i < side; ++i) before[i + 1] = before[i] + first[i * step];
            for (std::ptrdiff_t i = 0; i < side; ++i) {
                first[i * step] = before[std::min(i + reach, side - 1) + 1] - before[std::max<std::ptrdiff_t>(i - reach, 0)];
            }
        }
    }

    const FloatImage image_;
    const double unit_, ring_;
    const std::ptrdiff_t half_;
    std::ptrdiff_t count_ = 0, lanes_ = 0;
    double raw_ = 0;
    std::vector<float> x_, y_, value_, window_, weight_, rest_, weighted_;
    std::array<std::vector<float>, UNKNOWNS> columns_;
    std::vector<std::int32_t> pixel_;  // of each value in the patch
};

}  // namespace

std::vector<WornDisc> fit_worn_discs(const FloatImage& image, const double* places, std::ptrdiff_t count, double radius, double ring) {
    if (image.rows == 0 || image.columns == 0) return {};
    return Fitter(image, radius, ring).run(places, count);
}

}  // namespace tactile
