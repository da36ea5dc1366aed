/* Contact finding on the CUDA device against the host, on more than a million pairs of random shapes: every kind of
 * pair, on planes, meshes and heightfields too, in worlds of 20,000 bodies of 1e-3 to 1e3 m, each inspected as it is
 * and one step later, with what the step before remembers. Not one bit may differ. Says how many pairs and points of
 * each kind there were. On the emulated device (test_cuda_collision_slow_emulated.c), or with SADMM_TEST_SHORT, there
 * are few. */
#include <stdio.h>

#include "collision/manifold/collision_table.h"
#include "collision_soups.h"

enum { WANTED = 1000000, BODIES = 20000, FEW_BODIES = 60, THREADS = 16, MOST_ROUNDS = 20 };

static const struct soup_kind worlds[] = {
    {.name = "1 mm", .shapes_a_body = 1, .planes = 2, .density = 3, .size_low = 1e-3, .size_high = 1e-2,
     .static_share = 0.1, .hulls = 6, .smooth = 0.5},
    {.name = "1 m", .shapes_a_body = 1, .planes = 2, .density = 3, .size_low = 0.1, .size_high = 1,
     .static_share = 0.1, .hulls = 6, .smooth = 0.5},
    {.name = "1 km", .shapes_a_body = 1, .planes = 2, .density = 3, .size_low = 100, .size_high = 1e3,
     .static_share = 0.1, .hulls = 6, .smooth = 0.5},
    {.name = "1 mm to 1 km", .shapes_a_body = 1, .planes = 1, .density = 100, .size_low = 1e-3, .size_high = 1e3,
     .static_share = 0.1, .hulls = 3, .smooth = 0.6},
    {.name = "smooth bodies", .shapes_a_body = 1, .planes = 2, .density = 3, .size_low = 0.05, .size_high = 1,
     .static_share = 0.1, .smooth = 1},
    {.name = "on meshes and heightfields", .shapes_a_body = 1, .planes = 1, .density = 1, .size_low = 0.2,
     .size_high = 1, .static_share = 0.01, .hulls = 4, .meshes = 4, .smooth = 0.5},
};
enum { WORLDS = sizeof worlds / sizeof *worlds, TYPES = SADMM_SHAPE_TYPE_COUNT };

static const char *const type_names[] = {"plane", "sphere", "capsule", "box", "hull", "mesh",
                                         "cylinder", "cone", "ellipsoid"};

struct compared {
    long pairs[TYPES][TYPES], points[TYPES][TYPES], all;
};

static void count_pairs(const struct shape_soup *s, const struct sadmm_contact_set *set, struct compared *count)
{
    for (size_t i = 0; i < set->pair_count; ++i) {
        const struct sadmm_contact_pair *p = &set->pairs[i];
        const int a = s->geometries[p->shape_a].type, b = s->geometries[p->shape_b].type;
        ++count->pairs[a][b];
        count->points[a][b] += p->count;
        ++count->all;
    }
}

/* Both sets of a world, and those of it a step later. */
static void compare_world(const struct soup_kind *kind, uint64_t number, struct compared *count)
{
    struct shape_soup s = shape_soup_new(kind, number);
    struct both b = both_new(number % 2 ? 1 : 0);
    s.input.threads = THREADS;
    s.input.margin *= kind->size_low;
    s.input.gravity *= kind->size_high;
    for (int step = 0; step < 2; ++step) {
        char about[96];
        snprintf(about, sizeof about, "%s, world %d, step %d", kind->name, (int)number, step);
        both_find(&b, &s.input, about);
        count_pairs(&s, &b.host_set, count);
        if (step == 0) {
            random_impulses(&b.host_set);
            both_start_from(&b, &b.host_set);
        }
        soup_advance(&s, kind);
    }
    both_free(&b);
    shape_soup_free(&s);
}

static bool is_short(void)
{
#ifdef SADMM_CUDA_EMULATED
    return true;
#else
    return getenv("SADMM_TEST_SHORT") != NULL;
#endif
}

START_TEST(a_million_pairs_equal_the_host)
{
    static struct compared count;
    const long wanted = is_short() ? 1 : WANTED;
    uint64_t number = 0;
    for (int round = 0; round < MOST_ROUNDS && count.all < wanted; ++round)
        for (int w = 0; w < WORLDS; ++w) {
            struct soup_kind kind = worlds[w];
            kind.bodies = is_short() ? FEW_BODIES : BODIES;
            if (is_short() && kind.meshes) kind.static_share = 0.2;
            compare_world(&kind, ++number, &count);
        }
    printf("%ld pairs:\n", count.all);
    for (int a = 0; a < TYPES; ++a)
        for (int b = 0; b < TYPES; ++b)
            if (count.pairs[a][b])
                printf("  %-10s %-10s %9ld pairs %9ld points\n", type_names[a], type_names[b], count.pairs[a][b],
                       count.points[a][b]);
    ck_assert_int_ge(count.all, wanted);
    for (int a = 0; a < TYPES && !is_short(); ++a) /* every kind of pair was among them */
        for (int b = 0; b < TYPES; ++b)
            if (pair_is_listed(a, b) && geometry_rank(a) <= geometry_rank(b)) ck_assert_int_gt(count.pairs[a][b], 100);
}
END_TEST

int main(void)
{
    struct sadmm_cuda_collision *device = NULL;
    struct sadmm_error error = {0};
    const sadmm_status status = COLLISION(create)(0, &device, &error);
    if (status != SADMM_OK) {
        printf("%s%s\n", status == SADMM_ERROR_UNAVAILABLE ? "skipped: " : "", error.message);
        return status == SADMM_ERROR_UNAVAILABLE ? 77 : EXIT_FAILURE;
    }
    COLLISION(destroy)(device);
    Suite *suite = suite_create("cuda_collision, long");
    TCase *tests = tcase_create("a million pairs");
    tcase_set_timeout(tests, 600);
    tcase_add_test(tests, a_million_pairs_equal_the_host);
    suite_add_tcase(suite, tests);
    SRunner *runner = srunner_create(suite);
    srunner_set_fork_status(runner, CK_NOFORK); /* a driver that was started does not survive a fork */
    srunner_run_all(runner, CK_NORMAL);
    const int failed = srunner_ntests_failed(runner);
    srunner_free(runner);
    return failed ? EXIT_FAILURE : EXIT_SUCCESS;
}
