/* Contact problems for the tests, through the public problem level. Deterministic; a failure aborts. */
#ifndef PUBLIC_PROBLEMS_H
#define PUBLIC_PROBLEMS_H

#include "subadmm/problem.h"

/* `count` boxes of 0.2 m on top of each other, one step of 5 ms under gravity that leans by `lean` rad, four contacts a
 * layer; masses alternate between 1 kg and `other` kg. */
sadmm_problem *public_problem_stack(int count, double friction, double lean, double other);

/* Bodies with full random mass matrices and velocities; random contacts between them and with the world, as geometry
 * and as blocks (with e in all three rows); welds and partial joints as hard blocks. */
sadmm_problem *public_problem_random(unsigned seed, int bodies, int contacts, int blocks, int joints, double friction);

#endif
