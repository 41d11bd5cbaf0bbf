// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "psd/held_light.hpp"

#include <algorithm>
#include <cmath>

namespace tactile {
namespace {

constexpr double BIN = 0.01;       // s, over which light is averaged. Derived: a period of lamps on 50 Hz mains
constexpr double AGREE = 4;        // standard deviations by which bins may differ at rest. Chosen: as much as five of them do by noise
constexpr double FORGOTTEN = 0.2;  // s without rest, after which the last rest says nothing. Chosen: lamps are switched faster
constexpr double CERTAIN = 6;      // standard deviations of light that is judged. Chosen
constexpr double SEEN = 3;         // standard deviations of light that may be a lamp's before it is judged. Chosen
constexpr double AROUND = 0.2;     // half widths between centroids of the room's light and of the offset, which holds the dark voltages
                                   // too. Chosen
constexpr double APART = 0.05, APART_SIGMA = 4;      // half widths, and standard deviations, between the centroids of a lamp and of the
                                                     // contact. Chosen
constexpr double MOST_ROOM = 3, MOST_CONTACT = 0.5;  // parts of the room's light, and of the contact's; brighter changes are a second
                                                     // object. Chosen
constexpr double ALIKE = 0.05;                       // part of a lamp's light by which it may change until the object goes. Chosen
constexpr double GROWN = 0.015;  // part of an object's light that it grows by as the cover creeps, from rest to rest. Chosen
constexpr double LEFT = 0.7;                         // part of an object's light that is left at most after it is gone. Chosen
// Part of the room's light that an object shades, and its standard deviation, before it is measured: of what the room has beyond that of
// the calibration. Chosen: it hides a tenth at most.
constexpr double SHADE_EXPECTED = 0.05, SHADE = 0.05;
constexpr double SHADE_LEAST = 0.01;  // smallest standard deviation, of all of the room's light: objects differ. Chosen
constexpr double SHADE_MOST = 0.3;    // largest part. Chosen
constexpr double TWO = 4;             // standard deviations of the cross term, beyond which it is that of two contacts. Chosen
constexpr double ONSET = 0.03;        // s of a contact in which it grows. Chosen
constexpr double MODEL = 0.2;  // s of a contact from which the shade is measured; the error of the expected cross term is the same for
                               // all of it. Chosen

double total_sigma(const HeldFinger& finger, double count) {
    return std::sqrt(finger.noise[4 * TOTAL + TOTAL] / count);
}

// Distance between the centroids of two lights on the detector, half widths.
double apart(const FingerSums& a, const FingerSums& b) {
    return std::hypot(a[X] / a[TOTAL] - b[X] / b[TOTAL], a[Y] / a[TOTAL] - b[Y] / b[TOTAL]);
}

FingerSums difference(const FingerSums& a, const FingerSums& b) {
    return {a[X] - b[X], a[Y] - b[Y], a[TOTAL] - b[TOTAL], a[CROSS] - b[CROSS]};
}

// Whether a change of the sums may be the room's light: of its centroid, and not too bright.
bool may_be_room(const FingerSums& change, const FingerSums& contact, const FingerSums& room, double sigma) {
    const double total = change[TOTAL], most = std::max(MOST_ROOM * room[TOTAL], MOST_CONTACT * contact[TOTAL]);
    const FingerSums outputs = unmixed(change);
    double least = outputs[0] / std::copysign(1.0, total);
    for (const double output : outputs) least = std::min(least, output / std::copysign(1.0, total));
    return room[TOTAL] >= CERTAIN * sigma && least >= -sigma && std::abs(total) <= most && apart(change, room) < AROUND;
}

// Whether a change of the sums is the room's light, not that of the contact.
bool is_room(const FingerSums& change, const FingerSums& contact, const FingerSums& room, double sigma) {
    const double from_contact = apart(change, contact);
    return may_be_room(change, contact, room, sigma) && apart(change, room) < from_contact &&
           from_contact > APART + APART_SIGMA * sigma / std::abs(change[TOTAL]);
}

// Whether light is what has come suddenly while the object rested, with the light rest in the end.
bool is_doubtful(const FingerSums& light, const FingerSums& doubtful, const FingerSums& rest, double sigma) {
    const double most = ALIKE * doubtful[TOTAL] + GROWN * rest[TOTAL] + AGREE * sigma;
    const FingerSums apart = difference(light, doubtful);
    return doubtful[TOTAL] > CERTAIN * sigma && std::all_of(apart.begin(), apart.end(), [most](double d) { return std::abs(d) < most; });
}

// Information on the shaded part of the room's light before it is measured.
double known_beforehand(const HeldState& state) {
    const double all = std::max(std::abs(state.room[TOTAL]), 1e-9);
    const double sigma = std::max(SHADE * std::min(std::abs(state.beyond[TOTAL]) / all, 1.0), SHADE_LEAST);
    return 1 / (sigma * sigma);
}

// What the object shades of the room's light.
FingerSums shaded(const HeldState& state, double shade) {
    FingerSums light;
    for (int i = 0; i < 4; ++i) light[i] = SHADE_EXPECTED * state.beyond[i] + shade * state.room[i];
    return light;
}

// The cross term that is missing from light to which the shaded light is added, V; NaN where it is not known.
double missing_cross(const FingerSums& light, const FingerSums& shaded, const PlaceTable& table) {
    FingerSums whole;
    for (int i = 0; i < 4; ++i) whole[i] = light[i] + shaded[i];
    const Place place = place_of(whole.data());
    if (!(light[TOTAL] > 0 && whole[TOTAL] > 0) || std::isnan(place.x + place.y)) return std::nan("");
    return whole[CROSS] - TableCell(table, place).value(CROSS_PART) * whole[TOTAL];
}

// Updates the shaded part by the cross term of the mean of count samples: least squares with a known variance.
void measure_shade(HeldState& state, const FingerSums& light, double count, double seconds, const HeldFinger& finger) {
    const double missing = missing_cross(light, shaded(state, state.shade), finger.table);
    const double slope = (missing_cross(light, shaded(state, state.shade + SHADE_LEAST), finger.table) - missing) / SHADE_LEAST;
    const double each = finger.noise[4 * CROSS + CROSS] / count, model = finger.cross_volts * finger.cross_volts;
    const double known = known_beforehand(state), before = known + state.gained, variance = each + model * MODEL / seconds;
    if (!(missing * missing <= TWO * TWO * (each + model + slope * slope / before))) return;
    const double after = std::min(before + slope * slope / variance, std::max(before, 1 / (SHADE_LEAST * SHADE_LEAST)));
    const double shade = state.shade - slope * missing / variance / after;
    if (std::isnan(shade)) return;
    const double expected = SHADE_EXPECTED * state.beyond[TOTAL], least = -expected / std::max(state.room[TOTAL], expected);
    state.gained = after - known;
    state.shade = std::min(std::max(shade, std::min(least, 0.0)), SHADE_MOST);  // no object adds light
}

// The object rests with that light: whether it differs from that of the last rest by the room's, and by what.
bool judge(HeldState& state, const FingerSums& light, double sigma, FingerSums& shift) {
    const FingerSums before = state.rest;
    const bool known = state.rests > 0;
    state.restless = 0;
    if (known && std::abs(light[TOTAL] - before[TOTAL]) > CERTAIN * sigma) {
        shift = difference(light, before);
        if (is_room(shift, before, state.room, sigma)) {
            state.bins = 0;
            return true;
        }
        const bool of_room = is_room(light, before, state.room, sigma) || is_doubtful(light, state.doubtful, before, sigma);
        if (light[TOTAL] < LEFT * before[TOTAL] && of_room) {  // the object is gone
            interrupt_held(state);
            shift = light;
            return true;
        }
        for (int i = 0; i < 4; ++i) state.doubtful[i] += shift[i];
    }
    state.rest = light;
    state.rests = 1;
    return false;
}

// Largest difference between the finished bins, V, in any of the sums; and their mean.
double range_of_bins(const HeldState& state, FingerSums& mean) {
    double widest = 0;
    for (int i = 0; i < 4; ++i) {
        double low = state.finished[0][i], high = low, sum = 0;
        for (const FingerSums& bin : state.finished) {
            low = std::min(low, bin[i]);
            high = std::max(high, bin[i]);
            sum += bin[i];
        }
        widest = std::max(widest, high - low);
        mean[i] = sum / RESTS;
    }
    return widest;
}

// See judge; takes the mean of the present bin into account and begins the next one.
bool end_bin(HeldState& state, const HeldFinger& finger, FingerSums& shift) {
    const double count = state.count, seconds = count * finger.period, sigma = total_sigma(finger, count);
    FingerSums light;
    for (int i = 0; i < 4; ++i) light[i] = state.sum[i] / count;
    state.sum.fill(0);
    state.count = 0;
    state.since += seconds;
    if (state.bins == RESTS) std::rotate(state.finished.begin(), state.finished.begin() + 1, state.finished.end());
    state.bins = std::min(state.bins + 1, static_cast<double>(RESTS));
    state.finished[static_cast<int>(state.bins) - 1] = light;
    if (ONSET < state.since && state.since <= ONSET + MODEL) measure_shade(state, light, count, seconds, finger);
    FingerSums mean;
    if (state.bins < RESTS || range_of_bins(state, mean) > AGREE * sigma) {
        state.restless += seconds;
        if (state.restless > FORGOTTEN) state.rests = 0;
        return false;
    }
    return judge(state, mean, sigma / std::sqrt(static_cast<double>(RESTS)), shift);
}

// What is to be added to the sums whose mean of count samples is known. lasting: as follow_held returns it.
FingerSums correction(HeldState& state, const FingerSums& mean, double count, const HeldFinger& finger, const FingerSums* lasting) {
    const FingerSums added = shaded(state, state.shade);
    state.undecided.fill(0);
    if (lasting != nullptr) return difference(added, *lasting);
    const double sigma = total_sigma(finger, count);
    const FingerSums change = difference(mean, state.rest);
    const double total = std::abs(change[TOTAL]);
    if (state.rests == 0 || total < SEEN * sigma) return added;
    if (total > CERTAIN * sigma && is_room(change, state.rest, state.room, sigma)) return difference(added, change);
    if (total < MOST_ROOM * state.room[TOTAL] && apart(change, state.room) < AROUND + APART_SIGMA * sigma / total) state.undecided = change;
    return added;
}

}  // namespace

void begin_held(HeldState& state, const double* offset, const double* calibrated) {
    FingerSums beyond;
    for (int i = 0; i < 4; ++i) beyond[i] = offset[i] - calibrated[i];
    mix(offset, state.room.data());
    mix(beyond.data(), state.beyond.data());
    state.since = 0;
    state.doubtful.fill(0);
    state.undecided.fill(0);
    interrupt_held(state);
}

void interrupt_held(HeldState& state) {
    state.rests = state.bins = state.count = state.restless = 0;
    state.sum.fill(0);
}

double shaded_volts(const HeldState& state) {
    return std::abs(state.room[TOTAL]) / std::sqrt(known_beforehand(state) + std::max(state.gained, 0.0));
}

FingerSums lamp_volts(const HeldState& state, double sigma) {
    const bool certain = state.rests > 0 && std::abs(state.doubtful[TOTAL]) > CERTAIN * sigma;
    FingerSums light = state.undecided;
    if (!certain || !may_be_room(state.doubtful, state.rest, state.room, sigma)) return light;
    for (int i = 0; i < 4; ++i) light[i] += state.doubtful[i];
    return light;
}

bool follow_held(HeldState& state, double* sums, const std::uint8_t* in_contact, const std::uint8_t* saturated, std::ptrdiff_t count,
                 const HeldFinger& finger, FingerSums& shift) {
    FingerSums mean{};
    double used = 0;
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        if (!in_contact[k] || saturated[k]) continue;
        for (int i = 0; i < 4; ++i) mean[i] += sums[4 * k + i];
        ++used;
    }
    if (used == 0) return false;
    for (int i = 0; i < 4; ++i) {
        state.sum[i] += mean[i];
        mean[i] /= used;
    }
    state.count += used;
    const bool lasts = state.count * finger.period >= BIN * (1 - 1e-9) && end_bin(state, finger, shift);
    const FingerSums added = correction(state, mean, used, finger, lasts ? &shift : nullptr);
    for (std::ptrdiff_t k = 0; k < count; ++k) {
        if (!in_contact[k]) continue;
        for (int i = 0; i < 4; ++i) sums[4 * k + i] += added[i];
    }
    return lasts;
}

}  // namespace tactile
