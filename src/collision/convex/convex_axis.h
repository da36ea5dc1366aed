/* The direction along which two convex bodies are farthest apart, or least deep in each other, with the nearest points.
 *
 * Where the two are apart there is one optimum, beside the shortest vector of a - b that a walk finds; where they are
 * not, s (convex_newton.h) has several.
 *
 * 1. The optimum beside the last step's direction, by Newton's method alone, if that is certain of it. If it parts the
 *    two there is no other; else it is the one to stay with while they are not apart, nor deep in each other.
 * 2. Else, apart: the same from the shortest vector; where Newton's method is not certain, also from what is beside.
 * 3. Else of all of them the best one. A polytope inside a - b grows where its faces are nearest to the origin (epa.h).
 * No direction across a face is less deep than the face; the optimum that Newton's method, or a flat, has beside it is
 * no less deep than the least. A face that is no nearer than the best optimum that has been found is done with, until
 *    there are no others.
 */
#ifndef SADMM_COLLISION_CONVEX_CONVEX_AXIS_H
#define SADMM_COLLISION_CONVEX_CONVEX_AXIS_H

#include "convex_flat.h"
#include "convex_newton.h"

/* Depth up to which the side that the last step knows is not doubted, as a share of the thinner extent. */
#define CONVEX_SHALLOW ((real)0.05)
/* What is less deep than this share of its face's depth over it has that face's optimum: of bodies that overlap, which
 * may have several beside each other, and of others. */
#define CONVEX_FINE ((real)0.0005)
#define CONVEX_COARSE ((real)0.005)
/* How far apart b is held from a, as shares of the thinner extent: twice the depth, within these bounds. Further apart
 * moves are small where the two meet by corners, nearer the vector between the two says less. */
#define CONVEX_APART ((real)0.05)
#define CONVEX_NEAR (sizeof(real) == 4 ? (real)1e-3 : (real)1e-6)
enum { CONVEX_MOVES = 8, CONVEX_TRIES = 24 };

SADMM_INLINE void convex_activate_one(const struct difference_point *point, struct convex_active *active)
{
    active->count = 1;
    active->a[0] = point->a;
    active->b[0] = point->b;
    active->weight[0] = 1;
}

/* n, with what reaches farthest along it. */
SADMM_INLINE void convex_axis_along(const struct convex_pair *pair, vec3 n, struct convex_axis *axis,
                                    struct convex_active *active)
{
    const struct difference_point zero = {{0, 0, 0}, 0, 0}, point = convex_support(pair, n, &zero);
    axis->n = n;
    axis->separation = -v3_dot(n, point.w) - convex_radii(pair);
    convex_activate_one(&point, active);
}

/* b is held away from a along the n that is known, by so much, D, that they are well apart, and the shortest vector
 * there is the next n. It is where s(n) - D (1 - n . n_before) is largest, so that s grows with each move (the proximal
 * point method, Rockafellar 1976, on the sphere). active: the pieces that the last one ended with. */
SADMM_CALLED void convex_move(struct convex_pair *pair, real nearest, vec3 *n, real *separation,
                              struct convex_active *active)
{
    int move;
    for (move = 0; move < CONVEX_MOVES; ++move) {
        const real depth = real_max(-(*separation + convex_radii(pair)), 0),
                   held = depth + real_clamp(2 * depth, nearest * pair->thin, CONVEX_APART * pair->thin);
        struct gjk_simplex s;
        enum gjk_end end;
        vec3 v;
        real length, there;
        pair->shift = v3_scale(*n, held);
        end = convex_distance(pair, *n, SADMM_REAL_MAX, &s, &v);
        pair->shift = v3(0, 0, 0);
        length = v3_norm(v);
        if (end != GJK_APART || !(length > 0)) return;
        v = v3_scale(v, -1 / length);
        there = convex_separation(pair, v);
        if (!(there >= *separation - pair->slack)) return;
        convex_activate(&s, active);
        *n = v;
        if (there <= *separation + (real)1e-4 * depth) {
            *separation = there;
            return;
        }
        *separation = there;
    }
}

/* The optimum beside axis->n. False: not certain. */
SADMM_CALLED bool convex_local(struct convex_pair *pair, struct convex_axis *axis, struct convex_active *active)
{
    const real enough = pair->enough;
    if (convex_polish(pair, active, &axis->n, &axis->separation)) return true;
    convex_move(pair, CONVEX_APART, &axis->n, &axis->separation, active);
    if (convex_polish(pair, active, &axis->n, &axis->separation)) return true;
    pair->enough = 0;
    convex_move(pair, CONVEX_NEAR, &axis->n, &axis->separation, active);
    pair->enough = enough;
    return convex_polish(pair, active, &axis->n, &axis->separation);
}

/* The nearest face of the polytope, NULL: there is none left to ask. */
SADMM_INLINE struct epa_face *convex_nearest_face(struct epa *e)
{
    struct epa_face *best = &e->face[0];
    int f;
    for (f = 1; f < e->faces; ++f)
        if (e->face[f].height < best->height) best = &e->face[f];
    return e->faces > 0 && best->height < SADMM_REAL_MAX ? best : NULL;
}

/* The better one of two. */
SADMM_INLINE bool convex_take(const struct convex_axis *other, const struct convex_active *of_other,
                              struct convex_axis *axis, struct convex_active *active)
{
    if (!(other->separation > axis->separation)) return false;
    *axis = *other;
    *active = *of_other;
    return true;
}

/* Bodies that are all but aligned have optima side by side, at directions of their own, a thousandth of a radian apart:
 * too near to each other for faces of a polytope. Those of c within a degree of n (own frame): of a flat, and across
 * straight lines, of a round side the one at n and the one towards the other body. How many. */
#define CONVEX_BESIDE ((real)0.99985)
enum { CONVEX_OWN = 4 };
SADMM_INLINE int convex_own_directions(const struct convex *c, vec3 n, vec3 to_other, vec3 own[CONVEX_OWN])
{
    const int flat = convex_flat(c, n, CONVEX_BESIDE);
    int count = 0;
    if (flat >= 0) own[count++] = convex_flat_normal(c, flat);
    if (c->form != CONVEX_POLYTOPE) {
        const real round2 = to_other.x * to_other.x + to_other.y * to_other.y;
        struct convex_feature line;
        if (convex_line(c, n, &line) && v3_dot(line.normal, n) >= CONVEX_BESIDE) own[count++] = line.normal;
        if (round2 > 0) {
            const real turn = real_sqrt((n.x * n.x + n.y * n.y) / round2);
            if (convex_line(c, v3(turn * to_other.x, turn * to_other.y, n.z), &line) &&
                v3_dot(line.normal, n) >= CONVEX_BESIDE)
                own[count++] = line.normal;
        }
    } else if (c->p.edges > 0) { /* edges of the corner */
        const int v = polytope_support(&c->p, n, 0), last = c->p.vertex_first[v + 1];
        int k;
        for (k = c->p.vertex_first[v]; k < last && count < CONVEX_OWN; ++k) {
            const vec3 edge = v3_sub(polytope_vertex(&c->p, c->p.vertex_next[k]), polytope_vertex(&c->p, v)),
                       across = v3_madd(n, -v3_dot(n, edge) / v3_norm2(edge), edge);
            const real length = v3_norm(across);
            if (length >= CONVEX_BESIDE) own[count++] = v3_scale(across, 1 / length);
        }
    }
    return count;
}

/* Caps of both within a degree of n: between their normals h is that of two rims, each with its kink at one end. As far
 * as they are parallel it is ra |x| + rb |x - tilt| - w . x, x from a's normal to n, tilt to b's, w from a's centre to
 * b's. Where that is least the ways to x from the two kinks, u and v, are those of a triangle, w = ra u + rb v: where
 * the rims cross, seen along n. There are two such places, and x is at most at one of them, where it is ahead of both
 * kinks. False: at none; one of the caps' normals is better. */
SADMM_INLINE bool convex_where_rims_cross(const struct convex_pair *pair, vec3 n, vec3 *crossing)
{
    const struct convex *a = &pair->a, *b = &pair->b;
    const int of_a = a->form == CONVEX_POLYTOPE ? -1 : convex_flat(a, m3_tmul(pair->R, n), CONVEX_BESIDE),
              of_b = b->form == CONVEX_POLYTOPE ? -1 : convex_flat(b, v3_neg(n), CONVEX_BESIDE);
    vec3 normal, other, centres, w, across;
    real length, ra, rb, u1, u2, v1, v2, sine, along;
    int way;
    if (of_a < 0 || of_b < 0) return false;
    ra = a->size.x;
    rb = b->size.x;
    normal = m3_mul(pair->R, convex_flat_normal(a, of_a));
    other = v3_neg(convex_flat_normal(b, of_b));
    centres = v3_neg(v3_madd(v3_madd(pair->t, a->size.y, normal), b->size.y, other));
    w = v3_madd(centres, -v3_dot(centres, normal), normal);
    length = v3_norm(w);
    if (!(length > 0)) return false;
    u1 = (ra * ra + length * length - rb * rb) / (2 * ra * length);
    if (!(real_abs(u1) < 1)) return false; /* one within the other, or beside it */
    u2 = real_sqrt(1 - u1 * u1);
    v1 = (length - ra * u1) / rb;
    v2 = ra * u2 / rb;
    sine = u1 * v2 + u2 * v1;
    w = v3_scale(w, 1 / length);
    across = v3_cross(normal, w);
    along = v3_dot(other, w);
    for (way = -1; way <= 1; way += 2) {
        const real beside = (real)way * v3_dot(other, across), from_a = along * v2 + beside * v1,
                   from_b = beside * u1 - along * u2;
        if (!(from_a > 0 && from_b > 0 && sine > 0)) continue;
        *crossing = convex_turned(normal, from_a / sine * u1, w, (real)way * from_a / sine * u2, across);
        return true;
    }
    return false;
}

SADMM_RARE void convex_ask_beside(struct convex_pair *pair, struct convex_axis *axis, struct convex_active *active)
{
    const vec3 n = axis->n;
    int s, k;
    for (s = 0; s < 3; ++s) { /* a's, b's, and of both */
        vec3 own[CONVEX_OWN];
        const int count = s == 2 ? convex_where_rims_cross(pair, n, own)
                                 : convex_own_directions(s ? &pair->b : &pair->a, s ? v3_neg(n) : m3_tmul(pair->R, n),
                                                         s ? pair->t : v3_neg(m3_tmul(pair->R, pair->t)), own);
        for (k = 0; k < count; ++k) {
            const vec3 from = s == 2 ? own[k] : s ? v3_neg(own[k]) : m3_mul(pair->R, own[k]);
            const real beside = v3_norm2(v3_cross(from, n));
            struct convex_axis other;
            struct convex_active of_other;
            if (beside <= 256 * SADMM_EPSILON * SADMM_EPSILON) continue; /* the same */
            convex_axis_along(pair, from, &other, &of_other);
            /* so near to n the way from there leads back, unless it is better already */
            if (beside <= 16 * SADMM_EPSILON && other.separation <= axis->separation + pair->equal) continue;
            convex_local(pair, &other, &of_other);
            if (other.separation > axis->separation + pair->equal) convex_take(&other, &of_other, axis, active);
        }
    }
}

/* 3. simplex: of a - b, around the origin or beside it. axis: one to begin with. */
SADMM_RARE void convex_way_out(struct convex_pair *pair, const struct gjk_simplex *simplex, struct convex_axis *axis,
                               struct convex_active *active)
{
    struct epa e;
    uint32_t held = 0; /* by this flat */
    int tries = 0;
    bool sure = false, witness = false; /* is axis an optimum, the best one? */
    if (!convex_epa_begin(pair, simplex, &e)) { /* a - b is flat but for rounding */
        convex_local(pair, axis, active);
        return;
    }
    while (tries < CONVEX_TRIES) {
        const real best = -(axis->separation + convex_radii(pair)),
                   fine = best > pair->equal ? CONVEX_FINE : CONVEX_COARSE;
        struct epa_face *face = convex_nearest_face(&e);
        struct difference_point next;
        struct gjk_simplex s;
        struct convex_axis other, flat;
        struct convex_active of_other;
        uint32_t of_flat;
        real reach;
        bool again = false, certain;
        int k;
        if (!face) break;
        if (face->height >= best - pair->equal) { /* unless the two just touch, or rounding has turned faces */
            witness = face->height > pair->equal && face->height <= best + pair->equal;
            break;
        }
        other.n = epa_normal(&e, face);
        other.n = v3_scale(other.n, 1 / v3_norm(other.n));
        next = convex_support(pair, other.n, &e.p[face->corner[0]]);
        reach = v3_dot(other.n, next.w);
        other.separation = -reach - convex_radii(pair);
        epa_simplex(&e, face, other.n, face->height, &s);
        convex_activate(&s, &of_other);
        if (convex_take(&other, &of_other, axis, active)) sure = false;
        for (k = 0; k < e.points; ++k) again |= convex_same_point(&next, &e.p[k]);
        if (!again && e.points < EPA_POINTS && reach - face->height > real_max(pair->equal, fine * real_abs(reach))) {
            convex_epa_grow(pair, &e, (int)(face - e.face), next);
            continue;
        }
        of_flat = convex_flat_beside(pair, other.n, &flat);
        if (of_flat && of_flat != held && flat.separation >= axis->separation - pair->slack) {
            const bool better = flat.separation > axis->separation + pair->equal;
            convex_axis_along(pair, flat.n, axis, active);
            sure = convex_is_flat_witness(pair, &flat, of_flat);
            if (sure) held = of_flat;
            if (better) continue; /* it may be all that there is to find */
        }
        certain = of_flat && of_flat == held ? convex_polish(pair, &of_other, &other.n, &other.separation)
                                             : convex_local(pair, &other, &of_other);
        if (convex_take(&other, &of_other, axis, active)) sure = certain;
        face->height = SADMM_REAL_MAX;
        ++tries;
    }
    if (!sure) {
        if (witness) convex_polish(pair, active, &axis->n, &axis->separation);
        else convex_local(pair, axis, active);
    }
    /* proof, but for what the faces that were given up have beside their optimum */
    if (!witness || tries > 0) convex_ask_beside(pair, axis, active);
}

/* 2. v: the shortest vector, by the walk. False: not certain. */
SADMM_INLINE bool convex_apart(const struct convex_pair *pair, const struct gjk_simplex *s, vec3 v,
                               struct convex_axis *axis, struct convex_active *active)
{
    const real length = v3_norm(v);
    const vec3 n = v3_scale(v, -1 / length);
    struct convex_axis flat;
    uint32_t of_flat;
    if (!(length > 1000 * pair->slack)) return false; /* of less the vector may be rounding */
    of_flat = convex_flat_beside(pair, n, &flat);
    if (of_flat && flat.separation >= length - convex_radii(pair) - 2 * pair->slack &&
        convex_is_flat_witness(pair, &flat, of_flat)) {
        convex_axis_along(pair, flat.n, axis, active);
        return true;
    }
    axis->n = n;
    axis->separation = convex_separation(pair, n);
    convex_activate(s, active);
    return convex_polish(pair, active, &axis->n, &axis->separation) && axis->separation + convex_radii(pair) > 0;
}

/* The direction. side: the last step's direction, or one to begin with; known: it is the last step's. False: farther
 * apart than `limit`. */
SADMM_INLINE bool convex_find(struct convex_pair *pair, vec3 side, bool known, real limit, struct convex_axis *axis,
                              struct convex_active *active)
{
    struct gjk_simplex s;
    struct convex_axis kept;
    struct convex_active of_kept;
    vec3 v;
    bool certain = false;
    enum gjk_end end;
    if (known) {
        convex_axis_along(pair, v3_scale(side, 1 / v3_norm(side)), &kept, &of_kept);
        certain = convex_polish(pair, &of_kept, &kept.n, &kept.separation);
        *axis = kept;
        *active = of_kept;
        if (certain && kept.separation + convex_radii(pair) >= 0) return true;
    }
    end = convex_distance(pair, side, limit + convex_radii(pair) + pair->slack, &s, &v);
    if (end == GJK_FAR) return false;
    /* it is the optimum beside the last one, but only of what is not apart the one to stay with */
    if (certain && !(end == GJK_APART && v3_norm(v) > 1000 * pair->slack) &&
        kept.separation + convex_radii(pair) >= -CONVEX_SHALLOW * pair->thin)
        return true;
    convex_axis_along(pair, v3_scale(side, 1 / v3_norm(side)), axis, active);
    if (end == GJK_APART) {
        const real enough = pair->enough;
        if (convex_apart(pair, &s, v, axis, active)) return true;
        pair->enough = 0;
        end = convex_distance(pair, v3_neg(v), SADMM_REAL_MAX, &s, &v);
        pair->enough = enough;
        if (end == GJK_APART && convex_apart(pair, &s, v, axis, active)) return true;
        if (end == GJK_APART && axis->separation + convex_radii(pair) > CONVEX_NEAR * pair->thin) {
            if (!convex_local(pair, axis, active)) convex_ask_beside(pair, axis, active);
            return true;
        }
    }
    convex_way_out(pair, &s, axis, active);
    if (!known || axis->separation + convex_radii(pair) >= 0) return true;
    /* the last step's side stays unless clearly beaten, and not by the other one */
    if (!certain) certain = convex_local(pair, &kept, &of_kept);
    if (v3_dot(axis->n, kept.n) < -MANIFOLD_COS_OPPOSITE ||
        (certain && axis->separation <= kept.separation - MANIFOLD_KEEP_DEPTH * kept.separation +
                                            MANIFOLD_KEEP_EXTENT * pair->thin)) {
        *axis = kept;
        *active = of_kept;
    }
    return true;
}

/* The nearest points, by those of the active pieces that are as far along n as the two reach, or nearly; where the
 * direction is not certain there may be none. */
SADMM_INLINE void convex_nearest(const struct convex_pair *pair, const struct convex_active *active,
                                 struct convex_axis *axis)
{
    const vec3 n = axis->n;
    const real reach = -(axis->separation + convex_radii(pair)),
               least = reach - real_max(pair->equal, (real)1e-8 * pair->size);
    real all = 0, lack;
    int k;
    axis->pa = axis->pb = v3(0, 0, 0);
    for (k = 0; k < active->count; ++k) {
        const real weight = real_max(active->weight[k], 0);
        const vec3 a = convex_point_a(pair, active->a[k], n), b = convex_point_b(pair, active->b[k], n);
        if (v3_dot(n, v3_sub(a, b)) < least) continue;
        axis->pa = v3_madd(axis->pa, weight, a);
        axis->pb = v3_madd(axis->pb, weight, b);
        all += weight;
    }
    if (!(all > 0)) {
        const struct difference_point zero = {{0, 0, 0}, 0, 0}, point = convex_support(pair, n, &zero);
        axis->pa = convex_point_a(pair, point.a, n);
        axis->pb = convex_point_b(pair, point.b, n);
        all = 1;
    }
    axis->pa = v3_scale(axis->pa, 1 / all);
    axis->pb = v3_scale(axis->pb, 1 / all);
    lack = reach - v3_dot(n, v3_sub(axis->pa, axis->pb));
    axis->pa = v3_madd(axis->pa, pair->a.p.radius + lack / 2, n);
    axis->pb = v3_madd(axis->pb, -pair->b.p.radius - lack / 2, n);
}

#endif
