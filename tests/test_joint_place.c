/* Joints set to positions and speeds: in random trees of all kinds they have them then, and the other joints what they
 * had. */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "scene_tools.h"
#include "subadmm/arrays.h"

enum { MOST = 12 };

static uint64_t seed;
static double uniform(void) /* in [-1, 1) */
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / (double)(UINT64_C(1) << 52) - 1;
}
static int below(int n) { return (int)((uniform() + 1) / 2 * n); }

static void turn(double q[4])
{
    double size = 0;
    for (int k = 0; k < 4; ++k) q[k] = uniform(), size += q[k] * q[k];
    for (int k = 0; k < 4; ++k) q[k] /= sqrt(size);
}

/* A tree of bodies whose first one is free or joined to the static world, each joint either way round. */
static sadmm_world *random_tree(bool rooted, int *count)
{
    static const sadmm_joint_kind kinds[] = {SADMM_JOINT_FIXED,       SADMM_JOINT_REVOLUTE,  SADMM_JOINT_PRISMATIC,
                                             SADMM_JOINT_CYLINDRICAL, SADMM_JOINT_SPHERICAL, SADMM_JOINT_UNIVERSAL,
                                             SADMM_JOINT_PLANAR,      SADMM_JOINT_CARTESIAN, SADMM_JOINT_CUSTOM};
    const sadmm_world_def def = sadmm_world_def_default();
    sadmm_world *world = create_world(&def);
    sadmm_body_id bodies[MOST];
    const int n = 2 + below(MOST - 2);
    *count = 0;
    for (int i = 0; i < n; ++i) {
        sadmm_body_def body = sadmm_body_def_default();
        body.mass = 1;
        for (int k = 0; k < 3; ++k) {
            body.inertia[k] = 0.1;
            body.position[k] = 3 * uniform();
            body.linear_velocity[k] = uniform(), body.angular_velocity[k] = uniform();
        }
        turn(body.orientation);
        MUST(world, sadmm_world_add_body(world, &body, &bodies[i]));
        if (i == 0 && !rooted) continue;
        sadmm_joint_def joint = sadmm_joint_def_default();
        joint.kind = kinds[below((int)(sizeof kinds / sizeof *kinds))];
        if (joint.kind == SADMM_JOINT_CUSTOM) joint.locks = 1U + (uint32_t)below(62);
        for (int k = 0; k < 3; ++k) joint.position_a[k] = uniform(), joint.position_b[k] = uniform();
        turn(joint.orientation_a), turn(joint.orientation_b);
        sadmm_body_id *mine = below(2) ? &joint.body_a : &joint.body_b;
        *mine = bodies[i];
        if (i > 0) *(mine == &joint.body_a ? &joint.body_b : &joint.body_a) = bodies[below(i)];
        MUST(world, sadmm_world_add_joint(world, &joint, NULL));
        ++*count;
    }
    return world;
}

static bool is_free(sadmm_world *world, int32_t row, int k, int *free_turns)
{
    sadmm_joint_id id;
    sadmm_joint_def def;
    MUST(world, sadmm_world_joint_at(world, row, &id));
    MUST(world, sadmm_world_joint_def(world, id, &def));
    *free_turns = 3 - (int)(def.locks >> 3 & 1) - (int)(def.locks >> 4 & 1) - (int)(def.locks >> 5 & 1);
    return !(def.locks >> k & 1);
}

static void read(sadmm_world *world, sadmm_array array, int rows, double *x)
{
    MUST(world, sadmm_world_get_array(world, array, 0, rows, x));
}

/* Rounding of numbers of size 10 through twelve joints. */
static const double TOLERANCE = 1e-11;

/* First all joints at once; then one of them alone, which leaves the others. */
START_TEST(joints_have_what_they_are_set_to)
{
    seed = (uint64_t)_i * 977 + 5;
    int count;
    sadmm_world *world = random_tree(_i % 2, &count);
    double position[MOST * 6], speed[MOST * 6], now[MOST * 6];
    for (int pass = 0; pass < 3; ++pass) {
        const int first = pass == 0 ? 0 : below(count), rows = pass == 0 ? count : 1;
        read(world, SADMM_ARRAY_JOINT_POSITION, count, position);
        read(world, SADMM_ARRAY_JOINT_SPEED, count, speed);
        for (int r = first; r < first + rows; ++r)
            for (int k = 0; k < 6; ++k) {
                int turns;
                const bool free = is_free(world, r, k, &turns);
                /* angles wind, but not rotation vectors; a universal joint is singular at a quarter turn */
                const double most = k < 3 ? 2 : turns == 3 ? 1.8 : turns == 2 ? 1.2 : 20;
                position[6 * r + k] = free ? most * uniform() : 0;
                speed[6 * r + k] = free ? 2 * uniform() : 0;
            }
        MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, first, rows, position + 6 * first));
        if (pass == 1) { /* positions alone: all keep their speeds */
            read(world, SADMM_ARRAY_JOINT_SPEED, count, speed);
        } else {
            MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_SPEED, first, rows, speed + 6 * first));
        }
        read(world, SADMM_ARRAY_JOINT_POSITION, count, now);
        for (int k = 0; k < 6 * count; ++k)
            ck_assert_msg(fabs(now[k] - position[k]) <= TOLERANCE, "%d, joint %d, coordinate %d: %.17g, set %.17g", _i,
                          k / 6, k % 6, now[k], position[k]);
        read(world, SADMM_ARRAY_JOINT_SPEED, count, now);
        for (int k = 0; k < 6 * count; ++k)
            ck_assert_msg(fabs(now[k] - speed[k]) <= TOLERANCE, "%d, joint %d, speed %d: %.17g, set %.17g", _i, k / 6,
                          k % 6, now[k], speed[k]);
    }
    /* What has been read changes nothing when it is set. */
    uint64_t hash, again;
    read(world, SADMM_ARRAY_JOINT_POSITION, count, position);
    MUST(world, sadmm_world_state_hash(world, &hash));
    MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, 0, count, position));
    MUST(world, sadmm_world_state_hash(world, &again));
    ck_assert_uint_eq(hash, again);
    sadmm_world_destroy(world);
}
END_TEST

/* Speeds of a position that is set without them: as before, also of joints beyond, whose axes have turned. */
START_TEST(speeds_stay_when_positions_are_set)
{
    seed = (uint64_t)_i * 131 + 7;
    int count;
    sadmm_world *world = random_tree(_i % 2, &count);
    double position[MOST * 6] = {0}, speed[MOST * 6], now[MOST * 6];
    MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, 0, count, position)); /* locks are met */
    MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_SPEED, 0, count, position));
    for (int k = 0; k < 6 * count; ++k) {
        int turns;
        speed[k] = is_free(world, k / 6, k % 6, &turns) ? uniform() : 0;
    }
    MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_SPEED, 0, count, speed));
    const int row = below(count);
    for (int k = 0; k < 6; ++k) position[k] = uniform();
    MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, row, 1, position));
    read(world, SADMM_ARRAY_JOINT_SPEED, count, now);
    for (int k = 0; k < 6 * count; ++k)
        ck_assert_msg(fabs(now[k] - speed[k]) <= TOLERANCE, "%d, joint %d of %d, speed %d: %.17g, was %.17g", _i, k / 6,
                      row, k % 6, now[k], speed[k]);
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(loops_and_distances_are_refused)
{
    const sadmm_world_def def = sadmm_world_def_default();
    sadmm_world *world = create_world(&def);
    sadmm_body_id bodies[3];
    for (int i = 0; i < 3; ++i) {
        sadmm_body_def body = sadmm_body_def_default();
        body.mass = 1;
        body.position[0] = i;
        for (int k = 0; k < 3; ++k) body.inertia[k] = 0.1;
        MUST(world, sadmm_world_add_body(world, &body, &bodies[i]));
    }
    static const double straight[4] = {1, 0, 0, 0};
    for (int i = 0; i < 4; ++i) { /* world - 0 - 1 - 2 - world */
        sadmm_joint_def joint = sadmm_joint_def_default();
        const double at[3] = {i - 0.5, 0, 0};
        joint.kind = SADMM_JOINT_REVOLUTE;
        if (i > 0) joint.body_a = bodies[i - 1];
        if (i < 3) joint.body_b = bodies[i];
        MUST(world, sadmm_world_place_joint(world, &joint, at, straight));
        MUST(world, sadmm_world_add_joint(world, &joint, NULL));
    }
    double position[30] = {0}, now[24];
    uint64_t hash, again;
    MUST(world, sadmm_world_state_hash(world, &hash));
    read(world, SADMM_ARRAY_JOINT_POSITION, 4, position);
    MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, 0, 4, position)); /* what they have */
    position[6 + 5] = 0.1;
    ck_assert_int_eq(sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, 0, 4, position),
                     SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_msg(strstr(sadmm_world_message(world), "values, row 1: the joint is part of a loop") != NULL, "%s",
                  sadmm_world_message(world));
    MUST(world, sadmm_world_state_hash(world, &again));
    ck_assert_uint_eq(hash, again);
    /* Once it is open the joint turns what is beyond it. */
    sadmm_joint_id last;
    MUST(world, sadmm_world_joint_at(world, 3, &last));
    MUST(world, sadmm_world_set_joint_enabled(world, last, false));
    MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, 1, 1, position + 6));
    read(world, SADMM_ARRAY_JOINT_POSITION, 3, now);
    ck_assert_double_eq_tol(now[6 + 5], 0.1, TOLERANCE);
    ck_assert_double_eq_tol(now[12 + 5], 0, TOLERANCE);
    position[6 + 5] = NAN;
    ck_assert_int_eq(sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, 1, 1, position + 6),
                     SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert(strstr(sadmm_world_message(world), "column 5 = nan") != NULL);
    sadmm_joint_def rod = sadmm_joint_def_default();
    rod.kind = SADMM_JOINT_DISTANCE;
    rod.body_a = bodies[0], rod.body_b = bodies[2];
    MUST(world, sadmm_world_add_joint(world, &rod, NULL));
    double far[6] = {0, 1};
    ck_assert_int_eq(sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, 4, 1, far), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert(strstr(sadmm_world_message(world), "holds a distance") != NULL);
    sadmm_world_destroy(world);
}
END_TEST

/* What is set is what the caller changes: a distance joint and one that is not enabled, whose rows are as they were
 * read, stay as they are, though what was set before them moves their bodies. */
START_TEST(rows_that_do_not_change_are_left_alone)
{
    const sadmm_world_def def = sadmm_world_def_default();
    sadmm_world *world = create_world(&def);
    sadmm_body_id bodies[3];
    static const double straight[4] = {1, 0, 0, 0}, pivot[3] = {-0.5, 0, 0};
    for (int i = 0; i < 3; ++i) {
        sadmm_body_def body = sadmm_body_def_default();
        body.mass = 1;
        body.position[0] = 0.3 * i, body.position[1] = 0.7 * i, body.position[2] = 0.1 * i * i;
        for (int k = 0; k < 3; ++k) body.inertia[k] = 0.1;
        MUST(world, sadmm_world_add_body(world, &body, &bodies[i]));
    }
    sadmm_joint_def hinge = sadmm_joint_def_default(), rod = hinge, off = hinge;
    hinge.kind = SADMM_JOINT_REVOLUTE;
    hinge.body_b = bodies[0];
    MUST(world, sadmm_world_place_joint(world, &hinge, pivot, straight));
    rod.kind = SADMM_JOINT_DISTANCE;
    rod.body_a = bodies[0], rod.body_b = bodies[1];
    off.kind = SADMM_JOINT_FIXED;
    off.body_a = bodies[0], off.body_b = bodies[2];
    off.enabled = false;
    MUST(world, sadmm_world_add_joint(world, &hinge, NULL));
    MUST(world, sadmm_world_add_joint(world, &rod, NULL));
    MUST(world, sadmm_world_add_joint(world, &off, NULL));
    double position[18], now[18];
    sadmm_body_state before, after;
    MUST(world, sadmm_world_body_state(world, bodies[2], &before));
    for (int k = 0; k < 20; ++k) {
        read(world, SADMM_ARRAY_JOINT_POSITION, 3, position);
        position[5] += 0.37;
        MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, 0, 3, position));
        read(world, SADMM_ARRAY_JOINT_POSITION, 3, now);
        ck_assert_double_eq_tol(now[5], position[5], TOLERANCE);
        ck_assert_double_eq_tol(now[6], 0, TOLERANCE); /* the rod has its length */
    }
    MUST(world, sadmm_world_body_state(world, bodies[2], &after));
    ck_assert_mem_eq(&before, &after, sizeof before);
    read(world, SADMM_ARRAY_JOINT_SPEED, 3, position);
    position[5] = 1;
    MUST(world, sadmm_world_set_array(world, SADMM_ARRAY_JOINT_SPEED, 0, 3, position));
    read(world, SADMM_ARRAY_JOINT_SPEED, 3, now);
    ck_assert_double_eq_tol(now[5], 1, TOLERANCE);
    rod.kind = SADMM_JOINT_REVOLUTE; /* one that is not enabled is not set */
    rod.enabled = false;
    MUST(world, sadmm_world_add_joint(world, &rod, NULL));
    read(world, SADMM_ARRAY_JOINT_POSITION, 4 - 1, position);
    double free[6] = {0, 0, 0, 0, 0, 0.4};
    ck_assert_int_eq(sadmm_world_set_array(world, SADMM_ARRAY_JOINT_POSITION, 3, 1, free),
                     SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert(strstr(sadmm_world_message(world), "is not enabled") != NULL);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("joint_place");
    TCase *cases = tcase_create("joint_place");
    tcase_add_loop_test(cases, joints_have_what_they_are_set_to, 0, 400);
    tcase_add_loop_test(cases, speeds_stay_when_positions_are_set, 0, 200);
    tcase_add_test(cases, loops_and_distances_are_refused);
    tcase_add_test(cases, rows_that_do_not_change_are_left_alone);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
