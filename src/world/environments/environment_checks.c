#include "environment_checks.h"

#include <stdio.h>
#include <string.h>

#include "core/base/memory.h"

int32_t sadmm_environments_rows(const sadmm_environments *environments, sadmm_array array)
{
    return environments ? sadmm_world_array_rows(environments->worker[0].world, array) : 0;
}

bool sadmm_environments_is_input(sadmm_array array)
{
    const bool is_state = array == SADMM_ARRAY_BODY_STATE || array == SADMM_ARRAY_JOINT_POSITION ||
                          array == SADMM_ARRAY_JOINT_SPEED || array == SADMM_ARRAY_COUPLING_TARGET;
    return sadmm_array_is_settable(array) && !is_state;
}

/* ---- marks ------------------------------------------------------------------------------------------------------- */

void sadmm_environments_take_mark(struct sadmm_environments *environments, int32_t environment)
{
    sadmm_free(environments->marks[environment]);
    environments->marks[environment] = NULL;
    environments->marked[environment] = 0;
}

void sadmm_environments_put_mark(struct sadmm_environments *environments, int32_t environment, const char *why)
{
    const size_t size = strlen(why) + 1;
    sadmm_environments_take_mark(environments, environment);
    environments->marked[environment] = 1;
    environments->marks[environment] = (char *)sadmm_alloc(size, 1);
    if (environments->marks[environment]) memcpy(environments->marks[environment], why, size);
}

/* ---- checks ------------------------------------------------------------------------------------------------------ */

sadmm_status sadmm_environments_check(struct sadmm_environments *environments, const char *name, int32_t environment)
{
    if (environment >= 0 && environment < environments->count) return SADMM_OK;
    return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "%s = %d: must be in [0, %d)", name,
                      environment, environments->count);
}

sadmm_status sadmm_environments_check_which(struct sadmm_environments *environments, const int32_t *which,
                                            int32_t *count)
{
    char name[32];
    if (!which) {
        *count = environments->count;
        return SADMM_OK;
    }
    if (*count < 0 || *count > environments->count)
        return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "count = %d: must be in [0, %d]", *count,
                          environments->count);
    const uint64_t call = ++environments->calls;
    for (int32_t k = 0; k < *count; ++k) {
        const bool there = which[k] >= 0 && which[k] < environments->count;
        if (there && environments->seen[which[k]] != call) {
            environments->seen[which[k]] = call;
            continue;
        }
        snprintf(name, sizeof name, "which[%d]", k);
        TRY(sadmm_environments_check(environments, name, which[k]));
        return sadmm_fail(&environments->error, SADMM_ERROR_INVALID_ARGUMENT, "%s = %d: is there twice", name,
                          which[k]);
    }
    return SADMM_OK;
}
