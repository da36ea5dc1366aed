/* Bodies that roll and rock, with what is known of them; for tests of the backends. */
#ifndef TESTS_ROLLING_WORLDS_H
#define TESTS_ROLLING_WORLDS_H

#include <math.h>
#include <string.h>

#include "scene_tools.h"

/* ---- a ball that rocks ------------------------------------------------------------------------------------------- */

/* A round body of 1 kg and 0.1 m on a plane, its centre of mass 50 mm off its middle, let go 0.5 rad off. */
enum { ROLL_SPHERE, ROLL_CAPSULE, ROLL_CYLINDER, ROLL_ELLIPSOID, ROLL_SHAPES };
#define ROLL_RADIUS  0.1
#define ROLL_OFF     0.05
#define ROLL_INERTIA (0.4 * ROLL_RADIUS * ROLL_RADIUS)

static inline sadmm_shape_def rolling_shape(int kind, double friction)
{
    static const sadmm_shape_type types[ROLL_SHAPES] = {SADMM_SHAPE_SPHERE, SADMM_SHAPE_CAPSULE, SADMM_SHAPE_CYLINDER,
                                                        SADMM_SHAPE_ELLIPSOID};
    sadmm_shape_def shape = sadmm_shape_def_default();
    shape.type = types[kind];
    shape.friction = friction;
    shape.position[2] = ROLL_OFF;
    for (int k = 0; k < 3; ++k) shape.size[k] = ROLL_RADIUS;
    if (kind == ROLL_CAPSULE || kind == ROLL_CYLINDER) { /* along y */
        shape.size[1] = 0.05;
        shape.orientation[0] = shape.orientation[1] = sqrt(0.5);
    }
    return shape;
}

static inline sadmm_body_id add_rocking_ball(sadmm_world *world, int kind, double friction)
{
    const double tilt = 0.5;
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.type = SADMM_BODY_STATIC;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = SADMM_SHAPE_PLANE;
    shape.friction = friction;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    body = sadmm_body_def_default();
    body.mass = 1;
    for (int k = 0; k < 3; ++k) body.inertia[k] = ROLL_INERTIA;
    body.orientation[0] = cos(tilt / 2), body.orientation[2] = sin(tilt / 2);
    body.position[0] = -ROLL_OFF * sin(tilt), body.position[2] = ROLL_RADIUS - ROLL_OFF * cos(tilt);
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape = rolling_shape(kind, friction);
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

/* Its energy above that of rest, J. */
static inline double rocking_energy(sadmm_world *world, sadmm_body_id id)
{
    const sadmm_body_state s = body_state(world, id);
    double energy = 9.81 * (s.position[2] - (ROLL_RADIUS - ROLL_OFF));
    for (int k = 0; k < 3; ++k)
        energy += (s.linear_velocity[k] * s.linear_velocity[k] +
                   ROLL_INERTIA * s.angular_velocity[k] * s.angular_velocity[k]) /
                  2;
    return energy;
}

/* What is left of the energy after so many seconds; *most: the largest share on the way. */
static inline double rock(sadmm_world *world, int kind, double friction, double seconds, double *most)
{
    const sadmm_settings settings = sadmm_world_settings(world);
    const sadmm_body_id id = add_rocking_ball(world, kind, friction);
    const double start = rocking_energy(world, id);
    double energy = start;
    *most = 1;
    for (int k = 0; k < (int)lround(seconds / settings.dt); ++k) {
        step_world(world, 1);
        energy = rocking_energy(world, id);
        *most = fmax(*most, energy / start);
    }
    return energy / start;
}

/* ---- a flat lens ------------------------------------------------------------------------------------------------- */

/* An ellipsoid, a wide and c high, that lies on the ground, tilted by 1 mrad. It rolls on a radius of a^2 / c. */
static inline sadmm_body_id add_lens(sadmm_world *world, double a, double c)
{
    const double mass = 1000 * 4.0 / 3 * acos(-1) * a * a * c, tilt = 1e-3;
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.type = SADMM_BODY_STATIC;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = SADMM_SHAPE_BOX;
    for (int k = 0; k < 3; ++k) shape.size[k] = 20 * a;
    shape.position[2] = -20 * a;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    body = sadmm_body_def_default();
    body.mass = mass;
    body.inertia[0] = body.inertia[1] = mass * (a * a + c * c) / 5;
    body.inertia[2] = mass * 2 * a * a / 5;
    body.position[0] = 3 * a, body.position[1] = -2 * a;
    body.position[2] = hypot(a * sin(tilt), c * cos(tilt));
    body.orientation[0] = cos(tilt / 2), body.orientation[2] = sin(tilt / 2);
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape = sadmm_shape_def_default();
    shape.type = SADMM_SHAPE_ELLIPSOID;
    shape.size[0] = shape.size[1] = a, shape.size[2] = c;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

static inline double lens_frequency(double a, double c)
{
    return sqrt(9.81 * (a * a / c - c) / ((a * a + c * c) / 5 + c * c));
}

#endif
