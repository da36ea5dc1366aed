/* The pair manifolds compiled in float, for test_manifold.c. */
#define SADMM_REAL float

#include <string.h>

#include "collision/manifold/pair_manifold.h"

/* As in manifold_tools.h, which is compiled in double. */
struct world_manifold {
    int count;
    double normal[3];
    double position[SADMM_MANIFOLD_POINTS][3];
    double separation[SADMM_MANIFOLD_POINTS];
    uint32_t feature[SADMM_MANIFOLD_POINTS];
    uint32_t cache;
};

void manifold_in_float(int type_a, const double size_a[3], int type_b, const double size_b[3], const double Ra[9],
                       const double xa[3], const double Rb[9], const double xb[3], double limit, uint32_t cache,
                       struct world_manifold *out);

void manifold_in_float(int type_a, const double size_a[3], int type_b, const double size_b[3], const double Ra[9],
                       const double xa[3], const double Rb[9], const double xb[3], double limit, uint32_t cache,
                       struct world_manifold *out)
{
    struct pair_pose pose = pair_pose(type_a == SADMM_SHAPE_PLANE, Ra, xa, Rb, xb);
    struct sadmm_geometry a = {.type = type_a, .subshapes = 1}, b = {.type = type_b, .subshapes = 1};
    struct manifold m;
    double n[3];

    memset(out, 0, sizeof *out);
    memset(&m, 0x55, sizeof m);
    memcpy(a.size, size_a, sizeof a.size);
    memcpy(b.size, size_b, sizeof b.size);
    pair_manifold(&a, &b, NULL, 0, &pose, (float)limit, cache, &m);
    out->count = m.count;
    out->cache = m.cache;
    if (m.count == 0) return;
    v3_store(m.normal, n);
    for (int k = 0; k < 3; ++k) out->normal[k] = Rb[3 * k] * n[0] + Rb[3 * k + 1] * n[1] + Rb[3 * k + 2] * n[2];
    for (int i = 0; i < m.count; ++i) {
        double p[3];
        v3_store(m.points[i].position, p);
        for (int k = 0; k < 3; ++k)
            out->position[i][k] = xb[k] + Rb[3 * k] * p[0] + Rb[3 * k + 1] * p[1] + Rb[3 * k + 2] * p[2];
        out->separation[i] = (double)m.points[i].separation;
        out->feature[i] = m.points[i].feature;
    }
}
