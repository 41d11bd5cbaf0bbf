// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Origin of a lattice on the printed grid: its first row and column. One image determines it when all printed rows and columns are seen.
// If an outer row is missing, it either left the image (its position lies outside) or the indices of the last frame continue (motion
// below half a pitch). A shift by exactly one pitch with an occluded outer row is unobservable; such frames are rejected.
#include "dots/index/grid_anchor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "common/median.hpp"
#include "dots/index/neighbours.hpp"

namespace tactile {
namespace {

constexpr double OUTER_SHARE = 0.2;       // of the printed length, least number of dots of an outer row; fewer are false dots. Chosen
constexpr double CLIPPED_SHARE = 0.75;    // of the median row, most dots of an outer row that may be dropped if too many are seen. Chosen
constexpr std::int64_t MOST_CLIPPED = 2;  // surplus rows that may be dropped. Chosen
constexpr double NEAR = 0.35;             // pitches within which a dot continues one of the last frame. Chosen: below half a pitch
constexpr double STAYED_SHARE = 0.8;      // of the dots, that must continue for the last indices to be used. Chosen
constexpr double STILL = 0.2;             // pitches, largest median motion of a pattern at rest. Chosen
constexpr double UNEVEN_RATIO = 0.5;     // spread of motions at the right indices over that one row off, below which it is excluded. Chosen
constexpr std::size_t FEWEST_MOVES = 8;  // motions that give a spread. Chosen
constexpr double CUT = 0.25;             // pitches: dots nearer to the border are cut by it and may be missed. Chosen: a dot's radius

// Rows (or columns) with enough dots: index of the first, number of dots in each, number of printed ones.
struct Extent {
    std::int64_t first, printed;
    std::vector<std::int64_t> counts;
    std::int64_t seen() const { return static_cast<std::int64_t>(counts.size()); }
};

// Offset by the last frame. sure: for rows and columns, whether a shift by a whole pitch is excluded; still: whether nothing moved.
struct Vote {
    std::int64_t offset[2];
    bool sure[2], still;
};

class Anchoring {
 public:
    Anchoring(const IndexedDots& dots, const IndexedDots& before, const GridView& view)
        : dots_(dots), before_(before), view_(view), extents_{extent(0), extent(1)} {}

    Anchor run() const {
        for (int axis = 0; axis < 2; ++axis) {
            if (extents_[axis].counts.empty()) return {{0, 0}, AnchorFault::TOO_FEW, axis, 0};
        }
        const bool whole = extents_[0].seen() == extents_[0].printed && extents_[1].seen() == extents_[1].printed;
        const std::optional<Vote> vote = whole ? std::nullopt : vote_of_last_frame();
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
        if (extent.seen() == extent.printed) return AnchorFault::NONE;
        // Index among the seen rows of printed row 0 by the last frame.
        const std::optional<std::int64_t> by_vote = vote ? std::optional<std::int64_t>(-vote->offset[axis] - extent.first) : std::nullopt;
        if (extent.seen() > extent.printed) return drop_clipped(extent, by_vote, window);
        return place_part(axis, by_vote, vote && vote->sure[axis], vote && vote->still, window);
    }

    // More rows than printed: drops incomplete rows at the ends; else it is another pattern.
    static AnchorFault drop_clipped(const Extent& extent, const std::optional<std::int64_t>& by_vote, std::int64_t& window) {
        const std::int64_t spare = extent.seen() - extent.printed;
        if (spare > MOST_CLIPPED) return AnchorFault::ANOTHER_PATTERN;
        const auto& counts = extent.counts;
        std::int64_t most = -1, best = 0;
        for (std::int64_t k = 0; k <= spare; ++k) {
            const std::int64_t sum = std::accumulate(counts.begin() + k, counts.begin() + k + extent.printed, std::int64_t{0});
            if (sum > most) most = sum, best = k;
        }
        std::int64_t dropped = 0;
        for (std::int64_t k = 0; k < extent.seen(); ++k) {
            if (k < best || k >= best + extent.printed) dropped = std::max(dropped, counts[k]);
        }
        if (static_cast<double>(dropped) <= CLIPPED_SHARE * median({counts.begin(), counts.end()})) {
            window = best;
            return AnchorFault::NONE;
        }
        if (!by_vote || *by_vote < 0 || *by_vote > spare) return AnchorFault::ANOTHER_PATTERN;
        window = *by_vote;
        return AnchorFault::NONE;
    }

    // Fewer rows than printed: places them by the side that left the image and by the last frame. If the pattern extends beyond both sides
    // of the first frame, the row on the nearer side is assumed missing.
    AnchorFault place_part(int axis, std::optional<std::int64_t> by_vote, bool sure, bool still, std::int64_t& window) const {
        const Extent& extent = extents_[axis];
        const std::int64_t missing = extent.printed - extent.seen();
        const double before = beyond(axis, 0), after = beyond(axis, 1);
        std::optional<std::int64_t> by_border;
        if (before > 0 && !(after > 0)) by_border = -missing;
        if (after > 0 && !(before > 0)) by_border = 0;
        if (by_vote && (-*by_vote < 0 || -*by_vote > missing)) by_vote.reset(), sure = still = false;
        if (by_border && by_vote && *by_border != *by_vote && !sure) return AnchorFault::DISAGREEMENT;
        const bool wider = before > 0 && after > 0;  // the pattern extends beyond both sides of the image
        std::optional<std::int64_t> chosen = sure || (still && wider) ? by_vote : by_border;
        if (!chosen && before_.count() == 0 && missing == 1 && wider) chosen = before < after ? -1 : 0;
        window = chosen.value_or(0);
        return chosen ? AnchorFault::NONE : AnchorFault::AMBIGUOUS;
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
        if (distances.empty() || static_cast<double>(distances.size()) < enough) return std::nullopt;
        Vote vote{};
        for (int k = 0; k < 2; ++k) vote.offset[k] = static_cast<std::int64_t>(median(offsets[k]));
        std::ptrdiff_t agreeing = 0;
        for (std::size_t i = 0; i < distances.size(); ++i) {
            agreeing += offsets[0][i] == static_cast<double>(vote.offset[0]) && offsets[1][i] == static_cast<double>(vote.offset[1]);
        }
        if (static_cast<double>(agreeing) < enough) return std::nullopt;
        vote.still = median(distances) < STILL * view_.pitch;
        for (int axis = 0; axis < 2; ++axis) vote.sure[axis] = fits_only_here(vote, axis);
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
    bool fits_only_here(const Vote& vote, int axis) const {
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
        return spread[1] < UNEVEN_RATIO * std::min(spread[0], spread[2]);
    }

    const IndexedDots &dots_, &before_;
    const GridView view_;
    const Extent extents_[2];
};

}  // namespace

Anchor anchor_lattice(const IndexedDots& dots, const IndexedDots& before, const GridView& view) {
    return Anchoring(dots, before, view).run();
}

}  // namespace tactile
