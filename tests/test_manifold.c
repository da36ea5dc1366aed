/* Pair manifolds against analytic answers and against oracles that share no code with them: separation over many
 * directions, all 15 axes without preference, distance by alternating projection.
 *
 * Tolerances. 1e-12: positions of size 1 after some tens of roundings. The choice of an axis may cost up to 5 % of the
 * depth and 0.5 % of the thinner box (manifold.h); where a test allows for that it says `choice`.
 *
 * One file: one function is under test, and these tolerances hold for all of its tests.
 */
#include "hull_shapes.h"
#include "manifold_tools.h"
#include "mesh_tools.h"

#include "subadmm/world.h"

static const double pi = 3.14159265358979323846;

static double thinner(const struct solid *a, const struct solid *b)
{
    return fmin(thickness_of(a), thickness_of(b));
}

/* What preferring a face may cost against the best axis. */
static double choice(const struct solid *a, const struct solid *b, double depth)
{
    return 0.05 * fabs(depth) + 0.005 * thinner(a, b) + 1e-12;
}

static void expect_points_near_both(const struct solid *a, const struct solid *b, const struct world_manifold *m)
{
    for (int i = 0; i < m->count; ++i) {
        /* halfway between the surfaces: no farther from either than half the separation, but where corners stay
         * corners */
        double slack = MANIFOLD_SNAP * fmin(radius_of(a), radius_of(b)) + 1e-12;
        double reach = 0.5 * fabs(m->separation[i]) + slack;
        ck_assert_double_le(outside(a, m->position[i]), reach);
        ck_assert_double_le(outside(b, m->position[i]), reach);
    }
}

static struct solid random_box(struct random *r)
{
    struct solid s = box_at(1, 1, 1, 0, 0, 0);
    for (int k = 0; k < 3; ++k) s.size[k] = 0.05 * pow(10, random_in(r, -1.5, 0.5));
    random_rotation(r, s.R);
    return s;
}

/* ---- boxes: depth, normal, emptiness ----------------------------------------------------------------------------- */

START_TEST(box_depth_and_normal_are_those_of_the_sweep)
{
    enum { PAIRS = 250, DIRECTIONS = 20000 };
    struct random r = {1234};
    int overlapping = 0;
    for (int n = 0; n < PAIRS; ++n) {
        struct solid a = random_box(&r), b = random_box(&r);
        for (int k = 0; k < 3; ++k)
            b.x[k] = random_in(&r, -0.6, 0.6) * (shadow(&a, (double[]){1, 0, 0}) + shadow(&b, (double[]){0, 1, 0}));
        double best = box_separation(&a, &b, NULL), swept = sweep_separation(&a, &b, DIRECTIONS);
        struct world_manifold m = touch(&a, &b, 0, 0);
        if (swept > 0) ck_assert_int_eq(m.count, 0);
        if (best <= 0)
            ck_assert_double_ge(best, swept - 1e-12); /* apart, corners may be farther than every axis says */
        /* the nearest of the directions is within 0.02 rad (spacing sqrt(4 pi / n)); no point is farther than the sum
         * of radii */
        double reach = sqrt(dot3(b.x, b.x)) + sqrt(dot3(a.size, a.size)) + sqrt(dot3(b.size, b.size));
        if (best <= 0) ck_assert_double_le(best, swept + 0.02 * reach);
        if (best > 0) {
            ck_assert_int_eq(m.count, 0);
            continue;
        }
        ++overlapping;
        ck_assert_int_gt(m.count, 0);
        double chosen = separation_along(&a, &b, m.normal);
        ck_assert_double_ge(chosen, best - choice(&a, &b, chosen));
        ck_assert_double_ge(least_separation(&m), separation_along(&a, &b, m.normal) - 1e-12);
        expect_points_near_both(&a, &b, &m);
    }
    ck_assert_int_gt(overlapping, PAIRS / 3);
}
END_TEST

/* Boxes that just touch, shifted along their true axis from apart to deep: contact exactly when it should be. */
START_TEST(contact_starts_at_the_limit_and_never_ends_below_it)
{
    struct random r = {77};
    const double limit = 2e-3;
    for (int n = 0; n < 800; ++n) {
        struct solid a = random_box(&r), b = random_box(&r);
        double axis[3], direction[3];
        spread_direction(n, 800, direction);
        for (int k = 0; k < 3; ++k) b.x[k] = direction[k] * 0.4;
        double distance = distance_by_projection(&a, &b, 5000);
        if (distance <= 1e-3) continue; /* already overlap here */
        box_separation(&a, &b, axis);
        if (touch(&a, &b, distance * 0.999, 0).count > 0) ck_abort_msg("pair %d: contact beyond the limit", n);
        struct world_manifold m = touch(&a, &b, distance * 1.001 + 1e-9, 0);
        ck_assert_msg(m.count > 0, "pair %d: %g apart, not found within 1.001 times that", n, distance);
        /* projection converges slowly where faces are nearly parallel: 1e-3 relative */
        ck_assert_double_eq_tol(least_separation(&m), distance, 1.1e-3 * distance);
        /* approach to deep overlap in steps of a hundredth of the limit's scale: never empty */
        double separation = box_separation(&a, &b, axis);
        for (int k = 0; k < 3; ++k) b.x[k] -= axis[k] * separation;
        for (int step = 0; step < 40; ++step) {
            struct world_manifold deep;
            for (int k = 0; k < 3; ++k) b.x[k] -= axis[k] * 0.1 * thinner(&a, &b) / 4;
            if (box_separation(&a, &b, NULL) > 0) continue;
            deep = touch(&a, &b, limit, 0);
            ck_assert_msg(deep.count > 0, "pair %d, step %d: an overlap without contacts", n, step);
        }
    }
}
END_TEST

/* All pairs of kinds, from touching to concentric and out on the other side: overlap never empty. */
START_TEST(overlap_is_never_empty)
{
    const struct solid kinds[] = {
        solid_at(SADMM_SHAPE_SPHERE, 0.05, 0, 0, 0, 0, 0),
        solid_at(SADMM_SHAPE_CAPSULE, 0.02, 0.06, 0, 0, 0, 0),
        box_at(0.05, 0.03, 0.0005, 0, 0, 0),
        box_at(0.05, 0.05, 0.05, 0, 0, 0),
    };
    struct random r = {5};
    for (size_t i = 0; i < 4; ++i)
        for (size_t j = i; j < 4; ++j)
            for (int n = 0; n < 30; ++n) {
                struct solid a = kinds[i], b = kinds[j];
                double d[3];
                if (n > 0) {
                    random_rotation(&r, a.R);
                    random_rotation(&r, b.R);
                }
                spread_direction(n, 30, d);
                double reach = (shadow(&a, d) + shadow(&b, d)) * 1.2;
                uint32_t cache = 0;
                for (int step = -100; step <= 100; ++step) {
                    for (int k = 0; k < 3; ++k) b.x[k] = d[k] * reach * step / 100.0;
                    double swept = sweep_separation(&a, &b, 400);
                    struct world_manifold fresh = touch(&a, &b, 0, 0), kept = touch(&a, &b, 0, cache);
                    cache = kept.cache;
                    if (swept > 0) {
                        ck_assert_int_eq(fresh.count, 0);
                        ck_assert_int_eq(kept.count, 0);
                    } else if (distance_by_projection(&a, &b, 500) < -1e-9 ||
                               (a.type == SADMM_SHAPE_BOX && b.type == SADMM_SHAPE_BOX &&
                                box_separation(&a, &b, NULL) < 0)) {
                        ck_assert_msg(fresh.count > 0 && kept.count > 0, "kinds %zu %zu, pair %d, step %d", i, j, n,
                                      step);
                    }
                }
            }
}
END_TEST

/* ---- boxes: resting contact -------------------------------------------------------------------------------------- */

/* A cube on an equal cube, turned by a tiny angle about a horizontal axis: four points at the upper cube's corners,
 * each with the depth of that corner. */
START_TEST(nearly_aligned_boxes_give_four_exact_points)
{
    for (double tilt = 1e-9; tilt < 2e-2; tilt *= 10)
        for (int direction = 0; direction < 8; ++direction) {
            const double h = 0.05, depth = 1e-4;
            struct solid a = box_at(h, h, h, 0, 0, 0), b = box_at(h, h, h, 0, 0, 2 * h - depth);
            turn(&b, cos(direction * pi / 4), sin(direction * pi / 4), 0, tilt);
            struct world_manifold m = touch(&a, &b, 0.002, 0);
            ck_assert_int_eq(m.count, 4);
            ck_assert_double_gt(m.normal[2], 0.999);
            /* the reference face, and the face that is held against it */
            bool reference_is_a = fabs(m.normal[0]) + fabs(m.normal[1]) < 0.5 * tilt;
            const struct solid *reference = reference_is_a ? &a : &b, *incident = reference_is_a ? &b : &a;
            double out = reference_is_a ? 1 : -1, n[3];
            for (int k = 0; k < 3; ++k) n[k] = incident->R[3 * k + 2];
            for (int i = 0; i < 4; ++i) {
                double on_reference[3], on_incident[3];
                for (int k = 0; k < 3; ++k) {
                    double step = out * 0.5 * m.separation[i] * m.normal[k];
                    on_reference[k] = m.position[i][k] - step - reference->x[k];
                    on_incident[k] = m.position[i][k] + step - incident->x[k];
                }
                ck_assert_double_eq_tol(out * dot3(on_reference, m.normal), h, 1e-12);
                ck_assert_double_eq_tol(-out * dot3(on_incident, n), h, 1e-12);
                /* at a corner, or where a corner that the tilt pushed out over the side was cut off */
                for (int k = 0; k < 2; ++k)
                    ck_assert_double_eq_tol(fabs(m.position[i][k]), h, 1e-3 * h + 1.1 * tilt * h);
            }
        }
}
END_TEST

START_TEST(turned_boxes_give_the_corners_of_the_overlap)
{
    const double h = 0.05;
    struct solid a = box_at(h, h, h, 0, 0, 0), b = box_at(h, h, h, 0, 0, 2 * h);
    /* 45 degrees: the overlap of two squares is a regular octagon with inradius h */
    turn(&b, 0, 0, 1, pi / 4);
    struct world_manifold m = touch(&a, &b, 0.002, 0);
    ck_assert_int_eq(m.count, 8);
    for (int i = 0; i < 8; ++i) {
        double radius = hypot(m.position[i][0], m.position[i][1]);
        ck_assert_double_eq_tol(radius, h / cos(pi / 8), 1e-12);
        ck_assert_double_eq_tol(m.separation[i], 0, 1e-12);
        ck_assert_double_eq_tol(m.position[i][2], h, 1e-12);
    }
    /* shifted by half a side in both directions: a quarter of the face, exact corners */
    b = box_at(h, h, h, h, h, 2 * h);
    m = touch(&a, &b, 0.002, 0);
    ck_assert_int_eq(m.count, 4);
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 2; ++k) ck_assert(fabs(m.position[i][k]) < 1e-12 || fabs(m.position[i][k] - h) < 1e-12);
    /* any turn: 4 to 8 points, all within both faces */
    for (double angle = 1e-9; angle < 1.5; angle *= 1.7) {
        b = box_at(h, h, h, 0, 0, 2 * h);
        turn(&b, 0, 0, 1, angle);
        m = touch(&a, &b, 0.002, 0);
        ck_assert_int_ge(m.count, 4);
        expect_points_near_both(&a, &b, &m);
    }
}
END_TEST

/* The face of a huge box does not blur what is small: its tolerance is the small box's. */
START_TEST(a_small_box_on_a_huge_one_keeps_its_corners)
{
    for (double huge = 1; huge <= 1e4; huge *= 10) {
        const double h = 0.001;
        struct solid ground = box_at(huge, huge, huge, 0, 0, -huge), b = box_at(h, h, h, 0.3, -0.2, h);
        struct world_manifold m = touch(&ground, &b, 1e-5, 0), n = touch(&b, &ground, 1e-5, 0);
        ck_assert_int_eq(m.count, 4);
        ck_assert_int_eq(n.count, 4);
        for (int i = 0; i < 4; ++i) {
            ck_assert_double_eq_tol(fabs(m.position[i][0] - 0.3), h, 1e-12 * huge);
            ck_assert_double_eq_tol(fabs(m.position[i][1] + 0.2), h, 1e-12 * huge);
            ck_assert_double_eq_tol(m.separation[i], 0, 1e-15 * huge);
        }
    }
}
END_TEST

/* No pair is known that needs it, but the promise "overlap is never empty" rests on it: the deepest vertex of the box
 * that is held against the face. */
START_TEST(the_last_resort_is_the_deepest_vertex)
{
    struct random r = {14};
    for (int n = 0; n < 200; ++n) {
        struct solid a = random_box(&r), b = random_box(&r);
        struct pair_pose pose = pair_pose(false, a.R, a.x, b.R, b.x);
        struct box_pair pair;
        box_pair_make(v3_load(b.size), v3_load(a.size), &pose, 0, &pair);
        for (int axis = 0; axis < 6; ++axis) {
            struct manifold m;
            double normal[3], position[3], depth = 0.01 * (n + 1);
            const struct solid *owner = axis < 3 ? &a : &b;
            box_vertex_manifold(&pair, axis, n % 2, -depth, &m);
            ck_assert_int_eq(m.count, 1);
            v3_store(m.normal, normal);
            v3_store(m.points[0].position, position);
            apply(b.R, normal, normal); /* from b, box 1, to a, box 2 */
            apply(b.R, position, position);
            /* the point lies half the depth inside the surface of the vertex's owner: at the foot of its shadow */
            double foot = shadow(owner, normal) - 0.5 * depth;
            ck_assert_double_eq_tol(dot3(position, normal), axis < 3 ? -foot : foot, 1e-12);
            ck_assert_double_eq(m.points[0].separation, -depth);
        }
    }
}
END_TEST

START_TEST(concentric_boxes)
{
    struct solid a = box_at(0.05, 0.04, 0.03, 0, 0, 0), b = box_at(0.02, 0.03, 0.04, 0, 0, 0);
    struct world_manifold m = touch(&a, &b, 0, 0);
    /* least way out: along z, 0.03 + 0.04; along y 0.07 as well; along x 0.07 */
    ck_assert_int_ge(m.count, 1);
    ck_assert_double_eq_tol(separation_along(&a, &b, m.normal), -0.07, 1e-12);
    for (int i = 0; i < 20; ++i) {
        struct random r = {99 + (uint64_t)i};
        random_rotation(&r, b.R);
        m = touch(&a, &b, 0, 0);
        ck_assert_int_ge(m.count, 1);
        double best = box_separation(&a, &b, NULL);
        ck_assert_double_ge(separation_along(&a, &b, m.normal), best - choice(&a, &b, best));
    }
}
END_TEST

/* ---- boxes: edges ------------------------------------------------------------------------------------------------ */

/* Two roofs, ridge down on ridge, crossing at any angle: one point where the ridges cross, or both ends of the common
 * stretch when they are parallel. */
START_TEST(crossing_ridges)
{
    const double h = 0.05, r2 = h * sqrt(2.0), depth = 1e-3;
    for (int degrees = 0; degrees <= 90; degrees += 5) {
        struct solid a = box_at(h, 0.1, h, 0, 0, 0), b = box_at(h, 0.1, h, 0, 0, 2 * r2 - depth);
        turn(&a, 0, 1, 0, pi / 4);
        turn(&b, 0, 1, 0, pi / 4);
        turn(&b, 0, 0, 1, degrees * pi / 180);
        struct world_manifold m = touch(&a, &b, 0, 0);
        if (degrees == 0) {
            /* exactly parallel: the faces at 45 degrees are the axes; a line contact has two ends */
            ck_assert_int_ge(m.count, 2);
            continue;
        }
        ck_assert_int_ge(m.count, 1);
        ck_assert_double_ge(m.normal[2], 0.999999);
        double crossing = HUGE_VAL;
        for (int i = 0; i < m.count; ++i) {
            ck_assert_double_ge(m.separation[i], -depth - 1e-12);
            if (fabs(m.separation[i] + depth) < 1e-12)
                crossing = fmin(crossing, hypot(m.position[i][0], m.position[i][1]));
        }
        ck_assert_double_lt(crossing, 1e-12); /* the ridges cross on the axis of the turn */
        if (degrees >= 10) ck_assert_int_eq(m.count, 1);
    }
    /* Slightly crossed: the ridges meet in the middle, the separation at the ends of the stretch is what the turn
     * opens. As long as the ends are as deep as the crossing they stand for the line; once they are not, all three
     * count. */
    for (double angle = 2e-5; angle < 0.1; angle *= 1.5) {
        struct solid a = box_at(h, 0.1, h, 0, 0, 0), b = box_at(h, 0.1, h, 0, 0, 2 * r2 - 1e-7);
        turn(&a, 0, 1, 0, pi / 4);
        turn(&b, 0, 1, 0, pi / 4);
        turn(&b, 0, 0, 1, angle);
        struct world_manifold m = touch(&a, &b, 2e-3, 0);
        double open = 2 * 0.1 * sin(angle / 2); /* sideways at the ends; the faces fall away at 45 degrees */
        ck_assert_double_gt(m.normal[2], 0.999999);
        ck_assert_int_eq(m.count, open < 0.99e-5 ? 2 : (open < 2e-3 ? 3 : 1));
        for (int i = 0; i < m.count; ++i) {
            bool end = fabs(m.position[i][1]) > 0.09;
            ck_assert_double_eq_tol(m.separation[i], (end ? open : 0) - 1e-7, 1e-3 * open + 1e-12);
            if (!end) ck_assert_double_lt(hypot(m.position[i][0], m.position[i][1]), 1e-9);
        }
    }
}
END_TEST

/* Two ridges nearly parallel: a line contact keeps both ends of the stretch, also when it is only a part of the
 * edges. */
START_TEST(nearly_parallel_edges_touch_along_a_line)
{
    const double h = 0.05, r2 = h * sqrt(2.0);
    for (double angle = 1e-7; angle < 2e-3; angle *= 10)
        for (int along = 0; along < 3; ++along)
            for (int about = 0; about < 2; ++about) {
                struct solid a = box_at(h, 0.1, h, 0, 0, 0), b = box_at(h, 0.1, h, 0, 0.06 * along, 2 * r2 - 1e-4);
                double lo = HUGE_VAL, hi = -HUGE_VAL;
                turn(&a, 0, 1, 0, pi / 4);
                turn(&b, 0, 1, 0, pi / 4);
                /* about the vertical the ridges cross; about x one end is higher */
                if (about == 0) turn(&b, 0, 0, 1, angle);
                else turn(&b, 1, 0, 0, 1e-2 * angle);
                struct world_manifold m = touch(&a, &b, 1e-3, 0);
                ck_assert_int_ge(m.count, 2);
                for (int i = 0; i < m.count; ++i) {
                    lo = fmin(lo, m.position[i][1]);
                    hi = fmax(hi, m.position[i][1]);
                }
                /* the common stretch: from b's end to a's; 1 % for the turn */
                ck_assert_double_eq_tol(lo, -0.1 + 0.06 * along, 2e-3);
                ck_assert_double_eq_tol(hi, 0.1, 2e-3);
            }
}
END_TEST

/* A corner of one box over the inside of a face of the other, and the last step's axis an edge axis that is nearly as
 * good: the edges do not cross, and the corner lies on no edge of the other box. The normal is still one along which
 * the boxes are as far apart as along the best. */
START_TEST(a_corner_over_a_face_has_the_normal_of_the_face)
{
    struct random r = {41};
    int contacts = 0;
    for (int n = 0; n < 20000; ++n) {
        struct solid a = box_at(0.05, 0.05, 0.05, 0, 0, 0), b = box_at(0.05, 0.04, 0.03, 0, 0, 0);
        double axis[3];
        random_rotation(&r, a.R);
        random_rotation(&r, b.R);
        spread_direction(n, 20000, b.x);
        for (int k = 0; k < 3; ++k) b.x[k] *= 0.08;
        uint32_t cache = 0;
        for (int step = 0; step < 6; ++step) {
            for (int k = 0; k < 3; ++k) b.x[k] += random_in(&r, -2e-3, 2e-3);
            double separation = box_separation(&a, &b, axis);
            for (int k = 0; k < 3; ++k) b.x[k] += axis[k] * (2e-4 - separation);
            struct world_manifold m = touch(&a, &b, 2e-3, cache);
            double best = box_separation(&a, &b, NULL);
            cache = m.count ? m.cache : 0;
            if (best <= 0 || m.count == 0) continue;
            ++contacts;
            /* twice: the cached axis, and a face for an edge axis */
            ck_assert_double_ge(separation_along(&a, &b, m.normal), best - 2 * choice(&a, &b, 0));
        }
    }
    ck_assert_int_gt(contacts, 20000);
}
END_TEST

/* A card leans with its upper edge just below and beside the end of a lying one: both ends of the line that they have
 * in common, whichever way the last bit turns. (Half the contacts of a card house begin like that.) */
START_TEST(edges_side_by_side_touch_at_both_ends)
{
    const double tilts[] = {0, 1e-15, -1e-15, 1e-9, -1e-9}, half = 0.03, lean = 0.2923;
    for (size_t k = 0; k < sizeof tilts / sizeof *tilts; ++k) {
        struct solid lying = box_at(half, 0.05, 0.0005, 0, 0, 0), leaning = box_at(0.0005, half, 0.05, 0, 0, 0);
        double up[3] = {-0.0005, 0, 0.05}, corner[3], aside = 1.3e-4, below = 3e-4;
        turn(&leaning, 0, 1, 0, -lean);
        apply(leaning.R, up, corner);
        leaning.x[0] = half + aside - corner[0];
        leaning.x[2] = -0.0005 - below - corner[2];
        turn(&leaning, 1, 0, 0, tilts[k]);
        struct world_manifold m = touch(&lying, &leaning, 4e-4, 0);
        ck_assert_int_eq(m.count, 2);
        for (int i = 0; i < 2; ++i) {
            ck_assert_double_eq_tol(fabs(m.position[i][1]), half, 1e-9);
            ck_assert_double_eq_tol(m.separation[i], hypot(aside, below), 1e-9); /* turned by 1e-9 on 0.03 m */
        }
        ck_assert_double_lt(m.position[0][1] * m.position[1][1], 0);
        ck_assert_uint_ne(m.feature[0], m.feature[1]);
    }
}
END_TEST

/* Boxes apart with corners nearest: the closest points, along the shortest way. */
START_TEST(corners_apart_meet_by_their_closest_points)
{
    const double h = 0.05;
    struct solid a = box_at(h, h, h, 0, 0, 0);
    const double separations[][3] = {{1e-3, 2e-3, 3e-3}, {1e-3, 1e-3, 1e-3}, {5e-3, 1e-4, 1e-4}};
    for (size_t i = 0; i < 3; ++i) {
        struct solid b = box_at(h, h, h, 2 * h + separations[i][0], 2 * h + separations[i][1],
                                2 * h + separations[i][2]);
        double distance = sqrt(dot3(separations[i], separations[i]));
        struct world_manifold m = touch(&a, &b, distance * 1.0001, 0);
        ck_assert_int_eq(touch(&a, &b, distance * 0.9999, 0).count, 0);
        ck_assert_int_eq(m.count, 1);
        ck_assert_double_eq_tol(m.separation[0], distance, 1e-12);
        for (int k = 0; k < 3; ++k) {
            ck_assert_double_eq_tol(m.normal[k], separations[i][k] / distance, 1e-9);
            ck_assert_double_eq_tol(m.position[0][k], h + separations[i][k] / 2, 1e-12);
        }
    }
    /* parallel edges apart: both ends */
    struct solid b = box_at(h, h, h, 2 * h + 1e-3, 0, 2 * h + 2e-3);
    struct world_manifold m = touch(&a, &b, 3e-3, 0);
    ck_assert_int_eq(m.count, 2);
    for (int i = 0; i < 2; ++i) {
        ck_assert_double_eq_tol(m.separation[i], sqrt(5e-6), 1e-12);
        ck_assert_double_eq_tol(fabs(m.position[i][1]), h, 1e-12);
    }
}
END_TEST

/* ---- thin boxes: cards ------------------------------------------------------------------------------------------- */

static struct solid card_at(double x, double y, double z) { return box_at(0.05, 0.03, 0.0005, x, y, z); }

/* A card stands by its long edge on a lying card, leaning by any angle: two points (four upright), at the edge, with
 * the edge's depth: not the card's thickness, and not its width. */
START_TEST(a_leaning_card_stands_on_its_edge)
{
    const double depth = 2e-5;
    for (int degrees = 0; degrees <= 80; degrees += 4) {
        struct solid ground = card_at(0, 0, -0.0005), card = card_at(0, 0, 0);
        double angle = degrees * pi / 180, lowest;
        turn(&card, 1, 0, 0, pi / 2 - angle); /* width upwards, leaning */
        lowest = shadow(&card, (double[]){0, 0, 1});
        card.x[2] = lowest - depth;
        struct world_manifold m = touch(&ground, &card, 2e-5, 0);
        ck_assert_int_eq(m.count, degrees == 0 ? 4 : 2);
        ck_assert_double_gt(m.normal[2], 1 - 1e-12);
        for (int i = 0; i < m.count; ++i) {
            ck_assert_double_eq_tol(m.separation[i], -depth, 1e-12);
            ck_assert_double_eq_tol(fabs(m.position[i][0]), 0.05, 1e-12);
        }
    }
}
END_TEST

/* Two cards cross face to face, the upper one pressed into the lower: the depth is what it is, whatever the turn. */
START_TEST(depth_of_stacked_cards_is_not_spurious)
{
    for (int degrees = 0; degrees < 180; degrees += 7)
        for (double depth = 1e-6; depth < 0.9e-3; depth *= 2.3) {
            struct solid a = card_at(0, 0, 0), b = card_at(0.004, 0.003, 0.001 - depth);
            turn(&b, 0, 0, 1, degrees * pi / 180);
            struct world_manifold m = touch(&a, &b, 2e-5, depth > 0.5e-3 ? touch(&a, &b, 2e-5, 0).cache : 0);
            ck_assert_int_ge(m.count, 4);
            ck_assert_double_gt(m.normal[2], 1 - 1e-12);
            for (int i = 0; i < m.count; ++i) ck_assert_double_eq_tol(m.separation[i], -depth, 1e-12);
        }
}
END_TEST

/* Past the midplane the cached side is kept, so the card is pushed back to where it came from. Without history the
 * nearer side is the only sensible answer. */
START_TEST(a_card_past_the_midplane_goes_back)
{
    struct solid a = card_at(0, 0, 0), b = card_at(0.01, 0.005, 0.0012);
    uint32_t cache = 0;
    turn(&b, 0, 0, 1, 0.4);
    turn(&b, 1, 0.3, 0, 1e-3);
    for (double z = 1.1e-3; z > -0.6e-3; z -= 5e-5) {
        b.x[2] = z;
        struct world_manifold m = touch(&a, &b, 2e-4, cache);
        ck_assert_int_ge(m.count, 1);
        ck_assert_double_gt(m.normal[2], 0.99);
        /* the tilt lowers or lifts ends by 1e-3 x 0.05 */
        ck_assert_double_eq_tol(least_separation(&m), z - 1e-3, 1.2e-4);
        cache = m.cache;
    }
    b.x[2] = -0.4e-3;
    ck_assert_double_lt(touch(&a, &b, 2e-4, 0).normal[2], -0.99);
    /* once apart on the other side there is nothing to go back to */
    b.x[2] = -1.3e-3;
    ck_assert_int_eq(touch(&a, &b, 2e-5, cache).count, 0);

    struct solid ball = solid_at(SADMM_SHAPE_SPHERE, 0.005, 0, 0, 0, 0, 0);
    struct solid pill = solid_at(SADMM_SHAPE_CAPSULE, 0.005, 0.01, 0, 0, 0, 0);
    turn(&pill, 0, 1, 0, pi / 2);
    const struct solid *round[] = {&ball, &pill};
    for (int i = 0; i < 2; ++i) {
        struct solid s = *round[i];
        cache = 0;
        for (double z = 5.6e-3; z > -4e-3; z -= 1e-4) {
            s.x[2] = z;
            struct world_manifold m = touch(&a, &s, 2e-4, cache);
            ck_assert_int_ge(m.count, 1);
            ck_assert_double_gt(m.normal[2], 0.99);
            if (z > -0.5e-3) ck_assert_double_eq_tol(least_separation(&m), z - 5.5e-3, 1e-12);
            cache = m.cache;
            if (z < -0.4e-3) break; /* the centre leaves the card: from there on it is on the other side */
        }
    }
}
END_TEST

/* Apex of two cards leaning on each other: their inner faces are equally good axes and 40 degrees apart. Over a
 * thousand steps of 1 um jitter the normal must not jump, and both ends of the line must stay, with their ids. */
START_TEST(the_apex_of_two_cards_keeps_its_normal)
{
    const double lean = 20 * pi / 180, l = 0.05, t = 0.0005;
    struct random r = {31};
    uint32_t cache = 0;
    double before[3] = {0, 0, 0};
    uint32_t ids[2] = {0, 0};
    int flips_without_cache = 0;
    double previous_fresh[3] = {0, 0, 0};
    for (int step = 0; step < 1000; ++step) {
        struct solid a = box_at(t, 0.03, l, 0, 0, 0), b = a;
        turn(&a, 0, 1, 0, lean);
        turn(&b, 0, 1, 0, -lean);
        /* inner top edges meet at the origin with an overlap of 5 um */
        double edge_x = t * cos(lean) + l * sin(lean), edge_z = -t * sin(lean) + l * cos(lean);
        a.x[0] = -edge_x + 2.5e-6;
        b.x[0] = edge_x - 2.5e-6;
        a.x[2] = b.x[2] = -edge_z;
        for (int k = 0; k < 3; ++k) {
            a.x[k] += random_in(&r, -1e-6, 1e-6);
            b.x[k] += random_in(&r, -1e-6, 1e-6);
        }
        turn(&b, random_in(&r, -1, 1), random_in(&r, -1, 1), random_in(&r, -1, 1) + 2, random_in(&r, -1e-5, 1e-5));
        struct world_manifold m = touch(&a, &b, 2e-5, cache), fresh = touch(&a, &b, 2e-5, 0);
        cache = m.cache;
        ck_assert_int_eq(m.count, 2);
        ck_assert_double_gt(fabs(m.position[0][1] - m.position[1][1]), 0.0599);
        if (step > 0) {
            ck_assert_double_gt(dot3(m.normal, before), cos(1e-3));
            ck_assert((m.feature[0] == ids[0] && m.feature[1] == ids[1]) ||
                      (m.feature[1] == ids[0] && m.feature[0] == ids[1]));
            flips_without_cache += dot3(fresh.normal, previous_fresh) < cos(8 * pi / 180);
        }
        memcpy(before, m.normal, sizeof before);
        memcpy(previous_fresh, fresh.normal, sizeof before);
        memcpy(ids, m.feature, sizeof ids);
    }
    /* the case is the one hysteresis is for */
    ck_assert_int_gt(flips_without_cache, 100);
}
END_TEST

/* ---- boxes: symmetries and ids ----------------------------------------------------------------------------------- */

static void expect_same_points(const struct world_manifold *m, const struct world_manifold *n, double tolerance)
{
    ck_assert_int_eq(m->count, n->count);
    for (int i = 0; i < m->count; ++i) {
        bool found = false;
        for (int j = 0; j < n->count && !found; ++j) {
            double d[3];
            for (int k = 0; k < 3; ++k) d[k] = m->position[i][k] - n->position[j][k];
            found = sqrt(dot3(d, d)) < tolerance && fabs(m->separation[i] - n->separation[j]) < tolerance;
        }
        ck_assert_msg(found, "point %d of %d: no partner", i, m->count);
    }
}

START_TEST(swapping_the_two_solids_reverses_the_normal)
{
    struct random r = {4321};
    int contacts = 0;
    for (int n = 0; n < 4000; ++n) {
        struct solid a = random_box(&r), b = random_box(&r);
        double d[3];
        spread_direction(n, 4000, d);
        double reach = (shadow(&a, d) + shadow(&b, d)) * random_in(&r, 0.5, 1.05);
        for (int k = 0; k < 3; ++k) b.x[k] = d[k] * reach;
        struct world_manifold m = touch(&a, &b, 5e-3, 0), w = touch(&b, &a, 5e-3, 0);
        if (m.count == 0) {
            ck_assert_int_eq(w.count, 0);
            continue;
        }
        ++contacts;
        ck_assert_double_lt(dot3(m.normal, w.normal), -1 + 1e-9);
        double least = least_separation(&m);
        ck_assert_double_eq_tol(least, least_separation(&w), least > 0 ? 0.02 * thinner(&a, &b) : 1e-9);
        /* Closest points of edges: rounding over the sine of their angle, which is at least 1e-3 here. Apart by their
         * corners: the edges of one box are asked, so that line contacts of edges up to 8 degrees apart end
         * differently. */
        if (least <= 0) expect_same_points(&m, &w, 1e-9);
    }
    ck_assert_int_gt(contacts, 1000);
}
END_TEST

START_TEST(a_rigid_motion_carries_the_manifold_along)
{
    struct random r = {8};
    const int types[] = {SADMM_SHAPE_SPHERE, SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX};
    int contacts = 0;
    for (int n = 0; n < 3000; ++n) {
        struct solid a = random_box(&r), b = random_box(&r);
        a.type = types[n % 3];
        b.type = types[n / 3 % 3];
        double d[3], R[9], x[3];
        spread_direction(n, 3000, d);
        double reach = (shadow(&a, d) + shadow(&b, d)) * random_in(&r, 0.5, 1.0);
        for (int k = 0; k < 3; ++k) b.x[k] = d[k] * reach;
        struct solid a2 = a, b2 = b;
        random_rotation(&r, R);
        for (int k = 0; k < 3; ++k) x[k] = random_in(&r, -1, 1);
        move_rigidly(&a2, R, x);
        move_rigidly(&b2, R, x);
        struct world_manifold m = touch(&a, &b, 2e-3, 0), w = touch(&a2, &b2, 2e-3, 0);
        ck_assert_int_eq(m.count, w.count);
        if (m.count == 0) continue;
        ++contacts;
        apply(R, m.normal, m.normal);
        ck_assert_double_gt(dot3(m.normal, w.normal), 1 - 1e-9);
        for (int i = 0; i < m.count; ++i) {
            apply(R, m.position[i], m.position[i]);
            for (int k = 0; k < 3; ++k) m.position[i][k] += x[k];
        }
        expect_same_points(&m, &w, 1e-9);
    }
    ck_assert_int_gt(contacts, 1000);
}
END_TEST

/* Faces that touch face to face: whichever box is the reference, the points have the same ids. */
START_TEST(ids_do_not_depend_on_the_reference)
{
    struct random r = {10};
    for (int n = 0; n < 500; ++n) {
        struct solid a = box_at(0.05, 0.06, 0.07, 0, 0, 0), b = box_at(0.055, 0.045, 0.065, 0, 0, 0.1349);
        b.x[0] = random_in(&r, -0.06, 0.06);
        b.x[1] = random_in(&r, -0.06, 0.06);
        turn(&b, 0, 0, 1, random_in(&r, -pi, pi));
        /* faces of z: cache 3 is that of box 1 (the second solid), 6 that of box 2; the normal from 1 to 2 looks
         * down */
        struct world_manifold m = touch(&a, &b, 1e-3, 3 | BOX_AXIS_NEGATIVE),
                              w = touch(&a, &b, 1e-3, 6 | BOX_AXIS_NEGATIVE);
        ck_assert_uint_ne(m.cache, w.cache);
        ck_assert_int_ge(m.count, 3);
        ck_assert_int_eq(m.count, w.count);
        for (int i = 0; i < m.count; ++i) {
            bool found = false;
            for (int j = 0; j < w.count; ++j)
                if (m.feature[i] == w.feature[j]) {
                    double d[3];
                    for (int k = 0; k < 3; ++k) d[k] = m.position[i][k] - w.position[j][k];
                    /* within the clipping tolerance, 1e-3 of a half extent, either of two near points stands for
                     * both */
                    ck_assert_double_lt(sqrt(dot3(d, d)), 1.5e-3 * 0.07);
                    found = true;
                }
            ck_assert_msg(found, "turn %d: point %d has another id", n, i);
        }
    }
}
END_TEST

/* Resting pairs, jittered by 1 um from step to step with the cache carried along: ids stay. */
START_TEST(ids_survive_jitter)
{
    struct random r = {20};
    struct solid pairs[][2] = {
        {box_at(0.05, 0.05, 0.05, 0, 0, 0), box_at(0.05, 0.05, 0.05, 0, 0, 0.1)},         /* aligned */
        {box_at(0.05, 0.05, 0.05, 0, 0, 0), box_at(0.05, 0.05, 0.05, 0.03, 0.02, 0.1)},   /* shifted */
        {box_at(0.05, 0.05, 0.05, 0, 0, 0), box_at(0.05, 0.05, 0.05, 0, 0, 0.1)},         /* turned by 45 degrees */
        {box_at(0.05, 0.03, 0.0005, 0, 0, 0), box_at(0.05, 0.03, 0.0005, 0, 0, 0)},       /* card on its edge */
        {box_at(0.05, 0.03, 0.0005, 0, 0, 0), box_at(0.05, 0.03, 0.0005, 0, 0, 0.00099)}, /* card on card, crosswise */
        {box_at(0.05, 0.1, 0.05, 0, 0, 0), box_at(0.05, 0.1, 0.05, 0, 0, 0.1 * sqrt(2.0))}, /* crossing ridges */
    };
    turn(&pairs[2][1], 0, 0, 1, pi / 4);
    turn(&pairs[3][1], 1, 0, 0, pi / 2 - 0.3);
    pairs[3][1].x[2] = 0.0005 + shadow(&pairs[3][1], (double[]){0, 0, 1});
    turn(&pairs[4][1], 0, 0, 1, pi / 2);
    turn(&pairs[5][0], 0, 1, 0, pi / 4);
    turn(&pairs[5][1], 0, 1, 0, pi / 4);
    turn(&pairs[5][1], 0, 0, 1, 1.2);
    for (size_t p = 0; p < sizeof pairs / sizeof pairs[0]; ++p) {
        const struct solid a = pairs[p][0];
        double limit = 0.02 * thinner(&a, &pairs[p][1]);
        struct world_manifold m = touch(&a, &pairs[p][1], limit, 0), first = m;
        ck_assert_int_gt(m.count, 0);
        for (int step = 0; step < 300; ++step) {
            struct solid b = pairs[p][1];
            for (int k = 0; k < 3; ++k) b.x[k] += random_in(&r, -1e-6, 1e-6);
            turn(&b, random_in(&r, -1, 1), random_in(&r, -1, 1), random_in(&r, -1, 1), 1e-6);
            m = touch(&a, &b, limit, m.cache);
            ck_assert_int_eq(m.count, first.count);
            for (int i = 0; i < m.count; ++i) {
                bool found = false;
                for (int j = 0; j < m.count; ++j) found = found || m.feature[i] == first.feature[j];
                ck_assert_msg(found, "pair %zu, step %d: id %u is new", p, step, m.feature[i]);
            }
        }
    }
}
END_TEST

/* ---- round shapes and planes ------------------------------------------------------------------------------------- */

START_TEST(spheres_and_capsules_have_the_distance_of_their_cores)
{
    struct random r = {55};
    const int types[][2] = {
        {SADMM_SHAPE_SPHERE, SADMM_SHAPE_SPHERE},   {SADMM_SHAPE_SPHERE, SADMM_SHAPE_CAPSULE},
        {SADMM_SHAPE_CAPSULE, SADMM_SHAPE_CAPSULE}, {SADMM_SHAPE_SPHERE, SADMM_SHAPE_BOX},
        {SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX},
    };
    for (int n = 0; n < 5000; ++n) {
        struct solid a = random_box(&r), b = random_box(&r);
        double d[3];
        a.type = types[n % 5][0];
        b.type = types[n % 5][1];
        spread_direction(n, 5000, d);
        double reach = (shadow(&a, d) + shadow(&b, d)) * random_in(&r, 0.6, 1.1);
        for (int k = 0; k < 3; ++k) b.x[k] = d[k] * reach;
        double distance = distance_by_projection(&a, &b, 3000);
        double radii = a.size[0] + (b.type == SADMM_SHAPE_BOX ? 0 : b.size[0]);
        if (distance < -0.95 * radii) continue; /* cores meet: other tests */
        struct world_manifold m = touch(&a, &b, distance + 1e-5, 0),
                              none = touch(&a, &b, distance - 1e-5 * (1 + radii), 0);
        ck_assert_msg(m.count > 0, "pair %d: %g apart", n, distance);
        ck_assert_int_eq(none.count, 0);
        /* the projections have converged to 1e-6 of the size except between nearly parallel segments */
        ck_assert_double_eq_tol(least_separation(&m), distance, 1e-5);
        ck_assert_double_eq_tol(separation_along(&a, &b, m.normal), distance, 1e-5);
        for (int i = 0; i < m.count; ++i) {
            ck_assert_double_le(outside(&a, m.position[i]), 0.51 * fabs(m.separation[i]) + 2e-2 * radii);
            ck_assert_double_le(outside(&b, m.position[i]), 0.51 * fabs(m.separation[i]) + 2e-2 * radii);
        }
    }
}
END_TEST

START_TEST(lying_capsules_touch_along_a_line)
{
    const double radius = 0.01, half = 0.04;
    struct solid ground = box_at(0.5, 0.5, 0.5, 0, 0, -0.5),
                 pill = solid_at(SADMM_SHAPE_CAPSULE, radius, half, 0, 0.1, 0.2, 0);
    struct solid plane = solid_at(SADMM_SHAPE_PLANE, 0, 0, 0, 0, 0, 0);
    turn(&pill, 0, 1, 0, pi / 2);
    for (double tilt = 0; tilt < 1e-3; tilt = tilt * 10 + 1e-8)
        for (double z = radius - 5e-4; z < radius + 2e-4; z += 1e-4) {
            struct solid p = pill;
            p.x[2] = z;
            turn(&p, 0, 1, 0, tilt);
            const struct solid *grounds[] = {&ground, &plane};
            for (int g = 0; g < 2; ++g) {
                struct world_manifold m = touch(grounds[g], &p, 5e-4, 0);
                ck_assert_int_eq(m.count, 2);
                for (int i = 0; i < 2; ++i) {
                    double side = m.position[i][0] > 0.1 ? 1 : -1;
                    ck_assert_double_eq_tol(m.position[i][0], 0.1 + side * half * cos(tilt), 1e-9);
                    ck_assert_double_eq_tol(m.separation[i], z - side * half * sin(tilt) - radius, 1e-9);
                    ck_assert_double_eq_tol(m.normal[2], 1, 1e-6);
                }
            }
        }
    /* overhanging: the box's edge ends the line */
    struct solid p = pill;
    p.x[0] = 0.49;
    p.x[2] = radius;
    struct world_manifold m = touch(&ground, &p, 1e-4, 0);
    ck_assert_int_eq(m.count, 2);
    ck_assert_double_eq_tol(fmax(m.position[0][0], m.position[1][0]), 0.5, 1e-9);
    /* lying along an edge of the box, 45 degrees off its faces */
    p.x[0] = 0;
    p.x[1] = 0.5 + radius / sqrt(2.0) - 1e-5;
    p.x[2] = radius / sqrt(2.0) - 1e-5;
    m = touch(&ground, &p, 1e-4, 0);
    ck_assert_int_eq(m.count, 2);
    ck_assert_double_eq_tol(m.normal[1], sqrt(0.5), 1e-9);
    /* two capsules side by side, and one across another */
    struct solid q = pill;
    p = pill;
    q.x[0] += 0.02;
    q.x[2] = 2 * radius;
    m = touch(&p, &q, 1e-4, 0);
    ck_assert_int_eq(m.count, 2);
    for (int i = 0; i < 2; ++i) {
        ck_assert_double_eq_tol(m.separation[i], 0, 1e-12);
        ck_assert_double_eq_tol(m.position[i][2], radius, 1e-12);
    }
    ck_assert_double_eq_tol(fabs(m.position[0][0] - m.position[1][0]), 2 * half - 0.02, 1e-9);
    turn(&q, 0, 0, 1, pi / 2);
    m = touch(&p, &q, 1e-4, 0);
    ck_assert_int_eq(m.count, 1);
    ck_assert_double_eq_tol(m.normal[2], 1, 1e-12);
}
END_TEST

/* Capsules whose axes pass through each other: the side seen before is kept. */
START_TEST(crossing_capsules_keep_their_side)
{
    struct solid a = solid_at(SADMM_SHAPE_CAPSULE, 0.01, 0.05, 0, 0, 0, 0), b = a;
    uint32_t cache = 0;
    turn(&a, 0, 1, 0, pi / 2);
    turn(&b, 1, 0, 0, pi / 2);
    for (double z = 0.02; z > -0.009; z -= 1e-3) {
        b.x[2] = z;
        struct world_manifold m = touch(&a, &b, 1e-3, cache);
        ck_assert_int_eq(m.count, 1);
        ck_assert_double_gt(m.normal[2], 0.999);
        ck_assert_double_eq_tol(m.separation[0], z - 0.02, 1e-12);
        cache = m.cache;
    }
    /* nearly parallel: whatever stands for the line, the deepest point is as deep as the crossing (1e-4 of the
     * radii) */
    for (double angle = 1e-6; angle < 0.3; angle *= 1.5) {
        struct solid c = a;
        turn(&c, 0, 0, 1, angle);
        c.x[2] = 0.0199;
        struct world_manifold m = touch(&a, &c, 1e-3, 0);
        ck_assert_int_ge(m.count, angle < 0.05 ? 2 : 1);
        ck_assert_double_eq_tol(least_separation(&m), -1e-4, 2.1e-6);
    }
}
END_TEST

START_TEST(a_ball_meets_face_edge_corner_and_inside_of_a_box)
{
    const double h = 0.05, radius = 0.02;
    struct solid box = box_at(h, h, h, 0, 0, 0), ball = solid_at(SADMM_SHAPE_SPHERE, radius, 0, 0, 0, 0, 0);
    struct world_manifold m;
    for (int axes = 1; axes <= 3; ++axes) {
        double separation = 1e-3, d = (radius + separation) / sqrt(axes);
        for (int k = 0; k < 3; ++k) ball.x[k] = k < axes ? h + d : 0.01;
        m = touch(&box, &ball, 2e-3, 0);
        ck_assert_int_eq(m.count, 1);
        ck_assert_double_eq_tol(m.separation[0], separation, 1e-12);
        for (int k = 0; k < axes; ++k) {
            ck_assert_double_eq_tol(m.normal[k], 1 / sqrt(axes), 1e-12);
            ck_assert_double_eq_tol(m.position[0][k], h + 0.5 * separation / sqrt(axes), 1e-12);
        }
        ck_assert_int_eq(touch(&box, &ball, 0.9e-3, 0).count, 0);
    }
    ball.x[0] = 0.01;
    ball.x[1] = 0.04;
    ball.x[2] = -0.02;
    m = touch(&box, &ball, 0, 0);
    ck_assert_double_eq_tol(m.separation[0], -0.01 - radius, 1e-12);
    ck_assert_double_eq_tol(m.normal[1], 1, 1e-12);
}
END_TEST

START_TEST(every_vertex_near_a_plane_is_a_point)
{
    struct random r = {60};
    for (int n = 0; n < 500; ++n) {
        struct solid plane = solid_at(SADMM_SHAPE_PLANE, 0, 0, 0, 1e3, -2e3, 5e2), box = random_box(&r);
        double up[3], limit = 1e-3, height = random_in(&r, -1.2, 1.0);
        random_rotation(&r, plane.R);
        for (int k = 0; k < 3; ++k) up[k] = plane.R[3 * k + 2];
        height *= shadow(&box, up);
        for (int k = 0; k < 3; ++k)
            box.x[k] = plane.x[k] + 50 * plane.R[3 * k] - 70 * plane.R[3 * k + 1] + height * up[k];
        struct world_manifold m = touch(&plane, &box, limit, 0);
        int expected = 0;
        for (int v = 0; v < 8; ++v) {
            double local[3], p[3];
            for (int k = 0; k < 3; ++k) local[k] = v >> k & 1 ? box.size[k] : -box.size[k];
            apply(box.R, local, p);
            double s = height + dot3(p, up);
            if (fabs(s - limit) < 1e-9) expected = -100; /* too near to call: coordinates of 1e3 round at 1e-13 */
            if (s > limit) continue;
            ++expected;
            for (int i = 0; i < m.count; ++i)
                if (m.feature[i] == (uint32_t)v + 1) ck_assert_double_eq_tol(m.separation[i], s, 1e-11);
        }
        if (expected >= 0) ck_assert_int_eq(m.count, expected);
        if (m.count) ck_assert_double_gt(dot3(m.normal, up), 1 - 1e-12);
    }
    /* wholly below: all eight, as deep as they are */
    struct solid plane = solid_at(SADMM_SHAPE_PLANE, 0, 0, 0, 0, 0, 0), box = box_at(0.05, 0.05, 0.05, 0, 0, -1);
    ck_assert_int_eq(touch(&plane, &box, 0, 0).count, 8);
}
END_TEST

/* ---- single precision -------------------------------------------------------------------------------------------- */

void manifold_in_float(int type_a, const double size_a[3], int type_b, const double size_b[3], const double Ra[9],
                       const double xa[3], const double Rb[9], const double xb[3], double limit, uint32_t cache,
                       struct world_manifold *out);

/* The same formulas in float, as the GPU may run them: the same contacts to float's accuracy, also a kilometre from the
 * origin, because differences are taken in double. */
START_TEST(float_gives_the_same_contacts)
{
    struct random r = {70};
    const int types[] = {SADMM_SHAPE_SPHERE, SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX};
    const double offset[3] = {1000, -2000, 500}, identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    int contacts = 0, other_choice = 0;
    for (int n = 0; n < 6000; ++n) {
        struct solid a = random_box(&r), b = random_box(&r);
        struct world_manifold m, f;
        double d[3];
        a.type = types[n % 3];
        b.type = types[n / 3 % 3];
        if (a.type > b.type) b.type = a.type;
        spread_direction(n, 6000, d);
        double size = shadow(&a, d) + shadow(&b, d), reach = size * random_in(&r, 0.6, 1.0);
        for (int k = 0; k < 3; ++k) b.x[k] = d[k] * reach;
        move_rigidly(&a, identity, offset);
        move_rigidly(&b, identity, offset);
        m = touch(&a, &b, 1e-3, 0);
        manifold_in_float(a.type, a.size, b.type, b.size, a.R, a.x, b.R, b.x, 1e-3, 0, &f);
        if (box_separation(&a, &b, NULL) <= 0 && a.type == SADMM_SHAPE_BOX) ck_assert_int_gt(f.count, 0);
        if (m.count == 0 || f.count == 0) continue;
        ++contacts;
        if (dot3(m.normal, f.normal) < 1 - 1e-4 || m.count != f.count) {
            ++other_choice; /* two axes equally good, a point at the limit */
            continue;
        }
        /* float: 1e-7 of a size of 0.3, over the sine of the angle of edges */
        ck_assert_double_eq_tol(least_separation(&m), least_separation(&f), 2e-5);
    }
    ck_assert_int_gt(contacts, 2000);
    ck_assert_int_lt(other_choice, contacts / 50);
}
END_TEST

/* The table is complete but for planes and meshes, which meet neither each other nor themselves; what is not listed has
 * no contacts. */
START_TEST(every_pair_of_types_is_listed)
{
    const double size[3] = {0.5, 0.5, 0.5};
    struct test_shape_data *shape_data = test_shape_data_new();
    struct test_hull cube;
    box_hull(size, &cube);
    const uint32_t hull = test_shape_data_add(shape_data, &cube).hull;
    struct soup *s = soup_ground(2, 2, 4, 0, 1, soup_flat);
    sadmm_mesh *mesh = soup_mesh(s);
    const uint32_t ground = (uint32_t)shape_data->used;
    ck_assert_uint_le(shape_data->used + mesh->doubles, TEST_SHAPE_DATA);
    memcpy(shape_data->numbers + ground, mesh->block, mesh->doubles * sizeof *mesh->block);
    for (int low = -1; low <= 2 * SADMM_SHAPE_TYPE_COUNT; ++low)
        for (int high = low; high <= 2 * SADMM_SHAPE_TYPE_COUNT; ++high) {
            const bool known = low >= 0 && high < SADMM_SHAPE_TYPE_COUNT,
                       swapped = known && geometry_rank(low) > geometry_rank(high); /* a mesh comes last */
            const int a = swapped ? high : low, b = swapped ? low : high;
            const bool listed = known && a != SADMM_SHAPE_MESH &&
                                !(a == SADMM_SHAPE_PLANE && (b == SADMM_SHAPE_PLANE || b == SADMM_SHAPE_MESH));
            struct sadmm_geometry a_is = geometry_of(a, size), b_is = geometry_of(b, size);
            const struct pair_pose pose = {.R = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                           .t = {0.1, 0.1, 0.1}}; /* one in the other */
            struct manifold m;
            memset(&m, 0x55, sizeof m);
            a_is.hull = a == SADMM_SHAPE_MESH ? ground : hull;
            b_is.hull = b == SADMM_SHAPE_MESH ? ground : hull;
            pair_manifold(&a_is, &b_is, shape_data->numbers, 0, &pose, 0, 0, &m);
            if (b == SADMM_SHAPE_MESH) { /* by itself */
                ck_assert_int_eq(m.count, 0);
                if (listed) mesh_manifold(&a_is, &b_is, shape_data->numbers, 0, &pose, 0, 0, &m);
            }
            ck_assert_msg((m.count > 0) == listed, "types %d and %d: %d points", a, b, m.count);
            ck_assert_msg(pair_is_listed(a, b) == listed && pair_is_listed(b, a) == listed, "types %d and %d", a, b);
        }
    sadmm_mesh_destroy(mesh);
    free(s);
    free(shape_data);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("manifold");
    TCase *boxes = tcase_create("boxes"), *cards = tcase_create("cards"),
          *rest = tcase_create("round shapes and planes");
    SRunner *runner;
    int failed;

    tcase_set_timeout(boxes, 100);
    tcase_add_test(boxes, every_pair_of_types_is_listed);
    tcase_add_test(boxes, box_depth_and_normal_are_those_of_the_sweep);
    tcase_add_test(boxes, contact_starts_at_the_limit_and_never_ends_below_it);
    tcase_add_test(boxes, overlap_is_never_empty);
    tcase_add_test(boxes, nearly_aligned_boxes_give_four_exact_points);
    tcase_add_test(boxes, turned_boxes_give_the_corners_of_the_overlap);
    tcase_add_test(boxes, a_small_box_on_a_huge_one_keeps_its_corners);
    tcase_add_test(boxes, the_last_resort_is_the_deepest_vertex);
    tcase_add_test(boxes, concentric_boxes);
    tcase_add_test(boxes, crossing_ridges);
    tcase_add_test(boxes, nearly_parallel_edges_touch_along_a_line);
    tcase_add_test(boxes, corners_apart_meet_by_their_closest_points);
    tcase_add_test(boxes, a_corner_over_a_face_has_the_normal_of_the_face);
    tcase_add_test(boxes, edges_side_by_side_touch_at_both_ends);
    tcase_add_test(boxes, swapping_the_two_solids_reverses_the_normal);
    tcase_add_test(boxes, a_rigid_motion_carries_the_manifold_along);
    tcase_add_test(boxes, ids_do_not_depend_on_the_reference);
    tcase_add_test(boxes, ids_survive_jitter);
    suite_add_tcase(suite, boxes);
    tcase_add_test(cards, a_leaning_card_stands_on_its_edge);
    tcase_add_test(cards, depth_of_stacked_cards_is_not_spurious);
    tcase_add_test(cards, a_card_past_the_midplane_goes_back);
    tcase_add_test(cards, the_apex_of_two_cards_keeps_its_normal);
    suite_add_tcase(suite, cards);
    tcase_add_test(rest, spheres_and_capsules_have_the_distance_of_their_cores);
    tcase_add_test(rest, lying_capsules_touch_along_a_line);
    tcase_add_test(rest, crossing_capsules_keep_their_side);
    tcase_add_test(rest, a_ball_meets_face_edge_corner_and_inside_of_a_box);
    tcase_add_test(rest, every_vertex_near_a_plane_is_a_point);
    tcase_add_test(rest, float_gives_the_same_contacts);
    suite_add_tcase(suite, rest);

    runner = srunner_create(suite);
    srunner_run_all(runner, CK_NORMAL);
    failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
