// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Runs of pixels in each row, joined with those of the row above that they touch (union-find: Tarjan, Efficiency of a Good But Not Linear
// Set Union Algorithm, 1975).
#include "dots/detect/blob_regions.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace tactile {
namespace {

constexpr std::ptrdiff_t WORD = 8;  // pixels looked at in one step

// Pixels first to last of a row.
struct Run {
    std::ptrdiff_t row, first, last;
    std::int32_t region;
};

// First pixel from k on that is set, or not, as wanted.
std::ptrdiff_t next(const std::uint8_t* row, std::ptrdiff_t k, std::ptrdiff_t columns, bool set) {
    constexpr std::uint64_t ONES = 0x0101010101010101, HIGH = 0x8080808080808080;
    for (; k + WORD <= columns; k += WORD) {
        std::uint64_t word;
        std::memcpy(&word, row + k, sizeof word);
        if (set ? word != 0 : ((word - ONES) & ~word & HIGH) != 0) break;
    }
    while (k < columns && (row[k] != 0) != set) ++k;
    return k;
}

struct Region {
    std::ptrdiff_t left, top, right, bottom;
    std::int64_t area, x, y;  // number of pixels, sums of their places
    std::uint16_t label;
};

class Search {
 public:
    explicit Search(const Image& mask) : mask_(mask) {
        std::size_t above = 0;  // first run of the row above
        for (std::ptrdiff_t row = 0; row < mask.rows; ++row) {
            const std::size_t begin = runs_.size();
            const std::uint8_t* pixels = mask.pixels + row * mask.columns;
            for (std::ptrdiff_t k = next(pixels, 0, mask.columns, true); k < mask.columns;) {
                const std::ptrdiff_t end = next(pixels, k, mask.columns, false);
                const auto fresh = static_cast<std::int32_t>(parent_.size());
                std::int32_t region = -1;
                while (above < begin && runs_[above].last < k - 1) ++above;
                for (std::size_t n = above; n < begin && runs_[n].first <= end; ++n) region = joined(region, runs_[n].region);
                if (region < 0) parent_.push_back(region = fresh);
                runs_.push_back({row, k, end - 1, region});
                k = next(pixels, end, mask.columns, true);
            }
            above = begin;
        }
    }

    // Regions, numbered as their first pixels come; fills labels.
    std::vector<Region> regions(std::vector<std::uint16_t>& labels) {
        std::vector<Region> found;
        std::vector<std::int32_t> number(parent_.size(), -1);
        labels.assign(mask_.rows * mask_.columns, 0);
        for (const Run& run : runs_) {
            std::int32_t& n = number[root(run.region)];
            if (n < 0) {
                n = static_cast<std::int32_t>(found.size());
                const auto label = n < std::numeric_limits<std::uint16_t>::max() ? static_cast<std::uint16_t>(n + 1) : std::uint16_t{0};
                found.push_back({run.first, run.row, run.last, run.row, 0, 0, 0, label});
            }
            Region& region = found[n];
            const std::int64_t count = run.last - run.first + 1;
            region.left = std::min(region.left, run.first), region.right = std::max(region.right, run.last);
            region.bottom = run.row;
            region.area += count, region.x += count * (run.first + run.last), region.y += count * run.row;
            std::fill_n(labels.begin() + run.row * mask_.columns + run.first, count, region.label);
        }
        return found;
    }

 private:
    std::int32_t root(std::int32_t region) {
        while (parent_[region] != region) region = parent_[region] = parent_[parent_[region]];
        return region;
    }
    // The region that a and b are from now on; a may be none, -1.
    std::int32_t joined(std::int32_t a, std::int32_t b) {
        b = root(b);
        if (a < 0 || (a = root(a)) == b) return b;
        return parent_[std::max(a, b)] = std::min(a, b);
    }

    const Image& mask_;
    std::vector<Run> runs_;
    std::vector<std::int32_t> parent_;
};

// Upper median area of regions of more than speck px; 0 without any.
double typical_area(const std::vector<Region>& regions, std::int64_t speck) {
    std::vector<std::int64_t> areas;
    for (const Region& region : regions)
        if (region.area > speck) areas.push_back(region.area);
    if (areas.empty()) return 0;
    const auto middle = areas.begin() + static_cast<std::ptrdiff_t>(areas.size() / 2);
    std::nth_element(areas.begin(), middle, areas.end());
    return static_cast<double>(*middle);
}

}  // namespace

BlobRegions find_blob_regions(const Image& mask, const MarkerSizes& sizes) {
    BlobRegions found;
    const std::vector<Region> regions = Search(mask).regions(found.labels);
    const double typical = typical_area(regions, sizes.speck);
    for (const Region& r : regions) {
        const auto area = static_cast<double>(r.area);
        const bool whole = r.left > 0 && r.top > 0 && r.right < mask.columns - 1 && r.bottom < mask.rows - 1 && r.label > 0;
        if (!whole || !(area > sizes.least * typical) || !(area < sizes.most * typical)) continue;
        for (const std::ptrdiff_t number : {r.left, r.top, r.right - r.left + 1, r.bottom - r.top + 1})
            found.box.push_back(static_cast<std::int32_t>(number));
        found.centre.push_back(static_cast<double>(r.x) / (2 * area)), found.centre.push_back(static_cast<double>(r.y) / area);
        found.area.push_back(r.area), found.label.push_back(r.label);
    }
    return found;
}

}  // namespace tactile
