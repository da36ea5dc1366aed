/* Box against box.
 *
 * Box 1 is b (its frame is the frame of the computation) and box 2 is a; the normal is found from 1 to 2 and reversed at
 * the end. Separating axis test over 6 face axes and 9 edge axes, then
 *
 *   face axis   the face of the other box that looks against the normal is clipped by the sides of the reference face;
 *               every vertex of the clipped polygon within the limit is a point (up to 8)
 *   edge axis   closest points of the two supporting edges; nearly parallel edges touch along a line and give the ends
 *               of the common stretch
 *
 * Boxes that are apart and meet by corners (no point in the clipped face, edges that do not cross) get the closest
 * points of the two boxes.
 *
 * Choice of the axis. The largest separation wins, but
 *   - the cached axis stays unless beaten by 10 % of the depth plus 0.5 % of the thinner box: at the apex of two cards the
 *     two inner faces are equally good and 60 degrees apart;
 *   - the cached side stays, also past the midplane, until the boxes are apart;
 *   - an edge axis within 8 degrees of a face must beat that face by 5 % of the depth and 0.5 % of the thinner box (faces at
 *     rest have no depth to speak of): points of a face are worth more;
 *   - an edge axis is charged with its rounding error, which grows as the edges become parallel.
 *
 * Features. Vertex of box 1: 1 + v; of box 2: 9 + v (v: bit k set when coordinate k is positive). Crossing of edge e1 of
 * box 1 and e2 of box 2: 32 + 12 e1 + e2. An edge is 4 x direction + the signs of the two following axes.
 * Coincident vertices are box 1's. Corners: 256 + 3 e2 + (two ends of a stretch, closest point).
 */
#ifndef SADMM_COLLISION_MANIFOLD_BOX_H
#define SADMM_COLLISION_MANIFOLD_BOX_H

#include "manifold_box_round.h"

/* cache: 1 + axis, axis 0-2 faces of 1, 3-5 faces of 2, 6-14 edge pairs 6 + 3 i + j; bit 16: normal (1 to 2) along
 * the negative axis. */
enum { BOX_AXIS_MASK = 15, BOX_AXIS_NEGATIVE = 16 };

struct box_pair {
    real h1[3], h2[3];
    real R[3][3]; /* axes of 2 in the frame of 1: columns */
    real Q[3][3]; /* |R| */
    real t[3];    /* centre of 2 in the frame of 1 */
    real t2[3];   /* the same along the axes of 2 */
    real limit, thin, slack; /* slack: rounding of a separation */
};

/* Edge pair (i, j): axis e_i x b_j, not normalised. */
SADMM_INLINE vec3 box_edge_axis(const struct box_pair *b, int i, int j)
{
    real x = b->R[0][j], y = b->R[1][j], z = b->R[2][j];
    return i == 0 ? v3(0, -z, y) : (i == 1 ? v3(z, 0, -x) : v3(-y, x, 0));
}

/* Direction 1 to 2 of an axis code (axis | BOX_AXIS_NEGATIVE), unit. */
SADMM_INLINE vec3 box_axis_direction(const struct box_pair *b, int axis, int negative)
{
    real s = negative ? (real)-1 : (real)1;
    if (axis < 3) return v3_axis(axis, s);
    if (axis < 6) return v3(s * b->R[0][axis - 3], s * b->R[1][axis - 3], s * b->R[2][axis - 3]);
    {
        vec3 l = box_edge_axis(b, (axis - 6) / 3, (axis - 6) % 3);
        real n2 = v3_norm2(l);
        return n2 > 0 ? v3_scale(l, s / real_sqrt(n2)) : v3(0, 0, s);
    }
}

/* Corner sign of a coordinate of the supporting feature. */
SADMM_INLINE int box_edge_id(int direction, int bit_u, int bit_v) { return 4 * direction + bit_u + 2 * bit_v; }

SADMM_INLINE uint32_t box_feature_crossing(int e1, int e2) { return 32u + 12u * (uint32_t)e1 + (uint32_t)e2; }
SADMM_INLINE uint32_t box_feature_vertex(int owner_is_2, int v) { return (owner_is_2 ? 9u : 1u) + (uint32_t)v; }

/* A vertex of the clipped polygon: in-plane coordinates and separation, and the edge that leaves it: 0-3 edge of the
 * incident face, 4-7 side of the reference face (+u, -u, +v, -v). */
struct clip_vertex {
    real x, y, z;
    int out;
};

/* Keep the part of the polygon with sign * coordinate <= h. */
SADMM_INLINE int clip_side(const struct clip_vertex *in, int count, int along_y, real sign, real h, real tolerance,
                           int label, struct clip_vertex *out)
{
    int i, n = 0;
    for (i = 0; i < count; ++i) {
        const struct clip_vertex *p = &in[i], *q = &in[i + 1 < count ? i + 1 : 0];
        real dp = sign * (along_y ? p->y : p->x) - h, dq = sign * (along_y ? q->y : q->x) - h;
        bool inside = dp <= tolerance;
        if (n > SADMM_MANIFOLD_POINTS) break;
        if (inside) out[n++] = *p;
        if (inside != (dq <= tolerance)) {
            real f = real_clamp(dp / (dp - dq), 0, 1);
            struct clip_vertex *c = &out[n++];
            c->x = p->x + f * (q->x - p->x);
            c->y = p->y + f * (q->y - p->y);
            c->z = p->z + f * (q->z - p->z);
            c->out = inside ? label : p->out;
        }
    }
    return n;
}

/* Points of reference face (axis k, side sg of the reference box hr) against the incident box (hi, axes: columns of R,
 * centre t, all in the reference frame). owner: 1 when the reference is box 2. Positions are in the reference frame.
 * Returns the number of points within the limit. */
SADMM_INLINE int box_clip_face(const real hr[3], const real hi[3], const real R[3][3], const real t[3], int k, real sg,
                               real limit, int owner, struct manifold *m)
{
    int u = k == 2 ? 0 : k + 1, v = u == 2 ? 0 : u + 1, j = 0, ju, jv, q, i, count = 4, base_bits, ref_bits;
    struct clip_vertex poly[12], other[12];
    int bits[4];
    real si, cx, cy, cz, ux, uy, uz, vx, vy, vz, tol_u, tol_v;
    bool clip_u = false, clip_v = false;

    /* incident face: the axis most against the normal */
    if (real_abs(R[k][1]) > real_abs(R[k][j])) j = 1;
    if (real_abs(R[k][2]) > real_abs(R[k][j])) j = 2;
    si = sg * R[k][j] > 0 ? (real)-1 : (real)1;
    ju = j == 2 ? 0 : j + 1;
    jv = ju == 2 ? 0 : ju + 1;
    base_bits = si > 0 ? 1 << j : 0;
    ref_bits = sg > 0 ? 1 << k : 0;

    cx = t[u] + si * hi[j] * R[u][j];
    cy = t[v] + si * hi[j] * R[v][j];
    cz = sg * (t[k] + si * hi[j] * R[k][j]) - hr[k];
    ux = hi[ju] * R[u][ju]; uy = hi[ju] * R[v][ju]; uz = sg * hi[ju] * R[k][ju];
    vx = hi[jv] * R[u][jv]; vy = hi[jv] * R[v][jv]; vz = sg * hi[jv] * R[k][jv];
    /* the smaller of the two faces says what is near */
    tol_u = MANIFOLD_SNAP * real_min(hr[u], real_abs(ux) + real_abs(vx));
    tol_v = MANIFOLD_SNAP * real_min(hr[v], real_abs(uy) + real_abs(vy));
    for (q = 0; q < 4; ++q) {
        /* around the face: (+,+), (-,+), (-,-), (+,-) */
        int pu = q == 0 || q == 3, pv = q < 2;
        real a = pu ? (real)1 : (real)-1, b = pv ? (real)1 : (real)-1;
        poly[q].x = cx + a * ux + b * vx;
        poly[q].y = cy + a * uy + b * vy;
        poly[q].z = cz + a * uz + b * vz;
        poly[q].out = q;
        bits[q] = base_bits | (pu ? 1 << ju : 0) | (pv ? 1 << jv : 0);
        clip_u = clip_u || real_abs(poly[q].x) > hr[u] + tol_u;
        clip_v = clip_v || real_abs(poly[q].y) > hr[v] + tol_v;
    }
    if (clip_u) {
        count = clip_side(poly, count, 0, 1, hr[u], tol_u, 4, other);
        count = clip_side(other, count, 0, -1, hr[u], tol_u, 5, poly);
    }
    if (clip_v) {
        count = clip_side(poly, count, 1, 1, hr[v], tol_v, 6, other);
        count = clip_side(other, count, 1, -1, hr[v], tol_v, 7, poly);
    }
    for (i = 0; i < count; ++i) {
        const struct clip_vertex *p = &poly[i];
        int in = poly[i > 0 ? i - 1 : count - 1].out, out = p->out, d;
        uint32_t feature;
        real position[3];
        bool duplicate = false;
        /* on a corner of the reference face? */
        bool corner = real_abs(real_abs(p->x) - hr[u]) <= tol_u && real_abs(real_abs(p->y) - hr[v]) <= tol_v;
        int corner_bits = ref_bits | (p->x > 0 ? 1 << u : 0) | (p->y > 0 ? 1 << v : 0);
        if (p->z > limit) continue;
        if (in < 4 && out < 4) {
            /* vertex of the incident box; where two coincide the id is that of box 1's */
            feature = corner && !owner ? box_feature_vertex(0, corner_bits)
                                       : box_feature_vertex(!owner && !corner, bits[out]);
        } else if (in >= 4 && out >= 4) {
            /* corner of the reference; collinear leftovers (in == out) carry no information */
            if (in == out) continue;
            feature = box_feature_vertex(owner, corner_bits);
        } else {
            /* side of the reference face x edge of the incident face */
            int side = in >= 4 ? in : out, edge = in >= 4 ? out : in;
            int positive = side == 4 || side == 6, along_v = side < 6; /* the side at +-u runs along v */
            int e_ref, e_inc, kb = ref_bits != 0, jb = si > 0;
            /* signs of the two axes after the edge's direction */
            if (along_v) e_ref = box_edge_id(v, kb, positive);
            else e_ref = box_edge_id(u, positive, kb);
            /* edges 0 and 2 run along ju at +-jv, edges 1 and 3 along jv at -+ju */
            if (edge == 0 || edge == 2) e_inc = box_edge_id(ju, edge == 0, jb);
            else e_inc = box_edge_id(jv, jb, edge == 3);
            feature = owner ? box_feature_crossing(e_inc, e_ref) : box_feature_crossing(e_ref, e_inc);
            if (corner) feature = box_feature_vertex(owner, corner_bits); /* the edge passes by a corner */
        }
        for (d = 0; d < m->count; ++d) {
            real dx = real_abs(m->points[d].position.x - p->x), dy = real_abs(m->points[d].position.y - p->y);
            duplicate = duplicate || (dx <= tol_u && dy <= tol_v) || m->points[d].feature == feature;
        }
        if (duplicate || m->count == SADMM_MANIFOLD_POINTS) continue;
        position[0] = p->x;
        position[1] = p->y;
        position[2] = p->z;
        manifold_add(m, v3_from_array(position), p->z, feature);
    }
    /* in-plane to the reference frame, midway between the incident face and the reference face */
    for (i = 0; i < m->count; ++i) {
        real position[3];
        position[u] = m->points[i].position.x;
        position[v] = m->points[i].position.y;
        position[k] = sg * (hr[k] + m->points[i].separation / 2);
        m->points[i].position = v3_from_array(position);
    }
    return m->count;
}

SADMM_INLINE void box_face_manifold(const struct box_pair *b, int axis, int negative, struct manifold *m)
{
    real sg = negative ? (real)-1 : (real)1;
    int i, j;
    m->count = 0;
    m->normal = box_axis_direction(b, axis, negative);
    if (axis < 3) {
        box_clip_face(b->h1, b->h2, b->R, b->t, axis, sg, b->limit, 0, m);
    } else {
        /* in the frame of 2 the normal from 1 to 2 looks out of 1: the reference side of 2 is opposite */
        real RT[3][3], t[3];
        for (i = 0; i < 3; ++i) {
            for (j = 0; j < 3; ++j) RT[i][j] = b->R[j][i];
            t[i] = -b->t2[i];
        }
        box_clip_face(b->h2, b->h1, RT, t, axis - 3, -sg, b->limit, 1, m);
        for (i = 0; i < m->count; ++i) {
            real p[3], q[3];
            v3_to_array(m->points[i].position, p);
            for (j = 0; j < 3; ++j) q[j] = b->t[j] + b->R[j][0] * p[0] + b->R[j][1] * p[1] + b->R[j][2] * p[2];
            m->points[i].position = v3_from_array(q);
        }
    }
}

/* Supporting edge along axis i of a box with half extents h towards direction n (own frame); `lean`: where the other
 * box is, for coordinates along which n does not decide. Returns the edge's id. */
SADMM_INLINE int box_support_edge(const real h[3], int i, const real n[3], const real lean[3], real centre[3])
{
    int u = i == 2 ? 0 : i + 1, v = u == 2 ? 0 : u + 1, bu, bv;
    bu = (real_abs(n[u]) > (real)1e-3 ? n[u] : lean[u]) >= 0;
    bv = (real_abs(n[v]) > (real)1e-3 ? n[v] : lean[v]) >= 0;
    centre[i] = 0;
    centre[u] = bu ? h[u] : -h[u];
    centre[v] = bv ? h[v] : -h[v];
    return box_edge_id(i, bu, bv);
}

/* Vertex at the upper or lower end of the edge along i through centre. */
SADMM_INLINE int box_edge_end(const real centre[3], int i, int upper)
{
    int u = i == 2 ? 0 : i + 1, v = u == 2 ? 0 : u + 1;
    return (upper ? 1 << i : 0) | (centre[u] > 0 ? 1 << u : 0) | (centre[v] > 0 ? 1 << v : 0);
}

/* Tangent of the steepest descent of the box's surface beside the edge, looking sideways along `side` (unit, across the
 * edge and the normal): how fast the gap opens there. */
SADMM_INLINE real box_edge_fall(const real centre[3], int i, const real n[3], const real side[3])
{
    int u = i == 2 ? 0 : i + 1, v = u == 2 ? 0 : u + 1;
    /* outward normals of the two faces at the edge; the one that looks more to the side falls away there */
    real fu = centre[u] >= 0 ? (real)1 : (real)-1, fv = centre[v] >= 0 ? (real)1 : (real)-1;
    real su = fu * side[u], sv = fv * side[v], nu = fu * n[u], nv = fv * n[v];
    real s = su > sv ? su : sv, c = su > sv ? nu : nv;
    return s > 0 && c > (real)1e-3 ? s / c : (s > 0 ? (real)1e3 : 0);
}

/* Edge-edge manifold for axis code `axis`; returns false when the edges do not cross (closest points at an end). */
SADMM_INLINE bool box_edge_manifold(const struct box_pair *b, int axis, int negative, struct manifold *m)
{
    int i = (axis - 6) / 3, j = (axis - 6) % 3, e1, e2, k, end;
    vec3 n = box_axis_direction(b, axis, negative), p, q, w, axis1 = v3_axis(i, 1), p1, p2;
    real n1[3], n2[3], lean1[3], lean2[3], c1[3], c2[3], s, t, separation;
    bool crossing;
    vec3 l = box_edge_axis(b, i, j);

    m->count = 0;
    m->normal = n;
    v3_to_array(n, n1);
    for (k = 0; k < 3; ++k) {
        n2[k] = -(n1[0] * b->R[0][k] + n1[1] * b->R[1][k] + n1[2] * b->R[2][k]);
        lean1[k] = b->t[k];
        lean2[k] = -b->t2[k];
    }
    e1 = box_support_edge(b->h1, i, n1, lean1, c1);
    e2 = box_support_edge(b->h2, j, n2, lean2, c2);
    p = v3_from_array(c1);
    {
        real c[3];
        for (k = 0; k < 3; ++k) c[k] = b->t[k] + b->R[k][0] * c2[0] + b->R[k][1] * c2[1] + b->R[k][2] * c2[2];
        q = v3_from_array(c);
    }
    w = v3(b->R[0][j], b->R[1][j], b->R[2][j]);
    segments_closest(p, axis1, b->h1[i], q, w, b->h2[j], &s, &t);
    crossing = real_abs(s) < b->h1[i] && real_abs(t) < b->h2[j];
    p1 = v3_madd(p, s, axis1);
    p2 = v3_madd(q, t, w);
    separation = v3_dot(n, v3_sub(p2, p1));

    if (v3_norm2(l) < 1 - MANIFOLD_COS_NEAR * MANIFOLD_COS_NEAR) {
        /* nearly parallel: ends of the stretch the edges have in common along their mean direction, where the gap has not
         * opened past the limit */
        vec3 mean = b->R[i][j] > 0 ? v3_add(axis1, w) : v3_sub(axis1, w);
        real inverse = 1 / v3_norm(mean), d1, d2, lo1, hi1, lo2, hi2, lo, hi, worst = -(real)1e30;
        int added = 0;
        mean = v3_scale(mean, inverse);
        d1 = v3_dot(mean, axis1);
        d2 = v3_dot(mean, w);
        lo1 = v3_dot(mean, p) - b->h1[i] * d1;
        hi1 = v3_dot(mean, p) + b->h1[i] * d1;
        lo2 = v3_dot(mean, q) - b->h2[j] * real_abs(d2);
        hi2 = v3_dot(mean, q) + b->h2[j] * real_abs(d2);
        lo = real_max(lo1, lo2);
        hi = real_min(hi1, hi2);
        if (hi - lo > MANIFOLD_SNAP * real_min(b->h1[i], b->h2[j])) {
            for (end = 0; end < 2; ++end) {
                real x = end ? hi : lo, side_length, gap;
                vec3 a1 = v3_madd(p, (x - v3_dot(mean, p)) / d1, axis1), a2 = v3_madd(q, (x - v3_dot(mean, q)) / d2, w);
                vec3 d = v3_sub(a2, a1), side;
                uint32_t feature;
                gap = v3_dot(n, d);
                side = v3_madd(d, -gap, n);
                side_length = v3_norm(side);
                if (side_length > 0) {
                    real side1[3], side2[3];
                    side = v3_scale(side, 1 / side_length);
                    v3_to_array(side, side1);
                    for (k = 0; k < 3; ++k)
                        side2[k] = -(side1[0] * b->R[0][k] + side1[1] * b->R[1][k] + side1[2] * b->R[2][k]);
                    gap += side_length * real_min(box_edge_fall(c1, i, n1, side1), box_edge_fall(c2, j, n2, side2));
                }
                worst = real_max(worst, gap);
                if (gap > b->limit) continue;
                /* the end belongs to the edge that stops there */
                if (end ? hi1 <= hi2 : lo1 >= lo2) feature = box_feature_vertex(0, box_edge_end(c1, i, end));
                else feature = box_feature_vertex(1, box_edge_end(c2, j, (end != 0) == (d2 > 0)));
                manifold_add(m, v3_scale(v3_add(a1, a2), (real)0.5), gap, feature);
                ++added;
            }
            /* the crossing matters only where the ends are clearly less deep */
            if (added == 2 && worst - separation <= (real)0.01 * b->thin) return true;
        }
    }
    if (separation <= b->limit + b->slack)
        manifold_add(m, v3_scale(v3_add(p1, p2), (real)0.5), separation, box_feature_crossing(e1, e2));
    return crossing;
}

/* Boxes apart whose closest features are corners and edges that do not cross: the edges of 2 against the solid 1. */
SADMM_INLINE void box_corner_manifold(const struct box_pair *b, vec3 fallback, struct manifold *m)
{
    vec3 h1 = v3_from_array(b->h1), p = v3(0, 0, 0), u = p, x = p, q = p;
    real best2 = (real)1e30, best_slope = (real)1e30, half = 0, distance, tie = 64 * b->slack * b->limit;
    int direction, side, best = 0;
    uint32_t cache = m->cache;

    m->count = 0;
    for (direction = 0; direction < 3; ++direction) {
        int i = direction == 2 ? 0 : direction + 1, j = i == 2 ? 0 : i + 1, k;
        real w[3];
        for (k = 0; k < 3; ++k) w[k] = b->R[k][direction];
        for (side = 0; side < 4; ++side) {
            real c[3], d2, slope, hi = side & 1 ? b->h2[i] : -b->h2[i], hj = side & 2 ? b->h2[j] : -b->h2[j];
            vec3 x2, q1;
            for (k = 0; k < 3; ++k) c[k] = b->t[k] + b->R[k][i] * hi + b->R[k][j] * hj;
            x2 = v3_madd(v3_from_array(c), segment_box_closest(c, w, b->h1, b->h2[direction]), v3_from_array(w));
            q1 = box_clamp(x2, h1);
            d2 = v3_norm2(v3_sub(x2, q1));
            slope = real_abs(v3_dot(v3_from_array(w), v3_sub(x2, q1)));
            /* three edges meet in a closest vertex: the one that runs along the other box */
            if (d2 < best2 - tie || (d2 <= best2 + tie && slope < best_slope)) {
                best2 = d2;
                best_slope = slope;
                best = box_edge_id(direction, side & 1, side >> 1);
                p = v3_from_array(c);
                u = v3_from_array(w);
                half = b->h2[direction];
                x = x2;
                q = q1;
            }
        }
    }
    distance = real_sqrt(best2);
    if (distance > b->limit) return;
    if (distance > (real)1e-4 * b->thin) {
        manifold_segment_outside(0, half, h1, p, u, x, q, distance, (real)0.01 * b->thin, b->limit,
                                 256u + 3u * (uint32_t)best, m);
        m->normal = v3_neg(m->normal); /* it came from 2 to 1 */
    } else {
        m->normal = fallback;
        manifold_add(m, v3_scale(v3_add(x, q), (real)0.5), distance, 258u + 3u * (uint32_t)best);
    }
    m->cache = cache;
}

/* Deepest vertex of 2 along the normal: the last resort of an overlap that clipping lost to rounding. */
SADMM_INLINE void box_vertex_manifold(const struct box_pair *b, vec3 n, real separation, struct manifold *m)
{
    real p[3];
    int k, j, bits = 0;
    m->count = 0;
    m->normal = n;
    for (k = 0; k < 3; ++k) p[k] = b->t[k];
    for (j = 0; j < 3; ++j) {
        real along = n.x * b->R[0][j] + n.y * b->R[1][j] + n.z * b->R[2][j], s = along > 0 ? -b->h2[j] : b->h2[j];
        bits |= s > 0 ? 1 << j : 0;
        for (k = 0; k < 3; ++k) p[k] += s * b->R[k][j];
    }
    manifold_add(m, v3_madd(v3_from_array(p), -separation / 2, n), separation, box_feature_vertex(1, bits));
}

SADMM_INLINE void manifold_box_box(vec3 half1, vec3 half2, const struct pair_pose *pose, real limit, uint32_t cache,
                                   struct manifold *m)
{
    struct box_pair b;
    int i, j, axis, negative_face = 0, negative_edge = 0, face = 0, edge = -1, negative[6];
    int cached = (int)(cache & BOX_AXIS_MASK) - 1, cached_negative = (cache & BOX_AXIS_NEGATIVE) != 0;
    real size, s_face = -(real)1e30, s_edge = -(real)1e30, separation[6], reject, keep, s_chosen;
    vec3 n, n_cached = v3(0, 0, 0);
    bool past = false, use_edge = false, crossing = true;

    v3_to_array(half1, b.h1);
    v3_to_array(half2, b.h2);
    v3_to_array(pose->R.r[0], b.R[0]);
    v3_to_array(pose->R.r[1], b.R[1]);
    v3_to_array(pose->R.r[2], b.R[2]);
    v3_to_array(pose->t, b.t);
    for (i = 0; i < 3; ++i)
        for (j = 0; j < 3; ++j) b.Q[i][j] = real_abs(b.R[i][j]);
    size = b.h1[0] + b.h1[1] + b.h1[2] + b.h2[0] + b.h2[1] + b.h2[2];
    b.limit = limit;
    b.slack = 4 * SADMM_EPSILON * size;
    reject = limit + b.slack;

    /* faces */
    for (i = 0; i < 3; ++i) {
        separation[i] = real_abs(b.t[i]) -
                        (b.h1[i] + b.Q[i][0] * b.h2[0] + b.Q[i][1] * b.h2[1] + b.Q[i][2] * b.h2[2]);
        if (separation[i] > reject) return;
        negative[i] = b.t[i] < 0;
    }
    for (j = 0; j < 3; ++j) {
        b.t2[j] = b.R[0][j] * b.t[0] + b.R[1][j] * b.t[1] + b.R[2][j] * b.t[2];
        separation[3 + j] = real_abs(b.t2[j]) -
                            (b.h2[j] + b.Q[0][j] * b.h1[0] + b.Q[1][j] * b.h1[1] + b.Q[2][j] * b.h1[2]);
        if (separation[3 + j] > reject) return;
        negative[3 + j] = b.t2[j] < 0;
    }
    b.thin = 2 * real_min(real_min(b.h1[0], real_min(b.h1[1], b.h1[2])), real_min(b.h2[0], real_min(b.h2[1], b.h2[2])));

    /* the cached side, past the midplane too */
    if (cached >= 0) {
        n_cached = box_axis_direction(&b, cached, cached_negative);
        past = n_cached.x * b.t[0] + n_cached.y * b.t[1] + n_cached.z * b.t[2] < (real)0.5 * b.thin;
        if (past) {
            for (axis = 0; axis < 6; ++axis) {
                real d = axis < 3 ? b.t[axis] : b.t2[axis - 3];
                vec3 a = box_axis_direction(&b, axis, 0);
                real c = v3_dot(a, n_cached);
                if (real_abs(c) > (real)0.9 && c * d < 0) {
                    separation[axis] -= 2 * real_abs(d);
                    negative[axis] = c < 0;
                }
            }
        }
    }
    for (axis = 0; axis < 6; ++axis)
        if (separation[axis] > s_face) {
            s_face = separation[axis];
            face = axis;
        }
    keep = MANIFOLD_KEEP_EXTENT * b.thin;
    if (cached >= 0 && cached < 6 && cached != face &&
        s_face <= separation[cached] + MANIFOLD_KEEP_DEPTH * real_max(0, -separation[cached]) + keep) {
        face = cached;
        s_face = separation[cached];
    }
    negative_face = negative[face];

    /* edges: only those that can beat the face need their length */
    for (i = 0; i < 3; ++i) {
        int i1 = i == 2 ? 0 : i + 1, i2 = i1 == 2 ? 0 : i1 + 1;
        for (j = 0; j < 3; ++j) {
            int j1 = j == 2 ? 0 : j + 1, j2 = j1 == 2 ? 0 : j1 + 1;
            int code = 6 + 3 * i + j;
            /* (e_i x b_j) . t = t[i2] R[i1][j] - t[i1] R[i2][j] */
            real d = b.t[i2] * b.R[i1][j] - b.t[i1] * b.R[i2][j];
            real r = b.h1[i1] * b.Q[i2][j] + b.h1[i2] * b.Q[i1][j] + b.h2[j1] * b.Q[i][j2] + b.h2[j2] * b.Q[i][j1];
            real s = real_abs(d) - r - b.slack, length2, length;
            int away = d < 0;
            /* s / length <= s when s <= 0, so an axis already behind the face stays behind */
            if (s <= s_face && code != cached && s <= 0) continue;
            length2 = b.R[i1][j] * b.R[i1][j] + b.R[i2][j] * b.R[i2][j];
            if (length2 < (sizeof(real) == 4 ? (real)1e-7 : (real)1e-16)) continue;
            length = real_sqrt(length2);
            s /= length;
            if (s > limit) return;
            if (past) {
                vec3 l = box_edge_axis(&b, i, j);
                real c = v3_dot(l, n_cached);
                if (real_abs(c) > (real)0.9 * length && c * d < 0) {
                    s -= 2 * real_abs(d) / length;
                    away = c < 0;
                }
            }
            if (code == cached) s += MANIFOLD_KEEP_DEPTH * real_max(0, -s) + keep;
            if (s > s_edge) {
                s_edge = s;
                edge = code;
                negative_edge = away;
            }
        }
    }
    if (edge >= 0) {
        vec3 ne = box_axis_direction(&b, edge, negative_edge);
        int near_face = -1;
        if (edge == cached || cached < 0) use_edge = s_edge > s_face;
        else use_edge = s_edge > s_face + MANIFOLD_KEEP_DEPTH * real_max(0, -s_face) + keep;
        for (axis = 0; axis < 6; ++axis)
            if (real_abs(v3_dot(box_axis_direction(&b, axis, 0), ne)) > MANIFOLD_COS_NEAR &&
                (near_face < 0 || separation[axis] > separation[near_face]))
                near_face = axis;
        if (near_face >= 0) {
            /* a face in the same direction: its points are worth more (the bonus of a cached edge does not count) */
            real s = s_edge - (edge == cached ? MANIFOLD_KEEP_DEPTH * real_max(0, -s_edge) + keep : 0);
            bool beaten = s > separation[near_face] + (real)0.05 * real_abs(separation[near_face]) + keep;
            if (use_edge && !beaten) {
                face = near_face;
                s_face = separation[face];
                negative_face = negative[face];
                use_edge = false;
            }
        }
    }
    n = box_axis_direction(&b, face, negative_face);

    s_chosen = s_face;
    if (use_edge) {
        m->cache = (uint32_t)(edge + 1) | (negative_edge ? BOX_AXIS_NEGATIVE : 0u);
        crossing = box_edge_manifold(&b, edge, negative_edge, m);
        if (m->count > 0) s_chosen = m->points[m->count - 1].separation;
        if (m->count > 0 && (crossing || s_chosen <= 0)) goto done;
        n = m->normal;
        s_chosen = s_edge;
    } else {
        m->cache = (uint32_t)(face + 1) | (negative_face ? BOX_AXIS_NEGATIVE : 0u);
        box_face_manifold(&b, face, negative_face, m);
        if (m->count > 0) goto done;
    }
    if (s_chosen > 0) {
        box_corner_manifold(&b, n, m);
    } else if (edge >= 0 && !use_edge && s_edge > s_face - b.thin) {
        /* the face is nearer but its points lie outside: the edges touch */
        box_edge_manifold(&b, edge, negative_edge, m);
        if (m->count > 0) m->cache = (uint32_t)(edge + 1) | (negative_edge ? BOX_AXIS_NEGATIVE : 0u);
        else box_vertex_manifold(&b, n, s_face, m);
    } else {
        box_vertex_manifold(&b, n, s_face, m);
    }
done:
    m->normal = v3_neg(m->normal);
}

#endif
