// Copyright 2026 The tactile authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

// TACTILE_WIDE before a function compiles its loops twice, for processors with AVX2 and for others; the one that fits is selected when the
// module is loaded. Both do the same operations in the same order (no fused products, CMakeLists.txt): the same bits on every processor.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__)
#define TACTILE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define TACTILE_WIDE
#endif

// TACTILE_INLINE before a function makes it a part of each that calls it, so that TACTILE_WIDE there compiles its loops, too.
#define TACTILE_INLINE [[gnu::always_inline]] inline
