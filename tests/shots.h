/* Bodies of any shape, 0.5 mm to 1 m large, shot at one another: two to an environment, both dynamic, at 0.1 to 1,000
 * m/s, with or without spin, friction and restitution. They must not pass through each other: the balls about their
 * centres of mass that the two hold never come closer than half the sum of their radii, on the straight way of a
 * step. */
#ifndef TESTS_SHOTS_H
#define TESTS_SHOTS_H

#include "drops.h"
#include "fixed_work.h"

enum { SHOT_PAIRS = 40, SHOT_STEPS = 20 };

/* No larger than the radius of the ball about its centre of mass that the form holds, by its size (drop_shape). */
struct shot_form {
    int form;
    double inner;
};
static const struct shot_form shot_forms[] = {
    {SADMM_SHAPE_SPHERE, 1},     {SADMM_SHAPE_CAPSULE, 0.6}, {SADMM_SHAPE_BOX, 0.6},       {SADMM_SHAPE_HULL, 0.1},
    {SADMM_SHAPE_CYLINDER, 0.8}, {SADMM_SHAPE_CONE, 0.5},    {SADMM_SHAPE_ELLIPSOID, 0.6}, {DROP_COMPOUND, 0.04},
    {DROP_NEEDLE, 0.05},         {DROP_LEAF, 0.03}};

struct shot {
    sadmm_body_id id[2];
    double balls;   /* sum of the radii */
    vec3 last, way; /* where the first is from the second; where it is shot */
    bool through;
};

static inline void shoot(sadmm_world *world, int number, bool hulls, double dt, uint64_t *seed, struct shot *out)
{
    const double size = drop_log(seed, 5e-4, 1), other = fmin(1, fmax(5e-4, size * drop_log(seed, 0.03, 30))),
                 speed = drop_log(seed, 0.1, 1000), spin = drop_unit(seed) < 0.5 ? 0 : drop_log(seed, 1, 1000),
                 friction = drop_unit(seed) < 0.3 ? 0 : drop_unit(seed),
                 restitution = drop_unit(seed) < 0.5 ? 0 : drop_unit(seed);
    const struct shot_form *form[2];
    sadmm_body_def body[2] = {sadmm_body_def_default(), sadmm_body_def_default()};
    vec3 across, unused;
    for (int k = 0; k < 2; ++k) {
        form[k] = &shot_forms[(int)(10 * drop_unit(seed))];
        if (form[k]->form == SADMM_SHAPE_HULL && !hulls) form[k] = &shot_forms[0];
        q_store(drop_turn(seed), body[k].orientation);
        if (k == 0 || drop_unit(seed) < 0.3)
            v3_store(v3_scale(q_matrix(drop_turn(seed)).r[0], spin), body[k].angular_velocity);
    }
    out->balls = form[0]->inner * size + form[1]->inner * other;
    out->way = q_matrix(drop_turn(seed)).r[0];
    v3_tangents(out->way, &across, &unused);
    out->last = v3_madd(v3_scale(out->way, -2 * (size + other) - 3 * drop_unit(seed) * speed * dt),
                        0.4 * out->balls * drop_unit(seed), across);
    out->through = false;
    v3_store(out->last, body[0].position);
    v3_store(v3_scale(out->way, speed), body[0].linear_velocity);
    for (int k = 0; k < 2; ++k)
        out->id[k] = drop_body(world, form[k]->form, k ? other : size, number, &body[k], friction, restitution, seed);
}

/* The first beyond the second, through its middle. */
static inline void shot_inspect(sadmm_world *world, struct shot *s)
{
    const sadmm_body_state a = body_state(world, s->id[0]), b = body_state(world, s->id[1]);
    const vec3 x = v3_sub(v3_load(a.position), v3_load(b.position)), way = v3_sub(x, s->last);
    const double length2 = v3_norm2(way),
                 share = length2 > 0 ? fmin(1, fmax(0, -v3_dot(s->last, way) / length2)) : 0;
    s->through = s->through || (v3_norm(v3_madd(s->last, share, way)) < 0.5 * s->balls && v3_dot(x, s->way) > 0);
    s->last = x;
}

/* How many of the world's shots go through. */
static inline int shots_through(uint64_t number, bool hulls)
{
    static const double steps[] = {0.001, 0.005, 0.01, 0.02};
    uint64_t seed = number * UINT64_C(0x9E3779B97F4A7C15) + 1;
    sadmm_world_def def = fixed_world_def();
    struct shot shots[SHOT_PAIRS];
    int through = 0;
    for (int k = 0; k < 20; ++k) drop_unit(&seed);
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    def.settings.dt = steps[number % 4];
    sadmm_world *world = create_world(&def);
    for (int i = 0; i < SHOT_PAIRS; ++i) shoot(world, i, hulls, def.settings.dt, &seed, &shots[i]);
    for (int step = 0; step < SHOT_STEPS; ++step) {
        step_world(world, 1);
        for (int i = 0; i < SHOT_PAIRS; ++i) shot_inspect(world, &shots[i]);
    }
    for (int i = 0; i < SHOT_PAIRS; ++i) through += shots[i].through;
    sadmm_world_destroy(world);
    return through;
}

/* Of `worlds` of them, numbered from `first` on. */
static inline int shots_all(uint64_t first, int worlds)
{
    uint64_t seed = 1;
    sadmm_hull *hull = drop_hull(1, &seed);
    int through = 0;
    for (int k = 0; k < worlds; ++k) through += shots_through(first + (uint64_t)k, hull != NULL);
    sadmm_hull_destroy(hull);
    return through;
}

#endif
