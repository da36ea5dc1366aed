/* Contact of convex hulls: nearest points and depth against a reference that tries all features, points and normals
 * against what the two shapes are, memory, exchange, and boxes as hulls against boxes. */
#include "hull_touches.h"
#include "run_suite.h"

START_TEST(distance_and_depth_are_the_references)
{
    const struct extent extent = {fewer(400), 23, 6};
    touch_hulls((uint64_t)_i, &extent);
}
END_TEST

START_TEST(round_shapes_are_cores_with_a_radius)
{
    const struct extent extent = {400, 25, 0};
    touch_round((uint64_t)_i, _i % 2, &extent);
}
END_TEST

START_TEST(rounded_hulls_are_cores_with_a_radius)
{
    const struct extent extent = {fewer(160), 23, 3};
    touch_rounded((uint64_t)_i, _i % 2, &extent);
}
END_TEST

/* Whichever of two hulls is a: the same planes part them, and the same points are the nearest. */
START_TEST(exchange_changes_nothing)
{
    struct random r = {.state = 77 + (uint64_t)_i};
    struct pair_of *t = calloc(1, sizeof *t), *u = calloc(1, sizeof *u);
    const double unit[3] = {1, 1, 1};
    int alike = 0;
    t->shape_data = test_shape_data_new();
    for (int pose = 0; pose < 300; ++pose) {
        t->shape_data->used = HULL_FIRST_OWN;
        for (int s = 0; s < 2; ++s) {
            random_hull(&r.state, 6 + (int)(random_unit(&r) * 16), unit, &t->h[s]);
            t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
        }
        random_pose(&r, 2, t);
        put_together(t, random_in(&r, -0.05, 0.05));
        *u = *t;
        for (int s = 0; s < 2; ++s) {
            u->h[s] = t->h[1 - s];
            u->g[s] = t->g[1 - s];
            memcpy(u->R[s], t->R[1 - s], sizeof u->R[s]);
            memcpy(u->x[s], t->x[1 - s], sizeof u->x[s]);
        }
        const struct manifold m = touch_two(t, 0.1, 0), w = touch_two(u, 0.1, 0);
        const double thin = fmin(geometry_thickness(&t->g[0]), geometry_thickness(&t->g[1]));
        double n[2][3], local[2][3], turned = 0;
        v3_store(m.normal, local[0]);
        v3_store(w.normal, local[1]);
        for (int k = 0; k < 3; ++k) {
            n[0][k] = t_dot(t->R[1] + 3 * k, local[0]);
            n[1][k] = t_dot(u->R[1] + 3 * k, local[1]);
        }
        for (int k = 0; k < 3; ++k) turned = fmax(turned, fabs(n[0][k] + n[1][k]));
        /* a face that is preferred, but is over the other one by less than clipping resolves, is left to one of the
         * two */
        ck_assert_double_eq_tol(along(t, m.normal), along(u, w.normal), 0.01 * thin);
        if (turned > 1e-8) continue;
        ++alike;
        ck_assert_double_eq_tol(along(t, m.normal), along(u, w.normal), 1e-10 * size_of(t));
        double least[2] = {HUGE_VAL, HUGE_VAL};
        for (int i = 0; i < m.count; ++i) least[0] = fmin(least[0], m.points[i].separation);
        for (int i = 0; i < w.count; ++i) least[1] = fmin(least[1], w.points[i].separation);
        ck_assert_double_eq_tol(least[0], least[1], 1e-10 * size_of(t));
        for (int i = 0; i < m.count; ++i) { /* points of the one are points of the other, but for those that merge */
            double p[3], nearest_point = HUGE_VAL;
            v3_store(m.points[i].position, p);
            for (int k = 0; k < w.count; ++k) {
                double q[3], d[3];
                v3_store(w.points[k].position, q);
                for (int j = 0; j < 3; ++j)
                    d[j] = t_dot(t->R[1] + 3 * j, p) + t->x[1][j] - t_dot(u->R[1] + 3 * j, q) - u->x[1][j];
                nearest_point = fmin(nearest_point, t_norm(d));
            }
            ck_assert_double_le(nearest_point, 4e-3 * thin);
        }
    }
    ck_assert_int_ge(alike, 294);
    free(t->shape_data);
    free(t);
    free(u);
}
END_TEST

/* A box is a hull like any other: as deep, along the same normal, and resting faces have the same points. */
START_TEST(boxes_are_hulls)
{
    static const double tilts[] = {0, 1e-9, 1e-7, 1e-5, 1e-3};
    struct random r = {.state = 4711 + (uint64_t)_i};
    struct pair_of *t = calloc(1, sizeof *t), *u = calloc(1, sizeof *u);
    t->shape_data = test_shape_data_new();
    for (int pose = 0; pose < 200; ++pose) {
        double half[2][3], world[3];
        t->shape_data->used = HULL_FIRST_OWN;
        for (int s = 0; s < 2; ++s) {
            for (int k = 0; k < 3; ++k) half[s][k] = random_in(&r, 0.2, 1);
            box_hull(half[s], &t->h[s]);
            t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
            rotation(t->R[s], random_in(&r, -1, 1), random_in(&r, -1, 1), 1, tilts[_i]);
        }
        for (int k = 0; k < 3; ++k) t->x[0][k] = random_in(&r, -1, 1);
        for (int k = 0; k < 2; ++k) world[k] = t->x[0][k] + random_in(&r, -0.9, 0.9) * (half[0][k] + half[1][k]);
        world[2] = t->x[0][2] + half[0][2] + half[1][2] + random_in(&r, -0.02, 0.02);
        memcpy(t->x[1], world, sizeof world);
        *u = *t;
        for (int s = 0; s < 2; ++s) {
            const struct sadmm_geometry box = {.type = SADMM_SHAPE_BOX, .subshapes = 1,
                                               .size = {half[s][0], half[s][1], half[s][2]}};
            u->g[s] = box;
        }
        const struct manifold boxes = touch_two(u, 0.1, 0);
        for (int mixed = 0; mixed < 2; ++mixed) {
            if (mixed) t->g[0] = u->g[0]; /* a box and a hull */
            const struct manifold hulls = touch_two(t, 0.1, 0);
            ck_assert_int_eq(hulls.count, boxes.count);
            const double best = reference(t);
            check_manifold(t, &hulls, best, 0.1, "box");
            for (int i = 0; i < boxes.count; ++i) {
                double nearest2 = HUGE_VAL, separation = 0;
                for (int k = 0; k < hulls.count; ++k) {
                    const double d2 = v3_norm2(v3_sub(boxes.points[i].position, hulls.points[k].position));
                    if (d2 < nearest2) {
                        nearest2 = d2;
                        separation = hulls.points[k].separation;
                    }
                }
                /* both round corners to sides by their own tolerance */
                ck_assert_double_le(nearest2, 4e-6 + tilts[_i] * tilts[_i]);
                ck_assert_double_eq_tol(separation, boxes.points[i].separation, 1e-12 + 4 * tilts[_i]);
            }
        }
    }
    free(t->shape_data);
    free(t);
    free(u);
}
END_TEST

/* Slow motions, every manifold with the memory of the one before: as deep as the truth but for what memory is given,
 * without jumps, and points that go on where nothing has moved. */
START_TEST(memory_changes_little)
{
    struct random r = {.state = 99 + (uint64_t)_i};
    struct pair_of *t = calloc(1, sizeof *t);
    const double unit[3] = {1, 1, 1};
    long same = 0, all = 0, remembered = 0;
    t->shape_data = test_shape_data_new();
    for (int path = 0; path < fewer(12); ++path) {
        uint32_t cache = 0;
        double last = 0, spin[3], move[3];
        t->shape_data->used = HULL_FIRST_OWN;
        for (int s = 0; s < 2; ++s) {
            if (_i % 3 == 1) prism_hull(3 + (int)(random_unit(&r) * 8), random_in(&r, 0.2, 1), &t->h[s]);
            else random_hull(&r.state, 8 + (int)(random_unit(&r) * 24), unit, &t->h[s]);
            t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
        }
        const double thin = fmin(geometry_thickness(&t->g[0]), geometry_thickness(&t->g[1]));
        random_pose(&r, 1.9, t);
        put_together(t, -0.01);
        for (int k = 0; k < 3; ++k) {
            spin[k] = random_in(&r, -1, 1);
            move[k] = random_in(&r, -1, 1);
        }
        const double step = _i % 2 ? 1e-6 : 2e-3;
        for (int k = 0; k < 150; ++k) {
            const struct manifold m = touch_two(t, 0.05, cache);
            const double best = reference(t);
            if (best < -0.1) break; /* deep: the side may be remembered (manifold_hull.h) */
            check_manifold(t, &m, best, 0.05, "path");
            if (m.count == 0) break;
            const struct manifold again = touch_two(t, 0.05, m.cache);
            const double s = along(t, m.normal);
            remembered += again.cache == m.cache && m.cache != 0;
            if (k > 0)
                ck_assert_msg(fabs(s - last) <= 6 * step + 0.1 * fabs(s) + 0.011 * thin, "a jump from %g to %g", last,
                              s);
            last = s;
            cache = m.cache;
            turn_by(t->R[1], spin, step);
            for (int i = 0; i < 3; ++i) t->x[1][i] += step * move[i];
            if (step < 1e-5) { /* at rest but for rounding: points stay who they are */
                const struct manifold next = touch_two(t, 0.05, cache);
                for (int i = 0; i < m.count; ++i) {
                    ++all;
                    for (int q = 0; q < next.count; ++q) same += next.points[q].feature == m.points[i].feature;
                }
            }
        }
    }
    ck_assert_int_gt(remembered, 0);
    if (all > 0) ck_assert_msg(same > 0.99 * (double)all, "%ld of %ld points go on", same, all);
    free(t->shape_data);
    free(t);
}
END_TEST

/* Pushed through a plate, slowly: back to where it came from until the two are apart. */
START_TEST(sides_are_kept)
{
    struct pair_of *t = calloc(1, sizeof *t);
    const double plate[3] = {1, 1, 0.02}, unit[3] = {0.3, 0.3, 0.3};
    struct random r = {.state = 5 + (uint64_t)_i};
    uint32_t cache = 0;
    t->shape_data = test_shape_data_new();
    random_hull(&r.state, 20, unit, &t->h[0]);
    box_hull(plate, &t->h[1]);
    for (int s = 0; s < 2; ++s) {
        t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
        random_rotation(&r, t->R[s]);
    }
    double up[3];
    int beyond = 0; /* manifolds past the plate's middle */
    column_of(t->R[1], 2, up);
    for (int k = 0; k < 400; ++k) {
        const double height = 0.5 - 0.0015 * k;
        for (int i = 0; i < 3; ++i) t->x[0][i] = height * up[i];
        const struct manifold m = touch_two(t, 0.005, cache);
        cache = m.count > 0 ? m.cache : 0;
        if (m.count == 0 || along(t, m.normal) >= 0) continue;
        ck_assert_msg(m.normal.z < -0.5, "height %g: normal %g %g %g", height, m.normal.x, m.normal.y, m.normal.z);
        beyond += height < 0;
    }
    ck_assert_int_gt(beyond, 20); /* there were some to be wrong */
    free(t->shape_data);
    free(t);
}
END_TEST

/* Box on box, both with round edges, the upper one rolling over its edge and corner onto the next face, as it has been
 * laid before: the normal goes along without jumps, and the depth stays. */
START_TEST(rounded_boxes_roll_smoothly)
{
    struct pair_of *t = calloc(1, sizeof *t);
    const double half[2][3] = {{0.4, 0.3, 0.2}, {0.45, 0.35, 0.25}}, step = 1e-3;
    const double axis[3] = {_i == 0 ? 0 : 0.8, 1, _i == 2 ? 0.4 : 0};
    vec3 last = v3(0, 0, 0);
    uint32_t cache = 0;
    t->shape_data = test_shape_data_new();
    for (int s = 0; s < 2; ++s) {
        box_hull(half[s], &t->h[s]);
        t->h[s].convex_radius = s ? 0.1 : 0.05;
        t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
        rotation(t->R[s], 0, 0, 1, s * 0.1);
    }
    for (int k = 0; k < 3200; ++k) {
        double reach = 0; /* of the upper one, down */
        for (int v = 0; v < t->h[1].vertices; ++v) reach = fmax(reach, -t_dot(t->R[1] + 6, t->h[1].x[v]));
        t->x[1][0] = 0.42; /* beyond the lower one's side by turns: edge on edge, edge on face */
        t->x[1][2] = half[0][2] + reach + rounds_of(t) - 1e-3;
        const struct manifold m = touch_two(t, 0.01, cache);
        if (m.count > 0) {
            double n[3], world[3];
            v3_store(m.normal, n);
            for (int i = 0; i < 3; ++i) world[i] = t_dot(t->R[1] + 3 * i, n);
            const double best = reference(t) - rounds_of(t);
            double least = HUGE_VAL;
            for (int i = 0; i < m.count; ++i) least = fmin(least, m.points[i].separation);
            ck_assert_double_eq_tol(least, best, 1e-4); /* MANIFOLD_FLAT, MANIFOLD_SNAP */
            /* Corners move by at most 1.1 a step, the lower one's core is no nearer than 0.14: 8 mrad, and what corners
             * beside a face by MANIFOLD_SNAP / 2 count as on it */
            if (k > 0 && v3_norm2(last) > 0) ck_assert_double_le(v3_norm(v3_sub(v3_load(world), last)), 1.1e-2);
            last = v3_load(world);
        } else {
            last = v3(0, 0, 0);
        }
        cache = m.count > 0 ? m.cache : 0;
        turn_by(t->R[1], axis, step);
    }
    free(t->shape_data);
    free(t);
}
END_TEST

/* A capsule that lies on a face has both ends. */
START_TEST(a_capsule_lies_on_a_face)
{
    struct pair_of *t = calloc(1, sizeof *t);
    const double half[3] = {1, 1, 0.5};
    t->shape_data = test_shape_data_new();
    box_hull(half, &t->h[1]);
    t->g[1] = test_shape_data_add(t->shape_data, &t->h[1]);
    const struct sadmm_geometry capsule = {.type = SADMM_SHAPE_CAPSULE, .subshapes = 1, .size = {0.1, 0.6, 0}};
    t->g[0] = capsule;
    rotation(t->R[1], 0, 0, 1, 0.3);
    rotation(t->R[0], 0, 1, 0, M_PI / 2 + (_i - 1) * 1e-4);
    t->x[0][0] = _i == 2 ? 0.8 : 0;
    t->x[0][2] = 0.5 + 0.1 - 1e-4;
    const struct manifold m = touch_two(t, 0.01, 0);
    ck_assert_int_eq(m.count, 2);
    ck_assert_double_eq_tol(m.normal.z, -1, 1e-8); /* beyond the edge: across it and the capsule */
    for (int i = 0; i < 2; ++i) ck_assert_double_eq_tol(m.points[i].separation, -1e-4, 1e-4);
    ck_assert_double_gt(v3_norm(v3_sub(m.points[0].position, m.points[1].position)), _i == 2 ? 0.7 : 1.1);
    free(t->shape_data);
    free(t);
}
END_TEST

/* Prisms with faces in common planes, deep in each other: coplanar points are what an expanding polytope folds on. */
START_TEST(aligned_prisms_are_as_deep_as_they_are)
{
    static const struct {
        int a, b;
        double half_a, half_b, t[3];
    } cases[] = {{8, 3, 1, 1, {0.25, 0.25, -0.5}}, {9, 3, 1, 0.5, {0, 0, 0}}, {3, 3, 1.5, 0.5, {-0.25, -0.5, 0}},
                 {4, 4, 1, 1, {0, 0, 0}},          {6, 6, 0.5, 1, {0, 0, 0}}, {20, 20, 1, 1, {0.1, 0, 0.2}},
                 {12, 5, 0.3, 2, {0, 0.5, 0.25}}};
    const double turns[2][9] = {{0, 0, 1, 1, 0, 0, 0, 1, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    struct pair_of *t = calloc(1, sizeof *t);
    t->shape_data = test_shape_data_new();
    for (size_t c = 0; c < sizeof cases / sizeof *cases; ++c)
        for (int turned = 0; turned < 2; ++turned) {
            t->shape_data->used = HULL_FIRST_OWN;
            prism_hull(cases[c].a, cases[c].half_a, &t->h[0]);
            prism_hull(cases[c].b, cases[c].half_b, &t->h[1]);
            for (int s = 0; s < 2; ++s) {
                t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
                memcpy(t->R[s], turns[s == 0 ? turned : 1], sizeof t->R[s]);
                for (int k = 0; k < 3; ++k) t->x[s][k] = s == 0 ? cases[c].t[k] : 0;
            }
            char what[40];
            snprintf(what, sizeof what, "case %d, turn %d", (int)c, turned);
            const double best = reference(t), found = nearest(t, v3(0.3, 0.5, 0.8));
            ck_assert_msg(fabs(found - best) <= 1e-10 * size_of(t), "%s: %g, should be %g", what, found, best);
            const struct manifold m = touch_two(t, 0.01, 0);
            check_manifold(t, &m, best, 0.01, what);
        }
    free(t->shape_data);
    free(t);
}
END_TEST

/* A word that is no memory of this pair does no harm. */
START_TEST(any_memory_will_do)
{
    struct random r = {.state = 1234 + (uint64_t)_i};
    struct pair_of *t = calloc(1, sizeof *t);
    const double unit[3] = {1, 0.7, 0.5};
    t->shape_data = test_shape_data_new();
    for (int pose = 0; pose < 2000; ++pose) {
        t->shape_data->used = HULL_FIRST_OWN;
        for (int s = 0; s < 2; ++s) {
            random_hull(&r.state, 4 + (int)(random_unit(&r) * 12), unit, &t->h[s]);
            t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
        }
        random_pose(&r, random_in(&r, 0.5, 2), t);
        const uint32_t word = (uint32_t)(random_unit(&r) * 4294967296.0),
                       edges = 3u << 30 | (uint32_t)(random_unit(&r) * 10) << 15 | (uint32_t)(random_unit(&r) * 10);
        const struct manifold m = touch_two(t, 0.02, pose % 2 ? word : edges);
        const double s = m.count > 0 ? along(t, m.normal) : 0;
        for (int i = 0; i < m.count; ++i) {
            ck_assert_double_le(m.points[i].separation, 0.02 + 1e-9);
            ck_assert_double_ge(m.points[i].separation, s - 1e-9);
        }
        ck_assert_int_eq(m.count > 0, reference(t) <= 0.02);
    }
    free(t->shape_data);
    free(t);
}
END_TEST

/* The face that points most along the normal need not have the deepest corner. */
START_TEST(the_deepest_corner_is_there)
{
    static const double a[4][3] = {{-.00106, -.00306, .06254}, {-.02411, .01593, .06341},
                                   {-.02347, .04359, .05641}, {-.04148, .05734, .05466}},
                        b[4][3] = {{-.03471, .06601, .04755}, {-.05034, -.00488, .11932},
                                   {-.07769, .02698, .07224}, {-.01758, .00852, .0671}};
    struct pair_of *t = calloc(1, sizeof *t);
    double least = HUGE_VAL;
    t->shape_data = test_shape_data_new();
    test_hull_of(_i ? b : a, 4, 0, &t->h[0]);
    test_hull_of(_i ? a : b, 4, 0, &t->h[1]);
    for (int s = 0; s < 2; ++s) {
        t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
        rotation(t->R[s], 0, 0, 1, 0);
    }
    struct manifold m = touch_two(t, 1e-3, 0);
    for (int step = 0; step < 2; ++step) { /* without memory, and with */
        for (int i = 0; i < m.count; ++i) least = fmin(least, m.points[i].separation);
        ck_assert_double_eq_tol(least, reference(t), 1e-6);
        ck_assert_double_eq_tol(least, -2.009e-3, 1e-6);
        m = touch_two(t, 1e-3, m.cache);
    }
    free(t->shape_data);
    free(t);
}
END_TEST

/* A knife on a face, on its edge: however sharp it is, both ends of the edge carry it. */
START_TEST(a_knife_stands_on_its_edge)
{
    static const double thick[] = {1, 0.3, 0.05, 1e-3};
    struct pair_of *t = calloc(1, sizeof *t);
    const double half[3] = {1, 1, 0.5}, d = thick[_i % 4];
    const double knife[6][3] = {{-0.6, 0, 0}, {0.6, 0, 0}, {-0.6, d, 1}, {0.6, d, 1}, {-0.6, -d, 1}, {0.6, -d, 1}};
    t->shape_data = test_shape_data_new();
    box_hull(half, &t->h[1]);
    test_hull_of(knife, 6, 1e-9, &t->h[0]);
    for (int s = 0; s < 2; ++s) t->g[s] = test_shape_data_add(t->shape_data, &t->h[s]);
    if (_i >= 4) { /* the knife as b */
        const struct test_hull h = t->h[0];
        const struct sadmm_geometry g = t->g[0];
        t->h[0] = t->h[1], t->h[1] = h;
        t->g[0] = t->g[1], t->g[1] = g;
    }
    const int top = _i < 4 ? 0 : 1;
    rotation(t->R[1 - top], 0, 0, 1, 0.3);
    rotation(t->R[top], 0, 1, 0, 1e-5);
    t->x[top][2] = 0.5 - 1e-4;
    const struct manifold m = touch_two(t, 0.01, 0);
    ck_assert_int_eq(m.count, 2);
    ck_assert_double_eq_tol(fabs(m.normal.z), 1, 1e-9);
    for (int i = 0; i < 2; ++i) ck_assert_double_eq_tol(m.points[i].separation, -1e-4, 1e-5);
    ck_assert_double_gt(v3_norm(v3_sub(m.points[0].position, m.points[1].position)), 1.1);
    free(t->shape_data);
    free(t);
}
END_TEST

/* On a plane: all corners that are near enough, or of more than eight the lowest and the outermost. */
START_TEST(planes_touch_corners)
{
    struct random r = {.state = 63 + (uint64_t)_i};
    struct test_shape_data *shape_data = test_shape_data_new();
    struct test_hull h;
    const double unit[3] = {1, 1, 1};
    const struct sadmm_geometry plane = {.type = SADMM_SHAPE_PLANE, .subshapes = 1};
    for (int pose = 0; pose < 200; ++pose) {
        double R[9], Rp[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, x[3] = {0, 0, 0}, xp[3] = {0, 0, 0}, lowest = HUGE_VAL;
        const double limit = 0.01;
        int within = 0;
        shape_data->used = HULL_FIRST_OWN;
        if (_i % 2 == 0) random_hull(&r.state, 20, unit, &h);
        else prism_hull(20, 0.4, &h);
        h.convex_radius = _i < 2 ? 0 : 0.2;
        const struct sadmm_geometry hull = test_shape_data_add(shape_data, &h);
        if (_i % 2 == 0) random_rotation(&r, R);
        else rotation(R, random_in(&r, -1, 1), random_in(&r, -1, 1), 0, pose % 2 ? 1e-3 : 0);
        for (int v = 0; v < h.vertices; ++v) lowest = fmin(lowest, t_dot(R + 6, h.x[v]) - h.convex_radius);
        x[2] = -lowest + random_in(&r, -0.05, 0.009);
        const struct pair_pose pose_b = pair_pose(true, Rp, xp, R, x);
        struct manifold m;
        memset(&m, 0x55, sizeof m);
        pair_manifold(&plane, &hull, shape_data->numbers, 0, &pose_b, limit, 0, &m);
        for (int v = 0; v < h.vertices; ++v) within += t_dot(R + 6, h.x[v]) - h.convex_radius + x[2] <= limit;
        if (within <= SADMM_MANIFOLD_POINTS) ck_assert_int_eq(m.count, within);
        else ck_assert_int_ge(m.count, 4);
        double least = HUGE_VAL, reach = 0;
        for (int i = 0; i < m.count; ++i) {
            double p[3], world[3];
            v3_store(m.points[i].position, p);
            for (int k = 0; k < 3; ++k) world[k] = t_dot(R + 3 * k, p) + x[k];
            ck_assert_double_eq_tol(world[2], m.points[i].separation / 2, 1e-12);
            least = fmin(least, m.points[i].separation);
            reach = fmax(reach, hypot(world[0], world[1]));
            for (int k = 0; k < i; ++k) ck_assert_uint_ne(m.points[i].feature, m.points[k].feature);
        }
        ck_assert_double_eq_tol(least, lowest + x[2], 1e-12);
        if (_i % 2 == 1 && pose % 2 == 0) ck_assert_double_gt(reach, 0.99);
    }
    free(shape_data);
}
END_TEST

static Suite *suite(void)
{
    Suite *s = suite_create("manifold hull");
    TCase *tests = tcase_create("hulls");
    tcase_set_timeout(tests, 60);
    tcase_add_loop_test(tests, distance_and_depth_are_the_references, 0, 8);
    tcase_add_loop_test(tests, exchange_changes_nothing, 0, 4);
    tcase_add_loop_test(tests, boxes_are_hulls, 0, 5);
    tcase_add_loop_test(tests, memory_changes_little, 0, 6);
    tcase_add_loop_test(tests, sides_are_kept, 0, 6);
    tcase_add_loop_test(tests, round_shapes_are_cores_with_a_radius, 0, 4);
    tcase_add_loop_test(tests, rounded_hulls_are_cores_with_a_radius, 0, 4);
    tcase_add_loop_test(tests, rounded_boxes_roll_smoothly, 0, 3);
    tcase_add_loop_test(tests, a_capsule_lies_on_a_face, 0, 3);
    tcase_add_test(tests, aligned_prisms_are_as_deep_as_they_are);
    tcase_add_loop_test(tests, any_memory_will_do, 0, 2);
    tcase_add_loop_test(tests, the_deepest_corner_is_there, 0, 2);
    tcase_add_loop_test(tests, a_knife_stands_on_its_edge, 0, 8);
    tcase_add_loop_test(tests, planes_touch_corners, 0, 4);
    suite_add_tcase(s, tests);
    return s;
}

int main(void) { return run_suite(suite()); }
