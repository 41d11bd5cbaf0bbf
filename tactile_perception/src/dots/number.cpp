// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/number.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "common/median.hpp"
#include "dots/lattice.hpp"
#include "dots/links.hpp"

namespace tactile {
namespace {

// Row and column are locally nearly linear in image position. A linear fit to the nearest indexed dots predicts the index of a dot without
// one. A prediction far from a whole number, or with a high leverage, is rejected. This repeats until no dot is added.

constexpr double MOST_TURNED = 38.0 * M_PI / 180;  // rad: rotated further, rows and columns may be exchanged
constexpr double LOOSE = 0.05;      // share of dots without an index above which indices are extrapolated: more than false dots alone
constexpr double FEW_LINKED = 0.7;  // of the dots: with fewer linked, the reason gives their number

constexpr std::size_t NEAREST = 8;  // indexed dots in a fit. Chosen
constexpr std::size_t FEWEST = 4;   // of them: one more than a plane has unknowns
constexpr double REACH = 2.9;       // pitches, dots further away are excluded. Chosen
constexpr double LEVERAGES[] = {1.0,
                                3.0};  // largest variance of a prediction per variance of a dot: the second only if the first adds none
constexpr double BENT = 0.15;          // rows, largest RMS residual of a fit. Chosen
constexpr double OFF = 0.25;           // rows, largest distance of a prediction from a whole number. Chosen
constexpr double LAST_OFF = 0.3;       // rows, the same for an indexed dot in the final check. Chosen
constexpr double RIDGE = 1e-6;         // of the normal equations: keeps collinear dots solvable

using Place = std::pair<std::int64_t, std::int64_t>;

struct Prediction {
    bool sure = false;
    double row = 0, column = 0;
};

class Growth {
 public:
    Growth(const double* places, std::ptrdiff_t count, double pitch, std::vector<std::int64_t>& rc, std::vector<std::uint8_t>& member)
        : places_(places), count_(count), pitch_(pitch), rc_(rc), member_(member) {}

    void run() {
        while (std::any_of(std::begin(LEVERAGES), std::end(LEVERAGES), [this](double leverage) { return wave(leverage); })) {
        }
        confirm();
    }

 private:
    // Adds dots that fits of at most this leverage predict; returns whether any were added.
    bool wave(double leverage) {
        if (members() <= NEAREST) return false;
        std::map<Place, int> claims;  // of each node; a dot that has it counts for two
        std::vector<std::pair<std::ptrdiff_t, Place>> said;
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            if (member_[i]) claims[{rc_[2 * i], rc_[2 * i + 1]}] += 2;
        }
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            if (member_[i]) continue;
            const Prediction found = predict(i, leverage);
            if (!found.sure || !(off(found, std::rint(found.row), std::rint(found.column)) < OFF)) continue;
            said.push_back({i, {std::llrint(found.row), std::llrint(found.column)}});
            ++claims[said.back().second];
        }
        bool any = false;
        for (const auto& [i, place] : said) {
            if (claims[place] > 1) continue;
            rc_[2 * i] = place.first;
            rc_[2 * i + 1] = place.second;
            member_[i] = 1;
            any = true;
        }
        return any;
    }

    // Keeps members whose indices match the prediction from their neighbours.
    void confirm() {
        if (members() <= NEAREST + 1) return;
        std::vector<std::uint8_t> kept(member_);
        for (std::ptrdiff_t i = 0; i < count_; ++i) {
            if (!member_[i]) continue;
            const Prediction found = predict(i, LEVERAGES[1]);
            kept[i] = found.sure && off(found, static_cast<double>(rc_[2 * i]), static_cast<double>(rc_[2 * i + 1])) < LAST_OFF;
        }
        member_ = kept;
    }

    std::size_t members() const { return static_cast<std::size_t>(std::count(member_.begin(), member_.end(), 1)); }

    static double off(const Prediction& found, double row, double column) {
        return std::max(std::abs(found.row - row), std::abs(found.column - column));
    }

    // The nearest members within reach of dot i, itself excepted, nearest first.
    void find_near(std::ptrdiff_t i) {
        near_.clear();
        const double u = places_[2 * i], v = places_[2 * i + 1], reach = REACH * pitch_;
        for (std::ptrdiff_t j = 0; j < count_; ++j) {
            const double across = places_[2 * j] - u, down = places_[2 * j + 1] - v;
            if (std::abs(across) >= reach || std::abs(down) >= reach || !member_[j] || j == i) continue;
            const double square = across * across + down * down;
            if (square < reach * reach) near_.push_back({square, j});
        }
        const std::size_t kept = std::min(near_.size(), NEAREST);
        std::partial_sort(near_.begin(), near_.begin() + static_cast<std::ptrdiff_t>(kept), near_.end());
        near_.resize(kept);
    }

    // Row and column at dot i by a plane through its neighbours' indices, relative to the nearest one's, which the ridge hardly biases.
    Prediction predict(std::ptrdiff_t i, double leverage) {
        find_near(i);
        if (near_.size() < FEWEST) return {};
        const std::int64_t* origin = &rc_[2 * near_[0].second];
        double n = RIDGE, x = 0, y = 0, xx = RIDGE, xy = 0, yy = RIDGE, sums[2][3] = {};
        for (const auto& [square, j] : near_) {
            const double across = (places_[2 * j] - places_[2 * i]) / pitch_, down = (places_[2 * j + 1] - places_[2 * i + 1]) / pitch_;
            n += 1, x += across, y += down, xx += across * across, xy += across * down, yy += down * down;
            for (int axis = 0; axis < 2; ++axis) {
                const auto value = static_cast<double>(rc_[2 * j + axis] - origin[axis]);
                sums[axis][0] += value, sums[axis][1] += value * across, sums[axis][2] += value * down;
            }
        }
        // the inverse of the symmetric matrix [n x y; x xx xy; y xy yy] by its cofactors
        const double a = xx * yy - xy * xy, b = xy * y - x * yy, c = x * xy - xx * y, inverse = 1 / (n * a + x * b + y * c);
        const double d = n * yy - y * y, e = x * y - n * xy, f = n * xx - x * x;
        double fit[2][3];
        for (int axis = 0; axis < 2; ++axis) {
            const double* sum = sums[axis];
            fit[axis][0] = (a * sum[0] + b * sum[1] + c * sum[2]) * inverse;
            fit[axis][1] = (b * sum[0] + d * sum[1] + e * sum[2]) * inverse;
            fit[axis][2] = (c * sum[0] + e * sum[1] + f * sum[2]) * inverse;
        }
        const bool sure = a * inverse < leverage && residual(i, fit) < 2 * BENT * BENT;
        return {sure, fit[0][0] + static_cast<double>(origin[0]), fit[1][0] + static_cast<double>(origin[1])};
    }

    // Squared residuals of both planes over the degrees of freedom.
    double residual(std::ptrdiff_t i, const double (&fit)[2][3]) const {
        double squares = 0;
        for (const auto& [square, j] : near_) {
            const double across = (places_[2 * j] - places_[2 * i]) / pitch_, down = (places_[2 * j + 1] - places_[2 * i + 1]) / pitch_;
            for (int axis = 0; axis < 2; ++axis) {
                const auto value = static_cast<double>(rc_[2 * j + axis] - rc_[2 * near_[0].second + axis]);
                const double rest = fit[axis][0] + fit[axis][1] * across + fit[axis][2] * down - value;
                squares += rest * rest;
            }
        }
        return squares / std::max(static_cast<double>(near_.size()) - 3, 1.0);
    }

    const double* places_;
    const std::ptrdiff_t count_;
    const double pitch_;
    std::vector<std::int64_t>& rc_;
    std::vector<std::uint8_t>& member_;
    std::vector<std::pair<double, std::ptrdiff_t>> near_;  // squared distance and index
};

// Origin of a lattice on the printed grid: its first row and column. The last certain frame determines it where the irregularity of the
// pattern excludes a shift by a pitch; else one image does when all printed rows and columns are seen. An outer row that is missing may
// have left the image, or be hidden by a rim or by glare: it is known only where the last frame and the border of the image agree;
// elsewhere the frame is rejected.

constexpr double OUTER_SHARE = 0.2;       // of the printed length, least number of dots of an outer row; fewer are false dots. Chosen
constexpr double CLIPPED_SHARE = 0.75;    // of the median row, most dots of an outer row that may be dropped if too many are seen. Chosen
constexpr std::int64_t MOST_CLIPPED = 2;  // surplus rows that may be dropped. Chosen
constexpr double NEAR = 0.35;             // pitches within which a dot continues one of the last frame. Chosen: below half a pitch
constexpr double STAYED_SHARE = 0.8;      // of the dots, that must continue for the last indices to be used. Chosen
constexpr double STILL = 0.2;             // pitches, largest median motion from the last frame that needs less evidence. Chosen
constexpr double UNEVEN_RATIO = 0.5;     // spread of motions at the right indices over that one row off, below which it is excluded. Chosen
constexpr double STILL_RATIO = 0.8;      // the same where little moved. Chosen: an even grid, which cannot tell, has one
constexpr std::size_t FEWEST_MOVES = 8;  // motions that give a spread. Chosen
constexpr double CUT = 0.25;             // pitches: dots nearer to the border are cut by it and may be missed. Chosen: a dot's radius

// Dots with relative or printed rows and columns: places (count, 2), px; rc (count, 2).
struct IndexedDots {
    std::vector<double> places;
    std::vector<std::int64_t> rc;
    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(rc.size() / 2); }
};

// A printed grid and its image, px; width and height are 0 where unknown.
struct GridView {
    std::int64_t printed[2];  // rows, columns
    double pitch, width, height;
};

enum class AnchorFault { NONE, TOO_FEW, ANOTHER_PATTERN, DISAGREEMENT, AMBIGUOUS };

// What to add to relative rows and columns. With a fault: its axis, 0 for rows or 1 for columns, and the number of rows or columns seen.
struct Anchor {
    std::int64_t offset[2];
    AnchorFault fault;
    int axis;
    std::int64_t seen;
};

// Rows (or columns) with enough dots: index of the first, number of dots in each, number of printed ones.
struct Extent {
    std::int64_t first, printed;
    std::vector<std::int64_t> counts;
    std::int64_t seen() const { return static_cast<std::int64_t>(counts.size()); }
};

// Offset by the last frame. sure: for rows and columns, whether a shift by a whole pitch is excluded; likely: by less evidence, but little
// moved.
struct Vote {
    std::int64_t offset[2];
    bool sure[2], likely[2];
};

class Anchoring {
 public:
    Anchoring(const IndexedDots& dots, const IndexedDots& before, const GridView& view)
        : dots_(dots), before_(before), view_(view), extents_{extent(0), extent(1)} {}

    Anchor run() const {
        for (int axis = 0; axis < 2; ++axis) {
            if (extents_[axis].counts.empty()) return {{0, 0}, AnchorFault::TOO_FEW, axis, 0};
        }
        const std::optional<Vote> vote = vote_of_last_frame();
        Anchor anchor{{0, 0}, AnchorFault::NONE, 0, 0};
        for (int axis = 0; axis < 2; ++axis) {
            std::int64_t window = 0;  // index among the seen rows of printed row 0, negative where that is not seen
            const AnchorFault fault = place(axis, vote, window);
            if (fault != AnchorFault::NONE) return {{0, 0}, fault, axis, extents_[axis].seen()};
            anchor.offset[axis] = -extents_[axis].first - window;
        }
        return anchor;
    }

 private:
    Extent extent(int axis) const {
        Extent found{0, view_.printed[axis], {}};
        if (dots_.count() == 0) return found;
        std::int64_t low = dots_.rc[axis], high = low;
        for (std::ptrdiff_t i = 0; i < dots_.count(); ++i) {
            low = std::min(low, dots_.rc[2 * i + axis]);
            high = std::max(high, dots_.rc[2 * i + axis]);
        }
        std::vector<std::int64_t> counts(high - low + 1);
        for (std::ptrdiff_t i = 0; i < dots_.count(); ++i) ++counts[dots_.rc[2 * i + axis] - low];
        const double least = std::max(2.0, OUTER_SHARE * static_cast<double>(view_.printed[1 - axis]));
        const auto full = [least](std::int64_t number) { return static_cast<double>(number) >= least; };
        const auto first = std::find_if(counts.begin(), counts.end(), full);
        if (first == counts.end()) return found;
        const auto end = std::find_if(counts.rbegin(), counts.rend(), full).base();
        found.first = low + (first - counts.begin());
        found.counts.assign(first, end);
        return found;
    }

    AnchorFault place(int axis, const std::optional<Vote>& vote, std::int64_t& window) const {
        const Extent& extent = extents_[axis];
        // Index among the seen rows of printed row 0 by the last frame.
        const std::optional<std::int64_t> by_vote = vote ? std::optional<std::int64_t>(-vote->offset[axis] - extent.first) : std::nullopt;
        if (by_vote && (vote->sure[axis] || (vote->likely[axis] && extent.seen() < extent.printed))) {
            window = *by_vote;
            return AnchorFault::NONE;
        }
        if (extent.seen() < extent.printed) return place_part(axis, by_vote, window);
        return extent.seen() == extent.printed ? AnchorFault::NONE : drop_clipped(extent, by_vote, window);
    }

    // More rows than printed: drops incomplete rows at the ends, those that the last frame had not; else it is another pattern.
    AnchorFault drop_clipped(const Extent& extent, const std::optional<std::int64_t>& by_vote, std::int64_t& window) const {
        const std::int64_t spare = extent.seen() - extent.printed;
        if (spare > MOST_CLIPPED) return AnchorFault::ANOTHER_PATTERN;
        const auto& counts = extent.counts;
        std::int64_t most = -1;
        for (std::int64_t k = 0; k <= spare; ++k) {
            const std::int64_t sum = std::accumulate(counts.begin() + k, counts.begin() + k + extent.printed, std::int64_t{0});
            if (sum > most) most = sum, window = k;
        }
        std::int64_t dropped = 0;
        for (std::int64_t k = 0; k < extent.seen(); ++k) {
            if (k < window || k >= window + extent.printed) dropped = std::max(dropped, counts[k]);
        }
        if (static_cast<double>(dropped) > CLIPPED_SHARE * median({counts.begin(), counts.end()})) return AnchorFault::ANOTHER_PATTERN;
        return before_.count() == 0 || by_vote == window ? AnchorFault::NONE : AnchorFault::DISAGREEMENT;
    }

    // Fewer rows than printed: known where the last frame and the border of the image agree on which have left.
    AnchorFault place_part(int axis, const std::optional<std::int64_t>& by_vote, std::int64_t& window) const {
        if (!by_vote) return AnchorFault::AMBIGUOUS;
        const bool before = beyond(axis, 0) > 0, after = beyond(axis, 1) > 0;
        window = *by_vote;
        const std::int64_t missing = extents_[axis].printed - extents_[axis].seen();
        return before != after && window == (before ? -missing : 0) ? AnchorFault::NONE : AnchorFault::AMBIGUOUS;
    }

    // Median distance, px, outside the image of the row before the first (side 0) or after the last (1); 0 for inside or unknown.
    double beyond(int axis, int side) const {
        const Extent& extent = extents_[axis];
        if (!(view_.width > 0) || extent.seen() < 2) return 0;
        const std::int64_t outer = side == 0 ? extent.first : extent.first + extent.seen() - 1, inner = side == 0 ? outer + 1 : outer - 1;
        const int along = 1 - axis;  // rows follow each other along v, columns along u
        std::vector<double> outer_places, inner_places, outside;
        for (std::ptrdiff_t i = 0; i < dots_.count(); ++i) {
            const std::int64_t at = dots_.rc[2 * i + axis];
            if (at == outer) outer_places.push_back(dots_.places[2 * i + along]);
            if (at == inner) inner_places.push_back(dots_.places[2 * i + along]);
        }
        if (inner_places.empty()) return 0;
        const double step = median(outer_places) - median(inner_places), border = view_.pitch * CUT;
        const double ends[2] = {view_.width - 1, view_.height - 1};
        for (std::ptrdiff_t i = 0; i < dots_.count(); ++i) {
            if (dots_.rc[2 * i + axis] != outer) continue;
            double most = -std::numeric_limits<double>::infinity();
            for (int k = 0; k < 2; ++k) {
                const double at = dots_.places[2 * i + k] + (k == along ? step : 0);
                most = std::max({most, border - at, at + border - ends[k]});
            }
            outside.push_back(most);
        }
        return std::max(0.0, median(outside));
    }

    // The offset at which most dots continue those of the last frame.
    std::optional<Vote> vote_of_last_frame() const {
        if (before_.count() == 0) return std::nullopt;
        const std::vector<std::ptrdiff_t> nearest = nearest_before();
        std::vector<double> offsets[2], distances;
        for (std::ptrdiff_t i = 0; i < dots_.count(); ++i) {
            if (nearest[i] < 0) continue;
            for (int k = 0; k < 2; ++k) offsets[k].push_back(static_cast<double>(before_.rc[2 * nearest[i] + k] - dots_.rc[2 * i + k]));
            distances.push_back(std::hypot(before_.places[2 * nearest[i]] - dots_.places[2 * i],
                                           before_.places[2 * nearest[i] + 1] - dots_.places[2 * i + 1]));
        }
        const double enough = STAYED_SHARE * static_cast<double>(std::min(dots_.count(), before_.count()));
        if (offsets[0].empty() || static_cast<double>(offsets[0].size()) < enough) return std::nullopt;
        Vote vote{};
        for (int k = 0; k < 2; ++k) vote.offset[k] = static_cast<std::int64_t>(median(offsets[k]));
        std::ptrdiff_t agreeing = 0;
        for (std::size_t i = 0; i < offsets[0].size(); ++i) {
            agreeing += offsets[0][i] == static_cast<double>(vote.offset[0]) && offsets[1][i] == static_cast<double>(vote.offset[1]);
        }
        if (static_cast<double>(agreeing) < enough) return std::nullopt;
        const bool still = median(distances) < STILL * view_.pitch;
        for (int axis = 0; axis < 2; ++axis) {
            vote.sure[axis] = fits_only_here(vote, axis, UNEVEN_RATIO);
            vote.likely[axis] = still && fits_only_here(vote, axis, STILL_RATIO);
        }
        return vote;
    }

    // For each dot the nearest one of the last frame, -1 for none nearer than NEAR pitches.
    std::vector<std::ptrdiff_t> nearest_before() const {
        std::vector<double> places(before_.places);
        places.insert(places.end(), dots_.places.begin(), dots_.places.end());
        const double reach = NEAR * view_.pitch;
        std::vector<std::ptrdiff_t> nearest(dots_.count(), -1);
        std::vector<double> least(dots_.count(), reach * reach);
        for (const auto& [i, j] : near_pairs(places.data(), before_.count() + dots_.count(), reach)) {
            const std::ptrdiff_t dot = j - before_.count();
            if (i >= before_.count() || dot < 0) continue;
            const double across = places[2 * i] - places[2 * j], down = places[2 * i + 1] - places[2 * j + 1];
            const double square = across * across + down * down;
            if (square < least[dot]) least[dot] = square, nearest[dot] = i;
        }
        return nearest;
    }

    // Whether the irregularity of the pattern fits the last frame at the voted indices, and much worse one row (or column) further.
    bool fits_only_here(const Vote& vote, int axis, double ratio) const {
        std::vector<std::ptrdiff_t> at(view_.printed[0] * view_.printed[1], -1);  // dot of the last frame at each node
        for (std::ptrdiff_t i = 0; i < before_.count(); ++i) at[before_.rc[2 * i] * view_.printed[1] + before_.rc[2 * i + 1]] = i;
        double spread[3];
        for (const std::int64_t shift : {0, -1, 1}) {
            std::vector<double> moves[2];
            for (std::ptrdiff_t i = 0; i < dots_.count(); ++i) {
                const std::int64_t row = dots_.rc[2 * i] + vote.offset[0] + (axis == 0 ? shift : 0);
                const std::int64_t column = dots_.rc[2 * i + 1] + vote.offset[1] + (axis == 1 ? shift : 0);
                if (row < 0 || column < 0 || row >= view_.printed[0] || column >= view_.printed[1]) continue;
                const std::ptrdiff_t then = at[row * view_.printed[1] + column];
                for (int k = 0; then >= 0 && k < 2; ++k) moves[k].push_back(dots_.places[2 * i + k] - before_.places[2 * then + k]);
            }
            if (moves[0].size() < FEWEST_MOVES) return false;
            const double middle[2] = {median(moves[0]), median(moves[1])};
            std::vector<double> off(moves[0].size());
            for (std::size_t i = 0; i < off.size(); ++i) off[i] = std::abs(moves[0][i] - middle[0]) + std::abs(moves[1][i] - middle[1]);
            spread[shift + 1] = median(std::move(off));
        }
        return spread[1] < ratio * std::min(spread[0], spread[2]);
    }

    const IndexedDots &dots_, &before_;
    const GridView view_;
    const Extent extents_[2];
};

// Rejection of outliers among indexed dots: each step between neighbours on the grid is compared with the mean of the steps around it.

constexpr std::ptrdiff_t AROUND = 2;  // rows and columns on each side over which steps are averaged. Chosen
constexpr double OUTLIER = 0.6;   // of the mean step, deviation of a step with a wrong index at one end. Chosen: one pitch deviates by 1
constexpr double BESIDE = 0.25;   // of the mean step: a dot is rejected if all of its steps deviate more. Chosen
constexpr double NOTHING = 1e-9;  // px, prevents division by zero

// A step from each dot to the next, px, its sums over the dots around, and the number of steps that are known.
struct Step {
    double u, v, count;
    void add(const Step& other) { u += other.u, v += other.v, count += other.count; }
};

class Outliers {
 public:
    Outliers(std::ptrdiff_t rows, std::ptrdiff_t columns)
        : rows_(rows),
          columns_(columns),
          places_(2 * rows * columns, std::numeric_limits<double>::quiet_NaN()),
          bad_(rows * columns),
          held_(rows * columns) {}

    void run(std::int64_t* id, const double* places, std::ptrdiff_t count) {
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            if (id[i] >= 0) std::copy_n(places + 2 * i, 2, places_.data() + 2 * id[i]);
        }
        compare(1, 0);
        compare(0, 1);
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            if (id[i] >= 0 && (!held_[id[i]] || is_beside_bad(id[i]))) id[i] = -1;
        }
    }

 private:
    // Marks the ends of steps by one row (down) or one column (across) that deviate from those around, or that agree with them.
    void compare(std::ptrdiff_t down, std::ptrdiff_t across) {
        const std::ptrdiff_t next = down * columns_ + across;
        std::vector<Step> steps(rows_ * columns_, Step{0, 0, 0});
        for (std::ptrdiff_t r = 0; r < rows_ - down; ++r) {
            for (std::ptrdiff_t c = 0; c < columns_ - across; ++c) {
                const std::ptrdiff_t k = r * columns_ + c;
                const double u = places_[2 * (k + next)] - places_[2 * k], v = places_[2 * (k + next) + 1] - places_[2 * k + 1];
                if (std::isfinite(u + v)) steps[k] = {u, v, 1};
            }
        }
        const std::vector<Step> sums = sums_around(steps);
        for (std::ptrdiff_t k = 0; k < rows_ * columns_; ++k) {
            if (steps[k].count == 0) continue;
            const double u = sums[k].u / sums[k].count, v = sums[k].v / sums[k].count;
            const double off = std::hypot(steps[k].u - u, steps[k].v - v) / std::max(std::hypot(u, v), NOTHING);
            if (off > OUTLIER) bad_[k] = bad_[k + next] = 1;
            if (off < BESIDE) held_[k] = held_[k + next] = 1;
        }
    }

    // Sums over squares, along the columns and then along the rows.
    std::vector<Step> sums_around(const std::vector<Step>& steps) const {
        std::vector<Step> down(steps.size(), Step{0, 0, 0}), sums = down;
        for (std::ptrdiff_t r = 0; r < rows_; ++r) {
            for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(r - AROUND, 0); k <= std::min(r + AROUND, rows_ - 1); ++k) {
                for (std::ptrdiff_t c = 0; c < columns_; ++c) down[r * columns_ + c].add(steps[k * columns_ + c]);
            }
            for (std::ptrdiff_t c = 0; c < columns_; ++c) {
                const std::ptrdiff_t last = std::min(c + AROUND, columns_ - 1);
                for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(c - AROUND, 0); k <= last; ++k) {
                    sums[r * columns_ + c].add(down[r * columns_ + k]);
                }
            }
        }
        return sums;
    }

    bool is_beside_bad(std::ptrdiff_t id) const {
        const std::ptrdiff_t row = id / columns_, column = id % columns_;
        for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
            for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
                if (bad_[r * columns_ + c]) return true;
            }
        }
        return false;
    }

    const std::ptrdiff_t rows_, columns_;
    std::vector<double> places_;
    std::vector<std::uint8_t> bad_, held_;
};

// Why a lattice has no place on the printed grid.
std::string reason_of(const Anchor& anchor, const std::int64_t* printed) {
    const std::string name = anchor.axis == 0 ? "rows" : "columns", seen = std::to_string(anchor.seen);
    const std::string of = "only " + seen + " of " + std::to_string(printed[anchor.axis]) + " " + name + " seen";
    switch (anchor.fault) {
        case AnchorFault::TOO_FEW:
            return "no " + name + " with enough dots";
        case AnchorFault::ANOTHER_PATTERN:
            return seen + " " + name + " of dots seen, " + std::to_string(printed[anchor.axis]) + " configured: is it another pattern?";
        case AnchorFault::DISAGREEMENT:
            return seen + " " + name + " of dots seen, " + std::to_string(printed[anchor.axis]) +
                   " configured, and the last frame had others";
        case AnchorFault::AMBIGUOUS:
            return of + ", and which is ambiguous: let the camera see all of them once, or set " + name + " to those it sees";
        default:
            return "";
    }
}

// Rows and columns of a lattice's members, and of dots beyond gaps that no link bridges where many are without.
IndexedDots members_of(const Lattice& lattice, const double* places, std::ptrdiff_t count, std::vector<std::ptrdiff_t>& which) {
    std::vector<std::int64_t> rc;
    for (std::ptrdiff_t i = 0; i < count; ++i) rc.insert(rc.end(), {lattice.row[i], lattice.column[i]});
    std::vector<std::uint8_t> member = lattice.member;
    const auto linked = std::count(member.begin(), member.end(), 1);
    if (static_cast<double>(linked) < (1 - LOOSE) * static_cast<double>(count)) Growth(places, count, lattice.pitch, rc, member).run();
    IndexedDots dots;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        if (!member[i]) continue;
        dots.places.insert(dots.places.end(), places + 2 * i, places + 2 * i + 2);
        dots.rc.insert(dots.rc.end(), rc.begin() + 2 * i, rc.begin() + 2 * i + 2);
        which.push_back(i);
    }
    return dots;
}

}  // namespace

GridNumbering::GridNumbering(std::int64_t rows, std::int64_t columns) : printed_{rows, columns} {}

GridNumbers GridNumbering::number(const double* places, std::ptrdiff_t count, double width, double height) {
    GridNumbers found = numbered(places, count, width, height);
    if (found.reason.empty()) remember(places, found.id.data(), count);
    return found;
}

void GridNumbering::remember(const double* places, const std::int64_t* id, std::ptrdiff_t count) {
    before_places_.clear(), before_rc_.clear();
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        if (id[i] < 0) continue;
        before_places_.insert(before_places_.end(), places + 2 * i, places + 2 * i + 2);
        before_rc_.insert(before_rc_.end(), {id[i] / printed_[1], id[i] % printed_[1]});
    }
}

GridNumbers GridNumbering::numbered(const double* places, std::ptrdiff_t count, double width, double height) const {
    GridNumbers found{std::vector<std::int64_t>(count, -1), "", std::numeric_limits<double>::quiet_NaN()};
    const Lattice lattice = find_lattice(places, count, 0);
    const std::string seen = std::to_string(count) + " dots found";
    if (!lattice.found) {
        found.reason = seen + " do not form a consistent grid";
        return found;
    }
    if (std::abs(lattice.angle) > MOST_TURNED) {
        found.reason =
            "rows run at " + std::to_string(std::lround(lattice.angle * 180 / M_PI)) + " degrees: rows and columns are ambiguous";
        return found;
    }
    found.pitch = lattice.pitch;
    std::vector<std::ptrdiff_t> which;
    const IndexedDots dots = members_of(lattice, places, count, which), before{before_places_, before_rc_};
    const Anchor anchor = Anchoring(dots, before, {{printed_[0], printed_[1]}, lattice.pitch, width, height}).run();
    if (anchor.fault != AnchorFault::NONE) {
        const bool few = static_cast<double>(which.size()) < FEW_LINKED * static_cast<double>(count);
        found.reason = (few ? "of " + seen + " (" + std::to_string(printed_[0] * printed_[1]) + " configured) only " +
                                  std::to_string(which.size()) + " are linked: "
                            : "") +
                       reason_of(anchor, printed_);
        return found;
    }
    std::ptrdiff_t numbers = 0;
    for (std::size_t k = 0; k < which.size(); ++k) {
        const std::int64_t row = dots.rc[2 * k] + anchor.offset[0], column = dots.rc[2 * k + 1] + anchor.offset[1];
        if (row < 0 || column < 0 || row >= printed_[0] || column >= printed_[1]) continue;
        found.id[which[k]] = row * printed_[1] + column;
        ++numbers;
    }
    if (numbers < printed_[0] * printed_[1]) Outliers(printed_[0], printed_[1]).run(found.id.data(), places, count);  // all are consistent
    return found;
}

}  // namespace tactile
