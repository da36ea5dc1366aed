/* Articulations that are trees (core/solve/articulation_tree.h): random ones, held to the laws that they solve. */
#include <check.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/math/joint.h"
#include "core/model/system_math.h"
#include "core/solve/articulation.h"
#include "core/solve/articulation_part.h"
#include "fixed_work.h"
#include "run_suite.h"
#include "subadmm/settings.h"

enum { MOST_BODIES = 16 };

/* ---- random numbers ---------------------------------------------------------------------------------------------- */

static uint64_t state;

static double uniform(double lo, double hi)
{
    state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return lo + (hi - lo) * (double)(state >> 11) / 9007199254740992.0;
}
static int below(int count) { return (int)uniform(0, count); }
static vec3 direction(void)
{
    for (;;) {
        const vec3 v = v3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
        const double size = v3_norm(v);
        if (size > 0.1 && size < 1) return v3_scale(v, 1 / size);
    }
}
static quat orientation(void)
{
    const vec3 axis = direction();
    const double half = uniform(0, 3);
    quat q;
    q.w = cos(half), q.x = sin(half) * axis.x, q.y = sin(half) * axis.y, q.z = sin(half) * axis.z;
    return q;
}

/* ---- a tree ------------------------------------------------------------------------------------------------------ */

struct tree {
    int bodies;
    struct sadmm_rigid rigid[MOST_BODIES];
    double velocity[6 * MOST_BODIES], start[6 * MOST_BODIES];
    struct sadmm_rows rows;
    struct sadmm_contact_set contacts;
    struct sadmm_system system;
    sadmm_settings settings;
    struct sadmm_articulations *articulations;
};

/* Masses over two decades either way. */
static void make_body(struct sadmm_rigid *body)
{
    const double mass = pow(10, uniform(-2, 2)), size = uniform(0.05, 0.3);
    const quat q = orientation();
    memset(body, 0, sizeof *body);
    for (int k = 0; k < 3; ++k) {
        body->position[k] = uniform(-1, 1);
        body->inertia[k] = mass * size * size * uniform(0.6, 1);
    }
    q_store(q, body->orientation);
    for (int k = 0; k < 6; ++k) body->velocity[k] = uniform(-1, 1), body->wrench[k] = uniform(-10, 10);
    body->mass = mass;
    body->gravity_scale = 1;
}

/* Which coordinates are locked: of most kinds of joints; two rotations' axes need not be perpendicular to a third. */
static uint32_t random_locks(void)
{
    static const uint32_t locks[] = {63, 7 | 24, 7 | 48, 7, 63 ^ 1, 63 ^ 4, 63 ^ 33, 7 | 8, 28, 56, 1, 3, 8, 0};
    return locks[below(sizeof locks / sizeof *locks)];
}

static int32_t add_rows(struct sadmm_rows *rows, int count, int a, int b, vec3 offset)
{
    const double from[3] = {offset.x, offset.y, offset.z};
    const int32_t first = sadmm_rows_add(rows, count, a, b);
    sadmm_rows_set_rigid(rows, from);
    return first;
}

/* A row of coordinate k, of axes n, at a point. */
static void put_row(struct tree *t, int32_t r, int a, int b, vec3 point, int k, const vec3 axis[6])
{
    for (int s = 0; s < 2; ++s) {
        const int body = s ? b : a;
        double *row = (s ? t->rows.jacobian_b : t->rows.jacobian_a) + 6 * r;
        const double sign = s ? 1 : -1;
        if (body < 0) continue;
        const vec3 arm = v3_sub(point, v3_load(t->rigid[body].position));
        v3_store(k < 3 ? v3_scale(axis[k], sign) : v3(0, 0, 0), row);
        v3_store(v3_scale(k < 3 ? v3_cross(arm, axis[k]) : axis[k], sign), row + 3);
    }
}

/* Laws along a free coordinate: a spring, a limit, a motor, friction, or several. */
static int random_laws(int32_t r, struct sadmm_rows *rows, int most)
{
    int count = 0;
    for (int kind = 0; kind < 4 && count < most; ++kind) {
        if (below(3)) continue;
        const int32_t at = r + count++;
        if (kind == 0) sadmm_row_soft(rows, at, pow(10, uniform(-1, 4)), pow(10, uniform(-2, 1)), uniform(-0.01, 0.01));
        if (kind == 1) sadmm_row_limit(rows, at, uniform(-0.5, 0.5));
        if (kind == 2) sadmm_row_motor(rows, at, uniform(-1, 1), pow(10, uniform(-3, 1)));
        if (kind == 3) sadmm_row_motor(rows, at, 0, pow(10, uniform(-3, 0)));
        rows->lambda[at] = below(2) ? 0 : uniform(0, 0.1);
    }
    return count;
}

static void make_joint(struct tree *t, int a, int b)
{
    const mat3 frame = q_matrix(orientation());
    const uint32_t locks = random_locks();
    vec3 axis[6], point = v3_load(t->rigid[b].position), other = a >= 0 ? v3_load(t->rigid[a].position) : v3(0, 0, 0);
    const vec3 offset = v3_sub(point, other);
    int locked = 0;
    point = v3_add(point, v3_scale(direction(), uniform(0, 0.5)));
    for (int k = 0; k < 6; ++k) axis[k] = m3_column(frame, k % 3);
    if ((locks >> 3) == 1) axis[4] = v3_cross(axis[3], direction()), axis[4] = v3_scale(axis[4], 1 / v3_norm(axis[4]));
    for (int k = 0; k < 6; ++k) locked += locks >> k & 1;
    if (locked > 0) {
        const int32_t first = add_rows(&t->rows, locked, a, b, offset);
        for (int k = 0, i = 0; k < 6; ++k) {
            if (!(locks >> k & 1)) continue;
            put_row(t, first + i, a, b, point, k, axis);
            sadmm_row_hard(&t->rows, first + i, uniform(-0.1, 0.1));
            t->rows.lambda[first + i++] = uniform(-0.1, 0.1);
        }
    }
    for (int k = 0; k < 6; ++k) {
        if (locks >> k & 1) continue;
        const int32_t first = add_rows(&t->rows, 6, a, b, offset);
        struct sadmm_row_constraint *constraint = &t->rows.constraints[t->rows.constraint_count - 1];
        const int count = random_laws(first, &t->rows, 6);
        for (int i = 0; i < count; ++i) put_row(t, first + i, a, b, point, k, axis);
        constraint->count = count;
        t->rows.row_count = (size_t)(first + count);
        if (count == 0) --t->rows.constraint_count;
    }
}

static void make_tree(struct tree *t, uint64_t seed)
{
    memset(t, 0, sizeof *t);
    state = seed * UINT64_C(0x9e3779b97f4a7c15) + 1;
    t->settings = fixed_settings();
    t->settings.ncp_points = 1; /* rows to rounding */
    t->bodies = 2 + below(MOST_BODIES - 1);
    const bool anchored = below(2);
    for (int i = 0; i < t->bodies; ++i) make_body(&t->rigid[i]);
    for (int i = anchored ? 0 : 1; i < t->bodies; ++i)
        if (below(2)) make_joint(t, i > 0 ? below(i) : -1, i);
        else if (i > 0) make_joint(t, i, below(i)); /* the body further from the root is a */
        else make_joint(t, -1, 0);
    for (int k = 0; k < 6 * t->bodies; ++k) t->velocity[k] = t->start[k] = uniform(-1, 1);
    t->system = (struct sadmm_system){.body_count = t->bodies, .rigid = t->rigid, .velocity = t->velocity,
                                      .contacts = &t->contacts, .rows = &t->rows};
    t->articulations = sadmm_articulations_create();
    ck_assert_ptr_nonnull(t->articulations);
}

static void free_tree(struct tree *t)
{
    sadmm_articulations_destroy(t->articulations);
    sadmm_rows_free(&t->rows);
}

static sadmm_status solve(struct tree *t)
{
    struct sadmm_error error = {0};
    sadmm_articulations_begin(t->articulations);
    return sadmm_articulations_solve(t->articulations, &t->system, t->rows.constraints, t->rows.constraint_count,
                                     &t->settings, NULL, false, &error);
}

/* ---- the laws ---------------------------------------------------------------------------------------------------- */

/* The largest velocity that the impulse of a row would give body i, L the factor of its A. */
static double largest_part(const struct tree *t, int i, const double L[36])
{
    double most = 0, v[6];
    for (size_t c = 0; c < t->rows.constraint_count; ++c)
        for (int s = 0; s < 2; ++s) {
            const struct sadmm_row_constraint *constraint = &t->rows.constraints[c];
            if ((s ? constraint->body_b : constraint->body_a) != i) continue;
            for (int32_t r = constraint->first; r < constraint->first + constraint->count; ++r) {
                ldl6_solve(L, (s ? t->rows.jacobian_b : t->rows.jacobian_a) + 6 * r, v);
                for (int k = 0; k < 6; ++k) most = fmax(most, fabs(v[k] * t->rows.lambda[r]));
            }
        }
    return most;
}

/* |A v - b - J^T lambda| of the worst body, as a velocity of it, over the largest velocity that an impulse on it alone
 * would give it. */
static double momentum_error(const struct tree *t)
{
    double most = 0, size = 1;
    for (int i = 0; i < t->bodies; ++i) {
        double A[36], L[36], b[6], owed[6];
        sadmm_system_body(&t->system, &t->settings, i, A, b);
        for (size_t c = 0; c < t->rows.constraint_count; ++c) {
            const struct sadmm_row_constraint *constraint = &t->rows.constraints[c];
            for (int32_t r = constraint->first; r < constraint->first + constraint->count; ++r)
                for (int k = 0; k < 6; ++k)
                    b[k] += t->rows.lambda[r] * ((constraint->body_a == i ? t->rows.jacobian_a[6 * r + k] : 0) +
                                                 (constraint->body_b == i ? t->rows.jacobian_b[6 * r + k] : 0));
        }
        ldl6_factor(A, L);
        ldl6_solve(L, b, owed);
        for (int k = 0; k < 6; ++k) most = fmax(most, fabs(t->velocity[6 * i + k] - owed[k]));
        size = fmax(size, largest_part(t, i, L));
    }
    return most / size;
}

static double rate_of(const struct tree *t, const struct sadmm_row_constraint *constraint, int32_t r)
{
    double x = 0;
    if (constraint->body_a >= 0) x += six_product(t->rows.jacobian_a + 6 * r, t->velocity + 6 * constraint->body_a);
    if (constraint->body_b >= 0) x += six_product(t->rows.jacobian_b + 6 * r, t->velocity + 6 * constraint->body_b);
    return x;
}

/* How far the worst row is from its law, m/s or rad/s: a row inside its bounds has no residual, one at a bound only one
 * that presses it there. */
static double row_error(const struct tree *t)
{
    const struct sadmm_rows *rows = &t->rows;
    double most = 0;
    for (size_t c = 0; c < rows->constraint_count; ++c) {
        const struct sadmm_row_constraint *constraint = &rows->constraints[c];
        for (int32_t r = constraint->first; r < constraint->first + constraint->count; ++r) {
            const double residual = rows->gain[r] * rate_of(t, constraint, r) + rows->bias[r] +
                                    rows->compliance[r] * rows->lambda[r],
                         size = fabs(residual) / fmax(1, rows->gain[r]);
            ck_assert(rows->lambda[r] >= rows->lo[r] && rows->lambda[r] <= rows->hi[r]);
            const double rounding = 1e-12 * (1 + fabs(rows->lambda[r]));
            const bool presses = (rows->lambda[r] <= rows->lo[r] + rounding && residual > 0) ||
                                 (rows->lambda[r] >= rows->hi[r] - rounding && residual < 0);
            if (!presses) most = fmax(most, size);
        }
    }
    return most;
}

/* By its laws: rows that nothing meets give (articulation.c). */
static bool is_solved(const struct tree *t, int32_t part)
{
    return t->articulations->parts[part].kept && !t->articulations->parts[part].gave;
}

/* Rows that say what others say, a limit and friction of a coordinate, may have any of the multipliers that solve. */
START_TEST(random_trees_solve_their_laws)
{
    int solved = 0, trees = 0;
    enum { TREES = 3000 };
    for (uint64_t seed = 1; seed <= TREES; ++seed) {
        static struct tree t;
        make_tree(&t, seed);
        ck_assert_int_eq(solve(&t), SADMM_OK);
        for (int32_t k = 0; k < t.articulations->order.parts; ++k) {
            ck_assert(t.articulations->parts[k].by_tree);
            ++trees;
            solved += is_solved(&t, k);
        }
        bool all = true;
        for (int32_t k = 0; k < t.articulations->order.parts; ++k) all = all && is_solved(&t, k);
        if (all) {
            /* rounding, times the ratio of masses of four decades */
            ck_assert_msg(row_error(&t) < 1e-8, "seed %d: rows are off by %g", (int)seed, row_error(&t));
            bool whole = true; /* bodies without a row are left to the iteration */
            for (int i = 0; i < t.bodies; ++i) whole = whole && t.articulations->part[i] >= 0;
            if (whole)
                ck_assert_msg(momentum_error(&t) < 1e-9, "seed %d: momentum is off by %g", (int)seed,
                              momentum_error(&t));
        }
        free_tree(&t);
    }
    /* The states of rows may go round in circles: these are left to the iteration, which starts where it was. */
    ck_assert_int_ge(solved, trees - trees / 50);
}
END_TEST

/* The sparse factor solves the same equations, with a regularisation of 1e-9 of a row's scale. */
START_TEST(trees_and_the_sparse_factor_agree)
{
    int compared = 0;
    for (uint64_t seed = 1; seed <= 300; ++seed) {
        static struct tree t;
        double by_tree[6 * MOST_BODIES];
        make_tree(&t, seed);
        ck_assert_int_eq(solve(&t), SADMM_OK);
        memcpy(by_tree, t.velocity, sizeof by_tree);
        memcpy(t.velocity, t.start, sizeof t.velocity);
        bool all = t.articulations->order.parts > 0;
        for (int32_t k = 0; k < t.articulations->order.parts; ++k) {
            all = all && is_solved(&t, k);
            t.articulations->parts[k].tree.nodes = 0;
        }
        ck_assert_int_eq(solve(&t), SADMM_OK);
        for (int32_t k = 0; k < t.articulations->order.parts; ++k) {
            ck_assert(!t.articulations->parts[k].by_tree);
            all = all && is_solved(&t, k);
        }
        for (int k = 0; all && k < 6 * t.bodies; ++k)
            ck_assert_msg(fabs(t.velocity[k] - by_tree[k]) < 1e-6 * (1 + fabs(by_tree[k])), "seed %d: %g and %g",
                          (int)seed, t.velocity[k], by_tree[k]);
        compared += all;
        free_tree(&t);
    }
    ck_assert_int_ge(compared, 250);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("articulation_tree");
    TCase *tcase = tcase_create("random");
    tcase_add_test(tcase, random_trees_solve_their_laws);
    tcase_add_test(tcase, trees_and_the_sparse_factor_agree);
    suite_add_tcase(suite, tcase);
    return run_suite(suite);
}
