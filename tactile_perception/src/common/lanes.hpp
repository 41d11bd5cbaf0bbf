// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Numbers that one instruction handles at once, where the compiler does not find that itself in a loop over them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

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
    TACTILE_INLINE friend Four lesser(const Four& a, const Four& b) { return Four(a.values < b.values ? a.values : b.values); }
};

constexpr std::ptrdiff_t EIGHT = 8, SIXTEEN = 16;

typedef std::int16_t EightValues __attribute__((vector_size(EIGHT * sizeof(std::int16_t))));
typedef std::int16_t SixteenValues __attribute__((vector_size(SIXTEEN * sizeof(std::int16_t))));
typedef std::uint8_t EightPixels __attribute__((vector_size(EIGHT)));
typedef std::uint8_t SixteenPixels __attribute__((vector_size(SIXTEEN)));
TACTILE_INLINE void widen(const EightPixels& pixels, EightValues& values) {
    values = __builtin_convertvector(pixels, EightValues);
}
TACTILE_INLINE void widen(const SixteenPixels& pixels, SixteenValues& values) {
    values = __builtin_convertvector(pixels, SixteenValues);
}

// Calculates like a 16-bit number, with all COUNT; a number stands for equal ones. Sums and products have to fit.
template <std::ptrdiff_t COUNT>
struct Shorts {
    using Values = std::conditional_t<COUNT == EIGHT, EightValues, SixteenValues>;
    using Pixels = std::conditional_t<COUNT == EIGHT, EightPixels, SixteenPixels>;
    Values values;

    TACTILE_INLINE explicit Shorts(const Values& all) : values(all) {}
    TACTILE_INLINE explicit Shorts(const std::int16_t* from) { std::memcpy(&values, from, sizeof values); }
    // Pixels from this one on.
    TACTILE_INLINE static Shorts of_pixels(const std::uint8_t* from) {
        Pixels pixels;
        std::memcpy(&pixels, from, sizeof pixels);
        Values wide;
        widen(pixels, wide);
        return Shorts(wide);
    }
    // Pixels from this one backwards.
    TACTILE_INLINE static Shorts of_pixels_back(const std::uint8_t* from) {
        std::uint64_t bytes[COUNT / EIGHT];
        for (std::ptrdiff_t k = 0; k < COUNT / EIGHT; ++k) {
            std::memcpy(&bytes[k], from - EIGHT * k - (EIGHT - 1), EIGHT);
            bytes[k] = __builtin_bswap64(bytes[k]);
        }
        return of_pixels(reinterpret_cast<const std::uint8_t*>(bytes));
    }
    TACTILE_INLINE void store(std::int16_t* to) const { std::memcpy(to, &values, sizeof values); }
    // The first four, the first one lowest (little endian).
    TACTILE_INLINE std::uint64_t first_four() const {
        std::uint64_t four;
        std::memcpy(&four, &values, sizeof four);
        return four;
    }

    TACTILE_INLINE friend Shorts operator+(const Shorts& a, const Shorts& b) { return Shorts(a.values + b.values); }
    TACTILE_INLINE friend Shorts operator-(const Shorts& a, const Shorts& b) { return Shorts(a.values - b.values); }
    TACTILE_INLINE friend Shorts operator-(const Shorts& a, std::int16_t b) { return Shorts(a.values - b); }
    TACTILE_INLINE friend Shorts operator*(std::int16_t a, const Shorts& b) { return Shorts(a * b.values); }
};
using Eight = Shorts<EIGHT>;

// Sixteen pixels from one on: the first, third, ... and the second, fourth, ... of them (little endian).
struct Sixteen {
    Eight even, odd;
    TACTILE_INLINE explicit Sixteen(const std::uint8_t* from) : Sixteen(pairs(from)) {}
    TACTILE_INLINE friend Sixteen operator+(const Sixteen& a, const Sixteen& b) { return {a.even + b.even, a.odd + b.odd}; }

 private:
    typedef std::uint16_t Pairs __attribute__((vector_size(EIGHT * sizeof(std::uint16_t))));
    TACTILE_INLINE static Pairs pairs(const std::uint8_t* from) {
        Pairs values;
        std::memcpy(&values, from, sizeof values);
        return values;
    }
    TACTILE_INLINE explicit Sixteen(const Pairs& both) : even(Eight::Values(both & 0xff)), odd(Eight::Values(both >> 8)) {}
    TACTILE_INLINE Sixteen(const Eight& even_, const Eight& odd_) : even(even_), odd(odd_) {}
};

}  // namespace tactile
