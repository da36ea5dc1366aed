/* What "stands" means, shared by the short and the slow test. */
#ifndef SADMM_TESTS_STANDING_H
#define SADMM_TESTS_STANDING_H

#include <float.h>

#include "scene_tools.h"

struct standing_case {
    const char *spec;
    double duration;    /* s; in the second half of it everything is at rest */
    double load;        /* weight on and of the body that carries most, over its own */
    double reach;       /* m, how far a body may get from where it was put; INFINITY: some are dropped */
    int32_t contacts;   /* at rest, by the scene's geometry; 0: not that simple */
    void (*expect)(sadmm_world *world, const sadmm_body_state *start); /* what else, at the end; may be NULL */
    double table;       /* Table I's average number of contacts over the run; 0: it has none */
};

/* Contacts may be penetrated by this much (the default). */
#define SLOP 1e-5

/* The fastest a body at rest may be, m/s: a millimetre in twelve days, and what rounding leaves. Method paper adds up
 * impulses: what a body's load is rounded to pushes it. Method fast passes on changes, which go to 0: less than what
 * gravity adds in a step is rounded to. */
static inline double creep(const struct standing_case *about, sadmm_method method, sadmm_precision precision, double dt)
{
    const double roundoff = (precision == SADMM_F32 ? FLT_EPSILON : DBL_EPSILON) / 2;
    return 1e-9 + roundoff * 9.81 * dt * (method == SADMM_METHOD_PAPER ? about->load : 1);
}

static inline void run_standing(const struct standing_case *about, sadmm_method method, sadmm_precision precision)
{
    struct sadmm_scene scene = open_scene(about->spec);
    sadmm_scene_set_method(&scene, method);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = precision;
    scene.def.settings.threads = 1; /* others run beside this one */
    const double dt = scene.def.settings.dt, still = creep(about, method, precision, dt);
    const int steps = (int)lround(about->duration / dt);
    char what[80];
    snprintf(what, sizeof what, "%s, %s, f%d", about->spec, method == SADMM_METHOD_FAST ? "fast" : "paper",
             precision == SADMM_F32 ? 32 : 64);

    ck_assert_double_eq(scene.def.settings.slop, SLOP);
    sadmm_world *world = build_scene(&scene);
    sadmm_body_state *start = all_states(world), *middle = NULL;
    double sum = 0;
    for (int i = 1; i <= steps; ++i) {
        step_world(world, 1);
        const sadmm_step_report report = world_report(world);
        sum += report.contacts;
        if (middle && about->contacts)
            ck_assert_msg(report.contacts == about->contacts, "%s: %d contacts", what, report.contacts);
        /* Deeper ones are pushed out, by a share a step. */
        if (middle)
            ck_assert_msg(report.penetration_max <= SLOP + still * dt, "%s: %g m deep", what, report.penetration_max);
        if (i == steps / 2) middle = all_states(world);
        if (i % 20 && i < steps) continue; /* along the way, so that what moves and comes back is seen */
        const double away = top_drift(world, start), crept = middle ? top_drift(world, middle) : 0;
        ck_assert_msg(away <= about->reach, "%s: %g m from where it was put", what, away);
        ck_assert_msg(crept <= still * about->duration / 2, "%s: creeps by %g m", what, crept);
    }
    const sadmm_certificate certificate = certified_step(world);
    ck_assert_msg(top_speed(world) <= still, "%s: %g m/s at rest", what, top_speed(world));
    /* What two bodies move and turn by. */
    ck_assert_msg(certificate.ncp_max <= 4 * still, "%s: natural map %g m/s at rest", what, certificate.ncp_max);
    /* The paper says little of how its bodies are arranged (docs/guide/scenes.md, which promises this). */
    if (about->table > 0)
        ck_assert_msg(fabs(sum / steps / about->table - 1) <= 0.15, "%s: %g contacts on average, Table I has %g", what,
                      sum / steps, about->table);
    if (about->expect) about->expect(world, start);
    free(start);
    free(middle);
    sadmm_world_destroy(world);
}

/* Every third body after the ground is the top of a stack of three 0.3 m cubes. A contact sinks by the slop and no
 * more, which tilts a cube by that over its side about two axes; the heavy one was dropped pitched by 0.025 rad, and
 * rights itself about an edge, which takes its centre, and what is below along with it, half (1 - cos + sin) to the
 * side. */
static inline void expect_vertical_stacks(sadmm_world *world, const sadmm_body_state *start)
{
    const double half = 0.15, pitch = 0.025, sideways = half * (1 - cos(pitch) + sin(pitch));
    for (int32_t i = 1; i < sadmm_world_body_count(world); ++i) {
        const int level = (i - 1) % 3;
        const double sunk = (level + 1) * SLOP, tilted = sqrt(2) * sunk / (2 * half);
        sadmm_body_state state = body_state(world, body_at(world, i));
        double height = half * (2 * level + 1), tilt = 2 * hypot(state.orientation[1], state.orientation[2]);
        double moved = hypot(state.position[0] - start[i].position[0], state.position[1] - start[i].position[1]);
        ck_assert_double_le(fabs(state.position[2] - height), sunk);
        ck_assert_double_le(tilt, tilted);
        ck_assert_double_le(moved, sideways + 2 * half * tilted * level);
    }
}

#endif
