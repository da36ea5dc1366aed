/* How the motions of known_motions.h are drawn. */
#ifndef BENCH_KNOWN_MAKE_H
#define BENCH_KNOWN_MAKE_H

#include "known_motions.h"

/* Goes on along the motion, which may be one of several states of it, by so many seconds; *now: since its start. */
void known_motion_advance(struct known_motion *motion, double *now, double seconds);

#endif
