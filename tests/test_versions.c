/* Programs that were compiled with older or newer headers than the library (subadmm/status.h). */
#include <check.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "core/base/definition_fields.h"
#include "core/base/growing.h"
#include "core/base/settings_fields.h"
#include "first_version.h"
#include "run_suite.h"

static sadmm_world *world;
static sadmm_body_id ground, ball;

static void begin(void)
{
    const sadmm_world_def def = sadmm_world_def_default();
    sadmm_body_def body = sadmm_body_def_default();
    ck_assert_int_eq(sadmm_world_create(&def, &world), SADMM_OK);
    body.mass = 1;
    sadmm_sphere_inertia(1, 0.1, body.inertia);
    ck_assert_int_eq(sadmm_world_add_body(world, &body, &ball), SADMM_OK);
    body.type = SADMM_BODY_STATIC;
    ck_assert_int_eq(sadmm_world_add_body(world, &body, &ground), SADMM_OK);
}

static void end(void) { sadmm_world_destroy(world); }

#define SAYS(text) \
    ck_assert_msg(strstr(sadmm_last_message(), text) != NULL, "\"%s\" in \"%s\"", text, sadmm_last_message())
#define REFUSED(call, text)                                      \
    do {                                                         \
        ck_assert_int_eq((call), SADMM_ERROR_INVALID_ARGUMENT);  \
        SAYS(text);                                              \
    } while (0)

/* ---- the version ------------------------------------------------------------------------------------------------- */

START_TEST(header_and_library_have_one_version)
{
    char text[32];
    snprintf(text, sizeof text, "%d.%d.%d", SADMM_VERSION_MAJOR, SADMM_VERSION_MINOR, SADMM_VERSION_PATCH);
    ck_assert_str_eq(sadmm_version(), text);
    ck_assert_int_eq(sadmm_version_number(), SADMM_VERSION);
}
END_TEST

/* ---- members keep their places ----------------------------------------------------------------------------------- */

struct place {
    const char *name;
    size_t first, now, first_size, size;
};

/* part: a member that may have become larger. */
static void compare(const struct place *places, size_t count, const char *part)
{
    for (size_t k = 0; k < count; ++k) {
        const struct place *p = &places[k];
        ck_assert_msg(p->first == p->now, "%s is at byte %zu, and was at %zu", p->name, p->now, p->first);
        ck_assert_msg(p->first_size == p->size || strcmp(p->name, part) == 0, "%s has %zu bytes, and had %zu", p->name,
                      p->size, p->first_size);
    }
}

#define PLACE(type, name, dimensions) \
    {#name, offsetof(first, name), offsetof(now, name), sizeof((first){0}.name), sizeof((now){0}.name)},
#define COMPARE(of, part)                                            \
    do {                                                             \
        typedef struct first_##of first;                             \
        typedef sadmm_##of now;                                      \
        const struct place places[] = {FIRST_##of(PLACE)};           \
        compare(places, sizeof places / sizeof *places, part);       \
    } while (0)

START_TEST(members_are_where_they_were)
{
    COMPARE(settings, "");
    COMPARE(world_def, "settings");
    COMPARE(body_def, "");
    COMPARE(shape_def, "");
    COMPARE(joint_coordinate, "");
    COMPARE(joint_def, "coordinates");
    COMPARE(coupling_def, "");
    COMPARE(gear_def, "");
    COMPARE(hull_def, "");
    COMPARE(mesh_def, "");
    COMPARE(heightfield_def, "");
    COMPARE(mesh_file_def, "");
    COMPARE(query_filter, "");
    COMPARE(draw, "");
    COMPARE(backend_info, "");
    COMPARE(solve_report, "");
    COMPARE(step_report, "");
    COMPARE(mesh_file_info, "");
}
END_TEST

/* A member that came later does not begin in the padding of the first version, which an older program leaves as it
 * is. */
static void all_were_there(const struct sadmm_field *fields, size_t count, size_t first_size, const char *const *names,
                           size_t name_count)
{
    for (size_t k = 0; k < count; ++k) {
        bool there = fields[k].offset >= first_size;
        for (size_t i = 0; i < name_count; ++i) there = there || strcmp(fields[k].name, names[i]) == 0;
        ck_assert_msg(there, "%s begins at byte %zu of %zu that were there before it", fields[k].name, fields[k].offset,
                      first_size);
    }
}

#define NAME(type, name, dimensions) #name,
#define NO_PADDING_IS_USED(table, of)                                                                           \
    do {                                                                                                        \
        static const char *const names[] = {FIRST_##of(NAME)};                                                  \
        all_were_there(table, sizeof table / sizeof *table, sizeof(struct first_##of), names,                   \
                       sizeof names / sizeof *names);                                                           \
    } while (0)

START_TEST(later_members_are_behind_the_first_version)
{
    NO_PADDING_IS_USED(sadmm_settings_table, settings);
    NO_PADDING_IS_USED(sadmm_body_table, body_def);
    NO_PADDING_IS_USED(sadmm_shape_table, shape_def);
    NO_PADDING_IS_USED(sadmm_joint_table, joint_def);
    NO_PADDING_IS_USED(sadmm_coordinate_table, joint_coordinate);
    NO_PADDING_IS_USED(sadmm_coupling_table, coupling_def);
    NO_PADDING_IS_USED(sadmm_gear_table, gear_def);
    NO_PADDING_IS_USED(sadmm_hull_table, hull_def);
}
END_TEST

/* ---- a program of the first version ------------------------------------------------------------------------------ */

/* What the library may write, and bytes behind it that it may not. */
#define GUARDED(type)                  \
    struct {                           \
        type of;                       \
        unsigned char behind[64];      \
    }
#define GUARD(x) memset(&(x), 0xa5, sizeof(x))
#define UNTOUCHED(x)                                                          \
    do {                                                                      \
        for (size_t k = 0; k < sizeof(x).behind; ++k) ck_assert_uint_eq((x).behind[k], 0xa5); \
    } while (0)

START_TEST(programs_of_the_first_version_go_on)
{
    GUARDED(struct first_body_def) body;
    GUARDED(struct first_shape_def) shape;
    GUARDED(struct first_joint_def) joint;
    GUARDED(struct first_settings) settings;
    GUARDED(struct first_world_def) def;
    GUARDED(struct first_step_report) report;
    sadmm_world *made;
    sadmm_body_id a, b;
    sadmm_shape_id form;
    sadmm_joint_id hinge;
    GUARD(body), GUARD(shape), GUARD(joint), GUARD(settings), GUARD(def), GUARD(report);

    sadmm_world_def_init((sadmm_world_def *)&def.of, sizeof def.of, sizeof def.of.settings);
    UNTOUCHED(def);
    ck_assert_uint_eq(def.of.struct_size, sizeof def.of);
    ck_assert_uint_eq(def.of.settings.struct_size, sizeof def.of.settings);
    ck_assert(def.of.contact_margin == 0.02 && def.of.settings.iterations == 200);
    def.of.settings.dt = 0.001;
    ck_assert_int_eq(sadmm_world_create((const sadmm_world_def *)&def.of, &made), SADMM_OK);
    sadmm_world_settings_sized(made, (sadmm_settings *)&settings.of, sizeof settings.of);
    UNTOUCHED(settings);
    ck_assert(settings.of.struct_size == sizeof settings.of && settings.of.dt == 0.001);
    settings.of.iterations = 7;
    ck_assert_int_eq(sadmm_world_set_settings(made, (const sadmm_settings *)&settings.of), SADMM_OK);
    ck_assert(sadmm_world_settings(made).iterations == 7 && sadmm_world_settings(made).threads == 0);

    sadmm_body_def_init((sadmm_body_def *)&body.of, sizeof body.of);
    UNTOUCHED(body);
    body.of.mass = 2;
    sadmm_sphere_inertia(2, 0.1, body.of.inertia);
    ck_assert_int_eq(sadmm_world_add_body(made, (const sadmm_body_def *)&body.of, &a), SADMM_OK);
    body.of.linear_damping = 3;
    ck_assert_int_eq(sadmm_world_add_body(made, (const sadmm_body_def *)&body.of, &b), SADMM_OK);
    GUARD(body);
    ck_assert_int_eq(sadmm_world_body_def_sized(made, b, (sadmm_body_def *)&body.of, sizeof body.of), SADMM_OK);
    UNTOUCHED(body);
    ck_assert(body.of.struct_size == sizeof body.of && body.of.mass == 2 && body.of.linear_damping == 3);

    sadmm_shape_def_init((sadmm_shape_def *)&shape.of, sizeof shape.of);
    shape.of.size[0] = 0.1;
    ck_assert_int_eq(sadmm_world_add_shape(made, a, (const sadmm_shape_def *)&shape.of, &form), SADMM_OK);
    ck_assert_int_eq(sadmm_world_shape_def_sized(made, form, (sadmm_shape_def *)&shape.of, sizeof shape.of, NULL),
                     SADMM_OK);
    UNTOUCHED(shape);
    ck_assert(shape.of.friction == 0.5 && shape.of.mask == UINT32_MAX);

    sadmm_joint_def_init((sadmm_joint_def *)&joint.of, sizeof joint.of, sizeof *joint.of.coordinates);
    UNTOUCHED(joint);
    joint.of.kind = SADMM_JOINT_REVOLUTE;
    joint.of.body_a = a, joint.of.body_b = b;
    joint.of.coordinates[5].friction = 4;
    ck_assert_int_eq(sadmm_world_add_joint(made, (const sadmm_joint_def *)&joint.of, &hinge), SADMM_OK);
    GUARD(joint);
    ck_assert_int_eq(sadmm_world_joint_def_sized(made, hinge, (sadmm_joint_def *)&joint.of, sizeof joint.of,
                                                 sizeof *joint.of.coordinates), SADMM_OK);
    UNTOUCHED(joint);
    ck_assert(joint.of.coordinates[5].friction == 4 && isinf(joint.of.coordinates[5].drive_force));
    joint.of.coordinates[5].friction = 5;
    ck_assert_int_eq(sadmm_world_set_joint_coordinate_sized(
                         made, hinge, 5, (const sadmm_joint_coordinate *)&joint.of.coordinates[5],
                         sizeof *joint.of.coordinates), SADMM_OK);

    ck_assert_int_eq(sadmm_world_step(made), SADMM_OK);
    ck_assert_int_eq(sadmm_world_report_sized(made, (sadmm_step_report *)&report.of, sizeof report.of), SADMM_OK);
    UNTOUCHED(report);
    ck_assert(report.of.step == 1 && report.of.bodies == 2 && report.of.joints == 1);
    sadmm_world_destroy(made);
}
END_TEST

/* ---- a program of a later version -------------------------------------------------------------------------------- */

/* With one more member in each struct, which the library does not have. */
struct later_settings {
    sadmm_settings known;
    double more;
};
struct later_world_def {
    unsigned char head[offsetof(sadmm_world_def, settings)];
    struct later_settings settings;
    double more;
};
struct later_coordinate {
    sadmm_joint_coordinate known;
    double more;
};
struct later_joint_def {
    unsigned char head[offsetof(sadmm_joint_def, coordinates)];
    struct later_coordinate coordinates[6];
    const char *name;
    void *user_data;
    double more;
};
struct later_body_def {
    sadmm_body_def known;
    double more;
};
struct later_report {
    sadmm_step_report known;
    double more;
};

START_TEST(programs_of_a_later_version_may_leave_out_what_is_new)
{
    struct later_body_def body;
    struct later_report report;
    sadmm_body_id id;
    GUARD(body), GUARD(report);
    sadmm_body_def_init(&body.known, sizeof body);
    ck_assert(body.known.struct_size == sizeof body && body.known.gravity_scale == 1 && body.more == 0);
    body.known.mass = 1;
    sadmm_sphere_inertia(1, 0.1, body.known.inertia);
    ck_assert_int_eq(sadmm_world_add_body(world, &body.known, &id), SADMM_OK);
    body.more = 1;
    REFUSED(sadmm_world_add_body(world, &body.known, &id), "def: a member at byte ");
    SAYS("must be 0: this library (version 0.1.0) is older than the program");
    ck_assert_int_eq(sadmm_world_body_def_sized(world, id, &body.known, sizeof body), SADMM_OK);
    ck_assert(body.known.struct_size == sizeof body && body.known.mass == 1 && body.more == 0);
    ck_assert_int_eq(sadmm_world_report_sized(world, &report.known, sizeof report), SADMM_OK);
    ck_assert(report.known.step == 0 && report.more == 0);
}
END_TEST

START_TEST(parts_may_be_larger_than_the_library_knows)
{
    struct later_world_def def;
    struct later_joint_def joint;
    sadmm_world_def *const d = (sadmm_world_def *)&def;
    sadmm_joint_def *const j = (sadmm_joint_def *)&joint;
    sadmm_world *made = NULL;
    sadmm_joint_id hinge;
    GUARD(def), GUARD(joint);
    sadmm_world_def_init(d, sizeof def, sizeof def.settings);
    ck_assert(def.settings.known.struct_size == sizeof def.settings && def.settings.more == 0 && def.more == 0);
    def.settings.known.threads = 3; /* the last known member of the settings */
    ck_assert_int_eq(sadmm_world_create(d, &made), SADMM_OK);
    ck_assert_int_eq(sadmm_world_settings(made).threads, 3);
    sadmm_world_destroy(made);
    def.settings.more = 1;
    REFUSED(sadmm_world_create(d, &made), "def: a member at byte ");
    def.settings.more = 0, def.more = 1;
    REFUSED(sadmm_world_create(d, &made), "def: a member at byte ");
    ck_assert_ptr_null(made);

    sadmm_joint_def_init(j, sizeof joint, sizeof *joint.coordinates);
    ck_assert(j->coordinate_size == sizeof *joint.coordinates && joint.more == 0);
    for (int k = 0; k < 6; ++k)
        ck_assert(isinf(joint.coordinates[k].known.drive_force) && joint.coordinates[k].more == 0);
    j->kind = SADMM_JOINT_REVOLUTE;
    j->body_b = ball;
    joint.coordinates[5].known.armature = 4;
    joint.name = "hinge", joint.user_data = &world; /* behind the larger coordinates */
    ck_assert_int_eq(sadmm_world_add_joint(world, j, &hinge), SADMM_OK);
    sadmm_joint_def back;
    ck_assert_int_eq(sadmm_world_joint_def(world, hinge, &back), SADMM_OK);
    ck_assert(back.coordinates[5].armature == 4 && back.coordinates[4].armature == 0);
    ck_assert(strcmp(back.name, "hinge") == 0 && back.user_data == &world);
    GUARD(joint);
    ck_assert_int_eq(sadmm_world_joint_def_sized(world, hinge, j, sizeof joint, sizeof *joint.coordinates), SADMM_OK);
    ck_assert(joint.coordinates[5].known.armature == 4 && joint.coordinates[5].more == 0 && joint.more == 0);
    ck_assert(strcmp(joint.name, "hinge") == 0 && joint.user_data == &world);
    joint.coordinates[3].more = 1;
    REFUSED(sadmm_world_add_joint(world, j, &hinge), "def: a member at byte ");
    joint.coordinates[5].more = 1;
    REFUSED(
        sadmm_world_set_joint_coordinate_sized(world, hinge, 5, &joint.coordinates[5].known, sizeof *joint.coordinates),
        "coordinate: a member at byte ");
}
END_TEST

/* ---- sizes that are none ----------------------------------------------------------------------------------------- */

START_TEST(structs_that_were_not_begun_are_refused)
{
    char small[8];
    sadmm_body_id id;
    sadmm_body_def body = {.type = SADMM_BODY_STATIC};
    sadmm_shape_def shape = {.type = SADMM_SHAPE_SPHERE, .size = {1}};
    sadmm_settings settings = {.dt = 0.01};
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_query_filter filter = {.body_types = 1};
    const sadmm_ray ray = {.direction = {1, 0, 0}, .length = 1};
    sadmm_ray_hit hit;
    sadmm_world *made;
    REFUSED(sadmm_world_add_body(world, &body, &id), "def->struct_size = 0: must be in [");
    SAYS("start from sadmm_body_def_default()");
    body.struct_size = sizeof(struct first_body_def) - 8;
    REFUSED(sadmm_world_add_body(world, &body, &id), "def->struct_size = ");
    body.struct_size = (size_t)1 << 40;
    REFUSED(sadmm_world_add_body(world, &body, &id), "def->struct_size = 1099511627776: must be in [");
    REFUSED(sadmm_world_add_shape(world, ground, &shape, NULL), "start from sadmm_shape_def_default()");
    REFUSED(sadmm_world_set_settings(world, &settings), "settings->struct_size = 0: must be in [");
    REFUSED(sadmm_world_cast_ray(world, &ray, &filter, &hit), "filter->struct_size = 0: must be in [");
    def.settings = settings;
    REFUSED(sadmm_world_create(&def, &made), "def->settings.struct_size = 0: must be in [");
    def.settings = sadmm_settings_default();
    def.settings.struct_size += 8; /* so that it reaches beyond the definition */
    REFUSED(sadmm_world_create(&def, &made), "with def->settings.struct_size");
    joint.coordinate_size = 0;
    REFUSED(sadmm_world_add_joint(world, &joint, NULL), "def->coordinate_size = 0: must be in [");
    joint.coordinate_size = sizeof *joint.coordinates + 8;
    REFUSED(sadmm_world_add_joint(world, &joint, NULL), "with def->coordinate_size");
    REFUSED(sadmm_world_body_def_sized(world, ball, (sadmm_body_def *)small, sizeof small), "size = 8: must be in [");
    REFUSED(sadmm_world_report_sized(world, (sadmm_step_report *)small, sizeof small), "size = 8: must be in [");
    REFUSED(sadmm_backend_query_sized(SADMM_BACKEND_CPU, (sadmm_backend_info *)small, sizeof small),
            "size = 8: must be in [");
    sadmm_body_def_init((sadmm_body_def *)small, 0); /* nothing is written */
}
END_TEST

/* ---- a later library --------------------------------------------------------------------------------------------- */

/* What a later library has of a struct, beside what the program was compiled with: everywhere one member more, whose
 * default is not 0. */
struct old_part { double x; };
struct old_def { size_t struct_size, part_size; double y; struct old_part parts[2]; };
struct new_part { double x, more; };
struct new_def { size_t struct_size, part_size; double y; struct new_part parts[2]; double z; };
static const struct new_def new_defaults = {.y = 1, .parts = {{2, 3}, {4, 5}}, .z = 6};
static const struct sadmm_growing later = {.size = sizeof(struct new_def),
                                           .least = sizeof(struct old_def),
                                           .defaults = &new_defaults,
                                           .start = "new_default()",
                                           .part_count = 2,
                                           .part_at = offsetof(struct new_def, parts),
                                           .part_size = sizeof(struct new_part),
                                           .part_least = sizeof(struct old_part),
                                           .part_size_at = offsetof(struct new_def, part_size),
                                           .part_name = "part_size"};

START_TEST(a_later_library_takes_and_gives_older_structs)
{
    GUARDED(struct old_def) old;
    struct new_def taken;
    GUARD(old);
    sadmm_growing_init(&later, &old.of, sizeof old.of, sizeof *old.of.parts);
    UNTOUCHED(old);
    ck_assert(old.of.struct_size == sizeof old.of && old.of.part_size == sizeof *old.of.parts);
    ck_assert(old.of.y == 1 && old.of.parts[0].x == 2 && old.of.parts[1].x == 4);
    old.of.y = 10, old.of.parts[0].x = 20, old.of.parts[1].x = 40;
    ck_assert_int_eq(sadmm_growing_take(&later, &taken, &old.of, "def", NULL), SADMM_OK);
    ck_assert(taken.y == 10 && taken.parts[0].x == 20 && taken.parts[1].x == 40);
    ck_assert(taken.parts[0].more == 3 && taken.parts[1].more == 5 && taken.z == 6); /* defaults */
    ck_assert(taken.struct_size == sizeof taken && taken.part_size == sizeof *taken.parts);
    GUARD(old);
    ck_assert_int_eq(sadmm_growing_give(&later, &old.of, sizeof old.of, sizeof *old.of.parts, &taken, "def", NULL),
                     SADMM_OK);
    UNTOUCHED(old);
    ck_assert(old.of.struct_size == sizeof old.of && old.of.part_size == sizeof *old.of.parts);
    ck_assert(old.of.y == 10 && old.of.parts[0].x == 20 && old.of.parts[1].x == 40);
    old.of.struct_size -= 8;
    REFUSED(sadmm_growing_take(&later, &taken, &old.of, "def", NULL), "def->struct_size = 32: must be in [40, 65536]");
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("versions");
    TCase *cases = tcase_create("versions");
    tcase_add_checked_fixture(cases, begin, end);
    tcase_add_test(cases, header_and_library_have_one_version);
    tcase_add_test(cases, members_are_where_they_were);
    tcase_add_test(cases, later_members_are_behind_the_first_version);
    tcase_add_test(cases, programs_of_the_first_version_go_on);
    tcase_add_test(cases, programs_of_a_later_version_may_leave_out_what_is_new);
    tcase_add_test(cases, parts_may_be_larger_than_the_library_knows);
    tcase_add_test(cases, structs_that_were_not_begun_are_refused);
    tcase_add_test(cases, a_later_library_takes_and_gives_older_structs);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
