/* Islands: bodies connected by constraints. */
#ifndef SADMM_CORE_MODEL_ISLANDS_H
#define SADMM_CORE_MODEL_ISLANDS_H

#include "system.h"

/* label[i]: the smallest body of i's island (body_count). The static world joins nothing. */
void sadmm_islands(const struct sadmm_system *system, int32_t *label);

#endif
