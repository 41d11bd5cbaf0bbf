// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Whether something touches a PSD finger, sample by sample, from its total light; steps of ambient light are distinguished from objects.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile::finger {

// Whether an object is near.
//
// The cover reflects light before it touches the waveguide, so an object's light rises gradually (Maekawa et al., section 6.3). A sudden
// onset is watched for up to 20 ms: light that grows is an object's, constant light is a step of ambient light.
class ProximityDetector {
 public:
    // WATCHED: not known yet; PASSED: what was watched is gone; AMBIENT_STEP: the samples since the onset hold one.
    enum State { NOTHING, WATCHED, PASSED, OBJECT, AMBIENT_STEP };

    // Nothing is near.
    void reset();
    // Samples are missing: what was before them does not show whether light rises.
    void interrupt();
    // State after one more total, V, of samples period apart, s; sigma: V, standard deviation of the untouched total.
    State add(double total, double sigma, double period);

 private:
    State watch(double total, double sigma, double period);
    bool rises(double sigma, double period) const;
    bool stays(double sigma) const;

    bool near_ = false, watching_ = false;
    std::vector<double> before_, watched_;  // totals before a possible onset, the last at the end; totals since an onset
};

// Contact of the first samples of a batch.
struct ContactStates {
    std::vector<std::uint8_t> contact;
    std::vector<std::uint8_t> settled;  // of a near object or of none, not of light that is still watched
    bool ambient_step = false;          // the last samples hold a step of ambient light, to be subtracted before the remaining ones follow
};

// Contact begins and ends at the light at first contact, with hysteresis.
class ContactDetector {
 public:
    // threshold: V, of the total, for the published method (section 5), in which no other sample is settled, so that the offset stays; NaN
    // for detection by noise.
    explicit ContactDetector(double threshold) : threshold_(threshold) {}
    // Nothing touches.
    void reset();
    // Samples are missing: a contact goes on only if the next sample shows one by itself.
    void interrupt();
    // Totals of samples, V, and what each is above the light at first contact (-infinity: too dark for a position); at least one sample.
    ContactStates detect(const std::vector<double>& totals, const std::vector<double>& over, double sigma, double period);
    // Whether the last sample was in contact.
    bool touching() const { return touching_; }

 private:
    double threshold_;
    bool touching_ = false, seen_ = false;  // seen: the sample before the next one is known
    ProximityDetector proximity_;
};

}  // namespace tactile::finger
