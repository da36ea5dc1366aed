/* Worlds that queries are asked in. */
#ifndef SADMM_TESTS_QUERY_WORLDS_H
#define SADMM_TESTS_QUERY_WORLDS_H

#include "fixed_work.h"
#include "manifold_tools.h"
#include "mesh_tools.h"
#include "scene_tools.h"

static inline sadmm_world *empty_world(void)
{
    sadmm_world_def def = fixed_world_def();
    def.backend = SADMM_BACKEND_CPU;
    def.settings.threads = 1;
    return create_world(&def);
}

static inline sadmm_body_id add_body(sadmm_world *world, sadmm_body_type type, double x, double y, double z)
{
    const double position[3] = {x, y, z};
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    def.type = type;
    def.mass = 1;
    for (int k = 0; k < 3; ++k) def.inertia[k] = 1;
    memcpy(def.position, position, sizeof position);
    MUST(world, sadmm_world_add_body(world, &def, &id));
    return id;
}

static inline sadmm_shape_def shape_of(sadmm_shape_type type, double a, double b, double c)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    def.type = type;
    def.size[0] = a;
    def.size[1] = b;
    def.size[2] = c;
    return def;
}

static inline sadmm_shape_id add_shape(sadmm_world *world, sadmm_body_id body, const sadmm_shape_def *def)
{
    sadmm_shape_id id;
    MUST(world, sadmm_world_add_shape(world, body, def, &id));
    return id;
}

static inline bool same_shape(sadmm_shape_id a, sadmm_shape_id b)
{
    return a.slot == b.slot && a.generation == b.generation;
}

/* Bodies of all types with shapes of all types, some of several, in a heap. */
struct crowd {
    sadmm_world *world;
    struct random r;
    sadmm_mesh *ground, *field;
};

static inline void add_to_crowd(struct crowd *c, int n)
{
    static const sadmm_shape_type types[] = {SADMM_SHAPE_SPHERE,   SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX,
                                             SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE,    SADMM_SHAPE_ELLIPSOID};
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id body;
    def.type = n % 5 == 3 ? SADMM_BODY_STATIC : n % 7 == 3 ? SADMM_BODY_KINEMATIC : SADMM_BODY_DYNAMIC;
    def.mass = 1;
    for (int k = 0; k < 3; ++k) {
        def.inertia[k] = 1;
        def.position[k] = random_in(&c->r, -8, 8);
    }
    double q[4], length = 0;
    for (int k = 0; k < 4; ++k) {
        q[k] = random_in(&c->r, -1, 1);
        length += q[k] * q[k];
    }
    for (int k = 0; k < 4; ++k) def.orientation[k] = q[k] / sqrt(length);
    MUST(c->world, sadmm_world_add_body(c->world, &def, &body));
    for (int k = 0; k <= n % 3; ++k) {
        sadmm_shape_def shape = shape_of(types[(n + k) % 6], random_in(&c->r, 0.1, 0.8), random_in(&c->r, 0.1, 0.8),
                                         random_in(&c->r, 0.1, 0.8));
        shape.position[k] = random_in(&c->r, -0.5, 0.5);
        add_shape(c->world, body, &shape);
    }
}

static inline struct crowd make_crowd(int bodies, uint64_t seed)
{
    struct crowd c = {empty_world(), {seed}, soup_some_mesh(6), soup_some_mesh(7)};
    const sadmm_body_id ground = add_body(c.world, SADMM_BODY_STATIC, 0, 0, -9),
                        away = add_body(c.world, SADMM_BODY_STATIC, 1, 2, 3);
    const sadmm_shape_def plane = shape_of(SADMM_SHAPE_PLANE, 0, 0, 0);
    sadmm_shape_def mesh = shape_of(SADMM_SHAPE_MESH, 0, 0, 0);
    add_shape(c.world, ground, &plane);
    mesh.mesh = c.ground;
    add_shape(c.world, away, &mesh);
    mesh.mesh = c.field;
    mesh.position[0] = 3;
    add_shape(c.world, away, &mesh);
    for (int n = 0; n < bodies; ++n) add_to_crowd(&c, n);
    return c;
}

static inline void free_crowd(struct crowd *c)
{
    sadmm_world_destroy(c->world);
    sadmm_mesh_destroy(c->ground);
    sadmm_mesh_destroy(c->field);
}

/* A refused call: the status, and a message that holds `text`. */
static inline void expect_refused(sadmm_world *world, sadmm_status got, sadmm_status wanted, const char *text)
{
    ck_assert_msg(got == wanted, "%s for %s (message: %s)", sadmm_status_name(got), text, sadmm_world_message(world));
    ck_assert_msg(strstr(sadmm_world_message(world), text), "the message names no \"%s\": %s", text,
                  sadmm_world_message(world));
}

#endif
