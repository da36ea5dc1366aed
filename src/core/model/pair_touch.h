/* What contacts say of the trapezoid corrections of bodies without joints (math/trapezoid.h), pair by pair, on the
 * host: the CPU backend's threads, and steps without a solve. In double. */
#ifndef SADMM_CORE_MODEL_PAIR_TOUCH_H
#define SADMM_CORE_MODEL_PAIR_TOUCH_H

#include <string.h>

#include "body_trapezoid.h"
#include "system_terms.h"

/* What becomes of what does not move is of no interest. */
enum { TOUCH_OF_STATIC = TOUCH_SUPPORTED | TOUCH_MOVED };

/* All is known that decides on the trapezoid correction. */
static inline bool touch_is_known(const struct trapezoid_touch *touch)
{
    return touch->island & TOUCH_PENETRATES && touch->body[0] & touch->body[1] & TOUCH_SUPPORTED;
}

/* What a pair's points touch. a, b: of its bodies, all 0 of what does not move; known: bits that are not looked for
 * again. */
static inline struct trapezoid_touch sadmm_pair_touch(const struct sadmm_system *system,
                                                      const struct sadmm_settings *settings,
                                                      const struct sadmm_contact_pair *pair,
                                                      const struct sadmm_trapezoid *a, const struct sadmm_trapezoid *b,
                                                      struct trapezoid_touch known)
{
    static const double still[6];
    const double dt = settings->dt, slop = settings->slop, *n = pair->normal;
    const double rest[2] = {a->rest, b->rest};
    struct trapezoid_touch touch = known;
    touch.island |= body_contact_touch(pair->body_a >= 0 && pair->body_b >= 0, pair->friction);
    touch.island |= a->touch | b->touch;
    if (sadmm_pair_is_kinematic(system, pair)) touch.island |= TOUCH_PENETRATES;
    for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
        const struct sadmm_contact_point *point = &system->contacts->points[k];
        const double *arm_a = point->arm_a, *arm_b = point->arm_b;
        const double size[2] = {trapezoid_size_at(a->linear, a->angular, arm_a),
                                trapezoid_size_at(b->linear, b->angular, arm_b)};
        const double moves[2] = {trapezoid_size_at(a->moves_linear, a->moves_angular, arm_a),
                                 trapezoid_size_at(b->moves_linear, b->moves_angular, arm_b)};
        trapezoid_add_push(&touch, dot3(n, point->impulse), moves, rest);
        if (trapezoid_is_still(size, dt, slop)) continue;
        if (touch_is_known(&touch)) {
            if (touch.body[0] & touch.body[1] & TOUCH_MOVED) break;
            continue;
        }
        const double *const v[2] = {pair->body_a >= 0 ? &system->velocity[6 * (size_t)pair->body_a] : still,
                                    pair->body_b >= 0 ? &system->velocity[6 * (size_t)pair->body_b] : still};
        const double *const own[2] = {a->correction, b->correction};
        const struct rolling_halfway at = rolling_halfway_of(
            n, point, sadmm_migration_of(system->contacts->points, system->contacts->migrations, k));
        double corrections[2];
        const struct trapezoid_separation separation = body_point_way(&at, point, v, own, corrections);
        trapezoid_add_way(&touch, separation, corrections, size, dt, slop);
    }
    return touch;
}

/* The correction that a body takes, in place of its own. island, own: bits of its contacts. */
static inline void sadmm_choose_trapezoid(const struct sadmm_rigid *body, const struct sadmm_settings *settings,
                                          int island, int own, struct sadmm_trapezoid *trapezoid)
{
    trapezoid->kind = body_trapezoid_kind(body, island, own);
    switch (trapezoid->kind) {
    case TRAPEZOID_OFF: memset(trapezoid->correction, 0, sizeof trapezoid->correction); break;
    case TRAPEZOID_SHARED: trapezoid_shared(settings->gravity, settings->dt, trapezoid->correction); break;
    case TRAPEZOID_OWN: break;
    }
}

#endif
