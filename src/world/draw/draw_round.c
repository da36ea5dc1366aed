/* Round shapes: outlines turned about z, an ellipsoid a ball that is stretched. An outline goes from the lowest point
 * of the axis to the highest. */
#include <math.h>

#include "draw_shapes.h"

struct outline {
    const struct sadmm_geometry *geometry;
    int32_t n;   /* segments of a circle, a multiple of 4 */
    int32_t last; /* index of its last point */
    vec3 stretch;
};

/* (cos, sin) of k turns of a circle's n, exact where it crosses an axis. */
static void circle(int32_t k, int32_t n, double *c, double *s)
{
    static const double pi = 3.14159265358979323846;
    const int32_t quarter = (k % n + n) % n / (n / 4);
    const double angle = 2 * pi * ((k % n + n) % n - quarter * (n / 4)) / n, x = cos(angle), y = sin(angle);
    *c = quarter == 0 ? x : quarter == 1 ? -y : quarter == 2 ? -x : y;
    *s = quarter == 0 ? y : quarter == 1 ? x : quarter == 2 ? -y : -x;
}

static struct outline outline_of(const struct sadmm_geometry *geometry, int32_t n)
{
    const double *size = geometry->size;
    struct outline o = {geometry, n, n / 2, {1, 1, 1}};
    if (geometry->type == SADMM_SHAPE_SPHERE) o.stretch = v3(size[0], size[0], size[0]);
    if (geometry->type == SADMM_SHAPE_ELLIPSOID) o.stretch = v3_load(size);
    if (geometry->type == SADMM_SHAPE_CAPSULE) o.last = n / 2 + 1;
    if (geometry->type == SADMM_SHAPE_CYLINDER) o.last = 3;
    if (geometry->type == SADMM_SHAPE_CONE) o.last = 2;
    return o;
}

/* Distance from the axis and height of a point of it. */
static void point_of(const struct outline *o, int32_t i, double *r, double *z)
{
    const double *size = o->geometry->size;
    const bool upper = o->geometry->type == SADMM_SHAPE_CAPSULE && i > o->n / 4; /* of its two equators */
    if (o->geometry->type == SADMM_SHAPE_CYLINDER || o->geometry->type == SADMM_SHAPE_CONE) {
        *r = i == 0 || i == o->last ? 0 : size[0];
        *z = i < 2 ? -size[1] : size[1];
        return;
    }
    circle((upper ? i - 1 : i) - o->n / 4, o->n, r, z);
    if (o->geometry->type != SADMM_SHAPE_CAPSULE) return;
    *r *= size[0];
    *z = *z * size[0] + (upper ? size[1] : -size[1]);
}

/* The k-th point of the ring that it turns to. */
static vec3 turned(const struct outline *o, int32_t i, int32_t k)
{
    double r, z, c, s;
    point_of(o, i, &r, &z);
    circle(k, o->n, &c, &s);
    return v3(o->stretch.x * r * c, o->stretch.y * r * s, o->stretch.z * z);
}

void sadmm_draw_round_faces(const struct sadmm_pen *pen, const struct sadmm_geometry *geometry)
{
    const struct outline o = outline_of(geometry, pen->draw->segments);
    for (int32_t i = 0; i < o.last; ++i)
        for (int32_t k = 0; k < o.n; ++k) {
            const vec3 low = turned(&o, i, k), next_low = turned(&o, i, k + 1), high = turned(&o, i + 1, k),
                       next_high = turned(&o, i + 1, k + 1);
            if (i > 0) pen_triangle(pen, low, next_low, i + 1 < o.last ? next_high : high);
            if (i + 1 < o.last) pen_triangle(pen, low, next_high, high);
        }
}

/* Does a ring of edges go round at this point of the outline? */
static bool has_ring(const struct outline *o, int32_t i)
{
    const int type = o->geometry->type;
    if (type == SADMM_SHAPE_CYLINDER || type == SADMM_SHAPE_CONE) return i > 0 && i < o->last;
    return i == o->n / 4 || (type == SADMM_SHAPE_CAPSULE && i == o->n / 4 + 1);
}

void sadmm_draw_round_edges(const struct sadmm_pen *pen, const struct sadmm_geometry *geometry)
{
    const struct outline o = outline_of(geometry, pen->draw->segments);
    for (int32_t i = 0; i <= o.last; ++i) {
        for (int32_t k = 0; has_ring(&o, i) && k < o.n; ++k) pen_line(pen, turned(&o, i, k), turned(&o, i, k + 1));
        for (int32_t k = 0; i < o.last && k < o.n; k += o.n / 4)
            pen_line(pen, turned(&o, i, k), turned(&o, i + 1, k));
    }
}
