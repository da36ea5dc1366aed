/* Depth of two polytopes that meet: the expanding polytope algorithm (van den Bergen, "Proximity queries and
 * penetration depth computation on 3D game objects", GDC 2001). A polytope inside a - b grows towards the face of a - b
 * that is nearest to the origin, point by point, until it has that face itself. Heights of faces over the origin are
 * signed: where a - b just misses the origin the nearest face is the one that says so. How it grows is in epa_grow.h,
 * as it is the same for pairs that have other points.
 */
#ifndef SADMM_COLLISION_CONVEX_EPA_H
#define SADMM_COLLISION_CONVEX_EPA_H

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
#include "epa_grow.h"

/* The face of a - b nearest to the origin: its outward normal, unit, its points with the weights of the one nearest to
 * the origin, and how far a - b reaches along the normal: where points run out or rounding turns a face, that is still
 * true, of the best normal that was met. False: rounding has let none be found. */
SADMM_INLINE bool epa_depth(const struct polytope_pair *pair, struct gjk_simplex *s, vec3 *normal, real *height)
{
    struct epa e;
    struct epa_face found = {SADMM_REAL_MAX, {0, 0, 0}};
    *height = SADMM_REAL_MAX;
    if (!epa_begin(pair, s, &e)) return false;
    for (;;) {
        struct difference_point next;
        struct epa_face *best = &e.face[0];
        vec3 n;
        real reach;
        int f, k;
        bool again = false, done;
        for (f = 1; f < e.faces; ++f)
            if (e.face[f].height < best->height) best = &e.face[f];
        if (e.faces == 0 || !(best->height < SADMM_REAL_MAX)) break;
        n = epa_normal(&e, best);
        n = v3_scale(n, 1 / v3_norm(n));
        next = pair_support(pair, n, &e.p[best->corner[0]]);
        reach = v3_dot(n, next.w);
        done = reach - best->height <= pair->slack / 2;
        if (reach < *height || (done && reach <= *height + pair->slack)) {
            *height = reach;
            *normal = n;
            found = *best;
        }
        if (done) break;
        for (k = 0; k < e.points; ++k) again |= same_point(&next, &e.p[k]);
        if (again) { /* not a face of the hull of these points: rounding has turned it */
            best->height = SADMM_REAL_MAX;
            continue;
        }
        if (e.points == EPA_POINTS) break;
        epa_grow(pair, &e, (int)(best - e.face), next);
    }
    if (!(*height < SADMM_REAL_MAX)) return false;
    epa_simplex(&e, &found, *normal, *height, s);
    return true;
}

#endif
