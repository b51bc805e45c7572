#pragma once

// The same arithmetic, compiled for wider vectors too and chosen when the program starts: without
// fused operations every version gives the same bits. Sanitizers cannot stand the choosing.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define KNAP_VECTORISED __attribute__((target_clones("avx512f", "avx2", "default"), flatten))
#else
#define KNAP_VECTORISED
#endif
