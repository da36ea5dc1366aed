/* A spring whose force is a table: straight lines between points (position, load), going on by the end slopes, the
 * load being what holds the spring there. In a step it is a line, with up to two bounds, that is right where the step
 * begins, so that forces at rest are exact. Which line depends on the way that the step is predicted to go, from q_0
 * to y:
 *
 *   resolved   slope s = 2/L^2 times the integral of T - T(q_0) over the way's length L, through (q_0, T(q_0)): the
 *              spring's work along the way to second order, kinks included
 *   stiff      (joint_late) the line of the steepest part of the way, bounded by the loads at those ends of the way
 *              that are not on it: a way over one kink is exact, however steep, and whatever the way really is
 *
 * y goes on from the rate before by what the spring's own load changes, taken at the step's end, against the row's own
 * response: it solves A y + B T(y) = C, which has one solution where T does not fall. */
#ifndef SADMM_MATH_JOINT_TABLE_H
#define SADMM_MATH_JOINT_TABLE_H

#include <float.h>
#include <math.h>

#include "core/base/inline.h"

struct joint_table {
    const double *position, *load; /* positions strictly increasing */
    int count;                     /* 2 or more */
};

SADMM_INLINE int joint_table_segment(const struct joint_table *t, double q)
{
    int i = 0;
    while (i < t->count - 2 && q >= t->position[i + 1]) ++i;
    return i;
}

SADMM_INLINE double joint_table_slope(const struct joint_table *t, int segment)
{
    return (t->load[segment + 1] - t->load[segment]) / (t->position[segment + 1] - t->position[segment]);
}

SADMM_INLINE double joint_table_load(const struct joint_table *t, double q)
{
    const int i = joint_table_segment(t, q);
    return t->load[i] + joint_table_slope(t, i) * (q - t->position[i]);
}

struct joint_table_way {
    double length;     /* y - q_0 */
    double mean;       /* s where it is resolved */
    double rise;       /* of the load */
    double steepest;   /* slope on the way, at least 0 */
    double steep_length, steep_rise; /* from q_0 to where that begins */
    int points, steep_points;        /* passed: on the way, and until there */
};

/* From q_0 to the first y with A y + B T(y) = C, A > 0, B >= 0. Where the end slope falls so fast that there is none:
 * to the last point on the way there. */
SADMM_INLINE struct joint_table_way joint_table_go(const struct joint_table *t, double from, double A, double B,
                                                   double C)
{
    struct joint_table_way way;
    double residual = C - A * from - B * joint_table_load(t, from), at = from, area = 0, step;
    const int ahead = residual > 0;
    int i = joint_table_segment(t, from), last;
    way.rise = way.steepest = way.steep_length = way.steep_rise = way.points = way.steep_points = 0;
    do {
        const double slope = joint_table_slope(t, i), under = A + B * slope;
        double to_point;
        last = ahead ? i >= t->count - 2 : i <= 0;
        to_point = last ? 0 : t->position[ahead ? i + 1 : i] - at;
        step = under > 0 ? residual / under : to_point;
        if (!last && (under <= 0 || fabs(step) > fabs(to_point))) step = to_point;
        else last = 1;
        if (slope > way.steepest) {
            way.steepest = slope;
            way.steep_length = at - from, way.steep_rise = way.rise;
            way.steep_points = way.points;
        }
        area += step * (way.rise + slope * step / 2);
        way.rise += slope * step;
        residual -= under * step;
        at += step;
        way.mean = slope; /* the mean of a way of no length */
        way.points += !last;
        i += ahead ? 1 : -1;
    } while (!last);
    way.length = at - from;
    if (way.length * way.length > DBL_MIN) way.mean = 2 * area / (way.length * way.length);
    return way;
}

/* load + slope (q - at), between `least` and `most`, loads at a place each. */
struct joint_table_bound {
    int given;
    double at, load;
};
struct joint_table_line {
    double at, load, slope;
    struct joint_table_bound least, most;
};

SADMM_INLINE struct joint_table_line joint_table_line_of(const struct joint_table *t, double from,
                                                         const struct joint_table_way *way, int stiff)
{
    const int rises = stiff && way->rise * way->length >= 0;
    struct joint_table_line line;
    struct joint_table_bound near, far;
    near.at = line.at = from;
    near.load = line.load = joint_table_load(t, from);
    far.at = from + way->length, far.load = near.load + way->rise;
    near.given = rises && way->steep_points > 0;
    far.given = rises && way->steep_points < way->points;
    line.slope = way->mean;
    if (stiff) line.at += way->steep_length, line.load += way->steep_rise, line.slope = way->steepest;
    line.least = way->length > 0 ? near : far;
    line.most = way->length > 0 ? far : near;
    return line;
}

#endif
