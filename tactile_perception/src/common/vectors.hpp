// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
// Vectors of three components, stored one after the other in arrays (N, 3).
#pragma once

#include <cmath>
#include <cstddef>

namespace tactile {

struct Vec3 {
    double x, y, z;
};

inline Vec3 operator+(Vec3 a, Vec3 b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator-(Vec3 a, Vec3 b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec3 operator*(double s, Vec3 a) {
    return {s * a.x, s * a.y, s * a.z};
}
inline double dot(Vec3 a, Vec3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(Vec3 a, Vec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vec3 a) {
    return std::sqrt(dot(a, a));
}

// Vector k of an array (N, 3).
inline Vec3 vec3_at(const double* array, std::ptrdiff_t k) {
    return {array[3 * k], array[3 * k + 1], array[3 * k + 2]};
}
inline void add_to(double* array, std::ptrdiff_t k, Vec3 a) {
    array[3 * k] += a.x;
    array[3 * k + 1] += a.y;
    array[3 * k + 2] += a.z;
}
inline void store(double* array, std::ptrdiff_t k, Vec3 a) {
    array[3 * k] = a.x;
    array[3 * k + 1] = a.y;
    array[3 * k + 2] = a.z;
}

}  // namespace tactile
