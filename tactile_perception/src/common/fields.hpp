// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <tuple>

// In a struct: the members that Python gives or reads, by name.
#define TACTILE_FIELDS(...)                             \
    static constexpr const char* FIELDS = #__VA_ARGS__; \
    auto fields() {                                     \
        return std::tie(__VA_ARGS__);                   \
    }                                                   \
    auto fields() const {                               \
        return std::tie(__VA_ARGS__);                   \
    }
