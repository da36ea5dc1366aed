/* What "stands" means for each scene, shared by the short and the slow test. */
#ifndef SADMM_TESTS_STANDING_H
#define SADMM_TESTS_STANDING_H

#include "scene_tools.h"

struct standing_case {
    const char *spec;
    sadmm_method method;
    sadmm_precision precision;
    double duration;  /* s */
    double settle;    /* s, when the scene must have come to rest */
    double drift;     /* m, how far any body may move after that */
    double speed;     /* m/s, at the end */
    double ncp;       /* m/s, certificate at the end */
    double contacts;  /* Table I's average over the whole run; 0: not looked at */
};

/* Run a scene and hold it to the limits; the caller destroys the world. */
static inline sadmm_world *run_standing(const struct standing_case *limits)
{
    struct sadmm_scene scene = open_scene(limits->spec);
    sadmm_scene_set_method(&scene, limits->method);
    scene.def.backend = SADMM_BACKEND_CPU;
    scene.def.precision = limits->precision;
    scene.def.settings.threads = 1; /* others run beside this one */
    sadmm_world *world = build_scene(&scene);
    const char *method = limits->method == SADMM_METHOD_FAST ? "fast" : "paper";
    sadmm_body_state *settled = NULL;
    int steps = (int)lround(limits->duration / scene.def.settings.dt);
    int settle = (int)lround(limits->settle / scene.def.settings.dt);
    double contacts = 0, drift = 0;

    for (int i = 0; i < steps; ++i) {
        step_world(world, 1);
        contacts += world_report(world).contacts;
        if (i + 1 == settle) settled = all_states(world);
        /* Looked at along the way, so that what moves and comes back is seen. */
        if (settled && i % 20 == 0) drift = fmax(drift, top_drift(world, settled));
    }
    drift = fmax(drift, top_drift(world, settled));
    free(settled);
    sadmm_certificate certificate = certified_step(world);
    ck_assert_msg(drift <= limits->drift, "%s, %s: drift %g m after settling, limit %g", limits->spec, method, drift,
                  limits->drift);
    ck_assert_msg(top_speed(world) <= limits->speed, "%s, %s: final speed %g m/s, limit %g", limits->spec, method,
                  top_speed(world), limits->speed);
    ck_assert_msg(certificate.ncp_max <= limits->ncp, "%s, %s: certificate %g m/s at rest, limit %g", limits->spec,
                  method, certificate.ncp_max, limits->ncp);
    if (limits->contacts > 0) {
        double ratio = contacts / steps / limits->contacts;
        ck_assert_msg(fabs(ratio - 1) <= 0.15, "%s, %s: %g contacts on average, Table I has %g", limits->spec,
                      method, contacts / steps, limits->contacts);
    }
    return world;
}

/* Every third body after the ground is the top of a stack of three 0.3 m cubes: it stands at 0.75 m, level. */
static inline void expect_vertical_stacks(sadmm_world *world)
{
    for (int32_t i = 1; i < sadmm_world_body_count(world); ++i) {
        sadmm_body_state state = body_state(world, body_at(world, i));
        double height = 0.15 + 0.3 * ((i - 1) % 3), tilt = 2 * hypot(state.orientation[1], state.orientation[2]);
        /* a tenth of a millimetre: the slop and a penetration ten times as deep */
        ck_assert_double_eq_tol(state.position[2], height, 1e-4);
        ck_assert_double_lt(tilt, 1e-3);
    }
}

#endif
