/* Bodies thrown on a floor. */
#ifndef SADMM_TESTS_BOUNCING_H
#define SADMM_TESTS_BOUNCING_H

#include "scene_tools.h"

/* A body of one shape, with its inertia; its orientation is that of the world. */
static inline sadmm_body_id add_thrown(sadmm_world *world, sadmm_shape_type type, const double size[3],
                                       const sadmm_body_state *state, double mass, double friction,
                                       double restitution)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.mass = mass;
    if (type == SADMM_SHAPE_SPHERE) sadmm_sphere_inertia(mass, size[0], body.inertia);
    if (type == SADMM_SHAPE_CAPSULE) sadmm_capsule_inertia(mass, size[0], size[1], body.inertia);
    if (type == SADMM_SHAPE_BOX) sadmm_box_inertia(mass, size, body.inertia);
    memcpy(body.position, state->position, sizeof body.position);
    memcpy(body.linear_velocity, state->linear_velocity, sizeof body.linear_velocity);
    memcpy(body.angular_velocity, state->angular_velocity, sizeof body.angular_velocity);
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = type;
    memcpy(shape.size, size, sizeof shape.size);
    shape.friction = friction;
    shape.restitution = restitution;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

/* A box with spin, and two balls of which one comes down on the other, all with restitution; a box that lies beside
 * them, so that no step is without contacts. */
static inline void add_bouncers(sadmm_world *world, double friction)
{
    static const double size[3] = {0.1, 0.12, 0.08};
    const sadmm_body_state box = {
        .position = {0, 0, 0.2}, .linear_velocity = {0.5, 0, -2}, .angular_velocity = {8, 5, 2.4}};
    const sadmm_body_state ball = {.position = {1, 0, 0.15}, .linear_velocity = {0, 0.1, -2}};
    const sadmm_body_state above = {.position = {1.02, 0, 0.4}, .linear_velocity = {0, 0, -3}};
    const sadmm_body_state still = {.position = {0, 2, 0.08}};
    add_floor(world, friction);
    add_thrown(world, SADMM_SHAPE_BOX, size, &still, 1, friction, 0);
    add_thrown(world, SADMM_SHAPE_BOX, size, &box, 1, friction, 1);
    add_thrown(world, SADMM_SHAPE_SPHERE, size, &ball, 3, friction, 0.8);
    add_thrown(world, SADMM_SHAPE_SPHERE, size, &above, 1, friction, 0.5);
}

/* How fast the fastest body goes up, m/s. */
static inline double upward_speed(sadmm_world *world)
{
    double most = 0;
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i)
        most = fmax(most, body_state(world, body_at(world, i)).linear_velocity[2]);
    return most;
}

#endif
