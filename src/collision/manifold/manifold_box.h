/* Box against box: separating axis test over 6 face axes and 9 edge axes, then
 *
 *   face axis   points of the clipped incident face, up to 8 (manifold_box_face.h)
 *   edge axis   closest points of the two edges, or the ends of a line contact (manifold_box_edge.h), and the points
 *               of the faces beside them that are within reach
 *
 * Boxes that are apart and meet by corners (no point in the clipped face, edges that do not cross) get the closest
 * points of the two boxes.
 *
 * Choice of the axis. The largest separation wins, but
 *   - the cached axis stays unless beaten by 10 % of the depth plus 0.5 % of the thinner box: at the apex of two
 *     cards the two inner faces are equally good and tens of degrees apart;
 *   - the cached side stays, also past the midplane, until the boxes are apart: an axis they overlap along is not
 *     taken in the direction opposite to the cached one. Where they are apart the axis that says so has its true side;
 *   - an edge axis within 8 degrees of a face must beat that face by 5 % of the depth and 0.5 % of the thinner box
 *     (faces at rest have no depth to speak of): points of a face are worth more;
 *   - an edge axis is charged with its rounding error, which grows as the edges become parallel.
 * Should the axis so preferred have no points although the boxes overlap, the better ones are asked.
 */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_BOX_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_BOX_H

#include "manifold_box_edge.h"
#include "manifold_box_face.h"

/* Separations of the axes and what became of them. Normals run from 1 to 2; negative: against the axis. */
struct box_axes {
    real separation[3 + ROW3];
    unsigned negative;           /* bits, by axis */
    int cached;                  /* axis of the last step, -1: none */
    bool past;                   /* maybe past the midplane: sides follow the cached one */
    vec3 n_cached;               /* the normal of the last step, turned with the boxes */
    int best_face;               /* of largest separation */
    int face, edge;              /* the ones to choose from; edge -1: none can win */
    int edge_negative;
    real s_edge;                 /* of `edge`, with the bonus of a cached axis */
    real keep;                   /* absolute part of the preferences */
};

/* Of a face axis, or the edge axis to choose from. */
SADMM_INLINE int box_axis_negative(const struct box_axes *axes, int axis)
{
    return axis < 6 ? (int)(axes->negative >> axis & 1) : axes->edge_negative;
}

/* What an axis is given when it is the cached one. */
SADMM_INLINE real box_bonus(const struct box_axes *axes, real separation)
{
    return MANIFOLD_KEEP_DEPTH * real_max(0, -separation) + axes->keep;
}

/* The axis and the normal of the last step as they are now that the boxes have turned. A pair of edges that are nearly
 * parallel has an axis that turns much faster than they do: then the normal stays what it was, and no axis is cached.
 */
SADMM_INLINE void box_recall(const struct box_pair *b, uint32_t cache, struct box_axes *axes)
{
    axes->cached = (int)(cache & BOX_AXIS_MASK) - 1;
    axes->past = false;
    axes->n_cached = v3(0, 0, 0);
    if (axes->cached < 0) return;
    if (axes->cached < 6) {
        axes->n_cached = box_axis_direction(b, axes->cached, (cache & BOX_AXIS_NEGATIVE) != 0);
    } else {
        vec3 n = manifold_cached_direction(cache), now = box_axis_direction(b, axes->cached, 0);
        real along = v3_dot(n, now);
        axes->n_cached = along < 0 ? v3_neg(now) : now;
        if (real_abs(along) < MANIFOLD_COS_SAME) {
            axes->n_cached = n;
            axes->cached = -1;
        }
    }
    axes->past = v3_dot(axes->n_cached, v3_from_array(b->t)) < (real)0.5 * b->thin;
}

/* Separations along the face axes of a box of half extents h, from one of half extents `other` whose centre is at t:
 * all along these axes. R: of the other's axes to them, by columns. */
SADMM_INLINE row3 box_face_separations(row3 t, const real h[ROW3], const row3 R[3], const real other[ROW3])
{
    row3 shadows = r3_load(h);
    int k;
    for (k = 0; k < 3; ++k) shadows = r3_madd(shadows, other[k], r3_abs(R[k]));
    return r3_sub(r3_abs(t), shadows);
}

/* Face axes; false when one separates the boxes. */
SADMM_INLINE bool box_test_faces(struct box_pair *b, struct box_axes *axes)
{
    const row3 t = r3_load(b->t), reject = r3_fill(b->limit + b->slack),
               rows[3] = {r3_load(b->R[0]), r3_load(b->R[1]), r3_load(b->R[2])};
    real *s = axes->separation, most;
    row3 columns[3], t2, separations;
    int axis;

    r3_transpose(rows, columns);
    separations = box_face_separations(t, b->h1, columns, b->h2);
    if (r3_above(separations, reject)) return false;
    r3_store(separations, s);
    t2 = r3_madd(r3_madd(r3_scale(rows[0], b->t[0]), b->t[1], rows[1]), b->t[2], rows[2]);
    separations = box_face_separations(t2, b->h2, rows, b->h1);
    if (r3_above(separations, reject)) return false;
    r3_store(separations, s + 3);
    r3_store(t2, b->t2);
    axes->negative = (unsigned)(r3_above(r3_fill(0), t) | r3_above(r3_fill(0), t2) << 3);
    if (axes->past)
        for (axis = 0; axis < 6; ++axis) {
            real d = axis < 3 ? b->t[axis] : b->t2[axis - 3];
            real c = v3_dot(box_axis_direction(b, axis, 0), axes->n_cached);
            if (s[axis] <= 0 && real_abs(c) > MANIFOLD_COS_OPPOSITE && c * d < 0) {
                s[axis] -= 2 * real_abs(d);
                axes->negative = (axes->negative & ~(1u << axis)) | (unsigned)(c < 0) << axis;
            }
        }
    for (axis = 1, most = s[0]; axis < 6; ++axis) most = real_max(s[axis], most);
    axes->best_face = lowest_bit(r3_not_above(r3_fill(most), r3_load(s)) |
                                 r3_not_above(r3_fill(most), r3_load(s + 3)) << 3);
    axes->face = axes->best_face;
    if (axes->cached >= 0 && axes->cached < 6 &&
        s[axes->face] <= s[axes->cached] + box_bonus(axes, s[axes->cached]))
        axes->face = axes->cached;
    return true;
}

/* The edge axis of edges i and j, by its separation s, not normalised, and (e_i x b_j) . t = d; false when it separates
 * the boxes. */
SADMM_INLINE bool box_test_edge(const struct box_pair *b, struct box_axes *axes, int i, int j, real s, real d)
{
    const int i1 = i == 2 ? 0 : i + 1, i2 = i1 == 2 ? 0 : i1 + 1, code = 6 + 3 * i + j;
    const real length2 = b->R[i1][j] * b->R[i1][j] + b->R[i2][j] * b->R[i2][j];
    real length;
    int negative;

    if (length2 < MANIFOLD_PARALLEL2) return true;
    length = real_sqrt(length2);
    s /= length;
    if (s > b->limit) return false;
    negative = d < 0;
    if (axes->past && s <= 0) {
        real c = v3_dot(box_edge_axis(b, i, j), axes->n_cached);
        if (real_abs(c) > MANIFOLD_COS_OPPOSITE * length && c * d < 0) {
            s -= 2 * real_abs(d) / length;
            negative = c < 0;
        }
    }
    if (code == axes->cached) s += box_bonus(axes, s);
    if (s > axes->s_edge) {
        axes->s_edge = s;
        axes->edge = code;
        axes->edge_negative = negative;
    }
    return true;
}

/* Edge axes that can beat the face; false when one separates the boxes. */
SADMM_INLINE bool box_test_edges(const struct box_pair *b, struct box_axes *axes)
{
    const real s_face = axes->separation[axes->face];
    const row3 rows[3] = {r3_load(b->R[0]), r3_load(b->R[1]), r3_load(b->R[2])}, h2 = r3_load(b->h2),
               slack = r3_fill(b->slack), face = r3_fill(s_face), zero = r3_fill(0);
    real separations[6 + ROW3], along[6 + ROW3];
    int i, left = 0; /* bits, by edge axis */

    for (i = 0; i < 3; ++i) {
        const int i1 = i == 2 ? 0 : i + 1, i2 = i1 == 2 ? 0 : i1 + 1;
        const row3 own = r3_abs(rows[i]);
        /* not normalised: (e_i x b_j) . t and the shadows of the boxes */
        const row3 d = r3_sub(r3_scale(rows[i1], b->t[i2]), r3_scale(rows[i2], b->t[i1]));
        const row3 shadows = r3_add(r3_add(r3_add(r3_scale(r3_abs(rows[i2]), b->h1[i1]),
                                                  r3_scale(r3_abs(rows[i1]), b->h1[i2])),
                                           r3_mul(r3_turn(h2), r3_turn_back(own))),
                                    r3_mul(r3_turn_back(h2), r3_turn(own)));
        const row3 s = r3_sub(r3_sub(r3_abs(d), shadows), slack);
        r3_store(s, separations + 3 * i);
        r3_store(d, along + 3 * i);
        /* division by a length below 1 only makes it worse */
        left |= (~(r3_not_above(s, face) & r3_not_above(s, zero)) & 7) << 3 * i;
    }
    if (axes->cached >= 6) left |= 1 << (axes->cached - 6);
#ifdef __CUDA_ARCH__
#pragma unroll
    for (int e = 0; e < 9; ++e) /* separations stay in registers */
        if ((left >> e & 1) && !box_test_edge(b, axes, e / 3, e % 3, separations[e], along[e])) return false;
#else
    for (; left; left &= left - 1) {
        const int e = lowest_bit(left);
        if (!box_test_edge(b, axes, e / 3, e % 3, separations[e], along[e])) return false;
    }
#endif
    return true;
}

/* Edge or face? Where the edge would win but runs like a face, axes->face becomes that face. */
SADMM_INLINE bool box_prefers_edge(const struct box_pair *b, struct box_axes *axes)
{
    const real *separation = axes->separation;
    real s_face = separation[axes->face], s = axes->s_edge;
    int axis, near_face = -1;
    vec3 n;

    if (axes->edge < 0) return false;
    if (axes->cached >= 0 && axes->cached != axes->edge) s_face += box_bonus(axes, s_face);
    if (s <= s_face) return false;
    n = box_axis_direction(b, axes->edge, 0);
    for (axis = 0; axis < 6; ++axis)
        if (real_abs(v3_dot(box_axis_direction(b, axis, 0), n)) > MANIFOLD_COS_NEAR &&
            (near_face < 0 || separation[axis] > separation[near_face]))
            near_face = axis;
    if (near_face < 0) return true;
    /* the bonus of a cached edge does not count against a face of the same direction */
    if (axes->edge == axes->cached) s -= box_bonus(axes, s);
    if (s > separation[near_face] + (real)0.05 * real_abs(separation[near_face]) + axes->keep) return true;
    axes->face = near_face;
    return false;
}

/* Deepest vertex along the normal of `axis`: the last resort of an overlap that all else lost to rounding. */
SADMM_INLINE void box_vertex_manifold(const struct box_pair *b, int axis, int negative, real separation,
                                      struct manifold *m)
{
    vec3 n = box_axis_direction(b, axis, negative), p;
    real x[3];
    int k, j, bits = 0, of_1 = axis >= 3 && axis < 6;

    m->count = 0;
    m->normal = n;
    if (of_1) {
        real na[3];
        v3_to_array(n, na);
        for (k = 0; k < 3; ++k) {
            x[k] = na[k] > 0 ? b->h1[k] : -b->h1[k];
            bits |= na[k] > 0 ? 1 << k : 0;
        }
    } else {
        for (k = 0; k < 3; ++k) x[k] = b->t[k];
        for (j = 0; j < 3; ++j) {
            real along = n.x * b->R[0][j] + n.y * b->R[1][j] + n.z * b->R[2][j];
            real s = along > 0 ? -b->h2[j] : b->h2[j];
            bits |= s > 0 ? 1 << j : 0;
            for (k = 0; k < 3; ++k) x[k] += s * b->R[k][j];
        }
    }
    p = v3_madd(v3_from_array(x), (of_1 ? separation : -separation) / 2, n);
    manifold_add(m, p, separation, box_feature_vertex(!of_1, bits));
}

/* Boxes apart whose closest features are a corner of 1 and the inside of the best face, one of 2? (That corner is on no
 * edge of 2, which box_corner_manifold handles.) */
SADMM_INLINE bool box_corner_over_face(const struct box_pair *b, const struct box_axes *axes)
{
    int face = axes->best_face - 3, k, j;
    real n[3], x[3];
    if (face < 0) return false;
    v3_to_array(box_axis_direction(b, axes->best_face, box_axis_negative(axes, axes->best_face)), n);
    for (k = 0; k < 3; ++k) x[k] = (n[k] > 0 ? b->h1[k] : -b->h1[k]) - b->t[k];
    for (j = 0; j < 3; ++j)
        if (j != face && real_abs(x[0] * b->R[0][j] + x[1] * b->R[1][j] + x[2] * b->R[2][j]) > b->h2[j]) return false;
    return true;
}

/* The face that an edge axis is completed by: the one nearest to the normal, unless what lies beyond half the thinner
 * box's extent to the side of the crossing is out of reach; -1: none. */
SADMM_INLINE int box_clip_axis(const struct box_pair *b, vec3 n, real separation)
{
    real cosine = 0, sine;
    int axis, nearest = -1;
    for (axis = 0; axis < 6; ++axis) {
        real c = real_abs(v3_dot(box_axis_direction(b, axis, 0), n));
        if (c > cosine) {
            cosine = c;
            nearest = axis;
        }
    }
    sine = real_sqrt(real_max(0, 1 - cosine * cosine));
    return sine * b->thin / 2 <= b->limit - separation ? nearest : -1;
}

/* Which axis is asked for contacts. */
enum box_turn {
    BOX_PREFERRED,
    BOX_OVER_FACE, /* a corner over a face, apart */
    BOX_BETTER,    /* the preferred axis has no points although the boxes overlap: better ones, not preferred, may */
    BOX_OTHER,
    BOX_COMPLETE   /* the faces beside a crossing of edges */
};

SADMM_INLINE void manifold_box_box(vec3 half1, vec3 half2, const struct pair_pose *pose, real limit, uint32_t cache,
                                   struct manifold *m)
{
    struct box_pair b;
    struct box_axes axes;
    enum box_turn turn = BOX_PREFERRED;
    bool edge_first;
    int axis, negative;
    real s;

    box_pair_make(half1, half2, pose, limit, &b);
    box_recall(&b, cache, &axes);
    axes.edge = -1;
    axes.edge_negative = 0;
    axes.s_edge = -SADMM_REAL_MAX;
    axes.keep = MANIFOLD_KEEP_EXTENT * b.thin;
    if (!box_test_faces(&b, &axes) || !box_test_edges(&b, &axes)) return;

    if (box_prefers_edge(&b, &axes)) {
        axis = axes.edge;
        negative = axes.edge_negative;
        s = axes.s_edge;
    } else {
        axis = axes.face;
        negative = box_axis_negative(&axes, axis);
        s = axes.separation[axis];
    }
    edge_first = axes.edge >= 0 && axes.s_edge > axes.separation[axes.best_face];

    for (;;) {
        bool crossing = true;
        if (axis < 6) {
            if (turn != BOX_COMPLETE) {
                m->count = 0;
                m->normal = box_axis_direction(&b, axis, negative);
                m->cache = (uint32_t)(axis + 1) | (negative ? BOX_AXIS_NEGATIVE : 0u);
            }
            box_face_manifold(&b, axis, negative, turn == BOX_COMPLETE, m);
        } else {
            crossing = box_edge_manifold(&b, axis, negative, m);
            m->cache = (uint32_t)(axis + 1) | manifold_direction_bits(m->normal);
        }
        if (turn == BOX_COMPLETE || turn == BOX_OVER_FACE) break;
        if (turn == BOX_PREFERRED) {
            if (m->count > 0 && axis >= 6) s = m->points[m->count - 1].separation;
            if (m->count == 0 || (s > 0 && (!crossing || s > limit))) {
                if (s <= 0) {
                    turn = BOX_BETTER;
                    axis = edge_first ? axes.edge : axes.best_face;
                } else if (box_corner_over_face(&b, &axes)) {
                    turn = BOX_OVER_FACE;
                    axis = axes.best_face;
                } else {
                    box_corner_manifold(&b, box_axis_direction(&b, axis, negative), m);
                    break;
                }
                negative = box_axis_negative(&axes, axis);
                continue;
            }
        } else if (m->count == 0 || m->points[m->count - 1].separation > b.limit + b.slack) {
            /* Edges may turn out to be farther apart than their axis said. */
            if (turn == BOX_BETTER && axes.edge >= 0) {
                turn = BOX_OTHER;
                axis = edge_first ? axes.best_face : axes.edge;
                negative = box_axis_negative(&axes, axis);
                continue;
            }
            axis = axes.best_face;
            negative = box_axis_negative(&axes, axis);
            m->cache = (uint32_t)(axis + 1) | (negative ? BOX_AXIS_NEGATIVE : 0u);
            /* Boxes that may be apart, by the angle of edges that count as parallel over the boxes' extents (slack
             * is those times 4 roundings): there may be nothing of the one over the face of the other. */
            if (axes.separation[axis] >= -real_sqrt(MANIFOLD_PARALLEL2) / SADMM_EPSILON * b.slack)
                box_corner_manifold(&b, box_axis_direction(&b, axis, negative), m);
            else box_vertex_manifold(&b, axis, negative, axes.separation[axis], m);
            break;
        }
        if (axis < 6) break;
        axis = box_clip_axis(&b, m->normal, m->points[m->count - 1].separation);
        if (axis < 0) break;
        negative = v3_dot(box_axis_direction(&b, axis, 0), m->normal) < 0;
        turn = BOX_COMPLETE;
    }
    m->normal = v3_neg(m->normal);
}

#endif
