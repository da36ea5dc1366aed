/* Rays in environments. */
#include "core/base/check.h"
#include "environment_arrays.h"
#include "environment_backend.h"
#include "environment_checks.h"
#include "environment_work.h"

struct casting {
    int32_t each;
    const sadmm_ray *rays;
    const sadmm_query_filter *filter;
    sadmm_ray_hit *hits;
};

static sadmm_status cast_rays(struct sadmm_environments *environments, struct sadmm_environment_worker *worker,
                              int32_t environment, int32_t place, void *argument)
{
    const struct casting *casting = (const struct casting *)argument;
    const size_t first = (size_t)casting->each * (size_t)place;
    TRY(sadmm_environments_load(environments, worker, environment));
    TRY(sadmm_environments_read_good_forms(environments, worker, environment));
    return sadmm_world_cast_rays(worker->world, casting->each, casting->rays + first, casting->filter,
                                 casting->hits + first);
}

sadmm_status sadmm_environments_cast_rays(sadmm_environments *environments, const int32_t *which, int32_t count,
                                          int32_t each, const sadmm_ray *rays, const sadmm_query_filter *filter,
                                          sadmm_ray_hit *hits)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    TRY(sadmm_environments_check_backend(environments));
    struct sadmm_error *error = &environments->error;
    struct casting casting = {each, rays, filter, hits};
    TRY(sadmm_environments_check_which(environments, which, &count));
    if (each < 0) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "each = %d: must be >= 0", each);
    if (each == 0) return SADMM_OK;
    TRY(sadmm_check_given(rays, "rays", error));
    TRY(sadmm_check_given(hits, "hits", error));
    TRY(sadmm_environments_pull_inputs(environments, true));
    return sadmm_environments_each(environments, which, count, cast_rays, &casting);
}
