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

/* Balls that fall towards the middle: they hit each other within steps, and then press on each other. */
static inline void add_bouncing_balls(sadmm_world *world)
{
    static const double at[3] = {10, -20, 30};
    static const struct cluster balls = {SADMM_SHAPE_SPHERE, 125, 0.25, false};
    add_cluster(world, &balls, at);
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
        sadmm_body_state state = body_state(world, body_at(world, i));
        for (int k = 0; k < 3; ++k) state.linear_velocity[k] -= 6 * (state.position[k] - at[k]);
        MUST(world, sadmm_world_set_body_state(world, body_at(world, i), &state));
    }
    for (int32_t i = 0; i < sadmm_world_shape_count(world); ++i) {
        sadmm_shape_id id;
        MUST(world, sadmm_world_shape_at(world, i, &id));
        MUST(world, sadmm_world_set_shape_material(world, id, 0.5, 0.5));
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

/* ---- mechanisms ------------------------------------------------------------------------------------------------ */

/* Where a mechanism is: in the air, without a weight, or thrown; on a floor without friction; its first body on a joint
 * with the world. */
enum mechanism_place { MECHANISM_FLOATS, MECHANISM_FALLS, MECHANISM_ON_ICE, MECHANISM_HANGS, MECHANISM_PLACES };

static inline bool mechanism_has_weight(enum mechanism_place place)
{
    return place == MECHANISM_FALLS || place == MECHANISM_ON_ICE;
}

/* Of a mechanism: bits of what is kept. */
static inline unsigned mechanism_keeps(enum mechanism_place place, bool space)
{
    if (place == MECHANISM_HANGS) return space ? 8 | 16 | 32 : 32;
    return place == MECHANISM_ON_ICE ? 1 | 2 | 32 : 63;
}

/* A chain of boxes with three different moments, on hinges in a row or (space) on ball joints and universal ones by
 * turns, that is hit by two balls; with a motor, a spring and a limit. Not in space all of it turns about z. At the
 * default step rows turn by more than a step resolves (core/model/joint_law.h): what is not in the air keeps its
 * momentum by shorter ones. */
static inline void add_mechanism(sadmm_world *world, enum mechanism_place place, bool space, double friction)
{
    static const double half[3] = {0.1, 0.05, 0.03}, ball[3] = {0.1, 0, 0}, identity[4] = {1, 0, 0, 0};
    sadmm_body_id last = {0, 0};
    const double up = place == MECHANISM_ON_ICE ? 0.1 : 0;
    sadmm_settings settings = sadmm_world_settings(world);
    if (place == MECHANISM_ON_ICE || place == MECHANISM_HANGS) settings.dt = 0.0005;
    MUST(world, sadmm_world_set_settings(world, &settings));
    if (place == MECHANISM_ON_ICE) add_plane(world, 0);
    for (int k = 0; k < 6; ++k) {
        const bool box = k < 4;
        sadmm_body_def body = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        sadmm_body_id id;
        body.mass = box ? 1 + 0.2 * k : 5;
        if (box) sadmm_box_inertia(body.mass, half, body.inertia);
        else sadmm_sphere_inertia(body.mass, 0.1, body.inertia);
        body.position[0] = 0.11 + (box ? 0.22 * k : 0.05 + 0.5 * (k - 4));
        body.position[1] = box ? 0 : k == 4 ? -0.17 : 0.18;
        body.position[2] = up + (space && !box ? 0.02 : 0);
        body.linear_velocity[1] = box ? 0 : k == 4 ? 5 : -4;
        body.linear_velocity[0] = place == MECHANISM_FALLS ? 10 : 0;
        body.angular_velocity[2] = box ? 0 : 3;
        if (space) body.angular_velocity[0] = box ? 0 : 5;
        MUST(world, sadmm_world_add_body(world, &body, &id));
        shape.type = box ? SADMM_SHAPE_BOX : SADMM_SHAPE_SPHERE;
        shape.friction = friction;
        for (int j = 0; j < 3; ++j) shape.size[j] = box ? half[j] : ball[j];
        MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
        const sadmm_body_id from = last;
        last = id;
        if (!box || (k == 0 && place != MECHANISM_HANGS)) continue;
        sadmm_joint_def joint = sadmm_joint_def_default();
        const double at[3] = {0.22 * k, 0, up};
        joint.kind = !space ? SADMM_JOINT_REVOLUTE : k % 2 ? SADMM_JOINT_UNIVERSAL : SADMM_JOINT_SPHERICAL;
        joint.body_a = from, joint.body_b = id;
        MUST(world, sadmm_world_place_joint(world, &joint, at, identity));
        sadmm_joint_coordinate *turn = &joint.coordinates[space && k % 2 ? 3 : 5];
        if (k == 1) turn->spring_stiffness = 5, turn->spring_damping = 0.1;
        if (k == 2) turn->limited = true, turn->lower = -0.3, turn->upper = 0.2;
        if (k == 3) turn->drive = SADMM_DRIVE_SPEED, turn->target_speed = 3, turn->drive_force = 1;
        MUST(world, sadmm_world_add_joint(world, &joint, &(sadmm_joint_id){0, 0}));
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

/* Of the bodies that move, at the places of `before`, about `centre`: after the step; without `after`, what the free
 * motion has. */
static inline struct total_momentum momentum_of(sadmm_world *world, const sadmm_body_state *before,
                                                const sadmm_body_state *after, const double centre[3])
{
    const sadmm_settings settings = sadmm_world_settings(world);
    struct total_momentum sum = {{0}, 0, 0};
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
        const sadmm_body_def def = body_def(world, body_at(world, i));
        if (def.type != SADMM_BODY_DYNAMIC) continue;
        const sadmm_body_state *own = after ? &after[i] : &before[i];
        double d[3], linear[3], angular[3];
        for (int k = 0; k < 3; ++k) {
            d[k] = before[i].position[k] - centre[k];
            linear[k] = def.mass * (after ? after[i].linear_velocity[k]
                                          : before[i].linear_velocity[k] + settings.dt * settings.gravity[k]);
        }
        v3_store(rigid_angular_momentum(q_load(own->orientation), v3_load(def.inertia), v3_load(own->angular_velocity)),
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

/* Of all bodies about the world's origin, where and as fast as they are; before: and what the step's forces will
 * give. */
static inline struct total_momentum whole_momentum(sadmm_world *world, bool before)
{
    const sadmm_settings settings = sadmm_world_settings(world);
    struct total_momentum sum = {{0}, 0, 0};
    for (int32_t i = 0; i < sadmm_world_body_count(world); ++i) {
        const sadmm_body_def b = body_def(world, body_at(world, i));
        double linear[3], angular[3], weight[3] = {0}, halfway[3], none[3] = {0};
        if (b.type != SADMM_BODY_DYNAMIC) continue;
        v3_store(rigid_angular_momentum(q_load(b.orientation), v3_load(b.inertia), v3_load(b.angular_velocity)),
                 angular);
        for (int k = 0; k < 3; ++k) {
            linear[k] = b.mass * b.linear_velocity[k];
            if (before) weight[k] = b.mass * settings.dt * settings.gravity[k];
            halfway[k] = b.position[k] + settings.dt / 2 * b.linear_velocity[k];
        }
        add_momentum(&sum, b.position, linear, angular);
        add_momentum(&sum, halfway, weight, none);
    }
    return sum;
}

/* The same of a mechanism: bodies move otherwise than by the velocities at the end. hangs: what it has got in the step
 * is from the first joint, at the joint's point. */
static inline void expect_whole_momentum_kept(sadmm_world *world, unsigned kept, bool hangs, double tolerance,
                                              const char *what)
{
    struct total_momentum wanted = whole_momentum(world, true);
    step_world(world, 1);
    const struct total_momentum got = whole_momentum(world, false);
    if (hangs) {
        sadmm_joint_id id;
        sadmm_joint_state joint;
        MUST(world, sadmm_world_joint_at(world, 0, &id));
        MUST(world, sadmm_world_joint_state(world, id, &joint));
        const vec3 impulse = v3_sub(v3_load(got.number), v3_load(wanted.number));
        v3_store(v3_add(v3_load(wanted.number + 3), v3_cross(v3_load(joint.point), impulse)), wanted.number + 3);
    }
    for (int k = 0; k < 6; ++k) {
        const double scale = k < 3 ? wanted.linear_scale : wanted.angular_scale;
        ck_assert_msg(!(kept >> k & 1) || fabs(got.number[k] - wanted.number[k]) <= tolerance * scale,
                      "%s: component %d: %.17g, wanted %.17g, of %g", what, k, got.number[k], wanted.number[k], scale);
    }
}

#endif
