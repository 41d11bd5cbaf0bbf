// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Numbers that one instruction handles at once, where the compiler does not find that itself in a loop over them.
#pragma once

#include <cstddef>
#include <cstring>

#include "common/wide.hpp"

namespace tactile {

constexpr std::ptrdiff_t FOUR = 4;

// Calculates like a double, with all four; one double stands for four equal ones.
struct Four {
    typedef double Values __attribute__((vector_size(FOUR * sizeof(double))));
    Values values;

    TACTILE_INLINE Four() : values{} {}
    TACTILE_INLINE Four(double all) : values{all, all, all, all} {}
    TACTILE_INLINE explicit Four(const Values& all) : values(all) {}
    TACTILE_INLINE explicit Four(const double* from) { std::memcpy(&values, from, sizeof values); }
    TACTILE_INLINE void store(double* to) const { std::memcpy(to, &values, sizeof values); }

    TACTILE_INLINE Four& operator+=(const Four& other) { return values += other.values, *this; }
    TACTILE_INLINE Four& operator-=(const Four& other) { return values -= other.values, *this; }
    TACTILE_INLINE friend Four operator+(const Four& a, const Four& b) { return Four(a.values + b.values); }
    TACTILE_INLINE friend Four operator-(const Four& a, const Four& b) { return Four(a.values - b.values); }
    TACTILE_INLINE friend Four operator*(const Four& a, const Four& b) { return Four(a.values * b.values); }
    TACTILE_INLINE friend Four operator/(const Four& a, const Four& b) { return Four(a.values / b.values); }
};

}  // namespace tactile
