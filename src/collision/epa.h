/* Depth of two polytopes that meet: the expanding polytope algorithm (van den Bergen, "Proximity queries and
 * penetration depth computation on 3D game objects", GDC 2001). A polytope inside a - b grows towards the face of a - b
 * that is nearest to the origin, point by point, until it has that face itself. Heights of faces over the origin are
 * signed: where a - b just misses the origin the nearest face is the one that says so.
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

/* Of the points of a - b farthest along d and against it the one that is farther from the plane through `origin` across
 * d. */
SADMM_INLINE struct difference_point epa_farther(const struct polytope_pair *pair, vec3 d, vec3 origin)
{
    const struct difference_point zero = {{0, 0, 0}, 0, 0};
    const struct difference_point up = pair_support(pair, d, &zero), down = pair_support(pair, v3_neg(d), &zero);
    return real_abs(v3_dot(d, v3_sub(up.w, origin))) >= real_abs(v3_dot(d, v3_sub(down.w, origin))) ? up : down;
}

/* A tetrahedron with as many of the simplex's points as are of use. False: a - b is flat but for rounding. */
SADMM_INLINE bool epa_begin(const struct polytope_pair *pair, const struct gjk_simplex *s, struct epa *e)
{
    struct difference_point *p = e->p;
    vec3 d, n;
    int k;
    e->least2 = SADMM_EPSILON * SADMM_EPSILON * pair->size * pair->size;
    e->least2 *= e->least2;
    e->thin2 = pair->slack * pair->slack / 16;
    e->faces = 0;
    e->points = 4;
    p[0] = p[1] = p[2] = s->p[0]; /* NaN is farther than nothing */
    if (s->count > 1) {
        p[1] = s->p[1];
    } else {
        real most = -1;
        for (k = 0; k < 3; ++k) {
            const vec3 axis = v3_axis(k, 1);
            const struct difference_point q = epa_farther(pair, axis, p[0].w);
            const real far2 = v3_norm2(v3_sub(q.w, p[0].w));
            if (far2 > most) {
                most = far2;
                p[1] = q;
            }
        }
    }
    d = v3_sub(p[1].w, p[0].w);
    if (s->count > 2) {
        p[2] = s->p[2];
    } else {
        real most = -1;
        for (k = 0; k < 3; ++k) {
            const vec3 across = v3_cross(d, v3_axis(k, 1));
            const struct difference_point q = epa_farther(pair, across, p[0].w);
            const real area2 = v3_norm2(v3_cross(d, v3_sub(q.w, p[0].w)));
            if (area2 > most) {
                most = area2;
                p[2] = q;
            }
        }
    }
    n = v3_cross(d, v3_sub(p[2].w, p[0].w));
    p[3] = epa_farther(pair, n, p[0].w);
    if (s->count > 3 && real_abs(v3_dot(n, v3_sub(s->p[3].w, p[0].w))) >=
                            (real)0.1 * real_abs(v3_dot(n, v3_sub(p[3].w, p[0].w))))
        p[3] = s->p[3];
    {
        const real volume = v3_dot(n, v3_sub(p[3].w, p[0].w));
        if (!(real_abs(volume) > SADMM_EPSILON * pair->slack * pair->size * pair->size)) return false;
        if (volume > 0) { /* p[3] is on the side that the corners 0, 1, 2 face: turned round, they face away from it */
            const struct difference_point swap = p[1];
            p[1] = p[2];
            p[2] = swap;
        }
    }
    epa_add_face(e, 0, 1, 2);
    epa_add_face(e, 0, 3, 1);
    epa_add_face(e, 1, 3, 2);
    epa_add_face(e, 2, 3, 0);
    return true;
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

/* Is the face beside what has gone, and does `next` see it, or lie in its plane? */
SADMM_INLINE bool epa_goes(const struct polytope_pair *pair, const struct epa *e, const struct epa_face *face,
                           uint8_t rim[EPA_RIM][2], int sides, vec3 next)
{
    const vec3 n = epa_normal(e, face);
    const real above = v3_dot(n, v3_sub(next, e->p[face->corner[0]].w));
    int k, i;
    if (!(above >= 0 || above * above <= pair->slack * pair->slack / 16 * v3_norm2(n))) return false;
    for (k = 0; k < 3; ++k) {
        const uint8_t from = face->corner[k], to = face->corner[k < 2 ? k + 1 : 0];
        for (i = 0; i < sides; ++i)
            if (rim[i][0] == to && rim[i][1] == from) return true;
    }
    return false;
}

/* Put `next` in, which face f sees: from there on what it sees goes, and what is in one plane with it, as that would
 * leave slivers; new faces join it to the rim of that. */
SADMM_INLINE void epa_grow(const struct polytope_pair *pair, struct epa *e, int f, struct difference_point next)
{
    uint8_t rim[EPA_RIM][2];
    int sides = epa_take(e, f, rim, 0), k;
    bool more = true;
    while (more) {
        more = false;
        for (f = 0; f < e->faces;) {
            if (!epa_goes(pair, e, &e->face[f], rim, sides, next.w)) {
                ++f;
                continue;
            }
            sides = epa_take(e, f, rim, sides);
            more = true;
        }
    }
    e->p[e->points] = next;
    for (k = 0; k < sides; ++k) epa_add_face(e, rim[k][0], rim[k][1], e->points);
    ++e->points;
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
