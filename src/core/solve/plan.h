/* The plan: what this step needs, found once from what the scene contains. Backends specialise on it. */
#ifndef SADMM_CORE_SOLVE_PLAN_H
#define SADMM_CORE_SOLVE_PLAN_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/inline.h"
#include "core/math/weight.h"
#include "core/model/system.h"

#ifdef __cplusplus
extern "C" {
#endif

struct sadmm_plan {
    int32_t bodies;         /* dynamic */
    int32_t pairs, points;  /* contacts given by geometry */
    int32_t row_constraints; /* constraints given by Jacobian rows */
    bool rows_apart;         /* they do not iterate: nothing else touches their bodies: block direct solve */
    int contact_rows;       /* rows of a geometric contact: 0 no contact, 1 every mu is 0, 3 otherwise */
    bool rigid;             /* world level: bodies are given by their state, A is (m I, world inertia) */
    bool gyroscopic;        /* some body has unequal principal moments (world level) */
    bool warm_start;        /* take the system's start values */
    bool warm;              /* PAPER: ... and most constraints have one */
    bool penalty_updates;   /* eq. (15) will run at least once */
    bool initialise;        /* FAST: impulses are initialised (impulse_initialisation.h); never in steps that a backend
                               makes alone */
    bool weight_updates;    /* FAST: weights are recomputed during the step, of islands that start cold, if any does */
    bool energy_limit;      /* FAST: energies of islands under contacts alone are limited after the last iteration */
    bool momentum;          /* islands of rigid bodies under contacts keep what momentum no static contact may change */
    bool residuals;         /* some iteration is measured */
    bool wrenches;          /* eq. (12) a body */
    bool certificate;
    int threads;            /* at most, >= 1 */
};

/* ---- rules, also for a backend that counts contacts where they are ----------------------------------------------- */

/* Rows of a geometric contact. contacts: how many there are; rough: how many of them, or of their pairs, have
 * friction. */
SADMM_INLINE int plan_contact_rows(int64_t contacts, int64_t rough) { return contacts == 0 ? 0 : rough > 0 ? 3 : 1; }

/* The same of equal worlds, of which no one's depend on another's; these are solved as if they had contacts, so that
 * bodies in the air make as many iterations whether others have some or not. */
enum { PLAN_CONTACT_ROWS_OF_COPIES = 3 };

/* Do at least half of the constraints carry an impulse? */
SADMM_INLINE bool plan_mostly_warm(int64_t constraints, int64_t warm)
{
    return constraints > 0 && 2 * warm >= constraints;
}

/* ---- the plan ---------------------------------------------------------------------------------------------------- */

/* Threads for `points` contact points: as many as have enough to do, at most `wanted` (0: any number). `team` may be
 * NULL. */
int sadmm_plan_threads(const struct sadmm_team *team, int wanted, size_t points);

/* Threads for a pass over `count` bodies, pairs or points outside the kernels: those of the plan if there is enough to
 * do. */
int sadmm_pass_threads(int threads, size_t count);

/* FAST: may islands start warm (math/weight.h)? Impulses that are initialised are cold ones. */
SADMM_INLINE bool plan_may_start_warm(const struct sadmm_plan *plan, const struct sadmm_settings *settings)
{
    return settings->warm_start && !plan->initialise;
}

/* FAST: are weights of islands that start cold updated? Steps of a world with few iterations go on from each other: the
 * loads that one does not find the next ones do, where masses are not uneven. first: no step came before. */
SADMM_INLINE bool plan_updates_weights(const struct sadmm_settings *settings, bool rigid, bool first, bool uneven)
{
    return !rigid || first || uneven || !settings->warm_start || settings->iterations >= WEIGHT_SPRING_ITERATIONS;
}

/* What follows from the settings once the counts and `contact_rows` are in. mostly_warm: at least half of the
 * constraints (contacts counted by pairs) carry an impulse; cold: some island may start cold, and has its weights
 * updated. `threads` is left alone. */
void sadmm_plan_complete(struct sadmm_plan *plan, const struct sadmm_settings *settings, bool mostly_warm, bool cold);

/* Does it decide anything in a plan with contacts whether most constraints are warm? */
bool sadmm_plan_depends_on_warmth(const struct sadmm_settings *settings);

/* Does one of the bodies have unequal principal moments? */
bool sadmm_plan_is_gyroscopic(const struct sadmm_rigid *rigid, int32_t count);

/* Do masses of bodies differ too much for loads to be found over steps? */
bool sadmm_plan_is_uneven(const struct sadmm_rigid *rigid, int32_t count);

/* Is there any constraint? */
bool sadmm_plan_is_constrained(const struct sadmm_plan *plan);

struct sadmm_plan sadmm_plan_make(const struct sadmm_system *system, const struct sadmm_settings *settings);

#ifdef __cplusplus
}
#endif
#endif
