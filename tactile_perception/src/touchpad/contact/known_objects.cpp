// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#include "touchpad/contact/known_objects.hpp"

#include <algorithm>

namespace tactile {

TouchingObject continued(const Dots& dots, const StickSlipMemory& memory) {
    std::vector<int> shared(memory.objects.size() + 1);
    for (const std::ptrdiff_t k : dots) ++shared[memory.held[k]];
    shared[0] = 0;
    const std::ptrdiff_t number = std::max_element(shared.begin(), shared.end()) - shared.begin();
    return number ? memory.objects[number - 1] : TouchingObject{memory.friction};
}

void keep_lost(const StickSlipMemory& memory, const std::vector<std::uint8_t>& touched, std::vector<TouchingObject>& objects,
               std::vector<std::int64_t>& held) {
    std::vector<std::uint8_t> found(memory.objects.size());
    for (std::size_t k = 0; k < touched.size(); ++k) {
        if (touched[k] && memory.held[k] > 0) found[memory.held[k] - 1] = 1;
    }
    for (std::size_t number = 0; number < found.size(); ++number) {
        if (found[number] || memory.objects[number].lost) continue;
        objects.push_back(memory.objects[number]);
        objects.back().lost = true;
        for (std::size_t k = 0; k < touched.size(); ++k) {
            if (memory.held[k] == static_cast<std::int64_t>(number) + 1) held[k] = static_cast<std::int64_t>(objects.size());
        }
    }
}

}  // namespace tactile
