/* Depths of many pairs, counted in bins of a 64th of an octave: a quantile is right to 0.6 per cent, whatever the
 * number of pairs. */
#ifndef BENCH_DEPTH_COUNTS_H
#define BENCH_DEPTH_COUNTS_H

#include <stdint.h>

enum { DEPTHS_PER_OCTAVE = 64, DEPTH_OCTAVES = 40 };

/* Starts zeroed. */
struct depth_counts {
    int64_t bins[DEPTHS_PER_OCTAVE * DEPTH_OCTAVES];
    int64_t count, deep; /* deep: beyond a hundredth of the thickness */
    double deepest;      /* m */
};

/* `thickness`: of the thinner of the two, m. Pairs that overlap by less than a nanometre touch, and are not counted. */
void depth_count(struct depth_counts *counts, double depth, double thickness);
/* What that share of all is not deeper than, m; `share` in (0, 1]. 0 where nothing was counted. */
double depth_quantile(const struct depth_counts *counts, double share);

#endif
