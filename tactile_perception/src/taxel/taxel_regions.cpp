// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "taxel/taxel_regions.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tactile {
namespace {

// Marks the largest components, most of them.
std::vector<std::uint8_t> largest(const std::vector<Component>& parts, std::ptrdiff_t most) {
    std::vector<std::size_t> order(parts.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return parts[a].count > parts[b].count; });
    std::vector<std::uint8_t> kept(parts.size() + 1);
    for (std::size_t k = 0; k < order.size() && static_cast<std::ptrdiff_t>(k) < most; ++k) kept[order[k] + 1] = 1;
    return kept;
}

// Outlines within a box that has a margin of one taxel; scores of components that are not kept count as 0.
Loops outlines_in(const float* score, const TaxelRule& rule, const Box& box, const std::vector<std::int32_t>& labels,
                  const std::vector<std::uint8_t>& kept, bool broken) {
    std::vector<double> field(box.rows() * box.columns());
    for (std::ptrdiff_t r = std::max<std::ptrdiff_t>(box.top, 0); r < std::min(box.bottom, rule.rows); ++r) {
        for (std::ptrdiff_t c = std::max<std::ptrdiff_t>(box.left, 0); c < std::min(box.right, rule.columns); ++c) {
            const std::ptrdiff_t at = r * rule.columns + c;
            if (!broken || kept[labels[at]]) field[(r - box.top) * box.columns() + c - box.left] = score[at];
        }
    }
    Loops loops = find_contours(field.data(), box.rows(), box.columns(), rule.level);
    for (std::size_t k = 0; k < loops.places.size(); ++k) loops.places[k] += static_cast<double>(k % 2 == 0 ? box.top : box.left);
    return loops;
}

std::vector<double> points_on_array(const Loops& loops, const TaxelRule& rule) {
    std::vector<double> points(loops.places.size() / 2 * 3);
    for (std::size_t k = 0; k < loops.places.size() / 2; ++k) {
        points[3 * k] = rule.pitch * (loops.places[2 * k + 1] - 0.5 * static_cast<double>(rule.columns - 1));
        points[3 * k + 1] = rule.pitch * (loops.places[2 * k] - 0.5 * static_cast<double>(rule.rows - 1));
    }
    return points;
}

// Labels, each spread to the taxels around it that have none; the larger label where several meet. box: around all labels.
std::vector<std::int32_t> spread(const std::vector<std::int32_t>& labels, const Box& box, const TaxelRule& rule) {
    const Box wide = box.grown(rule.around, rule.rows, rule.columns);
    std::vector<float> largest;
    for (std::ptrdiff_t r = wide.top; r < wide.bottom; ++r) {
        const auto line = labels.begin() + r * rule.columns;
        largest.insert(largest.end(), line + wide.left, line + wide.right);
    }
    spread_largest(largest, wide.rows(), wide.columns(), rule.around);
    std::vector<std::int32_t> near(labels);
    for (std::ptrdiff_t r = 0; r < wide.rows(); ++r) {
        for (std::ptrdiff_t c = 0; c < wide.columns(); ++c) {
            std::int32_t& here = near[(wide.top + r) * rule.columns + wide.left + c];
            if (here == 0) here = static_cast<std::int32_t>(largest[r * wide.columns() + c]);
        }
    }
    return near;
}

// Label of the taxel on the inner side of a place on a contour.
std::int32_t label_inside(const double* place, const std::vector<std::int32_t>& labels, const TaxelRule& rule) {
    for (const bool up : {false, true}) {
        const auto r = static_cast<std::ptrdiff_t>(up ? std::ceil(place[0]) : std::floor(place[0]));
        const auto c = static_cast<std::ptrdiff_t>(up ? std::ceil(place[1]) : std::floor(place[1]));
        if (r < 0 || c < 0 || r >= rule.rows || c >= rule.columns) continue;
        if (const std::int32_t label = labels[r * rule.columns + c]) return label;
    }
    return 0;
}

// Components that one outline surrounds, since it passes over a corner where they meet, become one: labels, boxes and counts are those of
// the first. Returns the label of each region.
std::vector<std::int32_t> join(const Loops& loops, const TaxelRule& rule, std::vector<std::int32_t>& labels,
                               std::vector<Component>& parts) {
    std::vector<std::int32_t> joined(parts.size() + 1), regions;
    std::iota(joined.begin(), joined.end(), 0);
    for (std::size_t k = 0; k < loops.region.size(); ++k) {
        if (loops.region[k] == static_cast<std::int64_t>(regions.size())) regions.push_back(0);
        std::int32_t& first = regions.back();
        for (std::int64_t at = loops.start[k]; at < loops.start[k + 1]; ++at) {
            const std::int32_t label = label_inside(&loops.places[2 * at], labels, rule);
            if (label == 0) continue;
            if (first == 0) first = label;
            if (label == first || joined[label] != label) continue;
            joined[label] = first;
            Component &whole = parts[first - 1], part = parts[label - 1];
            whole.count += part.count;
            whole.box = {std::min(whole.box.top, part.box.top), std::min(whole.box.left, part.box.left),
                         std::max(whole.box.bottom, part.box.bottom), std::max(whole.box.right, part.box.right)};
        }
    }
    for (std::int32_t& label : labels) label = joined[label];
    return regions;
}

void add_load(const float* pressure, const std::vector<std::int32_t>& near, const TaxelRule& rule, TaxelRegion& region) {
    const Box wide = region.box.grown(rule.around, rule.rows, rule.columns);
    double total = 0;
    for (std::ptrdiff_t r = wide.top; r < wide.bottom; ++r) {
        for (std::ptrdiff_t c = wide.left; c < wide.right; ++c) {
            const double load = pressure[r * rule.columns + c];
            if (near[r * rule.columns + c] != region.label || !(load > 0)) continue;
            total += load;
            region.peak = std::max(region.peak, load);
        }
    }
    region.force = total * rule.pitch * rule.pitch;
}

// Adds the integrals within a polygon (count, 3) by Green's theorem, about its first vertex, and then moved to the origin: a tiny polygon
// keeps its digits. Holes turn the other way and are subtracted.
void add_polygon(const double* points, std::ptrdiff_t count, std::array<double, 6>& sums) {
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
    sums[0] += area;
    sums[1] += x + area * x0;
    sums[2] += y + area * y0;
    sums[3] += xx + 2 * x0 * x + area * x0 * x0;
    sums[4] += xy + x0 * y + y0 * x + area * x0 * y0;
    sums[5] += yy + 2 * y0 * y + area * y0 * y0;
}

}  // namespace

TaxelRegions taxel_regions(const float* score, const float* pressure, const TaxelRule& rule) {
    const std::ptrdiff_t taxels = rule.rows * rule.columns;
    std::vector<std::uint8_t> touched(taxels);
    for (std::ptrdiff_t k = 0; k < taxels; ++k) touched[k] = score[k] > rule.level;
    TaxelRegions found;
    std::vector<Component> parts = components(touched.data(), rule.rows, rule.columns, false, found.labels);
    found.near = found.labels;
    if (parts.empty()) return found;
    found.broken = static_cast<std::ptrdiff_t>(parts.size()) > rule.most;
    const Box inside = box_around(touched.data(), rule.rows, rule.columns);
    const Box box{inside.top - 1, inside.left - 1, inside.bottom + 1, inside.right + 1};
    found.loops = outlines_in(score, rule, box, found.labels, largest(parts, rule.most), found.broken);
    found.points = points_on_array(found.loops, rule);
    const std::vector<std::int32_t> regions = join(found.loops, rule, found.labels, parts);
    found.near = spread(found.labels, inside, rule);
    for (std::size_t k = 0; k < found.loops.region.size(); ++k) {
        const std::int64_t first = found.loops.start[k], last = found.loops.start[k + 1];
        if (found.loops.region[k] == static_cast<std::int64_t>(found.regions.size())) {
            TaxelRegion region;
            region.label = regions[found.regions.size()];
            if (region.label > 0) {
                region.box = parts[region.label - 1].box;
                region.count = parts[region.label - 1].count;
            }
            add_load(pressure, found.near, rule, region);
            found.regions.push_back(region);
        }
        add_polygon(&found.points[3 * first], last - first, found.regions.back().sums);
    }
    return found;
}

}  // namespace tactile
