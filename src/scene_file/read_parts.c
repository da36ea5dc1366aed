/* What is between bodies in a scene file: joints, couplings, gears, what is set for pairs. */
#include <math.h>

#include "core/base/memory.h"
#include "orientation.h"
#include "read_parts.h"
#include "read_shape.h"

static sadmm_body_id body_of(const struct sadmm_filler *f, int64_t number)
{
    return number < 0 ? (sadmm_body_id){0, 0} : f->bodies[number];
}

/* Two bodies of the object at hand, numbers in its members body_a and body_b. */
static sadmm_status read_two_bodies(struct sadmm_filler *f, const json_t *object, int64_t bodies[2])
{
    TRY(sadmm_read_body(f, object, "body_a", &bodies[0]));
    TRY(sadmm_read_body(f, object, "body_b", &bodies[1]));
    if (bodies[0] == bodies[1] && bodies[0] >= 0)
        return sadmm_refuse(&f->reader, "body_b", "must be another body than body_a, is %lld", (long long)bodies[1]);
    return SADMM_OK;
}

/* Every element of a list of the file, one after the other. */
static sadmm_status read_list(struct sadmm_filler *f, const char *name,
                              sadmm_status (*read)(struct sadmm_filler *f, const json_t *object, size_t number))
{
    json_t *list;
    TRY(sadmm_read_array(&f->reader, f->root, name, &list));
    for (size_t k = 0; k < json_array_size(list); ++k) {
        const size_t before = sadmm_enter(&f->reader, "%s[%zu]", name, k);
        TRY(read(f, json_array_get(list, k), k));
        sadmm_leave(&f->reader, before);
    }
    return SADMM_OK;
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

/* null, or [lower, upper], of which null is infinite. */
static sadmm_status read_limits(const struct sadmm_filler *f, const json_t *value, sadmm_joint_coordinate *c)
{
    if (!value || json_is_null(value)) return SADMM_OK;
    if (!json_is_array(value) || json_array_size(value) != 2)
        return sadmm_refuse_value(&f->reader, "limits", "null or an array of 2 numbers", value);
    const json_t *lower = json_array_get(value, 0), *upper = json_array_get(value, 1);
    c->limited = true;
    c->lower = -INFINITY;
    c->upper = INFINITY;
    if (!json_is_null(lower)) TRY(sadmm_read_real(&f->reader, "limits[0]", lower, &c->lower));
    if (!json_is_null(upper)) TRY(sadmm_read_real(&f->reader, "limits[1]", upper, &c->upper));
    return SADMM_OK;
}

/* Of an array of six; those that are null, or not there with it, stay as they are. */
static sadmm_status read_coordinates(struct sadmm_filler *f, const json_t *list, sadmm_joint_def *def)
{
    if (!list) return SADMM_OK;
    if (!json_is_array(list) || json_array_size(list) != 6)
        return sadmm_refuse_value(&f->reader, "coordinates", "an array of 6", list);
    for (size_t k = 0; k < 6; ++k) {
        const json_t *object = json_array_get(list, k);
        if (json_is_null(object)) continue;
        const size_t before = sadmm_enter(&f->reader, "coordinates[%zu]", k);
        TRY(sadmm_read_fields(&f->reader, object, &sadmm_coordinate_fields, &def->coordinates[k]));
        TRY(read_limits(f, json_object_get(object, "limits"), &def->coordinates[k]));
        sadmm_leave(&f->reader, before);
    }
    return SADMM_OK;
}

/* One of the two lists of a table. */
static sadmm_status read_points(const struct sadmm_filler *f, const json_t *table, const char *member, double *points,
                                size_t *count)
{
    json_t *list;
    TRY(sadmm_read_array(&f->reader, table, member, &list));
    *count = json_array_size(list);
    if (*count < 2 || *count > SADMM_MOST_SPRING_POINTS)
        return sadmm_refuse(&f->reader, member, "must have 2 to %d numbers, has %zu", SADMM_MOST_SPRING_POINTS, *count);
    return sadmm_read_reals(&f->reader, member, list, points, *count);
}

static sadmm_status read_table(struct sadmm_filler *f, const json_t *table, sadmm_joint_id id, int32_t index)
{
    double positions[SADMM_MOST_SPRING_POINTS], forces[SADMM_MOST_SPRING_POINTS];
    size_t count, loads;
    TRY(sadmm_read_fields(&f->reader, table, &sadmm_table_fields, NULL));
    TRY(read_points(f, table, "positions", positions, &count));
    TRY(read_points(f, table, "forces", forces, &loads));
    if (loads != count)
        return sadmm_refuse(&f->reader, "forces", "must have %zu numbers, as positions has, has %zu", count, loads);
    return sadmm_refuse_world(
        f, sadmm_world_set_joint_spring_table(f->world, id, index, positions, forces, (int32_t)count), ".");
}

static sadmm_status read_tables(struct sadmm_filler *f, const json_t *list, sadmm_joint_id id)
{
    for (size_t k = 0; k < json_array_size(list); ++k) {
        const json_t *table = json_object_get(json_array_get(list, k), "spring_table");
        if (!table || json_is_null(table)) continue;
        const size_t before = sadmm_enter(&f->reader, "coordinates[%zu].spring_table", k);
        TRY(read_table(f, table, id, (int32_t)k));
        sadmm_leave(&f->reader, before);
    }
    return SADMM_OK;
}

static bool moves(const struct sadmm_filler *f, int64_t body)
{
    return body >= 0 && f->body_types[body] == SADMM_BODY_DYNAMIC;
}

static sadmm_status read_joint(struct sadmm_filler *f, const json_t *object, size_t number)
{
    sadmm_joint_def def = sadmm_joint_def_default(), made;
    int64_t bodies[2];
    TRY(sadmm_read_fields(&f->reader, object, &sadmm_joint_fields, &def));
    TRY(read_two_bodies(f, object, bodies));
    if (!moves(f, bodies[0]) && !moves(f, bodies[1]))
        return sadmm_refuse(&f->reader, "body_a, body_b", "one of them must be dynamic");
    const json_t *coordinates = json_object_get(object, "coordinates");
    TRY(read_coordinates(f, coordinates, &def));
    TRY(sadmm_read_object_name(f, object, &def.name));
    def.body_a = body_of(f, bodies[0]);
    def.body_b = body_of(f, bodies[1]);
    sadmm_pose_in_body(f, bodies[0], def.position_a, def.orientation_a);
    sadmm_pose_in_body(f, bodies[1], def.position_b, def.orientation_b);
    sadmm_before_unit(def.orientation_a);
    sadmm_before_unit(def.orientation_b);
    TRY(sadmm_refuse_world(f, sadmm_world_add_joint(f->world, &def, &f->joints[number]), ": "));
    TRY(sadmm_refuse_world(f, sadmm_world_joint_def(f->world, f->joints[number], &made), ": "));
    if (json_object_get(object, "locks") && def.locks != made.locks)
        return sadmm_refuse(&f->reader, "locks", "must be %u, what this kind of joint locks, or left out, is %u",
                            made.locks, def.locks);
    return read_tables(f, coordinates, f->joints[number]);
}

static sadmm_status read_joints(struct sadmm_filler *f)
{
    json_t *list;
    TRY(sadmm_read_array(&f->reader, f->root, "joints", &list));
    f->joint_count = json_array_size(list);
    f->joints = (sadmm_joint_id *)sadmm_alloc(f->joint_count, sizeof *f->joints);
    if (!f->joints) return sadmm_fail_memory(f->reader.error, "the joints of a scene file");
    return read_list(f, "joints", read_joint);
}

/* ---- couplings and gears ----------------------------------------------------------------------------------------- */

static sadmm_status read_coupling(struct sadmm_filler *f, const json_t *object, size_t number)
{
    sadmm_coupling_def def = sadmm_coupling_def_default();
    int64_t body;
    (void)number;
    TRY(sadmm_read_fields(&f->reader, object, &sadmm_coupling_fields, &def));
    TRY(sadmm_read_body(f, object, "body", &body));
    if (!moves(f, body)) return sadmm_refuse(&f->reader, "body", "must be a dynamic body");
    TRY(sadmm_read_object_name(f, object, &def.name));
    def.body = body_of(f, body);
    sadmm_pose_in_body(f, body, def.position, def.orientation);
    sadmm_before_unit(def.orientation);
    sadmm_before_unit(def.target_orientation);
    return sadmm_refuse_world(f, sadmm_world_add_coupling(f->world, &def, NULL), ": ");
}

/* A joint, by its number or its name. */
static sadmm_status read_joint_of(const struct sadmm_filler *f, const json_t *object, const char *member,
                                  sadmm_joint_id *id)
{
    int64_t number;
    const json_t *value = json_object_get(object, member);
    if (json_is_string(value)) {
        if (sadmm_world_joint_named(f->world, json_string_value(value), id) == SADMM_OK) return SADMM_OK;
        return sadmm_refuse_value(&f->reader, member, "the name of one joint", value);
    }
    TRY(sadmm_read_number_in(f, object, member, f->joint_count, &number));
    *id = f->joints[number];
    return SADMM_OK;
}

static sadmm_status read_gear(struct sadmm_filler *f, const json_t *object, size_t number)
{
    sadmm_gear_def def = sadmm_gear_def_default();
    (void)number;
    TRY(sadmm_read_fields(&f->reader, object, &sadmm_gear_fields, &def));
    TRY(read_joint_of(f, object, "joint_1", &def.joint_1));
    TRY(read_joint_of(f, object, "joint_2", &def.joint_2));
    TRY(sadmm_read_object_name(f, object, &def.name));
    return sadmm_refuse_world(f, sadmm_world_add_gear(f->world, &def, NULL), ": ");
}

/* ---- pairs ------------------------------------------------------------------------------------------------------- */

/* A shape by its place in the list of a body. */
static sadmm_status find_shape(const struct sadmm_filler *f, const char *member, int64_t body, int32_t place,
                               sadmm_shape_id *id)
{
    const size_t first = f->first_shape[body], count = f->first_shape[body + 1] - first;
    if (place < 0 || (size_t)place >= count)
        return sadmm_refuse(&f->reader, member, "must be in [0, %zu), the shapes of the body, is %d", count, place);
    *id = f->shapes[first + (size_t)place];
    return SADMM_OK;
}

static sadmm_status read_friction(struct sadmm_filler *f, const json_t *object, size_t number)
{
    struct sadmm_shape_pair pair = {.friction = -2};
    sadmm_shape_id shapes[2];
    int64_t bodies[2];
    TRY(sadmm_read_fields(&f->reader, object, &sadmm_friction_fields, &pair));
    TRY(sadmm_read_body(f, object, "body_a", &bodies[0]));
    TRY(sadmm_read_body(f, object, "body_b", &bodies[1]));
    for (int k = 0; k < 2; ++k)
        if (bodies[k] < 0) return sadmm_refuse(&f->reader, k ? "body_b" : "body_a", "must be a body");
    TRY(find_shape(f, "shape_a", bodies[0], pair.shape_a, &shapes[0]));
    TRY(find_shape(f, "shape_b", bodies[1], pair.shape_b, &shapes[1]));
    if (!json_object_get(object, "friction")) return sadmm_refuse(&f->reader, "friction", "is missing");
    if (pair.friction < 0) return sadmm_refuse(&f->reader, "friction", "must be in [0, 1e6], is %g", pair.friction);
    TRY(sadmm_refuse_world(f, sadmm_world_set_pair_friction(f->world, shapes[0], shapes[1], pair.friction), ": "));
    if ((size_t)sadmm_world_pair_friction_count(f->world) != number + 1)
        return sadmm_refuse(&f->reader, NULL, "must be another pair than those before it");
    return SADMM_OK;
}

static sadmm_status read_contact_off(struct sadmm_filler *f, const json_t *object, size_t number)
{
    int64_t bodies[2];
    TRY(sadmm_read_fields(&f->reader, object, &sadmm_off_fields, NULL));
    TRY(read_two_bodies(f, object, bodies));
    for (int k = 0; k < 2; ++k)
        if (bodies[k] < 0) return sadmm_refuse(&f->reader, k ? "body_b" : "body_a", "must be a body");
    TRY(sadmm_refuse_world(
        f, sadmm_world_set_body_pair_contact(f->world, f->bodies[bodies[0]], f->bodies[bodies[1]], false), ": "));
    if ((size_t)sadmm_world_body_pair_off_count(f->world) != number + 1)
        return sadmm_refuse(&f->reader, NULL, "must be another pair than those before it");
    return SADMM_OK;
}

sadmm_status sadmm_read_parts(struct sadmm_filler *f)
{
    TRY(read_joints(f));
    TRY(read_list(f, "couplings", read_coupling));
    TRY(read_list(f, "gears", read_gear));
    TRY(read_list(f, "pair_friction", read_friction));
    return read_list(f, "contact_off", read_contact_off);
}
