/* Worlds on the CUDA backend, on a device or emulated (CUDA_EMULATED), for the tests of its whole steps. */
#ifndef TESTS_CUDA_WORLDS_H
#define TESTS_CUDA_WORLDS_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/definition_fields.h"
#include "cuda_suite.h"
#include "fixed_work.h"
#include "scene_tools.h"
#include "world/state/world_state.h"

#ifdef CUDA_EMULATED
#include "emulation_control.h"
#define force_tier cuda_emulation_force_tier
#define tier_of cuda_emulation_tier_of
#define tune_capacities cuda_emulation_tune_capacities
#else
#include "backend_cuda/device/tier.h"
#define force_tier sadmm_cuda_force_tier
#define tier_of sadmm_cuda_tier_of
#define tune_capacities sadmm_cuda_tune_capacities
#endif

static const struct sadmm_kernels *tables[2]; /* by precision */

/* The emulated device takes seconds for what a device does in milliseconds. */
#ifdef CUDA_EMULATED
enum { EMULATED = 1 };
#else
enum { EMULATED = 0 };
#endif

/* ---- worlds ---------------------------------------------------------------------------------------------------- */

/* Give a world the device's kernels before its first step. */
static inline void use_device(sadmm_world *world, int precision, int device)
{
    world->kernels = tables[precision];
    ck_assert_msg(world->kernels->create(device, &world->context, &world->error) == SADMM_OK, "%s",
                  world->error.message);
}

/* The host makes the steps: a stop rule has to be inspected, and nothing ever meets this one. */
static inline void by_host(sadmm_world *world)
{
    sadmm_settings settings = sadmm_world_settings(world);
    settings.residual_tolerance = 1e-300;
    settings.check_period = 1000000;
    MUST(world, sadmm_world_set_settings(world, &settings));
}

/* The method `fast`, with so many iterations a step. */
static inline void use_fast(sadmm_world *world, int iterations)
{
    sadmm_settings settings = sadmm_world_settings(world);
    settings.method = SADMM_METHOD_FAST;
    settings.iterations = iterations;
    MUST(world, sadmm_world_set_settings(world, &settings));
}

/* A box, or a ball with the inertia of the box around it. */
static inline sadmm_body_id add_solid(sadmm_world *world, sadmm_shape_type type, double x, double y, double z,
                                      double half, double mass, double friction)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    const double h[3] = {half, half, half};
    sadmm_body_id id;
    body.mass = mass;
    body.position[0] = x;
    body.position[1] = y;
    body.position[2] = z;
    sadmm_box_inertia(mass, h, body.inertia);
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = type;
    shape.friction = friction;
    memcpy(shape.size, h, type == SADMM_SHAPE_BOX ? sizeof h : sizeof *h);
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

static inline sadmm_body_id add_box(sadmm_world *world, double x, double y, double z, double half, double mass,
                                    double friction)
{
    return add_solid(world, SADMM_SHAPE_BOX, x, y, z, half, mass, friction);
}

/* Towers of boxes that fall a little and land in different steps; every third one leans on its neighbour. */
static inline sadmm_world *towers_on(int count, int height, double friction, int precision, int device)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.precision = (sadmm_precision)precision;
    def.settings.method = SADMM_METHOD_PAPER; /* use_fast for the other one */
    def.settings.iterations = EMULATED ? 23 : 35;
    def.settings.penalty_period = 10;
    sadmm_world *world = create_world(&def);
    add_floor(world, friction);
    for (int t = 0; t < count; ++t)
        for (int i = 0; i < height; ++i)
            add_box(world, t % 3 == 2 ? 0.5 * t - 0.29 : 0.5 * t, 0.01 * i, 0.1 + 0.002 * t + 0.201 * i, 0.1, 1 + i,
                    friction);
    use_device(world, precision, device);
    return world;
}

static inline sadmm_world *towers(int count, int height, double friction, int precision)
{
    return towers_on(count, height, friction, precision, 0);
}

static inline void expect_same_world(sadmm_world *a, sadmm_world *b, const char *what)
{
    ck_assert_msg(state_hash(a) == state_hash(b), "%s: states differ", what);
    int32_t count = sadmm_world_contact_count(a);
    ck_assert_msg(count == sadmm_world_contact_count(b), "%s: %d and %d contacts", what, count,
                  sadmm_world_contact_count(b));
    sadmm_contact *x = calloc((size_t)count + 1, sizeof *x), *y = calloc((size_t)count + 1, sizeof *y);
    MUST(a, sadmm_world_contacts(a, 0, count, x));
    MUST(b, sadmm_world_contacts(b, 0, count, y));
    for (int32_t k = 0; k < count; ++k)
        ck_assert_msg(memcmp(&x[k], &y[k], sizeof *x) == 0, "%s: contact %d differs: separation %g %g, impulse %g %g",
                      what, k, x[k].separation, y[k].separation, x[k].impulse[2], y[k].impulse[2]);
    free(x);
    free(y);
    for (int32_t i = 0; i < sadmm_world_body_count(a); ++i) {
        double wa[6], wb[6];
        sadmm_body_id id = body_at(a, i);
        if (body_def(a, id).type == SADMM_BODY_STATIC) continue;
        MUST(a, sadmm_world_body_contact_wrench(a, id, wa));
        MUST(b, sadmm_world_body_contact_wrench(b, id, wb));
        /* contacts are summed in the same order, hits beside them in another: some hundred roundings of double */
        double size = 0;
        for (int k = 0; k < 6; ++k) size += fabs(wa[k]);
        const double tolerance = a->start.hit_count > 0 ? 1e-12 * size : 0;
        for (int k = 0; k < 6; ++k)
            ck_assert_msg(fabs(wa[k] - wb[k]) <= tolerance, "%s: wrench %d of body %d differs: %.17g %.17g", what, k, i,
                          wa[k], wb[k]);
    }
    sadmm_step_report ra = world_report(a), rb = world_report(b);
    ck_assert_msg(ra.step == rb.step && ra.time == rb.time && ra.contacts == rb.contacts && ra.pairs == rb.pairs &&
                      ra.bodies == rb.bodies && ra.iterations == rb.iterations && ra.limited == rb.limited &&
                      ra.penetration_max == rb.penetration_max,
                  "%s: reports differ: steps %lld %lld, depth %g %g, iterations %d %d, limited %d %d", what,
                  (long long)ra.step, (long long)rb.step, ra.penetration_max, rb.penetration_max, ra.iterations,
                  rb.iterations, ra.limited, rb.limited);
}

#endif
