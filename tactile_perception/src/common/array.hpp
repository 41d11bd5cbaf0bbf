// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tactile {

/// Numbers of somebody else, in row-major order, with the lengths of up to five axes.
template <class T>
struct Array {
    const T* data = nullptr;
    std::array<std::ptrdiff_t, 5> lengths{};
    std::ptrdiff_t size = 0;

    std::ptrdiff_t length(int axis = 0) const { return lengths[axis]; }
    operator const T*() const { return data; }
    std::vector<T> vector() const { return {data, data + size}; }
};

}  // namespace tactile
