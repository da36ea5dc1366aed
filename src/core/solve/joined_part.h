/* A part of joined bodies on the host: what is known of it from call to call, and its direct solve for given contact
 * impulses, by the formulas of core/model/joined.h. Shared by the solve before and after the iterations (joined.h) and
 * by that of contacts (direct.h). */
#ifndef SADMM_CORE_SOLVE_JOINED_PART_H
#define SADMM_CORE_SOLVE_JOINED_PART_H

#include "core/model/joined.h"
#include "core/model/system.h"
#include "joined_order.h"

#ifdef __cplusplus
extern "C" {
#endif

struct joined_part {
    struct joined_view view; /* arrays in `work` of sadmm_joined */
    double *impulse;         /* bodies x 6, in lists of all parts: J^T lambda; */
    double *kept_velocity;   /* that before the iterations */
    bool loop;               /* its joints are more than hang it together */
    double speed;            /* that its impulses change it by; 0: it is not solved */
    bool left;               /* it is not this call's */
    bool touched;            /* by a contact */
    bool kept;               /* solved before the iterations: */
    uint8_t *kept_state;     /* rows; in `kept_states` */
};

struct sadmm_joined {
    struct sadmm_joined_order order;
    int32_t *bodies;        /* two a constraint: what the order was made for */
    size_t constraints;
    int32_t body_count;
    struct joined_part *parts;
    bool loops;             /* a part has one */
    int32_t *part, *entry;  /* bodies: the part, -1: not joined; number in it */
    double *work;           /* of all views */
    double *impulse;        /* joined bodies x 6 */
    bool kept;              /* velocities and multipliers from before the iterations are in: */
    double *kept_velocity, *kept_lambda; /* joined bodies x 6; rows */
    uint8_t *kept_states;                /* places x JOINED_ROWS of all parts */
    size_t bodies_capacity, part_capacity, entry_capacity, parts_capacity, work_capacity, impulse_capacity,
        kept_velocity_capacity, kept_lambda_capacity, kept_states_capacity;
};

/* Goes through the rows of a part: r, which is row `from` of the system; slots as of sadmm_joined_solve. */
#define EACH_JOINED_ROW(slots, v, r, from)                                                              \
    for (int32_t p_ = 0; p_ < (v)->s.places; ++p_)                                                      \
        for (int32_t r = JOINED_ROWS * p_, from = (slots)[(v)->s.constraint[p_]].first,                 \
                     end_ = r + (slots)[(v)->s.constraint[p_]].count;                                   \
             r < end_; ++r, ++from)

/* Rows; velocities; A, and b - A v + J^T lambda + the part's `impulse`; the speed that its impulses change it by. */
void sadmm_joined_part_load(struct joined_part *part, const struct sadmm_system *system,
                            const struct sadmm_settings *settings, const struct sadmm_row_constraint *slots);

/* The factors of the bodies' A + C, and what is missing by them: the free change. */
void sadmm_joined_part_free(const struct joined_view *v);

/* Where rows are before the first pass. earlier: states of a solve of this step; NULL: none. */
void sadmm_joined_part_begin_rows(const struct joined_view *v, const uint8_t *earlier);

/* Rows that left their bounds, or are held there against their law: did any change its state? */
bool sadmm_joined_part_change_rows(const struct joined_view *v);

void sadmm_joined_part_factorize(const struct joined_view *v);

/* Multipliers of rows inside their bounds, for what the others are. again: from what they are. */
void sadmm_joined_part_solve_rows(const struct joined_view *v, bool again);

/* All of it but loading. exact: what hard rows give by is taken back to rounding, not only where it is much. Is it
 * solved? Rows may not have settled, or numbers are not finite. */
bool sadmm_joined_part_solve(const struct joined_view *v, const uint8_t *earlier, bool exact);

/* Its velocities and multipliers to the system. */
void sadmm_joined_part_store(const struct joined_view *v, const struct sadmm_system *system,
                             const struct sadmm_row_constraint *slots);

#ifdef __cplusplus
}
#endif
#endif
