// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/links.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "common/cells.hpp"
#include "common/median.hpp"
#include "common/nearest.hpp"

namespace tactile {
namespace {

using Eigen::Vector2d;

constexpr std::ptrdiff_t NEIGHBOURS = 8;    // of a track: a square grid has as many within one step
constexpr std::size_t MIN_COMPARED = 4;     // dots, of which one is compared with the others
constexpr double GATE = 0.7;                // spacings from its expected position, within which a track's dot is searched: half a diagonal
constexpr double MAX_STRAIN = 0.5;          // difference of neighbours' displacements over their distance: beyond it they may be exchanged
constexpr double MOTION_SIGMA = 0.2;        // spacings, of the common motion between two frames about a prediction: a prior
const double UNEXPLAINED = std::log(20);    // nats: one of 20 dots is missed in a frame, or false
const double RELEASED = std::log(1e6);      // nats: one of a million frames shows the end of a press that the frame before shows in full
const double CONTRADICTED = std::log(1e4);  // nats: an answer that is less probable by so much contradicts no link
constexpr double INFINITE = std::numeric_limits<double>::infinity();

// An answer: the dot of each track, the tracks' positions, and what speaks against it, nats.
struct Hypothesis {
    std::vector<std::int32_t> dot;
    std::ptrdiff_t links = 0;
    Positions position;
    double cost = INFINITE;
};

class TrackLinker {
 public:
    TrackLinker(const TracksBefore& tracks, const Positions& dots, const Vector2d& size)
        : tracks_(tracks), last_(tracks.last), dots_(dots), size_(size), cells_(dots.data(), dots.cols()), neighbour_(tracks.seen.size()) {
        const std::ptrdiff_t count = NEIGHBOURS + 1;  // a track is among those nearest to it
        const Nearest near = nearest_points(last_.data(), last_.cols(), last_.data(), last_.cols(), count);
        std::vector<double> pitch;
        for (std::ptrdiff_t i = 0; i < last_.cols(); ++i) {
            double nearest = INFINITE;
            for (std::ptrdiff_t k = count * i; k < count * (i + 1); ++k) {
                if (near.index[k] == i || near.index[k] == last_.cols()) continue;
                nearest = std::min(nearest, near.distance[k]);
                neighbour_[static_cast<std::size_t>(i)].push_back(static_cast<std::int32_t>(near.index[k]));
            }
            pitch.push_back(std::max(nearest, 1e-6));
        }
        spacing_ = median(pitch);
        pitch_ = Eigen::Map<const Eigen::ArrayXd>(pitch.data(), last_.cols());
    }

    TrackLinks solve() const {
        std::vector<Hypothesis> hypotheses{fit(tracks_.predicted), fit(last_), fit(tracks_.first)};
        const auto cheapest = [&] {
            return std::min_element(hypotheses.begin(), hypotheses.end(),
                                    [](const Hypothesis& a, const Hypothesis& b) { return a.cost < b.cost; });
        };
        auto best = cheapest();
        const double motion = MOTION_SIGMA * std::sqrt(2 * surprise(best->position));          // spacings, from the nearest prediction
        const double of_others = std::pow((1 - std::min(motion, 1.0)) / MOTION_SIGMA, 2) / 2;  // smallest of any that differs by a spacing
        if (best->cost + CONTRADICTED > of_others) {
            const auto middle = static_cast<Eigen::Index>(middle_track());
            const double best_cost = best->cost;
            for (const std::int32_t j : neighbour_[static_cast<std::size_t>(middle)]) {
                const Vector2d step = (last_.col(j) - last_.col(middle)) / pitch_[middle];
                for (const double share : {0.5, 1.0}) {
                    const Positions expected = tracks_.predicted + share * step * pitch_.matrix().transpose();
                    if (surprise(expected) < best_cost + CONTRADICTED) hypotheses.push_back(fit(expected));
                }
            }
            best = cheapest();
        }
        TrackLinks answer{best->dot, {}, spacing_, 0};
        for (const Hypothesis& other : hypotheses) {
            if (other.cost > best->cost + CONTRADICTED) continue;
            for (Eigen::Index i = 0; i < last_.cols(); ++i)
                if ((other.position.col(i) - best->position.col(i)).squaredNorm() > spacing_ * spacing_ / 4)
                    answer.dot[static_cast<std::size_t>(i)] = -1;
        }
        answer.position.assign(best->position.data(), best->position.data() + best->position.size());
        answer.ambiguous = ambiguous(answer.dot, best->position);
        return answer;
    }

 private:
    std::size_t middle_track() const {
        Vector2d mean = Vector2d::Zero();
        double count = 0;
        for (std::size_t i = 0; i < tracks_.seen.size(); ++i)
            if (tracks_.seen[i]) mean += last_.col(static_cast<Eigen::Index>(i)), ++count;
        mean /= std::max(count, 1.0);
        std::size_t middle = 0;
        double smallest = INFINITE;
        for (std::size_t i = 0; i < tracks_.seen.size(); ++i) {
            const double square = (last_.col(static_cast<Eigen::Index>(i)) - mean).squaredNorm();
            if (tracks_.seen[i] && square < smallest) smallest = square, middle = i;
        }
        return middle;
    }

    // Links near expected positions, and again where the neighbours' links lead, while that finds more.
    Hypothesis fit(const Positions& expected) const {
        Hypothesis best{std::vector<std::int32_t>(tracks_.seen.size(), -1), 0, expected, 0};
        while (best.links < std::min(last_.cols(), dots_.cols())) {
            std::vector<std::int32_t> dot = nearest(best.position);
            const std::ptrdiff_t links = drop_torn(dot);
            if (links <= best.links) break;
            best.links = links;
            best.position = positions(dot);
            best.dot = std::move(dot);
        }
        best.cost = UNEXPLAINED * static_cast<double>(unexplained(best)) + surprise(best.position);
        return best;
    }

    // The dot of each track of which it is the nearest, where that track is also nearest to the dot.
    std::vector<std::int32_t> nearest(const Positions& expected) const {
        const std::size_t count = tracks_.seen.size(), dots = static_cast<std::size_t>(dots_.cols());
        std::vector<std::int32_t> dot(count, -1), track(dots, -1);
        std::vector<double> smallest(dots, INFINITE);
        for (std::size_t i = 0; i < count; ++i) {
            double nearest = INFINITE;
            cells_.within(expected(0, static_cast<Eigen::Index>(i)), expected(1, static_cast<Eigen::Index>(i)), GATE * spacing_,
                          [&](Eigen::Index j, double square) {
                              const auto n = static_cast<std::size_t>(j);
                              if (square < nearest) nearest = square, dot[i] = static_cast<std::int32_t>(j);
                              if (square < smallest[n]) smallest[n] = square, track[n] = static_cast<std::int32_t>(i);
                          });
        }
        for (std::size_t i = 0; i < count; ++i)
            if (dot[i] >= 0 && track[static_cast<std::size_t>(dot[i])] != static_cast<std::int32_t>(i)) dot[i] = -1;
        return dot;
    }

    // Parts of the pattern that move continuously are joined. A part that contradicts a larger one beside it loses its links, and so do
    // neighbours of one part that contradict each other. Returns how many links are left.
    std::ptrdiff_t drop_torn(std::vector<std::int32_t>& dot) const {
        const std::size_t count = dot.size();
        std::vector<std::pair<std::size_t, std::size_t>> torn, joined;
        for (std::size_t i = 0; i < count; ++i) {
            if (dot[i] < 0) continue;
            for (const std::int32_t neighbour : neighbour_[i]) {
                const auto j = static_cast<std::size_t>(neighbour);
                if (dot[j] < 0) continue;
                const auto a = static_cast<Eigen::Index>(i), b = static_cast<Eigen::Index>(j);
                const Vector2d strain = dots_.col(dot[i]) - last_.col(a) - dots_.col(dot[j]) + last_.col(b);
                const double limit = MAX_STRAIN * std::min(pitch_[a], pitch_[b]);
                (strain.squaredNorm() < limit * limit ? joined : torn).emplace_back(i, j);
            }
        }
        if (torn.empty()) return static_cast<std::ptrdiff_t>(count) - std::count(dot.begin(), dot.end(), -1);
        std::vector<std::size_t> part(count), size(count, 1);
        std::iota(part.begin(), part.end(), std::size_t{0});
        const auto root = [&](std::size_t i) {
            while (part[i] != i) i = part[i] = part[part[i]];
            return i;
        };
        for (const auto& [i, j] : joined) {
            const std::size_t a = root(i), b = root(j);
            if (a != b) size[b] += size[a], part[a] = b;
        }
        std::vector<std::uint8_t> lost(count, 0);
        for (const auto& [i, j] : torn) {
            const std::size_t a = root(i), b = root(j);
            if (a == b) dot[i] = dot[j] = -1;
            if (a != b && size[a] <= size[b]) lost[a] = 1;
            if (a != b && size[b] <= size[a]) lost[b] = 1;
        }
        std::ptrdiff_t links = 0;
        for (std::size_t i = 0; i < count; ++i) {
            if (lost[root(i)]) dot[i] = -1;
            links += dot[i] >= 0;
        }
        return links;
    }

    // Of tracks with links, their dots; else as the neighbours move, or, without a neighbour's link, as the middle one of all tracks.
    Positions positions(const std::vector<std::int32_t>& dot) const {
        Positions found = last_;
        std::vector<double> moved[2];
        for (std::size_t i = 0; i < dot.size(); ++i) {
            if (dot[i] < 0) continue;
            found.col(static_cast<Eigen::Index>(i)) = dots_.col(dot[i]);
            for (int axis = 0; axis < 2; ++axis) moved[axis].push_back(dots_(axis, dot[i]) - last_(axis, static_cast<Eigen::Index>(i)));
        }
        const Vector2d common{median(moved[0]), median(moved[1])};
        for (std::size_t i = 0; i < dot.size(); ++i) {
            if (dot[i] >= 0) continue;
            Vector2d sum = Vector2d::Zero();
            double known = 0;
            for (const std::int32_t j : neighbour_[i])
                if (dot[static_cast<std::size_t>(j)] >= 0) sum += dots_.col(dot[static_cast<std::size_t>(j)]) - last_.col(j), ++known;
            found.col(static_cast<Eigen::Index>(i)) += known > 0 ? Vector2d(sum / known) : common;
        }
        return found;
    }

    bool is_inside(const Vector2d& p) const { return (p.array() > spacing_ / 2).all() && (p.array() < size_.array() - spacing_ / 2).all(); }

    // How many tracks and dots without a link are half a spacing and more within the image, now and in the last frame.
    std::ptrdiff_t unexplained(const Hypothesis& answer) const {
        std::vector<double> moved[2];
        std::vector<std::uint8_t> is_new(static_cast<std::size_t>(dots_.cols()), 1);
        std::ptrdiff_t missed = 0;
        for (std::size_t i = 0; i < answer.dot.size(); ++i) {
            const auto k = static_cast<Eigen::Index>(i);
            if (answer.dot[i] >= 0) is_new[static_cast<std::size_t>(answer.dot[i])] = 0;
            if (!tracks_.seen[i]) continue;
            missed += answer.dot[i] < 0 && is_inside(answer.position.col(k));
            for (int axis = 0; axis < 2; ++axis) moved[axis].push_back(answer.position(axis, k) - last_(axis, k));
        }
        const Vector2d common{median(moved[0]), median(moved[1])};
        for (Eigen::Index j = 0; j < dots_.cols(); ++j)
            missed += is_new[static_cast<std::size_t>(j)] && is_inside(dots_.col(j)) && is_inside(dots_.col(j) - common);
        return missed;
    }

    // Nats against the motion of the tracks to these positions, by the prediction that it fits best.
    double surprise(const Positions& position) const {
        double smallest = INFINITE;
        for (const auto& [expected, cost] :
             {std::pair(&tracks_.predicted, 0.0), std::pair(&tracks_.last, 0.0), std::pair(&tracks_.first, RELEASED)}) {
            std::vector<double> squares;
            for (std::size_t i = 0; i < tracks_.seen.size(); ++i) {
                const auto k = static_cast<Eigen::Index>(i);
                if (tracks_.seen[i]) squares.push_back((position.col(k) - expected->col(k)).squaredNorm());
            }
            const double sigma = MOTION_SIGMA * spacing_;
            smallest = std::min(smallest, cost + median(squares) / (2 * sigma * sigma));
        }
        return smallest;
    }

    // How many seen tracks without a link have a dot without one within a spacing.
    std::ptrdiff_t ambiguous(const std::vector<std::int32_t>& dot, const Positions& position) const {
        std::vector<std::uint8_t> is_free(static_cast<std::size_t>(dots_.cols()), 1);
        for (const std::int32_t j : dot)
            if (j >= 0) is_free[static_cast<std::size_t>(j)] = 0;
        std::ptrdiff_t count = 0;
        for (std::size_t i = 0; i < dot.size(); ++i) {
            bool has_free = false;
            if (dot[i] < 0 && tracks_.seen[i])
                cells_.within(position(0, static_cast<Eigen::Index>(i)), position(1, static_cast<Eigen::Index>(i)), spacing_,
                              [&](Eigen::Index j, double) { has_free |= is_free[static_cast<std::size_t>(j)] != 0; });
            count += has_free;
        }
        return count;
    }

    const TracksBefore& tracks_;
    const Positions &last_, &dots_;
    const Vector2d size_;
    const Cells cells_;                                 // of the dots
    std::vector<std::vector<std::int32_t>> neighbour_;  // of each track, nearest first
    Eigen::ArrayXd pitch_;                              // px, of each track to its nearest neighbour
    double spacing_ = 0;
};

}  // namespace

TrackLinks link_tracks(const TracksBefore& tracks, const Positions& dots, const Vector2d& size) {
    return TrackLinker(tracks, dots, size).solve();
}

std::vector<std::uint8_t> continuous(const Positions& first, const Positions& now) {
    const Positions moved = now - first;
    std::vector<std::uint8_t> kept(static_cast<std::size_t>(first.cols()), 1);
    std::vector<Eigen::Index> some(kept.size());
    std::iota(some.begin(), some.end(), Eigen::Index{0});
    for (std::size_t before = 0; some.size() != before && some.size() >= MIN_COMPARED;) {
        before = some.size();
        const auto count = static_cast<Eigen::Index>(before), each = std::min<Eigen::Index>(NEIGHBOURS + 1, count);
        Positions at(2, count);
        for (Eigen::Index i = 0; i < count; ++i) at.col(i) = first.col(some[static_cast<std::size_t>(i)]);
        const Nearest near = nearest_points(at.data(), count, at.data(), count, each);
        std::vector<double> nearest;
        for (Eigen::Index i = 0; i < count; ++i) nearest.push_back(near.distance[static_cast<std::size_t>(each * i + 1)]);
        const double spacing = median(nearest);  // of the print: where dots are missing, those near are farther
        std::vector<Eigen::Index> good;
        for (Eigen::Index i = 0; i < count; ++i) {
            const Eigen::Index dot = some[static_cast<std::size_t>(i)];
            std::vector<double> around[2];
            for (Eigen::Index n = each * i + 1; n < each * (i + 1); ++n)
                for (int axis = 0; axis < 2; ++axis)
                    around[axis].push_back(moved(axis, some[static_cast<std::size_t>(near.index[static_cast<std::size_t>(n)])]));
            const Vector2d usual{median(std::move(around[0])), median(std::move(around[1]))};
            if ((moved.col(dot) - usual).norm() < MAX_STRAIN * std::min(nearest[static_cast<std::size_t>(i)], spacing))
                good.push_back(dot);
            else
                kept[static_cast<std::size_t>(dot)] = 0;
        }
        some = std::move(good);
    }
    return kept;
}

}  // namespace tactile
