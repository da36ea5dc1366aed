/* Depth of two polytopes that meet: the expanding polytope algorithm (van den Bergen, "Proximity queries and
 * penetration depth computation on 3D game objects", GDC 2001). A polytope inside a - b grows towards the face of a - b
 * that is nearest to the origin, point by point, until it has that face itself. Heights of faces over the origin are
 * signed: where a - b just misses the origin the nearest face is the one that says so. How it grows is in epa_grow.h,
 * as it is the same for pairs that have other points.
 */
#ifndef SADMM_COLLISION_EPA_H
#define SADMM_COLLISION_EPA_H

#include "gjk.h"

enum { EPA_POINTS = 40, EPA_FACES = 2 * EPA_POINTS - 4, EPA_RIM = 3 * EPA_FACES };

struct epa_face {
    real height; /* of its plane over the origin, m; largest: it has no area, and is never asked */
    uint8_t corner[3]; /* counter-clockwise from outside */
};

struct epa {
    struct difference_point p[EPA_POINTS];
    struct epa_face face[EPA_FACES + 1];
    int points, faces;
    real least2; /* square of an area, twice, that has no direction */
    real thin2;  /* square of a sliver's height that leaves it none */
};

/* Not unit; outward. */
SADMM_INLINE vec3 epa_normal(const struct epa *e, const struct epa_face *f)
{
    const vec3 a = e->p[f->corner[0]].w;
    return v3_cross(v3_sub(e->p[f->corner[1]].w, a), v3_sub(e->p[f->corner[2]].w, a));
}

SADMM_INLINE void epa_add_face(struct epa *e, int a, int b, int c)
{
    struct epa_face *f = &e->face[e->faces];
    vec3 n;
    real n2, side2;
    if (e->faces == EPA_FACES) return;
    f->corner[0] = (uint8_t)a;
    f->corner[1] = (uint8_t)b;
    f->corner[2] = (uint8_t)c;
    n = epa_normal(e, f);
    n2 = v3_norm2(n);
    side2 = real_max(v3_norm2(v3_sub(e->p[b].w, e->p[a].w)),
                     real_max(v3_norm2(v3_sub(e->p[c].w, e->p[b].w)), v3_norm2(v3_sub(e->p[a].w, e->p[c].w))));
    f->height = n2 > e->least2 && n2 > e->thin2 * side2 ? v3_dot(n, e->p[a].w) / real_sqrt(n2) : SADMM_REAL_MAX;
    ++e->faces;
}

/* Take a face away. Its sides become rim, but for those that were rim already: the faces on both sides have gone. */
SADMM_INLINE int epa_take(struct epa *e, int f, uint8_t rim[EPA_RIM][2], int sides)
{
    int k, i;
    for (k = 0; k < 3; ++k) {
        const uint8_t from = e->face[f].corner[k], to = e->face[f].corner[k < 2 ? k + 1 : 0];
        for (i = 0; i < sides && !(rim[i][0] == to && rim[i][1] == from);) ++i;
        if (i < sides) {
            --sides;
            rim[i][0] = rim[sides][0];
            rim[i][1] = rim[sides][1];
        } else {
            rim[sides][0] = from;
            rim[sides][1] = to;
            ++sides;
        }
    }
    e->face[f] = e->face[--e->faces];
    return sides;
}

/* The simplex becomes the face's corners. The origin's foot on its plane may be beside this triangle, on another one of
 * the same face of a - b: the weights go on there. */
SADMM_INLINE void epa_simplex(const struct epa *e, const struct epa_face *face, vec3 normal, real height,
                              struct gjk_simplex *s)
{
    int k;
    s->count = 3;
    for (k = 0; k < 3; ++k) s->p[k] = e->p[face->corner[k]];
    simplex_weigh(s, v3_scale(normal, height), normal);
}

#define EPA_NAME(name) epa_##name
#define EPA_PAIR struct polytope_pair
#define EPA_SUPPORT pair_support
#define EPA_SAME same_point
#define EPA_ENOUGH(pair) ((pair)->slack / 2)
#include "epa_grow.h"

#endif
