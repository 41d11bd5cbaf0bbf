// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Contacts of a pressure image: the score of each taxel, and outlines.
#include "taxel/region.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>

#include "common/grid.hpp"
#include "common/outlines.hpp"
#include "taxel/constants.hpp"

namespace tactile::taxel {

// Contact score of each taxel: pressure over that which the pad's mechanics expects at the border of a contact.
//
// The level of pressure inside a contact is fitted to each patch of touched taxels, a plane or a quadratic. A flat face ends with a
// step, of which a fixed share is seen at its border. Under a curved face the level is a dome that runs out to zero as a ramp, which the
// pad rounds off: a Gaussian of width sigma leaves sigma / sqrt(2 pi) times the slope at its foot.
namespace {

using Values = std::vector<float>;
using Six = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;


// Within 0 and 1; 0 for NaN.
float clipped(float value) {
    return value > 0 ? std::min(value, 1.0f) : 0.0f;
}

// Solves for the first count of six unknowns; the others are 0.
Six solved(const Matrix6& matrix, const Six& right, int count) {
    Six found = Six::Zero();
    found.head(count) = matrix.topLeftCorner(count, count).ldlt().solve(right.head(count));
    return found;
}

// Level of a patch: coefficients of 1, y, x, yy, xy, xx, in taxels from the middle of its box; mean of the fitted pressure.
struct Level {
    Six share;
    double row, column, mean;
    bool dome = false;  // runs out to zero near the touched taxels
    double top = 0;     // of a dome: highest level, and where
    double top_y = 0, top_x = 0;

    double value(double y, double x) const {
        return share[0] + (share[1] + share[3] * y) * y + (share[2] + share[4] * y + share[5] * x) * x;
    }

    // Level bounded to what is usual, for the step at the border of a flat face.
    float step(double y, double x) const {
        return static_cast<float>(std::min(std::max(value(y, x), TAXEL.min_level * mean), TAXEL.max_level * mean));
    }

    // Slope per taxel with which a dome runs out to zero in the direction of (y, x) from its top.
    float ramp(double y, double x) const {
        const double down = share[1] + 2 * share[3] * y + share[4] * x, across = share[2] + share[4] * y + 2 * share[5] * x;
        const double fallen = top - value(y, x);
        return fallen > 1e-6 * top ? static_cast<float>(std::sqrt((down * down + across * across) * top / fallen)) : 0;
    }

    // Makes it a dome if it is one: its foot encloses at most max_foot times the taxels with half of the pressure at its top.
    template <class Count>
    void find_dome(Count above) {
        const double determinant = 4 * share[3] * share[5] - share[4] * share[4];
        if (!(share[3] < 0 && share[5] < 0 && determinant > 0)) return;
        top_y = (share[4] * share[2] - 2 * share[5] * share[1]) / determinant;
        top_x = (share[4] * share[1] - 2 * share[3] * share[2]) / determinant;
        top = value(top_y, top_x);
        const double foot = 2 * M_PI * top / std::sqrt(determinant);
        dome = top > 0 && foot < TAXEL.max_foot * static_cast<double>(above(static_cast<float>(top / 2)));
    }
};

// Weighted least squares in a box; weight(r, c): of 0 to 1. Nothing where fewer than min_level_taxels count.
template <class Weight>
std::optional<Level> fitted(const float* pressure, std::ptrdiff_t columns, const Box& box, Weight weight) {
    Level level{{}, 0.5 * static_cast<double>(box.top + box.bottom - 1), 0.5 * static_cast<double>(box.left + box.right - 1), 0};
    const double scale = 2.0 / static_cast<double>(std::max(box.rows(), box.columns()));
    // Sums of w x^i y^j and of w value x^i y^j, row by row: those of x first.
    std::array<std::array<double, 5>, 5> moments{};
    std::array<std::array<double, 3>, 3> loads{};
    double square = 0;
    std::ptrdiff_t count = 0;
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        std::array<double, 5> along{};
        std::array<double, 3> load{};
        for (std::ptrdiff_t c = box.left; c < box.right; ++c) {
            const double w = weight(r, c), value = pressure[r * columns + c];
            if (!(w > 0)) continue;
            const double x = scale * (static_cast<double>(c) - level.column), wx = w * x, wxx = wx * x, wxxx = wxx * x, wv = w * value;
            along[0] += w;
            along[1] += wx;
            along[2] += wxx;
            along[3] += wxxx;
            along[4] += wxxx * x;
            load[0] += wv;
            load[1] += wv * x;
            load[2] += wv * x * x;
            square += wv * value;
            ++count;
        }
        const double y = scale * (static_cast<double>(r) - level.row);
        double power = 1;
        for (int j = 0; j < 5; ++j) {
            for (int i = 0; i < 5 - j; ++i) moments[j][i] += power * along[i];
            for (int i = 0; j < 3 && i < 3 - j; ++i) loads[j][i] += power * load[i];
            power *= y;
        }
    }
    if (count < TAXEL.min_level_taxels) return {};
    constexpr int DOWN[] = {0, 1, 0, 2, 1, 0}, ACROSS[] = {0, 0, 1, 0, 1, 2};  // powers of y and x of each term
    Matrix6 normal;
    Six sums;
    for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) normal(i, j) = moments[DOWN[i] + DOWN[j]][ACROSS[i] + ACROSS[j]];
        sums[i] = loads[DOWN[i]][ACROSS[i]];
    }
    level.mean = sums[0] / normal(0, 0);
    normal.diagonal().array() += 1e-6 * static_cast<double>(count);
    const Six plane = solved(normal, sums, 3), bent = solved(normal, sums, 6);
    const double explained = 1 - (square - bent.dot(sums)) / std::max(square - plane.dot(sums), 1e-300);
    const double curved = std::clamp((explained - TAXEL.bent_from) / (TAXEL.bent_wholly - TAXEL.bent_from), 0.0, 1.0);
    const double second = scale * scale;
    level.share = (plane + curved * (bent - plane)).cwiseProduct((Six() << 1, scale, scale, second, second, second).finished());
    return level;
}

// Expected pressure at the border, (rows, columns): by what is near, and on and around each patch by its level.
class Border {
 public:
    Border(const float* pressure, const std::uint8_t* full, std::ptrdiff_t rows, std::ptrdiff_t columns, const ScoreRule& rule)
        : pressure_(pressure), full_(full), rows_(rows), columns_(columns), rule_(rule), largest_(pressure, pressure + rows * columns) {
        blur(largest_, rows, columns, rule.smooth, Outside::replicated);
        spread_largest(largest_, rows, columns, rule.reach);
        expected = largest_;
        for (float& value : expected) value = std::max(value, rule.least);
        std::vector<std::uint8_t> touched(rows * columns);
        soft_.resize(rows * columns);
        // Soft thresholds: hard ones would shift level and border as a contact moves by parts of a taxel.
        for (std::size_t k = 0; k < touched.size(); ++k) {
            touched[k] = pressure[k] > rule.share * expected[k];
            soft_[k] = clipped(2.5f * pressure[k] / expected[k] - 1);
        }
        inner_ = soft_;
        blur(inner_, rows, columns, rule.smooth, Outside::replicated);
        for (float& value : inner_) value = clipped(5 * value - 3.75f);
        for (float& value : expected) value *= rule.share;
        const std::ptrdiff_t half = (rule.reach + 1) / 2;
        std::vector<std::int32_t> labels;
        const auto patches = components(spread_mask(touched.data(), rows, columns, half).data(), rows, columns, true, labels);
        for (std::size_t k = 0; k < patches.size(); ++k) fit(labels, static_cast<std::int32_t>(k) + 1, patches[k], half);
    }
    Values expected;

 private:
    void fit(const std::vector<std::int32_t>& labels, std::int32_t label, const Component& patch, std::ptrdiff_t half) {
        if (patch.count < TAXEL.min_level_taxels) return;
        const auto inside = [&](const Values& weights, bool all) {
            return fitted(pressure_, columns_, patch.box, [&](std::ptrdiff_t r, std::ptrdiff_t c) {
                const std::ptrdiff_t k = r * columns_ + c;
                return labels[k] == label && (all || !full_[k]) ? weights[k] : 0.0f;
            });
        };
        auto level = inside(inner_, false);  // what is saturated hides how high the level is
        if (!level) level = inside(inner_, true);
        if (!level) level = inside(soft_, true);  // a contact that is nowhere wider than what the pad rounds off
        if (!level) return;
        level->find_dome([&](float half_of_top) {
            std::ptrdiff_t count = 0;
            for (std::ptrdiff_t r = patch.box.top; r < patch.box.bottom; ++r) {
                for (std::ptrdiff_t c = patch.box.left; c < patch.box.right; ++c) {
                    const std::ptrdiff_t k = r * columns_ + c;
                    const double y = static_cast<double>(r) - level->row, x = static_cast<double>(c) - level->column;
                    count += labels[k] == label && (full_[k] ? level->value(y, x) : pressure_[k]) > half_of_top;
                }
            }
            return count;
        });
        const Box box = patch.box.grown(half, rows_, columns_);
        std::vector<std::uint8_t> mine(box.rows() * box.columns());
        for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
            for (std::ptrdiff_t c = box.left; c < box.right; ++c)
                mine[(r - box.top) * box.columns() + c - box.left] = labels[r * columns_ + c] == label;
        }
        mine = spread_mask(mine.data(), box.rows(), box.columns(), half);
        for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
            for (std::ptrdiff_t c = box.left; c < box.right; ++c) {
                if (mine[(r - box.top) * box.columns() + c - box.left]) expected[r * columns_ + c] = at_border(*level, r, c);
            }
        }
    }

    // Share of the step, or the foot of the ramp.
    float at_border(const Level& level, std::ptrdiff_t r, std::ptrdiff_t c) const {
        const double y = static_cast<double>(r) - level.row, x = static_cast<double>(c) - level.column;
        const float step = std::min(level.step(y, x), largest_[r * columns_ + c]);
        const float value = level.dome ? rule_.ramp * level.ramp(y, x) : rule_.share * step;
        return std::max(value, rule_.share * rule_.least);
    }

    const float* pressure_;
    const std::uint8_t* full_;
    const std::ptrdiff_t rows_, columns_;
    const ScoreRule rule_;
    Values largest_, soft_, inner_;  // largest: within a thickness
};

// Fills dips in which pressure stays above max_dip of the level: a rough face, no hole.
void close(Values& score, std::ptrdiff_t rows, std::ptrdiff_t columns, float free_below) {
    std::vector<std::uint8_t> above(score.size());
    for (std::size_t k = 0; k < score.size(); ++k) above[k] = score[k] > LEVEL;
    const Box box = box_around(above.data(), rows, columns).grown(1, rows, columns);
    std::vector<std::uint8_t> low(box.rows() * box.columns());
    for (std::ptrdiff_t r = 0; r < box.rows(); ++r) {
        for (std::ptrdiff_t c = 0; c < box.columns(); ++c) low[r * box.columns() + c] = !above[(box.top + r) * columns + box.left + c];
    }
    std::vector<std::int32_t> labels;
    const auto dips = components(low.data(), box.rows(), box.columns(), false, labels);
    std::vector<std::uint8_t> filled(dips.size() + 1);
    for (std::size_t k = 0; k < dips.size(); ++k) {
        const Box& dip = dips[k].box;
        filled[k + 1] = dip.top > 0 && dip.left > 0 && dip.bottom < box.rows() && dip.right < box.columns();
    }
    const auto value = [&](std::ptrdiff_t k) -> float& {
        return score[(box.top + k / box.columns()) * columns + box.left + k % box.columns()];
    };
    for (std::ptrdiff_t k = 0; k < box.rows() * box.columns(); ++k) {
        if (value(k) < free_below) filled[labels[k]] = 0;
    }
    for (std::ptrdiff_t k = 0; k < box.rows() * box.columns(); ++k) {
        if (filled[labels[k]]) value(k) = 1;
    }
}

}  // namespace

ScoreRule ScoreRule::of(double thickness, std::ptrdiff_t side, double sigma) {
    const double least = TAXEL.level_sigmas * sigma;
    return {std::max(TAXEL.score_width * thickness, TAXEL.min_score_width), std::clamp<std::ptrdiff_t>(std::lrint(thickness), 1, side),
            static_cast<float>(std::isfinite(least) ? std::clamp(least, 1e-30, 1e30) : 1e30), static_cast<float>(TAXEL.border_share),
            static_cast<float>(TAXEL.border_ramp * thickness)};
}

RegionRule RegionRule::of(double reach, std::ptrdiff_t side, double pitch) {
    return {LEVEL, std::min<std::ptrdiff_t>(std::lrint(0.5 * reach), side), TAXEL.load_margin, TAXEL.max_regions, TAXEL.min_area, pitch};
}

std::vector<float> contact_score(const float* pressure, const std::uint8_t* full, std::ptrdiff_t rows, std::ptrdiff_t columns,
                                 const ScoreRule& rule) {
    Values score(rows * columns);
    std::vector<std::uint8_t> pressed(score.size());
    for (std::size_t k = 0; k < score.size(); ++k) pressed[k] = pressure[k] > rule.share * rule.least;
    const Box inside = box_around(pressed.data(), rows, columns);
    if (inside.rows() == 0) return score;
    // What is farther away has no part in a contact's score.
    const auto margin = 2 * rule.reach + 2 * static_cast<std::ptrdiff_t>(std::ceil(4 * rule.smooth)) + 2;
    const Box box = inside.grown(margin, rows, columns);
    Values near;
    std::vector<std::uint8_t> hidden;
    for (std::ptrdiff_t r = box.top; r < box.bottom; ++r) {
        near.insert(near.end(), pressure + r * columns + box.left, pressure + r * columns + box.right);
        hidden.insert(hidden.end(), full + r * columns + box.left, full + r * columns + box.right);
    }
    const Border border(near.data(), hidden.data(), box.rows(), box.columns(), rule);
    for (std::size_t k = 0; k < near.size(); ++k) near[k] = clipped(0.5f * near[k] / border.expected[k]);
    close(near, box.rows(), box.columns(), 0.5f * TAXEL.max_dip / rule.share);
    for (std::ptrdiff_t r = 0; r < box.rows(); ++r)
        std::copy_n(near.begin() + r * box.columns(), box.columns(), score.begin() + (box.top + r) * columns + box.left);
    return score;
}

namespace {

// Integrals within a polygon (count, 3) by Green's theorem, about its first vertex, and then moved to the origin: a tiny polygon keeps its
// digits.
std::array<double, 6> integrals_of(const double* points, std::ptrdiff_t count) {
    const double x0 = points[0], y0 = points[1];
    double area = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (std::ptrdiff_t k = 1; k + 1 < count; ++k) {
        const double ax = points[3 * k] - x0, ay = points[3 * k + 1] - y0, bx = points[3 * k + 3] - x0, by = points[3 * k + 4] - y0;
        const double twice = ax * by - bx * ay;  // of the triangle with the first vertex
        area += twice / 2;
        x += twice * (ax + bx) / 6;
        y += twice * (ay + by) / 6;
        xx += twice * (ax * ax + ax * bx + bx * bx) / 12;
        xy += twice * (2 * ax * ay + ax * by + bx * ay + 2 * bx * by) / 24;
        yy += twice * (ay * ay + ay * by + by * by) / 12;
    }
    return {area,
            x + area * x0,
            y + area * y0,
            xx + 2 * x0 * x + area * x0 * x0,
            xy + x0 * y + y0 * x + area * x0 * y0,
            yy + 2 * y0 * y + area * y0 * y0};
}

// Labels (rows, columns) of what touches; whether it has more than the most pieces, of which the largest keep theirs.
bool label(const std::vector<std::uint8_t>& touched, std::ptrdiff_t rows, std::ptrdiff_t columns, const RegionRule& rule,
           std::vector<std::int32_t>& labels) {
    const std::vector<Component> pieces = components(touched.data(), rows, columns, false, labels);
    const auto count = static_cast<std::ptrdiff_t>(pieces.size());
    if (count > rule.most) {
        std::vector<std::ptrdiff_t> order(count);
        std::iota(order.begin(), order.end(), 0);
        std::stable_sort(order.begin(), order.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) { return pieces[a].count > pieces[b].count; });
        std::vector<std::uint8_t> kept(count + 1);
        for (std::ptrdiff_t k = 0; k < rule.most; ++k) kept[order[k] + 1] = 1;
        for (std::int32_t& one : labels) one = kept[one] ? one : 0;
    } else if (count > 1) {  // one outline surrounds taxels that meet at a corner, too
        components(spread_mask(touched.data(), rows, columns, rule.reach).data(), rows, columns, true, labels);
        for (std::size_t k = 0; k < touched.size(); ++k) labels[k] = touched[k] ? labels[k] : 0;
    }
    return count > rule.most;
}

}  // namespace

Regions find_regions(const float* score, const float* pressure, const std::uint8_t* full, std::ptrdiff_t rows, std::ptrdiff_t columns,
                     const RegionRule& rule) {
    Regions found;
    found.rows = rows, found.columns = columns;
    std::vector<std::uint8_t>& touched = found.touched;
    touched.resize(rows * columns);
    for (std::size_t k = 0; k < touched.size(); ++k) touched[k] = score[k] > rule.level;
    found.broken = label(touched, rows, columns, rule, found.labels);
    const std::vector<std::int32_t>& labels = found.labels;
    std::vector<double> field((rows + 2) * (columns + 2));  // with a margin, in which contours close
    for (std::ptrdiff_t k = 0; k < rows * columns; ++k)
        field[(k / columns + 1) * (columns + 2) + k % columns + 1] = touched[k] && !labels[k] ? 0 : score[k];
    const Loops loops = find_contours(field.data(), rows + 2, columns + 2, rule.level);
    std::vector<std::ptrdiff_t> region_of(labels.size() + 1, -1);  // by label
    for (std::size_t k = 0, next; k < loops.region.size(); k = next) {
        std::vector<std::vector<double>> polygons;  // of a piece: its outline, and holes
        std::array<double, 6> integrals{};
        for (next = k; next < loops.region.size() && loops.region[next] == loops.region[k]; ++next) {
            std::vector<double>& points = polygons.emplace_back();
            for (std::int64_t at = loops.start[next]; at < loops.start[next + 1]; ++at) {
                points.insert(points.end(), {rule.pitch * (loops.vertices[2 * at + 1] - 1 - 0.5 * static_cast<double>(columns - 1)),
                                             rule.pitch * (loops.vertices[2 * at] - 1 - 0.5 * static_cast<double>(rows - 1)), 0});
            }
            const auto part = integrals_of(points.data(), static_cast<std::ptrdiff_t>(points.size() / 3));
            for (int i = 0; i < 6; ++i) integrals[i] += part[i];
        }
        if (!(integrals[0] > rule.least * rule.pitch * rule.pitch)) continue;
        const auto at = [&](double row, double column) {
            const auto r = static_cast<std::ptrdiff_t>(row) - 1, c = static_cast<std::ptrdiff_t>(column) - 1;
            return r < 0 || c < 0 || r >= rows || c >= columns ? 0 : labels[r * columns + c];
        };
        // Of the two taxels beside a vertex one is inside.
        const double row = loops.vertices[2 * loops.start[k]], column = loops.vertices[2 * loops.start[k] + 1];
        const std::int32_t name = std::max(at(std::floor(row), std::floor(column)), at(std::ceil(row), std::ceil(column)));
        if (region_of[name] < 0) {
            region_of[name] = static_cast<std::ptrdiff_t>(found.all.size());
            found.all.push_back({name});
        }
        Region& region = found.all[region_of[name]];
        region.outlines.push_back(std::move(polygons[0]));
        std::move(polygons.begin() + 1, polygons.end(), std::back_inserter(region.holes));
        for (int i = 0; i < 6; ++i) region.integrals[i] += integrals[i];
    }
    Values around(labels.begin(), labels.end());
    spread_largest(around, rows, columns, rule.around);
    found.near = labels;
    for (std::ptrdiff_t k = 0; k < rows * columns; ++k) {
        if (!labels[k]) found.near[k] = static_cast<std::int32_t>(around[k]);
        if (region_of[found.near[k]] < 0) continue;
        Region& region = found.all[region_of[found.near[k]]];
        region.force += rule.pitch * rule.pitch * std::max(pressure[k], 0.0f);
        region.peak = std::max(region.peak, pressure[k]);
        if (!labels[k]) continue;
        ++region.count;
        region.at_edge |= k < columns || k >= (rows - 1) * columns || k % columns == 0 || k % columns == columns - 1;
        region.saturated |= full[k] != 0;
    }
    std::stable_sort(found.all.begin(), found.all.end(), [](const Region& a, const Region& b) { return a.integrals[0] > b.integrals[0]; });
    return found;
}

}  // namespace tactile::taxel
