/* Contact of cylinders, cones and ellipsoids with all that is convex: distance, depth, normals and nearest points are
 * certified (convex_touches.h), by formulas of their own (convex_tools.h). */
#include <check.h>
#include <stdio.h>

#include "convex_touches.h"
#include "fewer.h"
#include "run_suite.h"

enum { ANYHOW, ALIGNED, FAR_OUT_OF_SCALE, WAYS };

static void random_pair(struct random *r, struct pair_of *t, int a, int b, int way)
{
    static const double tilts[] = {0, 0, 1e-12, 1e-9, 1e-6, 1e-3};
    const double scale = way == FAR_OUT_OF_SCALE ? pow(10, random_in(r, -3, 3)) : 1;
    double d[3];
    t->shape_data->used = HULL_FIRST_OWN;
    random_shape_of(r, t, 0, a, scale);
    random_shape_of(r, t, 1, b, way == FAR_OUT_OF_SCALE ? scale * pow(10, random_in(r, -2, 2)) : scale);
    for (int k = 0; k < 3; ++k) d[k] = random_in(r, -1, 1);
    for (int s = 0; s < 2; ++s) {
        random_rotation(r, t->R[s]);
        if (way != ALIGNED) continue;
        double turn[9], tilt[9];
        const int axis = (int)(3 * random_unit(r));
        rotation(turn, axis == 0, axis == 1, axis == 2, M_PI / 2 * (int)(4 * random_unit(r)));
        rotation(tilt, random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1), tilts[(int)(6 * random_unit(r))]);
        multiply(tilt, turn, t->R[s]);
        for (int k = 0; k < 3 && t->g[s].type != SADMM_SHAPE_HULL && axis; ++k) t->g[s].size[k] = 0.5;
    }
    if (way == ALIGNED) {
        const int along = (int)(3 * random_unit(r));
        for (int k = 0; k < 3; ++k) d[k] *= k == along || random_unit(r) < 0.3 ? 1 : random_unit(r) < 0.5 ? 0 : 1e-9;
    }
    const double length = t_norm(d);
    for (int k = 0; k < 3; ++k) {
        t->x[0][k] = scale * random_in(r, -1, 1);
        t->x[1][k] = t->x[0][k] + random_in(r, 1, 2) * pair_size(t) / length * d[k];
    }
}

/* Of a loop's number: a type for b, and how it is posed. */
static int type_of(int i) { return SADMM_SHAPE_CYLINDER + i % 3; }

/* What a separation may be short of the best one by, as a share of the size: of directions that differ by a tenth of
 * this any may come first (`equal` of convex_pair.h), and rounding is far below. */
#define CLOSE 1e-10

/* ---- what is nearest --------------------------------------------------------------------------------------------- */

/* Apart: two points of the bodies as far from each other as two planes between them. */
START_TEST(distances_are_certified)
{
    struct random r = {.state = 1000 + (uint64_t)_i};
    struct pair_of *t = new_pair();
    for (int a = SADMM_SHAPE_SPHERE; a <= type_of(_i); a = next_type(a))
        for (int pose = 0; pose < fewer(400); ++pose) {
            random_pair(&r, t, a, type_of(_i), _i / 3);
            for (int near = 0; near < 3; ++near) { /* as they are; a millionth of the thinner one apart; a thousandth */
                if (near > 0) push_together(t, -(near == 1 ? 1e-6 : 1e-3) * pair_thin(t));
                const struct found f = certify(t);
                if (near == 0 && f.apart < 0) continue;
                /* a flat has its own normal as long as that is no worse, to rounding: as a square, so that points are
                 * off by the root of it */
                const double size = pair_size(t), off = _i / 3 == ALIGNED ? 1e-6 : 1e-10;
                ck_assert_msg(f.off <= off * size, "%s-%s, pose %d.%d: %g off a certificate, size %g", names[a],
                              names[type_of(_i)], pose, near, f.off, size);
                if (_i / 3 == ALIGNED && pose % 20 == 0) /* the distance itself is as good as ever */
                    ck_assert_double_ge(f.apart, best_direction(t, f.n) - 1e-12 * size);
            }
        }
    free_pair(t);
}
END_TEST

/* Overlapping: no direction is better, near or far. Two points prove it of those nearby, but where corners and rims
 * meet: there the direction has no bend to hold it, and the points are off by what it may turn. */
START_TEST(depths_are_the_least)
{
    static const double depths[] = {0, 1e-12, 1e-8, 1e-5, 1e-3, 1e-2, 0.1, 0.5};
    struct random r = {.state = 2000 + (uint64_t)_i};
    struct pair_of *t = new_pair();
    int all = 0, certified = 0;
    for (int a = SADMM_SHAPE_SPHERE; a <= type_of(_i); a = next_type(a))
        for (int pose = 0; pose < fewer(48); ++pose) {
            random_pair(&r, t, a, type_of(_i), _i / 3);
            const double depth = depths[pose % 8], thin = pair_thin(t), size = pair_size(t);
            const struct found before = push_together(t, depth * thin), f = certify(t);
            const double best = best_direction(t, before.n);
            ck_assert_msg(f.apart >= best - CLOSE * size,
                          "%s-%s, pose %d: %g deep, should be %g, thin %g", names[a], names[type_of(_i)], pose,
                          -f.apart, -best, thin);
            ck_assert_msg(f.off <= 1e-5 * size, "%s-%s, pose %d: %g off, size %g", names[a], names[type_of(_i)], pose,
                          f.off, size);
            ++all;
            certified += f.off <= 1e-8 * size;
            const struct manifold m = pair_touch(t, 0, 0);
            ck_assert(m.count > 0 || f.apart > -1e-11 * size);
        }
    ck_assert_int_ge(certified, all - all / 50 - 1);
    free_pair(t);
}
END_TEST

/* However deep: there is a contact, no deeper than the least depth by more than what near-best axes are given. */
START_TEST(deep_ones_are_in_contact)
{
    struct random r = {.state = 3000 + (uint64_t)_i};
    struct pair_of *t = new_pair();
    for (int a = SADMM_SHAPE_SPHERE; a <= type_of(_i); a = next_type(a))
        for (int pose = 0; pose < fewer(30); ++pose) {
            random_pair(&r, t, a, type_of(_i), _i / 3);
            const double share = pose % 3 == 0 ? 0 : 0.4 * random_unit(&r);
            for (int k = 0; k < 3; ++k) t->x[1][k] = t->x[0][k] + share * (t->x[1][k] - t->x[0][k]);
            const double best = best_direction(t, NULL), thin = pair_thin(t);
            const struct manifold m = pair_touch(t, 0, 0);
            double n[3];
            const struct found f = certify(t);
            if (best > -1e-9 * pair_size(t) || (f.apart > 0 && f.off <= 1e-10 * pair_size(t))) continue; /* needles */
            ck_assert_msg(m.count > 0, "%s-%s, pose %d: no contact, %g deep", names[a], names[type_of(_i)], pose,
                          -best);
            normal_in_world(t, m.normal, n);
            ck_assert_double_eq_tol(t_norm(n), 1, 1e-12);
            ck_assert_msg(apart_along(t, n) >= best - CLOSE * pair_size(t),
                          "%s-%s, pose %d: %g deep, should be %g, thin %g",
                          names[a], names[type_of(_i)], pose, -apart_along(t, n), -best, thin);
        }
    free_pair(t);
}
END_TEST

/* Whichever is a: the same distance along the same normal, the other way round. */
START_TEST(exchange_changes_nothing)
{
    struct random r = {.state = 4000 + (uint64_t)_i};
    struct pair_of *t = new_pair(), *u = calloc(1, sizeof *u);
    for (int a = SADMM_SHAPE_SPHERE; a <= type_of(_i); a = next_type(a))
        for (int pose = 0; pose < fewer(60); ++pose) {
            random_pair(&r, t, a, type_of(_i), _i / 3);
            push_together(t, (pose % 2 ? 1e-3 : -1e-3) * pair_thin(t));
            exchange(t, u);
            const double size = pair_size(t);
            const struct convex_axis p = nearest_axis(t), q = nearest_axis(u);
            ck_assert_double_eq_tol(p.separation, q.separation, CLOSE * size);
            const struct pair_pose pose_u = pair_of_pose(u);
            struct manifold m = pair_touch(t, 0.1 * size, 0), w = {.count = 0};
            convex_manifold(&u->g[0], &u->g[1], u->shape_data->numbers, &pose_u, 0.1 * size, 0, &w);
            double n[2][3], least[2] = {HUGE_VAL, HUGE_VAL}, sum[3];
            normal_in_world(t, m.normal, n[0]);
            normal_in_world(u, w.normal, n[1]);
            for (int k = 0; k < 3; ++k) sum[k] = n[0][k] + n[1][k];
            if (t_norm(sum) > 1e-7) continue; /* two that are as good as each other */
            for (int i = 0; i < m.count; ++i) least[0] = fmin(least[0], m.points[i].separation);
            for (int i = 0; i < w.count; ++i) least[1] = fmin(least[1], w.points[i].separation);
            ck_assert_double_eq_tol(least[0], least[1], MANIFOLD_FLAT * pair_thin(t) + 1e-12 * size);
        }
    free_pair(t);
    free(u);
}
END_TEST

/* Along a path the separation changes by no more than the bodies move, and memory changes nothing that it should
 * not. */
START_TEST(paths_have_no_jumps)
{
    struct random r = {.state = 5000 + (uint64_t)_i};
    struct pair_of *t = new_pair();
    for (int a = SADMM_SHAPE_SPHERE; a <= type_of(_i); a = next_type(a))
        for (int path = 0; path < fewer(6); ++path) {
            const double step = path % 2 ? 1e-3 : 1e-5;
            double spin[2][3], move[3], last = 0;
            uint32_t cache = 0;
            random_pair(&r, t, a, type_of(_i), _i / 3 % 2);
            push_together(t, 1e-3 * pair_thin(t));
            for (int k = 0; k < 3; ++k) {
                for (int s = 0; s < 2; ++s) spin[s][k] = random_in(&r, -1, 1);
                move[k] = 0.1 * random_in(&r, -1, 1);
            }
            const double size = pair_size(t), thin = pair_thin(t);
            for (int k = 0; k < 60; ++k) {
                double n[3];
                const struct manifold m = pair_touch(t, 0.1 * size, cache);
                const double truth = nearest_axis(t).separation;
                if (m.count == 0 || truth < -0.03 * thin) break;
                normal_in_world(t, m.normal, n);
                const double s = apart_along(t, n);
                /* while they overlap the last direction is kept, if it is still the best of those beside it, unless
                 * beaten by this */
                const double kept = truth < 0 ? -MANIFOLD_KEEP_DEPTH * truth + MANIFOLD_KEEP_EXTENT * thin : 0;
                ck_assert_msg(s <= truth + CLOSE * size && s >= truth - kept - CLOSE * size,
                              "%s-%s, path %d.%d: %g, without memory %g", names[a], names[type_of(_i)], path, k, s,
                              truth);
                ck_assert_double_le(k ? fabs(s - last) : 0, 4 * step * size + kept + CLOSE * size);
                for (int i = 0; i < m.count; ++i) {
                    ck_assert_double_ge(m.points[i].separation, s - 1e-11 * size);
                    for (int q = 0; q < i; ++q) ck_assert_uint_ne(m.points[q].feature, m.points[i].feature);
                }
                last = s;
                cache = m.cache;
                for (int q = 0; q < 2; ++q) {
                    double turn[9];
                    rotation(turn, spin[q][0], spin[q][1], spin[q][2], step);
                    multiply(turn, t->R[q], t->R[q]);
                }
                for (int q = 0; q < 3; ++q) t->x[1][q] += step * size * move[q];
            }
        }
    free_pair(t);
}
END_TEST

/* A word that is no memory of this pair does no harm. */
START_TEST(any_memory_will_do)
{
    struct random r = {.state = 6000 + (uint64_t)_i};
    struct pair_of *t = new_pair();
    for (int pose = 0; pose < fewer(2000); ++pose) {
        const int type = SADMM_SHAPE_SPHERE + pose % (type_of(_i) - SADMM_SHAPE_SPHERE + 1);
        random_pair(&r, t, type == SADMM_SHAPE_MESH ? SADMM_SHAPE_HULL : type, type_of(_i), pose % 2);
        push_together(t, (pose % 5 - 2) * 1e-3 * pair_thin(t));
        const uint32_t word = (uint32_t)(random_unit(&r) * 4294967296.0) & (pose % 3 ? ~0u : ~28u);
        const double size = pair_size(t);
        const struct manifold m = pair_touch(t, 1e-2 * size, word);
        double n[3];
        ck_assert_int_gt(m.count, 0);
        normal_in_world(t, m.normal, n);
        for (int i = 0; i < m.count; ++i) {
            ck_assert_double_le(m.points[i].separation, 1e-2 * size + 1e-9 * size);
            ck_assert_double_ge(m.points[i].separation, apart_along(t, n) - 1e-11 * size);
        }
    }
    free_pair(t);
}
END_TEST

/* Pushed through a plate, slowly: back to where it came from until the two are apart. */
START_TEST(sides_are_kept)
{
    static const double plate[3] = {1, 1, 0.02}, size[3] = {0.2, 0.3, 0.25};
    struct pair_of *t = new_pair();
    struct random r = {.state = 7000 + (uint64_t)_i};
    uint32_t cache = 0;
    double up[3];
    int beyond = 0;
    t->g[0] = geometry_of(SADMM_SHAPE_BOX, plate);
    t->g[1] = geometry_of(type_of(_i), size);
    for (int s = 0; s < 2; ++s) random_rotation(&r, t->R[s]);
    for (int k = 0; k < 3; ++k) up[k] = t->R[0][3 * k + 2];
    for (int k = 0; k < 400; ++k) {
        const double height = 0.5 - 0.0015 * k;
        double n[3];
        for (int i = 0; i < 3; ++i) t->x[1][i] = height * up[i];
        const struct manifold m = pair_touch(t, 0.005, cache);
        cache = m.count > 0 ? m.cache : 0;
        normal_in_world(t, m.normal, n);
        if (m.count == 0 || apart_along(t, n) >= 0) continue;
        ck_assert_msg(t_dot(n, up) > 0.5, "height %g: normal %g %g %g", height, n[0], n[1], n[2]);
        beyond += height < 0;
    }
    ck_assert_int_gt(beyond, 20); /* there were some to be wrong */
    free_pair(t);
}
END_TEST

/* ---- points ------------------------------------------------------------------------------------------------------ */

/* Features of a manifold, in order. */
static void features_of(const struct manifold *m, uint32_t features[8])
{
    for (int i = 0; i < m->count; ++i) {
        int at = i;
        for (; at > 0 && features[at - 1] > m->points[i].feature; --at) features[at] = features[at - 1];
        features[at] = m->points[i].feature;
    }
}

static double normal_z(const struct pair_of *t, const struct manifold *m)
{
    double n[3];
    normal_in_world(t, m->normal, n);
    return n[2];
}

/* b stands on a's top, in the middle or moved along x, turned about its axis by `spin`. */
static struct manifold stand(struct pair_of *t, double half, double bottom, double x, double spin, double separation,
                             uint32_t cache)
{
    rotation(t->R[0], 0, 0, 1, 0.3);
    rotation(t->R[1], 0, 0, 1, spin);
    t->x[1][0] = x;
    t->x[1][2] = half + bottom + separation;
    return pair_touch(t, 0.01, cache);
}

/* On a cap: eight points of the rim, evenly spread, which stay where they are, with their names, as the body spins;
 * beyond the edge of what it stands on the corners of the overlap. */
START_TEST(caps_stand_on_eight_points)
{
    static const double box[3] = {0.6, 0.6, 0.2}, below[3] = {0.5, 0.3, 0}, size[3] = {0.4, 0.3, 0};
    struct pair_of *t = new_pair();
    t->g[0] = geometry_of(_i % 2 ? SADMM_SHAPE_CYLINDER : SADMM_SHAPE_BOX, _i % 2 ? below : box);
    t->g[1] = geometry_of(_i / 2 ? SADMM_SHAPE_CONE : SADMM_SHAPE_CYLINDER, size);
    const double half = _i % 2 ? below[1] : box[2], bottom = size[1];
    uint32_t cache = 0, first[8], features[8];
    for (int k = 0; k < 12; ++k) {
        const struct manifold m = stand(t, half, bottom, 0, 0.1 * k, -1e-4, cache);
        ck_assert_int_eq(m.count, 8);
        ck_assert_double_eq_tol(fabs(m.normal.z), 1, 1e-12);
        vec3 sum = v3(0, 0, 0);
        for (int i = 0; i < 8; ++i) {
            double world[3];
            point_in_world(t, m.points[i].position, world);
            ck_assert_double_eq_tol(hypot(world[0], world[1]), 0.4, 1e-12);
            ck_assert_double_eq_tol(m.points[i].separation, -1e-4, 1e-12);
            sum = v3_add(sum, m.points[i].position);
        }
        ck_assert_double_eq_tol(hypot(sum.x, sum.y), 0, 1e-12);
        features_of(&m, k ? features : first);
        if (k) ck_assert_mem_eq(features, first, sizeof first);
        cache = m.cache;
    }
    /* half of it over the edge: sides and rims cross where they do */
    const struct manifold m = stand(t, half, bottom, 0.6, 0.2, -1e-4, 0);
    double farthest = 0, across = 0;
    ck_assert_int_ge(m.count, 4);
    for (int i = 0; i < m.count; ++i) {
        double world[3];
        point_in_world(t, m.points[i].position, world);
        for (int s = 0; s < 2; ++s) ck_assert_double_le(own_outside(t, s, world), 1e-4);
        farthest = fmax(farthest, world[0]);
        across = fmax(across, fabs(world[1]));
    }
    if (_i % 2) { /* two circles, 0.6 apart: (0.36 + 0.25 - 0.16) / 1.2 from the lower one's centre they cross */
        ck_assert_double_eq_tol(across, sqrt(0.25 - 0.375 * 0.375), 1e-9);
    }
    free_pair(t);
}
END_TEST

/* On its side: the two ends of the line, whatever the roll angle is; they keep their names. */
START_TEST(sides_lie_on_two_points)
{
    static const double box[3] = {2, 2, 0.2}, log[3] = {0.3, 1, 0}, size[3] = {0.2, 0.5, 0};
    struct pair_of *t = new_pair();
    const bool cone = _i / 2;
    t->g[0] = geometry_of(_i % 2 ? SADMM_SHAPE_CYLINDER : SADMM_SHAPE_BOX, _i % 2 ? log : box);
    t->g[1] = geometry_of(cone ? SADMM_SHAPE_CONE : SADMM_SHAPE_CYLINDER, size);
    /* along world x: the cylinder's axis, or the cone's line, and the lower one's axis */
    const double slope = cone ? atan2(size[0], 2 * size[1]) : 0;
    uint32_t cache = 0, first[8], features[8];
    for (int k = 0; k < 40; ++k) {
        double roll[9], lie[9], sink = 0;
        rotation(roll, 0, 0, 1, 0.17 * k);
        rotation(lie, 0, 1, 0, M_PI / 2 + slope);
        multiply(lie, roll, t->R[1]);
        rotation(t->R[0], 0, 1, 0, _i % 2 ? M_PI / 2 : 0);
        t->x[1][0] = 0.1;
        const double down[3] = {0, 0, -1};
        sink = own_support(t, 1, down);
        t->x[1][2] = (_i % 2 ? log[0] : box[2]) + sink - 1e-4;
        const struct manifold m = pair_touch(t, 0.003, cache);
        ck_assert_int_eq(m.count, 2);
        ck_assert_double_eq_tol(fabs(normal_z(t, &m)), 1, 1e-9);
        for (int i = 0; i < 2; ++i) ck_assert_double_eq_tol(m.points[i].separation, -1e-4, 1e-9);
        const double length = v3_norm(v3_sub(m.points[0].position, m.points[1].position));
        ck_assert_double_eq_tol(length, cone ? hypot(size[0], 2 * size[1]) : 2 * size[1], 1e-6);
        features_of(&m, k ? features : first);
        if (k) ck_assert_mem_eq(features, first, 2 * sizeof *first);
        cache = m.cache;
    }
    free_pair(t);
}
END_TEST

/* Inclined caps, and inclined sides, that face each other: every point is one of both bodies, wherever rims cross and
 * lines end. All poses are apart, so that the normal is one of nearest points; the two are up to 8 degrees inclined to
 * that, further than which nothing faces along it. */
START_TEST(inclined_ones_have_points_of_both)
{
    static const int types[][2] = {{SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CYLINDER},
                                   {SADMM_SHAPE_CONE, SADMM_SHAPE_CONE},
                                   {SADMM_SHAPE_CAPSULE, SADMM_SHAPE_CYLINDER},
                                   {SADMM_SHAPE_CAPSULE, SADMM_SHAPE_CONE}};
    const int *type = types[_i % 4];
    const bool caps = _i < 2;
    struct random r = {.state = 9000 + (uint64_t)_i};
    struct pair_of *t = new_pair();
    long several = 0, crossings = 0;
    for (int pose = 0; pose < fewer(4000); ++pose) {
        for (int s = 0; s < 2; ++s) {
            double lie[9], tilt[9];
            const double size[3] = {random_in(&r, 0.3, 1), random_in(&r, 0.3, 1), 0},
                         slope = type[s] == SADMM_SHAPE_CONE ? atan2(size[0], 2 * size[1]) : 0;
            t->g[s] = geometry_of(type[s], size);
            /* a cap, a line or a cone's line up for a, down for b */
            rotation(lie, 0, 1, 0, caps ? (s ? 0 : M_PI) : (s ? M_PI / 2 + slope : -M_PI / 2 + slope));
            rotation(tilt, random_in(&r, -1, 1), random_in(&r, -1, 1), caps ? 0 : random_in(&r, -1, 1),
                     random_in(&r, 0, 0.13));
            multiply(tilt, lie, t->R[s]);
            for (int k = 0; k < 3; ++k) t->x[s][k] = k < 2 && s ? random_in(&r, -0.5, 0.5) : s * 2.5;
        }
        push_together(t, -random_in(&r, 0.001, 0.05));
        const struct manifold m = pair_touch(t, 1e300, 0);
        several += m.count > 1;
        for (int i = 0; i < m.count; ++i) {
            const double out = points_outside(t, m.normal, m.points[i].position, m.points[i].separation);
            crossings += m.points[i].feature >> AXIS_KIND_SHIFT == FEATURE_CROSSING;
            /* what is beside a side by half of MANIFOLD_SNAP counts as over it; 1e-9 m: rounding, which where rims
             * cross at a flat angle is that of a root */
            ck_assert_msg(out <= MANIFOLD_SNAP * pair_thin(t) + 1e-9, "%s-%s, pose %d: outside by %g, feature %x",
                          names[type[0]], names[type[1]], pose, out, m.points[i].feature);
        }
    }
    ck_assert_int_gt(several, fewer(4000) / 4);
    if (caps) ck_assert_int_gt(crossings, fewer(4000) / 8);
    free_pair(t);
}
END_TEST

/* Planes: the lowest point exactly, in any pose, and the rim of a cap that is nearly flat on it. */
START_TEST(planes_are_exact)
{
    struct random r = {.state = 8000 + (uint64_t)_i};
    struct pair_of *t = new_pair();
    const struct sadmm_geometry plane = {.type = SADMM_SHAPE_PLANE, .subshapes = 1};
    for (int pose = 0; pose < 2000; ++pose) {
        static const double tilts[] = {0, 1e-9, 1e-4, 0.05, 0.13, 0.15};
        double turn[9], down[3], low, least = HUGE_VAL;
        random_pair(&r, t, SADMM_SHAPE_SPHERE, type_of(_i), pose % 2 ? ANYHOW : FAR_OUT_OF_SCALE);
        t->g[0] = plane;
        if (pose % 3 == 0) { /* upright, or nearly */
            rotation(turn, random_in(&r, -1, 1), random_in(&r, -1, 1), 0, tilts[pose / 3 % 6]);
            multiply(t->R[0], turn, t->R[1]);
        }
        for (int k = 0; k < 3; ++k) down[k] = -t->R[0][3 * k + 2];
        low = own_support(t, 1, down);
        const double size = geometry_radius(&t->g[1]), separation = random_in(&r, -0.01, 0.01) * size;
        for (int k = 0; k < 3; ++k) t->x[1][k] = t->x[0][k] - (low + separation) * down[k];
        const struct pair_pose at = pair_pose(true, t->R[0], t->x[0], t->R[1], t->x[1]);
        struct manifold m;
        pair_manifold(&t->g[0], &t->g[1], t->shape_data->numbers, 0, &at, separation + 1e-9 * size, 0, &m);
        ck_assert_int_gt(m.count, 0);
        for (int i = 0; i < m.count; ++i) {
            double world[3], d[3];
            point_in_world(t, m.points[i].position, world);
            t_sub(world, t->x[0], d);
            least = fmin(least, m.points[i].separation);
            ck_assert_double_eq_tol(-t_dot(d, down), m.points[i].separation / 2, 1e-12 * size);
            for (int k = 0; k < 3; ++k) world[k] -= m.points[i].separation / 2 * down[k];
            ck_assert_double_le(own_outside(t, 1, world), 1e-11 * size);
        }
        ck_assert_double_eq_tol(least, separation, MANIFOLD_FLAT * geometry_thickness(&t->g[1]) + 1e-12 * size);
        if (pose % 18 == 0) ck_assert_int_eq(m.count, type_of(_i) == SADMM_SHAPE_ELLIPSOID ? 1 : 8); /* flat on it */
    }
    free_pair(t);
}
END_TEST

static Suite *suite(void)
{
    Suite *s = suite_create("manifold convex");
    TCase *tests = tcase_create("smooth bodies");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, distances_are_certified, 0, 3 * WAYS);
    tcase_add_loop_test(tests, depths_are_the_least, 0, 3 * WAYS);
    tcase_add_loop_test(tests, deep_ones_are_in_contact, 0, 3 * WAYS);
    tcase_add_loop_test(tests, exchange_changes_nothing, 0, 6);
    tcase_add_loop_test(tests, paths_have_no_jumps, 0, 6);
    tcase_add_loop_test(tests, any_memory_will_do, 0, 3);
    tcase_add_loop_test(tests, sides_are_kept, 0, 6);
    tcase_add_loop_test(tests, caps_stand_on_eight_points, 0, 4);
    tcase_add_loop_test(tests, sides_lie_on_two_points, 0, 4);
    tcase_add_loop_test(tests, inclined_ones_have_points_of_both, 0, 8);
    tcase_add_loop_test(tests, planes_are_exact, 0, 3);
    suite_add_tcase(s, tests);
    return s;
}

int main(void) { return run_suite(suite()); }
