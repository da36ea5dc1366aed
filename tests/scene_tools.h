/* Worlds and scenes in tests: every call must succeed, or the running test fails with the library's message. */
#ifndef SADMM_TESTS_SCENE_TOOLS_H
#define SADMM_TESTS_SCENE_TOOLS_H

#include <check.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scenes/scenes.h"
#include "subadmm/subadmm.h"
#include "run_suite.h"

#define MUST(world, call)                                                                                   \
    do {                                                                                                    \
        sadmm_status must_status = (call);                                                                  \
        ck_assert_msg(must_status == SADMM_OK, "%s: %s: %s", #call, sadmm_status_name(must_status),         \
                      sadmm_world_message(world));                                                          \
    } while (0)

static inline struct sadmm_scene open_scene(const char *spec)
{
    struct sadmm_scene scene;
    struct sadmm_error error = { 0 };
    sadmm_status status = sadmm_scene_open(spec, &scene, &error);
    ck_assert_msg(status == SADMM_OK, "%s: %s", spec, error.message);
    return scene;
}

static inline sadmm_world *build_scene(const struct sadmm_scene *scene)
{
    sadmm_world *world = NULL;
    struct sadmm_error error = { 0 };
    sadmm_status status = sadmm_scene_build(scene, &world, &error);
    ck_assert_msg(status == SADMM_OK, "%s: %s", scene->info->name, error.message);
    return world;
}

/* The scene has convex hulls, and the library was built without what makes them. */
static inline bool lacks_hulls(const struct sadmm_scene *scene)
{
    sadmm_world *world = NULL;
    struct sadmm_error error = { 0 };
    const sadmm_status status = sadmm_scene_build(scene, &world, &error);
    sadmm_world_destroy(world);
    if (status != SADMM_ERROR_UNAVAILABLE) return false;
    ck_assert_msg(strstr(error.message, "hull") && world == NULL, "%s: %s", scene->info->name, error.message);
    return true;
}

static inline sadmm_world *create_world(const sadmm_world_def *def)
{
    sadmm_world *world = NULL;
    sadmm_status status = sadmm_world_create(def, &world);
    ck_assert_msg(status == SADMM_OK, "%s", sadmm_last_message());
    return world;
}

static inline void step_world(sadmm_world *world, int steps)
{
    for (int i = 0; i < steps; ++i) MUST(world, sadmm_world_step(world));
}

static inline sadmm_step_report world_report(sadmm_world *world)
{
    sadmm_step_report report;
    MUST(world, sadmm_world_report(world, &report));
    return report;
}

static inline uint64_t state_hash(sadmm_world *world)
{
    uint64_t hash;
    MUST(world, sadmm_world_state_hash(world, &hash));
    return hash;
}

/* One more step, with its certificate. */
static inline sadmm_certificate certified_step(sadmm_world *world)
{
    sadmm_settings settings = sadmm_world_settings(world);
    settings.certify = true;
    MUST(world, sadmm_world_set_settings(world, &settings));
    step_world(world, 1);
    settings.certify = false;
    MUST(world, sadmm_world_set_settings(world, &settings));
    return world_report(world).certificate;
}

static inline sadmm_body_state body_state(sadmm_world *world, sadmm_body_id id)
{
    sadmm_body_state state;
    MUST(world, sadmm_world_body_state(world, id, &state));
    return state;
}

/* The index-th body in order of creation. */
static inline sadmm_body_id body_at(sadmm_world *world, int32_t index)
{
    sadmm_body_id id;
    MUST(world, sadmm_world_body_at(world, index, &id));
    return id;
}

static inline sadmm_body_def body_def(sadmm_world *world, sadmm_body_id id)
{
    sadmm_body_def def;
    MUST(world, sadmm_world_body_def(world, id, &def));
    return def;
}

/* States of all bodies, static ones included, in order of creation; the caller frees them. */
static inline sadmm_body_state *all_states(sadmm_world *world)
{
    int32_t count = sadmm_world_body_count(world);
    sadmm_body_state *states = malloc((size_t)count * sizeof *states);
    for (int32_t i = 0; i < count; ++i) states[i] = body_state(world, body_at(world, i));
    return states;
}

static inline double distance(const double a[3], const double b[3])
{
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

static inline double norm3(const double a[3])
{
    return hypot(hypot(a[0], a[1]), a[2]);
}

/* Fastest body: linear speed, m/s. */
static inline double top_speed(sadmm_world *world)
{
    double top = 0;
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i)
        top = fmax(top, norm3(body_state(world, body_at(world, i)).linear_velocity));
    return top;
}

/* The farthest any body has moved from `from` (all_states at an earlier time), m. */
static inline double top_drift(sadmm_world *world, const sadmm_body_state *from)
{
    double top = 0;
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i)
        top = fmax(top, distance(body_state(world, body_at(world, i)).position, from[i].position));
    return top;
}

/* A static plane at z = 0 that bodies of all environments meet. */
static inline void add_floor(sadmm_world *world, double friction)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.type = SADMM_BODY_STATIC;
    body.environment = -1;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = SADMM_SHAPE_PLANE;
    shape.friction = friction;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
}

#endif
