// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Ambient light while an object touches a PSD finger: lamps that are switched or dimmed, and the room's light that the object shades.
//
// While something touches, the offset cannot be measured. Three facts replace the measurement. The room's light falls on the whole cover,
// so its centroid on the detector is the offset's, not the contact's. An object that rests keeps its light; a step between two rests whose
// centroid is the room's is a lamp. Four outputs hold one number more than light and place: the cross term, which is known for a single
// contact; what is missing there is the shaded light.
// Light that is left alone when the object goes, and equals what has come suddenly before, is a lamp's, whose centroid was the contact's by
// chance. The calibrated map holds what was shaded of the room then, and nothing shades the dark voltages of the amplifiers: before it is
// measured, a part is expected of what this room has beyond that one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "psd/finger.hpp"

namespace tactile {

constexpr int RESTS = 5;  // bins that agree while an object rests. Chosen

// What is known of the light of a contact. Numbers alone, so that Python holds it as one array; all 0 before the first contact.
struct HeldState {
    FingerSums room;                         // of the untouched outputs before the contact
    double shade;                            // part of the room's light that the object shades beyond the expected
    double gained;                           // information on it, 1 / variance, beyond what is known beforehand
    double since;                            // s, from the contact's begin to the last bin's end
    double restless;                         // s without rest
    double rests;                            // 0, or 1 where rest is known
    FingerSums rest;                         // light of the object when it rested last
    double count;                            // samples in the present bin
    FingerSums sum;                          // of them
    double bins;                             // finished bins, 0 to RESTS
    std::array<FingerSums, RESTS> finished;  // their mean light
    FingerSums beyond;                       // of the room's light, what the room of the calibration had not
    FingerSums doubtful;                     // sudden changes of the contact's light, which may be a lamp's
    FingerSums undecided;                    // what the last samples have beyond the last rest, which may be a lamp's, too
};
constexpr std::ptrdiff_t HELD_NUMBERS = sizeof(HeldState) / sizeof(double);

// A contact begins on a finger whose untouched outputs are offset (4,), V, and were calibrated (4,), V, when it was calibrated.
void begin_held(HeldState& state, const double* offset, const double* calibrated);

// Samples are missing: what came before them is no longer compared with what follows.
void interrupt_held(HeldState& state);

// V, standard deviation of the room's light that the object shades.
double shaded_volts(const HeldState& state);

// V, light of the contact that has come or gone suddenly, or just now, and may be a lamp's; 0 without such light. sigma: V, of a sample's
// total.
FingerSums lamp_volts(const HeldState& state, double sigma);

struct HeldFinger {
    PlaceTable table;     // with the channels of a finger
    const double* noise;  // (4, 4) V^2, covariance of one sample's sums
    double cross_volts;   // V, standard deviation of the expected cross term
    double period;        // s between samples
};

// Corrects the sums (N, 4) of those samples that are in contact for ambient light that changes during it. Returns whether a change is
// certain and lasts; shift is then what the sums of the untouched outputs have become brighter. in_contact, saturated: (N,).
bool follow_held(HeldState& state, double* sums, const std::uint8_t* in_contact, const std::uint8_t* saturated, std::ptrdiff_t count,
                 const HeldFinger& finger, FingerSums& shift);

}  // namespace tactile
