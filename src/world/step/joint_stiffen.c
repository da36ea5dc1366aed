/* Geometric stiffness of a (sub-)step's joints, by the forces that their rows have (core/model/stiffening.h). */
#include <string.h>

#include "core/base/memory.h"
#include "core/model/stiffening.h"
#include "joint_act.h"
#include "joint_stiffen.h"

/* What is done with the force of a joint on a dynamic body of it. */
typedef void on_force(sadmm_world *world, int32_t body, vec3 place, vec3 force);

/* Of a joint, on side s. */
static vec3 force_of(const sadmm_world *world, const struct sadmm_world_joint *joint, int s, double dt)
{
    const struct sadmm_rows *rows = &world->start.rows;
    const double *jacobian = s ? rows->jacobian_b : rows->jacobian_a;
    const bool held = (joint->def.locks & 7) == 7; /* its first three rows are all that has a force */
    vec3 force = v3(0, 0, 0);
    for (int32_t r = joint->first_row; r < (held ? joint->first_row + 3 : joint->end_row); ++r)
        force = stiffening_add_row(force, world->joint_sources[r].coordinate, jacobian + 6 * r, rows->lambda[r], dt);
    return force;
}

static inline void each_force(sadmm_world *world, double dt, on_force *f)
{
    for (size_t j = 0; j < world->step_joint_count; ++j) {
        const struct sadmm_world_joint *joint = world->step_joints[j];
        if (joint->first_row == joint->end_row) continue;
        /* On a it is that on b but for its sign. */
        const struct joint_side *side = world->acting_joints[joint->number].side;
        const int of = side[1].system_body >= 0;
        const vec3 force = force_of(world, joint, of, dt);
        for (int s = 0; s < 2; ++s) {
            const int32_t body = side[s].system_body;
            if (body < 0 || (s == 0 && joint->coupling)) continue;
            f(world, body, joint->frame[s].position, s == of ? force : v3_neg(force));
        }
    }
}

static void add_most(sadmm_world *world, int32_t body, vec3 place, vec3 force)
{
    stiffening_add_most(world->joint_load + 3 * (size_t)body, place, v3_norm(force));
}

static void add_stiffness(sadmm_world *world, int32_t body, vec3 place, vec3 force)
{
    struct joint_stiffening *s = &world->stiffening[body];
    if (world->stiffened[body]) stiffening_add(s->K, place, m3_tmul(s->frame, force));
}

static bool is_stiffened(const struct sadmm_rigid *body) { return body->rolls & ROLLING_IS_STIFFENED; }

/* May it be stiff, or is it? */
static bool is_of_account(const sadmm_world *world, int32_t i, double dt)
{
    const struct sadmm_rigid *body = &world->start.rigid[i];
    return is_stiffened(body) || stiffening_may_be(body->inertia, dt, world->joint_load + 3 * (size_t)i);
}

/* A body's own stiffness is kept beside, and there is none yet of joints where none has been found before. */
static void begin_body(sadmm_world *world, int32_t i, double dt)
{
    const struct sadmm_rigid *body = &world->start.rigid[i];
    struct joint_stiffening *s = &world->stiffening[i];
    memset(s->K, 0, sizeof s->K);
    s->frame = stiffening_frame(body, dt);
    if (is_stiffened(body)) return;
    memset(s->more, 0, sizeof s->more);
    if (rolling_is_stiff(body)) memcpy(s->own, body->stiffness, sizeof s->own);
}

/* Is its inertia another one than before? */
static bool stiffen_body(sadmm_world *world, int32_t i, double dt)
{
    struct sadmm_rigid *body = &world->start.rigid[i];
    struct joint_stiffening *s = &world->stiffening[i];
    if (!stiffening_renew(body->inertia, s->frame, dt, s->K, is_stiffened(body), s->more)) return false;
    stiffening_set(body, s->own, dt, s->more);
    return true;
}

sadmm_status sadmm_world_stiffen(sadmm_world *world, const sadmm_settings *settings, bool *any)
{
    const size_t n = (size_t)world->dynamic_count;
    bool may = false;
    *any = false;
    if (world->joint_rows == 0) return SADMM_OK;
    if (!SADMM_GROW(world->joint_load, 0, 3 * n) || !SADMM_GROW(world->stiffening, 0, n) ||
        !SADMM_GROW(world->stiffened, 0, n))
        return sadmm_fail_memory(&world->error, "the stiffness of joints");
    memset(world->joint_load, 0, 3 * n * sizeof *world->joint_load);
    each_force(world, settings->dt, add_most);
    for (int32_t i = 0; i < world->dynamic_count; ++i) {
        world->stiffened[i] = is_of_account(world, i, settings->dt);
        if (world->stiffened[i]) begin_body(world, i, settings->dt);
        may = may || world->stiffened[i];
    }
    if (!may) return SADMM_OK;
    each_force(world, settings->dt, add_stiffness);
    for (int32_t i = 0; i < world->dynamic_count; ++i) {
        world->stiffened[i] = world->stiffened[i] && stiffen_body(world, i, settings->dt);
        *any = *any || world->stiffened[i];
    }
    return SADMM_OK;
}
