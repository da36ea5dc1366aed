/* Edges that cross with faces beside them which are nearly parallel: the contact has the points where the faces may
 * come together, too, or the boxes turn into each other within a step. */
#include <float.h>

#include "manifold_tools.h"
#include "run_suite.h"

/* Points within a thousandth of the half extent of a rim count as on it (MANIFOLD_SNAP); what that changes of a
 * separation, by both snaps and slopes of up to 0.3 between the faces, m. */
#define SNAP 1e-3
#define SNAPPED 5e-4

/* Two unit plates, corner over corner, the upper one rolled and pitched a little: edges cross, and by the axis of
 * these edges the plates are nearest. */
static void crossed_plates(struct random *r, double lean, struct solid *a, struct solid *b)
{
    *a = box_at(0.5, 0.5, 0.1, 0, 0, 0);
    *b = box_at(0.5, 0.5, 0.1, random_in(r, -0.6, 0.6), random_in(r, -0.6, 0.6), 0);
    turn(b, 0, 0, 1, random_in(r, -1.5, 1.5));
    turn(a, random_in(r, -1, 1), random_in(r, -1, 1), 0.01, lean);
    turn(b, random_in(r, -1, 1), random_in(r, -1, 1), 0.01, lean);
    b->x[2] = 0.2;
}

/* The axis of a pair of edges, not of a face? */
static bool is_edge_axis(uint32_t cache) { return (cache & 15u) > 6; }

/* Coordinate interval of p + s n inside a box; false: none. */
static bool line_in_box(const struct solid *box, const double p[3], const double n[3], double *from, double *to)
{
    *from = -HUGE_VAL;
    *to = HUGE_VAL;
    for (int k = 0; k < 3; ++k) {
        double at = 0, along = 0, lo, hi;
        for (int j = 0; j < 3; ++j) {
            at += box->R[3 * j + k] * (p[j] - box->x[j]);
            along += box->R[3 * j + k] * n[j];
        }
        if (along == 0) {
            if (fabs(at) > box->size[k]) return false;
            continue;
        }
        lo = (-copysign(box->size[k], along) - at) / along;
        hi = (copysign(box->size[k], along) - at) / along;
        if (lo > *from) *from = lo;
        if (hi < *to) *to = hi;
    }
    return *from <= *to;
}

/* Does the line p + s n cross the surface of the box at s by a face that points along n? */
static bool by_a_face_along(const struct solid *box, const double p[3], const double n[3], double s)
{
    double farthest = 0, along = 0;
    for (int k = 0; k < 3; ++k) {
        const double axis[3] = {box->R[k], box->R[3 + k], box->R[6 + k]};
        double at = 0;
        for (int j = 0; j < 3; ++j) at += axis[j] * (p[j] + s * n[j] - box->x[j]);
        if (fabs(at) / box->size[k] < farthest) continue;
        farthest = fabs(at) / box->size[k];
        along = fabs(dot3(axis, n));
    }
    return along > 0.5;
}

/* The separation at a point of the manifold is the one that the two boxes have on the line along the normal through
 * it. */
START_TEST(points_are_on_both_surfaces)
{
    struct random r = {UINT64_C(0x243F6A8885A308D3)};
    int edges = 0, completed = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        struct solid a, b;
        struct world_manifold m;
        crossed_plates(&r, random_in(&r, 0.005, 0.1), &a, &b);
        m = touch(&a, &b, 0.05, 0);
        if (m.count == 0 || !is_edge_axis(m.cache)) continue;
        ++edges;
        completed += m.count > 1;
        for (int i = 0; i < m.count; ++i) {
            /* a little towards the middle of what all points span: clipping snaps to a rim within SNAP */
            double p[3] = {0, 0, 0}, a0, a1, b0, b1;
            for (int j = 0; j < m.count; ++j)
                for (int k = 0; k < 3; ++k) p[k] += m.position[j][k] / m.count;
            for (int k = 0; k < 3; ++k) p[k] = m.position[i][k] + SNAP * (p[k] - m.position[i][k]);
            if (!line_in_box(&a, p, m.normal, &a0, &a1) || !line_in_box(&b, p, m.normal, &b0, &b1)) continue;
            if (!by_a_face_along(&a, p, m.normal, a1) || !by_a_face_along(&b, p, m.normal, b0))
                continue; /* by a side */
            ck_assert_double_eq_tol(b0 - a1, m.separation[i], SNAPPED);
        }
        for (int i = 0; i < m.count; ++i) {
            double half = 0.5 * fabs(m.separation[i]) + SNAPPED;
            ck_assert_double_le(m.separation[i], 0.05 + 1e-12);
            ck_assert_double_le(outside(&a, m.position[i]), half);
            ck_assert_double_le(outside(&b, m.position[i]), half);
            for (int j = 0; j < i; ++j) ck_assert_uint_ne(m.feature[i], m.feature[j]);
        }
    }
    ck_assert_int_ge(edges, 100); /* or the plates are not crossed: some 400 are */
    ck_assert_int_ge(completed, 90 * edges / 100);
}
END_TEST

/* A vertex of one box faces the other where the line along the normal leaves, or enters, its own box there, and the
 * other by a face of that direction. */
static bool faces(const struct solid *own, const struct solid *other, const double p[3], const double n[3], bool below,
                  double *separation)
{
    double own0, own1, other0, other1;
    if (!line_in_box(own, p, n, &own0, &own1) || !line_in_box(other, p, n, &other0, &other1)) return false;
    *separation = below ? other0 - own1 : own0 - other1;
    return fabs(below ? own1 : own0) < 1e-6 && by_a_face_along(other, p, n, below ? other0 : other1);
}

/* Every corner within reach of the other box's face is a point, but for those next to its rim (clipping snaps them). */
START_TEST(corners_in_reach_are_points)
{
    struct random r = {UINT64_C(0x13198A2E03707344)};
    const double limit = 0.05;
    int corners = 0;
    for (int trial = 0; trial < 4000; ++trial) {
        struct solid pair[2];
        struct world_manifold m;
        crossed_plates(&r, random_in(&r, 0.005, 0.1), &pair[0], &pair[1]);
        m = touch(&pair[0], &pair[1], limit, 0);
        if (m.count == 0 || !is_edge_axis(m.cache)) continue;
        for (int vertex = 0; vertex < 16; ++vertex) {
            const struct solid *own = &pair[vertex / 8], *other = &pair[1 - vertex / 8];
            double p[3], separation, nearest = HUGE_VAL;
            for (int k = 0; k < 3; ++k) {
                p[k] = own->x[k];
                for (int j = 0; j < 3; ++j) /* 1e-8 inside, so that rounding does not put it beside the box */
                    p[k] += own->R[3 * k + j] * own->size[j] * (vertex >> j & 1 ? 1 - 1e-8 : 1e-8 - 1);
            }
            if (!faces(own, other, p, m.normal, own == &pair[0], &separation) || separation > limit - 1e-6) continue;
            ++corners;
            for (int i = 0; i < m.count; ++i) {
                double d[3], along;
                for (int k = 0; k < 3; ++k) d[k] = m.position[i][k] - p[k];
                along = dot3(d, m.normal);
                nearest = fmin(nearest, sqrt(fmax(0, dot3(d, d) - along * along)));
            }
            ck_assert_double_le(nearest, SNAP * M_SQRT2); /* along two sides */
        }
    }
    ck_assert_int_ge(corners, 500); /* or nothing is asked: some 1,500 are */
}
END_TEST

/* The other points come and go with the limit, not the crossing. */
START_TEST(out_of_reach_the_crossing_is_alone)
{
    struct solid a = box_at(0.5, 0.5, 0.5, 0, 0, 0), b = a;
    struct world_manifold m;
    /* a cube on its edge over another's edge: the faces fall away at 45 degrees */
    turn(&a, 0, 1, 0, M_PI / 4);
    turn(&b, 1, 0, 0, M_PI / 4);
    b.x[2] = M_SQRT2 - 0.001;
    m = touch(&a, &b, 0.01, 0);
    ck_assert_int_eq(m.count, 1);
    ck_assert_double_eq_tol(m.separation[0], -0.001, 1e-12);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("manifold clip");
    TCase *tests = tcase_create("edges with faces beside them");
    tcase_add_test(tests, points_are_on_both_surfaces);
    tcase_add_test(tests, corners_in_reach_are_points);
    tcase_add_test(tests, out_of_reach_the_crossing_is_alone);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
