/* Which kernel table runs: the one registration list, and the automatic choice. */
#ifndef SADMM_CORE_SOLVE_REGISTRY_H
#define SADMM_CORE_SOLVE_REGISTRY_H

#include "kernels.h"

/* Pick a table. AUTO takes the fastest available one for that many contacts; `why` receives one line that says what
 * was chosen and why. Errors: INVALID_ARGUMENT (unknown value), UNAVAILABLE (with the reason). */
sadmm_status sadmm_backend_choose(sadmm_backend wanted, sadmm_precision precision, int64_t expected_contacts,
                                  const struct sadmm_kernels **out, char *why, size_t why_size,
                                  struct sadmm_error *error);

#endif
