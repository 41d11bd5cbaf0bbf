// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/numbering.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "common/median.hpp"
#include "dots/lattice.hpp"
#include "dots/links.hpp"

namespace tactile {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Offset = std::array<std::int64_t, 2>;  // rows and columns

constexpr NumberingLimits LIMITS;
constexpr const char* NAMES[] = {"rows", "columns"};

// Why no dot is numbered.
struct NotCertain : std::runtime_error {
    using std::runtime_error::runtime_error;
};

template <class... Part>
std::string text(const Part&... parts) {
    const auto shown = [](const auto& part) {
        if constexpr (std::is_arithmetic_v<std::decay_t<decltype(part)>>)
            return std::to_string(part);
        else
            return std::string(part);
    };
    return (shown(parts) + ...);
}

std::string degrees(double angle) {
    char shown[32];
    std::snprintf(shown, sizeof shown, "%.0f", angle * 180 / M_PI);
    return shown;
}

template <class T>
T upper_median(std::vector<T> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

bool is_known(const Rows2& positions, Index row) {
    return std::isfinite(positions(row, 0));
}

// A dot of the lattice: px, relative row and column.
struct LatticeDot {
    Index dot;
    Vector2d uv;
    Offset index;
};

// The rows, or columns, of a lattice: the first that has enough dots, and the numbers of dots of those from there to the last such one.
struct Extent {
    std::int64_t first = 0;
    std::vector<std::int64_t> counts;

    Extent(const std::vector<LatticeDot>& dots, std::size_t axis, double min_dots) {
        if (dots.empty()) return;
        const auto by_index = [axis](const LatticeDot& a, const LatticeDot& b) { return a.index[axis] < b.index[axis]; };
        const auto [low, high] = std::minmax_element(dots.begin(), dots.end(), by_index);
        first = low->index[axis];
        counts.assign(static_cast<std::size_t>(high->index[axis] - first + 1), 0);
        for (const LatticeDot& one : dots) ++counts[static_cast<std::size_t>(one.index[axis] - first)];
        const auto is_full = [least = std::max(min_dots, static_cast<double>(LIMITS.min_row))](std::int64_t count) {
            return static_cast<double>(count) >= least;
        };
        counts.erase(std::find_if(counts.rbegin(), counts.rend(), is_full).base(), counts.end());
        const auto begin = std::find_if(counts.begin(), counts.end(), is_full);
        first += begin - counts.begin();
        counts.erase(counts.begin(), begin);
    }
    std::int64_t size() const { return static_cast<std::int64_t>(counts.size()); }
};

// What to add to relative rows and columns of dots to get printed ones. The last certain image, before, null for none, decides where the
// irregularity of the pattern excludes a shift by a pitch; else one image does where all printed rows and columns are seen.
class Origin {
 public:
    Origin(const std::vector<LatticeDot>& dots, double pitch, const PrintedGrid& printed, const Rows2* before)
        : dots_(dots),
          pitch_(pitch),
          printed_(printed),
          before_(before),
          is_whole_(printed.is_whole || !before),
          extents_{Extent(dots, 0, LIMITS.outer_share * static_cast<double>(printed.columns)),
                   Extent(dots, 1, LIMITS.outer_share * static_cast<double>(printed.rows))} {}

    // found: number of dots, of which some are on the lattice.
    Offset find(std::size_t found) {
        try {
            if (before_) continue_last();
            return {shift_of(0), shift_of(1)};
        } catch (const NotCertain& error) {
            if (static_cast<double>(dots_.size()) >= LIMITS.few_linked * static_cast<double>(found)) throw;
            throw NotCertain(text("of ", found, " dots found (", printed_.count(), " configured) only ", dots_.size(),
                                  " are linked: ", error.what()));
        }
    }

 private:
    std::int64_t printed(std::size_t axis) const { return axis ? printed_.columns : printed_.rows; }

    std::int64_t shift_of(std::size_t axis) const {
        const auto& [first, counts] = extents_[axis];
        const std::int64_t seen = extents_[axis].size(), all = printed(axis);
        if (!seen) throw NotCertain(text("no ", NAMES[axis], " with enough dots"));
        const std::optional<std::int64_t> by_last = offset_ ? std::optional(-(*offset_)[axis] - first) : std::nullopt;
        if (seen == all && (by_last ? *by_last == 0 : is_whole_)) return -first;
        if (by_last && fits_only_here(axis, is_still_ && seen < all ? LIMITS.still_ratio : LIMITS.uneven_ratio)) return (*offset_)[axis];
        if (seen < all + !is_whole_)
            throw NotCertain(text(seen, " of ", all, " ", NAMES[axis],
                                  " seen, and which is ambiguous: let the camera see all of them once, or set ", NAMES[axis],
                                  " to those it sees"));
        if (seen == all) return -first;
        // Incomplete rows at the ends are dropped, those that the last image had not; else it is another pattern.
        std::vector<std::int64_t> sums;
        for (auto from = counts.begin(); counts.end() - from >= all; ++from) sums.push_back(std::accumulate(from, from + all, std::int64_t{0}));
        const std::int64_t window = std::max_element(sums.begin(), sums.end()) - sums.begin();  // row 0 of the print among those seen
        std::int64_t dropped = 0;
        for (std::int64_t k = 0; k < seen; ++k)
            if (k < window || k >= window + all) dropped = std::max(dropped, counts[static_cast<std::size_t>(k)]);
        if (seen - all > LIMITS.max_clipped ||
            static_cast<double>(dropped) > LIMITS.clipped_share * median({counts.begin(), counts.end()}))
            throw NotCertain(text(seen, " ", NAMES[axis], " of dots seen, ", all, " configured: is it another pattern?"));
        if (before_ && by_last != window)
            throw NotCertain(text(seen, " ", NAMES[axis], " of dots seen, ", all, " configured, and the last frame had others"));
        return -first - window;
    }

    // Finds the offset at which nearly all dots continue those of the last image, of two where they may.
    void continue_last() {
        double known = 0;
        for (Index k = 0; k < before_->rows(); ++k) known += is_known(*before_, k);
        const double needed = std::max(LIMITS.stayed_share * std::min(static_cast<double>(dots_.size()), known), 1.0);
        for (const bool by_nearest : {false, true}) {
            const Offset offset = by_nearest ? offset_of_nearest() : Offset{-extents_[0].first, -extents_[1].first};
            std::vector<double> stayed;
            for (const Vector2d& move : moves(offset))
                if (const double length = std::hypot(move[0], move[1]); length < LIMITS.near * pitch_) stayed.push_back(length);
            if (static_cast<double>(stayed.size()) < needed) continue;
            is_still_ = upper_median(std::move(stayed)) < LIMITS.max_still_motion * pitch_;
            offset_ = offset;
            return;
        }
    }

    // Offset of some of the dots from those of the last image that are nearest; 0 without any near ones.
    Offset offset_of_nearest() const {
        std::vector<std::int64_t> offsets[2];
        for (std::size_t i = 0; i < dots_.size(); i += std::max<std::size_t>(1, dots_.size() / LIMITS.sample)) {
            double smallest = std::numeric_limits<double>::infinity();
            Index nearest = 0;
            for (Index k = 0; k < before_->rows(); ++k) {
                const double u = dots_[i].uv[0] - (*before_)(k, 0), v = dots_[i].uv[1] - (*before_)(k, 1), square = u * u + v * v;
                if (square < smallest) smallest = square, nearest = k;  // not of NaN
            }
            if (!(smallest < (LIMITS.near * pitch_) * (LIMITS.near * pitch_))) continue;
            offsets[0].push_back(nearest / printed_.columns - dots_[i].index[0]);
            offsets[1].push_back(nearest % printed_.columns - dots_[i].index[1]);
        }
        if (offsets[0].empty()) return {0, 0};
        return {upper_median(std::move(offsets[0])), upper_median(std::move(offsets[1]))};
    }

    // px, motions since the last image of the dots that it shows at rows and columns that are so much higher.
    std::vector<Vector2d> moves(const Offset& offset) const {
        std::vector<Vector2d> found;
        found.reserve(dots_.size());
        for (const LatticeDot& one : dots_) {
            const std::int64_t row = one.index[0] + offset[0], column = one.index[1] + offset[1];
            if (row < 0 || row >= printed_.rows || column < 0 || column >= printed_.columns) continue;
            const Index number = row * printed_.columns + column;
            if (is_known(*before_, number)) found.push_back(one.uv - before_->row(number).transpose());
        }
        return found;
    }

    // Whether the irregularity of the pattern fits the last image at the offset, and much worse one row (or column) further.
    bool fits_only_here(std::size_t axis, double ratio) const {
        double spreads[3];
        for (const int shift : {0, 1, 2}) {
            Offset offset = *offset_;
            offset[axis] += shift == 2 ? -1 : shift;
            const std::vector<Vector2d> all = moves(offset);
            if (all.size() < LIMITS.min_moves) return false;
            std::vector<double> along[2], away;
            for (const Vector2d& move : all)
                for (const int k : {0, 1}) along[k].push_back(move[k]);
            const Vector2d middle{median(std::move(along[0])), median(std::move(along[1]))};
            for (const Vector2d& move : all) away.push_back((move - middle).lpNorm<1>());
            spreads[shift] = median(std::move(away));
        }
        return spreads[0] < ratio * std::min(spreads[1], spreads[2]);
    }

    const std::vector<LatticeDot>& dots_;
    const double pitch_;
    const PrintedGrid& printed_;
    const Rows2* before_;
    const bool is_whole_;
    const Extent extents_[2];
    std::optional<Offset> offset_;
    bool is_still_ = false;
};

std::vector<LatticeDot> members(const Lattice& lattice, const Rows2& uv) {
    std::vector<LatticeDot> found;
    for (std::size_t i = 0; i < lattice.member.size(); ++i) {
        const auto k = static_cast<Index>(i);
        if (lattice.member[i]) found.push_back({k, uv.row(k).transpose(), {lattice.rc[2 * i], lattice.rc[2 * i + 1]}});
    }
    return found;
}

std::vector<Index> positions_among(const Rows2& uv) {
    std::vector<Index> good;
    for (Index k = 0; k < uv.rows(); ++k)
        if (std::abs(uv(k, 0)) < FARTHEST && std::abs(uv(k, 1)) < FARTHEST) good.push_back(k);
    return good;
}

}  // namespace

GridNumbers GridNumbering::number(const Rows2& all) {
    GridNumbers found{std::vector<std::int64_t>(static_cast<std::size_t>(all.rows()), -1), "", std::numeric_limits<double>::quiet_NaN()};
    const std::vector<Index> good = positions_among(all);
    const Rows2 uv = all(good, Eigen::all);
    const Lattice lattice = find_lattice(uv.data(), uv.rows());
    if (!lattice.found) return found.reason = text(uv.rows(), " dots found do not form a consistent grid"), found;
    if (std::abs(lattice.angle * 180 / M_PI) > LIMITS.max_turned)
        return found.reason = text("rows run at ", degrees(lattice.angle), " degrees: rows and columns are ambiguous"), found;
    found.pitch = lattice.pitch;
    const std::vector<LatticeDot> dots = members(lattice, uv);
    std::optional<Offset> offset;
    for (std::size_t k = 0; !offset && k < std::max<std::size_t>(before_.size(), 1); ++k) try {
            offset = Origin(dots, lattice.pitch, printed_, before_.empty() ? nullptr : &before_[k]).find(lattice.member.size());
        } catch (const NotCertain& error) {
            if (k == 0) found.reason = error.what();
        }
    if (!offset) return found;
    found.reason.clear();
    Rows2 seen = Rows2::Constant(printed_.count(), 2, std::numeric_limits<double>::quiet_NaN());
    bool any = false;
    for (const LatticeDot& one : dots) {
        const std::int64_t row = one.index[0] + (*offset)[0], column = one.index[1] + (*offset)[1];
        if (row < 0 || row >= printed_.rows || column < 0 || column >= printed_.columns) continue;
        const std::int64_t number = row * printed_.columns + column;
        found.id[static_cast<std::size_t>(good[static_cast<std::size_t>(one.dot)])] = number;
        seen.row(number) = one.uv.transpose();
        any = true;
    }
    if (!any) return found;
    if (before_.size() < 2)
        before_.insert(before_.begin(), std::move(seen));
    else
        before_[0] = std::move(seen);
    return found;
}

PrintedGrid find_grid(const Rows2& all) {
    const Rows2 uv = all(positions_among(all), Eigen::all);
    const Lattice lattice = find_lattice(uv.data(), uv.rows());
    const std::vector<LatticeDot> dots = members(lattice, uv);
    if (!lattice.found || static_cast<double>(dots.size()) / static_cast<double>(uv.rows()) < LIMITS.on_grid) return {};
    Rows3 index(static_cast<Index>(dots.size()), 3);
    Rows2 positions(index.rows(), 2);
    for (Index k = 0; k < index.rows(); ++k) {
        const LatticeDot& one = dots[static_cast<std::size_t>(k)];
        index.row(k) << static_cast<double>(one.index[1]), static_cast<double>(one.index[0]), 1;
        positions.row(k) = one.uv.transpose();
    }
    const Rows2 steps = index.completeOrthogonalDecomposition().solve(positions);
    const double across = steps.row(0).norm(), down = steps.row(1).norm();
    if (std::abs(steps.row(0).dot(steps.row(1))) > LIMITS.oblique * across * down ||
        std::max(across, down) > LIMITS.unequal * std::min(across, down))
        return {};
    const auto seen = [&](std::size_t axis, double min_dots) { return Extent(dots, axis, min_dots).size(); };
    const std::int64_t rows = seen(0, LIMITS.outer_share * static_cast<double>(seen(1, 0)));
    const std::int64_t columns = seen(1, LIMITS.outer_share * static_cast<double>(rows));
    return std::min(rows, columns) >= 2 ? PrintedGrid{rows, columns} : PrintedGrid{};
}

}  // namespace tactile
