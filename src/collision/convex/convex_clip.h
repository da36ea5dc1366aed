/* Contact points of two convex bodies by clipping their features along a normal: a flat face of each, or, if that is
 * too steep, a straight line of its surface, or nothing. The corners of the overlap of their projections become points,
 * each with the separation along the normal, as between two polytopes (polytope_face.h).
 *
 * A disc's rim has no corners. Eight points of it stand for it, evenly spread from a direction that is not the disc's
 * own but the other body's: a side of the face, a plane's or a mesh's x axis, b's of two discs. So a disc that turns
 * about its axis keeps its points. An octagon leaves out up to 1 - cos(pi / 8) = 7.6 % of the radius: where a centre of
 * mass is as near to the rim, one of the eight is the rim's point nearest to it, and a body tips over the rim where it
 * would in truth. Where rims cross sides, lines and each other the points are exact.
 */
#ifndef SADMM_COLLISION_CONVEX_CONVEX_CLIP_H
#define SADMM_COLLISION_CONVEX_CONVEX_CLIP_H

#include "convex_pair.h"
#include "polytope_face.h"

/* From where to where a centre of mass decides about the points of a rim, in radii: from within the octagon to beyond
 * the rim. */
#define CONVEX_TIPS_FROM ((real)0.9)
#define CONVEX_TIPS_TO   ((real)1.1)
enum { CONVEX_RIM = 8, CONVEX_POINTS = 64, CONVEX_END = 16 /* features of ends: above those of a rim */ };

enum convex_feature_kind { CONVEX_NOTHING, CONVEX_LINE, CONVEX_FACE, CONVEX_DISC };

struct convex_feature {
    int kind, count;
    vec3 corner[CLIP_CORNERS]; /* of a face counter-clockwise seen from outside; the ends of a line */
    int vertex[CLIP_CORNERS], edge[CLIP_CORNERS];
    vec3 normal; /* of a flat, outward from its own body, with its offset; of a line, outward as well */
    real offset;
    vec3 centre; /* of a disc */
    real radius;
    real inner[2]; /* radii of curvature across a line, at its ends */
    bool is_edge;  /* of a polytope; else the line is of a cylinder or a cone: */
    vec3 axis[2];  /* its axis, beside the ends of the line */
    real wide[2];  /* its radii there */
};

/* a - b seen along n, and the points that have been found. */
struct convex_meeting {
    const struct convex_pair *pair;
    vec3 n, x1, x2;
    real least, limit, tolerance;
    real nearest; /* separation of all points that there are, those that are left out included */
    int count;
    struct clip_corner at[CONVEX_POINTS];
    real separation[CONVEX_POINTS];
    uint32_t feature[CONVEX_POINTS];
};

/* A straight line of a smooth body that points along d (own frame) to within 8 degrees. */
SADMM_INLINE bool convex_line(const struct convex *c, vec3 d, struct convex_feature *out)
{
    const real r = real_sqrt(d.x * d.x + d.y * d.y);
    vec3 e;
    if (c->form != CONVEX_CYLINDER && c->form != CONVEX_CONE) return false;
    if (!(r > (real)1e-6)) return false;
    e = v3(d.x / r, d.y / r, 0);
    out->corner[0] = v3(c->size.x * e.x, c->size.x * e.y, -c->size.y);
    if (c->form == CONVEX_CYLINDER) {
        out->normal = e;
        out->corner[1] = v3(out->corner[0].x, out->corner[0].y, c->size.y);
        out->inner[0] = out->inner[1] = c->size.x;
    } else {
        const real length = real_sqrt(c->size.x * c->size.x + 4 * c->size.y * c->size.y);
        out->normal = v3(2 * c->size.y / length * e.x, 2 * c->size.y / length * e.y, c->size.x / length);
        out->corner[1] = v3(0, 0, c->size.y);
        out->inner[0] = c->size.x * length / (2 * c->size.y); /* to the axis, along the normal */
        out->inner[1] = 0;
    }
    out->is_edge = false;
    out->axis[0] = v3(0, 0, -c->size.y);
    out->axis[1] = v3(0, 0, c->size.y);
    out->wide[0] = c->size.x;
    out->wide[1] = c->form == CONVEX_CYLINDER ? c->size.x : 0;
    out->kind = CONVEX_LINE;
    out->count = 2;
    out->vertex[0] = CONVEX_END;
    out->vertex[1] = CONVEX_END + 1;
    out->edge[0] = out->edge[1] = CONVEX_END;
    return v3_dot(out->normal, d) >= MANIFOLD_COS_NEAR;
}

/* Of a polytope, as polytope_face.h takes them. */
SADMM_INLINE void convex_polytope_feature(const struct polytope *p, vec3 d, struct convex_feature *out)
{
    const int face = clip_face(p, d);
    int ends[2], k;
    if (face >= 0) {
        const int first = p->face_first[face], all = p->face_first[face + 1] - first;
        out->kind = CONVEX_FACE;
        out->count = all < CLIP_CORNERS ? all : CLIP_CORNERS;
        for (k = 0; k < out->count; ++k) {
            const int at = first + (all == out->count ? k : k * all / out->count);
            out->vertex[k] = p->corner_vertex[at];
            out->edge[k] = p->corner_edge[at];
            out->corner[k] = polytope_vertex(p, out->vertex[k]);
        }
        out->normal = polytope_normal(p, face);
        out->offset = polytope_offset(p, face);
    } else if (p->edges > 0 && clip_edge(p, d, ends) == 2) {
        out->kind = CONVEX_LINE;
        out->count = 2;
        for (k = 0; k < 2; ++k) {
            out->vertex[k] = ends[k];
            out->corner[k] = polytope_vertex(p, ends[k]);
            out->inner[k] = 0;
        }
        out->edge[0] = out->edge[1] = polytope_edge_between(p, ends[0], ends[1]);
        out->normal = d;
        out->is_edge = true;
    }
}

/* What of c points along d (own frame). */
SADMM_CALLED void convex_feature_of(const struct convex *c, vec3 d, struct convex_feature *out)
{
    const int flat = convex_flat(c, d, MANIFOLD_COS_NEAR);
    out->kind = CONVEX_NOTHING;
    out->count = 0;
    if (c->form == CONVEX_POLYTOPE) {
        convex_polytope_feature(&c->p, d, out);
    } else if (flat >= 0) {
        out->kind = CONVEX_DISC;
        out->normal = convex_flat_normal(c, flat);
        out->offset = convex_flat_offset(c, flat);
        out->centre = v3_scale(out->normal, out->offset);
        out->radius = c->size.x;
    } else if (!convex_line(c, d, out)) {
        out->kind = CONVEX_NOTHING;
    }
}

/* From a's frame to b's. */
SADMM_INLINE void convex_feature_place(const struct convex_pair *pair, struct convex_feature *f)
{
    int k;
    for (k = 0; k < f->count; ++k) f->corner[k] = v3_add(m3_mul(pair->R, f->corner[k]), pair->t);
    f->normal = m3_mul(pair->R, f->normal);
    f->offset += v3_dot(f->normal, pair->t);
    f->centre = v3_add(m3_mul(pair->R, f->centre), pair->t);
    if (f->kind == CONVEX_LINE && !f->is_edge)
        for (k = 0; k < 2; ++k) f->axis[k] = v3_add(m3_mul(pair->R, f->axis[k]), pair->t);
}

/* The point of a flat's plane over x, along n. */
SADMM_INLINE vec3 convex_over(const struct convex_feature *flat, vec3 n, vec3 x)
{
    return v3_madd(x, (flat->offset - v3_dot(flat->normal, x)) / v3_dot(flat->normal, n), n);
}

/* Outward of side k of a face, unit, in its plane. */
SADMM_INLINE vec3 convex_side_out(const struct convex_feature *face, int k)
{
    const vec3 side = v3_sub(face->corner[k + 1 < face->count ? k + 1 : 0], face->corner[k]),
               out = v3_cross(side, face->normal);
    const real length = v3_norm(out);
    return length > 0 ? v3_scale(out, 1 / length) : v3(0, 0, 0);
}

/* Is a point of a flat's plane on the flat, or beside it by no more than the tolerance? */
SADMM_INLINE bool convex_is_on(const struct convex_feature *flat, vec3 x, real tolerance)
{
    int k;
    if (flat->kind == CONVEX_DISC) {
        const real reach = flat->radius + tolerance;
        return v3_norm2(v3_sub(x, flat->centre)) <= reach * reach;
    }
    for (k = 0; k < flat->count; ++k)
        if (v3_dot(convex_side_out(flat, k), v3_sub(x, flat->corner[k])) > tolerance) return false;
    return true;
}

/* Is the point of a corner, or on a side, of b that is left out? */
SADMM_INLINE bool convex_leaves_out(const struct convex_pair *pair, uint32_t feature)
{
    const uint32_t number = feature & AXIS_EDGE_MASK;
    switch (feature >> AXIS_KIND_SHIFT) {
    case FEATURE_VERTEX_B: return number <= 16 && (pair->left_out >> (number - 1) & 1) != 0;
    case FEATURE_CROSSING: return number < 16 && (pair->left_out >> (16 + number) & 1) != 0;
    default: return false;
    }
}

/* A point by where it is on each of the two, without their rounds. */
SADMM_CALLED void convex_meet(struct convex_meeting *m, vec3 on_a, vec3 on_b, uint32_t feature)
{
    const struct convex_pair *pair = m->pair;
    const real separation = real_max(v3_dot(m->n, v3_sub(on_b, on_a)) - convex_radii(pair), m->least);
    const vec3 x = v3_madd(v3_scale(v3_add(on_a, on_b), (real)0.5), (pair->a.p.radius - pair->b.p.radius) / 2, m->n);
    struct clip_corner at;
    int k;
    m->nearest = real_min(m->nearest, separation);
    if (!(separation <= m->limit + pair->slack) || m->count == CONVEX_POINTS || convex_leaves_out(pair, feature))
        return;
    at.x = v3_dot(m->x1, x);
    at.y = v3_dot(m->x2, x);
    at.z = v3_dot(m->n, x);
    at.edge = 0;
    for (k = 0; k < m->count; ++k)
        if (m->feature[k] == feature || (clip_near(&m->at[k], at.x, at.y, m->tolerance) &&
                                         real_abs(m->separation[k] - separation) <= 2 * m->tolerance))
            return;
    m->at[m->count] = at;
    m->separation[m->count] = separation;
    m->feature[m->count++] = feature;
}

/* x is a point of one of the two, of a where so said; the other is a flat. */
SADMM_INLINE void convex_meet_flat(struct convex_meeting *m, vec3 x, bool of_a, const struct convex_feature *flat,
                                   uint32_t feature)
{
    const vec3 over = convex_over(flat, m->n, x);
    convex_meet(m, of_a ? x : over, of_a ? over : x, feature);
}

/* The k-th point of a disc's rim; e1, e2: axes in its plane. */
SADMM_INLINE vec3 convex_rim(const struct convex_feature *disc, vec3 e1, vec3 e2, int k)
{
    const real half = (real)0.70710678118654752;
    const real cosine = k % 4 == 2 ? 0 : k % 2 ? half : 1, sine = k % 4 == 0 ? 0 : k % 2 ? half : 1;
    return v3_madd(v3_madd(disc->centre, (k > 2 && k < 6 ? -cosine : cosine) * disc->radius, e1),
                   (k > 4 ? -sine : sine) * disc->radius, e2);
}

/* The direction in a disc's plane that is nearest to `along`, unit, and the one across it. */
SADMM_INLINE void convex_rim_axes(const struct convex_feature *disc, vec3 along, vec3 *e1, vec3 *e2)
{
    const vec3 flat = v3_madd(along, -v3_dot(along, disc->normal), disc->normal);
    const real length2 = v3_norm2(flat);
    if (length2 > (real)1e-6 * v3_norm2(along)) {
        *e1 = v3_scale(flat, 1 / real_sqrt(length2));
        *e2 = v3_cross(disc->normal, *e1);
    } else {
        v3_tangents(disc->normal, e1, e2);
    }
}

/* Is a centre of mass near the rim, so that which points stand for it decides whether the body tips? To it from the
 * disc's centre; of two that are the outer one. 0: there is none. */
SADMM_INLINE vec3 convex_tipping(const struct convex_feature *disc, const vec3 centre[2], const bool tips[2])
{
    real most2 = CONVEX_TIPS_FROM * CONVEX_TIPS_FROM * disc->radius * disc->radius;
    vec3 way = v3(0, 0, 0);
    int s;
    for (s = 0; s < 2; ++s) {
        vec3 d;
        real d2;
        if (!tips[s]) continue;
        d = v3_sub(centre[s], disc->centre);
        d = v3_madd(d, -v3_dot(d, disc->normal), disc->normal);
        d2 = v3_norm2(d);
        if (!(d2 > most2 && d2 < CONVEX_TIPS_TO * CONVEX_TIPS_TO * disc->radius * disc->radius)) continue;
        most2 = d2;
        way = d;
    }
    return way;
}

/* What the points of a rim that faces `other` are spread from. */
SADMM_INLINE vec3 convex_spread(const struct convex_pair *pair, const struct convex_feature *disc,
                                const struct convex_feature *other)
{
    const vec3 way = convex_tipping(disc, pair->centre, pair->tips);
    if (v3_norm2(way) > 0) return way;
    if (v3_norm2(pair->spread) > 0) return pair->spread;
    return other->kind == CONVEX_DISC ? v3(1, 0, 0) : v3_sub(other->corner[1], other->corner[0]);
}

/* Points of the rim that are over a flat of the other one. */
SADMM_INLINE void convex_rim_over(struct convex_meeting *m, const struct convex_feature *disc, bool disc_is_a,
                                  const struct convex_feature *flat)
{
    vec3 e1, e2;
    int k;
    convex_rim_axes(disc, convex_spread(m->pair, disc, flat), &e1, &e2);
    for (k = 0; k < CONVEX_RIM; ++k) {
        const vec3 x = convex_rim(disc, e1, e2, k);
        if (convex_is_on(flat, convex_over(flat, m->n, x), m->tolerance))
            convex_meet_flat(m, x, disc_is_a, flat,
                             polytope_feature(disc_is_a ? FEATURE_VERTEX_A : FEATURE_VERTEX_B, 0, k) + 1);
    }
}

/* Where the line through p and q, in a disc's plane, crosses its rim: shares of the way from p to q. False: nowhere. */
SADMM_INLINE bool convex_crossings(const struct convex_feature *disc, vec3 p, vec3 q, real share[2])
{
    const vec3 d = v3_sub(q, p), r = v3_sub(p, disc->centre);
    const real dd = v3_norm2(d), half = v3_dot(d, r), rest = v3_norm2(r) - disc->radius * disc->radius,
               det = half * half - dd * rest;
    real root;
    if (!(det > 0 && dd > 0)) return false;
    root = real_sqrt(det);
    /* both without a difference of like numbers */
    share[0] = half > 0 ? (-half - root) / dd : rest / (-half + root);
    share[1] = half > 0 ? rest / (-half - root) : (-half + root) / dd;
    return true;
}

/* of_disc, of_other: what is crossed, by a number of its own. */
SADMM_INLINE uint32_t convex_crossing_feature(bool disc_is_a, int of_disc, int of_other)
{
    return polytope_feature(FEATURE_CROSSING, disc_is_a ? of_disc : of_other, disc_is_a ? of_other : of_disc);
}

SADMM_INLINE void convex_disc_face(struct convex_meeting *m, const struct convex_feature *disc, bool disc_is_a,
                                   const struct convex_feature *face)
{
    int k, i;
    convex_rim_over(m, disc, disc_is_a, face);
    for (k = 0; k < face->count; ++k)
        if (convex_is_on(disc, convex_over(disc, m->n, face->corner[k]), m->tolerance))
            convex_meet_flat(m, face->corner[k], !disc_is_a, disc,
                             polytope_feature(disc_is_a ? FEATURE_VERTEX_B : FEATURE_VERTEX_A, 0, face->vertex[k]) + 1);
    for (k = 0; k < face->count; ++k) {
        const vec3 from = face->corner[k], to = face->corner[k + 1 < face->count ? k + 1 : 0];
        real share[2];
        if (!convex_crossings(disc, convex_over(disc, m->n, from), convex_over(disc, m->n, to), share)) continue;
        for (i = 0; i < 2; ++i)
            if (share[i] > 0 && share[i] < 1)
                convex_meet_flat(m, v3_madd(from, share[i], v3_sub(to, from)), !disc_is_a, disc,
                                 convex_crossing_feature(disc_is_a, i, face->edge[k]));
    }
}

/* Where the rim of b crosses that of a as seen along n: from the point where circles would, by Newton's method in the
 * angle about b's axis. Along n the rim of b is over p + c q + s r of a's plane, (c, s) on the unit circle, counted
 * from a's centre; there its length is to be a's radius. False: they do not cross there. */
SADMM_CALLED bool convex_rim_crossing(const struct convex_meeting *m, const struct convex_feature *a,
                                      const struct convex_feature *b, vec3 start, vec3 *on_b)
{
    enum { STEPS = 8 };
    const real tilt = v3_dot(a->normal, m->n), wanted = a->radius * a->radius,
               close = 2 * m->pair->slack * a->radius; /* of a square */
    const vec3 from = v3_sub(convex_over(b, m->n, start), b->centre),
               p = v3_sub(convex_over(a, m->n, b->centre), a->centre);
    vec3 e1, e2, q, r;
    real c = 1, s = 0;
    int step;
    if (!(v3_norm2(from) > 0)) return false;
    e1 = v3_scale(from, 1 / v3_norm(from));
    e2 = v3_cross(b->normal, e1);
    q = v3_scale(v3_madd(e1, -v3_dot(a->normal, e1) / tilt, m->n), b->radius);
    r = v3_scale(v3_madd(e2, -v3_dot(a->normal, e2) / tilt, m->n), b->radius);
    for (step = 0; step < STEPS; ++step) {
        const vec3 y = v3_madd(v3_madd(p, c, q), s, r);
        const real residual = v3_norm2(y) - wanted, slope = 2 * v3_dot(y, v3_sub(v3_scale(r, c), v3_scale(q, s)));
        real turn, length, old = c;
        if (real_abs(residual) <= close) {
            *on_b = v3_madd(v3_madd(b->centre, c * b->radius, e1), s * b->radius, e2);
            return true;
        }
        turn = residual / slope;
        if (!(real_abs(turn) < (real)0.5)) return false; /* they touch, or pass */
        c += s * turn;
        s -= old * turn;
        length = real_sqrt(c * c + s * s);
        c /= length;
        s /= length;
    }
    return false;
}

/* Seen along n, which both are across to within 8 degrees, the discs are circles but for 1 - cosine of that, and their
 * rims cross beside where circles would. */
SADMM_INLINE void convex_disc_disc(struct convex_meeting *m, const struct convex_feature *a,
                                   const struct convex_feature *b)
{
    const vec3 to_b = v3_sub(convex_over(a, m->n, b->centre), a->centre);
    const real d2 = v3_norm2(to_b), d = real_sqrt(d2);
    convex_rim_over(m, a, true, b);
    convex_rim_over(m, b, false, a);
    if (d > m->tolerance && d < a->radius + b->radius && d > real_abs(a->radius - b->radius)) {
        const vec3 e1 = v3_scale(to_b, 1 / d), e2 = v3_cross(a->normal, e1);
        const real along = (d2 + a->radius * a->radius - b->radius * b->radius) / (2 * d),
                   height = real_sqrt(real_max(a->radius * a->radius - along * along, 0));
        int side;
        for (side = 0; side < 2; ++side) {
            const vec3 start = v3_madd(v3_madd(a->centre, along, e1), side ? height : -height, e2);
            vec3 x;
            if (convex_rim_crossing(m, a, b, start, &x))
                convex_meet_flat(m, x, false, a, polytope_feature(FEATURE_CROSSING, side, 0));
        }
    }
}

/* The part of a line that is over a flat. */
SADMM_INLINE void convex_line_flat(struct convex_meeting *m, const struct convex_feature *line, bool line_is_a,
                                   const struct convex_feature *flat)
{
    const vec3 p = convex_over(flat, m->n, line->corner[0]), q = convex_over(flat, m->n, line->corner[1]);
    const int own = line_is_a ? FEATURE_VERTEX_A : FEATURE_VERTEX_B;
    real low = 0, high = 1;
    uint32_t feature[2];
    int k;
    for (k = 0; k < 2; ++k) feature[k] = polytope_feature(own, 0, line->vertex[k]) + 1;
    if (flat->kind == CONVEX_DISC) {
        real share[2];
        if (!convex_crossings(flat, p, q, share)) return;
        for (k = 0; k < 2; ++k) {
            if (!(k ? share[1] < high : share[0] > low)) continue;
            if (k) high = share[1];
            else low = share[0];
            feature[k] = convex_crossing_feature(!line_is_a, k, line->edge[0]);
        }
    } else {
        for (k = 0; k < flat->count; ++k) {
            const vec3 out = convex_side_out(flat, k);
            const real dp = v3_dot(out, v3_sub(p, flat->corner[k])), dq = v3_dot(out, v3_sub(q, flat->corner[k]));
            const bool p_beyond = dp > m->tolerance, q_beyond = dq > m->tolerance;
            real share;
            if (!p_beyond && !q_beyond) continue;
            if (p_beyond && q_beyond) return;
            share = dp / (dp - dq); /* beyond an end that is not beyond the side by more than the tolerance: there */
            share = p_beyond ? real_min(share, 1) : real_max(share, 0);
            if (p_beyond && share > low) {
                low = share;
                feature[0] = convex_crossing_feature(!line_is_a, flat->edge[k], line->edge[0]);
            } else if (q_beyond && share < high) {
                high = share;
                feature[1] = convex_crossing_feature(!line_is_a, flat->edge[k], line->edge[0]);
            }
        }
    }
    if (!(low <= high)) return;
    for (k = 0; k < 2; ++k)
        convex_meet_flat(m, v3_madd(line->corner[0], k ? high : low, v3_sub(line->corner[1], line->corner[0])),
                         line_is_a, flat, feature[k]);
}

/* x, moved along n to the surface of a cylinder or a cone that it is near. *beyond: how far that is beyond its ends, as
 * a share of the axis; 0: it is not. */
SADMM_INLINE vec3 convex_onto_side(const struct convex_feature *line, vec3 n, vec3 x, real *beyond)
{
    const vec3 axis = v3_sub(line->axis[1], line->axis[0]), w = v3_sub(x, line->axis[0]);
    const real length = v3_norm(axis), taper = (line->wide[1] - line->wide[0]) / length,
               along = v3_dot(w, axis) / length, up = v3_dot(n, axis) / length, wide = line->wide[0] + taper * along,
               a = 1 - up * up * (1 + taper * taper), b = v3_dot(w, n) - up * (along + taper * wide),
               c = v3_norm2(w) - along * along - wide * wide, det = b * b - a * c,
               way = det > 0 && b > 0 ? -c / (b + real_sqrt(det))
                     : a > 0          ? -b / a
                                      : 0,
               at = (along + way * up) / length;
    *beyond = at < 0 ? at : real_max(at - 1, 0);
    return v3_madd(x, way, n);
}

/* x, moved along n to the ball around the edge's point there, which rounds it. u: along the edge, across n. */
SADMM_INLINE vec3 convex_onto_edge(const struct convex_feature *line, real round, vec3 n, vec3 u, vec3 x)
{
    const vec3 d = v3_sub(line->corner[1], line->corner[0]);
    const real share = real_clamp(v3_dot(u, v3_sub(x, line->corner[0])) / v3_dot(u, d), 0, 1);
    const vec3 rel = v3_sub(x, v3_madd(line->corner[0], share, d));
    const real above = v3_dot(n, rel), aside2 = v3_norm2(rel) - above * above;
    return v3_madd(x, real_sqrt(real_max(round * round - aside2, 0)) - above, n);
}

/* Points near the two lines, one over the other along n, are moved to the surfaces that these are of, not beyond their
 * ends. u: along a's line, across n. */
SADMM_CALLED void convex_onto_both(const struct convex_meeting *m, const struct convex_feature *a,
                                   const struct convex_feature *b, vec3 u, vec3 *on_a, vec3 *on_b)
{
    enum { MOVES = 3 }; /* each leaves a fiftieth of what there was */
    int move, s;
    for (move = 0;; ++move) {
        real back = 0;
        for (s = 0; s < 2; ++s) {
            const struct convex_feature *line = s ? b : a;
            const vec3 n = s ? v3_neg(m->n) : m->n;
            vec3 *on = s ? on_b : on_a, axis;
            real beyond;
            if (line->is_edge) {
                *on = convex_onto_edge(line, s ? m->pair->b.p.radius : m->pair->a.p.radius, n, u, *on);
                continue;
            }
            *on = convex_onto_side(line, n, *on, &beyond);
            axis = v3_sub(line->axis[1], line->axis[0]);
            beyond *= v3_norm2(axis) / v3_dot(u, axis);
            if (real_abs(beyond) > real_abs(back)) back = beyond;
        }
        if (move == MOVES || real_abs(back) <= m->tolerance) return;
        *on_a = v3_madd(*on_a, -back, u);
        *on_b = v3_madd(*on_b, -back, u);
    }
}

/* Two lines side by side, to within 8 degrees: both ends of the common stretch, where the round surfaces over them are
 * nearest to each other. */
SADMM_INLINE void convex_line_line(struct convex_meeting *m, const struct convex_feature *a,
                                   const struct convex_feature *b)
{
    const vec3 n = m->n;
    vec3 u = v3_sub(a->corner[1], a->corner[0]), w = v3_sub(b->corner[1], b->corner[0]);
    real lu, lw, ends[2][2], low, high;
    int k;
    u = v3_madd(u, -v3_dot(u, n), n);
    w = v3_madd(w, -v3_dot(w, n), n);
    lu = v3_norm(u);
    lw = v3_norm(w);
    if (!(lu > 0 && lw > 0) || real_abs(v3_dot(u, w)) < MANIFOLD_COS_NEAR * lu * lw) return;
    u = v3_scale(u, 1 / lu);
    for (k = 0; k < 2; ++k) {
        ends[0][k] = v3_dot(u, a->corner[k]);
        ends[1][k] = v3_dot(u, b->corner[k]);
    }
    low = real_max(real_min(ends[0][0], ends[0][1]), real_min(ends[1][0], ends[1][1]));
    high = real_min(real_max(ends[0][0], ends[0][1]), real_max(ends[1][0], ends[1][1]));
    if (!(high - low > MANIFOLD_SNAP * real_min(lu, lw))) return;
    for (k = 0; k < 2; ++k) {
        const real at = k ? high : low, sa = (at - ends[0][0]) / (ends[0][1] - ends[0][0]),
                   sb = (at - ends[1][0]) / (ends[1][1] - ends[1][0]),
                   round_a = a->inner[0] + sa * (a->inner[1] - a->inner[0]) + m->pair->a.p.radius,
                   round_b = b->inner[0] + sb * (b->inner[1] - b->inner[0]) + m->pair->b.p.radius,
                   rounds = round_a + round_b;
        /* a's and b's points there; between them the nearest place, by the radii of curvature */
        const vec3 xa = v3_madd(a->corner[0], sa, v3_sub(a->corner[1], a->corner[0])),
                   xb = v3_madd(b->corner[0], sb, v3_sub(b->corner[1], b->corner[0])), d = v3_sub(xb, xa),
                   aside = v3_madd(d, -v3_dot(n, d), n);
        vec3 on_a = v3_madd(xa, round_a / rounds, aside), on_b = v3_madd(xb, -round_b / rounds, aside);
        if (!(rounds > 0) || !(rounds * rounds > v3_norm2(aside))) continue;
        convex_onto_both(m, a, b, u, &on_a, &on_b);
        /* which end it is: a's own features, where a ends first or both do, or b's */
        convex_meet(m, v3_madd(on_a, -m->pair->a.p.radius, n), v3_madd(on_b, m->pair->b.p.radius, n),
                    (k ? real_max(ends[0][0], ends[0][1]) <= high : real_min(ends[0][0], ends[0][1]) >= low)
                        ? polytope_feature(FEATURE_VERTEX_A, 0, a->vertex[(ends[0][1] > ends[0][0]) == (k == 1)]) + 1
                        : polytope_feature(FEATURE_VERTEX_B, 0, b->vertex[(ends[1][1] > ends[1][0]) == (k == 1)]) + 1);
    }
}

SADMM_INLINE real convex_slope(const struct convex_feature *f, vec3 n)
{
    const real c = f->kind == CONVEX_FACE || f->kind == CONVEX_DISC ? real_abs(v3_dot(f->normal, n)) : 1;
    return real_sqrt(real_max(0, 1 - c * c)) / c;
}

/* Is n a witness of the separation: two points opposite each other along n, as near as the planes across n? Then no
 * direction beside n is better. Here points must be over the flats exactly. */
SADMM_INLINE bool convex_is_witness(const struct convex_meeting *m, const struct convex_feature *a,
                                    const struct convex_feature *b)
{
    const struct convex_pair *pair = m->pair;
    const real within = 4 * pair->slack;
    int k;
    for (k = 0; k < m->count; ++k) {
        vec3 x;
        if (m->separation[k] > m->least + pair->equal) continue;
        x = v3_madd(v3_madd(v3_scale(m->x1, m->at[k].x), m->at[k].y, m->x2), m->at[k].z, m->n);
        if ((a->kind == CONVEX_LINE || convex_is_on(a, convex_over(a, m->n, x), within)) &&
            (b->kind == CONVEX_LINE || convex_is_on(b, convex_over(b, m->n, x), within)))
            return true;
    }
    return false;
}

/* Sets m's normal to n, and its points to those of what faces along it. least: the separation of the two along n. The
 * smallest separation of all that there are, those that are left out included; largest: there are none. *witness: n is
 * a separating axis witness, no direction beside it is better. */
SADMM_RARE real convex_clip_manifold(const struct convex_pair *pair, vec3 n, real least, real limit,
                                     struct manifold *m, bool *witness)
{
    struct convex_feature a, b;
    struct convex_meeting meeting;
    uint64_t chosen;
    real slope;
    int i;
    m->normal = n;
    m->count = 0;
    *witness = false;
    convex_feature_of(&pair->a, m3_tmul(pair->R, n), &a);
    if (a.kind == CONVEX_NOTHING) return SADMM_REAL_MAX;
    convex_feature_of(&pair->b, v3_neg(n), &b);
    if (b.kind == CONVEX_NOTHING) return SADMM_REAL_MAX;
    convex_feature_place(pair, &a);

    meeting.pair = pair;
    meeting.n = n;
    meeting.least = least;
    meeting.limit = limit;
    meeting.nearest = SADMM_REAL_MAX;
    meeting.count = 0;
    slope = convex_slope(&a, n) + convex_slope(&b, n);
    meeting.tolerance = MANIFOLD_SNAP / 2 * slope > CLIP_SEPARATION ? CLIP_SEPARATION / slope : MANIFOLD_SNAP / 2;
    meeting.tolerance *= pair->thin;
    /* axes that do not turn with a disc, as those of its rim */
    if (a.kind == CONVEX_DISC || b.kind == CONVEX_DISC) {
        struct convex_feature across;
        const bool of_b = b.kind == CONVEX_DISC &&
                          (a.kind != CONVEX_DISC || v3_norm2(convex_tipping(&b, pair->centre, pair->tips)) > 0);
        across.normal = n;
        convex_rim_axes(&across, of_b ? convex_spread(pair, &b, &a) : convex_spread(pair, &a, &b), &meeting.x1,
                        &meeting.x2);
    } else {
        v3_tangents(n, &meeting.x1, &meeting.x2);
    }
    if (a.kind == CONVEX_DISC && b.kind == CONVEX_DISC) convex_disc_disc(&meeting, &a, &b);
    else if (a.kind == CONVEX_DISC && b.kind == CONVEX_FACE) convex_disc_face(&meeting, &a, true, &b);
    else if (a.kind == CONVEX_FACE && b.kind == CONVEX_DISC) convex_disc_face(&meeting, &b, false, &a);
    else if (a.kind == CONVEX_LINE && b.kind == CONVEX_LINE) convex_line_line(&meeting, &a, &b);
    else if (a.kind == CONVEX_LINE) convex_line_flat(&meeting, &a, true, &b);
    else if (b.kind == CONVEX_LINE) convex_line_flat(&meeting, &b, false, &a);
    *witness = convex_is_witness(&meeting, &a, &b);
    chosen = clip_choice(meeting.at, meeting.separation, meeting.count);
    for (i = 0; i < meeting.count; ++i)
        if (chosen >> i & 1) {
            const struct clip_corner *p = &meeting.at[i];
            manifold_add(m, v3_madd(v3_madd(v3_scale(meeting.x1, p->x), p->y, meeting.x2), p->z, n),
                         meeting.separation[i], meeting.feature[i]);
        }
    return meeting.nearest;
}

#endif
