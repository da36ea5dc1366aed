/* Convex hulls. With a convex radius the surface is that of the polyhedron moved out: its faces along their normals,
 * between two of them a strip about the edge, around a vertex a patch of a ball. A strip goes along the arc between its
 * faces' normals; a patch is made of one sector an edge that leaves the vertex, from the mean of the normals there to
 * that arc. So all of them share their corners, and the surface is closed. */
#include <math.h>

#include "collision/convex/polytope.h"
#include "draw_shapes.h"

/* An edge as a face goes along it. */
struct edge {
    int32_t from, to;
    vec3 own, other; /* normals of the face, and of that across the edge */
};

/* The face across the edge that leaves a corner of a face. */
static int32_t across(const struct polytope *p, int32_t face, int32_t corner)
{
    const uint16_t *faces = p->edge_face + 2 * p->corner_edge[corner];
    return faces[0] == face ? faces[1] : faces[0];
}

static int32_t next_corner(const struct polytope *p, int32_t face, int32_t corner)
{
    return corner + 1 < p->face_first[face + 1] ? corner + 1 : p->face_first[face];
}

static struct edge edge_of(const struct polytope *p, int32_t face, int32_t corner)
{
    return (struct edge){p->corner_vertex[corner], p->corner_vertex[next_corner(p, face, corner)],
                         polytope_normal(p, face), polytope_normal(p, across(p, face, corner))};
}

/* On to the next face around a corner's vertex. */
static void go_around(const struct polytope *p, int32_t *face, int32_t *corner)
{
    const uint16_t vertex = p->corner_vertex[*corner];
    *face = across(p, *face, *corner);
    *corner = p->face_first[*face];
    while (p->corner_vertex[*corner] != vertex) ++*corner;
}

/* The mean of the normals around a corner's vertex, the same to the bit from any of its faces: the sum begins with the
 * lowest. */
static vec3 middle_of(const struct polytope *p, int32_t face, int32_t corner)
{
    int32_t f = face, c = corner, first = face, at = corner;
    do {
        if (f < first) first = f, at = c;
        go_around(p, &f, &c);
    } while (f != face);
    vec3 sum = v3(0, 0, 0);
    f = first, c = at;
    do {
        sum = v3_add(sum, polytope_normal(p, f));
        go_around(p, &f, &c);
    } while (f != first);
    return v3_scale(sum, 1 / v3_norm(sum));
}

static double angle_between(vec3 a, vec3 b) { return atan2(v3_norm(v3_cross(a, b)), v3_dot(a, b)); }

/* A share of the way from one unit vector to another, along the arc; its ends exactly. */
static vec3 between(vec3 a, vec3 b, int32_t k, int32_t of)
{
    const double angle = angle_between(a, b), t = (double)k / of;
    if (k == 0 || k == of) return k == 0 ? a : b;
    if (angle < 1e-6) return v3_madd(v3_scale(a, 1 - t), t, b); /* of unit length to 1e-12 */
    return v3_madd(v3_scale(a, sin((1 - t) * angle) / sin(angle)), sin(t * angle) / sin(angle), b);
}

/* The same of the arc between an edge's normals, to the bit from either of its faces. */
static vec3 along(const struct edge *edge, int32_t k, int32_t of)
{
    return edge->from < edge->to ? between(edge->own, edge->other, k, of)
                                 : between(edge->other, edge->own, of - k, of);
}

/* Steps of an arc, none longer than a segment of a circle. */
static int32_t steps_of(const struct sadmm_pen *pen, const struct edge *edge)
{
    static const double pi = 3.14159265358979323846;
    const double steps = ceil(angle_between(edge->own, edge->other) * pen->draw->segments / (2 * pi) - 1e-9);
    return steps > 1 ? (int32_t)steps : 1;
}

static void draw_strip(const struct sadmm_pen *pen, const struct polytope *p, const struct edge *edge)
{
    const int32_t steps = steps_of(pen, edge);
    const vec3 a = polytope_vertex(p, edge->from), b = polytope_vertex(p, edge->to);
    for (int32_t k = 0; k < steps; ++k) {
        const vec3 left = along(edge, k, steps), right = along(edge, k + 1, steps), normal = v3_add(left, right);
        const vec3 corner = v3_madd(a, p->radius, left), opposite = v3_madd(b, p->radius, right);
        pen_facet(pen, corner, v3_madd(a, p->radius, right), opposite, normal);
        pen_facet(pen, corner, opposite, v3_madd(b, p->radius, left), normal);
    }
}

/* Of the patch of the vertex that the edge leaves, whose middle is `middle`. */
static void draw_sector(const struct sadmm_pen *pen, const struct polytope *p, const struct edge *edge, vec3 middle)
{
    const int32_t steps = steps_of(pen, edge), rows = pen->draw->segments / 4;
    const vec3 at = polytope_vertex(p, edge->from);
    for (int32_t k = 0; k < steps; ++k) {
        const vec3 left = along(edge, k, steps), right = along(edge, k + 1, steps);
        for (int32_t i = 0; i < rows; ++i) {
            const vec3 low_left = between(middle, left, i, rows), low_right = between(middle, right, i, rows),
                       high_left = between(middle, left, i + 1, rows), high_right = between(middle, right, i + 1, rows),
                       normal = v3_add(v3_add(low_left, low_right), v3_add(high_left, high_right));
            const vec3 corner = v3_madd(at, p->radius, low_left), opposite = v3_madd(at, p->radius, high_right);
            pen_facet(pen, corner, opposite, v3_madd(at, p->radius, high_left), normal);
            if (i > 0) pen_facet(pen, corner, v3_madd(at, p->radius, low_right), opposite, normal);
        }
    }
}

void sadmm_draw_hull_faces(const struct sadmm_pen *pen, const double *block)
{
    struct polytope p;
    polytope_at(block, 0, &p);
    for (int32_t f = 0; pen->draw->triangle && f < p.faces; ++f) {
        const int32_t begin = p.face_first[f], end = p.face_first[f + 1];
        const vec3 normal = polytope_normal(&p, f), out = v3_scale(normal, p.radius);
        for (int32_t c = begin + 2; c < end; ++c)
            pen_facet(pen, v3_add(polytope_vertex(&p, p.corner_vertex[begin]), out),
                      v3_add(polytope_vertex(&p, p.corner_vertex[c - 1]), out),
                      v3_add(polytope_vertex(&p, p.corner_vertex[c]), out), normal);
        for (int32_t c = begin; p.radius > 0 && c < end; ++c) {
            const struct edge edge = edge_of(&p, f, c);
            if (edge.from < edge.to) draw_strip(pen, &p, &edge);
            draw_sector(pen, &p, &edge, middle_of(&p, f, c));
        }
    }
}

/* With a convex radius an edge is two, where its faces end. */
void sadmm_draw_hull_edges(const struct sadmm_pen *pen, const double *block)
{
    struct polytope p;
    polytope_at(block, 0, &p);
    for (int32_t f = 0; pen->draw->line && f < p.faces; ++f) {
        const vec3 out = v3_scale(polytope_normal(&p, f), p.radius);
        for (int32_t c = p.face_first[f]; c < p.face_first[f + 1]; ++c) {
            const int32_t from = p.corner_vertex[c], to = p.corner_vertex[next_corner(&p, f, c)];
            if (p.radius > 0 || from < to)
                pen_line(pen, v3_add(polytope_vertex(&p, from), out), v3_add(polytope_vertex(&p, to), out));
        }
    }
}
