/* A convex hull (b) against plane, sphere, capsule, box and hull (a), in the frame of b.
 *
 *   1. The axis of the last step. Where it is a face's, and the points of the clipped faces prove that no other is
 *      better by enough to take its place, that is all: what rests never asks for more.
 *   2. The distance (gjk.h) or, where the two meet, the depth (epa.h), with the nearest points.
 *   3. The axis to use. As for boxes (manifold_box.h): the last step's stays unless clearly beaten, and its side until
 *      the two are apart; a face within 8 degrees of the nearest points' normal is preferred to what is not a face.
 *   4. The points of the faces that point along it (polytope_face.h); the nearest points as well where these do not
 *      have them.
 *
 * Round shapes are a core, a point or a segment or a hull that has been rounded, with a radius: outside, the cores'
 * distance is exact, and so is the normal; no face is preferred to it.
 */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_HULL_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_HULL_H

#include "collision/convex/epa.h"
#include "collision/convex/polytope_face.h"
#include "collision/shapes/geometry.h"
#include "manifold_plane.h"
#include "manifold_round.h"

/* Cores nearer than this share of their size: the vector between them says no more where it points. */
#define HULL_TOUCH (sizeof(real) == 4 ? (real)1e-4 : (real)1e-9)

SADMM_INLINE void polytope_pair_make(const struct sadmm_geometry *a, const struct sadmm_geometry *b,
                                     const double *hulls, const struct pair_pose *pose, struct polytope_pair *pair)
{
    int i;
    polytope_of(a, hulls, &pair->a);
    polytope_of(b, hulls, &pair->b);
    for (i = 0; i < 3; ++i) pair->R.r[i] = r3_vec3(pose->R[i]);
    pair->t = r3_vec3(pose->t);
    pair->thin = (real)min_of(geometry_thickness(a), geometry_thickness(b));
    pair->size = (real)(geometry_radius(a) + geometry_radius(b)) + v3_norm(pair->t);
    pair->slack = 8 * SADMM_EPSILON * pair->size;
}

/* Up to here an axis that was used before is good enough. */
SADMM_INLINE real hull_bonus(const struct polytope_pair *pair, real separation)
{
    return MANIFOLD_KEEP_DEPTH * real_max(0, -separation) + MANIFOLD_KEEP_EXTENT * pair->thin;
}

/* What is left between the two, at most, seen from a point of b's surface that is inside a, or of a's inside b: such a
 * point has to leave by some face. x: halfway between the two surfaces, `separation` < 0 apart along the axis. */
SADMM_INLINE real hull_way_out(const struct polytope_pair *pair, const struct polytope_axis *axis, vec3 x,
                               real separation)
{
    const bool of_a = axis->kind == AXIS_FACE_A;
    const struct polytope *p = of_a ? &pair->a : &pair->b;
    vec3 inside = v3_madd(x, of_a ? separation / 2 + pair->b.radius : -separation / 2 - pair->a.radius, axis->n);
    if (of_a) inside = m3_tmul(pair->R, v3_sub(inside, pair->t));
    return real_max(separation, polytope_height(p, inside, of_a ? axis->a : axis->b) - pair_radii(pair));
}

/* Is a face axis a witness by its points: does no axis beat it by more than the bonus of the last step's axis? */
SADMM_INLINE bool hull_is_witness(const struct polytope_pair *pair, const struct polytope_axis *axis,
                                  const struct manifold *m)
{
    const real most = axis->separation + hull_bonus(pair, axis->separation);
    vec3 middle = v3(0, 0, 0);
    real separation = 0;
    int k, deepest = 0;
    if (m->count == 0) return false;
    for (k = 0; k < m->count; ++k) {
        middle = v3_add(middle, m->points[k].position);
        separation += m->points[k].separation;
        if (m->points[k].separation < m->points[deepest].separation) deepest = k;
    }
    /* two points of the cores as near to each other as the planes are: nothing is nearer, and no plane parts them
     * further; of sharp ones as near as their points are distinguished by (hull_add_nearest) */
    if (axis->separation >= -pair_radii(pair))
        return m->points[deepest].separation <=
               axis->separation + (pair_radii(pair) > 0 ? 2 * pair->slack : MANIFOLD_FLAT * pair->thin);
    /* the face along the normal need not have the deepest corner */
    if (m->points[deepest].separation > axis->separation + MANIFOLD_FLAT * pair->thin) return false;
    middle = v3_scale(middle, (real)1 / (real)m->count);
    separation /= (real)m->count;
    return hull_way_out(pair, axis, middle, separation) <= most ||
           hull_way_out(pair, axis, m->points[deepest].position, m->points[deepest].separation) <= most;
}

/* Where rounding leaves nothing else: the best of all faces. */
SADMM_RARE void hull_best_face(const struct polytope_pair *pair, struct polytope_axis *best)
{
    struct polytope_axis axis;
    int f;
    axis_of_face_b(pair, 0, best);
    for (f = 1; f < pair->b.faces; ++f) {
        axis_of_face_b(pair, f, &axis);
        if (axis.separation > best->separation) *best = axis;
    }
    for (f = 0; f < pair->a.faces; ++f) {
        axis_of_face_a(pair, f, &axis);
        if (axis.separation > best->separation) *best = axis;
    }
}

/* Two different numbers among a few; false: there are more, or fewer. */
SADMM_INLINE bool two_of(const int *numbers, int count, int two[2])
{
    int k, found = 1;
    two[0] = numbers[0];
    two[1] = numbers[0];
    for (k = 1; k < count; ++k) {
        if (numbers[k] == two[0] || (found == 2 && numbers[k] == two[1])) continue;
        if (found == 2) return false;
        two[found++] = numbers[k];
    }
    return found == 2;
}

/* Are the nearest features an edge of each? Then the axis is theirs. */
SADMM_INLINE void hull_edges_of(const struct polytope_pair *pair, const struct gjk_simplex *s,
                                struct polytope_axis *axis)
{
    struct polytope_axis edges;
    int of_a[4], of_b[4], a[2], b[2], k, ea, eb;
    for (k = 0; k < s->count; ++k) {
        of_a[k] = s->p[k].a;
        of_b[k] = s->p[k].b;
    }
    if (!two_of(of_a, s->count, a) || !two_of(of_b, s->count, b)) return;
    ea = polytope_edge_between(&pair->a, a[0], a[1]);
    eb = polytope_edge_between(&pair->b, b[0], b[1]);
    if (ea < 0 || eb < 0 || !axis_of_edges(pair, ea, eb, &edges)) return;
    if (edges.separation >= axis->separation - pair->slack) *axis = edges;
}

/* The points of two edges that are nearest to each other. False: the edges do not cross, seen along the axis. */
SADMM_INLINE bool hull_crossing(const struct polytope_pair *pair, const struct polytope_axis *axis, vec3 *pa, vec3 *pb)
{
    vec3 a, b;
    const vec3 da = edge_of_a(pair, axis->a, &a), db = edge_of_b(pair, axis->b, &b);
    const real la = v3_norm(da), lb = v3_norm(db);
    const vec3 ua = v3_scale(da, 1 / la), ub = v3_scale(db, 1 / lb);
    real s, t;
    segments_closest(v3_madd(a, (real)0.5, da), ua, la / 2, v3_madd(b, (real)0.5, db), ub, lb / 2, &s, &t);
    *pa = v3_madd(a, la / 2 + s, ua);
    *pb = v3_madd(b, lb / 2 + t, ub);
    return v3_norm(v3_cross(axis->n, v3_sub(*pb, *pa))) <= MANIFOLD_KEEP_EXTENT * pair->thin;
}

/* Is the last step's axis one of two edges and a witness by their nearest points: does no other beat it by more than
 * its bonus? pa, pb: these points. While the two are apart, where they are as near as the planes across the axis are.
 * Else each of them is inside of the other body, and no direction is less deep than its way to that one's surface. */
SADMM_INLINE bool hull_edges_are_witness(const struct polytope_pair *pair, const struct polytope_axis *axis, vec3 *pa,
                                         vec3 *pb, uint32_t *feature)
{
    const real cores = axis->separation + pair_radii(pair);
    vec3 d;
    if (axis->kind != AXIS_EDGES || !hull_crossing(pair, axis, pa, pb)) return false;
    d = v3_sub(*pb, *pa);
    if (v3_dot(axis->n, d) > cores + 2 * pair->slack || v3_norm(v3_cross(axis->n, d)) > 2 * pair->slack) return false;
    if (cores <= HULL_TOUCH * pair->size &&
        real_min(polytope_height(&pair->b, *pa, -1),
                 polytope_height(&pair->a, m3_tmul(pair->R, v3_sub(*pb, pair->t)), -1)) >
            cores + hull_bonus(pair, axis->separation))
        return false;
    *pa = v3_madd(*pa, pair->a.radius, axis->n);
    *pb = v3_madd(*pb, -pair->b.radius, axis->n);
    *feature = polytope_feature(FEATURE_CROSSING, axis->a, axis->b);
    return true;
}

SADMM_INLINE void hull_walk(const struct polytope_pair *pair, vec3 start, real limit, struct gjk_walk *walk)
{
    walk->end = gjk_distance(pair, start, limit + pair_radii(pair) + pair->slack, &walk->simplex, &walk->v);
}

/* The axis that the nearest points say, or those that are least deep; and the points. False: too far apart. */
SADMM_INLINE bool hull_nearest_from(const struct polytope_pair *pair, const struct gjk_walk *walk, real limit,
                                         struct polytope_axis *axis, vec3 *pa, vec3 *pb, uint32_t *feature)
{
    struct gjk_simplex s = walk->simplex;
    vec3 v = walk->v;
    real length, height;
    bool apart;
    if (walk->end == GJK_FAR) return false;
    length = v3_norm(v);
    apart = walk->end == GJK_APART && length > HULL_TOUCH * pair->size;
    axis->kind = AXIS_FREE;
    axis->a = axis->b = 0;
    if (apart) {
        axis->n = v3_scale(v, -1 / length);
        axis->separation = length - pair_radii(pair);
        if (s.count == 3) simplex_weigh(&s, v, axis->n);
    } else if (epa_depth(pair, &s, &v, &height)) {
        axis->n = v;
        axis->separation = -height - pair_radii(pair);
    } else {
        hull_best_face(pair, axis);
    }
    if (pair->a.faces > 0) hull_edges_of(pair, &s, axis);
    if (axis->kind != AXIS_EDGES || !hull_crossing(pair, axis, pa, pb)) gjk_points(pair, &s, pa, pb);
    *pa = v3_madd(*pa, pair->a.radius, axis->n);
    *pb = v3_madd(*pb, -pair->b.radius, axis->n);
    *feature = axis->kind == AXIS_EDGES ? polytope_feature(FEATURE_CROSSING, axis->a, axis->b)
                                        : polytope_feature(FEATURE_NEAREST, 0, 0);
    return axis->separation <= limit + pair->slack;
}

SADMM_INLINE bool hull_nearest(const struct polytope_pair *pair, vec3 start, real limit, struct polytope_axis *axis,
                               vec3 *pa, vec3 *pb, uint32_t *feature)
{
    struct gjk_walk walk;
    hull_walk(pair, start, limit, &walk);
    return hull_nearest_from(pair, &walk, limit, axis, pa, pb, feature);
}

/* The better one of the two faces nearest to the axis; false: none is within 8 degrees of it. */
SADMM_INLINE bool hull_face_beside(const struct polytope_pair *pair, vec3 n, struct polytope_axis *face)
{
    const vec3 na = m3_tmul(pair->R, n), nb = v3_neg(n);
    const int fa = polytope_face_along(&pair->a, na), fb = polytope_face_along(&pair->b, nb);
    const bool by_a = v3_dot(polytope_normal(&pair->a, fa), na) > MANIFOLD_COS_NEAR,
               by_b = v3_dot(polytope_normal(&pair->b, fb), nb) > MANIFOLD_COS_NEAR;
    struct polytope_axis other;
    if (by_a) axis_of_face_a(pair, fa, face);
    if (by_b) {
        axis_of_face_b(pair, fb, &other);
        if (!by_a || other.separation > face->separation) *face = other;
    }
    return by_a || by_b;
}

/* a: hull or box. `kept`: the last step's axis, `known`: there is one. */
SADMM_INLINE void hull_choose(const struct polytope_pair *pair, const struct polytope_axis *kept, bool known,
                              struct polytope_axis *axis)
{
    /* round edges that touch have the nearest points' normal, whatever it was before: a face is taken where it is that
     * normal */
    const bool round = pair_radii(pair) > 0 && axis->separation >= -pair_radii(pair);
    struct polytope_axis face;
    real more;
    if (known && !round) {
        /* past the middle of a thin one the other side is nearer, but wrong */
        const bool turned = axis->separation < 0 && v3_dot(kept->n, axis->n) < -MANIFOLD_COS_OPPOSITE;
        if (turned || axis->separation <= kept->separation + hull_bonus(pair, kept->separation)) *axis = *kept;
        if (turned) return;
    }
    if (axis->kind == AXIS_FACE_A || axis->kind == AXIS_FACE_B || (round && axis->kind != AXIS_FREE) ||
        !hull_face_beside(pair, axis->n, &face))
        return;
    /* the bonus of a cached axis does not count against a face of the same direction */
    more = round ? 2 * pair->slack : (real)0.05 * real_abs(face.separation) + MANIFOLD_KEEP_EXTENT * pair->thin;
    if (axis->separation <= face.separation + more) *axis = face;
}

/* The point halfway between pa and pb, unless m has one that is as deep. */
SADMM_INLINE void hull_add_nearest(real thin, vec3 pa, vec3 pb, uint32_t feature, struct manifold *m)
{
    const real separation = v3_dot(m->normal, v3_sub(pb, pa)), even = separation + MANIFOLD_FLAT * thin;
    const vec3 x = v3_scale(v3_add(pa, pb), (real)0.5);
    int k, least = 0;
    for (k = 0; k < m->count; ++k) {
        if (m->points[k].feature == feature || m->points[k].separation <= even) return;
        if (m->points[k].separation > m->points[least].separation) least = k;
    }
    if (m->count == SADMM_MANIFOLD_POINTS) { /* in place of the one that is farthest apart */
        m->points[least].position = x;
        m->points[least].separation = separation;
        m->points[least].feature = feature;
    } else {
        manifold_add(m, x, separation, feature);
    }
}

/* The last step's axis. False: there is none. */
SADMM_INLINE bool hull_recall(const struct polytope_pair *pair, uint32_t cache, struct polytope_axis *kept)
{
    kept->kind = AXIS_FREE; /* until something is known */
    kept->n = v3(0, 0, 0);
    kept->separation = 0;
    kept->a = kept->b = 0;
    return axis_recall(pair, cache, kept);
}

/* What the last step's axis says by itself: true, and the manifold is there, or there is none. Else *start is a
 * direction to search for the nearest points along; `known`: *kept is an axis. */
SADMM_INLINE bool hull_by_memory(const struct polytope_pair *pair, real limit, uint32_t cache,
                                 struct polytope_axis *kept, bool *known, vec3 *start, struct manifold *m)
{
    *known = hull_recall(pair, cache, kept);
    *start = v3_neg(pair->t);
    if (!*known) return false;
    *start = kept->n;
    if (kept->separation > limit + pair->slack) return true;
    if (kept->kind == AXIS_EDGES || pair->a.faces == 0) return false;
    clip_manifold(pair, kept->n, kept->separation, limit, m);
    m->cache = cache;
    if (hull_is_witness(pair, kept, m)) return true;
    m->count = 0;
    m->cache = 0;
    return false;
}

/* The last step's axis of two edges in place of the nearest one: do they still cross? */
SADMM_INLINE void hull_keep_edges(const struct polytope_pair *pair, const struct polytope_axis *nearest,
                                  struct polytope_axis *axis, vec3 *pa, vec3 *pb, uint32_t *feature)
{
    vec3 on_a, on_b;
    if (axis->kind != AXIS_EDGES || axis_memory(axis) == axis_memory(nearest)) return;
    if (!hull_crossing(pair, axis, &on_a, &on_b) || /* or not the outermost along it? */
        v3_dot(axis->n, v3_sub(on_b, on_a)) > axis->separation + hull_bonus(pair, axis->separation)) {
        *axis = *nearest;
        return;
    }
    *pa = on_a;
    *pb = on_b;
    *feature = polytope_feature(FEATURE_CROSSING, axis->a, axis->b);
}

/* Round shapes whose core is inside keep to the last step's side as well, and to its axis. */
SADMM_INLINE void hull_choose_inside(const struct polytope_pair *pair, const struct polytope_axis *kept, bool known,
                                     struct polytope_axis *axis)
{
    if (!known || axis->separation >= -pair_radii(pair)) return;
    if (v3_dot(kept->n, axis->n) < -MANIFOLD_COS_OPPOSITE ||
        axis->separation <= kept->separation + hull_bonus(pair, kept->separation))
        *axis = *kept;
}

/* Is some face of b seen along n? Round shapes beside an edge or a corner have their nearest point alone. */
SADMM_INLINE bool hull_has_face_along(const struct polytope_pair *pair, vec3 n)
{
    const vec3 outward = v3_neg(n);
    return v3_dot(polytope_normal(&pair->b, polytope_face_along(&pair->b, outward)), outward) > MANIFOLD_COS_NEAR;
}

/* The manifold by the nearest points, or those that are least deep, of axis `nearest`. */
SADMM_INLINE void hull_by_nearest(const struct polytope_pair *pair, const struct polytope_axis *kept, bool known,
                                  const struct polytope_axis *nearest, vec3 pa, vec3 pb, uint32_t feature, real limit,
                                  struct manifold *m)
{
    struct polytope_axis axis = *nearest;
    if (pair->a.faces > 0) hull_choose(pair, kept, known, &axis);
    else hull_choose_inside(pair, kept, known, &axis);
    hull_keep_edges(pair, nearest, &axis, &pa, &pb, &feature);
    if (pair->a.faces > 0 || hull_has_face_along(pair, axis.n))
        clip_manifold(pair, axis.n, axis.separation, limit, m);
    /* not over each other */
    if (m->count == 0 && (axis.kind == AXIS_FACE_A || axis.kind == AXIS_FACE_B)) axis = *nearest;
    m->normal = axis.n;
    m->cache = axis_memory(&axis);
    hull_add_nearest(pair->thin, pa, pb, feature, m); /* the face along the normal need not have the deepest corner */
}

/* In two parts, for devices, where the threads of a warp wait for each other. What is little work comes first: what
 * goes on as it was, and what is too far apart. False: the rest has to be done, from where `walk` has ended. */
SADMM_RARE bool hull_manifold_at_once(const struct sadmm_geometry *a, const struct sadmm_geometry *b,
                                      const double *hulls, const struct pair_pose *pose, real limit, uint32_t cache,
                                      struct gjk_walk *walk, struct manifold *m)
{
    struct polytope_pair pair;
    struct polytope_axis kept;
    vec3 start;
    bool known;
    m->count = 0;
    m->cache = 0;
    polytope_pair_make(a, b, hulls, pose, &pair);
    if (hull_by_memory(&pair, limit, cache, &kept, &known, &start, m)) return true;
    hull_walk(&pair, start, limit, walk);
    return walk->end == GJK_FAR;
}

/* The rest. */
SADMM_RARE void hull_manifold_from(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *hulls,
                                   const struct pair_pose *pose, real limit, uint32_t cache,
                                   const struct gjk_walk *walk, struct manifold *m)
{
    struct polytope_pair pair;
    struct polytope_axis kept, nearest;
    vec3 pa, pb;
    uint32_t feature;
    bool known;
    m->count = 0;
    m->cache = 0;
    polytope_pair_make(a, b, hulls, pose, &pair);
    known = hull_recall(&pair, cache, &kept);
    if (hull_edges_are_witness(&pair, &kept, &pa, &pb, &feature)) nearest = kept;
    else if (!hull_nearest_from(&pair, walk, limit, &nearest, &pa, &pb, &feature)) return;
    hull_by_nearest(&pair, &kept, known, &nearest, pa, pb, feature, limit, m);
}

/* The whole. */
SADMM_RARE void hull_manifold(const struct sadmm_geometry *a, const struct sadmm_geometry *b, const double *hulls,
                              const struct pair_pose *pose, real limit, uint32_t cache, struct manifold *m)
{
#ifdef __CUDACC__ /* its compiler takes minutes for another copy of the two */
    struct gjk_walk walk;
    if (!hull_manifold_at_once(a, b, hulls, pose, limit, cache, &walk, m))
        hull_manifold_from(a, b, hulls, pose, limit, cache, &walk, m);
#else
    struct polytope_pair pair;
    struct polytope_axis kept, nearest;
    vec3 pa, pb, start;
    uint32_t feature;
    bool known;

    polytope_pair_make(a, b, hulls, pose, &pair);
    if (hull_by_memory(&pair, limit, cache, &kept, &known, &start, m)) return;
    if (hull_edges_are_witness(&pair, &kept, &pa, &pb, &feature)) nearest = kept;
    else if (!hull_nearest(&pair, start, limit, &nearest, &pa, &pb, &feature)) return;
    hull_by_nearest(&pair, &kept, known, &nearest, pa, pb, feature, limit, m);
#endif
}

/* A vertex over the plane, or the lowest point of the ball around it. */
SADMM_INLINE void hull_plane_point(struct manifold *m, const struct polytope *p, int v, real offset)
{
    const vec3 x = polytope_vertex(p, v);
    const real s = v3_dot(m->normal, x) + offset - p->radius;
    manifold_add(m, v3_madd(x, -(s / 2 + p->radius), m->normal), s, (uint32_t)v + 1);
}

/* a: the plane (manifold_plane.h). Of more vertices within the limit than a manifold has points, the lowest one and
 * those that are outermost, and low, in eight directions. */
SADMM_RARE void hull_plane_manifold(const struct sadmm_geometry *b, const double *hulls, const struct pair_pose *pose,
                                    real limit, struct manifold *m)
{
    struct polytope p;
    vec3 n, x1, x2;
    const real offset = plane_offset(pose, &n);
    int v, k, within = 0, lowest = 0, best[SADMM_MANIFOLD_POINTS];
    real least = SADMM_REAL_MAX, most[SADMM_MANIFOLD_POINTS];
    bool has_lowest = false;

    polytope_at(hulls, b->hull, &p);
    m->normal = n;
    v3_tangents(n, &x1, &x2);
    for (v = 0; v < p.vertices; ++v) {
        const vec3 x = polytope_vertex(&p, v);
        const real s = v3_dot(n, x) + offset - p.radius, sx = v3_dot(x1, x), sy = v3_dot(x2, x);
        if (s > limit) continue;
        if (s < least) {
            least = s;
            lowest = v;
        }
        for (k = 0; k < SADMM_MANIFOLD_POINTS; ++k) {
            const real along = outermost_along(k, sx, sy, s);
            if (within == 0 || along > most[k]) {
                most[k] = along;
                best[k] = v;
            }
        }
        if (within++ < SADMM_MANIFOLD_POINTS) hull_plane_point(m, &p, v, offset);
    }
    if (within <= SADMM_MANIFOLD_POINTS) return;
    m->count = 0;
    for (k = 0; k < SADMM_MANIFOLD_POINTS; ++k) {
        int i;
        bool twice = false;
        for (i = 0; i < k; ++i) twice |= best[i] == best[k];
        has_lowest |= best[k] == lowest;
        if (!twice) hull_plane_point(m, &p, best[k], offset);
    }
    if (!has_lowest) {
        const vec3 x = polytope_vertex(&p, lowest);
        int i, nearest = 0;
        real nearest2 = SADMM_REAL_MAX;
        for (i = 0; i < m->count && m->count == SADMM_MANIFOLD_POINTS; ++i) {
            const real d2 = v3_norm2(v3_sub(m->points[i].position, x));
            if (d2 < nearest2) {
                nearest2 = d2;
                nearest = i;
            }
        }
        if (m->count < SADMM_MANIFOLD_POINTS) nearest = m->count++;
        m->points[nearest].position = v3_madd(x, -(least / 2 + p.radius), n);
        m->points[nearest].separation = least;
        m->points[nearest].feature = (uint32_t)lowest + 1;
    }
}

#endif
