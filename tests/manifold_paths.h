/* Pairs of shapes that rest, slide, tumble and are pushed through each other: every manifold along the way, its cache
 * carried on as a step does, against the separating axes in double without preference or memory.
 *
 * A path is slow when no point of one body moves by more than a fifth of the thinner extent in a step as the other
 * sees it, and shallow while the bodies are not near a midplane (make_path says where). Then none is passed: a normal n
 * that was right has n . t (t from centre to centre) of a quarter of that extent or more, its opposite is deeper by
 * twice that, and a step makes up for two fifths of the extent at most. So on a slow and shallow path every manifold is
 * as deep as the truth, but for the margins of path_margin. On other paths a direction near the opposite of the last
 * normal may be left out where the shapes overlap, or the side of the last normal kept: that, and no more, may be
 * remembered. A body pushed on through the other, slowly, is pushed back to where it came from as long as the two
 * overlap. */
#ifndef SADMM_TESTS_MANIFOLD_PATHS_H
#define SADMM_TESTS_MANIFOLD_PATHS_H

#include "manifold_tools.h"

void manifold_in_float(int type_a, const double size_a[3], int type_b, const double size_b[3], const double Ra[9],
                       const double xa[3], const double Rb[9], const double xb[3], double limit, uint32_t cache,
                       struct world_manifold *out);

enum path_pair { PATH_BOX_BOX, PATH_SPHERE_BOX, PATH_CAPSULE_BOX, PATH_CAPSULE_CAPSULE, PATH_PAIRS };
enum path_motion { PATH_RESTING, PATH_SLIDING, PATH_TUMBLING, PATH_THROUGH, PATH_MOTIONS };

/* What a set of paths has shown. */
struct path_counts {
    long poses, contacts, strict; /* strict: compared with the truth itself */
    long kept;                    /* beyond the midplane, the side kept */
    long reversed;                /* the cached axis is an edge axis, and its cross product has changed sign */
    double worst;                 /* of excess / margin, strict poses */
};

/* ---- the truth --------------------------------------------------------------------------------------------------- */

/* Directions a to b along which the solids are apart most, or overlap least: local maxima of the separation. */
struct ways {
    int count;
    double d[30][3], s[30];
    bool apart; /* or at least their cores are: then there is one way only */
    bool either; /* capsules: at the end of the stretch where a side is remembered */
};

static inline void cross3(const double a[3], const double b[3], double out[3])
{
    double t[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    memcpy(out, t, sizeof t);
}

static inline void apply_transposed(const double R[9], const double v[3], double out[3])
{
    for (int k = 0; k < 3; ++k) out[k] = R[k] * v[0] + R[3 + k] * v[1] + R[6 + k] * v[2];
}

static inline void column(const double R[9], int j, double out[3])
{
    for (int k = 0; k < 3; ++k) out[k] = R[3 * k + j];
}

static inline void add_ways(struct ways *w, const struct solid *a, const struct solid *b, const double axis[3])
{
    double length = sqrt(dot3(axis, axis));
    if (length < 1e-9) return; /* parallel edges: faces stand for them */
    for (int side = -1; side <= 1; side += 2) {
        double *d = w->d[w->count];
        for (int k = 0; k < 3; ++k) d[k] = side * axis[k] / length;
        w->s[w->count++] = separation_along(a, b, d);
    }
}

/* Closest points of the cores of two solids one of which is no box: alternating minimisation has no use for segments
 * that cross, so the segment is searched by thirds (the distance to a convex core is convex along it). */
static inline double core_distance(const struct solid *a, const struct solid *b, double d[3])
{
    double axis[3], lo = -1, hi = 1, half = a->type == SADMM_SHAPE_CAPSULE ? a->size[1] : 0, p[3], q[3];
    column(a->R, 2, axis);
    for (int i = 0; i < (half > 0 ? 60 : 1); ++i) {
        double f[2];
        for (int side = 0; side < 2; ++side) {
            double s = side ? hi - (hi - lo) / 3 : lo + (hi - lo) / 3;
            for (int k = 0; k < 3; ++k) p[k] = a->x[k] + s * half * axis[k];
            project_on_core(b, p, q);
            for (int k = 0; k < 3; ++k) q[k] -= p[k];
            f[side] = dot3(q, q);
        }
        if (f[0] < f[1]) hi = hi - (hi - lo) / 3;
        else lo = lo + (hi - lo) / 3;
    }
    for (int k = 0; k < 3; ++k) p[k] = a->x[k] + 0.5 * (lo + hi) * half * axis[k];
    project_on_core(b, p, q);
    for (int k = 0; k < 3; ++k) d[k] = q[k] - p[k];
    return sqrt(dot3(d, d));
}

/* a is the solid of the lower type. */
static inline void find_ways(const struct solid *a, const struct solid *b, struct ways *w)
{
    double d[3], axis[3], e[3], f[3];
    w->count = 0;
    w->apart = w->either = false;
    if (a->type == SADMM_SHAPE_BOX) {
        for (int k = 0; k < 3; ++k) {
            column(a->R, k, axis);
            add_ways(w, a, b, axis);
            column(b->R, k, axis);
            add_ways(w, a, b, axis);
        }
        for (int i = 0; i < 9; ++i) {
            column(a->R, i / 3, e);
            column(b->R, i % 3, f);
            cross3(e, f, axis);
            add_ways(w, a, b, axis);
        }
        for (int i = 0; i < w->count; ++i) w->apart = w->apart || w->s[i] > 0;
        return;
    }
    double distance = core_distance(a, b, d), reach = 1e-9;
    column(a->R, 2, e);
    if (b->type == SADMM_SHAPE_CAPSULE) {
        column(b->R, 2, f);
        cross3(e, f, axis);
        /* where the axes pass each other the closest direction is across both; its opposite may be remembered */
        double sine = sqrt(dot3(axis, axis)), across = fabs(dot3(d, axis)) / (sine + 1e-300),
               share = distance / (a->size[0] + b->size[0]);
        if (sine > 0.9e-3 && across > (1 - 1e-6) * distance && share < 0.51) {
            w->either = sine < 1.1e-3 || across < (1 - 1e-12) * distance || share > 0.49;
            add_ways(w, a, b, axis);
            return;
        }
    }
    if (distance > reach * (a->size[0] + a->size[1] + b->size[0] + b->size[1])) {
        w->count = 1;
        w->apart = true;
        for (int k = 0; k < 3; ++k) w->d[0][k] = d[k] / distance;
        w->s[0] = separation_along(a, b, w->d[0]);
        return;
    }
    for (int k = 0; k < 3; ++k) {
        column(b->R, k, f);
        add_ways(w, a, b, f);
        if (a->type != SADMM_SHAPE_CAPSULE) continue;
        cross3(e, f, axis);
        add_ways(w, a, b, axis);
    }
}

/* Largest separation, over directions less than acos(least) from `n` (NULL: all); *axis gets its direction. */
static inline double best_way(const struct ways *w, const double n[3], double least, double axis[3])
{
    double best = -HUGE_VAL;
    if (axis) memset(axis, 0, 3 * sizeof *axis);
    for (int i = 0; i < w->count; ++i)
        if (w->s[i] > best && (!n || dot3(w->d[i], n) > least)) {
            best = w->s[i];
            if (axis) memcpy(axis, w->d[i], sizeof w->d[i]);
        }
    return best;
}

/* ---- paths ------------------------------------------------------------------------------------------------------- */

static inline double log_in(struct random *r, double lo, double hi) { return lo * pow(hi / lo, random_unit(r)); }

static inline struct solid path_box(struct random *r, int kind)
{
    double h = log_in(r, 0.01, 0.1);
    struct solid s = box_at(h, h, h, 0, 0, 0);                                     /* 0: a cube, equal for both */
    if (kind == 1)
        for (int k = 0; k < 3; ++k) s.size[k] = log_in(r, 0.01, 0.1);              /* any */
    if (kind == 2) s.size[(int)random_in(r, 0, 3)] = log_in(r, 0.005, 0.1) * h;    /* a plate */
    if (kind == 3) {
        int along = (int)random_in(r, 0, 3);
        for (int k = 0; k < 3; ++k)
            if (k != along) s.size[k] = log_in(r, 0.01, 0.1) * h;                  /* a needle */
    }
    return s;
}

static inline struct solid path_round(struct random *r, int type)
{
    double radius = log_in(r, 0.003, 0.05), half = type == SADMM_SHAPE_CAPSULE ? radius * log_in(r, 0.3, 10) : 0;
    return solid_at(type, radius, half, 0, 0, 0, 0);
}

static inline void random_direction(struct random *r, double d[3])
{
    spread_direction((int)random_in(r, 0, 4096), 4096, d);
}

struct path {
    struct solid a, b; /* a of the lower type */
    enum path_motion motion;
    double thin, angle;      /* m, rad a step */
    double beyond;           /* shallow: the separation is more, m */
    bool slow;
    double base_a[9], base_b[9], spin_a[3], spin_b[3], slide[3];
    double mean, swing, phase; /* of the separation, m */
    bool shallow;            /* up to now */
};

/* Two boxes edge to edge: parallel edges, one ridge over the other, a little beside it. */
static inline void put_ridge_on_ridge(struct path *p, struct random *r)
{
    int c = (int)random_in(r, 0, 3), u = (c + 1) % 3, v = (c + 2) % 3;
    double axis[3], edge_a[3] = {0, 0, 0}, edge_b[3] = {0, 0, 0}, along = random_in(r, -1, 1), beside[3];
    column(p->b.R, c, axis);
    memcpy(p->a.R, p->b.R, sizeof p->a.R);
    turn(&p->a, axis[0], axis[1], axis[2], M_PI + random_in(r, -0.6, 0.6));
    edge_a[u] = p->a.size[u];
    edge_a[v] = p->a.size[v];
    edge_b[u] = p->b.size[u];
    edge_b[v] = p->b.size[v];
    apply(p->a.R, edge_a, edge_a);
    apply(p->b.R, edge_b, edge_b);
    random_direction(r, beside);
    for (int k = 0; k < 3; ++k)
        p->b.x[k] = p->a.x[k] + edge_a[k] - edge_b[k] + along * fmax(p->a.size[c], p->b.size[c]) * axis[k] +
                    0.1 * p->thin * beside[k];
}

static inline struct path make_path(struct random *r, enum path_pair pair, enum path_motion motion)
{
    struct path p = {.motion = motion, .shallow = true};
    int kind = (int)random_in(r, 0, 4), other = kind == 0 ? 0 : (int)random_in(r, 1, 4);
    double reach, direction[3];
    p.b = path_box(r, kind);
    p.a = p.b;
    if (pair == PATH_BOX_BOX && kind != 0) p.a = path_box(r, other);
    if (pair == PATH_SPHERE_BOX) p.a = path_round(r, SADMM_SHAPE_SPHERE);
    if (pair == PATH_CAPSULE_BOX || pair == PATH_CAPSULE_CAPSULE) p.a = path_round(r, SADMM_SHAPE_CAPSULE);
    if (pair == PATH_CAPSULE_CAPSULE) p.b = path_round(r, SADMM_SHAPE_CAPSULE);
    p.thin = fmin(thickness_of(&p.a), thickness_of(&p.b));
    reach = radius_of(&p.a) + radius_of(&p.b);

    random_rotation(r, p.a.R);
    random_rotation(r, p.b.R);
    if (random_unit(r) < 0.7) { /* edges, or axes of capsules, are parallel: they cross to and fro */
        column(p.b.R, pair == PATH_CAPSULE_CAPSULE ? 2 : (int)random_in(r, 0, 3), direction);
        memcpy(p.a.R, p.b.R, sizeof p.a.R);
        turn(&p.a, direction[0], direction[1], direction[2], random_in(r, -2, 2));
    }
    random_direction(r, direction);
    for (int k = 0; k < 3; ++k) p.b.x[k] = direction[k] * reach * random_in(r, 0.2, 1);
    if (pair == PATH_BOX_BOX && random_unit(r) < 0.5) put_ridge_on_ridge(&p, r);
    memcpy(p.base_a, p.a.R, sizeof p.base_a);
    memcpy(p.base_b, p.b.R, sizeof p.base_b);

    p.angle = log_in(r, 1e-3, 0.1);
    p.slow = motion == PATH_THROUGH || random_unit(r) < 0.7;
    /* both turn, by twice the angle at most (resting), and the points of one are less than twice the reach away */
    if (p.slow) p.angle = fmin(p.angle, 0.15 * p.thin / (6 * reach));
    random_direction(r, p.spin_a);
    random_direction(r, p.spin_b);
    random_direction(r, p.slide);

    /* Round shapes have something to remember once their cores are inside the box or pass each other closely. */
    p.beyond = -0.45 * p.thin;
    if (pair == PATH_SPHERE_BOX || pair == PATH_CAPSULE_BOX)
        p.beyond = -p.a.size[0] - 0.225 * thickness_of(&p.b);
    if (pair == PATH_CAPSULE_CAPSULE) p.beyond = -0.75 * (p.a.size[0] + p.b.size[0]);
    p.mean = random_in(r, 0.8 * p.beyond, 0.3 * p.thin);
    p.swing = random_in(r, 0, 0.1) * p.thin;
    p.phase = random_in(r, 0, 6);
    return p;
}

/* Move b along the true axis to `separation`, at most by `most`. */
static inline void hold(struct path *p, double separation, double most)
{
    struct ways w;
    double axis[3], s;
    find_ways(&p->a, &p->b, &w);
    s = best_way(&w, NULL, -2, axis);
    s = fmin(fmax(separation - s, -most), most);
    for (int k = 0; k < 3; ++k) p->b.x[k] += s * axis[k];
}

/* `last`: the normal of the last step, where there is one. */
static inline void advance(struct path *p, struct random *r, int step, const double *last)
{
    double angle = p->angle, most = 0.05 * p->thin;
    if (p->motion == PATH_RESTING) {
        random_direction(r, p->spin_a);
        random_direction(r, p->spin_b);
        memcpy(p->a.R, p->base_a, sizeof p->a.R);
        memcpy(p->b.R, p->base_b, sizeof p->b.R);
    }
    if (p->motion == PATH_SLIDING) angle *= 0.1;
    turn(&p->a, p->spin_a[0], p->spin_a[1], p->spin_a[2], angle);
    turn(&p->b, p->spin_b[0], p->spin_b[1], p->spin_b[2], angle);
    if (p->motion == PATH_SLIDING)
        for (int k = 0; k < 3; ++k) p->b.x[k] += 0.05 * p->thin * p->slide[k] * (p->slow ? 1 : 5);
    if (p->motion == PATH_THROUGH && last) {
        for (int k = 0; k < 3; ++k) p->b.x[k] -= most * last[k];
        return;
    }
    hold(p, p->mean + p->swing * sin(p->phase + 0.1 * step), p->slow ? most : HUGE_VAL);
}

/* The manifold in double or float; as touch, but for its checks of every point, which take longer than the manifold. */
static inline struct world_manifold path_touch(const struct path *p, bool in_float, double limit, uint32_t cache)
{
    struct world_manifold w = {0};
    if (in_float) {
        manifold_in_float(p->a.type, p->a.size, p->b.type, p->b.size, p->a.R, p->a.x, p->b.R, p->b.x, limit, cache, &w);
    } else {
        struct pair_pose pose = pair_pose(false, p->a.R, p->a.x, p->b.R, p->b.x);
        const struct sadmm_geometry a = geometry_of(p->a.type, p->a.size), b = geometry_of(p->b.type, p->b.size);
        struct manifold m;
        pair_manifold(&a, &b, NULL, 0, &pose, limit, cache, &m);
        w.count = m.count;
        w.cache = m.cache;
        if (m.count == 0) return w;
        v3_store(m.normal, w.normal);
        apply(p->b.R, w.normal, w.normal);
    }
    return w;
}

/* The cross product of the edges of a cached edge axis of two boxes, in the frame of b; false for other axes. */
static inline bool path_edge_axis(const struct path *p, uint32_t cache, double axis[3])
{
    int pair = (int)(cache & BOX_AXIS_MASK) - 7;
    double e[3], f[3], world[3];
    if (p->a.type != SADMM_SHAPE_BOX || pair < 0) return false;
    column(p->b.R, pair / 3, e);
    column(p->a.R, pair % 3, f);
    cross3(e, f, world);
    apply_transposed(p->b.R, world, axis);
    return true;
}

/* By how much the depth may exceed the truth.
 *
 * Boxes. An axis is chosen because it is the best; or because it is the cached one and the best beats it by less than
 * KEEP_DEPTH of its depth and KEEP_EXTENT of the thinner extent; or because it is a face within 8 degrees of an edge
 * axis so chosen that beats it by less than 0.05 of its depth and KEEP_EXTENT. Both at most. Also, an edge axis within
 * 1e-3 of a face's normal does not say which edge is the highest: then the face may stand for it. And faces stand for
 * edges that are parallel within phi, up to phi x reach, and these are charged with slack / phi (4 epsilon x extents):
 * at worst sqrt(slack x reach). The rest is some tens of roundings of the reach. */
static inline double path_margin(const struct path *p, enum path_pair pair, bool in_float, double chosen)
{
    double reach = radius_of(&p->a) + radius_of(&p->b),
           keep = (double)MANIFOLD_KEEP_EXTENT * p->thin, share = (double)MANIFOLD_KEEP_DEPTH * fabs(chosen),
           epsilon = in_float ? FLT_EPSILON : DBL_EPSILON, rounding = 64 * epsilon * reach;
    switch (pair) {
    case PATH_BOX_BOX: return share + 0.05 * fabs(chosen) + 2 * keep + reach * (1e-3 + sqrt(8 * epsilon)) + rounding;
    case PATH_SPHERE_BOX: return share + keep + rounding;
    /* here a face within 8 degrees of the edge axis wins at any depth */
    case PATH_CAPSULE_BOX: return share + 0.05 * fabs(chosen) + 2 * keep + 2 * sin(4 * M_PI / 180) * reach + rounding;
    /* across both axes: the cross product of two that are 1e-3 from parallel */
    default: return 1e3 * rounding;
    }
}

static inline void walk_path(struct random *r, enum path_pair pair, enum path_motion motion, int steps, bool in_float,
                             struct path_counts *counts)
{
    struct path p = make_path(r, pair, motion);
    const double limit = 0.5 * p.thin * random_unit(r);
    uint32_t cache = 0;
    double last[3] = {0}, edges[3] = {0};
    bool known = false; /* last is the normal of the last step */

    for (int i = 0; i < 40; ++i) hold(&p, p.mean, HUGE_VAL);
    for (int step = 0; step < steps; ++step) {
        struct ways w;
        struct world_manifold m;
        double truth, chosen, margin, axis[3], in_b[3], across[3], now[3];
        bool past;

        find_ways(&p.a, &p.b, &w);
        truth = best_way(&w, NULL, -2, axis);
        p.shallow = p.shallow && truth > p.beyond;
        if (known && path_edge_axis(&p, cache, now)) counts->reversed += dot3(now, edges) < 0;
        m = path_touch(&p, in_float, limit, cache);
        ++counts->poses;
        for (int k = 0; k < 3; ++k) across[k] = p.b.x[k] - p.a.x[k];
        past = known && dot3(across, last) < 0.25 * p.thin;
        chosen = m.count ? separation_along(&p.a, &p.b, m.normal) : 0;
        margin = path_margin(&p, pair, in_float, chosen);
        if (m.count == 0) {
            ck_assert_msg(truth > -margin, "pair %d, motion %d, step %d: an overlap of %g without contacts", pair,
                          motion, step, -truth);
            known = false;
        } else {
            ++counts->contacts;
            if (p.slow && p.shallow) {
                ++counts->strict;
                counts->worst = fmax(counts->worst, (truth - chosen) / margin);
                ck_assert_msg(chosen >= truth - margin,
                              "pair %d, motion %d, step %d: depth %g, truly %g, at most %g more; thin %g, angle %g",
                              pair, motion, step, -chosen, -truth, margin, p.thin, p.angle);
            } else if (truth <= 0) {
                /* The opposite of a cached axis: within 26 degrees, and it may have turned by 45 since; of capsules: a
                 * half-space. Where the truth is there, all the way back is the worst. */
                double least = pair == PATH_CAPSULE_CAPSULE ? 0.2 : -0.3,
                       allowed = best_way(&w, known && !w.apart ? last : NULL, least, NULL),
                       back[3] = {-axis[0], -axis[1], -axis[2]};
                if (known && dot3(axis, last) < least) allowed = fmin(allowed, separation_along(&p.a, &p.b, back));
                ck_assert_msg(chosen >= allowed - margin,
                              "pair %d, motion %d, step %d: depth %g, %g but for one side; truly %g, angle %g", pair,
                              motion, step, -chosen, -allowed, -truth, p.angle);
            }
            if (motion == PATH_THROUGH && known && past && !w.apart && !w.either && truth <= 0) {
                ck_assert_msg(dot3(m.normal, last) > -0.95, "pair %d, step %d: the normal turned round, depth %g", pair,
                              step, -chosen);
                counts->kept += chosen < truth - margin;
            }
        }
        cache = m.count ? m.cache : 0;
        known = m.count > 0;
        path_edge_axis(&p, cache, edges);
        /* the last normal turns with b */
        apply_transposed(p.b.R, m.normal, in_b);
        advance(&p, r, step, known ? m.normal : NULL);
        apply(p.b.R, in_b, last);
    }
}

static inline struct path_counts walk_paths(enum path_pair pair, bool in_float, int paths, int steps, uint64_t seed)
{
    struct random r = {seed};
    struct path_counts counts = {0};
    for (int n = 0; n < paths; ++n) walk_path(&r, pair, (enum path_motion)(n % PATH_MOTIONS), steps, in_float, &counts);
    return counts;
}

#endif
