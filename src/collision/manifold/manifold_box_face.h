/* Face clipping along the normal: the face of the other box that points against the reference face is clipped by its
 * sides (Sutherland-Hodgman). The edges of the polygon carry labels, from which the features of its vertices follow.
 * The normal is the reference face's own, or that of an edge axis near it (manifold_box.h): then the incident face is
 * projected onto the reference plane along the normal, and separations are along it. */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_BOX_FACE_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_BOX_FACE_H

#include "manifold_box_pair.h"

/* A vertex of the clipped polygon: in-plane coordinates and separation, and the edge that leaves it: 0-3 edge of the
 * incident face, 4-7 side of the reference face (+u, -u, +v, -v). */
struct clip_vertex {
    real at[ROW3]; /* x, y, z */
    int out;
};

/* What a polygon takes in memory: at most ten vertices, and the first one once more. */
enum { CLIP_VERTICES = 12 };

/* Keep the part of the polygon `in` with sign * coordinate <= h: all of it, or what is then in `out`. Which vertices
 * stay has no order that a processor could foresee: it writes both the vertex and the crossing, and then counts what
 * stays. */
SADMM_INLINE struct clip_vertex *clip_side(struct clip_vertex *in, int *vertices, int axis, real sign, real h,
                                           real tolerance, int label, struct clip_vertex *out)
{
    const int count = *vertices;
    real dp = sign * in[0].at[axis] - h;
    int i, n = 0, all = 1;
    for (i = 0; i < count; ++i) all &= sign * in[i].at[axis] - h <= tolerance;
    if (all) return in;
    r3_store(r3_load(in[0].at), in[count].at);
    for (i = 0; i < count && n <= SADMM_MANIFOLD_POINTS; ++i) {
        const real dq = sign * in[i + 1].at[axis] - h;
        const int inside = dp <= tolerance, crosses = inside ^ (dq <= tolerance), leaves = in[i].out;
        const row3 p = r3_load(in[i].at);
        r3_store(p, out[n].at);
        out[n].out = leaves;
        n += inside;
#ifdef __CUDA_ARCH__
        if (crosses) /* a division there is long */
#endif
        {
            const real f = real_min(1, real_max(0, dp / (dp - dq)));
            r3_store(r3_madd(p, f, r3_sub(r3_load(in[i + 1].at), p)), out[n].at);
            out[n].out = leaves ^ ((leaves ^ label) & -inside);
        }
        n += crosses;
        dp = dq;
    }
    *vertices = n;
    return out;
}

/* How the normal leans in the reference frame: its components along u and v over that along the face's own normal, and
 * the latter. (0, 0, 1): it is the face's normal. */
struct box_lean {
    real u, v, cosine;
};

/* Points of reference face (axis k, side sg of the reference box hr) against the incident box (hi, axes: columns of R,
 * centre t, all in the reference frame). thin: the thinner extent of both. owner: 1 when the reference is box 2.
 * Appends points within the limit to m, which has others already in completions; positions are in the reference
 * frame. */
SADMM_INLINE void box_clip_face(const real hr[3], const real hi[3], const real R[3][3], const real t[3], int k, real sg,
                                struct box_lean lean, real limit, real thin, int owner, struct manifold *m)
{
    int first = m->count;
    int u = k == 2 ? 0 : k + 1, v = u == 2 ? 0 : u + 1, j = 0, ju, jv, q, i, count = 4, base_bits, ref_bits;
    struct clip_vertex polygons[2][CLIP_VERTICES], *poly = polygons[0];
    int bits[4];
    real si, cx, cy, cz, ux, uy, uz, vx, vy, vz, tol_u, tol_v, tol_z;
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
    tol_z = MANIFOLD_SNAP * thin;
    for (q = 0; q < 4; ++q) {
        /* around the face: (+,+), (-,+), (-,-), (+,-) */
        int pu = q == 0 || q == 3, pv = q < 2;
        real a = pu ? (real)1 : (real)-1, b = pv ? (real)1 : (real)-1;
        real x = cx + a * ux + b * vx, y = cy + a * uy + b * vy, z = cz + a * uz + b * vz;
        x -= lean.u * z;
        y -= lean.v * z;
        r3_store(r3_of(v3(x, y, z)), poly[q].at);
        poly[q].out = q;
        bits[q] = base_bits | (pu ? 1 << ju : 0) | (pv ? 1 << jv : 0);
        clip_u |= real_abs(x) > hr[u] + tol_u;
        clip_v |= real_abs(y) > hr[v] + tol_v;
    }
    if (clip_u) {
        poly = clip_side(poly, &count, 0, 1, hr[u], tol_u, 4, polygons[1]);
        poly = clip_side(poly, &count, 0, -1, hr[u], tol_u, 5, polygons[poly == polygons[0]]);
    }
    if (clip_v) {
        poly = clip_side(poly, &count, 1, 1, hr[v], tol_v, 6, polygons[poly == polygons[0]]);
        poly = clip_side(poly, &count, 1, -1, hr[v], tol_v, 7, polygons[poly == polygons[0]]);
    }
    for (i = 0; i < count; ++i) {
        const struct clip_vertex *p = &poly[i];
        int in = poly[i > 0 ? i - 1 : count - 1].out, out = p->out, d;
        uint32_t feature;
        real position[3], separation = p->at[2] / lean.cosine;
        int duplicate = 0;
        /* on a corner of the reference face? */
        const int at_u = real_abs(real_abs(p->at[0]) - hr[u]) <= tol_u,
                  at_v = real_abs(real_abs(p->at[1]) - hr[v]) <= tol_v, corner = at_u & at_v;
        int corner_bits = ref_bits | (p->at[0] > 0 ? 1 << u : 0) | (p->at[1] > 0 ? 1 << v : 0);
        if (separation > limit) continue;
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
            real dx = real_abs(m->points[d].position.x - p->at[0]), dy = real_abs(m->points[d].position.y - p->at[1]);
            /* near each other on a face that is long and steep, but not equally deep: two points */
            real dz = real_abs(m->points[d].separation - separation);
            duplicate |= (m->points[d].feature == feature) |
                         ((d >= first) & (dx <= tol_u) & (dy <= tol_v) & (dz <= tol_z));
        }
        if (duplicate || m->count == SADMM_MANIFOLD_POINTS) continue;
        position[0] = p->at[0];
        position[1] = p->at[1];
        position[2] = p->at[2];
        manifold_add(m, v3_from_array(position), separation, feature);
    }
    /* in-plane to the reference frame, halfway between the incident face and the reference face */
    for (i = first; i < m->count; ++i) {
        real position[3], half = lean.cosine * m->points[i].separation / 2;
        position[u] = m->points[i].position.x + lean.u * half;
        position[v] = m->points[i].position.y + lean.v * half;
        position[k] = sg * (hr[k] + half);
        m->points[i].position = v3_from_array(position);
    }
}

/* Appends the points of a face axis, seen along m->normal: the face's own, or one near it (`leans`). */
SADMM_INLINE void box_face_manifold(const struct box_pair *b, int axis, int negative, bool leans, struct manifold *m)
{
    /* as the separation of the axis was judged: faces that touch keep their points, whatever their rounding says */
    const real limit = b->limit + b->slack;
    const int owner = axis >= 3, k = owner ? axis - 3 : axis, u = k == 2 ? 0 : k + 1, v = u == 2 ? 0 : u + 1;
    /* in the frame of 2 the normal from 1 to 2 points out of 1: the reference side of 2 is opposite */
    const real sg = (negative != 0) != (owner != 0) ? (real)-1 : (real)1;
    struct box_lean lean = {0, 0, 1};
    real R[3][3], t[3], hr[3], hi[3];
    int i, j, first = m->count;

    for (i = 0; i < 3; ++i) {
        for (j = 0; j < 3; ++j) R[i][j] = owner ? b->R[j][i] : b->R[i][j];
        t[i] = owner ? -b->t2[i] : b->t[i];
        hr[i] = owner ? b->h2[i] : b->h1[i];
        hi[i] = owner ? b->h1[i] : b->h2[i];
    }
    if (leans) {
        real n[3], along[3];
        v3_to_array(m->normal, n);
        for (i = 0; i < 3; ++i) along[i] = owner ? -(R[i][0] * n[0] + R[i][1] * n[1] + R[i][2] * n[2]) : n[i];
        lean.cosine = sg * along[k];
        lean.u = along[u] / lean.cosine;
        lean.v = along[v] / lean.cosine;
    }
    box_clip_face(hr, hi, R, t, k, sg, lean, limit, b->thin, owner, m);
    if (!owner) return;
    for (i = first; i < m->count; ++i) {
        real p[3], q[3];
        v3_to_array(m->points[i].position, p);
        for (j = 0; j < 3; ++j) q[j] = b->t[j] + b->R[j][0] * p[0] + b->R[j][1] * p[1] + b->R[j][2] * p[2];
        m->points[i].position = v3_from_array(q);
    }
}

#endif
