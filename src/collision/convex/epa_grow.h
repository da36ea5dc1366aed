/* The growth of epa.h over the points of any pair: included by whoever defines
 *
 *   EPA_NAME(name)             the functions' names
 * EPA_PAIR the pair, with `slack`, the rounding of a separation, and `size`, what that is measured by
 *   EPA_SUPPORT(pair, d, at)   its difference_point farthest along d
 *
 * all of which end here. */

/* Of the points of a - b farthest along d and against it the one that is farther from the plane through `origin` across
 * d. */
SADMM_INLINE struct difference_point EPA_NAME(farther)(const EPA_PAIR *pair, vec3 d, vec3 origin)
{
    const struct difference_point zero = {{0, 0, 0}, 0, 0};
    const struct difference_point up = EPA_SUPPORT(pair, d, &zero), down = EPA_SUPPORT(pair, v3_neg(d), &zero);
    return real_abs(v3_dot(d, v3_sub(up.w, origin))) >= real_abs(v3_dot(d, v3_sub(down.w, origin))) ? up : down;
}

/* A tetrahedron with as many of the simplex's points as are of use. False: a - b is flat but for rounding. */
SADMM_INLINE bool EPA_NAME(begin)(const EPA_PAIR *pair, const struct gjk_simplex *s, struct epa *e)
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
            const struct difference_point q = EPA_NAME(farther)(pair, axis, p[0].w);
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
            const struct difference_point q = EPA_NAME(farther)(pair, across, p[0].w);
            const real area2 = v3_norm2(v3_cross(d, v3_sub(q.w, p[0].w)));
            if (area2 > most) {
                most = area2;
                p[2] = q;
            }
        }
    }
    n = v3_cross(d, v3_sub(p[2].w, p[0].w));
    p[3] = EPA_NAME(farther)(pair, n, p[0].w);
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

/* Is the face beside what has gone, and does `next` see it, or lie in its plane? */
SADMM_INLINE bool EPA_NAME(goes)(const EPA_PAIR *pair, const struct epa *e, const struct epa_face *face,
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
SADMM_INLINE void EPA_NAME(grow)(const EPA_PAIR *pair, struct epa *e, int f, struct difference_point next)
{
    uint8_t rim[EPA_RIM][2];
    int sides = epa_take(e, f, rim, 0), k;
    bool more = true;
    while (more) {
        more = false;
        for (f = 0; f < e->faces;) {
            if (!EPA_NAME(goes)(pair, e, &e->face[f], rim, sides, next.w)) {
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

#undef EPA_NAME
#undef EPA_PAIR
#undef EPA_SUPPORT
