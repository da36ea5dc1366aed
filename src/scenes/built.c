#include "built.h"

#include <math.h>

#include "core/math/vec3.h"

/* Unlike fmax: once NaN, always NaN. */
static double larger(double a, double b)
{
    return a > b || isnan(a) ? a : b;
}

sadmm_status sadmm_measure_built(sadmm_world *world, int32_t first, int32_t count, int32_t skip, sadmm_built_at at,
                                 double *moved, double *speed, struct sadmm_error *error)
{
    *moved = *speed = 0;
    for (int32_t i = 0; i < count; ++i) {
        sadmm_body_id id;
        sadmm_body_state state;
        if (i == skip) continue;
        sadmm_status status = sadmm_world_body_at(world, first + i, &id);
        if (status == SADMM_OK) status = sadmm_world_body_state(world, id, &state);
        if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
        const struct sadmm_frame put = at(i);
        *moved = larger(*moved, v3_norm(v3_sub(v3_load(state.position), v3_load(put.origin))));
        *speed = larger(*speed, v3_norm(v3_load(state.linear_velocity)));
    }
    return SADMM_OK;
}

sadmm_status sadmm_observe_built(const struct sadmm_scene *scene, sadmm_world *world, int64_t step, int32_t first,
                                 int32_t count, int32_t skip, sadmm_built_at at, double end, double most,
                                 struct sadmm_scene_task *task, struct sadmm_error *error)
{
    const double dt = scene->def.settings.dt, t = (double)step * dt;
    if (step > 0 && task->finished) return SADMM_OK;
    if (step > 0 && floor(t * 10 + 1e-6) == floor((t - dt) * 10 + 1e-6)) return SADMM_OK;
    double moved, speed;
    sadmm_status status = sadmm_measure_built(world, first, count, skip, at, &moved, &speed, error);
    if (status != SADMM_OK) return status;
    task->name = "stand";
    task->figure_count = 2;
    task->figures[0] = (struct sadmm_scene_figure){"moved", "m", moved};
    task->figures[1] = (struct sadmm_scene_figure){"speed", "m/s", speed};
    task->finished = t >= end - 1e-9;
    task->passed = task->finished && moved <= most;
    return SADMM_OK;
}
