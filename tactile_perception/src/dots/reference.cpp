// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "dots/reference.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/median.hpp"

namespace tactile {
namespace {

constexpr double QUIET = 5.0;         // standard deviations from the affine motion, beyond which a contact displaces a dot. Chosen
constexpr double QUIET_FLOOR = 0.1;   // px, least such deviation: changes of light shift centroids by less. Chosen
constexpr double QUIET_SHARE = 0.01;  // of the dots, that may deviate as outliers. Chosen
constexpr double AFFINE_SHARE = 0.8;  // of the dots, those with the least residuals, that the second affine fit uses. Chosen
constexpr double DRIFTED = 0.5;       // px, median displacement that is contact: drift is tracked before it grows so far. Chosen
constexpr std::size_t FEWEST = 8;     // dots for an affine fit. Chosen
constexpr double FARTHEST = 1e12;     // px: no image is wider, and squares stay far from overflow
constexpr double RIDGE = 1e-9;        // of the dots' scatter, px^2, for collinear dots

constexpr double STILL = 0.1;        // px, largest motion of nearly all dots at rest. Chosen
constexpr double NOISE = 7.0;        // standard deviations, the same for noisy dots. Chosen: 5 sqrt 2, of a difference of positions
constexpr double NEARLY_ALL = 0.99;  // of the dots
constexpr double SAME_SHARE = 0.9;   // of the dots, least number seen in both frames. Chosen

constexpr double RELEASED = 0.15;  // of the largest size of a contact, largest residue
constexpr double LARGEST = 1.0;    // px, largest residue
constexpr double SETTLED_S = 3.0;  // s without motion
constexpr double GROWN = 1.5;      // times its accepted size, from which a residue is contact again

constexpr std::ptrdiff_t LONGEST_TABLE = 8;  // entries of find_ids for each id. Chosen: bounds the memory

// Deviation of dots from their common affine motion.
struct Deviation {
    bool moved;   // more dots deviate than outliers, or the whole pattern moved farther than drift
    double size;  // px, the largest deviation without outliers
};

// places (count, 2), px.
struct PlacedDots {
    const std::int64_t* id;
    const double* places;
    std::ptrdiff_t count;
};

// A dot: position and motion (u, v, du, dv), px.
struct Moved {
    Eigen::Vector4d at;
    double sigma;
};

// Squared residuals, px^2, of all dots from the affine motion fitted to those whose square is at most `most`.
std::vector<double> residuals(const std::vector<Moved>& dots, const std::vector<double>& squares, double most) {
    Eigen::Vector4d middle = Eigen::Vector4d::Zero();
    double count = 0;
    for (std::size_t i = 0; i < dots.size(); ++i) {
        if (squares[i] <= most) middle += dots[i].at, ++count;
    }
    middle /= count;
    Eigen::Matrix4d scatter = Eigen::Matrix4d::Zero();
    for (std::size_t i = 0; i < dots.size(); ++i) {
        if (squares[i] <= most) scatter += (dots[i].at - middle) * (dots[i].at - middle).transpose();
    }
    Eigen::Matrix2d places = scatter.topLeftCorner<2, 2>();
    places += (RIDGE * places.trace() + RIDGE) * Eigen::Matrix2d::Identity();
    const Eigen::Matrix2d slopes = scatter.bottomLeftCorner<2, 2>() * places.inverse();
    std::vector<double> found;
    for (const Moved& dot : dots) {
        const Eigen::Vector4d off = dot.at - middle;
        found.push_back((off.tail<2>() - slopes * off.head<2>()).squaredNorm());
    }
    return found;
}

// Index of each id (count) among known ids (known_count), of the first of equal ones; -1 where it is not among them.
// By a table of all ids from the least to the largest one, as on a grid; by search in sorted ids where it would be long.
std::vector<std::ptrdiff_t> find_ids(const std::int64_t* id, std::ptrdiff_t count, const std::int64_t* known, std::ptrdiff_t known_count) {
    std::vector<std::ptrdiff_t> found(count, -1);
    if (known_count == 0) return found;
    const auto [least, most] = std::minmax_element(known, known + known_count);
    const std::uint64_t low = static_cast<std::uint64_t>(*least), span = static_cast<std::uint64_t>(*most) - low;
    if (span < static_cast<std::uint64_t>(LONGEST_TABLE * known_count)) {
        std::vector<std::ptrdiff_t> table(span + 1, -1);
        for (std::ptrdiff_t k = known_count - 1; k >= 0; --k) table[static_cast<std::uint64_t>(known[k]) - low] = k;
        for (std::ptrdiff_t i = 0; i < count; ++i) {
            const std::uint64_t at = static_cast<std::uint64_t>(id[i]) - low;
            if (at <= span) found[i] = table[at];
        }
        return found;
    }
    std::vector<std::ptrdiff_t> order(known_count);
    std::iota(order.begin(), order.end(), std::ptrdiff_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) { return known[a] < known[b]; });
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const auto at =
            std::lower_bound(order.begin(), order.end(), id[i], [&](std::ptrdiff_t k, std::int64_t wanted) { return known[k] < wanted; });
        if (at != order.end() && known[*at] == id[i]) found[i] = *at;
    }
    return found;
}

// places, motions (count, 2), px, sigma (count), px per axis; dots whose motion is not finite are left out.
Deviation deviation_from_drift(const double* places, const double* motions, const double* sigma, std::ptrdiff_t count) {
    std::vector<Moved> dots;
    std::vector<double> squares;
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        const Moved dot{{places[2 * i], places[2 * i + 1], motions[2 * i], motions[2 * i + 1]}, sigma[i]};
        const double square = dot.at.tail<2>().squaredNorm();
        if (!(square <= FARTHEST * FARTHEST && dot.at.head<2>().cwiseAbs().maxCoeff() <= FARTHEST)) continue;  // or not seen
        dots.push_back(dot);
        squares.push_back(square);
    }
    if (dots.empty()) return {false, 0};
    const auto share = [&](double part) { return static_cast<std::ptrdiff_t>(part); };
    const auto number = static_cast<double>(dots.size());
    const double shared = std::sqrt(smallest(squares, share(number / 2)));
    if (dots.size() < FEWEST) return {shared > DRIFTED, shared};
    squares = residuals(dots, squares, *std::max_element(squares.begin(), squares.end()));
    squares = residuals(dots, squares, smallest(squares, share(AFFINE_SHARE * number)));
    std::ptrdiff_t leaving = 0;
    for (std::size_t i = 0; i < dots.size(); ++i) {
        const double quiet = QUIET * dots[i].sigma;  // NaN: no dot leaves
        leaving += std::sqrt(squares[i]) > (quiet < QUIET_FLOOR ? QUIET_FLOOR : quiet);
    }
    const double size = std::sqrt(smallest(squares, share((1 - QUIET_SHARE) * (number - 1))));
    return {static_cast<double>(leaving) > QUIET_SHARE * number || shared > DRIFTED, std::max(size, shared)};
}

// Whether nearly all dots are where they were; ids are distinct.
bool have_stayed(const PlacedDots& now, const double* sigma, const PlacedDots& then) {
    const std::vector<std::ptrdiff_t> at = find_ids(now.id, now.count, then.id, then.count);
    std::vector<double> squares, noise;
    for (std::ptrdiff_t i = 0; i < now.count; ++i) {
        if (std::isfinite(sigma[i])) noise.push_back(sigma[i]);
        if (at[i] < 0) continue;
        const double *from = then.places + 2 * at[i], *to = now.places + 2 * i;
        const double square = (to[0] - from[0]) * (to[0] - from[0]) + (to[1] - from[1]) * (to[1] - from[1]);
        squares.push_back(std::isnan(square) ? HUGE_VAL : square);
    }
    if (squares.empty() || static_cast<double>(squares.size()) < SAME_SHARE * static_cast<double>(std::max(now.count, then.count))) {
        return false;
    }
    const double usual = noise.empty() ? 0 : smallest(noise, static_cast<std::ptrdiff_t>(noise.size() / 2));
    const double limit = std::max(STILL, NOISE * usual);
    return smallest(squares, static_cast<std::ptrdiff_t>(NEARLY_ALL * static_cast<double>(squares.size() - 1))) < limit * limit;
}

}  // namespace

Reference::Reference(double time_constant_s, std::int64_t frames) : time_constant_s_(time_constant_s), frames_(frames) {
    reset();
}

void Reference::reset() {
    begin(nullptr, nullptr, nullptr, 0);
    stamp_s_ = NAN;
    touched_ = false;
}

void Reference::begin(const std::int64_t* id, const double* uv, const std::int64_t* frames, std::ptrdiff_t count) {
    id_.clear(), uv_.clear(), counts_.clear();
    calibrated_ = count ? *std::max_element(frames, frames + count) : 0;
    insert(id, uv, frames, count);
    forget_contact();
}

std::vector<double> Reference::places(const std::int64_t* id, std::ptrdiff_t count) const {
    std::vector<double> found(2 * count, NAN);
    const std::vector<std::ptrdiff_t> at = find_ids(id, count, id_.data(), static_cast<std::ptrdiff_t>(id_.size()));
    for (std::ptrdiff_t i = 0; i < count; ++i) {
        if (at[i] >= 0) std::copy_n(uv_.data() + 2 * at[i], 2, found.data() + 2 * i);
    }
    return found;
}

std::vector<double> Reference::update(const SeenDots& dots, double stamp_s, std::optional<bool> touched) {
    const std::ptrdiff_t count = dots.count();
    const auto motions = [&] {
        std::vector<double> moved = places(dots.id.data(), count);
        for (std::ptrdiff_t k = 0; k < 2 * count; ++k) moved[k] = dots.uv[k] - moved[k];
        return moved;
    };
    std::vector<double> moved = motions();
    grown_ = false;
    touched_ = touched ? *touched : is_touched(dots, moved, stamp_s);
    if (!touched_) {
        follow(dots, stamp_s);
        moved = motions();
    }
    stamp_s_ = stamp_s;
    return moved;
}

void Reference::insert(const std::int64_t* id, const double* uv, const std::int64_t* frames, std::ptrdiff_t count) {
    std::vector<std::int64_t> ids(id_), counts(counts_);
    std::vector<double> all(uv_);
    ids.insert(ids.end(), id, id + count), all.insert(all.end(), uv, uv + 2 * count), counts.insert(counts.end(), frames, frames + count);
    std::vector<std::ptrdiff_t> order(ids.size());
    std::iota(order.begin(), order.end(), std::ptrdiff_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::ptrdiff_t a, std::ptrdiff_t b) { return ids[a] < ids[b]; });
    id_.clear(), uv_.clear(), counts_.clear();
    for (const std::ptrdiff_t k : order) {
        id_.push_back(ids[k]), counts_.push_back(counts[k]);
        uv_.insert(uv_.end(), all.begin() + 2 * k, all.begin() + 2 * k + 2);
    }
}

// Averages over the first frames, then follows with the time constant; dots without a reference get their present position.
void Reference::follow(const SeenDots& dots, double stamp_s) {
    const double elapsed = std::isnan(stamp_s_) ? 0 : std::max(0.0, stamp_s - stamp_s_);
    const double slow = std::min(1.0, elapsed / time_constant_s_);
    const std::vector<std::ptrdiff_t> at = find_ids(dots.id.data(), dots.count(), id_.data(), static_cast<std::ptrdiff_t>(id_.size()));
    SeenDots fresh;
    for (std::ptrdiff_t i = 0; i < dots.count(); ++i) {
        if (at[i] < 0) {
            fresh.id.push_back(dots.id[i]);
            fresh.uv.insert(fresh.uv.end(), {dots.uv[2 * i], dots.uv[2 * i + 1]});
            continue;
        }
        std::int64_t& seen = counts_[at[i]];
        const double gain = seen < calibrated_ + frames_ ? 1 / static_cast<double>(seen + 1) : slow;
        for (int k = 0; k < 2; ++k) uv_[2 * at[i] + k] += gain * (dots.uv[2 * i + k] - uv_[2 * at[i] + k]);
        ++seen;
    }
    grown_ = fresh.count() > 0;
    const std::vector<std::int64_t> none(fresh.id.size(), 0);
    if (grown_) insert(fresh.id.data(), fresh.uv.data(), none.data(), fresh.count());
}

// Whether something touches; the residual displacement after a contact (creep of the pad, shifted print), which looks like a small lasting
// contact, is followed as drift. A residue is small, small against the contact before it, and still for some time.
bool Reference::is_touched(const SeenDots& dots, const std::vector<double>& moved, double stamp_s) {
    const Deviation now = deviation_from_drift(dots.uv.data(), moved.data(), dots.sigma.data(), dots.count());
    if (!now.moved) {
        forget_contact();
        return false;
    }
    largest_ = std::max(largest_, now.size);
    const PlacedDots seen{dots.id.data(), dots.uv.data(), dots.count()}, before{still_.id.data(), still_.uv.data(), still_.count()};
    if (!have_stayed(seen, dots.sigma.data(), before)) since_s_ = stamp_s, still_ = dots, accepted_ = NAN;
    if (std::isfinite(accepted_)) return now.size > GROWN * accepted_;
    if (now.size > std::min(RELEASED * largest_, LARGEST) || stamp_s - since_s_ < SETTLED_S) return true;
    accepted_ = now.size;
    return false;
}

void Reference::forget_contact() {
    largest_ = 0, accepted_ = NAN, since_s_ = INFINITY;
    still_ = {};
}

}  // namespace tactile
