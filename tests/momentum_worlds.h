/* Worlds that keep momentum, and what they have of it before and after a step. */
#ifndef TESTS_MOMENTUM_WORLDS_H
#define TESTS_MOMENTUM_WORLDS_H

#include "core/math/rigid.h"
#include "scene_tools.h"

/* ---- worlds ---------------------------------------------------------------------------------------------------- */

static inline double random_number(uint64_t *seed) /* in [-1, 1) */
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(*seed >> 11) / 4503599627370496.0 - 1;
}

struct cluster {
    sadmm_shape_type type; /* balls of 0.1 m radius, or boxes of half as much */
    int bodies;
    double spacing; /* of a cubic lattice, m; they overlap below 0.2, 0.1 */
    bool gravity;
};

static inline void add_member(sadmm_world *world, const struct cluster *c, const double position[3],
                              const double velocity[6], double mass, double friction)
{
    const double half[3] = {0.05, 0.05, 0.05};
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.mass = mass;
    if (c->type == SADMM_SHAPE_BOX) sadmm_box_inertia(mass, half, body.inertia);
    else sadmm_sphere_inertia(mass, 0.1, body.inertia);
    for (int k = 0; k < 3; ++k) {
        body.position[k] = position[k];
        body.linear_velocity[k] = velocity[k];
        body.angular_velocity[k] = velocity[k + 3];
    }
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = c->type;
    shape.friction = friction;
    shape.size[0] = c->type == SADMM_SHAPE_BOX ? half[0] : 0.1;
    if (c->type == SADMM_SHAPE_BOX) shape.size[1] = half[1], shape.size[2] = half[2];
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
}

/* A cluster that spins, flies, and whose bodies run into each other; masses 0.5 to 1.5 kg. */
static inline void add_cluster(sadmm_world *world, const struct cluster *c, const double at[3])
{
    static const double flight[3] = {3, -2, 1}, spin[3] = {1, 5, -3};
    uint64_t seed = 7;
    const int side = (int)ceil(cbrt(c->bodies) - 1e-9);
    for (int i = 0; i < c->bodies; ++i) {
        const int place[3] = {i % side, i / side % side, i / side / side};
        double d[3], position[3], velocity[6];
        for (int k = 0; k < 3; ++k) {
            d[k] = c->spacing * (place[k] - (side - 1) / 2.0 + 0.05 * random_number(&seed));
            position[k] = at[k] + d[k];
        }
        for (int k = 0; k < 3; ++k) {
            const int u = (k + 1) % 3, w = (k + 2) % 3;
            velocity[k] = flight[k] + spin[u] * d[w] - spin[w] * d[u] + random_number(&seed);
            velocity[k + 3] = spin[k] + random_number(&seed);
        }
        add_member(world, c, position, velocity, 1 + 0.5 * random_number(&seed), 0.5);
    }
}

static inline void add_plane(sadmm_world *world, double friction)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    body.type = SADMM_BODY_STATIC;
    MUST(world, sadmm_world_add_body(world, &body, &id));
    shape.type = SADMM_SHAPE_PLANE;
    shape.friction = friction;
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
}

/* A row of boxes that touch, and five more in one place behind it, on a floor without friction. */
static inline void add_train(sadmm_world *world)
{
    static const double velocity[6] = {5, 1, 0, 0, 0, 0};
    const struct cluster boxes = {.type = SADMM_SHAPE_BOX};
    add_plane(world, 0);
    for (int i = 0; i < 15; ++i) {
        const double position[3] = {i < 10 ? 0.1 * i : -0.1 + 0.001 * (i - 10), i < 10 ? 0 : 0.001 * (i - 10), 0.05};
        add_member(world, &boxes, position, velocity, 1 + i % 3, 0);
    }
}

/* ---- momentum -------------------------------------------------------------------------------------------------- */

/* Of all bodies, about the origin of the world's coordinates moved to `centre`; scales: sums of sizes. */
struct total_momentum {
    double number[6], linear_scale, angular_scale;
};

static inline void add_momentum(struct total_momentum *sum, const double d[3], const double linear[3],
                                const double angular[3])
{
    for (int k = 0; k < 3; ++k) {
        const int u = (k + 1) % 3, w = (k + 2) % 3;
        sum->number[k] += linear[k];
        sum->number[k + 3] += angular[k] + d[u] * linear[w] - d[w] * linear[u];
    }
    sum->linear_scale += norm3(linear);
    sum->angular_scale += norm3(angular) + norm3(d) * norm3(linear);
}

/* The middle of the mass that moves. */
static inline void centre_of_mass(sadmm_world *world, const sadmm_body_state *states, double centre[3])
{
    double mass = 0, sum[3] = {0, 0, 0};
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
        const sadmm_body_def def = body_def(world, body_at(world, i));
        if (def.type != SADMM_BODY_DYNAMIC) continue;
        mass += def.mass;
        for (int k = 0; k < 3; ++k) sum[k] += def.mass * states[i].position[k];
    }
    for (int k = 0; k < 3; ++k) centre[k] = sum[k] / mass;
}

/* A v of the bodies that move, with inertia and place of `before`. Without `after`: b, what the free motion has. */
static inline struct total_momentum momentum_of(sadmm_world *world, const sadmm_body_state *before,
                                                const sadmm_body_state *after, const double centre[3])
{
    const sadmm_settings settings = sadmm_world_settings(world);
    struct total_momentum sum = {{0}, 0, 0};
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
        const sadmm_body_def def = body_def(world, body_at(world, i));
        if (def.type != SADMM_BODY_DYNAMIC) continue;
        const quat q = q_load(before[i].orientation);
        double d[3], linear[3], angular[3];
        for (int k = 0; k < 3; ++k) {
            d[k] = before[i].position[k] - centre[k];
            linear[k] = def.mass * (after ? after[i].linear_velocity[k]
                                          : before[i].linear_velocity[k] + settings.dt * settings.gravity[k]);
        }
        if (after)
            v3_store(s3_mul(rigid_world_inertia(q_matrix(q), v3_load(def.inertia)), v3_load(after[i].angular_velocity)),
                     angular);
        else
            v3_store(rigid_angular_momentum(q, v3_load(def.inertia), v3_load(before[i].angular_velocity), settings.dt),
                     angular);
        add_momentum(&sum, d, linear, angular);
    }
    return sum;
}

/* Each body's velocity is rounded by epsilon, and so is b; sums of hundreds of them by some more. */
static inline double momentum_tolerance(sadmm_precision precision) { return precision == SADMM_F64 ? 1e-12 : 1e-6; }

enum { ALL_MOMENTUM = 63, ON_ICE = 1 | 2 | 32 }; /* on a floor: along it, and turning on it */

/* A step; components of the momentum are kept, of `kept` bits. In the air about the centre of mass, wherever the step
 * moves the bodies to: those that overlap are moved by more than their velocities. On ice where they were. */
static inline void expect_momentum_kept(sadmm_world *world, unsigned kept, double tolerance, const char *what)
{
    sadmm_body_state *before = all_states(world), *after;
    double centre[2][3];
    step_world(world, 1);
    after = all_states(world);
    const sadmm_body_state *places = kept == ALL_MOMENTUM ? after : before;
    centre_of_mass(world, before, centre[0]);
    centre_of_mass(world, places, centre[1]);
    const struct total_momentum wanted = momentum_of(world, before, NULL, centre[0]),
                                got = momentum_of(world, places, after, centre[1]);
    for (int k = 0; k < 6; ++k) {
        const double scale = k < 3 ? wanted.linear_scale : wanted.angular_scale;
        ck_assert_msg(!(kept >> k & 1) || fabs(got.number[k] - wanted.number[k]) <= tolerance * scale,
                      "%s: component %d: %.17g, wanted %.17g, of %g", what, k, got.number[k], wanted.number[k], scale);
    }
    free(before);
    free(after);
}

#endif
