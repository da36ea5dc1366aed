/* Fifty frozen problems of known names, from 12 to some 3,000 contacts, for `subadmm-bench profile`: built ones that
 * are hard for known reasons, and the steps of scenes whose bodies have no joints, which FCLIB files cannot hold as
 * this library has them. The same on every machine up to the rounding of the build. */
#ifndef BENCH_PROFILE_SET_H
#define BENCH_PROFILE_SET_H

#include "problem_set.h"

size_t profile_set_count(void);

/* One of them, index in [0, count); the caller frees it. quick: one of the few of a quick run. file: "pile_400_400",
 * what its file is called. Errors: those of problem_set_make and problem_set_freeze. */
sadmm_status profile_set_make(size_t index, struct set_problem *out, char file[64], struct sadmm_error *error);
const char *profile_set_name(size_t index);
bool profile_set_quick(size_t index);

#endif
