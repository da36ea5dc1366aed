/* Different worlds on different threads, and one world that several threads only read. The thread sanitizer looks for
 * races here; without it the results are compared. */
#include <check.h>
#include <pthread.h>

#include "fixed_work.h"
#include "scene_tools.h"

enum { THREADS = 4 };

/* All at once through the choice of a backend: that is where worlds have the most in common. */
static void *create_and_step(void *hash)
{
    for (int k = 0; k < 20; ++k) {
        sadmm_world_def def = fixed_world_def();
        sadmm_backend_info info;
        def.precision = k % 2 ? SADMM_F32 : SADMM_F64;
        def.settings.threads = 1;
        sadmm_world *world = create_world(&def);
        sadmm_body_def ball = sadmm_body_def_default();
        sadmm_shape_def sphere = sadmm_shape_def_default();
        sadmm_body_id id;
        ball.mass = 1;
        ball.name = "ball";
        sadmm_sphere_inertia(1, 0.1, ball.inertia);
        sphere.size[0] = 0.1;
        for (int i = 0; i < 3; ++i) { /* in a row, touching */
            ball.position[0] = 0.2 * i;
            MUST(world, sadmm_world_add_body(world, &ball, &id));
            MUST(world, sadmm_world_add_shape(world, id, &sphere, NULL));
        }
        step_world(world, 2);
        ck_assert_int_eq(sadmm_world_contact_count(world), 2);
        *(uint64_t *)hash = state_hash(world);
        ck_assert_int_eq(sadmm_backend_query(SADMM_BACKEND_CPU, &info), SADMM_OK);
        sadmm_world_destroy(world);
    }
    return NULL;
}

START_TEST(worlds_on_threads_of_their_own)
{
    pthread_t threads[THREADS];
    uint64_t hashes[THREADS];
    for (int t = 0; t < THREADS; ++t)
        ck_assert_int_eq(pthread_create(&threads[t], NULL, create_and_step, &hashes[t]), 0);
    for (int t = 0; t < THREADS; ++t) pthread_join(threads[t], NULL);
    for (int t = 1; t < THREADS; ++t) ck_assert_uint_eq(hashes[t], hashes[0]);
}
END_TEST

struct readings {
    const sadmm_world *world;
    const sadmm_problem *problem;
    double sum;
};

/* Everything that takes a const world or problem. */
static void *read_all(void *data)
{
    struct readings *r = data;
    r->sum = 0;
    for (int k = 0; k < 50; ++k) {
        double velocity[6], impulse[3];
        r->sum += sadmm_world_body_count(r->world) + sadmm_world_shape_count(r->world);
        r->sum += sadmm_world_settings(r->world).dt + (double)strlen(sadmm_world_message(r->world));
        r->sum += sadmm_problem_body_count(r->problem) + sadmm_problem_contact_count(r->problem) +
                  sadmm_problem_block_count(r->problem) + (double)strlen(sadmm_problem_message(r->problem));
        if (sadmm_problem_get_bodies(r->problem, NULL, velocity, NULL) == SADMM_OK) r->sum += velocity[0];
        if (sadmm_problem_get_solution(r->problem, velocity, impulse, NULL) == SADMM_OK)
            r->sum += velocity[1] + impulse[2];
    }
    return NULL;
}

START_TEST(const_objects_on_several_threads)
{
    pthread_t threads[THREADS];
    struct readings readings[THREADS];
    struct sadmm_scene scene = open_scene("vertical_stacks:1");
    sadmm_world *world = build_scene(&scene);
    sadmm_problem *problem;
    double A[36] = {0}, b[6] = {1, 2, 3, 4, 5, 6};
    const sadmm_problem_contact contact = {.body_a = -1, .normal = {0, 0, 1}};
    for (int i = 0; i < 6; ++i) A[7 * i] = 1;
    ck_assert_int_eq(sadmm_problem_create(&problem), SADMM_OK);
    ck_assert_int_eq(sadmm_problem_set_bodies(problem, 1, A, b, NULL), SADMM_OK);
    ck_assert_int_eq(sadmm_problem_set_contacts(problem, 1, &contact, NULL), SADMM_OK);
    step_world(world, 1);
    for (int t = 0; t < THREADS; ++t) {
        readings[t] = (struct readings){world, problem, 0};
        ck_assert_int_eq(pthread_create(&threads[t], NULL, read_all, &readings[t]), 0);
    }
    for (int t = 0; t < THREADS; ++t) pthread_join(threads[t], NULL);
    for (int t = 0; t < THREADS; ++t) ck_assert(readings[t].sum > 0 && readings[t].sum == readings[0].sum);
    sadmm_problem_destroy(problem);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("concurrent");
    TCase *cases = tcase_create("concurrent");
    tcase_add_test(cases, worlds_on_threads_of_their_own);
    tcase_add_test(cases, const_objects_on_several_threads);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
