/* Two boxes while their manifold is computed: box 1 is b of the pair (its frame is the frame of the computation), box
 * 2 is a. Names of axes and features.
 */
#ifndef SADMM_COLLISION_MANIFOLD_MANIFOLD_BOX_PAIR_H
#define SADMM_COLLISION_MANIFOLD_MANIFOLD_BOX_PAIR_H

#include "manifold_box_round.h"

/* cache: 1 + axis, axis 0-2 faces of 1, 3-5 faces of 2, 6-14 edge pairs 6 + 3 i + j. Faces: 16 when the normal (1 to 2)
 * is along the negative axis. Edge pairs: the normal itself, in the frame of 1 (manifold_direction_bits). */
enum { BOX_AXIS_MASK = 15, BOX_AXIS_NEGATIVE = 16 };

struct box_pair {
    real h1[ROW3], h2[ROW3];
    real R[3][ROW3]; /* axes of 2 in the frame of 1: columns */
    real t[ROW3];    /* centre of 2 in the frame of 1 */
    real t2[ROW3];   /* the same along the axes of 2 */
    real limit, thin, slack; /* slack: rounding of a separation */
};

SADMM_INLINE void box_pair_make(vec3 half1, vec3 half2, const struct pair_pose *pose, real limit, struct box_pair *b)
{
    int i;
    r3_store(r3_of(half1), b->h1);
    r3_store(r3_of(half2), b->h2);
    for (i = 0; i < 3; ++i) r3_store(pose->R[i], b->R[i]);
    r3_store(pose->t, b->t);
    b->limit = limit;
    b->slack = 4 * SADMM_EPSILON * (b->h1[0] + b->h1[1] + b->h1[2] + b->h2[0] + b->h2[1] + b->h2[2]);
    b->thin = 2 * real_min(real_min(b->h1[0], real_min(b->h1[1], b->h1[2])),
                           real_min(b->h2[0], real_min(b->h2[1], b->h2[2])));
}

/* Edge pair (i, j): axis e_i x b_j, not normalised. */
SADMM_INLINE vec3 box_edge_axis(const struct box_pair *b, int i, int j)
{
    real x = b->R[0][j], y = b->R[1][j], z = b->R[2][j];
    return i == 0 ? v3(0, -z, y) : (i == 1 ? v3(z, 0, -x) : v3(-y, x, 0));
}

/* Direction 1 to 2 of an axis code (axis | BOX_AXIS_NEGATIVE), unit. */
SADMM_HOST_INLINE vec3 box_axis_direction(const struct box_pair *b, int axis, int negative)
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

/* Features. Vertex of box 1: 1 + v; of box 2: 9 + v (v: bit k set when coordinate k is positive). Crossing of edge e1
 * of box 1 and e2 of box 2: 32 + 12 e1 + e2. Corners apart: 256 + 3 e2 + (two ends of a stretch, closest point). An
 * edge is 4 x direction + the signs of the two following axes. */
SADMM_INLINE int box_edge_id(int direction, int bit_u, int bit_v) { return 4 * direction + bit_u + 2 * bit_v; }

SADMM_INLINE uint32_t box_feature_crossing(int e1, int e2) { return 32u + 12u * (uint32_t)e1 + (uint32_t)e2; }
SADMM_INLINE uint32_t box_feature_vertex(int owner_is_2, int v) { return (owner_is_2 ? 9u : 1u) + (uint32_t)v; }

#endif
