/* By which rule islands are pushed apart without a velocity, and where their bodies go by that (core/solve/push.h): for
 * the host and for backends that make whole steps. In double. */
#ifndef SADMM_MODEL_PUSH_LAW_H
#define SADMM_MODEL_PUSH_LAW_H

#include <stdint.h>

#include "core/base/contact_set.h"
#include "core/math/array3.h"
#include "core/math/contact.h"
#include "core/math/rigid.h"
#include "subadmm/settings.h"
#include "system.h"

/* ---- which worlds ------------------------------------------------------------------------------------------------ */

/* On `cuda` iterations of larger worlds, and of those with kinematic bodies, are launched one by one, where a second
 * problem takes as long as the first: they have their pushes in v. By the world's size alone, so that no partition, no
 * device and no way to drive a step changes a result; bodies: of one of equal worlds, which does not depend on how many
 * there are. */
enum { PUSH_CUDA_MOST_BODIES = 8192 };

SADMM_INLINE bool push_is_apart(bool cuda, int32_t bodies, int32_t kinematic)
{
    return !cuda || (bodies <= PUSH_CUDA_MOST_BODIES && kinematic == 0);
}

/* ---- which islands ----------------------------------------------------------------------------------------------- */

/* How fast a contact with this separation is pushed, m/s. */
SADMM_INLINE double push_speed(const struct sadmm_settings *s, double separation)
{
    const double e = contact_error(separation, s->dt, s->correction_factor, s->slop, s->correction_speed);
    return e < 0 ? -e : 0;
}

/* In the method `paper` impulses creep: velocities follow a push down by no more than 0.3 of gravity. */
#define PUSH_PAPER_SHARE 0.25

/* The least acceleration by which gravity takes back a velocity of one of the pair's bodies. gravity: its size. */
SADMM_INLINE double push_pull(const struct sadmm_rigid *rigid, const struct sadmm_contact_pair *pair, double gravity,
                              bool paper)
{
    double scale = INFINITY;
    if (pair->body_a >= 0) scale = min_of(scale, rigid[pair->body_a].gravity_scale);
    if (pair->body_b >= 0) scale = min_of(scale, rigid[pair->body_b].gravity_scale);
    return scale * gravity * (paper ? PUSH_PAPER_SHARE : 1);
}

/* What pairs say of their island: some are pushed; by more than gravity takes back; they are with what is not dynamic,
 * and with friction then, so that gravity takes velocities back at all. There are constraints given by rows. */
enum push_bit { PUSH_SOME = 1, PUSH_MORE = 2, PUSH_STANDS = 4, PUSH_RESTS = 8, PUSH_ROWS = 16 };

/* Pushes add up on the way from the ground: an island's sum of how much of gravity they take, less the pairs over which
 * such ways begin. In units of which gravity is so many: sums of whole numbers know no order. */
enum { PUSH_GRAVITY = 1 << 20 };

struct push_share {
    int32_t bits;
    int64_t units;
};

/* What a pair adds to its island. speed: of its deepest point; pull: in m/s a step, counts where there is a speed. */
SADMM_INLINE struct push_share push_share_of(const struct sadmm_contact_pair *pair, double speed,
                                             double correction_factor, double pull)
{
    struct push_share share = {0, 0};
    if (pair->body_a < 0 || pair->body_b < 0) {
        share.bits = PUSH_STANDS | (pair->friction > 0 ? PUSH_RESTS : 0);
        share.units = -PUSH_GRAVITY;
    }
    if (speed > 0) {
        const double takes = contact_push_takes(speed, correction_factor, pull);
        share.bits |= takes > 1 ? PUSH_SOME | PUSH_MORE : PUSH_SOME;
        share.units += (int64_t)(min_of(takes, 1.0) * PUSH_GRAVITY);
    }
    return share;
}

/* Pushes that gravity does not take back in any case. */
SADMM_INLINE bool push_stays(int32_t bits) { return (bits & (PUSH_SOME | PUSH_RESTS)) == PUSH_SOME; }

/* Is an island pushed, by what its pairs have said? */
SADMM_INLINE bool push_is_due(int32_t bits, int64_t units)
{
    if (bits & PUSH_ROWS || !(bits & PUSH_SOME)) return false;
    return push_stays(bits) || bits & PUSH_MORE || units > 0;
}

/* ---- the way ----------------------------------------------------------------------------------------------------- */

/* Of an island in the air. */
struct push_island {
    double mass;
    vec3 middle, turn; /* sum of m d, about a place near it; what pushes have changed the angular momentum by */
    sym3 inertia;      /* about that place */
};

/* m (|d|^2 1 - d d^T) */
SADMM_INLINE sym3 push_arm_inertia(double m, vec3 d)
{
    const sym3 out = {m * (d.y * d.y + d.z * d.z),
                      m * (d.x * d.x + d.z * d.z),
                      m * (d.x * d.x + d.y * d.y),
                      -(m * d.x * d.y),
                      -(m * d.x * d.z),
                      -(m * d.y * d.z)};
    return out;
}

/* R diag(inertia) R^T of a body where it is. */
SADMM_INLINE sym3 push_inertia(const struct sadmm_rigid *body)
{
    return rigid_world_inertia(q_matrix(q_load(body->orientation)), v3_load(body->inertia));
}

/* Moves a body by v_1 - v_0, `way`; its island gets to know, if it is in the air (else NULL). */
SADMM_INLINE void push_move_body(struct sadmm_rigid *body, const double way[6], double dt, vec3 place,
                                 struct push_island *island)
{
    const vec3 before = v3_load(body->position), after = rigid_move(before, v3_load(way), dt),
               v = v3_load(body->velocity), w = v3_load(body->velocity + 3);
    const vec3 spin = island ? s3_mul(push_inertia(body), w) : v3(0, 0, 0);
    v3_store(after, body->position);
    q_store(rigid_turn(q_load(body->orientation), v3_load(way + 3), dt), body->orientation);
    if (!island) return;
    const sym3 inertia = push_inertia(body);
    const vec3 d = v3_sub(after, place);
    island->mass += body->mass;
    island->middle = v3_madd(island->middle, body->mass, d);
    island->turn = v3_add(island->turn, v3_add(v3_cross(v3_sub(after, before), v3_scale(v, body->mass)),
                                               v3_sub(s3_mul(inertia, w), spin)));
    island->inertia = s3_add(s3_add(island->inertia, inertia), push_arm_inertia(body->mass, d));
}

/* In place of `turn` the turn about the middle that takes it back, rad/s; in place of `middle` where that is. */
SADMM_INLINE void push_find_turn(struct push_island *island)
{
    island->middle = v3_scale(island->middle, 1 / island->mass);
    const sym3 s = s3_add(island->inertia, push_arm_inertia(-island->mass, island->middle));
    const mat3 m = {{v3(s.xx, s.xy, s.xz), v3(s.xy, s.yy, s.yz), v3(s.xz, s.yz, s.zz)}};
    island->turn = v3_max_abs(island->turn) > 0 ? m3_solve(m, v3_neg(island->turn)) : v3(0, 0, 0);
}

/* A body of the island, by that. */
SADMM_INLINE void push_turn_body(const struct push_island *island, vec3 place, struct sadmm_rigid *body)
{
    const vec3 d = v3_sub(v3_sub(v3_load(body->position), place), island->middle);
    v3_store(v3_add(v3_load(body->velocity), v3_cross(island->turn, d)), body->velocity);
    v3_store(v3_add(v3_load(body->velocity + 3), island->turn), body->velocity + 3);
}

#endif
