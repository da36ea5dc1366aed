#include "depth_counts.h"

#include <math.h>

static const double least_depth = 1e-9; /* m */
static const double deep = 0.01;        /* of the thickness */

void depth_count(struct depth_counts *c, double depth, double thickness)
{
    if (!(depth >= least_depth)) return;
    const double octaves = fmin(log2(depth / least_depth), DEPTH_OCTAVES);
    const int bin = (int)(octaves * DEPTHS_PER_OCTAVE), last = DEPTHS_PER_OCTAVE * DEPTH_OCTAVES - 1;
    ++c->bins[bin < last ? bin : last];
    ++c->count;
    c->deep += depth > deep * thickness;
    c->deepest = fmax(c->deepest, depth);
}

double depth_quantile(const struct depth_counts *c, double share)
{
    const int64_t rank = (int64_t)ceil(share * (double)c->count);
    int64_t below = 0;
    int bin = 0;
    if (c->count == 0) return 0;
    while ((below += c->bins[bin]) < rank) ++bin;
    return fmin(c->deepest, least_depth * exp2((bin + 0.5) / DEPTHS_PER_OCTAVE));
}
