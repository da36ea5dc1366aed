/* Every kind of pair with a cylinder, a cone or an ellipsoid, further than test_manifold_convex.c goes: a million poses
 * of each, of sizes from 1e-6 to 1e6 m, as they come, aligned, as needles, and one body far smaller than the other;
 * apart, nearly touching, touching, in each other, and deep. One in eight is held to directions all over the sphere;
 * with SADMM_TEST_ALL all are, and those that miss by more than 1e-10 of the size are named (half an hour). */
#include <check.h>
#include <stdio.h>

#include "convex_touches.h"
#include "run_suite.h"

enum { PARTS = 10, POSES = 1000000 / PARTS };

enum { ANYHOW, ALIGNED, NEEDLES, FAR_APART_IN_SIZE, WAYS };
static const char *const ways[] = {"anyhow", "aligned", "needles", "of two sizes"};
enum { APART, NEAR, TOUCHING, SHALLOW, DEEP, DEPTHS };
static const char *const depth_names[] = {"apart", "near", "touching", "shallow", "deep"};

static const int pairs[][2] = {
    {SADMM_SHAPE_SPHERE, SADMM_SHAPE_CYLINDER},   {SADMM_SHAPE_SPHERE, SADMM_SHAPE_CONE},
    {SADMM_SHAPE_SPHERE, SADMM_SHAPE_ELLIPSOID},  {SADMM_SHAPE_CAPSULE, SADMM_SHAPE_CYLINDER},
    {SADMM_SHAPE_CAPSULE, SADMM_SHAPE_CONE},      {SADMM_SHAPE_CAPSULE, SADMM_SHAPE_ELLIPSOID},
    {SADMM_SHAPE_BOX, SADMM_SHAPE_CYLINDER},      {SADMM_SHAPE_BOX, SADMM_SHAPE_CONE},
    {SADMM_SHAPE_BOX, SADMM_SHAPE_ELLIPSOID},     {SADMM_SHAPE_HULL, SADMM_SHAPE_CYLINDER},
    {SADMM_SHAPE_HULL, SADMM_SHAPE_CONE},         {SADMM_SHAPE_HULL, SADMM_SHAPE_ELLIPSOID},
    {SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CYLINDER}, {SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE},
    {SADMM_SHAPE_CYLINDER, SADMM_SHAPE_ELLIPSOID}, {SADMM_SHAPE_CONE, SADMM_SHAPE_CONE},
    {SADMM_SHAPE_CONE, SADMM_SHAPE_ELLIPSOID},    {SADMM_SHAPE_ELLIPSOID, SADMM_SHAPE_ELLIPSOID},
};
enum { PAIRS = sizeof pairs / sizeof *pairs };

/* ---- poses ------------------------------------------------------------------------------------------------------- */

static double in_range(double size) { return fmin(1e6, fmax(1e-6, size)); }

static void far_shape(struct random *r, struct pair_of *t, int s, int type, double scale, bool needle)
{
    const double flat = pow(10, needle ? random_in(r, -4, -1) : random_in(r, -1, 0));
    const int thin = (int)(3 * random_unit(r)),
              thin_too = needle && random_unit(r) < 0.5 ? (int)(3 * random_unit(r)) : thin;
    struct sadmm_geometry g = {.type = type, .subshapes = 1};
    for (int k = 0; k < 3; ++k)
        g.size[k] = in_range(scale * random_in(r, 0.3, 1) * (k == thin || k == thin_too ? flat : 1));
    if (type == SADMM_SHAPE_HULL) {
        if (random_unit(r) < 0.3) box_hull(g.size, &t->h[s]);
        else random_hull(&r->state, 5 + (int)(random_unit(r) * 12), g.size, &t->h[s]);
        t->h[s].convex_radius = random_unit(r) < 0.3 ? 0.2 * scale * flat : 0;
        g = test_shape_data_add(t->shape_data, &t->h[s]);
    }
    t->g[s] = g;
}

static void far_pair(struct random *r, struct pair_of *t, const int type[2], int way)
{
    static const double tilts[] = {0, 0, 1e-12, 1e-9, 1e-6, 1e-3};
    const double scale = pow(10, random_in(r, -6, 6)),
                 ratio = way == FAR_APART_IN_SIZE ? pow(10, random_in(r, -4, 0)) : 1;
    const int smaller = random_unit(r) < 0.5;
    double d[3];
    t->shape_data->used = HULL_FIRST_OWN;
    for (int s = 0; s < 2; ++s) far_shape(r, t, s, type[s], s == smaller ? scale * ratio : scale, way == NEEDLES);
    for (int k = 0; k < 3; ++k) d[k] = random_in(r, -1, 1);
    for (int s = 0; s < 2; ++s) {
        double turn[9], tilt[9];
        random_rotation(r, t->R[s]);
        if (way != ALIGNED) continue;
        const int axis = (int)(3 * random_unit(r));
        rotation(turn, axis == 0, axis == 1, axis == 2, M_PI / 2 * (int)(4 * random_unit(r)));
        rotation(tilt, random_in(r, -1, 1), random_in(r, -1, 1), random_in(r, -1, 1),
                 tilts[(int)(6 * random_unit(r))]);
        multiply(tilt, turn, t->R[s]);
        for (int k = 0; k < 3 && t->g[s].type != SADMM_SHAPE_HULL && axis; ++k) t->g[s].size[k] = in_range(scale / 2);
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

static void put_at_depth(struct random *r, struct pair_of *t, int depth)
{
    const double thin = pair_thin(t);
    switch (depth) {
    case NEAR: push_together(t, -pow(10, random_in(r, -12, -2)) * thin); break;
    case TOUCHING: push_together(t, 0); break;
    case SHALLOW: push_together(t, pow(10, random_in(r, -12, -1.31)) * thin); break;
    case DEEP: push_together(t, pow(10, random_in(r, -1.3, 0)) * thin); break;
    default: break;
    }
}

/* ---- what is checked --------------------------------------------------------------------------------------------- */

/* The optimum before a flat is preferred. */
static struct convex_axis bare_axis(const struct pair_of *t)
{
    const struct pair_pose pose = pair_of_pose(t);
    struct convex_pair pair;
    struct convex_axis axis;
    struct convex_active active;
    memset(&axis, 0, sizeof axis);
    convex_pair_make(&t->g[0], &t->g[1], t->shape_data->numbers, &pose, &pair);
    convex_find(&pair, v3_norm2(pair.t) > 0 ? v3_neg(pair.t) : v3(0, 0, 1), false, 1e300, &axis, &active);
    convex_nearest(&pair, &active, &axis);
    return axis;
}

/* How far a point of smooth shape s is from where the shape points along n (world): from its one point there, or from
 * the line between the two of its discs. Of others 0. */
static double off_feature(const struct pair_of *t, int s, const double n[3], const double world[3])
{
    const double *size = t->g[s].size;
    double d[3], p[3], rel[3], line[3];
    t_sub(world, t->x[s], rel);
    to_own(t->R[s], rel, p);
    to_own(t->R[s], n, d);
    const double r = hypot(d[0], d[1]);
    switch (t->g[s].type) {
    case SADMM_SHAPE_SPHERE:
        for (int k = 0; k < 3; ++k) p[k] -= size[0] * d[k];
        return t_norm(p);
    case SADMM_SHAPE_ELLIPSOID: {
        const double reach = own_support(t, s, n);
        for (int k = 0; k < 3; ++k) p[k] -= size[k] * size[k] * d[k] / reach;
        return t_norm(p);
    }
    case SADMM_SHAPE_CYLINDER:
    case SADMM_SHAPE_CONE: {
        if (r < 1e-6) return 0; /* a cap: all of it */
        const double bottom[3] = {size[0] * d[0] / r, size[0] * d[1] / r, -size[1]},
                     wide = t->g[s].type == SADMM_SHAPE_CONE ? 0 : size[0],
                     top[3] = {wide * d[0] / r, wide * d[1] / r, size[1]};
        t_sub(top, bottom, line);
        t_sub(p, bottom, p);
        const double share = fmax(0, fmin(1, t_dot(line, p) / t_dot(line, line)));
        for (int k = 0; k < 3; ++k) p[k] -= share * line[k];
        return t_norm(p);
    }
    default: return 0;
    }
}

/* Check writes down every assertion that it passes: there are too many here. */
#define HOLDS(condition, ...)                                \
    do {                                                     \
        if (!(condition)) ck_assert_msg(false, __VA_ARGS__); \
    } while (0)

/* What the separation may be short of the best one by: CLOSE but for few poses, and never by more than this. */
#define CLOSE 1e-10
static double may_miss(const struct pair_of *t, int depth)
{
    const double thin = pair_thin(t), size = pair_size(t);
    switch (depth) {
    case APART: /* rims that hardly miss each other, or a flat: rounding of the way to them is that of a square */
    case NEAR:
    case TOUCHING: return 1e-8 * size;
    case SHALLOW: /* optima of two sides that are as deep but for this: the polytope between them is flat to rounding */
        return 5e-7 * thin + 1e-8 * size;
    default: /* of a body around another one's middle there may be more optima than the search asks for */
        return 1e-4 * thin + 1e-7 * size;
    }
}

/* How far points within the margin may be outside of their bodies. */
static double may_be_outside(const struct pair_of *t)
{
    return MANIFOLD_SNAP * pair_thin(t) + 1e-5 * pair_size(t); /* clipping; a corner or a rim at another one */
}

struct checked {
    long all, certified; /* of those that are apart */
    long within, outside; /* of those that are not deep */
    long asked, missed;   /* for the best direction; not CLOSE to it */
};

static void check_pair(const struct pair_of *t, struct pair_of *u, int depth, bool sweep, const char *what,
                       struct checked *count)
{
    const double thin = pair_thin(t), size = pair_size(t);
    const struct convex_axis axis = bare_axis(t);
    const struct manifold m = pair_touch(t, 1e300, 0);
    double n[3], own[3], back[3], pa[3], pb[3], separation[3], least = HUGE_VAL, outside = -HUGE_VAL;
    HOLDS(m.count > 0 && fabs(v3_norm(m.normal) - 1) < 1e-12, "%s: %d points", what, m.count);
    normal_in_world(t, m.normal, n);
    normal_in_world(t, axis.n, own);
    for (int k = 0; k < 3; ++k) back[k] = -own[k];
    const double apart = apart_along(t, n);

    /* two points of the bodies bound the distance from above, the planes across n from below */
    point_in_world(t, axis.pa, pa);
    point_in_world(t, axis.pb, pb);
    t_sub(pb, pa, separation);
    double above = t_norm(separation) + fmax(0, own_outside(t, 0, pa)) + fmax(0, own_outside(t, 1, pb));
    for (int i = 0; i < m.count; ++i) {
        const double out = points_outside(t, m.normal, m.points[i].position, m.points[i].separation);
        if (m.points[i].separation <= apart + 0.1 * thin) outside = fmax(outside, out);
        least = fmin(least, m.points[i].separation);
        above = fmin(above, fabs(m.points[i].separation) + 2 * fmax(0, out));
        HOLDS(m.points[i].separation >= apart - 1e-11 * size, "%s: a point at %g, the two at %g", what,
              m.points[i].separation, apart);
        for (int q = 0; q < i; ++q)
            HOLDS(m.points[q].feature != m.points[i].feature, "%s: feature %x twice", what, m.points[i].feature);
    }
    if (depth <= NEAR) {
        const bool certified = above - apart <= 1e-10 * size;
        ++count->all;
        count->certified += certified;
        sweep = !certified;
    }
    if (sweep) { /* or no direction is better */
        const double best = fmax(best_direction(t, n), best_direction(t, own));
        ++count->asked;
        count->missed += apart < best - CLOSE * size;
        if (getenv("SADMM_TEST_ALL") && apart < best - CLOSE * size)
            printf("%s: short by %.2g of the size\n", what, (best - apart) / size);
        HOLDS(apart >= best - may_miss(t, depth),
              "%s: %.17g apart along the normal, %.17g at best, size %g, thin %g", what, apart, best, size, thin);
    }
    HOLDS(least <= apart + 1.1 * MANIFOLD_FLAT * thin + 1e-10 * size, "%s: nearest point at %g, the two at %g", what,
          least, apart);
    if (depth != DEEP) {
        ++count->within;
        count->outside += outside > may_be_outside(t);
        if (depth <= NEAR && apart > 1e-9 * size)
            HOLDS(outside <= may_be_outside(t), "%s: a point is outside by %g, size %g, thin %g", what, outside, size,
                  thin);
    }
    if (depth <= TOUCHING)
        HOLDS(off_feature(t, 0, own, pa) <= 1e-10 * size && off_feature(t, 1, back, pb) <= 1e-10 * size,
              "%s: nearest points point elsewhere, by %g and %g, size %g", what, off_feature(t, 0, own, pa),
              off_feature(t, 1, back, pb), size);

    /* the same two the other way round */
    struct manifold w = {.count = 0};
    double other[3];
    exchange(t, u);
    const struct pair_pose pose = pair_of_pose(u);
    convex_manifold(&u->g[0], &u->g[1], u->shape_data->numbers, &pose, 1e300, 0, &w);
    HOLDS(w.count > 0, "%s: nothing the other way round", what);
    normal_in_world(u, w.normal, other);
    const double there = apart_along(u, other);
    HOLDS(fabs(there - apart) <= may_miss(t, depth),
          "%s: %.17g, %.17g the other way round, size %g, thin %g", what, apart, there, size, thin);
}

START_TEST(pairs_are_what_they_are)
{
    const int *type = pairs[_i / PARTS];
    struct random r = {.state = 10007 + (uint64_t)_i};
    struct pair_of *t = new_pair(), *u = calloc(1, sizeof *u);
    struct checked count[WAYS] = {{0, 0, 0, 0, 0, 0}};
    const int poses = getenv("SADMM_TEST_SHORT") ? POSES / 50 : POSES;
    ck_assert_ptr_nonnull(u);
    for (int pose = 0; pose < poses; ++pose) {
        const int way = pose % WAYS, depth = pose / WAYS % DEPTHS;
        char what[96];
        far_pair(&r, t, type, way);
        put_at_depth(&r, t, depth);
        snprintf(what, sizeof what, "%s-%s, pose %d.%d, %s, %s", names[type[0]], names[type[1]], _i, pose, ways[way],
                 depth_names[depth]);
        check_pair(t, u, depth, getenv("SADMM_TEST_ALL") || pose / (WAYS * DEPTHS) % 8 == 0, what, &count[way]);
    }
    for (int way = 0; way < WAYS; ++way) {
        /* points prove nearly all of them; of aligned ones flats have preference */
        if (way != ALIGNED) ck_assert_int_ge(count[way].certified, count[way].all - count[way].all / 1000 - 1);
        /* of corners and rims that touch, or of what lies along a needle, the nearest point may be another one */
        ck_assert_int_le(count[way].outside, 2 + count[way].within / 500);
        ck_assert_int_le(count[way].missed, 1);
    }
    free_pair(t);
    free(u);
}
END_TEST

/* On planes: the lowest point, by formula. */
START_TEST(planes_touch_the_lowest_point)
{
    const int type[2] = {SADMM_SHAPE_SPHERE, SADMM_SHAPE_CYLINDER + _i / PARTS};
    struct random r = {.state = 20011 + (uint64_t)_i};
    struct pair_of *t = new_pair();
    const int poses = getenv("SADMM_TEST_SHORT") ? POSES / 50 : POSES;
    for (int pose = 0; pose < poses; ++pose) {
        double down[3], least = HUGE_VAL;
        far_pair(&r, t, type, pose % WAYS);
        t->g[0] = (struct sadmm_geometry){.type = SADMM_SHAPE_PLANE, .subshapes = 1};
        for (int k = 0; k < 3; ++k) down[k] = -t->R[0][3 * k + 2];
        const double size = geometry_radius(&t->g[1]), thin = geometry_thickness(&t->g[1]),
                     low = own_support(t, 1, down), separation = (pose % 3 - 1) * pow(10, random_in(&r, -12, 0)) * thin;
        for (int k = 0; k < 3; ++k) t->x[1][k] = t->x[0][k] - (low + separation) * down[k];
        const struct pair_pose at = pair_pose(true, t->R[0], t->x[0], t->R[1], t->x[1]);
        /* the position itself is rounded */
        const double rounding = 1e-12 * size + 4e-16 * (t_norm(t->x[0]) + t_norm(t->x[1]));
        struct manifold m;
        memset(&m, 0x55, sizeof m);
        pair_manifold(&t->g[0], &t->g[1], t->shape_data->numbers, 0, &at, separation + 1e-9 * size, 0, &m);
        HOLDS(m.count > 0 && m.count <= SADMM_MANIFOLD_POINTS, "pose %d: %d points", pose, m.count);
        for (int i = 0; i < m.count; ++i) {
            double world[3], d[3];
            const double s = m.points[i].separation;
            point_in_world(t, m.points[i].position, world);
            t_sub(world, t->x[0], d);
            least = fmin(least, s);
            HOLDS(fabs(-t_dot(d, down) - s / 2) <= rounding, "pose %d: at %g, separation %g", pose, -t_dot(d, down), s);
            for (int k = 0; k < 3; ++k) world[k] -= s / 2 * down[k];
            HOLDS(own_outside(t, 1, world) <= 1e-11 * size + rounding, "pose %d: outside by %g, size %g", pose,
                  own_outside(t, 1, world), size);
        }
        HOLDS(least >= separation - rounding && least <= separation + MANIFOLD_FLAT * thin + rounding,
              "pose %d: at %.17g, should be %.17g", pose, least, separation);
    }
    free_pair(t);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("manifold convex, long");
    TCase *cases = tcase_create("smooth bodies");
    tcase_set_timeout(cases, 600);
    tcase_add_loop_test(cases, pairs_are_what_they_are, 0, PAIRS * PARTS);
    tcase_add_loop_test(cases, planes_touch_the_lowest_point, 0, 3 * PARTS);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
