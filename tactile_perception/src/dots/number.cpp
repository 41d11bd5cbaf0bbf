// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/number.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "common/median.hpp"
#include "dots/lattice.hpp"
#include "dots/links.hpp"

namespace tactile {
namespace {

constexpr double MOST_TURNED = 38.0 * M_PI / 180;  // rad: rotated further, rows and columns may be exchanged
constexpr double FEW_LINKED = 0.7;                 // of the dots: with fewer linked, the reason gives their number

// Origin of a lattice on the printed grid: its first row and column. The last certain frame determines it where the irregularity of the
// pattern excludes a shift by a pitch; else one image does when all printed rows and columns are seen; elsewhere the frame is rejected.

constexpr double OUTER_SHARE = 0.2;       // of the printed length, least number of dots of an outer row; fewer are false dots. Chosen
constexpr double CLIPPED_SHARE = 0.75;    // of the median row, most dots of an outer row that may be dropped if too many are seen. Chosen
constexpr std::int64_t MOST_CLIPPED = 2;  // surplus rows that may be dropped. Chosen
constexpr double NEAR = 0.35;             // pitches within which a dot continues one of the last frame. Chosen: below half a pitch
constexpr double STAYED_SHARE = 0.8;      // of the dots, that must continue for the last indices to be used. Chosen
constexpr double STILL = 0.2;             // pitches, largest median motion from the last frame that needs less evidence. Chosen
constexpr double UNEVEN_RATIO = 0.5;     // spread of motions at the right indices over that one row off, below which it is excluded. Chosen
constexpr double STILL_RATIO = 0.8;      // the same where little moved. Chosen: an even grid, which cannot tell, has one
constexpr std::size_t FEWEST_MOVES = 8;  // motions that give a spread. Chosen

// Dots with relative or printed rows and columns: places (count, 2), px; rc (count, 2).
struct IndexedDots {
    std::vector<double> places;
    std::vector<std::int64_t> rc;
    std::ptrdiff_t count() const { return static_cast<std::ptrdiff_t>(rc.size() / 2); }
};

// A printed grid: its rows and columns, and pitch, px.
struct GridView {
    std::int64_t printed[2];
    double pitch;
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
        if (extent.seen() < extent.printed) return AnchorFault::AMBIGUOUS;
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

// Rows and columns of a lattice's members, whose indices are appended to which.
IndexedDots members_of(const Lattice& lattice, const double* places, std::vector<std::ptrdiff_t>& which) {
    IndexedDots dots;
    for (std::size_t i = 0; i < lattice.member.size(); ++i) {
        if (!lattice.member[i]) continue;
        dots.places.insert(dots.places.end(), places + 2 * i, places + 2 * i + 2);
        dots.rc.insert(dots.rc.end(), lattice.rc.begin() + 2 * i, lattice.rc.begin() + 2 * i + 2);
        which.push_back(i);
    }
    return dots;
}

}  // namespace

GridNumbering::GridNumbering(std::int64_t rows, std::int64_t columns) : printed_{rows, columns} {}

GridNumbers GridNumbering::number(const double* places, std::ptrdiff_t count) {
    GridNumbers found = numbered(places, count);
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

GridNumbers GridNumbering::numbered(const double* places, std::ptrdiff_t count) const {
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
    const IndexedDots dots = members_of(lattice, places, which), before{before_places_, before_rc_};
    const Anchor anchor = Anchoring(dots, before, {{printed_[0], printed_[1]}, lattice.pitch}).run();
    if (anchor.fault != AnchorFault::NONE) {
        const bool few = static_cast<double>(which.size()) < FEW_LINKED * static_cast<double>(count);
        found.reason = (few ? "of " + seen + " (" + std::to_string(printed_[0] * printed_[1]) + " configured) only " +
                                  std::to_string(which.size()) + " are linked: "
                            : "") +
                       reason_of(anchor, printed_);
        return found;
    }
    for (std::size_t k = 0; k < which.size(); ++k) {
        const std::int64_t row = dots.rc[2 * k] + anchor.offset[0], column = dots.rc[2 * k + 1] + anchor.offset[1];
        if (row < 0 || column < 0 || row >= printed_[0] || column >= printed_[1]) continue;
        found.id[which[k]] = row * printed_[1] + column;
    }
    return found;
}

}  // namespace tactile
