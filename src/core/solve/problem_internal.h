/* A problem's insides, for the tests. */
#ifndef SADMM_CORE_SOLVE_PROBLEM_INTERNAL_H
#define SADMM_CORE_SOLVE_PROBLEM_INTERNAL_H

#include "subadmm/problem.h"
#include "core/model/system.h"

/* The contacts as a solve sees them: in the order they were set, grouped into pairs. */
const struct sadmm_contact_set *sadmm_problem_contact_set(const sadmm_problem *problem);

#endif
