/* Every direction n bounds the depth of two convex solids from above: by how far their shadows on n overlap. The depth
 * is the least of all n, and for boxes one of fifteen reaches it: three face normals each, and the normals of nine
 * pairs of edges. Shadows are projected onto the very n that was computed, at full length: edges that are nearly
 * parallel give a rounded n, which is a direction like any other and cannot make the depth too small.
 *
 * Spheres and capsules are points and segments with a radius. Where these are apart their distance is what counts, and
 * the distance of a box from a point that moves along a segment has a slope that only grows: its zero is bisected.
 */
#include "overlap.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/math/quat.h"

/* ---- solids ---------------------------------------------------------------------------------------------------- */

struct solid solid_of_shape(const sadmm_shape_def *shape)
{
    struct solid solid = {.plane = shape->type == SADMM_SHAPE_PLANE};
    switch (shape->type) {
    case SADMM_SHAPE_SPHERE: solid.radius = shape->size[0]; break;
    case SADMM_SHAPE_CAPSULE: solid.radius = shape->size[0], solid.half[2] = shape->size[1]; break;
    case SADMM_SHAPE_BOX:
        for (int k = 0; k < 3; ++k) solid.half[k] = shape->size[k];
        break;
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_HULL:
    case SADMM_SHAPE_MESH:
    case SADMM_SHAPE_CYLINDER:
    case SADMM_SHAPE_CONE:
    case SADMM_SHAPE_ELLIPSOID:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    for (int k = 0; k < 3; ++k) solid.axes[k] = v3(k == 0, k == 1, k == 2);
    return solid;
}

void solid_place(struct solid *solid, const double position[3], const double orientation[4])
{
    const mat3 turn = q_matrix(q_load(orientation));
    solid->centre = v3_load(position);
    for (int k = 0; k < 3; ++k) solid->axes[k] = m3_mul(turn, v3(k == 0, k == 1, k == 2));
}

double solid_thickness(const struct solid *s)
{
    return s->plane ? INFINITY : 2 * (s->radius + fmin(s->half[0], fmin(s->half[1], s->half[2])));
}

/* Half the length of the shadow on a unit direction. */
static double shadow(const struct solid *s, vec3 n)
{
    double half = s->radius;
    for (int k = 0; k < 3; ++k) half += s->half[k] * fabs(v3_dot(s->axes[k], n));
    return half;
}

/* ---- pairs ----------------------------------------------------------------------------------------------------- */

static double depth_in_plane(const struct solid *plane, const struct solid *other)
{
    const vec3 up = plane->axes[2];
    return shadow(other, up) - v3_dot(v3_sub(other->centre, plane->centre), up);
}

static double overlap_along(const struct solid *a, const struct solid *b, vec3 n)
{
    return shadow(a, n) + shadow(b, n) - fabs(v3_dot(v3_sub(b->centre, a->centre), n));
}

static double depth_by_axes(const struct solid *a, const struct solid *b)
{
    double depth = INFINITY;
    for (int i = 0; i < 3; ++i) {
        depth = fmin(depth, overlap_along(a, b, a->axes[i]));
        depth = fmin(depth, overlap_along(a, b, b->axes[i]));
    }
    for (int i = 0; i < 3 && depth > 0; ++i)
        for (int j = 0; j < 3; ++j) {
            const vec3 normal = v3_cross(a->axes[i], b->axes[j]);
            const double sine = v3_norm(normal);
            /* Of parallel edges the face normals say it all. Of nearly parallel ones they miss by the angle times the
             * length of the edges: 1e-10 of it here. */
            if (sine > 1e-10) depth = fmin(depth, overlap_along(a, b, v3_scale(normal, 1 / sine)));
        }
    return depth;
}

/* From `point` to the nearest point of the box, or segment, inside of the radius. */
static vec3 way_to_core(const struct solid *s, vec3 point)
{
    const vec3 from_centre = v3_sub(point, s->centre);
    vec3 way = v3(0, 0, 0);
    for (int k = 0; k < 3; ++k) {
        const double along = v3_dot(from_centre, s->axes[k]);
        const double inside = fmax(-s->half[k], fmin(along, s->half[k]));
        way = v3_madd(way, inside - along, s->axes[k]);
    }
    return way;
}

/* Between the cores of two solids, one of them a point or a segment along its z. */
static double core_distance(const struct solid *segment, const struct solid *other)
{
    double low = -segment->half[2], high = segment->half[2];
    for (int k = 0; k < 60 && low < high; ++k) {
        const double middle = 0.5 * (low + high);
        const vec3 way = way_to_core(other, v3_madd(segment->centre, middle, segment->axes[2]));
        const double slope = -v3_dot(way, segment->axes[2]);
        if (slope <= 0) low = middle;
        if (slope >= 0) high = middle;
    }
    return v3_norm(way_to_core(other, v3_madd(segment->centre, 0.5 * (low + high), segment->axes[2])));
}

double overlap_depth(const struct solid *a, const struct solid *b)
{
    if (a->plane || b->plane) {
        if (a->plane && b->plane) return -INFINITY;
        return a->plane ? depth_in_plane(a, b) : depth_in_plane(b, a);
    }
    /* Of shapes with a radius all are segments or points. */
    const double apart = a->radius > 0 ? core_distance(a, b) : b->radius > 0 ? core_distance(b, a) : 0;
    return apart > 0 ? a->radius + b->radius - apart : depth_by_axes(a, b);
}

/* ---- sweep ----------------------------------------------------------------------------------------------------- */

struct interval {
    double low[3], high[3]; /* of the solid's bounding box */
    int solid;
};

static int compare_intervals(const void *a, const void *b)
{
    const struct interval *x = a, *y = b;
    return x->low[0] != y->low[0] ? (x->low[0] > y->low[0]) - (x->low[0] < y->low[0]) : x->solid - y->solid;
}

static struct interval bounds(const struct solid *s, int index)
{
    struct interval interval = {.solid = index};
    double centre[3];
    v3_store(s->centre, centre);
    for (int k = 0; k < 3; ++k) {
        const double half = s->plane ? INFINITY : shadow(s, v3(k == 0, k == 1, k == 2));
        interval.low[k] = centre[k] - half;
        interval.high[k] = centre[k] + half;
    }
    return interval;
}

static bool add_if_overlapping(struct overlaps *o, const struct solid *solids, int i, int j)
{
    const struct solid *a = &solids[i], *b = &solids[j];
    if (a->body == b->body || (a->fixed && b->fixed)) return true;
    const double depth = overlap_depth(a, b);
    if (!(depth > 0)) return true;
    if (!SADMM_GROW(o->pairs, o->count, o->count + 1)) return false;
    o->pairs[o->count++] = (struct overlap){i < j ? i : j, i < j ? j : i, depth};
    return true;
}

bool overlaps_find(struct overlaps *o, const struct solid *solids, int count)
{
    o->count = 0;
    if (!SADMM_GROW(o->intervals, 0, (size_t)count)) return false;
    for (int i = 0; i < count; ++i) o->intervals[i] = bounds(&solids[i], i);
    qsort(o->intervals, (size_t)count, sizeof *o->intervals, compare_intervals);
    for (int i = 0; i < count; ++i)
        for (int j = i + 1; j < count && o->intervals[j].low[0] <= o->intervals[i].high[0]; ++j) {
            const struct interval *x = &o->intervals[i], *y = &o->intervals[j];
            if (x->low[1] > y->high[1] || y->low[1] > x->high[1] || x->low[2] > y->high[2] || y->low[2] > x->high[2])
                continue;
            if (!add_if_overlapping(o, solids, x->solid, y->solid)) return false;
        }
    return true;
}

void overlaps_free(struct overlaps *o)
{
    sadmm_free(o->pairs);
    sadmm_free(o->intervals);
    *o = (struct overlaps){0};
}
