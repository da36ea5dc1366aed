#include "motion_world.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "core/base/clock.h"
#include "core/base/memory.h"
#include "core/math/quat.h"

sadmm_status motion_world_check(const struct motion_world *w, sadmm_status status)
{
    return status == SADMM_OK ? status : sadmm_fail(w->error, status, "%s", sadmm_world_message(w->world));
}

/* ---- opening --------------------------------------------------------------------------------------------------- */

static sadmm_status list_bodies(struct motion_world *w, int *moving_of, int32_t count)
{
    for (int32_t i = 0; i < count; ++i) {
        sadmm_body_id id;
        sadmm_body_def def;
        TRY(motion_world_check(w, sadmm_world_body_at(w->world, i, &id)));
        TRY(motion_world_check(w, sadmm_world_body_def(w->world, id, &def)));
        moving_of[id.slot] = -1;
        if (def.type != SADMM_BODY_DYNAMIC) continue;
        moving_of[id.slot] = w->body_count;
        struct moving_body *body = &w->bodies[w->body_count++];
        *body = (struct moving_body){.id = id, .mass = def.mass};
        memcpy(body->inertia, def.inertia, sizeof body->inertia);
    }
    return SADMM_OK;
}

static void place_shape(struct motion_world *w, int k, const sadmm_body_state *state)
{
    const sadmm_shape_def *def = &w->shapes[k].def;
    const quat turn = q_load(state->orientation);
    double position[3], orientation[4];
    v3_store(v3_add(v3_load(state->position), m3_mul(q_matrix(turn), v3_load(def->position))), position);
    q_store(q_normalize(q_mul(turn, q_load(def->orientation))), orientation);
    solid_place(&w->solids[k], position, orientation);
}

static sadmm_status list_shapes(struct motion_world *w, const int *moving_of)
{
    for (int k = 0; k < w->shape_count; ++k) {
        sadmm_shape_id id;
        sadmm_body_id body;
        sadmm_body_state state;
        struct motion_shape *shape = &w->shapes[k];
        TRY(motion_world_check(w, sadmm_world_shape_at(w->world, k, &id)));
        TRY(motion_world_check(w, sadmm_world_shape_def(w->world, id, &shape->def, &body)));
        if (shape->def.type >= SADMM_SHAPE_HULL)
            return sadmm_fail(w->error, SADMM_ERROR_UNSUPPORTED, "a scene with other shapes: overlaps are measured of "
                                                                 "boxes, capsules, spheres and planes alone");
        shape->body = moving_of[body.slot];
        w->solids[k] = solid_of_shape(&shape->def);
        w->solids[k].body = (int)body.slot;
        w->solids[k].fixed = shape->body < 0;
        TRY(motion_world_check(w, sadmm_world_body_state(w->world, body, &state)));
        place_shape(w, k, &state);
    }
    return SADMM_OK;
}

/* Finaliser of SplitMix64: all bits of the result depend on all bits of x. */
static uint64_t mix(uint64_t x)
{
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

/* Uniform over all orientations (Shoemake, Graphics Gems III), from three numbers in [0, 1). */
static quat random_orientation(int seed, int body)
{
    double u[3];
    for (uint64_t k = 0; k < 3; ++k)
        u[k] = (double)(mix(((uint64_t)seed << 40) + ((uint64_t)body << 2) + k + 1) >> 11) * 0x1p-53;
    const double turn = 2 * 3.14159265358979323846, a = sqrt(1 - u[0]), b = sqrt(u[0]);
    return (quat){a * sin(turn * u[1]), a * cos(turn * u[1]), b * sin(turn * u[2]), b * cos(turn * u[2])};
}

static sadmm_status turn_bodies(struct motion_world *w, int seed)
{
    for (int i = 0; i < w->body_count; ++i) q_store(random_orientation(seed, i), w->states[i].orientation);
    return motion_world_set_states(w, w->states);
}

sadmm_status motion_world_open(struct motion_world *w, const struct sadmm_scene *scene, int seed,
                               struct sadmm_error *error)
{
    *w = (struct motion_world){.scene = scene, .error = error};
    TRY(sadmm_scene_build(scene, &w->world, error));
    const int32_t count = sadmm_world_body_count(w->world);
    w->shape_count = sadmm_world_shape_count(w->world);
    w->bodies = sadmm_alloc((size_t)count, sizeof *w->bodies);
    w->states = sadmm_alloc((size_t)count, sizeof *w->states);
    w->shapes = sadmm_alloc((size_t)w->shape_count, sizeof *w->shapes);
    w->solids = sadmm_alloc((size_t)w->shape_count, sizeof *w->solids);
    int *moving_of = sadmm_alloc((size_t)count + 1, sizeof *moving_of); /* by slot: of a new world 1, 2, ... */
    sadmm_status status = SADMM_OK;
    if (!w->bodies || !w->states || !w->shapes || !w->solids || !moving_of)
        status = sadmm_fail_memory(error, "the bodies");
    if (status == SADMM_OK) status = list_bodies(w, moving_of, count);
    if (status == SADMM_OK) status = list_shapes(w, moving_of);
    if (status == SADMM_OK) status = motion_world_read(w);
    if (status == SADMM_OK && seed > 0) status = turn_bodies(w, seed);
    sadmm_free(moving_of);
    return status;
}

void motion_world_close(struct motion_world *w)
{
    sadmm_world_destroy(w->world);
    sadmm_free(w->bodies);
    sadmm_free(w->states);
    sadmm_free(w->shapes);
    sadmm_free(w->solids);
    *w = (struct motion_world){0};
}

/* ---- states and steps ------------------------------------------------------------------------------------------ */

sadmm_status motion_world_set_states(struct motion_world *w, const sadmm_body_state *states)
{
    for (int i = 0; i < w->body_count; ++i)
        TRY(motion_world_check(w, sadmm_world_set_body_state(w->world, w->bodies[i].id, &states[i])));
    return motion_world_read(w);
}

sadmm_status motion_world_read(struct motion_world *w)
{
    for (int i = 0; i < w->body_count; ++i)
        TRY(motion_world_check(w, sadmm_world_body_state(w->world, w->bodies[i].id, &w->states[i])));
    for (int k = 0; k < w->shape_count; ++k)
        if (w->shapes[k].body >= 0) place_shape(w, k, &w->states[w->shapes[k].body]);
    return SADMM_OK;
}

sadmm_status motion_world_step(struct motion_world *w, int64_t done, double *ms)
{
    TRY(sadmm_scene_before_step(w->scene, w->world, done, w->error));
    const double begin = sadmm_clock_ms();
    TRY(motion_world_check(w, sadmm_world_step(w->world)));
    if (ms) *ms += sadmm_clock_ms() - begin;
    return SADMM_OK;
}

/* ---- measures -------------------------------------------------------------------------------------------------- */

/* Points of a body lie at r = sum r_k a_k with its axes a_k. Its principal moments are those of r: the mean of r_k^2 is
 * s_k = (I_1 + I_2 + I_3 - 2 I_k) / (2 m), that of r_j r_k is 0, and so the mean square of (x + r) - (x' + r') is
 * |x - x'|^2 + sum s_k |a_k - a'_k|^2. */
double pose_distance(const struct moving_body *body, const sadmm_body_state *a, const sadmm_body_state *b)
{
    const double *inertia = body->inertia, sum = inertia[0] + inertia[1] + inertia[2];
    const mat3 to_a = q_matrix(q_load(a->orientation)), to_b = q_matrix(q_load(b->orientation));
    double square = v3_norm2(v3_sub(v3_load(a->position), v3_load(b->position)));
    for (int k = 0; k < 3; ++k) {
        const vec3 unit = v3(k == 0, k == 1, k == 2);
        const double mean_square = fmax(0, 0.5 * sum - inertia[k]) / body->mass;
        square += mean_square * v3_norm2(v3_sub(m3_mul(to_a, unit), m3_mul(to_b, unit)));
    }
    return sqrt(square);
}

struct motion_moments motion_world_moments(const struct motion_world *w)
{
    const vec3 gravity = v3_load(w->scene->def.settings.gravity);
    const double strength = v3_norm(gravity);
    const vec3 up = strength > 0 ? v3_scale(gravity, -1 / strength) : v3(0, 0, 1);
    struct motion_moments m = {0};
    vec3 centre = v3(0, 0, 0);
    double mass = 0;
    for (int i = 0; i < w->body_count; ++i) {
        centre = v3_madd(centre, w->bodies[i].mass, v3_load(w->states[i].position));
        mass += w->bodies[i].mass;
    }
    centre = v3_scale(centre, 1 / mass);
    for (int i = 0; i < w->body_count; ++i) {
        const struct moving_body *body = &w->bodies[i];
        const sadmm_body_state *state = &w->states[i];
        const vec3 out = v3_sub(v3_load(state->position), centre);
        const vec3 spin = m3_tmul(q_matrix(q_load(state->orientation)), v3_load(state->angular_velocity));
        m.spread += body->mass / mass * (v3_norm2(out) - v3_dot(out, up) * v3_dot(out, up));
        m.kinetic += 0.5 * body->mass * v3_norm2(v3_load(state->linear_velocity)) +
                     0.5 * (body->inertia[0] * spin.x * spin.x + body->inertia[1] * spin.y * spin.y +
                            body->inertia[2] * spin.z * spin.z);
    }
    m.height = v3_dot(centre, up);
    m.spread = sqrt(fmax(0, m.spread));
    return m;
}
