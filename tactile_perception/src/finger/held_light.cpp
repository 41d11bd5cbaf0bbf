// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "finger/held_light.hpp"

#include <algorithm>
#include <cmath>

namespace tactile::finger {
namespace {

constexpr double BIN = 0.01;       // s, over which light is averaged. Derived: a period of lamps on 50 Hz mains
constexpr double AGREE = 4;        // standard deviations by which bins may differ at rest. Chosen: as much as five of them do by noise
constexpr double FORGOTTEN = 0.2;  // s without rest, after which the last rest counts no more. Chosen: lamps are switched faster
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
constexpr double LEFT = 0.7;     // part of an object's light that is left at most after it is gone. Chosen
// Part of the room's light that an object shades, and its standard deviation, before it is measured: of what the room has beyond that of
// the calibration. Chosen: it hides a tenth at most.
constexpr double SHADE_EXPECTED = 0.05, SHADE = 0.05;
constexpr double SHADE_LEAST = 0.01;  // smallest standard deviation, of all of the room's light: objects differ. Chosen
constexpr double SHADE_MOST = 0.3;    // largest part. Chosen
constexpr double TWO = 4;             // standard deviations of the cross term, beyond which it is that of two contacts. Chosen
constexpr double ONSET = 0.03;        // s of a contact in which it grows. Chosen
constexpr double MODEL = 0.2;  // s of a contact from which the shade is measured; the error of the expected cross term is the same for
                               // all of it. Chosen

// Distance between the centroids of two lights on the detector, half widths.
double apart(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
    return std::hypot(a[X] / a[TOTAL] - b[X] / b[TOTAL], a[Y] / a[TOTAL] - b[Y] / b[TOTAL]);
}

// Whether a change of the sums may be the room's light: of its centroid, and not too bright.
bool may_be_room(const Eigen::Vector4d& change, const Eigen::Vector4d& contact, const Eigen::Vector4d& room, double sigma) {
    const double total = change[TOTAL], most = std::max(MOST_ROOM * room[TOTAL], MOST_CONTACT * contact[TOTAL]);
    const double least = (unmix(change) / std::copysign(1.0, total)).minCoeff();
    return room[TOTAL] >= CERTAIN * sigma && least >= -sigma && std::abs(total) <= most && apart(change, room) < AROUND;
}

// Whether a change of the sums is the room's light, not that of the contact.
bool is_room(const Eigen::Vector4d& change, const Eigen::Vector4d& contact, const Eigen::Vector4d& room, double sigma) {
    const double from_contact = apart(change, contact);
    return may_be_room(change, contact, room, sigma) && apart(change, room) < from_contact &&
           from_contact > APART + APART_SIGMA * sigma / std::abs(change[TOTAL]);
}

// Whether light is what has come suddenly while the object rested, with the light rest in the end.
bool is_doubtful(const Eigen::Vector4d& light, const Eigen::Vector4d& doubtful, const Eigen::Vector4d& rest, double sigma) {
    const double most = ALIKE * doubtful[TOTAL] + GROWN * rest[TOTAL] + AGREE * sigma;
    return doubtful[TOTAL] > CERTAIN * sigma && ((light - doubtful).array().abs() < most).all();
}

// The cross term that is missing from light to which the shaded light is added, V; NaN where it is not known.
double missing_cross(const Eigen::Vector4d& light, const Eigen::Vector4d& shaded, const FingerModel& model) {
    const Eigen::Vector4d whole = light + shaded;
    const Eigen::Vector2d place = centroid(whole);
    if (!(light[TOTAL] > 0 && whole[TOTAL] > 0) || place.hasNaN()) return UNKNOWN;
    return whole[CROSS] - Cell(model, place).value(CROSS_PART) * whole[TOTAL];
}

}  // namespace

void HeldLight::begin(const Eigen::Vector4d& offset, const Eigen::Vector4d& calibrated) {
    room_ = mix(offset);
    beyond_ = mix(offset - calibrated);
    since_s_ = 0;
    doubtful_.setZero();
    undecided_.setZero();
    interrupt();
}

void HeldLight::interrupt() {
    rest_.reset();
    bins_ = 0;
    count_ = restless_s_ = 0;
    sum_.setZero();
}

std::optional<Eigen::Vector4d> HeldLight::follow(Eigen::Matrix4Xd& sums, const std::vector<std::uint8_t>& contact,
                                                 const std::vector<std::uint8_t>& saturated, const FingerModel& model, const Noise& noise) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    double used = 0;
    for (std::ptrdiff_t k = 0; k < sums.cols(); ++k) {
        if (!contact[k] || saturated[k]) continue;
        sum += sums.col(k);
        ++used;
    }
    if (used == 0) return std::nullopt;
    sum_ += sum;
    count_ += used;
    std::optional<Eigen::Vector4d> lasting;
    if (count_ * noise.period >= BIN * (1 - 1e-9)) lasting = end_bin(model, noise);
    undecided_.setZero();
    const Eigen::Vector4d added = lasting ? shaded(shade_) - *lasting : correction(sum / used, std::sqrt(noise.sums(TOTAL, TOTAL) / used));
    for (std::ptrdiff_t k = 0; k < sums.cols(); ++k) {
        if (contact[k]) sums.col(k) += added;
    }
    return lasting;
}

// What is to be added to samples with this mean, whose total has this standard deviation, V.
Eigen::Vector4d HeldLight::correction(const Eigen::Vector4d& mean, double sigma) {
    const Eigen::Vector4d added = shaded(shade_);
    if (!rest_) return added;
    const Eigen::Vector4d change = mean - *rest_;
    const double total = std::abs(change[TOTAL]);
    if (total < SEEN * sigma) return added;
    if (total > CERTAIN * sigma && is_room(change, *rest_, room_, sigma)) return added - change;
    if (total < MOST_ROOM * room_[TOTAL] && apart(change, room_) < AROUND + APART_SIGMA * sigma / total) undecided_ = change;
    return added;
}

// Takes the mean of the present bin into account and begins the next one; returns as follow does.
std::optional<Eigen::Vector4d> HeldLight::end_bin(const FingerModel& model, const Noise& noise) {
    const double seconds = count_ * noise.period, sigma = std::sqrt(noise.sums(TOTAL, TOTAL) / count_);
    const Eigen::Vector4d light = sum_ / count_;
    since_s_ += seconds;
    std::rotate(finished_.begin(), finished_.begin() + 1, finished_.end());
    finished_.back() = light;
    bins_ = std::min(bins_ + 1, RESTS);
    if (ONSET < since_s_ && since_s_ <= ONSET + MODEL) measure_shade(light, seconds, model, noise);
    sum_.setZero();
    count_ = 0;
    if (bins_ == RESTS) {
        Eigen::Matrix<double, 4, RESTS> all;
        for (int k = 0; k < RESTS; ++k) all.col(k) = finished_[k];
        const double widest = (all.rowwise().maxCoeff() - all.rowwise().minCoeff()).maxCoeff();
        if (widest <= AGREE * sigma) return judge_rest(all.rowwise().sum() / RESTS, sigma / std::sqrt(static_cast<double>(RESTS)));
    }
    restless_s_ += seconds;
    if (restless_s_ > FORGOTTEN) rest_.reset();
    return std::nullopt;
}

// The object rests with that light: if it differs from that of the last rest by the room's, returns by what.
std::optional<Eigen::Vector4d> HeldLight::judge_rest(const Eigen::Vector4d& light, double sigma) {
    restless_s_ = 0;
    if (rest_ && std::abs(light[TOTAL] - (*rest_)[TOTAL]) > CERTAIN * sigma) {
        const Eigen::Vector4d change = light - *rest_;
        if (is_room(change, *rest_, room_, sigma)) {
            bins_ = 0;
            return change;
        }
        const bool of_room = is_room(light, *rest_, room_, sigma) || is_doubtful(light, doubtful_, *rest_, sigma);
        if (light[TOTAL] < LEFT * (*rest_)[TOTAL] && of_room) {  // the object is gone
            interrupt();
            return light;
        }
        doubtful_ += change;
    }
    rest_ = light;
    return std::nullopt;
}

// Information on the shaded part of the room's light before it is measured.
double HeldLight::known_beforehand() const {
    const double all = std::max(std::abs(room_[TOTAL]), 1e-9);
    const double sigma = std::max(SHADE * std::min(std::abs(beyond_[TOTAL]) / all, 1.0), SHADE_LEAST);
    return 1 / (sigma * sigma);
}

// What the object shades of the room's light.
Eigen::Vector4d HeldLight::shaded(double shade) const {
    return SHADE_EXPECTED * beyond_ + shade * room_;
}

// Updates the shaded part by the cross term of the mean light of the present bin: least squares with a known variance.
void HeldLight::measure_shade(const Eigen::Vector4d& light, double seconds, const FingerModel& model, const Noise& noise) {
    const double missing = missing_cross(light, shaded(shade_), model);
    const double slope = (missing_cross(light, shaded(shade_ + SHADE_LEAST), model) - missing) / SHADE_LEAST;
    const double each = noise.sums(CROSS, CROSS) / count_, of_model = noise.cross_volts * noise.cross_volts;
    const double known = known_beforehand(), before = known + gained_, variance = each + of_model * MODEL / seconds;
    if (!(missing * missing <= TWO * TWO * (each + of_model + slope * slope / before))) return;
    const double after = std::min(before + slope * slope / variance, std::max(before, 1 / (SHADE_LEAST * SHADE_LEAST)));
    const double shade = shade_ - slope * missing / variance / after;
    if (std::isnan(shade)) return;
    const double expected = SHADE_EXPECTED * beyond_[TOTAL], least = -expected / std::max(room_[TOTAL], expected);
    gained_ = after - known;
    shade_ = std::min(std::max(shade, std::min(least, 0.0)), SHADE_MOST);  // no object adds light
}

double HeldLight::shaded_volts() const {
    return std::abs(room_[TOTAL]) / std::sqrt(known_beforehand() + std::max(gained_, 0.0));
}

Eigen::Vector4d HeldLight::lamp_volts(double sigma) const {
    const bool certain = rest_ && std::abs(doubtful_[TOTAL]) > CERTAIN * sigma && may_be_room(doubtful_, *rest_, room_, sigma);
    return certain ? Eigen::Vector4d(undecided_ + doubtful_) : undecided_;
}

}  // namespace tactile::finger
