/* How far a step moves a body. Semi-implicit Euler, x + dt v, is ahead of a constant acceleration by half of the step's
 * change of velocity: its lead. Taken back,
 *
 *     x <- x + dt (v - lead),     lead = (v - v before the step) / 2
 *
 * is exact for constant forces: gravity, friction that slides, rolling down a slope. But contacts bound v so that gaps
 * are right after x + dt v. Where taking leads back would close a contact of an island beyond that, all of its bodies
 * keep theirs, since those that hold on to each other would slip else; but for bodies that fly
 * (docs/internals/algorithm.md, "Positions"). Double in every precision. */
#ifndef SADMM_MATH_LEAD_H
#define SADMM_MATH_LEAD_H

#include <stdbool.h>

#include "core/base/contact_set.h"
#include "array3.h"
#include "max.h"

/* What touches an island, bits; then what touches a body of it. */
enum {
    TOUCH_INNER = 1,    /* contacts between its bodies */
    TOUCH_SMOOTH = 2,   /* static ones without friction */
    TOUCH_FRICTION = 4, /* with friction */
    TOUCH_JOLT = 8,     /* a contact that taking back leads would close beyond what v does */
    TOUCH_CARRIED = 16, /* contacts that press on it, or that it might close by itself */
    TOUCH_MOVED = 32,   /* where it touches, it does not rest */
    TOUCH_DIFFERS = 64, /* of the island again: a body of it has gravity or damping of its own (model/forces.h) */
    TOUCH_ROLLS = 128   /* of the body: a contact of it migrates (model/rolling.h); only where that is looked up */
};

enum lead_kind {
    LEAD_STAYS,  /* semi-implicit Euler */
    LEAD_SHARED, /* gravity's alone is taken back: bodies have it in common, so that their angular momentum stays */
    LEAD_OWN
};

SADMM_INLINE enum lead_kind lead_kind_of(int island, int body)
{
    if (island & TOUCH_INNER && !(island & TOUCH_FRICTION)) {
        if (!(island & (TOUCH_SMOOTH | TOUCH_DIFFERS))) return LEAD_SHARED;
        /* forces alone move a body that nothing presses on, and by its own lead it keeps its angular momentum */
        return island & TOUCH_SMOOTH || body & TOUCH_CARRIED ? LEAD_STAYS : LEAD_OWN;
    }
    if (!(body & TOUCH_CARRIED)) return LEAD_OWN;
    return island & TOUCH_JOLT || !(body & TOUCH_MOVED) ? LEAD_STAYS : LEAD_OWN;
}

SADMM_INLINE void lead_shared(const double gravity[3], double dt, double lead[6])
{
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        lead[k] = dt / 2 * gravity[k];
        lead[k + 3] = 0;
    }
}

SADMM_INLINE void lead_own(const double before[6], const double v[6], double lead[6])
{
    SADMM_UNROLL
    for (int k = 0; k < 6; ++k) lead[k] = (v[k] - before[k]) / 2;
}

/* Of the velocity that v gives the point at `arm`, the part along n. */
SADMM_INLINE double lead_along(const double n[3], const double v[6], const double arm[3])
{
    double x[3] = {v[0], v[1], v[2]};
    add_cross(v + 3, arm, 1, x);
    return dot3(n, x);
}

/* No less than the speed at which a velocity, or a lead, moves the point; linear, angular: size3 of its parts. */
SADMM_INLINE double lead_size_at(double linear, double angular, const double arm[3])
{
    return linear + angular * size3(arm);
}
SADMM_INLINE double lead_size(const double lead[6], const double arm[3])
{
    return lead_size_at(size3(lead), size3(lead + 3), arm);
}
/* The same of the velocities before the step and after, whichever is more; part 0: linear, 1: angular. */
SADMM_INLINE double lead_speed_part(const double before[6], const double v[6], int part)
{
    return max_of(size3(before + 3 * part), size3(v + 3 * part));
}
SADMM_INLINE double lead_speed(const double before[6], const double v[6], const double arm[3])
{
    return lead_size_at(lead_speed_part(before, v, 0), lead_speed_part(before, v, 1), arm);
}

/* Taking leads back may close a contact by this share of what they move it by in all, since the normal part of a lead
 * grows with the square of the speed where a body rolls, or of the slop, which is what a solve that was cut short
 * jitters by. Of what goes by more than its point's arm in a step it is this share of the arm: a bullet would be taken
 * through a plate. */
#define LEAD_SHARE 0.05
#define LEAD_SLOP  0.1
/* Where a round surface pressed in the last step, nothing lands: its lead closes it by what its normal turns. This share
 * it may, so that a body that rolls goes on by means after a step in which it did not. */
#define LEAD_ROLLS 0.5
/* A body that is carried and moves its points by less than this share of what it would gain in a step by itself rests.
 * Contacts that are solved in part are springs, on which it sways; a mean of two velocities would let that grow, for it
 * does not show the contacts what they corrected by. */
#define LEAD_LEAST 0.1

/* That speed, m/s; scale: of gravity, force: on the body, N. */
SADMM_INLINE double lead_rest_speed(const double gravity[3], double scale, const double force[3], double mass,
                                    double dt)
{
    double free[3];
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) free[k] = scale * gravity[k] + force[k] / mass;
    return LEAD_LEAST * dt * size3(free);
}

/* Bits of an island, and of the two bodies, a and b. */
struct lead_touch {
    int island, body[2];
};

/* Of a contact point and a body, by its normal impulse, the body's speed there (lead_speed), and what that is at rest
 * (lead_rest_speed). */
SADMM_INLINE int lead_push(double push, double moves, double rest)
{
    return (push > 0 ? TOUCH_CARRIED : 0) | (moves > rest ? TOUCH_MOVED : 0);
}
SADMM_INLINE void lead_add_push(struct lead_touch *touch, double push, const double moves[2], const double rest[2])
{
    SADMM_UNROLL
    for (int s = 0; s < 2; ++s) touch->body[s] |= lead_push(push, moves[s], rest[s]);
}

/* Leads of these sizes close nothing worth a look: bodies at rest, say. */
SADMM_INLINE bool lead_is_still(const double size[2], double dt, double slop)
{
    return dt * (size[0] + size[1]) <= LEAD_SLOP * slop / 2;
}

/* A contact as the step moves it: its gap at the start, m, the speed at which it opens, m/s, and the lengths of its
 * arms on a and b (size3), m. */
struct lead_gap {
    double start, speed, arm[2];
    uint32_t migrates; /* enum contact_migrates: it may stay as deep as it is (model/rolling.h) */
};

/* Of a point whose leads are not still, and what the leads of a and b add to its speed. Each of two bodies may close
 * half of what is left, whatever the other one does. */
SADMM_INLINE void lead_add_way(struct lead_touch *touch, struct lead_gap gap, const double lead[2],
                               const double size[2], double dt, double slop)
{
    const double way = (dt * size[0] < gap.arm[0] ? dt * size[0] : gap.arm[0]) +
                       (dt * size[1] < gap.arm[1] ? dt * size[1] : gap.arm[1]),
                 share = gap.migrates >= MIGRATES_SOON ? LEAD_ROLLS : LEAD_SHARE, end = gap.start + dt * gap.speed,
                 deep = gap.migrates != MIGRATES_NOT && gap.start < 0 ? -gap.start : 0,
                 room = (end > -deep ? end + deep : 0) + max_of(share * way, LEAD_SLOP * slop);
    if (dt * (lead[0] + lead[1]) > room) touch->island |= TOUCH_JOLT;
    SADMM_UNROLL
    for (int s = 0; s < 2; ++s)
        if (dt * lead[s] > room / 2) touch->body[s] |= TOUCH_CARRIED;
}

/* Both. */
SADMM_INLINE void lead_add_point(struct lead_touch *touch, struct lead_gap gap, double push, const double lead[2],
                                 const double size[2], const double moves[2], const double rest[2], double dt,
                                 double slop)
{
    lead_add_push(touch, push, moves, rest);
    if (!lead_is_still(size, dt, slop)) lead_add_way(touch, gap, lead, size, dt, slop);
}

#endif
