/* What an island does in a step does not depend on what else is in the world: random groups of bodies, far from each
 * other, that fall, land, rest, are thrown and sink into each other, alone and together. By every CPU backend, but for
 * rounding: what a body shares a vector with is another, and what is in the air makes one iteration where nothing
 * touches. By the device test_cuda_islands.c (BODIES_ON_CUDA), which includes this file. */
#include "body_worlds.h"
#include "environment_tools.h"

/* An emulated device takes seconds for what a device does in milliseconds. */
#ifdef CUDA_EMULATED
enum { STEPS = 20 };
#else
enum { STEPS = 60 };
#endif
enum { GROUPS = 5, MOST_BODIES = 8, ROUNDS = 6 };

/* Of group g, the same whatever the world: a heap or a stack, from a height of which some land sooner than others. */
static int bodies_of(int round, int g)
{
    return 1 + (int)(MOST_BODIES * (1 + noise((uint32_t)round, (uint32_t)g)) / 2);
}

static void add_group(sadmm_world *world, int round, int g)
{
    const uint32_t seed = (uint32_t)(1000 * round + 100 * g);
    const double drop = g == 0 ? 0.0005 : 0.05 * g * (1 + noise(seed, 99)), sunk = g == 3 ? -0.004 : 0.001;
    for (int i = 0; i < bodies_of(round, g); ++i) {
        const uint32_t k = (uint32_t)(10 * i);
        const bool heap = g % 2 == 1;
        sadmm_body_def def = cube_def(20.0 * g + (heap ? 0.12 : 0.02) * noise(seed, k),
                                      (heap ? 0.12 : 0.02) * noise(seed, k + 1), 0.1 + drop + (0.2 + sunk) * i);
        def.mass *= 1 + 0.9 * noise(seed, k + 2);
        def.linear_velocity[0] = g == 2 ? 2 * noise(seed, k + 3) : 0;
        def.angular_velocity[2] = g == 2 ? 3 * noise(seed, k + 4) : 0;
        add_cube(world, &def, g == 4 ? 0.1 : 0.5);
    }
}

/* All groups, or one of them. */
static sadmm_world *groups_world(int solver, int round, int only)
{
    sadmm_world_def def = bodies_def();
    def.settings.iterations = round % 2 ? 20 : 90;
    sadmm_world *world = bodies_world(&def, solver);
    add_floor(world, 0.5);
    for (int g = 0; g < GROUPS; ++g)
        if (only < 0 || g == only) add_group(world, round, g);
    return world;
}

static double *states_of(sadmm_world *world, int32_t first, int32_t count)
{
    double *state = calloc(13 * (size_t)count + 1, sizeof *state);
    ck_assert_ptr_nonnull(state);
    MUST(world, sadmm_world_get_array(world, SADMM_ARRAY_BODY_STATE, first, count, state));
    return state;
}

/* Rounding, which bodies that run into each other make ten times as much in some steps. */
static void expect_alike(const double *together, const double *own, size_t count, int solver, int group, int step)
{
    const double tolerance = 1e6 * epsilon_of(solver);
    for (size_t k = 0; k < count; ++k)
        ck_assert_msg(fabs(together[k] - own[k]) <= tolerance, "solver %d, group %d, step %d, number %zu: %.17g, %.17g",
                      solver, group, step, k, together[k], own[k]);
}

START_TEST(islands_are_solved_as_if_alone)
{
    const int solver = _i / ROUNDS, round = _i % ROUNDS;
    sadmm_world *all = groups_world(solver, round, -1), *alone[GROUPS];
    for (int g = 0; g < GROUPS; ++g) alone[g] = groups_world(solver, round, g);
    for (int step = 0; step < STEPS; ++step) {
        int32_t first = 1; /* behind the floor */
        step_world(all, 1);
        for (int g = 0; g < GROUPS; ++g) {
            const int32_t count = bodies_of(round, g);
            step_world(alone[g], 1);
            double *together = states_of(all, first, count), *own = states_of(alone[g], 1, count);
            expect_alike(together, own, 13 * (size_t)count, solver, g, step);
            free(together);
            free(own);
            first += count;
        }
    }
    for (int g = 0; g < GROUPS; ++g) sadmm_world_destroy(alone[g]);
    sadmm_world_destroy(all);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("islands");
    TCase *cases = tcase_create("islands");
    tcase_set_timeout(cases, 600);
#ifdef BODIES_ON_CUDA
    if (!find_cuda_tables(tables)) return TEST_SKIPPED;
#endif
    tcase_add_loop_test(cases, islands_are_solved_as_if_alone, 0, ROUNDS * SOLVERS);
    suite_add_tcase(suite, cases);
    return RUN_BODIES_SUITE(suite);
}
