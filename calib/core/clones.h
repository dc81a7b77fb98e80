#pragma once

// Loops come in one copy for each instruction set, and the loader picks. The resolvers run before AddressSanitizer is
// ready, so that build has the plain copy only.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__)
#define FIELDTRUE_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define FIELDTRUE_CLONES
#endif
// Before a loop whose steps touch no memory of each other, though its compiler cannot know.
#if defined(__GNUC__) && !defined(__clang__)
#define FIELDTRUE_STEPS_APART _Pragma("GCC ivdep")
#else
#define FIELDTRUE_STEPS_APART
#endif
#define FIELDTRUE_INLINE __attribute__((always_inline)) inline
