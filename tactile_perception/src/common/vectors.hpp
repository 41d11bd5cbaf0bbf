// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Vectors of three components, stored one after the other in arrays (N, 3).
#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>

#include "common/wide.hpp"

namespace tactile {

// Of numbers, or of several numbers at once (lanes.hpp).
template <class Number>
struct Vector3 {
    Number x, y, z;
};
using Vec3 = Vector3<double>;

template <class Number>
TACTILE_INLINE Vector3<Number> operator+(const Vector3<Number>& a, const Vector3<Number>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Number>
TACTILE_INLINE Vector3<Number> operator-(const Vector3<Number>& a, const Vector3<Number>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Number>
TACTILE_INLINE Vector3<Number> operator*(const std::common_type_t<Number>& s, const Vector3<Number>& a) {
    return {s * a.x, s * a.y, s * a.z};
}
template <class Number>
TACTILE_INLINE Number dot(const Vector3<Number>& a, const Vector3<Number>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Number>
TACTILE_INLINE Vector3<Number> cross(const Vector3<Number>& a, const Vector3<Number>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vec3 a) {
    return std::sqrt(dot(a, a));
}

// Vector k of an array (N, 3).
inline Vec3 vec3_at(const double* array, std::ptrdiff_t k) {
    return {array[3 * k], array[3 * k + 1], array[3 * k + 2]};
}
inline void store(double* array, std::ptrdiff_t k, Vec3 a) {
    array[3 * k] = a.x;
    array[3 * k + 1] = a.y;
    array[3 * k + 2] = a.z;
}

}  // namespace tactile
