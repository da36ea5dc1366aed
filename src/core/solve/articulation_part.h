/* An articulation on the host, a part: what is kept of it from call to call, and its block direct solve for given
 * contact impulses, by the formulas of core/model/articulation.h. Shared by the solve before and after the iterations
 * (articulation.h) and the dense contact solve (ncp.h). */
#ifndef SADMM_CORE_SOLVE_ARTICULATION_PART_H
#define SADMM_CORE_SOLVE_ARTICULATION_PART_H

#include "articulation_order.h"
#include "articulation_kernels.h"
#include "core/model/articulation.h"
#include "core/model/system.h"

#ifdef __cplusplus
extern "C" {
#endif

struct articulation_part {
    struct articulation_view view; /* arrays in `work` of sadmm_articulations */
    double *impulse;         /* bodies x 6, in lists of all parts: J^T lambda; */
    double *without;         /* the residual without contacts; */
    double *kept_velocity;   /* that before the iterations */
    struct articulation_tree tree;
    const struct sadmm_articulation_kernels *kernels; /* of its tree */
    bool by_tree;            /* this call's rows are solved by it; else by the sparse factor */
    bool loop;               /* its joints are more than hang it together */
    double speed;            /* that its impulses change it by; 0: it is not solved */
    bool left;               /* it is not this call's; */
    bool renewed;            /* it is, but for inertias what the last call has loaded */
    bool gives;              /* rows with bounds do, by a share of their response, while it is loaded; */
    bool gave;               /* ... did in the last solve */
    double missed;           /* m/s, rad/s: what the last exact solve has left of its rows' laws. HUGE_VAL: not known,
                                laws were changed so that they can be met, or rows are not solved */
    bool touched;            /* by a contact; */
    int32_t points;          /* by so many points */
    bool for_ncp;            /* its contacts are left to the dense contact solve: no C */
    bool loaded;             /* by its tree, without C */
    bool kept;               /* solved before the iterations: */
    uint8_t *kept_state;     /* rows; in `kept_states` */
};

struct sadmm_articulations {
    struct sadmm_articulation_order order;
    int32_t *bodies;        /* two a constraint: what the order was made for */
    size_t constraints;
    int32_t body_count;
    struct articulation_part *parts;
    bool loops;             /* a part has one */
    int32_t *part, *entry;  /* bodies: the part, -1: of none; number in it */
    double *work;           /* of all views */
    struct articulation_node *nodes; /* of all trees: bodies of parts */
    int32_t *tree_numbers;  /* node_of, joint, soft, row_of */
    struct articulation_tree_row *tree_rows; /* columns x SADMM_MAX_ROWS */
    double *impulse;        /* bodies of parts x 6; again: without contacts */
    bool kept;              /* velocities and multipliers from before the iterations are in: */
    double *kept_velocity, *kept_lambda; /* bodies of parts x 6; rows */
    uint8_t *kept_states;                /* columns x SADMM_MAX_ROWS of all parts */
};

/* Goes through the rows of a part: r, which is row `from` of the system; slots as of sadmm_articulations_solve. */
#define EACH_ARTICULATION_ROW(slots, v, r, from)                                                        \
    for (int32_t p_ = 0; p_ < (v)->s.columns; ++p_)                                                     \
        for (int32_t r = SADMM_MAX_ROWS * p_, from = (slots)[(v)->s.constraint[p_]].first,              \
                     end_ = r + (slots)[(v)->s.constraint[p_]].count;                                   \
             r < end_; ++r, ++from)

/* Rows; velocities; A, and b - A v + J^T lambda + the part's `impulse`, which has J^T lambda then. */
void sadmm_articulation_part_load(struct articulation_part *part, const struct sadmm_system *system,
                                  const struct sadmm_settings *settings, const struct sadmm_row_constraint *slots);

/* Velocities are there already. */
void sadmm_articulation_part_load_at(struct articulation_part *part, const struct sadmm_system *system,
                                     const struct sadmm_settings *settings, const struct sadmm_row_constraint *slots);

/* A part that its tree has solved, with no C: the inertias of `changed` bodies (of the system) are others now. */
void sadmm_articulation_part_renew(struct articulation_part *part, const struct sadmm_system *system,
                                   const struct sadmm_settings *settings, const uint8_t *changed);

/* The speed that its impulses change it by, once it is loaded. */
void sadmm_articulation_part_find_speed(struct articulation_part *part);

/* For G (ncp.h): the sparse factor with rows in their states; multipliers of rows inside their bounds, for what the
 * others are. again: from what they are. */
void sadmm_articulation_part_factorize(struct articulation_part *part);
void sadmm_articulation_part_solve_rows(struct articulation_part *part, bool again);

/* A part solved by its tree that was loaded before, for other impulses of contacts (bodies x 6). */
void sadmm_articulation_part_put_contacts(const struct articulation_part *part, const double *loads);

/* All of it but loading. earlier: states of a solve of this step, NULL: none. exact: hard rows are refined to rounding,
 * not only where their regularisation leaves much, and `missed` is found. Is it solved? Rows may still change their
 * states, or numbers are not finite. */
bool sadmm_articulation_part_solve(struct articulation_part *part, const uint8_t *earlier, bool exact);

/* The same by its tree, with all rows where the last solve of what is loaded has left them, but for other impulses of
 * contacts. */
bool sadmm_articulation_part_solve_on(struct articulation_part *part);

/* How a row's rate responds to its multiplier, were its bodies free: of that which responds less, twice. */
double sadmm_articulation_part_scale(const struct articulation_part *part, int32_t r);

/* Its velocities and multipliers to the system. */
void sadmm_articulation_part_store(const struct articulation_view *v, const struct sadmm_system *system,
                                   const struct sadmm_row_constraint *slots);

#ifdef __cplusplus
}
#endif
#endif
