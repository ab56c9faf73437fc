// What is asked of the compiler.
#pragma once

// Hot loops are compiled for several instruction sets; the loader picks one. Elsewhere: the compiler's
// target. AddressSanitizer is not there yet when the loader picks.
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 12 && defined(__x86_64__) &&                     \
    defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
#define SMOKELIFT_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define SMOKELIFT_CLONES
#endif

#if defined(__GNUC__) || defined(__clang__) // clang-cl says only the latter
#define SMOKELIFT_INLINE inline __attribute__((always_inline))
#define SMOKELIFT_INLINE_LAMBDA __attribute__((always_inline))
#else
#define SMOKELIFT_INLINE inline
#define SMOKELIFT_INLINE_LAMBDA
#endif
