/* What is locked, closed at the end of a step (docs/internals/algorithm.md, "Closing"): the errors that turning bodies
 * leave joints with are of third order in the step, and where bodies turn by much of a radian in one they are a good
 * part of a link. Bodies are then moved by the least displacement, weighed by the step's inertia, that takes the errors
 * away. In double. */
#ifndef SADMM_CORE_MODEL_JOINT_CLOSE_H
#define SADMM_CORE_MODEL_JOINT_CLOSE_H

#include "joint_law.h"

/* A joint is closed once it is off by more than this share of its bodies' arms and radii of gyration, or rad. */
#define JOINT_CLOSE_FROM 5e-4 /* measured: bench/constants.py, mechanisms motion */
/* Where a loop folds: what is off by e there lets its bodies turn by the root of e. */
#define JOINT_CLOSE_FOLDING 1e-8
/* By so many Newton steps at most. */
enum { JOINT_CLOSE_STEPS = 8 };

SADMM_INLINE bool joint_turns_little(const struct joint_end *a, const struct joint_end *b, uint32_t locks)
{
    const double most = JOINT_CLOSE_FROM / 4; /* of half an angle, and with room */
    const int locked = joint_locked_rotations(locks), odd = joint_odd_rotation(locks);
    vec3 part;
    if (locked == 0) return true;
    if (locked == 1)
        return fabs(v3_dot(m3_column(q_matrix(a->orientation), (odd + 1) % 3),
                           m3_column(q_matrix(b->orientation), (odd + 2) % 3))) < most;
    const quat relative = q_mul(q_conjugate(a->orientation), b->orientation);
    part = v3(odd == 0 ? 0 : relative.x, odd == 1 ? 0 : relative.y, odd == 2 ? 0 : relative.z);
    return v3_norm2(part) < most * most;
}

/* How far the locks of a joint's translations are off, m. */
SADMM_INLINE double joint_opening(const sadmm_joint_def *def, const struct joint_end end[2])
{
    const vec3 way = v3_sub(end[1].point, end[0].point);
    double off = 0;
    int k;
    if (joint_is_radial(def->kind)) return def->locks & 1 ? fabs(v3_norm(way) - def->length) : 0;
    if (!(def->locks & 7)) return 0;
    const mat3 frame = q_matrix(end[0].orientation);
    for (k = 0; k < 3; ++k)
        if (def->locks >> k & 1) off = max_of(off, fabs(v3_dot(m3_column(frame, k), way)));
    return off;
}

/* Do the arms of its bodies that move, whose scale is more than that, say that all of it is little? off: as above. */
SADMM_INLINE bool joint_opens_little(const sadmm_joint_def *def, const struct joint_end end[2], const bool moves[2],
                                     double off)
{
    const double arms2 = (moves[0] ? v3_norm2(end[0].arm) : 0) + (moves[1] ? v3_norm2(end[1].arm) : 0);
    return off * off <= JOINT_CLOSE_FROM * JOINT_CLOSE_FROM * arms2 && joint_turns_little(&end[0], &end[1], def->locks);
}

/* Is a pose in which a loop may fold within so many steps? There a row says what others say, and near it the root of
 * what is left of it grows as the way to that pose. was, now: articulation_left of the row in the last step and in this
 * one. Rows that say the same in any pose (a plane mechanism of hinges) are left with what their errors make, 1e-6 at
 * most. Within two steps rows of ten windows at 12.5 ms are seen too late once in 10 s, and lose a third of their
 * energy. */
#define JOINT_FOLDS_WITHIN  3
#define JOINT_SAYS_THE_SAME 1e-6

SADMM_INLINE bool joint_row_folds(double was, double now)
{
    return was > 0 && now > 0 && max_of(was, now) > JOINT_SAYS_THE_SAME &&
           sqrt(now) < JOINT_FOLDS_WITHIN * fabs(sqrt(now) - sqrt(was));
}

/* A joint as its bodies' poses have it: locks in order. */
struct joint_closing {
    struct joint_geometry geometry;
    int count, coordinate[JOINT_COORDINATES];
    double error[JOINT_COORDINATES]; /* m, rad: that are to be taken away */
    double share;                    /* the largest one, over its scale */
};

/* What is left of an error that a step begins with: joints that were made apart are drawn together at the speed of
 * corrections. */
SADMM_INLINE double joint_closing_left(double error, double dt, double most)
{
    const double left = fabs(error) - dt * most;
    return left > 0 ? copysign(left, error) : 0;
}

/* Of a body, to the scale of its joint's errors; NULL: it does not move. */
SADMM_INLINE double joint_closing_scale(vec3 arm, const struct sadmm_rigid *body)
{
    return body ? v3_norm(arm) + sqrt(v3_max_abs(v3_load(body->inertia)) / body->mass) : 0;
}

/* Its errors: c->geometry as the poses have it; before: values as the step began; scale: of both bodies. A distance is
 * an arm, too. */
SADMM_INLINE void joint_closing_errors(const sadmm_joint_def *def, const double before[JOINT_COORDINATES], double scale,
                                       const struct sadmm_settings *settings, struct joint_closing *c)
{
    const int radial = joint_is_radial(def->kind);
    int k;
    c->count = 0;
    c->share = 0;
    if (radial) scale += def->length;
    for (k = 0; k < JOINT_COORDINATES; ++k) {
        const double rest = k == 0 && radial ? def->length : 0;
        double error;
        if (!(def->locks >> k & 1)) continue;
        error = c->geometry.value[k] - rest -
                joint_closing_left(before[k] - rest, settings->dt, settings->correction_speed);
        c->share = max_of(c->share, fabs(error) / (k < 3 ? scale : 1));
        c->coordinate[c->count] = k;
        c->error[c->count++] = error;
    }
}

/* start: as the step began. */
SADMM_INLINE struct joint_closing joint_closing_of(const sadmm_joint_def *def, const struct joint_end start[2],
                                                   const struct joint_end end[2], double scale,
                                                   const struct sadmm_settings *settings)
{
    const int radial = joint_is_radial(def->kind);
    const struct joint_geometry before = joint_geometry_of(&start[0], &start[1], def->locks, radial);
    struct joint_closing c;
    c.geometry = joint_geometry_of(&end[0], &end[1], def->locks, radial);
    joint_closing_errors(def, before.value, scale, settings, &c);
    return c;
}

/* The row of lock i on a side. */
SADMM_INLINE void joint_closing_row(const struct joint_closing *c, int i, int s, double row[6])
{
    vec3 linear, angular;
    const double sign = s ? 1 : -1;
    joint_row(&c->geometry, c->coordinate[i], s ? c->geometry.arm_b : c->geometry.arm_a, &linear, &angular);
    v3_store(v3_scale(linear, sign), row);
    v3_store(v3_scale(angular, sign), row + 3);
}

/* A body's pose, moved by a displacement. */
SADMM_INLINE void joint_close_move(const double by[6], double position[3], double orientation[4])
{
    v3_store(rigid_move(v3_load(position), v3_load(by), 1), position);
    q_store(rigid_turn(q_load(orientation), v3_load(by + 3), 1), orientation);
}

/* ---- what it costs ----------------------------------------------------------------------------------------------- */

/* Twice the energy of a body's motion, J; */
SADMM_INLINE double joint_motion_energy2(const struct sadmm_rigid *body, const double orientation[4],
                                         const double velocity[6])
{
    const vec3 spin = v3_load(velocity + 3);
    return body->mass * dot3(velocity, velocity) +
           v3_dot(spin, rigid_angular_momentum(q_load(orientation), v3_load(body->inertia), spin));
}

/* and of that with its energy in the field of gravity. */
SADMM_INLINE double joint_energy2(const struct sadmm_rigid *body, const double position[3], const double orientation[4],
                                  const double velocity[6], const struct sadmm_settings *settings)
{
    double energy = joint_motion_energy2(body, orientation, velocity);
    int k;
    for (k = 0; k < 3; ++k) energy -= 2 * body->mass * forces_gravity(body, settings->gravity, k) * position[k];
    return energy;
}

/* What closing has lifted, motion pays: what is left of the velocities of an island to which it gave twice the energy
 * `gained`, and whose motion has twice the energy `moving`. */
SADMM_INLINE double joint_closing_keep(double gained, double moving)
{
    return !(gained > 0) ? 1 : gained < moving ? sqrt(1 - gained / moving) : 0;
}

#endif
