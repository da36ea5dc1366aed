/* Kernels of joints (world/step/joint_kernels.h) give the bits of the formulas that they are of, in every instruction
 * set that this machine has: random bodies, frames, locks and laws. */
#include <check.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "config.h"
#include "run_suite.h"
#include "subadmm/settings.h"
#include "world/step/joint_kernels.h"

enum { TRIALS = 3000, MOST = 11 };

static uint64_t state;

static double uniform(double lo, double hi)
{
    state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return lo + (hi - lo) * (double)(state >> 11) / 9007199254740992.0;
}
static int below(int count) { return (int)uniform(0, count); }
static void fill(double *x, int count, double most)
{
    for (int k = 0; k < count; ++k) x[k] = uniform(-most, most);
}
static quat orientation(void)
{
    quat q;
    q.w = uniform(-1, 1), q.x = uniform(-1, 1), q.y = uniform(-1, 1), q.z = uniform(-1, 1);
    return q_normalize(q);
}

/* Of several kinds: with equal moments, at rest, that turns on, that turns by several radians in a step. */
static struct sadmm_rigid random_body(void)
{
    struct sadmm_rigid body = {.mass = uniform(0.1, 10), .gravity_scale = 1};
    const int kind = below(12);
    fill(body.position, 3, 2);
    q_store(orientation(), body.orientation);
    fill(body.velocity, 6, kind == 0 ? 1000 : 3);
    for (int k = 0; k < 3; ++k) body.inertia[k] = kind == 1 ? 0.2 : uniform(0.3, 0.5);
    if (kind == 2) memset(body.velocity + 3, 0, 3 * sizeof(double));
    if (kind == 3) body.rolls = ROLLING_TURNS_ON;
    return body;
}

static bool same(const double *a, const double *b, size_t count)
{
    for (size_t k = 0; k < count; ++k)
        if (!(a[k] == b[k]) && !(a[k] != a[k] && b[k] != b[k])) return false; /* a zero's sign does not count */
    return true;
}
#define SAME(a, b) ck_assert_msg(same((const double *)&(a), (const double *)&(b), sizeof(a) / (sizeof(double))), #a)

static const struct sadmm_joint_kernels variants[] = {
    {sadmm_joint_spins_baseline, sadmm_joint_moves_baseline, sadmm_joint_act_baseline, sadmm_joint_rates_baseline,
     sadmm_joint_laws_baseline, sadmm_joint_openings_baseline, sadmm_joint_close_baseline},
#ifdef SADMM_HAVE_ISA_AVX2
    {sadmm_joint_spins_avx2, sadmm_joint_moves_avx2, sadmm_joint_act_avx2, sadmm_joint_rates_avx2,
     sadmm_joint_laws_avx2, sadmm_joint_openings_avx2, sadmm_joint_close_avx2},
#endif
};
enum { VARIANTS = sizeof variants / sizeof *variants };

static bool can_run(int i)
{
#ifdef SADMM_HAVE_ISA_AVX2
    return i == 0 || __builtin_cpu_supports("avx2");
#else
    return i == 0;
#endif
}

START_TEST(spins_and_moves)
{
    const struct sadmm_joint_kernels *by = &variants[_i];
    struct sadmm_rigid body[MOST];
    struct spin_system spin[MOST];
    struct joint_movement movement[MOST];
    const double dt = 0.005;
    if (!can_run(_i)) return;
    state = 1;
    for (int trial = 0; trial < TRIALS / MOST; ++trial) {
        const int count = 1 + trial % MOST;
        struct sadmm_rigid next[MOST] = {0};
        double velocity[MOST][6];
        for (int k = 0; k < count; ++k) {
            body[k] = random_body();
            memcpy(velocity[k], body[k].velocity, sizeof velocity[k]);
            velocity[k][below(6)] += 0.1;
            movement[k] = (struct joint_movement){&body[k], &spin[k].orientation.w, velocity[k], &next[k]};
        }
        by->spins(body, (size_t)count, dt, spin);
        by->moves(movement, (size_t)count, dt);
        for (int k = 0; k < count; ++k) {
            const struct spin_system expected = spin_of_system(&body[k], dt);
            struct sadmm_rigid moved = {0};
            double halfway[4];
            SAME(spin[k], expected);
            q_store(expected.orientation, halfway);
            joint_move(&body[k], halfway, velocity[k], false, dt, moved.position, moved.orientation,
                       moved.velocity);
            SAME(next[k].position, moved.position);
            SAME(next[k].orientation, moved.orientation);
            SAME(next[k].velocity, moved.velocity);
        }
    }
}
END_TEST

/* ---- a joint ----------------------------------------------------------------------------------------------------- */

static void random_law(struct sadmm_world_joint *joint, int k)
{
    sadmm_joint_coordinate *c = &joint->def.coordinates[k];
    c->limited = below(2), c->lower = uniform(-1, 0.5), c->upper = c->lower + uniform(0, 1);
    c->drive = (sadmm_drive)below(3), c->drive_force = uniform(0, 10), c->drive_stiffness = uniform(0, 100);
    c->friction = below(2), c->armature = below(2) * uniform(0, 1);
    c->spring_stiffness = below(2) * uniform(0, 1e4), c->spring_damping = below(2) * uniform(0, 10);
    for (int role = 0; role < SADMM_ROLE_COUNT; ++role) joint->next.force[role][k] = below(2) * uniform(-10, 10);
    joint->next.angle[k] = uniform(-20, 20);
}

static void random_joint(struct sadmm_world_joint *joint)
{
    static const sadmm_joint_kind kinds[] = {SADMM_JOINT_CUSTOM, SADMM_JOINT_CUSTOM, SADMM_JOINT_DISTANCE};
    static const uint32_t locks[] = {31, 7, 63, 47, 0, 15, 56, 62};
    memset(joint, 0, sizeof *joint);
    joint->def = sadmm_joint_def_default();
    joint->def.kind = kinds[below(3)];
    joint->def.locks = joint_is_radial(joint->def.kind) ? 1 : locks[below(8)];
    joint->def.length = uniform(0.5, 1);
    joint->next.trapezoid_off = below(4) == 0;
    for (int s = 0; s < 2; ++s) {
        joint->frame[s].position = v3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
        joint->frame[s].orientation = orientation();
    }
    for (int k = 0; k < JOINT_COORDINATES; ++k) random_law(joint, k);
}

static void check_geometry(const struct joint_geometry *a, const struct joint_geometry *b)
{
    SAME(a->axis, b->axis);
    SAME(a->arm_a, b->arm_a);
    SAME(a->arm_b, b->arm_b);
    SAME(a->point, b->point);
}

/* One side may be the world, or move as prescribed. */
static void random_sides(const struct sadmm_rigid body[2], const sadmm_settings *settings, struct acting_joint *acting)
{
    const int kind = below(6);
    for (int s = 0; s < 2; ++s) {
        const struct joint_body of = {kind < 2 && s == 0 ? -1 : s, kind == 0 && s == 0 ? NULL : &body[s],
                                      kind == 1 && s == 0, false};
        acting->side[s] = joint_side_of(of, settings);
    }
}

struct lists {
    double jacobian[2][6 * JOINT_MOST_ROWS], law[7][JOINT_MOST_ROWS];
    struct sadmm_joint_source source[JOINT_MOST_ROWS];
};

static void check_row(const struct lists *rows, int r, const struct joint_law *law, const struct acting_joint *acting)
{
    const double expected[5] = {law->gain, law->bias, law->compliance, law->lo, law->hi};
    double found[5];
    for (int k = 0; k < 5; ++k) found[k] = rows->law[k][r];
    SAME(found, expected);
    const struct sadmm_joint_source *source = &rows->source[r];
    ck_assert_int_eq(source->role, law->role);
    ck_assert_int_eq(source->coordinate, law->coordinate);
    const double of[3] = {source->separation, source->slack, source->prescribed},
                 should[3] = {law->separation, law->slack, law->prescribed};
    SAME(of, should);
    for (int s = 0; s < 2; ++s) {
        double row[6] = {0}, own[6];
        if (acting->side[s].system_body >= 0) joint_step_row(acting, s, law->coordinate, row);
        for (int k = 0; k < 6; ++k) row[k] *= law->sign, own[k] = rows->jacobian[s][6 * r + k];
        SAME(own, row);
    }
}

START_TEST(acting_and_laws)
{
    const struct sadmm_joint_kernels *by = &variants[_i];
    sadmm_settings settings = sadmm_settings_default();
    if (!can_run(_i)) return;
    settings.dt = 0.01;
    state = 2;
    for (int trial = 0; trial < TRIALS; ++trial) {
        const struct sadmm_rigid body[2] = {random_body(), random_body()};
        struct sadmm_world_joint joint;
        struct acting_joint acting, expected;
        struct joint_rates rates;
        struct lists rows;
        random_joint(&joint);
        random_sides(body, &settings, &acting);
        expected = acting;
        by->act(&joint.def, joint.frame, false, &settings, &acting);
        joint_act_between(&joint.def, joint.frame, false, &settings, &expected);
        check_geometry(&acting.start, &expected.start);
        check_geometry(&acting.middle, &expected.middle);
        SAME(acting.start.value, expected.start.value);
        SAME(acting.frame, expected.frame);

        const struct joint_row_lists lists = {{rows.jacobian[0], rows.jacobian[1]}, rows.law[0], rows.law[1],
                                              rows.law[2], rows.law[3], rows.law[4], rows.law[5], rows.law[6],
                                              rows.source};
        struct sadmm_world_joint before = joint;
        int r = 0;
        by->rates(&acting, &rates);
        const int count = by->laws(&joint, &acting, &rates, &settings, &lists);
        for (int locked = 1; locked >= 0; --locked)
            for (int k = 0; k < JOINT_COORDINATES; ++k) {
                struct joint_laws laws;
                if ((int)(joint.def.locks >> k & 1) != locked || !joint_has_coordinate(&joint.def, k)) continue;
                const struct joint_moving m = joint_moving_of(&joint.def, &before.next, &expected, k, &settings);
                joint_coordinate_laws(&joint.def, k, &m, NULL, &laws);
                for (int i = 0; i < laws.count; ++i) check_row(&rows, r++, &laws.law[i], &expected);
            }
        ck_assert_int_eq(count, r);
    }
}
END_TEST

START_TEST(closing)
{
    enum { JOINTS = 5 };
    const struct sadmm_joint_kernels *by = &variants[_i];
    const sadmm_settings settings = sadmm_settings_default();
    int little = 0, wide = 0;
    if (!can_run(_i)) return;
    state = 3;
    for (int trial = 0; trial < TRIALS; ++trial) {
        struct sadmm_world_joint joint[JOINTS];
        struct sadmm_rigid from[2 * JOINTS], to[2 * JOINTS];
        struct joint_opened opened[JOINTS];
        for (int j = 0; j < JOINTS; ++j) {
            random_joint(&joint[j]);
            joint[j].def.length = 1e-9;
            for (int s = 0; s < 2; ++s) {
                struct sadmm_rigid *body = &from[2 * j + s];
                *body = random_body();
                if (s && below(2)) { /* closed, but for a little */
                    *body = body[-1];
                    joint[j].frame[1] = joint[j].frame[0];
                    body->position[0] += uniform(0, 1e-3);
                }
                to[2 * j + s] = *body;
                to[2 * j + s].position[2] += uniform(0, 1e-3);
                opened[j].pose[s] = (struct joint_pose){to[2 * j + s].position, to[2 * j + s].orientation};
                opened[j].moves[s] = s || below(3) ? &from[2 * j + s] : NULL;
            }
            opened[j].joint = &joint[j];
        }
        by->openings(opened, JOINTS);
        for (int j = 0; j < JOINTS; ++j) {
            const struct sadmm_world_joint *of = &joint[j];
            struct joint_pose start[2];
            struct joint_end first[2], last[2];
            struct joint_closing found;
            double scale = 0;
            for (int s = 0; s < 2; ++s) {
                start[s] = (struct joint_pose){from[2 * j + s].position, from[2 * j + s].orientation};
                first[s] = joint_end_on(&of->frame[s], &from[2 * j + s]);
                last[s] = joint_end_on(&of->frame[s], &to[2 * j + s]);
                scale += joint_closing_scale(last[s].arm, opened[j].moves[s]);
            }
            const bool moves[2] = {opened[j].moves[0], opened[j].moves[1]};
            const double off = joint_opening(&of->def, last);
            ck_assert(opened[j].off == off);
            ck_assert_int_eq(opened[j].little, joint_opens_little(&of->def, last, moves, off));
            little += opened[j].little, wide += !opened[j].little;
            by->close(&opened[j], start, &settings, &found);
            const struct joint_closing expected = joint_closing_of(&of->def, first, last, scale, &settings);
            ck_assert_int_eq(found.count, expected.count);
            ck_assert(same(found.error, expected.error, (size_t)found.count));
            ck_assert(found.share == expected.share);
            check_geometry(&found.geometry, &expected.geometry);
        }
    }
    ck_assert(little > TRIALS && wide > TRIALS);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("joint_kernels");
    TCase *tcase = tcase_create("same bits");
    tcase_add_loop_test(tcase, spins_and_moves, 0, VARIANTS);
    tcase_add_loop_test(tcase, acting_and_laws, 0, VARIANTS);
    tcase_add_loop_test(tcase, closing, 0, VARIANTS);
    suite_add_tcase(suite, tcase);
    return run_suite(suite);
}
