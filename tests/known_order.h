/* Motions with known answers (bench/known_motions.h) and what of them is asked of every backend. */
#ifndef TESTS_KNOWN_ORDER_H
#define TESTS_KNOWN_ORDER_H

#include "../bench/known_motions.h"
#include "scene_tools.h"

/* What is off by less than this share of a body's length has no order left: rounding, and what the solve leaves in some
 * hundred steps. */
static inline double known_floor(sadmm_precision precision) { return precision == SADMM_F64 ? 1e-6 : 1e-4; }

/* Errors of second order are a quarter at half the step. A third is allowed for: at the longer one higher powers of the
 * step count as well. */
static const double KNOWN_SHRINKS = 1.0 / 3;

/* By so many halvings of the step. */
static inline void expect_order(int kind, int number, const sadmm_world_def *def, void (*opened)(sadmm_world *world),
                                int halvings)
{
    struct known_motion m;
    struct known_result result;
    struct sadmm_error error = {SADMM_OK, ""};
    known_motion_make(kind, number, &m);
    ck_assert_msg(known_motion_run(&m, def, opened, halvings + 1, &result, &error) == SADMM_OK, "%s", error.message);
    const double first = result.error[0], last = result.error[halvings], step = m.dt / (1 << halvings);
    /* a step within which friction ends takes the mean of it: a dt^2 / 8 at most, by where in the step that is */
    const double ends = m.event_time > 0 ? m.friction * 9.81 * step * step / 4 : 0,
                 least = known_floor(def->precision) * m.scale + ends;
    const bool exact = known_motion_order(kind) == 0;
    ck_assert_msg(!exact || first <= least, "%s, number %d: %g m off", known_motion_name(kind), number, first);
    ck_assert_msg(exact || last <= least || last <= pow(KNOWN_SHRINKS, halvings) * first,
                  "%s, number %d: %g m off, and %g m by %d halvings", known_motion_name(kind), number, first, last,
                  halvings);
}

#endif
