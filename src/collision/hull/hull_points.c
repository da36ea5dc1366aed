#include "hull_points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/math/vec3.h"

static int compare(const void *a, const void *b)
{
    const struct hull_point *p = (const struct hull_point *)a, *q = (const struct hull_point *)b;
    for (int k = 0; k < 3; ++k)
        if (p->x[k] != q->x[k]) return p->x[k] < q->x[k] ? -1 : 1;
    return (p->number > q->number) - (p->number < q->number);
}

static bool same(const struct hull_point *p, const struct hull_point *q)
{
    return p->x[0] == q->x[0] && p->x[1] == q->x[1] && p->x[2] == q->x[2];
}

/* The middle of the box around the points, and its largest side. */
static void measure(struct hull_points *points, const double *given, size_t count)
{
    points->extent = 0;
    for (int k = 0; k < 3; ++k) {
        double low = given[k], high = given[k];
        for (size_t i = 1; i < count; ++i) {
            low = fmin(low, given[3 * i + (size_t)k]);
            high = fmax(high, given[3 * i + (size_t)k]);
        }
        points->middle[k] = low + (high - low) / 2;
        points->extent = fmax(points->extent, high - low);
    }
}

sadmm_status sadmm_hull_points_sort(struct hull_points *points, const double *given, size_t count,
                                    struct sadmm_error *error)
{
    int32_t distinct = 0;
    points->count = 0;
    points->at = (struct hull_point *)sadmm_alloc(count, sizeof *points->at);
    if (!points->at) return sadmm_fail_memory(error, "the points of a hull");
    measure(points, given, count);
    for (size_t i = 0; i < count; ++i) {
        for (int k = 0; k < 3; ++k) points->at[i].x[k] = given[3 * i + (size_t)k] - points->middle[k];
        points->at[i].number = (int32_t)i;
    }
    qsort(points->at, count, sizeof *points->at, compare);
    for (size_t i = 0; i < count; ++i)
        if (i == 0 || !same(&points->at[i], &points->at[distinct - 1])) points->at[distinct++] = points->at[i];
    points->count = distinct;
    return SADMM_OK;
}

void sadmm_hull_points_free(struct hull_points *points)
{
    sadmm_free(points->at);
    points->at = NULL;
}

/* The largest distance of a point from `from`, from the line through it along `axis` (unit), or from the plane through
 * it square to `axis`; *far: whose it is. */
enum distance { FROM_POINT, FROM_LINE, FROM_PLANE };

static double farthest(const struct hull_points *points, vec3 from, vec3 axis, enum distance kind, int32_t *far)
{
    double most = -1;
    for (int32_t i = 0; i < points->count; ++i) {
        const vec3 d = v3_sub(v3_load(points->at[i].x), from);
        const double distance = kind == FROM_POINT  ? v3_norm(d)
                                : kind == FROM_LINE ? v3_norm(v3_cross(axis, d))
                                                    : fabs(v3_dot(axis, d));
        if (distance > most) {
            most = distance;
            *far = i;
        }
    }
    return most;
}

sadmm_status sadmm_hull_points_check(struct hull_points *points, double share, double least,
                                     struct sadmm_error *error)
{
    static const char *const what[] = {"one point", "a line", "a plane"};
    const double thin = fmax(share * points->extent, least);
    const vec3 first = v3_load(points->at[0].x); /* a corner of the hull: the first by x */
    vec3 along = v3(0, 0, 0);
    for (int kind = FROM_POINT; kind <= FROM_PLANE; ++kind) {
        int32_t far = 0;
        const double distance = farthest(points, first, along, (enum distance)kind, &far);
        if (!(distance > thin))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                              "def->points lie within %g m of %s: must reach farther than %g m, the larger of %g of "
                              "their extent of %g m and %g m",
                              distance, what[kind], thin, share, points->extent, least);
        points->thickness = distance;
        const vec3 d = v3_sub(v3_load(points->at[far].x), first);
        along = kind == FROM_POINT ? d : v3_cross(along, d);
        along = v3_scale(along, 1 / v3_norm(along));
    }
    return SADMM_OK;
}
