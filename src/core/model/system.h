/* The contact problem of one step as core and the backends share it on the host, in double.
 *
 * Bodies are the dynamic ones only, numbered 0..body_count-1; -1 is the static world. Contacts may be with kinematic
 * bodies besides (contact_set.h). There are two ways to give them:
 * `rigid` (world level: A and b follow from the state, see math/rigid.h) or `A` and `b` (problem level).
 * The certificate and every backend read the same raw data through the same inline formulas.
 */
#ifndef SADMM_CORE_MODEL_SYSTEM_H
#define SADMM_CORE_MODEL_SYSTEM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/contact_set.h"
#include "core/base/inline.h"
#include "rows.h"
#include "subadmm/problem.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A dynamic rigid body at the start of a step. */
struct sadmm_rigid {
    double position[3];     /* m, world */
    double orientation[4];  /* w x y z */
    double velocity[6];     /* m/s, rad/s, world */
    double mass;            /* kg */
    double inertia[3];      /* principal, kg m^2 */
    double wrench[6];       /* external, N, N m, world */
    double gravity_scale;   /* of the settings' gravity */
    double damping[2];      /* linear, angular, 1/s (forces.h) */
    int32_t mean;           /* it moved by the mean of its velocities before the last step and after it */
    int32_t rolls;          /* which of owed and stiffness are of account: enum rolling_kept; the others may be
                               anything */
    int32_t was_hit;        /* it was hit within the step (world/hits.c): its start is one from which the velocity that
                               it ends with takes it to where it is then, and has no trapezoid correction
                               (math/trapezoid.h) */
    int32_t reserved;
    double owed[6];         /* of the last step's contacts that rolled, N s, N m s, world (rolling.h) */
    double stiffness[6];    /* that no step resolves, N m: xx, yy, zz, xy, xz, yz, world: against rocking (rolling.h),
                               and in a step what joints give (stiffening.h) */
};

/* The changes of velocity of a body's last steps (extrapolation.h). */
struct sadmm_extrapolation {
    double change[6];  /* of the velocity in the last step */
    double dt;         /* of that step, s; 0: there was none */
    int32_t streak[2]; /* steps in a row with nearly the same acceleration: linear, angular */
    uint32_t placed;   /* how often its pose was set to another one */
    uint32_t reserved;
};

struct sadmm_team;
struct spin_system; /* spin.h */

struct sadmm_system {
    struct sadmm_team *team;         /* whose threads work on it (parallel.h); NULL: OpenMP's */
    int32_t body_count;
    const struct sadmm_rigid *rigid; /* (body_count) or NULL */
    const struct spin_system *spins; /* (body_count) spin_of_system of `rigid`, or NULL: not known yet */
    const double *A;                 /* (body_count x 36), when rigid is NULL */
    const double *b;                 /* (body_count x 6), when rigid is NULL */
    double *velocity;                /* (body_count x 6) start in, solution out */
    const double *kinematic;         /* (kinematic_count x 6) velocities of kinematic bodies, m/s, rad/s, world */
    int32_t kinematic_count;
    const double *support_motion;    /* (body_count x 6): velocities are relative to this, the motion of an island's
                                        support (world/step/kinematic.c); NULL: as they are */
    struct sadmm_contact_set *contacts;
    bool errors_given;               /* points carry e (problem level) instead of a separation */
    bool first;                      /* no step came before: where there are no impulses, none are known */
    bool uneven;                     /* masses of the world's dynamic bodies are (math/weight.h) */
    struct sadmm_rows *rows;         /* constraints given by Jacobian rows; NULL: none */
    const int32_t *islands;          /* (body_count) as sadmm_islands finds them; NULL: not known yet */
};

/* Constraints given by rows. */
static inline size_t sadmm_row_constraint_count(const struct sadmm_system *system)
{
    return system->rows ? system->rows->constraint_count : 0;
}

/* A kinematic body's velocity. */
SADMM_INLINE const double *sadmm_kinematic_velocity(const struct sadmm_system *system, int32_t body)
{
    return system->kinematic + 6 * (size_t)sadmm_kinematic(body);
}

/* Is one of the pair's bodies kinematic, and in motion? */
SADMM_INLINE bool sadmm_pair_is_kinematic(const struct sadmm_system *system, const struct sadmm_contact_pair *pair)
{
    const int32_t body = pair->body_a < pair->body_b ? pair->body_a : pair->body_b;
    if (!sadmm_body_is_kinematic(body)) return false;
    const double *v = sadmm_kinematic_velocity(system, body);
    return v[0] != 0 || v[1] != 0 || v[2] != 0 || v[3] != 0 || v[4] != 0 || v[5] != 0;
}

/* Does the pair give its island energy? A supported one sees its kinematic body at rest, unless that turns: its surface
 * moves on during the step. */
SADMM_INLINE bool sadmm_pair_gives_energy(const struct sadmm_system *system, const struct sadmm_contact_pair *pair)
{
    if (!sadmm_pair_is_kinematic(system, pair)) return false;
    if (!system->support_motion) return true;
    const double *c = system->support_motion + 6 * (size_t)(pair->body_a > pair->body_b ? pair->body_a : pair->body_b);
    const bool turns = c[3] != 0 || c[4] != 0 || c[5] != 0, goes = c[0] != 0 || c[1] != 0 || c[2] != 0;
    return turns || !goes;
}

/* Does e of the pair's points depend on how fast its bodies approach? */
SADMM_INLINE bool sadmm_pair_bounces(const struct sadmm_system *system, const struct sadmm_contact_pair *pair)
{
    return !system->errors_given && system->rigid && pair->restitution > 0;
}

#ifdef __cplusplus
}
#endif
#endif
