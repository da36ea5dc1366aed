/* Contact problems for the tests, built by hand: no world, no collision detection. Deterministic. */
#ifndef CONTACT_PROBLEMS_H
#define CONTACT_PROBLEMS_H

#include "core/solve/plan.h"
#include "core/model/system.h"

/* Owns what its `system` points to. Bodies are rigid and contacts have separations until contact_problem_raw() is
 * called. */
struct contact_problem {
    struct sadmm_system system;
    struct sadmm_contact_set contacts;
    struct sadmm_rigid *rigid;
    double *A, *b;
    sadmm_problem_block *blocks;
    double *block_lambda; /* (blocks x 6) */
    int32_t block_count;
    struct sadmm_rows rows; /* what the blocks mean, once contact_problem_rows() has said so */
};

struct contact_problem *contact_problem_new(void);
void contact_problem_free(struct contact_problem *problem);
/* With rows from the blocks as they are. */
struct contact_problem *contact_problem_copy(const struct contact_problem *problem);
/* The system's rows from the blocks as they are: before anything reads the system. */
void contact_problem_rows(struct contact_problem *problem);

/* A solid box; returns its index. */
int32_t contact_problem_box(struct contact_problem *problem, double mass, double hx, double hy, double hz, double x,
                            double y, double z);
/* A contact at a world point; joins the last pair when bodies, normal, friction and restitution are the same. */
void contact_problem_touch(struct contact_problem *problem, int32_t a, int32_t b, const double at[3],
                           const double normal[3], double separation, double friction, double restitution);
/* A zeroed block to fill; valid until the next call. */
sadmm_problem_block *contact_problem_block(struct contact_problem *problem, sadmm_block_kind kind, int32_t rows,
                                           int32_t a, int32_t b);
/* Give A, b and e instead of rigid bodies and separations. `coupling` > 0 mixes linear and angular parts of A,
 * relatively. */
void contact_problem_raw(struct contact_problem *problem, const sadmm_settings *settings, double coupling);
/* Random start values. */
void contact_problem_warm(struct contact_problem *problem, double speed, double impulse);

/* Deterministic uniform numbers in [-1, 1). */
double contact_problem_random(void);
void contact_problem_seed(uint64_t seed);

/* Boxes of 0.2 m on top of each other on the ground, four contacts each. */
struct contact_problem *contact_problem_stack(const double *masses, int count, double friction);
/* `rows` rows of 1 kg boxes, 2.2 half widths apart. */
struct contact_problem *contact_problem_pyramid(int rows, double friction);
/* 10 kg plates on four 50 g cubes each, tilted by the direction of gravity the caller chooses. */
struct contact_problem *contact_problem_plates(int layers, double friction);
/* Rotated, spinning bodies with contacts (separations, penetration, restitution), general contacts, welds and joints
 * with free rows, soft rows, a body on its own, and blocks to the static world on either side. */
struct contact_problem *contact_problem_mixed(uint64_t seed, double friction);

#endif
