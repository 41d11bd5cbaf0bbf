// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Registration of a contact's image with a keyframe: Gauss-Newton on the residuals at the edges (Lucas and Kanade 1981), weighted by
// Tukey's biweight. The image is the sum of a cubic B-spline at each taxel times its value there.
#include "taxel/taxel_registration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/cholesky.hpp"
#include "common/median.hpp"
#include "common/wide.hpp"

namespace tactile {
namespace {

constexpr double QUANTILE = 0.9;  // of the edges' distances, is the reach: a few edges beside the contact must not count. Chosen
constexpr int ITERATIONS = 4;
constexpr double CONVERGED = 0.04;      // taxels: a step below it leaves an error of about a tenth of it
constexpr double TUKEY = 4.685;         // of the biweight: 95 percent efficiency for Gaussian noise
constexpr double LEAST_SPREAD = 0.015;  // least standard deviation of the image's residuals. Chosen
constexpr double FARTHEST = 1e6;        // taxels, of a guess, beyond which the fit has failed

// Cubic B-spline at the four taxels around a place, part past the second.
std::array<double, 4> spline(double part) {
    const double rest = 1 - part;
    return {rest * rest * rest / 6, (4 + part * part * (3 * part - 6)) / 6, (4 + rest * rest * (3 * rest - 6)) / 6, part * part * part / 6};
}

// The image at a taxel.
TACTILE_INLINE float shown(float pressure, float scale) {
    return (pressure < 0 ? 0 : pressure) * scale;
}

double sampled(const Picture& picture, double row, double column) {
    const std::ptrdiff_t rows = picture.rows, columns = picture.columns;
    row = row > 0 ? std::min(row, static_cast<double>(rows - 1)) : 0;
    column = column > 0 ? std::min(column, static_cast<double>(columns - 1)) : 0;
    const auto top = static_cast<std::ptrdiff_t>(row), left = static_cast<std::ptrdiff_t>(column);
    const auto down = spline(row - static_cast<double>(top)), across = spline(column - static_cast<double>(left));
    double sum = 0;
    for (std::ptrdiff_t r = 0; r < 4; ++r) {
        const float* line = picture.pressure + std::clamp<std::ptrdiff_t>(top + r - 1, 0, rows - 1) * columns;
        double part = 0;
        for (std::ptrdiff_t c = 0; c < 4; ++c)
            part += across[c] * shown(line[std::clamp<std::ptrdiff_t>(left + c - 1, 0, columns - 1)], picture.scale);
        sum += down[r] * part;
    }
    return sum;
}

TACTILE_WIDE void show(const float* pressure, std::ptrdiff_t columns, float scale, double* line) {
    for (std::ptrdiff_t c = 0; c < columns; ++c) line[c] = shown(pressure[c], scale);
}

// Slopes along both axes, and value of the spline, along the middle one of three lines of the image (3, columns); none at the ends.
TACTILE_WIDE void slopes_of(const double* lines, std::ptrdiff_t columns, double* across, double* down, double* value) {
    const double *up = lines, *here = lines + columns, *low = lines + 2 * columns;
#pragma GCC ivdep
    for (std::ptrdiff_t c = 1; c < columns - 1; ++c) {
        const double left = up[c - 1] + 4 * here[c - 1] + low[c - 1], right = up[c + 1] + 4 * here[c + 1] + low[c + 1];
        const double top = up[c - 1] + 4 * up[c] + up[c + 1], bottom = low[c - 1] + 4 * low[c] + low[c + 1];
        const double middle = here[c - 1] + 4 * here[c] + here[c + 1];
        across[c] = (right - left) / 12;
        down[c] = (bottom - top) / 12;
        value[c] = (top + 4 * middle + bottom) / 36;
    }
}

// Step of count unknowns; NaN where it cannot be solved for.
void solve(double (&normal)[4][4], double (&step)[4], int count) {
    double sum = 0;
    for (int j = 0; j < count; ++j) sum += normal[j][j];
    for (int j = 0; j < count; ++j) normal[j][j] += 1e-9 * sum + 1e-12;
    if (!factorise(normal[0], count, 4, LEAST_PIVOT)) std::fill(step, step + 4, std::numeric_limits<double>::quiet_NaN());
    substitute(normal[0], count, 4, step);
}

}  // namespace

Edges edges_of(const Picture& picture, double steep, std::ptrdiff_t rim, std::ptrdiff_t most) {
    struct Edge {
        std::ptrdiff_t row, column;
        double across, down, value;
    };
    const std::ptrdiff_t rows = picture.rows, columns = picture.columns, from = std::max<std::ptrdiff_t>(rim, 1);
    std::vector<Edge> all;
    std::vector<double> lines(3 * columns), across(columns), down(columns), value(columns);
    for (std::ptrdiff_t r = from; r < rows - from; ++r) {
        for (std::ptrdiff_t k = 0; k < 3; ++k)
            show(picture.pressure + (r + k - 1) * columns, columns, picture.scale, lines.data() + k * columns);
        slopes_of(lines.data(), columns, across.data(), down.data(), value.data());
        for (std::ptrdiff_t c = from; c < columns - from; ++c) {
            if (across[c] * across[c] + down[c] * down[c] > steep * steep) all.push_back({r, c, across[c], down[c], value[c]});
        }
    }
    Edges found;
    found.count = static_cast<std::ptrdiff_t>(all.size());
    if (all.empty()) return found;
    for (const Edge& edge : all) {
        found.middle[0] += static_cast<double>(edge.row);
        found.middle[1] += static_cast<double>(edge.column);
    }
    for (double& part : found.middle) part /= static_cast<double>(all.size());
    std::vector<double> far;
    for (const Edge& edge : all)
        far.push_back(std::hypot(static_cast<double>(edge.row) - found.middle[0], static_cast<double>(edge.column) - found.middle[1]));
    found.reach = std::max(smallest(std::move(far), std::lround(QUANTILE * static_cast<double>(all.size() - 1))), 1e-6);
    const std::ptrdiff_t step = (found.count + most - 1) / most;
    for (const Edge& edge : all) {
        const double y = static_cast<double>(edge.row) - found.middle[0], x = static_cast<double>(edge.column) - found.middle[1];
        const double slopes[4] = {edge.across, edge.down, (x * edge.down - y * edge.across) / found.reach,
                                  -std::hypot(edge.across, edge.down)};
        for (int i = 0; i < 4; ++i) {
            for (int j = 0; j < 4; ++j) found.normal[4 * i + j] += slopes[i] * slopes[j];
        }
        if ((edge.row + edge.column) % step != 0) continue;  // evenly over all edges, along whichever axis they run
        found.place.insert(found.place.end(), {static_cast<double>(edge.row), static_cast<double>(edge.column)});
        found.value.push_back(edge.value);
        found.slopes.insert(found.slopes.end(), slopes, slopes + 4);
    }
    return found;
}

Registered registered(const Picture& picture, const double* place, const double* value, const double* slopes, std::ptrdiff_t count,
                      const std::array<double, 2>& middle, double reach, bool turns, const std::array<double, 4>& guess) {
    const int used[4] = {0, 1, turns ? 2 : 3, 3}, unknowns = turns ? 4 : 3;
    Registered found;
    found.fit = guess;
    std::vector<double> left(count), size(count);
    for (int iteration = 0; iteration < ITERATIONS; ++iteration) {
        const double turn = found.fit[2] / reach, cosine = std::cos(turn), sine = std::sin(turn);
        for (std::ptrdiff_t k = 0; k < count; ++k) {
            const double y = place[2 * k] - middle[0], x = place[2 * k + 1] - middle[1];
            const double row = middle[0] + cosine * y + sine * x + found.fit[1], column = middle[1] + cosine * x - sine * y + found.fit[0];
            left[k] = value[k] - sampled(picture, row, column) - slopes[4 * k + 3] * found.fit[3];
            size[k] = std::abs(left[k]);
        }
        found.spread = std::max(SIGMA_PER_MAD * (count > 0 ? smallest(size, count / 2) : 0), LEAST_SPREAD);
        double normal[4][4] = {}, step[4] = {};
        for (std::ptrdiff_t k = 0; k < count; ++k) {
            const double off = left[k] / (TUKEY * found.spread);
            if (!(off * off < 1)) continue;
            const double weight = (1 - off * off) * (1 - off * off);
            for (int i = 0; i < unknowns; ++i) {
                const double weighed = weight * slopes[4 * k + used[i]];
                for (int j = 0; j <= i; ++j) normal[i][j] += weighed * slopes[4 * k + used[j]];
                step[i] += weighed * left[k];
            }
        }
        solve(normal, step, unknowns);
        double largest = 0;
        for (int i = 0; i < unknowns; ++i) {
            found.fit[used[i]] += step[i];
            largest = std::max(largest, std::abs(step[i]));
        }
        if (!(largest >= CONVERGED && largest < FARTHEST)) break;
    }
    const auto kept = std::count_if(size.begin(), size.end(), [&](double one) { return one < TUKEY * found.spread; });
    found.inliers = count ? static_cast<double>(kept) / static_cast<double>(count) : 0;
    return found;
}

}  // namespace tactile
