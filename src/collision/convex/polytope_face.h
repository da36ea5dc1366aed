/* Contact points of two polytopes by clipping an incident against a reference feature along a normal: the face of each
 * that points most along it, or an edge or a corner, if that is too steep or the shape round. They are projected onto a
 * plane across the normal, and the corners of the overlap become points, each with the separation of the faces there
 * (Sutherland and Hodgman, "Reentrant polygon clipping", CACM 1974). Their features follow from the edges that meet
 * there, whichever polygon clips the other.
 */
#ifndef SADMM_COLLISION_CONVEX_POLYTOPE_FACE_H
#define SADMM_COLLISION_CONVEX_POLYTOPE_FACE_H

#include "polytope_axis.h"

enum {
    CLIP_CORNERS = 16,            /* of a face with more, so many are taken, evenly: what is between them is a sliver */
    CLIP_POLYGON = 2 * CLIP_CORNERS + 2
};
/* Corners beside a side by less than MANIFOLD_SNAP are on it, unless the separation there would be wrong by more than
 * this share of the thinner extent. */
#define CLIP_SEPARATION ((real)1e-5)
/* Cosine with the normal below which a face is too steep to be seen along it. */
#define CLIP_COSINE ((real)0.3)

/* A corner in the plane's coordinates, the height along the normal; of a clipped polygon `edge` is the one that leaves:
 * a corner's number in the subject, CLIP_CORNERS + that of a side of the other. */
struct clip_corner {
    real x, y, z;
    int edge;
};

struct clip_feature {
    int count; /* 1: a corner, or the centre of a sphere; 2: an edge, or a capsule's segment */
    struct clip_corner corner[CLIP_CORNERS];
    int vertex[CLIP_CORNERS]; /* in the polytope; the corners' edges are in `corner` */
};

/* Features: kind << 30, then a vertex, or an edge of a << 15 | one of b. The nearest points are one, whatever they are
 * made by. */
enum { FEATURE_VERTEX_A, FEATURE_VERTEX_B, FEATURE_CROSSING, FEATURE_NEAREST };
SADMM_INLINE uint32_t polytope_feature(int kind, int of_a, int of_b)
{
    return (uint32_t)kind << AXIS_KIND_SHIFT | (uint32_t)of_a << AXIS_EDGE_SHIFT | (uint32_t)of_b;
}

/* The face of p that points most along `outward` (own frame), -1: p has none, or it is too steep. */
SADMM_INLINE int clip_face(const struct polytope *p, vec3 outward)
{
    int f;
    if (p->faces == 0) return -1;
    f = polytope_face_along(p, outward);
    return v3_dot(polytope_normal(p, f), outward) >= CLIP_COSINE ? f : -1;
}

/* The corner farthest along `outward`, and with it the edge there that is nearest to across, if that is within 8
 * degrees. Their vertices; how many: 1 or 2. */
SADMM_INLINE int clip_edge(const struct polytope *p, vec3 outward, int vertex[2])
{
    const int v = polytope_support(p, outward, 0), last = p->vertex_first[v + 1];
    real flattest = 1 - MANIFOLD_COS_NEAR * MANIFOLD_COS_NEAR; /* square of its sine */
    int k, count = 1;
    vertex[0] = vertex[1] = v;
    for (k = p->vertex_first[v]; k < last; ++k) {
        const vec3 d = v3_sub(polytope_vertex(p, p->vertex_next[k]), polytope_vertex(p, v));
        const real along = v3_dot(d, outward), slope2 = along * along / v3_norm2(d);
        if (slope2 <= flattest) {
            flattest = slope2;
            vertex[1] = p->vertex_next[k];
            count = 2;
        }
    }
    return count;
}

/* x1, x2, n: the plane's axes and the normal. of_a: in b's frame by the pair's pose. outward: the direction of the
 * other one, own frame; face: the one that points there, -1: none. */
SADMM_INLINE void clip_feature_of(const struct polytope_pair *pair, bool of_a, int face, vec3 outward, vec3 x1, vec3 x2,
                                  vec3 n, struct clip_feature *out)
{
    const struct polytope *p = of_a ? &pair->a : &pair->b;
    int ends[2], k, edge = 0;
    const int first = face < 0 ? 0 : p->face_first[face],
              all = face < 0 ? clip_edge(p, outward, ends) : p->face_first[face + 1] - first;
    if (face < 0 && all == 2) edge = polytope_edge_between(p, ends[0], ends[1]);
    out->count = all < CLIP_CORNERS ? all : CLIP_CORNERS;
    for (k = 0; k < out->count; ++k) {
        const int at = first + (all == out->count ? k : k * all / out->count),
                  v = face < 0 ? ends[k] : p->corner_vertex[at];
        const vec3 x = of_a ? pair_point_a(pair, v) : polytope_vertex(p, v);
        out->vertex[k] = v;
        out->corner[k].x = v3_dot(x1, x);
        out->corner[k].y = v3_dot(x2, x);
        out->corner[k].z = v3_dot(n, x);
        out->corner[k].edge = face < 0 ? edge : p->corner_edge[at];
    }
}

/* Keep the part of `in` that is not outside the side from p to q, whose polygon is inside to its left, or, turned = -1,
 * to its right. It comes as `out`. */
SADMM_INLINE int clip_by_side(const struct clip_corner *in, int count, const struct clip_corner *p,
                              const struct clip_corner *q, real turned, int label, real tolerance,
                              struct clip_corner *out)
{
    const real ex = q->x - p->x, ey = q->y - p->y, length = real_sqrt(ex * ex + ey * ey);
    const real nx = length > 0 ? turned * ey / length : 0, ny = length > 0 ? -turned * ex / length : 0;
    real d = nx * (in[0].x - p->x) + ny * (in[0].y - p->y);
    int i, n = 0;
    for (i = 0; i < count && n < CLIP_POLYGON - 1; ++i) {
        const struct clip_corner *c = &in[i], *next = &in[i + 1 < count ? i + 1 : 0];
        const real d_next = nx * (next->x - p->x) + ny * (next->y - p->y);
        const bool inside = d <= tolerance, next_inside = d_next <= tolerance;
        if (inside) out[n++] = *c;
        if (inside != next_inside) {
            const real f = real_clamp(d / (d - d_next), 0, 1);
            struct clip_corner *x = &out[n++];
            x->x = c->x + f * (next->x - c->x);
            x->y = c->y + f * (next->y - c->y);
            x->z = c->z + f * (next->z - c->z);
            x->edge = inside ? label : c->edge;
        }
        d = d_next;
    }
    return n;
}

SADMM_INLINE bool clip_near(const struct clip_corner *p, real x, real y, real tolerance)
{
    return real_abs(p->x - x) <= tolerance && real_abs(p->y - y) <= tolerance;
}

/* What makes corner i of the clipped polygon; 0: nothing of its own. */
SADMM_INLINE uint32_t clip_feature_id(const struct clip_feature *clip, const struct clip_feature *subject,
                                      bool clip_is_a, const struct clip_corner *poly, int count, int i, real tolerance)
{
    const int in = poly[i > 0 ? i - 1 : count - 1].edge, out = poly[i].edge;
    const int of_clip = clip_is_a ? FEATURE_VERTEX_A : FEATURE_VERTEX_B,
              of_subject = clip_is_a ? FEATURE_VERTEX_B : FEATURE_VERTEX_A;
    if (in < CLIP_CORNERS && out < CLIP_CORNERS)
        return polytope_feature(of_subject, 0, subject->vertex[out]) + 1;
    if (in >= CLIP_CORNERS && out >= CLIP_CORNERS) {
        const int p = in - CLIP_CORNERS, q = out - CLIP_CORNERS;
        if (p == q) return 0;
        return polytope_feature(of_clip, 0, clip->vertex[p == (q + 1) % clip->count ? p : q]) + 1;
    } else {
        const int side = (in >= CLIP_CORNERS ? in : out) - CLIP_CORNERS,
                  end = side + 1 < clip->count ? side + 1 : 0,
                  own = clip->corner[side].edge,
                  other = subject->corner[in >= CLIP_CORNERS ? out : in].edge;
        int k;
        for (k = 0; k < 2; ++k) /* the edge passes by a corner */
            if (clip_near(&clip->corner[k ? end : side], poly[i].x, poly[i].y, tolerance))
                return polytope_feature(of_clip, 0, clip->vertex[k ? end : side]) + 1;
        return polytope_feature(FEATURE_CROSSING, clip_is_a ? own : other, clip_is_a ? other : own);
    }
}

/* How much a point at (x, y) counts as outermost in the k-th of eight directions: what is higher by `separation`
 * touches after a turn about what is below, by 1 / 8 rad at most. */
SADMM_INLINE real outermost_along(int k, real x, real y, real separation)
{
    const real half = (real)0.70710678118654752;
    const real cosine = k % 4 == 2 ? 0 : k % 2 ? half : 1, sine = k % 4 == 0 ? 0 : k % 2 ? half : 1;
    return (k > 2 && k < 6 ? -cosine : cosine) * x + (k > 4 ? -sine : sine) * y - 8 * separation;
}

/* Of `count` points those to keep where there are too many: the deepest, and the outermost in eight directions.
 * Bits. */
SADMM_INLINE uint64_t clip_choice(const struct clip_corner *p, const real *separation, int count)
{
    uint64_t chosen = 0;
    int k, i, deepest = 0;
    if (count <= SADMM_MANIFOLD_POINTS) return ((uint64_t)1 << count) - 1;
    for (k = 0; k < SADMM_MANIFOLD_POINTS; ++k) {
        int best = 0;
        for (i = 1; i < count; ++i)
            if (outermost_along(k, p[i].x, p[i].y, separation[i]) > outermost_along(k, p[best].x, p[best].y,
                                                                                    separation[best])) best = i;
        chosen |= (uint64_t)1 << best;
    }
    for (i = 1; i < count; ++i)
        if (separation[i] < separation[deepest]) deepest = i;
    if (!(chosen >> deepest & 1)) {
        real nearest2 = SADMM_REAL_MAX;
        int nearest = 0;
        for (i = 0; i < count; ++i) {
            const real dx = p[i].x - p[deepest].x, dy = p[i].y - p[deepest].y;
            if ((chosen >> i & 1) && dx * dx + dy * dy < nearest2) {
                nearest2 = dx * dx + dy * dy;
                nearest = i;
            }
        }
        chosen &= ~((uint64_t)1 << nearest);
        chosen |= (uint64_t)1 << deepest;
    }
    return chosen;
}

/* How far a point may be beside a side. fa, fb: the faces, -1: none; na: the normal in a's frame. */
SADMM_INLINE real clip_tolerance(const struct polytope_pair *pair, int fa, int fb, vec3 na, vec3 n)
{
    const real ca = fa < 0 ? 1 : v3_dot(polytope_normal(&pair->a, fa), na),
               cb = fb < 0 ? 1 : -v3_dot(polytope_normal(&pair->b, fb), n),
               slope = real_sqrt(real_max(0, 1 - ca * ca)) / ca + real_sqrt(real_max(0, 1 - cb * cb)) / cb;
    const real snap = MANIFOLD_SNAP / 2;
    return pair->thin * (snap * slope > CLIP_SEPARATION ? CLIP_SEPARATION / slope : snap);
}

/* Sets m's normal to n, and its points to those of the faces that point along it. least: the separation of the two
 * along n; what tolerance has let stand beside a face is not nearer. */
SADMM_INLINE void clip_manifold(const struct polytope_pair *pair, vec3 n, real least, real limit, struct manifold *m)
{
    const vec3 na = m3_tmul(pair->R, n);
    const int fa = clip_face(&pair->a, na), fb = clip_face(&pair->b, v3_neg(n));
    const bool clip_is_a = fa >= 0;
    const real tolerance = clip_tolerance(pair, fa, fb, na, n);
    struct clip_feature clip, subject;
    struct clip_corner polygons[2][CLIP_POLYGON], *poly = polygons[0];
    real separations[CLIP_POLYGON];
    uint32_t features[CLIP_POLYGON];
    vec3 x1, x2, normal;
    real offset, along, slope_x, slope_y;
    uint64_t chosen;
    int count, k, i, kept = 0;

    m->normal = n;
    m->count = 0;
    if (fa < 0 && fb < 0) return;
    v3_tangents(n, &x1, &x2);
    clip_feature_of(pair, clip_is_a, clip_is_a ? fa : fb, n, x1, x2, n, &clip);
    clip_feature_of(pair, !clip_is_a, clip_is_a ? fb : -1, clip_is_a ? v3_neg(n) : na, x1, x2, n, &subject);

    count = subject.count;
    for (k = 0; k < count; ++k) {
        poly[k] = subject.corner[k];
        poly[k].edge = k;
    }
    for (k = 0; k < clip.count && count > 0; ++k) {
        struct clip_corner *next = poly == polygons[0] ? polygons[1] : polygons[0];
        count = clip_by_side(poly, count, &clip.corner[k], &clip.corner[k + 1 < clip.count ? k + 1 : 0],
                             clip_is_a ? 1 : -1, CLIP_CORNERS + k, tolerance, next);
        poly = next;
    }

    /* the clipping face's height along n over (x, y): its plane */
    normal = clip_is_a ? m3_mul(pair->R, polytope_normal(&pair->a, fa)) : polytope_normal(&pair->b, fb);
    offset = clip_is_a ? polytope_offset(&pair->a, fa) + v3_dot(normal, pair->t) : polytope_offset(&pair->b, fb);
    along = v3_dot(normal, n);
    slope_x = v3_dot(normal, x1) / along;
    slope_y = v3_dot(normal, x2) / along;
    offset /= along;
    for (i = 0; i < count; ++i) {
        const real other = offset - slope_x * poly[i].x - slope_y * poly[i].y, own = poly[i].z,
                   separation = real_max((clip_is_a ? own - other : other - own) - pair_radii(pair), least);
        const uint32_t feature = clip_feature_id(&clip, &subject, clip_is_a, poly, count, i, tolerance);
        struct clip_corner at = poly[i];
        bool twice = feature == 0 || separation > limit + pair->slack;
        for (k = 0; k < kept; ++k)
            twice |= features[k] == feature || (clip_near(&polygons[0][k], at.x, at.y, tolerance) &&
                                                real_abs(separations[k] - separation) <= 2 * tolerance);
        if (twice) continue;
        /* halfway between the two surfaces */
        at.z = (own + other + pair->a.radius - pair->b.radius) / 2;
        separations[kept] = separation;
        features[kept] = feature;
        polygons[0][kept++] = at; /* behind i, or in the other array */
    }
    chosen = clip_choice(polygons[0], separations, kept);
    for (i = 0; i < kept; ++i)
        if (chosen >> i & 1) {
            const struct clip_corner *p = &polygons[0][i];
            manifold_add(m, v3_madd(v3_madd(v3_scale(x1, p->x), p->y, x2), p->z, n), separations[i], features[i]);
        }
}

#endif
