/* What the files of the dense contact solve (ncp.h) share: its memory, and the island that is solved. */
#ifndef SADMM_CORE_SOLVE_NCP_ISLAND_H
#define SADMM_CORE_SOLVE_NCP_ISLAND_H

#include "articulation_part.h"
#include "ncp.h"
#include "ncp_dense.h"

/* Active rows at most: solved for together with the contacts, since they changed their states. */
enum { MOST_ACTIVE = 96 };

struct ncp_contact {
    int32_t pair, point;
    int32_t body[2];           /* of the island; -1: not one that is solved for */
    double e;
    double row[2][3][6], response[2][3][6]; /* J of either side: normal, tangents; A^-1 J^T, for the sparse factor */
    double given[3];           /* velocity of what is not solved for */
};

/* An active row, solved for with the contacts: r of a part of the island. */
struct ncp_active {
    int32_t part, r;
};

struct ncp_body {
    int32_t body;              /* of the system */
    bool factored;             /* they are there (sadmm_ncp_factor): */
    double factor[36], b[6];
    double velocity[6], dv[6]; /* by the impulses so far; by one of them */
};

struct sadmm_ncp {
    /* bodies of the system: island, number in it, the next one of it; islands, by their first body: */
    int32_t *label, *number, *next_body;
    int32_t *points, *first_pair; /* how many points; its pairs */
    uint8_t *kind;             /* bits of enum island_kind */
    double *error;             /* what is left, m/s; -1: not known */
    int32_t *next_pair;
    /* one island: */
    struct ncp_body *bodies;
    struct ncp_contact *contacts;
    struct ncp_law *laws;
    int32_t *parts;            /* of the articulations */
    double *numbers;           /* lambda, u, G, Newton's work; the best, twice */
    double *rows;              /* multipliers of the system's rows, the best, twice */
    int32_t *first_node;       /* (parts + 1) of trees (below); the last: of bodies without joints */
    struct ncp_passed *passed; /* of each law (ncp_tree_response.c) */
    const struct ncp_passed **passed_at; /* by node: of one law */
    int32_t *passed_counts;
    bool known;                /* the lists are of this (sub-)step, from before its iterations; then */
    double *kept;              /* velocities, multipliers of rows, impulses at that time */
    uint8_t *states;           /* SADMM_MAX_ROWS a column, of the parts one after the other: those that G is for */
};

/* Of islands: they have rows; are the iterations'; are solved; are tried after the iterations. */
enum island_kind { ISLAND_ARTICULATED = 1, ISLAND_LEFT = 2, ISLAND_SOLVED = 4, ISLAND_LATER = 8 };

/* The island that is solved. */
struct island {
    struct sadmm_ncp *d;
    struct sadmm_articulations *articulations;
    const struct sadmm_system *system;
    const struct sadmm_row_constraint *slots;
    const struct sadmm_settings *settings;
    int32_t bodies, contacts, parts, active;
    struct ncp_active active_row[MOST_ACTIVE];
    struct ncp_dense dense;
    double *best_lambda, *best_velocity, *best_rows;    /* contacts x 3; bodies x 6; the system's rows */
    double *other_lambda, *other_velocity, *other_rows; /* of another search, or nothing */
    double best, best_hard;              /* natural map, m/s, of what is solved; of contacts that do not give */
    double best_missed;                  /* what its parts have missed then (articulation_part.h) */
    bool gives;
    bool begins;                         /* states of rows are not known before their next solve */
    bool again;                          /* after the iterations */
    bool fresh;                          /* all are parts, solved by their trees for the impulses that there are */
    bool current;                        /* the best is what bodies and parts have: it is saved before that changes */
    bool moved;                          /* bodies without joints are, by then */
    double budget;                       /* multiplications left to those */
    double regularisation;               /* of contacts, a share of their response */
};

static inline struct articulation_part *part_of(const struct island *s, int32_t k)
{
    return &s->articulations->parts[s->d->parts[k]];
}

/* A column of G as its load goes to the roots: with a load's shares z along the joints on its way, and H z of each,
 *
 *     G_rc = sum z_r H z_c over the nodes that both have passed
 *
 * The columns of a law go together, a lane each. Nodes have numbers of their own in the island: those of its parts'
 * trees one after the other, then bodies without joints, which are roots. */
struct ncp_passed {
    int32_t node, free; /* directions */
    double along[6][4], response[6][4];
};

/* ncp_response.c: numbers of nodes, once the island's bodies are there; G, with rows in the states that they have. */
void sadmm_ncp_number_nodes(struct island *s);
void sadmm_ncp_find_responses(struct island *s, double *G);

/* ncp_lists.c: A's factor and b of a body of the island. */
const double *sadmm_ncp_factor(const struct island *s, int32_t number);
/* The islands of a (sub-)step. False: no memory. */
bool sadmm_ncp_make_lists(struct sadmm_ncp *d, const struct sadmm_ncp_input *input, const struct sadmm_system *system);
/* Is it one that the dense contact solve takes, and not solved yet? */
bool sadmm_ncp_takes(const struct sadmm_ncp *d, int32_t label, const struct sadmm_settings *settings);
bool sadmm_ncp_is_solved(const struct sadmm_ncp *d, int32_t body_a, int32_t body_b);
/* Before the iterations: islands without contacts whose rows the block solve has solved, and bodies without either,
 * which are given A^-1 b; whether every other one may be solved, too, with no more contacts without joints than one
 * island may have, else those come later: iterations would not be spared. */
void sadmm_ncp_choose_islands(struct sadmm_ncp *d, const struct sadmm_ncp_input *input);
/* An island's error, and what a part of it has missed. */
void sadmm_ncp_add_missed(double *error, double missed);
/* Islands without joints, when there are iterations. */
void sadmm_ncp_leave_to_iterations(struct sadmm_ncp *d, const struct sadmm_system *system);
/* After them: those that miss the tolerance. */
void sadmm_ncp_choose_later(struct sadmm_ncp *d, const struct sadmm_ncp_input *input);
/* What solved islands are is kept while the iterations go on with others, and taken back. False: no memory. */
bool sadmm_ncp_keep(struct sadmm_ncp *d, const struct sadmm_system *system);
void sadmm_ncp_take_kept(const struct sadmm_ncp *d, const struct sadmm_system *system);

#endif
