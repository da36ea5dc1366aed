#include "built.h"

#include <math.h>

#include "core/math/quat.h"

/* Unlike fmax: once NaN, always NaN. */
static double larger(double a, double b)
{
    return a > b || isnan(a) ? a : b;
}

sadmm_status sadmm_measure_built(const struct sadmm_scene *scene, sadmm_world *world, const struct sadmm_built *built,
                                 double *moved, double *speed, struct sadmm_error *error)
{
    *moved = *speed = 0;
    for (int32_t i = 0; i < built->count; ++i) {
        sadmm_shape_id id;
        sadmm_shape_def shape;
        sadmm_body_id body;
        sadmm_body_state state;
        if (i == built->skip) continue;
        sadmm_status status = sadmm_world_shape_at(world, built->first + i, &id);
        if (status == SADMM_OK) status = sadmm_world_shape_def(world, id, &shape, &body);
        if (status == SADMM_OK) status = sadmm_world_body_state(world, body, &state);
        if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
        const struct sadmm_frame put = built->at(scene, i);
        const vec3 arm = m3_mul(q_matrix(q_load(state.orientation)), v3_load(shape.position));
        const vec3 is = v3_add(v3_load(state.position), arm);
        *moved = larger(*moved, v3_norm(v3_sub(is, v3_load(put.origin))));
        *speed = larger(*speed, v3_norm(v3_load(state.linear_velocity)));
    }
    return SADMM_OK;
}

sadmm_status sadmm_observe_built(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                 const struct sadmm_built *built, struct sadmm_scene_task *task,
                                 struct sadmm_error *error)
{
    const double dt = scene->def.settings.dt, t = (double)step * dt;
    if (step > 0 && task->finished) return SADMM_OK;
    if (step > 0 && floor(t * 10 + 1e-6) == floor((t - dt) * 10 + 1e-6)) return SADMM_OK;
    double moved, speed;
    sadmm_status status = sadmm_measure_built(scene, world, built, &moved, &speed, error);
    if (status != SADMM_OK) return status;
    task->name = "stand";
    task->figure_count = 2;
    task->figures[0] = (struct sadmm_scene_figure){"moved", "m", moved};
    task->figures[1] = (struct sadmm_scene_figure){"speed", "m/s", speed};
    task->finished = t >= built->end - 1e-9;
    task->passed = task->finished && moved <= built->most;
    return SADMM_OK;
}
