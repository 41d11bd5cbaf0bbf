// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "common/contact_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "common/constants.hpp"

namespace tactile {
namespace {

constexpr std::ptrdiff_t NOTHING = -1;

double radius(const TrackedRegion& region) {
    return std::sqrt(region.area / M_PI);
}

}  // namespace

bool TrackedContact::is_persistent() const {
    return seen_s - since_s > COMMON.min_persistent_s - 1e-6;
}

bool may_continue(double seen, double last, double stamp) {
    return seen >= std::min(last, stamp - COMMON.max_gap_s);
}

void ContactTracker::reset() {
    last_.clear(), owner_.clear();
    stamp_ = -std::numeric_limits<double>::infinity();
}

std::vector<TrackedContact> ContactTracker::assign(const std::vector<std::int32_t>& labels, const std::vector<TrackedRegion>& regions,
                                                   double reach, double stamp) {
    remember(labels.size(), stamp);
    stamp_ = stamp;
    std::vector<std::size_t> inside(labels.size());               // number of the region, from 1
    Shared shared(regions.size(), std::vector<std::ptrdiff_t>(last_.size() + 1));  // dots with no contact, and with each
    for (std::size_t k = 0; k < labels.size(); ++k) {
        if (k > 0 && labels[k] == labels[k - 1]) {
            inside[k] = inside[k - 1];
        } else {
            const auto at = std::find_if(regions.begin(), regions.end(), [&](const auto& one) { return one.label == labels[k]; });
            inside[k] = at == regions.end() ? 0 : static_cast<std::size_t>(at - regions.begin()) + 1;
        }
        if (inside[k]) ++shared[inside[k] - 1][owner_[k]];
    }
    const std::vector<std::ptrdiff_t> before = continued(shared, regions, reach);
    const auto is_free = [&](std::size_t j) { return std::count(before.begin(), before.end(), static_cast<std::ptrdiff_t>(j)) == 0; };
    std::vector<TrackedContact> found;
    for (std::size_t k = 0; k < regions.size(); ++k) {
        if (before[k] == NOTHING) {
            found.push_back({next_++, regions[k], stamp, stamp, false});
            continue;
        }
        const TrackedContact& one = last_[before[k]];
        bool splits = false, joined = false;
        for (std::size_t i = 0; i < regions.size(); ++i)
            splits |= i != k && shared[i][before[k] + 1] && std::accumulate(shared[i].begin(), shared[i].end(), 0L) >= COMMON.min_split;
        for (std::size_t j = 0; j < last_.size(); ++j) joined |= shared[k][j + 1] && last_[j].is_persistent() && is_free(j);
        found.push_back({one.number, regions[k], one.since_s, stamp, joined || (one.merged && !splits)});
    }
    std::vector<TrackedContact> now = found;
    std::vector<std::size_t> again(last_.size() + 1);  // of a contact that no region touches, its number among the last ones
    for (std::size_t j = 0; j < last_.size(); ++j) {
        if (!is_free(j) || std::any_of(shared.begin(), shared.end(), [&](const auto& common) { return common[j + 1] != 0; })) continue;
        now.push_back(last_[j]);
        again[j + 1] = now.size();
    }
    for (std::size_t k = 0; k < labels.size(); ++k) owner_[k] = inside[k] ? inside[k] : again[owner_[k]];
    last_ = std::move(now);
    return found;
}

// Drops the contacts that cannot continue.
void ContactTracker::remember(std::size_t size, double stamp) {
    std::vector<TrackedContact> kept;
    std::vector<std::size_t> number(last_.size() + 1);
    for (std::size_t j = 0; j < last_.size(); ++j) {
        if (!may_continue(last_[j].seen_s, stamp_, stamp)) continue;
        kept.push_back(last_[j]);
        number[j + 1] = kept.size();
    }
    if (owner_.size() != size)
        owner_.assign(size, 0);
    else if (kept.size() != last_.size())
        for (std::size_t& one : owner_) one = number[one];
    last_ = std::move(kept);
}

// Number of the contact that each region continues: greedily by most common dots, then by the smallest gap.
std::vector<std::ptrdiff_t> ContactTracker::continued(const Shared& shared, const std::vector<TrackedRegion>& regions, double reach) const {
    std::vector<std::tuple<std::ptrdiff_t, double, std::ptrdiff_t, std::size_t, std::ptrdiff_t>> pairs;
    for (std::size_t k = 0; k < regions.size(); ++k) {
        for (std::size_t j = 0; j < last_.size(); ++j) {
            const double gap = (regions[k].centroid - last_[j].region.centroid).norm() - radius(regions[k]) - radius(last_[j].region);
            if (shared[k][j + 1] || gap < reach)
                pairs.emplace_back(-shared[k][j + 1], gap, last_[j].number, k, static_cast<std::ptrdiff_t>(j));
        }
    }
    std::sort(pairs.begin(), pairs.end());
    std::vector<std::ptrdiff_t> found(regions.size(), NOTHING);
    for (const auto& [common, gap, number, k, j] : pairs)
        if (found[k] == NOTHING && std::find(found.begin(), found.end(), j) == found.end()) found[k] = j;
    return found;
}

}  // namespace tactile
