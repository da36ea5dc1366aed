/* The walk of gjk.h over the points of any pair: included by whoever defines
 *
 *   GJK_DISTANCE                    the function's name, with what comes before it
 *   GJK_PAIR                        the pair, with `slack`, the rounding of a separation
 *   GJK_SUPPORT(pair, d, at)        its difference_point farthest along d
 *   GJK_SAME(p, q)                  are two of them one?
 *   GJK_ENOUGH(pair, v2, length)    what the square of the distance, v2, may be too large by
 *
 * all of which end here. */

/* start: a direction from a to b, of any length. limit: the distance up to which it matters, between the cores. On
 * return *v: the shortest vector of a - b that was found, from b to a. */
GJK_DISTANCE(const GJK_PAIR *pair, vec3 start, real limit, struct gjk_simplex *s, vec3 *v)
{
    struct difference_point at;
    real v2;
    int move;
    at.a = at.b = 0;
    s->p[0] = GJK_SUPPORT(pair, start, &at);
    s->count = 1;
    s->weight[0] = 1;
    *v = s->p[0].w;
    v2 = v3_norm2(*v);
    if (-v3_dot(start, *v) > limit * v3_norm(start)) return GJK_FAR;
    for (move = 0; move < GJK_MOVES; ++move) {
        const struct gjk_simplex before = *s;
        struct difference_point next;
        vec3 x = v3(0, 0, 0);
        real along, length;
        int k;
        bool again = false;
        length = real_sqrt(v2);
        if (length <= pair->slack) return GJK_MEET;
        next = GJK_SUPPORT(pair, v3_neg(*v), &s->p[s->count - 1]);
        along = v3_dot(*v, next.w);
        if (along > limit * length) return GJK_FAR;
        for (k = 0; k < s->count; ++k) again |= GJK_SAME(&next, &s->p[k]);
        if (again || v2 - along <= GJK_ENOUGH(pair, v2, length)) return GJK_APART;
        s->p[s->count++] = next;
        if (s->count == 2) x = closest_on_segment(s);
        else if (s->count == 3) x = closest_on_triangle(s);
        else if (!closest_on_tetrahedron(s, &x)) return GJK_MEET;
        if (!(v3_norm2(x) < v2)) { /* rounding: no nearer any more */
            *s = before;
            return GJK_APART;
        }
        *v = x;
        v2 = v3_norm2(x);
    }
    return GJK_APART;
}

#undef GJK_DISTANCE
#undef GJK_PAIR
#undef GJK_SUPPORT
#undef GJK_SAME
#undef GJK_ENOUGH
