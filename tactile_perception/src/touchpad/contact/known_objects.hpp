// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// The objects of the last frame in this one.
#pragma once

#include "touchpad/contact/separate_objects.hpp"
#include "touchpad/contact/stick_slip.hpp"

namespace tactile {

// The object of the last frame that held most of the dots, as it was then; a new one if none did.
TouchingObject continued(const Dots& dots, const StickSlipMemory& memory);

// Adds the objects of the last frame of which no dot is touched (K) now to the objects of this one, for one frame, and the dots that they
// held to held (K), numbers of objects from 1.
void keep_lost(const StickSlipMemory& memory, const std::vector<std::uint8_t>& touched, std::vector<TouchingObject>& objects,
               std::vector<std::int64_t>& held);

}  // namespace tactile
