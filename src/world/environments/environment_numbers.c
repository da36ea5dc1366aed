#include "environment_numbers.h"

#include <string.h>

#include "core/model/moments.h"

struct sadmm_bound_array *sadmm_environments_bound(const struct sadmm_environments *environments, sadmm_array array,
                                                   int precision)
{
    for (size_t k = 0; k < environments->bound_count; ++k) {
        struct sadmm_bound_array *bound = &environments->bound[k];
        if (bound->array == array && (precision < 0 || (int)bound->precision == precision)) return bound;
    }
    return NULL;
}

/* Single precision may take the least size out of its range by rounding, as it does moments (core/model/moments.h). */
static void mend_size(double *size)
{
    static const double least = 1e-6; /* m */
    if (*size < least && *size * MOMENTS_ROUNDING >= least) *size = least;
}

void sadmm_bound_mend(const struct sadmm_bound_array *bound, double *numbers)
{
    if (bound->precision != SADMM_F32) return;
    if (bound->array == SADMM_ARRAY_BODY_INERTIA)
        for (size_t k = 0; k < bound->numbers; k += 4) moments_mend(numbers + k);
    if (bound->array == SADMM_ARRAY_SHAPE_SIZE)
        for (size_t k = 0; k < bound->numbers; ++k) mend_size(numbers + k);
}

void sadmm_bound_load(const struct sadmm_bound_array *bound, int32_t environment, double *out)
{
    const size_t n = bound->numbers, first = n * (size_t)environment;
    if (bound->precision == SADMM_F64) {
        memcpy(out, (const double *)bound->host + first, n * sizeof *out);
        return;
    }
    for (size_t k = 0; k < n; ++k) out[k] = (double)((const float *)bound->host)[first + k];
    sadmm_bound_mend(bound, out);
}

void sadmm_bound_store(const struct sadmm_bound_array *bound, int32_t environment, const double *numbers)
{
    const size_t n = bound->numbers, first = n * (size_t)environment;
    if (bound->precision == SADMM_F64) memcpy((double *)bound->host + first, numbers, n * sizeof *numbers);
    else
        for (size_t k = 0; k < n; ++k) ((float *)bound->host)[first + k] = (float)numbers[k];
}

sadmm_status sadmm_bound_get_all(sadmm_world *world, sadmm_array array, double *values)
{
    const int32_t rows = sadmm_world_array_rows(world, array);
    const sadmm_status status = sadmm_world_get_array(world, array, 0, rows, values);
    if (status != SADMM_ERROR_UNAVAILABLE) return status;
    memset(values, 0, (size_t)rows * (size_t)sadmm_array_columns(array) * sizeof *values);
    return SADMM_OK;
}

sadmm_status sadmm_bound_set_all(sadmm_world *world, sadmm_array array, const double *values)
{
    const sadmm_status status = sadmm_world_set_array(world, array, 0, sadmm_world_array_rows(world, array), values);
    if (status == SADMM_OK) return SADMM_OK;
    const struct sadmm_error cause = world->error;
    return sadmm_fail(&world->error, status, "%s: %s", sadmm_array_name(array), cause.message);
}

sadmm_status sadmm_bound_read(struct sadmm_environment_worker *worker, const struct sadmm_bound_array *bound,
                              int32_t environment, bool good)
{
    sadmm_bound_load(bound, environment, worker->numbers);
    const sadmm_status status = sadmm_bound_set_all(worker->world, bound->array, worker->numbers);
    if (status != SADMM_ERROR_INVALID_ARGUMENT || !good) return status;
    return sadmm_bound_set_all(worker->world, bound->array, bound->start);
}

sadmm_status sadmm_environments_read_good_frames(struct sadmm_environments *environments,
                                                 struct sadmm_environment_worker *worker, int32_t environment)
{
    const struct sadmm_bound_array *bound = sadmm_environments_bound(environments, SADMM_ARRAY_JOINT_FRAME, -1);
    if (!bound) return SADMM_OK;
    if (!bound->given) return sadmm_bound_read(worker, bound, environment, true);
    return sadmm_bound_set_all(worker->world, bound->array, bound->given + bound->numbers * (size_t)environment);
}
