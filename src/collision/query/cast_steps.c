#include "cast_steps.h"

#include <math.h>

/* Steps halve what is left, at least, where bodies graze each other; elsewhere its digits double. */
enum { MOST_STEPS = 60 };

bool sadmm_cast_go(sadmm_cast_apart *apart, const void *pair, vec3 direction, double size, double enter, double limit,
                   double *way, struct sadmm_separation *separation)
{
    double at = enter;
    for (int step = 0; step < MOST_STEPS; ++step) {
        if (!(at <= limit) || !apart(pair, at, separation)) return false;
        const double falls = v3_dot(direction, separation->normal);
        *way = at;
        if (separation->distance <= SADMM_CAST_TOUCH * (size + at)) return step > 0 || falls > SADMM_CAST_GRAZES;
        if (!(falls > 0)) return false;
        at += separation->distance / falls;
    }
    return true; /* by rounding it comes no nearer */
}

bool sadmm_cast_meets(const struct sadmm_box3 *moving, const double d[3], const struct sadmm_box3 *other, double limit,
                      double *enter)
{
    double in = 0, out = limit;
    for (int k = 0; k < 3; ++k) {
        const double near = other->lo[k] - moving->hi[k], far = other->hi[k] - moving->lo[k];
        if (fabs(d[k]) < 1e-300) {
            if (near > 0 || far < 0) return false;
            continue;
        }
        const double first = (d[k] > 0 ? near : far) / d[k], last = (d[k] > 0 ? far : near) / d[k];
        in = max_of(in, first - 8 * DBL_EPSILON * fabs(first)); /* rounding favours meeting */
        out = min_of(out, last + 8 * DBL_EPSILON * fabs(last));
    }
    *enter = in;
    return in <= out;
}
