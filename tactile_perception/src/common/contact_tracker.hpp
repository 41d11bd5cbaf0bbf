// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The same contact from frame to frame: regions of dots or taxels, and the contacts that they continue.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/fields.hpp"

namespace tactile {

// A region of dots or taxels with this label.
struct TrackedRegion {
    std::int32_t label;
    Eigen::Vector3d centroid;  // m
    double area;               // m^2
};

struct TrackedContact {
    std::ptrdiff_t number;   // id of the contact, never reused
    TrackedRegion region;    // in the last frame with it
    double since_s, seen_s;  // stamps of the first and of the last frame with it
    bool merged;             // whether several contacts have merged into the region
    TACTILE_FIELDS(number, merged)
    // Whether it has been there for longer than a transient.
    bool is_persistent() const;
};

// Whether a contact that was last seen at seen may continue in the frame at stamp, s: the last frame, at last, had it, however long ago,
// since frames may be refused; or it was seen lately.
bool may_continue(double seen, double last, double stamp);

// A region continues the contact with which it shares most dots (or taxels), one to one; without common ones, the nearest within reach from
// border to border. A region that continues none is a new contact. One that shares dots with a persistent contact that ends has merged with
// it, until a part splits off.
class ContactTracker {
 public:
    // All regions are new contacts; ids are not reused.
    void reset();
    // The contact of each region, in their order. labels: of each dot or taxel, another than those of the regions outside of them; reach:
    // m; stamp: s.
    std::vector<TrackedContact> assign(const std::vector<std::int32_t>& labels, const std::vector<TrackedRegion>& regions, double reach,
                                       double stamp);

 private:
    using Shared = std::vector<std::vector<std::ptrdiff_t>>;
    void remember(std::size_t size, double stamp);
    std::vector<std::ptrdiff_t> continued(const Shared& shared, const std::vector<TrackedRegion>& regions, double reach) const;

    std::ptrdiff_t next_ = 1;
    std::vector<TrackedContact> last_{};
    double stamp_ = -std::numeric_limits<double>::infinity();  // s, of the last frame
    std::vector<std::size_t> owner_{};  // of each dot or taxel: that of the last contacts, from 1, which it belonged to last, 0 for none
};

}  // namespace tactile
