// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Undeformed positions of numbered dots, which follow drift and are held during contact.
//
// Drift moves the dots by an affine motion of the image, a contact does not. What a contact leaves behind (creep of the pad, shifted print)
// looks like a small persistent one, and is followed as drift: it is small, small against the contact before it, and still for some time.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "common/fields.hpp"
#include "common/rows.hpp"

namespace tactile {

// What decides whether dots are touched, each with its unit and what it is.
struct ContactLimits {
    double quiet_sigmas = 5, quiet_floor = 0.1;  // sigma and px, noise: that changes of light shift a dot by at most
    double outliers = 0.01;                      // 1, noise: of the dots, that may deviate so without a contact
    double max_drift = 0.5;                      // px, limit: median displacement; drift is followed before it grows so far
    double kept = 0.8;                           // 1, numeric: of the dots, with the smallest residuals, that the affine fit uses
    Eigen::Index min_affine = 8;                 // 1, numeric: dots of an affine fit
    double released = 0.15, max_residue = 1;     // 1 and px, prior: of the largest size of a contact, and maximum size of what it leaves
    double settled_s = 3;                        // s, prior: without motion before a residue is accepted
    double grown = 1.5;                          // 1, prior: times its accepted size, from which a residue is a contact again
    double still = 0.1, still_sigmas = 7;        // px and sigma, noise: motion of nearly all dots at rest; 5 sqrt 2, of a difference
    double nearly_all = 0.99, common = 0.9;      // 1, limit: of the dots, that are at rest; and that are seen in both images
};

// Dots of one image that have ids. uv: px; sigma: px per axis, NaN: unknown.
struct IdentifiedDots {
    Numbers id;
    Rows2 uv;
    Eigen::VectorXd sigma;
};

// Positions (K, 2) px of dots by their rising ids (K).
struct DotPositions {
    Numbers id;
    Rows2 uv;

    // Index of an id, -1 for none. guess: where it may be.
    Eigen::Index find(std::int64_t wanted, Eigen::Index guess = 0) const;
};

// Whether something touches the dots.
class ContactWatch {
 public:
    void reset() { *this = {}; }
    // displacement: of the dots, px, NaN: unknown.
    bool judge(const IdentifiedDots& dots, const Rows2& displacement, double stamp_s);

 private:
    // Whether nearly all dots are where they came to rest.
    bool is_still(const IdentifiedDots& dots) const;

    double largest_ = 0, accepted_ = std::numeric_limits<double>::quiet_NaN();  // px, size of the contact, and of its accepted residue
    double since_s_ = std::numeric_limits<double>::infinity();                  // of being still
    DotPositions still_;
};

// The undeformed positions: averaged over the first images, followed as they drift, held during contact. A dot that appears later gets its
// position in the next untouched image.
class DotReference {
 public:
    // time_constant_s: of drift; frames: number of untouched images that are averaged first.
    DotReference(double time_constant_s, std::int64_t frames) : time_constant_s_(time_constant_s), frames_(frames) { reset(); }

    void reset();
    // Replaces the positions by uv, px, of dots with these ids, each of which counts as so many averaged images. Contacts are forgotten.
    void take(const Numbers& id, const Rows2& uv, const Numbers& frames);

    // displacement: px, of each dot, NaN without a position; grown: whether dots were added to the reference.
    struct Update {
        Rows2 displacement;
        bool grown;
        TACTILE_FIELDS(displacement, grown)
    };
    // is_touched: as known by a later stage, none to decide by the dots. Dots without a finite position count as not seen.
    Update update(const IdentifiedDots& dots, double stamp_s, std::optional<bool> is_touched);

    // uv, px, less the positions of the dots; NaN where unknown.
    Rows2 displacement(const Numbers& id, const Rows2& uv) const;
    const DotPositions& positions() const { return positions_; }
    bool is_touched() const { return is_touched_; }

 private:
    void follow(const IdentifiedDots& dots, double stamp_s);
    bool add_missing(const IdentifiedDots& dots);

    double time_constant_s_;
    std::int64_t frames_, averaged_ = 0;  // averaged: images until the positions follow drift
    DotPositions positions_;
    Numbers counts_;  // averaged images of each
    ContactWatch contact_;
    bool is_touched_ = false;
    double stamp_s_ = 0;
};

}  // namespace tactile
