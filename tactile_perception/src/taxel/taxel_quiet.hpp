// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Taxels without contact: their untouched values, and those that stay silent under a contact.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

// Untouched values after a frame.
struct Followed {
    std::vector<float> values, count;  // and the number of quiet frames of each taxel
    std::vector<std::uint8_t> quiet;   // whether a taxel is quiet in this frame
};

// Untouched values (rows, columns) that follow the quiet part of change (rows, columns): the mean of the first `frames` quiet frames, then
// by the part gain. Quiet is what is finite and has no touched taxel within around taxels along both axes.
Followed follow_quiet(const float* values, const float* count, const float* change, const std::uint8_t* touched, std::ptrdiff_t rows,
                      std::ptrdiff_t columns, std::ptrdiff_t around, double frames, float gain);

// Taxels that respond, and those that are silent though both neighbours along a row or a column do.
struct Responding {
    std::vector<std::uint8_t> responded, silent;
};

// responded: earlier; pressed: change from which a taxel responds; part: of the lesser neighbour, below which one is silent that never
// responded.
Responding responding(const float* change, const std::uint8_t* responded, std::ptrdiff_t rows, std::ptrdiff_t columns, float pressed,
                      float part);

}  // namespace tactile
