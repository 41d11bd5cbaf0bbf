// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/dot_classifier.hpp"

#include <algorithm>
#include <utility>

#include "common/median.hpp"
#include "common/vectors.hpp"

namespace tactile {
namespace {

// Median distance of neighbours in a row, m.
double pitch_of(const Skin& skin) {
    std::vector<double> found;
    for (std::ptrdiff_t k = 1; k < skin.grid.size(); ++k) {
        if (k % skin.grid.columns) found.push_back((vec3_at(skin.rest.data(), k) - vec3_at(skin.rest.data(), k - 1)).norm());
    }
    return median(std::move(found));
}

}  // namespace

DotClassifier::DotClassifier(Membrane membrane, BorderNetwork network, const StickSlipModel& model)
    : membrane_(std::move(membrane)),
      network_(std::move(network)),
      dots_(membrane_.skin().grid, membrane_.origin(), model),
      pitch_(pitch_of(membrane_.skin())) {}

void DotClassifier::set_rest(const Membrane& other) {
    membrane_.set_rest(other.skin());
    pitch_ = pitch_of(membrane_.skin());
}

ClassifiedDots DotClassifier::classify(const std::vector<std::int64_t>& id, const double* positions, double seconds) {
    const Grid grid = membrane_.skin().grid;
    DotLoads loads = membrane_.loads(id.data(), positions, static_cast<std::ptrdiff_t>(id.size()));
    ClassifiedDots found;
    found.all_scores = border_scores(network_, grid, loads, pitch_);
    found.all_states = dots_.update(loads, found.all_scores, seconds);
    found.force.assign(loads.force.size(), 0), found.wrench.assign(6, 0);
    if (std::any_of(found.all_states.begin(), found.all_states.end(), [](std::uint8_t state) { return state != FREE; })) {
        ContactForces forces = contact_forces(loads, grid);
        found.force = std::move(forces.force), found.wrench = std::move(forces.wrench);
    }
    found.motion = motion(loads, found.all_states);
    const std::vector<double> displacements = dots_.displacements();
    for (const std::int64_t k : id) {
        found.state.push_back(found.all_states[k]), found.score.push_back(found.all_scores[k]);
        found.confidence.push_back(dots_.confidence()[k]);
        found.displacements.insert(found.displacements.end(), &displacements[2 * k], &displacements[2 * k] + 2);
    }
    found.objects = dots_.objects();
    found.xyz = std::move(loads.xyz);
    return found;
}

std::optional<RigidMotion> DotClassifier::motion(const DotLoads& loads, const std::vector<std::uint8_t>& states) {
    const std::optional<RigidMotion> found = dots_.motion();
    if (!found || dots_.objects().size() != 1) {  // the dots of several objects do not move as one
        reference_.reset();
        return found;
    }
    std::vector<std::uint8_t> sticks(states.size());
    for (std::size_t k = 0; k < sticks.size(); ++k) sticks[k] = loads.seen[k] && states[k] == STICKING;
    return reference_.corrected(loads.xyz, sticks, *found);
}

}  // namespace tactile
