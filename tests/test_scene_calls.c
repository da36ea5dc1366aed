/* The public form of the scene library (subadmm/scenes.h). */
#include <stdlib.h>
#include <string.h>

#include "run_suite.h"
#include "subadmm/scenes.h"

/* A world of a scene makes the steps that its script asks for, and its text is a scene again: the same world. */
START_TEST(scene_to_text_and_back)
{
    sadmm_scene *scene, *again;
    sadmm_world *world, *copy;
    sadmm_world_def def;
    ck_assert_int_eq(sadmm_scene_create("grippers:2", &scene), SADMM_OK);
    ck_assert_str_eq(sadmm_scene_name(scene), "grippers");
    ck_assert(sadmm_scene_duration(scene) > 0 && sadmm_scene_is_scripted(scene));
    ck_assert_int_eq(sadmm_scene_world_def(scene, &def), SADMM_OK);
    def.settings.dt = 0.004;
    def.settings.threads = 1;
    ck_assert_int_eq(sadmm_scene_create_world(scene, &def, &world), SADMM_OK);
    ck_assert_double_eq(sadmm_world_settings(world).dt, 0.004);
    for (int64_t step = 0; step < 20; ++step) {
        ck_assert_int_eq(sadmm_scene_run_script(scene, world, step), SADMM_OK);
        ck_assert_int_eq(sadmm_world_step(world), SADMM_OK);
    }

    size_t size, needed;
    if (sadmm_scene_write_text(scene, world, NULL, 0, &size) == SADMM_ERROR_UNAVAILABLE) {
        ck_assert_ptr_nonnull(strstr(sadmm_last_message(), "jansson"));
        sadmm_world_destroy(world);
        sadmm_scene_destroy(scene);
        return;
    }
    char *text = (char *)malloc(size);
    ck_assert_int_eq(sadmm_scene_write_text(scene, world, text, size - 1, &needed), SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_uint_eq(needed, size);
    ck_assert_int_eq(sadmm_scene_write_text(scene, world, text, size, &needed), SADMM_OK);
    ck_assert_uint_eq(strlen(text) + 1, size);

    ck_assert_int_eq(sadmm_scene_create_from_text(text, size - 1, "text", &again), SADMM_OK);
    ck_assert(!sadmm_scene_is_scripted(again));
    ck_assert_int_eq(sadmm_scene_create_world(again, NULL, &copy), SADMM_OK);
    uint64_t here, there;
    ck_assert_int_eq(sadmm_world_state_hash(world, &here), SADMM_OK);
    ck_assert_int_eq(sadmm_world_state_hash(copy, &there), SADMM_OK);
    ck_assert_uint_eq(here, there);
    ck_assert_double_eq(sadmm_world_settings(copy).dt, 0.004);

    /* Without a scene: the same bodies. */
    ck_assert_int_eq(sadmm_scene_write_text(NULL, world, NULL, 0, &needed), SADMM_OK);
    ck_assert_uint_gt(needed, 1000);

    sadmm_scene_destroy(again);
    sadmm_scene_destroy(scene); /* worlds stay */
    ck_assert_int_eq(sadmm_world_step(copy), SADMM_OK);
    sadmm_world_destroy(copy);
    sadmm_world_destroy(world);
    free(text);
}
END_TEST

START_TEST(scene_list_and_methods)
{
    const int32_t count = sadmm_scene_library_count();
    sadmm_world_def fast, paper;
    sadmm_scene *scene;
    ck_assert_int_gt(count, 30);
    for (int32_t k = 0; k < count; ++k) {
        const char *name, *arguments, *description;
        ck_assert_int_eq(sadmm_scene_library_at(k, &name, &arguments, &description), SADMM_OK);
        ck_assert(*name && *description);
        ck_assert_int_eq(sadmm_scene_library_at(k, NULL, NULL, NULL), SADMM_OK);
    }
    ck_assert_int_eq(sadmm_scene_create("pyramid", &scene), SADMM_OK);
    ck_assert_int_eq(sadmm_scene_world_def(scene, &fast), SADMM_OK);
    ck_assert_int_eq(sadmm_scene_choose_method(scene, SADMM_METHOD_PAPER), SADMM_OK);
    ck_assert_int_eq(sadmm_scene_world_def(scene, &paper), SADMM_OK);
    ck_assert_int_eq(fast.settings.method, SADMM_METHOD_FAST);
    ck_assert_int_eq(paper.settings.method, SADMM_METHOD_PAPER);
    ck_assert_int_eq(paper.settings.substeps, 1);

    /* A program of other headers: what it does not know is left as it is. */
    struct {
        sadmm_world_def def;
        unsigned char behind[8];
    } later;
    memset(&later, 7, sizeof later);
    ck_assert_int_eq(sadmm_scene_world_def(scene, &later.def), SADMM_OK);
    ck_assert_uint_eq(later.def.settings.struct_size, sizeof later.def.settings);
    ck_assert_mem_eq(later.behind, "\7\7\7\7\7\7\7\7", 8);
    sadmm_scene_destroy(scene);
}
END_TEST

#define REFUSED(call, status, said)                             \
    do {                                                        \
        ck_assert_int_eq(call, status);                         \
        ck_assert_ptr_nonnull(strstr(sadmm_last_message(), said)); \
    } while (0)

START_TEST(scene_errors)
{
    sadmm_scene *scene = (sadmm_scene *)&scene;
    sadmm_world *world = (sadmm_world *)&world;
    sadmm_world_def def;
    REFUSED(sadmm_scene_create("piles", &scene), SADMM_ERROR_INVALID_ARGUMENT, "scene = \"piles\": must be one of");
    ck_assert_ptr_null(scene);
    REFUSED(sadmm_scene_create("pile:0", &scene), SADMM_ERROR_INVALID_ARGUMENT, "N must be in [1, 1000000]");
    REFUSED(sadmm_scene_create(NULL, &scene), SADMM_ERROR_INVALID_ARGUMENT, "scene = NULL");
    REFUSED(sadmm_scene_create("pile", NULL), SADMM_ERROR_INVALID_ARGUMENT, "out = NULL");
    REFUSED(sadmm_scene_create_from_text(NULL, 0, NULL, &scene), SADMM_ERROR_INVALID_ARGUMENT, "text = NULL");
    REFUSED(sadmm_scene_library_at(-1, NULL, NULL, NULL), SADMM_ERROR_INVALID_ARGUMENT, "index = -1: must be in [0, ");
    REFUSED(sadmm_scene_create_world(NULL, NULL, &world), SADMM_ERROR_INVALID_ARGUMENT, "scene = NULL");
    ck_assert_ptr_null(world);
    REFUSED(sadmm_scene_world_def(NULL, &def), SADMM_ERROR_INVALID_ARGUMENT, "scene = NULL");

    ck_assert_int_eq(sadmm_scene_create("incline", &scene), SADMM_OK);
    REFUSED(sadmm_scene_choose_method(scene, (sadmm_method)9), SADMM_ERROR_INVALID_ARGUMENT, "method = 9");
    ck_assert_int_eq(sadmm_scene_world_def(scene, &def), SADMM_OK);
    def.settings.dt = -1;
    REFUSED(sadmm_scene_create_world(scene, &def, &world), SADMM_ERROR_INVALID_ARGUMENT, "settings.dt = -1");
    ck_assert_ptr_null(world);
    ck_assert_int_eq(sadmm_scene_create_world(scene, NULL, &world), SADMM_OK);
    REFUSED(sadmm_scene_run_script(scene, world, -1), SADMM_ERROR_INVALID_ARGUMENT, "step = -1: must be >= 0");
    REFUSED(sadmm_scene_run_script(scene, NULL, 0), SADMM_ERROR_INVALID_ARGUMENT, "world = NULL");
    sadmm_world_destroy(world);
    sadmm_scene_destroy(scene);
    sadmm_scene_destroy(NULL);
    ck_assert_ptr_null(sadmm_scene_name(NULL));
}
END_TEST

/* A library without scenes says so. */
START_TEST(missing)
{
    sadmm_scene *scene;
    REFUSED(sadmm_scene_create("pile", &scene), SADMM_ERROR_UNAVAILABLE, "scenes are not in this library");
    ck_assert_ptr_null(scene);
    sadmm_scene_destroy(scene);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("scene calls");
    TCase *cases = tcase_create("scene calls");
    if (sadmm_scene_library_count() == 0) {
        tcase_add_test(cases, missing);
    } else {
        tcase_add_test(cases, scene_to_text_and_back);
        tcase_add_test(cases, scene_list_and_methods);
        tcase_add_test(cases, scene_errors);
    }
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
