#include "ray_solid.h"

#include "collision/convex/polytope.h"

static vec3 at(const struct ray_line *line, double t) { return v3_madd(line->x, t, line->d); }

static vec3 unit(vec3 v) { return v3_scale(v, 1 / v3_norm(v)); }

/* |x + t d| <= radius for vectors x of which the parts across the line count alone. d2: d . d > 0. */
static bool span_of_ball(vec3 x, vec3 d, double d2, double radius, double *in, double *out)
{
    const double middle = -v3_dot(x, d) / d2, left = radius * radius - v3_norm2(v3_madd(x, middle, d));
    if (!(left >= 0)) return false;
    const double half = sqrt(left / d2);
    *in = middle - half;
    *out = middle + half;
    return true;
}

static bool cast_sphere(const struct ray_line *line, double radius, struct ray_span *span)
{
    if (!span_of_ball(line->x, line->d, 1, radius, &span->in, &span->out)) return false;
    span->normal = unit(at(line, span->in));
    return true;
}

/* Cut by -half <= x <= half along an axis. False: nothing is left. */
static bool cut_slab(double x, double d, double half, int axis, struct ray_span *span)
{
    if (d == 0) return fabs(x) <= half;
    const double first = ((d > 0 ? -half : half) - x) / d, last = ((d > 0 ? half : -half) - x) / d;
    if (first > span->in) {
        span->in = first;
        span->normal = v3_axis(axis, d > 0 ? -1 : 1);
    }
    span->out = last < span->out ? last : span->out;
    return span->in <= span->out;
}

static const struct ray_span whole = {-HUGE_VAL, HUGE_VAL, {0, 0, 0}};

static bool cast_box(const struct ray_line *line, const double half[3], struct ray_span *span)
{
    *span = whole;
    return cut_slab(line->x.x, line->d.x, half[0], 0, span) && cut_slab(line->x.y, line->d.y, half[1], 1, span) &&
           cut_slab(line->x.z, line->d.z, half[2], 2, span);
}

/* Cut by x^2 + y^2 <= radius^2. */
static bool cut_tube(const struct ray_line *line, double radius, struct ray_span *span)
{
    const vec3 x = v3(line->x.x, line->x.y, 0), d = v3(line->d.x, line->d.y, 0);
    const double d2 = v3_norm2(d);
    double in, out;
    if (!(d2 > 1e-200)) return v3_norm2(x) <= radius * radius;
    if (!span_of_ball(x, d, d2, radius, &in, &out)) return false;
    if (in > span->in) {
        span->in = in;
        span->normal = unit(v3_madd(x, in, d));
    }
    span->out = out < span->out ? out : span->out;
    return span->in <= span->out;
}

static bool cast_cylinder(const struct ray_line *line, double radius, double half, struct ray_span *span)
{
    *span = whole;
    return cut_tube(line, radius, span) && cut_slab(line->x.z, line->d.z, half, 2, span);
}

/* What several parts of one convex solid have of the line, together. */
static void join(const struct ray_span *part, struct ray_span *span)
{
    if (part->in < span->in) {
        span->in = part->in;
        span->normal = part->normal;
    }
    span->out = part->out > span->out ? part->out : span->out;
}
static const struct ray_span no_part = {HUGE_VAL, -HUGE_VAL, {0, 0, 0}};

/* The segment from `from` to `to` with a round of `radius`: a tube, and a ball at either end. */
static bool cast_stick(const struct ray_line *line, vec3 from, vec3 to, double radius, struct ray_span *span)
{
    const vec3 along = v3_sub(to, from);
    const double length = v3_norm(along);
    struct ray_span part;
    *span = no_part;
    for (int end = 0; end < 2; ++end) {
        const vec3 centre = end ? to : from;
        const struct ray_line own = {v3_sub(line->x, centre), line->d};
        if (cast_sphere(&own, radius, &part)) join(&part, span);
    }
    if (length > 0) {
        const vec3 z = v3_scale(along, 1 / length);
        vec3 x, y;
        v3_tangents(z, &x, &y);
        const vec3 rel = v3_sub(line->x, v3_madd(from, 0.5, along));
        const struct ray_line own = {v3(v3_dot(x, rel), v3_dot(y, rel), v3_dot(z, rel)),
                                     v3(v3_dot(x, line->d), v3_dot(y, line->d), v3_dot(z, line->d))};
        if (cast_cylinder(&own, radius, length / 2, &part)) {
            part.normal = v3_madd(v3_madd(v3_scale(z, part.normal.z), part.normal.x, x), part.normal.y, y);
            join(&part, span);
        }
    }
    return span->in <= span->out;
}

static bool cast_capsule(const struct ray_line *line, double radius, double half, struct ray_span *span)
{
    return cast_stick(line, v3(0, 0, -half), v3(0, 0, half), radius, span);
}

/* Apex at +half, base at -half. Between these heights it is where f = x^2 + y^2 - slope^2 (half - z)^2 <= 0. */
static bool cast_cone(const struct ray_line *line, double radius, double half, struct ray_span *span)
{
    const double slope = radius / (2 * half), side = sqrt(1 + slope * slope);
    *span = whole;
    if (!cut_slab(line->x.z, line->d.z, half, 2, span)) return false;
    /* f = a (t - from)^2 + 2 b (t - from) + c, from where the line is nearest to the axis */
    const vec3 d = line->d;
    const double across2 = d.x * d.x + d.y * d.y,
                 from = across2 > 1e-200 ? -(line->x.x * d.x + line->x.y * d.y) / across2 : 0,
                 start = from > span->in ? from < span->out ? from : span->out : span->in;
    const vec3 x = at(line, start);
    const double rise = slope * d.z, room = slope * (half - x.z), r2 = x.x * x.x + x.y * x.y,
                 along = x.x * d.x + x.y * d.y, beside = x.x * d.y - x.y * d.x, a = across2 - rise * rise,
                 b = along + rise * room, c = r2 - room * room,
                 /* b^2 - a c, without the difference of what is large where the cone is a needle */
        disc = across2 * room * room + rise * (2 * along * room + r2 * rise) - beside * beside;
    double in = -HUGE_VAL, out = HUGE_VAL;
    if (disc < 0) {
        if (a >= 0) return false; /* beside it; else f < 0 all along */
    } else {
        const double q = -(b + (b < 0 ? -sqrt(disc) : sqrt(disc)));
        double low = a != 0 ? q / a : b < 0 ? -HUGE_VAL : HUGE_VAL, high = q != 0 ? c / q : low;
        if (low > high) {
            const double swap = low;
            low = high;
            high = swap;
        }
        if (a > 0) {
            in = low;
            out = high;
        } else if (rise > 0) {
            /* towards the apex: this cone is what is before the first root, the one above the apex after the second */
            out = low;
        } else {
            in = high;
        }
        if (a == 0) { /* along a line of the side */
            in = b < 0 ? -c / (2 * b) : -HUGE_VAL;
            out = b > 0 ? -c / (2 * b) : HUGE_VAL;
            if (b == 0 && c > 0) return false;
        }
    }
    in += start;
    out += start;
    if (in > span->in) {
        const vec3 p = at(line, in);
        const double r = sqrt(p.x * p.x + p.y * p.y);
        span->in = in;
        span->normal = r > 0 ? v3(p.x / (r * side), p.y / (r * side), slope / side) : v3(0, 0, 1);
    }
    span->out = out < span->out ? out : span->out;
    return span->in <= span->out;
}

static bool cast_ellipsoid(const struct ray_line *line, const double size[3], struct ray_span *span)
{
    const vec3 x = v3(line->x.x / size[0], line->x.y / size[1], line->x.z / size[2]),
               d = v3(line->d.x / size[0], line->d.y / size[1], line->d.z / size[2]);
    if (!span_of_ball(x, d, v3_norm2(d), 1, &span->in, &span->out)) return false;
    const vec3 p = v3_madd(x, span->in, d);
    span->normal = unit(v3(p.x / size[0], p.y / size[1], p.z / size[2]));
    return true;
}

/* The solid between the planes of a hull's faces, `out` further out than they are. */
static bool cast_faces(const struct ray_line *line, const struct polytope *p, double out, struct ray_span *span)
{
    *span = whole;
    for (int f = 0; f < p->faces; ++f) {
        const vec3 n = polytope_normal(p, f);
        const double left = polytope_offset(p, f) + out - v3_dot(n, line->x), rate = v3_dot(n, line->d);
        if (rate < 0) {
            if (left / rate > span->in) {
                span->in = left / rate;
                span->normal = n;
            }
        } else if (rate > 0) {
            span->out = left / rate < span->out ? left / rate : span->out;
        } else if (left < 0) {
            return false;
        }
        if (!(span->in <= span->out)) return false;
    }
    return true;
}

/* Is x over the face, seen along its normal? */
static bool is_over_face(const struct polytope *p, int f, vec3 x)
{
    const vec3 n = polytope_normal(p, f);
    const int first = p->face_first[f], last = p->face_first[f + 1];
    for (int c = first; c < last; ++c) {
        const vec3 from = polytope_vertex(p, p->corner_vertex[c]),
                   to = polytope_vertex(p, p->corner_vertex[c + 1 < last ? c + 1 : first]);
        if (v3_dot(v3_cross(n, v3_sub(to, from)), v3_sub(x, from)) < 0) return false;
    }
    return true;
}

/* Its surface is faces moved outwards, and pieces of sticks around the edges. */
static bool cast_rounded(const struct ray_line *line, const struct polytope *p, struct ray_span *span)
{
    struct ray_span part;
    if (!cast_faces(line, p, p->radius, &part)) return false;
    *span = no_part;
    for (int f = 0; f < p->faces; ++f) {
        const vec3 n = polytope_normal(p, f);
        const double left = polytope_offset(p, f) + p->radius - v3_dot(n, line->x), rate = v3_dot(n, line->d);
        if (rate == 0 || !is_over_face(p, f, at(line, left / rate))) continue;
        part.in = part.out = left / rate;
        part.normal = n;
        join(&part, span);
    }
    for (int e = 0; e < p->edges; ++e)
        if (cast_stick(line, polytope_vertex(p, p->edge_vertex[2 * e]), polytope_vertex(p, p->edge_vertex[2 * e + 1]),
                       p->radius, &part))
            join(&part, span);
    return span->in <= span->out;
}

static bool cast_hull(const struct ray_line *line, const double *blocks, uint32_t place, struct ray_span *span)
{
    struct polytope p;
    polytope_at(blocks, place, &p);
    return p.radius > 0 ? cast_rounded(line, &p, span) : cast_faces(line, &p, 0, span);
}

bool sadmm_ray_span(const struct sadmm_geometry *geometry, const double *blocks, const struct ray_line *line,
                    struct ray_span *span)
{
    const double *size = geometry->size;
    switch ((sadmm_shape_type)geometry->type) {
    case SADMM_SHAPE_SPHERE: return cast_sphere(line, size[0], span);
    case SADMM_SHAPE_CAPSULE: return cast_capsule(line, size[0], size[1], span);
    case SADMM_SHAPE_BOX: return cast_box(line, size, span);
    case SADMM_SHAPE_HULL: return cast_hull(line, blocks, geometry->hull, span);
    case SADMM_SHAPE_CYLINDER: return cast_cylinder(line, size[0], size[1], span);
    case SADMM_SHAPE_CONE: return cast_cone(line, size[0], size[1], span);
    case SADMM_SHAPE_ELLIPSOID: return cast_ellipsoid(line, size, span);
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_MESH:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    return false;
}
