/* How far a step moves a body. Semi-implicit Euler, x + dt v, is ahead of a constant acceleration by half of the step's
 * change of velocity: its trapezoid correction. Taken back,
 *
 *     x <- x + dt (v - trapezoid correction),     trapezoid correction = (v - v before the step) / 2
 *
 * is exact for constant forces: gravity, friction that slides, rolling down a slope. But contacts bound v so that
 * separations are right after x + dt v. Where taking leads back would close a contact of an island beyond that, all of
 * its bodies keep theirs, since those that hold on to each other would slip else; but for bodies that fly
 * (docs/internals/algorithm.md, "Positions"). Double in every precision. */
#ifndef SADMM_MATH_TRAPEZOID_H
#define SADMM_MATH_TRAPEZOID_H

#include <stdbool.h>

#include "core/base/contact_set.h"
#include "array3.h"
#include "max.h"

/* What touches an island, bits; then what touches a body of it. */
enum {
    TOUCH_INNER = 1,      /* contacts between its bodies */
    TOUCH_SMOOTH = 2,     /* static ones without friction */
    TOUCH_FRICTION = 4,   /* with friction */
    TOUCH_PENETRATES = 8, /* the trapezoid correction would make a contact penetrate */
    TOUCH_SUPPORTED = 16, /* contacts that press on it, or that it might close by itself */
    TOUCH_MOVED = 32,     /* where it touches, it does not rest */
    TOUCH_DIFFERS = 64,   /* of the island again: a body of it has gravity or damping of its own (model/forces.h) */
    TOUCH_ROLLS = 128     /* of the body: a contact of it migrates (model/rolling.h); only where that is looked up */
};

enum trapezoid_kind {
    TRAPEZOID_OFF,    /* semi-implicit Euler */
    TRAPEZOID_SHARED, /* of gravity alone, which bodies have in common, so that their angular momentum stays */
    TRAPEZOID_OWN
};

SADMM_INLINE enum trapezoid_kind trapezoid_kind_of(int island, int body)
{
    if (island & TOUCH_INNER && !(island & TOUCH_FRICTION)) {
        if (!(island & (TOUCH_SMOOTH | TOUCH_DIFFERS))) return TRAPEZOID_SHARED;
        /* forces alone move a body that nothing presses on, and with its own correction it keeps its angular
         * momentum */
        return island & TOUCH_SMOOTH || body & TOUCH_SUPPORTED ? TRAPEZOID_OFF : TRAPEZOID_OWN;
    }
    if (!(body & TOUCH_SUPPORTED)) return TRAPEZOID_OWN;
    return island & TOUCH_PENETRATES || !(body & TOUCH_MOVED) ? TRAPEZOID_OFF : TRAPEZOID_OWN;
}

SADMM_INLINE void trapezoid_shared(const double gravity[3], double dt, double correction[6])
{
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) {
        correction[k] = dt / 2 * gravity[k];
        correction[k + 3] = 0;
    }
}

SADMM_INLINE void trapezoid_own(const double before[6], const double v[6], double correction[6])
{
    SADMM_UNROLL
    for (int k = 0; k < 6; ++k) correction[k] = (v[k] - before[k]) / 2;
}

/* Of the velocity that v gives the point at `arm`, the part along n. */
SADMM_INLINE double trapezoid_along(const double n[3], const double v[6], const double arm[3])
{
    double x[3] = {v[0], v[1], v[2]};
    add_cross(v + 3, arm, 1, x);
    return dot3(n, x);
}

/* No less than the speed at which a velocity, or a correction, moves the point; linear, angular: size3 of its parts. */
SADMM_INLINE double trapezoid_size_at(double linear, double angular, const double arm[3])
{
    return linear + angular * size3(arm);
}
SADMM_INLINE double trapezoid_size(const double correction[6], const double arm[3])
{
    return trapezoid_size_at(size3(correction), size3(correction + 3), arm);
}
/* The same of the velocities before the step and after, whichever is more; part 0: linear, 1: angular. */
SADMM_INLINE double trapezoid_speed_part(const double before[6], const double v[6], int part)
{
    return max_of(size3(before + 3 * part), size3(v + 3 * part));
}
SADMM_INLINE double trapezoid_speed(const double before[6], const double v[6], const double arm[3])
{
    return trapezoid_size_at(trapezoid_speed_part(before, v, 0), trapezoid_speed_part(before, v, 1), arm);
}

/* Trapezoid corrections may close a contact by this share of what they move it by in all, since the normal part of a
 * correction grows with the square of the speed where a body rolls; or of the slop, by which a solve that was cut short
 * jitters. Where a point moves by more than its arm in a step, the share is of the arm: a bullet would go through a
 * plate otherwise. */
#define TRAPEZOID_SHARE 0.05 /* measured: bench/constants.py, standing motion */
#define TRAPEZOID_SLOP  0.1 /* measured: bench/constants.py, standing motion */
/* Where a round surface pressed in the last step, nothing lands: the correction closes the contact by what its normal
 * turns. It may do so by this share, so that a rolling body takes the correction again after a step without it. */
#define TRAPEZOID_ROLLS 0.5 /* measured: bench/constants.py, standing motion */
/* A supported body rests if its points move by less than this share of the speed that it would gain in a step by
 * itself. Partly solved contacts are springs, on which it sways; the trapezoidal rule would let that grow, since it
 * hides from the contacts what they corrected by. */
#define TRAPEZOID_LEAST 0.1 /* measured: bench/constants.py, standing motion */

/* That speed, m/s; scale: of gravity, force: on the body, N. */
SADMM_INLINE double trapezoid_rest_speed(const double gravity[3], double scale, const double force[3], double mass,
                                         double dt)
{
    double free[3];
    SADMM_UNROLL
    for (int k = 0; k < 3; ++k) free[k] = scale * gravity[k] + force[k] / mass;
    return TRAPEZOID_LEAST * dt * size3(free);
}

/* Bits of an island, and of the two bodies, a and b. */
struct trapezoid_touch {
    int island, body[2];
};

/* Of a contact point and a body, by its normal impulse, the body's speed there (trapezoid_speed), and what that is at
 * rest (trapezoid_rest_speed). */
SADMM_INLINE int trapezoid_push(double push, double moves, double rest)
{
    return (push > 0 ? TOUCH_SUPPORTED : 0) | (moves > rest ? TOUCH_MOVED : 0);
}
SADMM_INLINE void trapezoid_add_push(struct trapezoid_touch *touch, double push, const double moves[2],
                                     const double rest[2])
{
    SADMM_UNROLL
    for (int s = 0; s < 2; ++s) touch->body[s] |= trapezoid_push(push, moves[s], rest[s]);
}

/* Corrections of these sizes are too small to close a contact: those of bodies at rest, for example. */
SADMM_INLINE bool trapezoid_is_still(const double size[2], double dt, double slop)
{
    return dt * (size[0] + size[1]) <= TRAPEZOID_SLOP * slop / 2;
}

/* A contact as the step moves it: its separation at the start, m, the speed at which it opens, m/s, and the lengths of
 * its arms on a and b (size3), m. */
struct trapezoid_separation {
    double start, speed, arm[2];
    uint32_t migrates; /* enum contact_migrates: it may stay as deep as it is (model/rolling.h) */
};

/* Of a point whose corrections are not still: what those of a and b add to its speed. Each of the two bodies may close
 * half of the room that is left, whatever the other one does. */
SADMM_INLINE void trapezoid_add_way(struct trapezoid_touch *touch, struct trapezoid_separation separation,
                                    const double correction[2], const double size[2], double dt, double slop)
{
    const double way = (dt * size[0] < separation.arm[0] ? dt * size[0] : separation.arm[0]) +
                       (dt * size[1] < separation.arm[1] ? dt * size[1] : separation.arm[1]),
                 share = separation.migrates >= MIGRATES_SOON ? TRAPEZOID_ROLLS : TRAPEZOID_SHARE,
                 end = separation.start + dt * separation.speed,
                 deep = separation.migrates != MIGRATES_NOT && separation.start < 0 ? -separation.start : 0,
                 room = (end > -deep ? end + deep : 0) + max_of(share * way, TRAPEZOID_SLOP * slop);
    if (dt * (correction[0] + correction[1]) > room) touch->island |= TOUCH_PENETRATES;
    SADMM_UNROLL
    for (int s = 0; s < 2; ++s)
        if (dt * correction[s] > room / 2) touch->body[s] |= TOUCH_SUPPORTED;
}

/* Both. */
SADMM_INLINE void trapezoid_add_point(struct trapezoid_touch *touch, struct trapezoid_separation separation,
                                      double push, const double correction[2], const double size[2],
                                      const double moves[2], const double rest[2], double dt, double slop)
{
    trapezoid_add_push(touch, push, moves, rest);
    if (!trapezoid_is_still(size, dt, slop)) trapezoid_add_way(touch, separation, correction, size, dt, slop);
}

#endif
