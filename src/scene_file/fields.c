#include "fields.h"

#include <math.h>
#include <string.h>

#include "core/base/settings_fields.h"

#define COUNT(list) (sizeof(list) / sizeof *(list))

/* ---- names ------------------------------------------------------------------------------------------------------- */

const char *const sadmm_shape_names[SADMM_SHAPE_TYPE_COUNT] = {
    [SADMM_SHAPE_PLANE] = "plane",       [SADMM_SHAPE_SPHERE] = "sphere", [SADMM_SHAPE_CAPSULE] = "capsule",
    [SADMM_SHAPE_BOX] = "box",           [SADMM_SHAPE_HULL] = "hull",     [SADMM_SHAPE_MESH] = "mesh",
    [SADMM_SHAPE_CYLINDER] = "cylinder", [SADMM_SHAPE_CONE] = "cone",     [SADMM_SHAPE_ELLIPSOID] = "ellipsoid",
};
static const size_t shape_sizes[SADMM_SHAPE_TYPE_COUNT] = {
    [SADMM_SHAPE_PLANE] = 0,    [SADMM_SHAPE_SPHERE] = 1, [SADMM_SHAPE_CAPSULE] = 2,
    [SADMM_SHAPE_BOX] = 3,      [SADMM_SHAPE_HULL] = 0,   [SADMM_SHAPE_MESH] = 0,
    [SADMM_SHAPE_CYLINDER] = 2, [SADMM_SHAPE_CONE] = 2,   [SADMM_SHAPE_ELLIPSOID] = 3,
};
const char *const sadmm_method_names[SADMM_METHOD_COUNT] = {
    [SADMM_METHOD_PAPER] = "paper",
    [SADMM_METHOD_FAST] = "fast",
};
static const char *const precisions[] = {[SADMM_F32] = "f32", [SADMM_F64] = "f64"};
static const char *const body_types[] = {
    [SADMM_BODY_DYNAMIC] = "dynamic", [SADMM_BODY_STATIC] = "static", [SADMM_BODY_KINEMATIC] = "kinematic",
};
static const char *const joint_kinds[SADMM_JOINT_KIND_COUNT] = {
    [SADMM_JOINT_FIXED] = "fixed",         [SADMM_JOINT_REVOLUTE] = "revolute",
    [SADMM_JOINT_PRISMATIC] = "prismatic", [SADMM_JOINT_CYLINDRICAL] = "cylindrical",
    [SADMM_JOINT_SPHERICAL] = "spherical", [SADMM_JOINT_UNIVERSAL] = "universal",
    [SADMM_JOINT_PLANAR] = "planar",       [SADMM_JOINT_CARTESIAN] = "cartesian",
    [SADMM_JOINT_CUSTOM] = "custom",       [SADMM_JOINT_DISTANCE] = "distance",
    [SADMM_JOINT_SPRING] = "spring",       [SADMM_JOINT_LINK] = "link",
};
static const char *const drives[SADMM_DRIVE_COUNT] = {
    [SADMM_DRIVE_OFF] = "off", [SADMM_DRIVE_SPEED] = "speed", [SADMM_DRIVE_POSITION] = "position",
};

size_t sadmm_shape_sizes(sadmm_shape_type type) { return shape_sizes[type]; }

/* ---- tables ------------------------------------------------------------------------------------------------------ */

#define AT(type, member) offsetof(type, member)
#define REAL(type, member) {#member, FIELD_REALS, AT(type, member), 1, NULL}
#define REALS(type, member, count) {#member, FIELD_REALS, AT(type, member), count, NULL}
#define OR_INFINITY(type, member) {#member, FIELD_OR_INFINITY, AT(type, member), 1, NULL}
#define BOOL(type, member) {#member, FIELD_BOOL, AT(type, member), 1, NULL}
#define INT32(type, member) {#member, FIELD_INT32, AT(type, member), 1, NULL}
#define UINT32(type, member) {#member, FIELD_UINT32, AT(type, member), 1, NULL}
#define NAME(type, member, names) {#member, FIELD_NAME, AT(type, member), (int)COUNT(names), names}
#define OTHER(member) {member, FIELD_OTHER, 0, 0, NULL}
#define TABLE(table, what, list) const struct sadmm_fields table = {what, list, COUNT(list)}

static const struct sadmm_field file_list[] = {
    OTHER("$schema"),
    OTHER("format"),
    OTHER("format_version"),
    OTHER("scene"),
    OTHER("name"),
    OTHER("n"),
    OTHER("m"),
    OTHER("description"),
    OTHER("units"),
    OTHER("duration"),
    OTHER("iterations"),
    OTHER("substeps"),
    NAME(sadmm_world_def, precision, precisions),
    REAL(sadmm_world_def, contact_margin),
    OTHER("friction_of_a_pair"),
    OTHER("settings"),
    OTHER("bodies"),
    OTHER("hulls"),
    OTHER("meshes"),
    OTHER("joints"),
    OTHER("couplings"),
    OTHER("gears"),
    OTHER("pair_friction"),
    OTHER("contact_off"),
    OTHER("version"),
    OTHER("commit"),
    OTHER("compiler"),
};
TABLE(sadmm_file_fields, "a scene file", file_list);

static const struct sadmm_field method_list[] = {
    {"paper", FIELD_INT32, SADMM_METHOD_PAPER * sizeof(int), 1, NULL},
    {"fast", FIELD_INT32, SADMM_METHOD_FAST * sizeof(int), 1, NULL},
};
TABLE(sadmm_method_fields, "what goes by method", method_list);

#define SETTING(X, kind, role, name, ...) SETTING_##kind(name),
#define SETTING_REAL(name) REAL(sadmm_settings, name)
#define SETTING_VECTOR(name) REALS(sadmm_settings, name, 3)
#define SETTING_WHOLE(name) INT32(sadmm_settings, name)
#define SETTING_FLAG(name) BOOL(sadmm_settings, name)
#define SETTING_METHOD(name) NAME(sadmm_settings, name, sadmm_method_names)
static const struct sadmm_field settings_list[] = {SADMM_SETTINGS(SETTING, )};
TABLE(sadmm_settings_fields, "settings", settings_list);

static const struct sadmm_field body_list[] = {
    OTHER("index"),
    OTHER("name"),
    NAME(sadmm_body_def, type, body_types),
    OTHER("mass"), /* sadmm_dynamic_fields */
    OTHER("inertia"),
    REALS(sadmm_body_def, position, 3),
    REALS(sadmm_body_def, orientation, 4),
    REALS(sadmm_body_def, linear_velocity, 3),
    REALS(sadmm_body_def, angular_velocity, 3),
    INT32(sadmm_body_def, environment),
    OTHER("gravity_scale"),
    OTHER("linear_damping"),
    OTHER("angular_damping"),
    OTHER("force"), /* sadmm_load_fields */
    OTHER("torque"),
    OTHER("move"),
    OTHER("shapes"),
};
TABLE(sadmm_body_fields, "a body", body_list);

static const struct sadmm_field dynamic_list[] = {
    REAL(sadmm_body_def, mass),
    REALS(sadmm_body_def, inertia, 3),
    REAL(sadmm_body_def, gravity_scale),
    REAL(sadmm_body_def, linear_damping),
    REAL(sadmm_body_def, angular_damping),
};
TABLE(sadmm_dynamic_fields, "a body", dynamic_list);

static const struct sadmm_field load_list[] = {
    REALS(struct sadmm_body_load, force, 3),
    REALS(struct sadmm_body_load, torque, 3),
};
TABLE(sadmm_load_fields, "a body", load_list);

static const struct sadmm_field move_list[] = {
    REALS(sadmm_body_state, position, 3),
    REALS(sadmm_body_state, orientation, 4),
};
TABLE(sadmm_move_fields, "a move", move_list);

static const struct sadmm_field shape_list[] = {
    OTHER("index"),
    NAME(sadmm_shape_def, type, sadmm_shape_names),
    OTHER("size"),
    REALS(sadmm_shape_def, position, 3),
    REALS(sadmm_shape_def, orientation, 4),
    REAL(sadmm_shape_def, friction),
    REAL(sadmm_shape_def, restitution),
    UINT32(sadmm_shape_def, category),
    UINT32(sadmm_shape_def, mask),
    BOOL(sadmm_shape_def, sensor),
    OTHER("hull"),
    OTHER("mesh"),
};
TABLE(sadmm_shape_fields, "a shape", shape_list);

static const struct sadmm_field hull_list[] = {
    OTHER("points"),
    REAL(sadmm_hull_def, merge),
    REAL(sadmm_hull_def, convex_radius),
};
TABLE(sadmm_hull_fields, "a hull", hull_list);

static const struct sadmm_field mesh_list[] = {
    OTHER("vertices"),
    OTHER("triangles"),
    OTHER("heights"),
    OTHER("spacing"),
};
TABLE(sadmm_mesh_fields, "a mesh", mesh_list);

static const struct sadmm_field joint_list[] = {
    NAME(sadmm_joint_def, kind, joint_kinds),
    UINT32(sadmm_joint_def, locks),
    OTHER("body_a"),
    OTHER("body_b"),
    REALS(sadmm_joint_def, position_a, 3),
    REALS(sadmm_joint_def, orientation_a, 4),
    REALS(sadmm_joint_def, position_b, 3),
    REALS(sadmm_joint_def, orientation_b, 4),
    REAL(sadmm_joint_def, length),
    BOOL(sadmm_joint_def, collide),
    BOOL(sadmm_joint_def, enabled),
    OR_INFINITY(sadmm_joint_def, break_force),
    OR_INFINITY(sadmm_joint_def, break_torque),
    OTHER("coordinates"),
};
TABLE(sadmm_joint_fields, "a joint", joint_list);

static const struct sadmm_field coordinate_list[] = {
    OTHER("limits"),
    NAME(sadmm_joint_coordinate, drive, drives),
    REAL(sadmm_joint_coordinate, target_position),
    REAL(sadmm_joint_coordinate, target_speed),
    REAL(sadmm_joint_coordinate, drive_stiffness),
    REAL(sadmm_joint_coordinate, drive_damping),
    OR_INFINITY(sadmm_joint_coordinate, drive_force),
    REAL(sadmm_joint_coordinate, friction),
    REAL(sadmm_joint_coordinate, spring_stiffness),
    REAL(sadmm_joint_coordinate, spring_damping),
    REAL(sadmm_joint_coordinate, spring_rest),
    REAL(sadmm_joint_coordinate, armature),
    OTHER("spring_table"),
};
TABLE(sadmm_coordinate_fields, "a coordinate", coordinate_list);

static const struct sadmm_field table_list[] = {
    OTHER("positions"),
    OTHER("forces"),
};
TABLE(sadmm_table_fields, "a spring table", table_list);

static const struct sadmm_field coupling_list[] = {
    OTHER("body"),
    REALS(sadmm_coupling_def, position, 3),
    REALS(sadmm_coupling_def, orientation, 4),
    REALS(sadmm_coupling_def, target_position, 3),
    REALS(sadmm_coupling_def, target_orientation, 4),
    REALS(sadmm_coupling_def, target_velocity, 6),
    REAL(sadmm_coupling_def, linear_stiffness),
    REAL(sadmm_coupling_def, linear_damping),
    REAL(sadmm_coupling_def, angular_stiffness),
    REAL(sadmm_coupling_def, angular_damping),
    OR_INFINITY(sadmm_coupling_def, max_force),
    OR_INFINITY(sadmm_coupling_def, max_torque),
    BOOL(sadmm_coupling_def, enabled),
};
TABLE(sadmm_coupling_fields, "a coupling", coupling_list);

static const struct sadmm_field gear_list[] = {
    OTHER("joint_1"),
    INT32(sadmm_gear_def, coordinate_1),
    OTHER("joint_2"),
    INT32(sadmm_gear_def, coordinate_2),
    REAL(sadmm_gear_def, ratio),
    {"offset", FIELD_OR_NAN, AT(sadmm_gear_def, offset), 1, NULL},
    BOOL(sadmm_gear_def, enabled),
};
TABLE(sadmm_gear_fields, "a gear", gear_list);

static const struct sadmm_field friction_list[] = {
    OTHER("body_a"),
    INT32(struct sadmm_shape_pair, shape_a),
    OTHER("body_b"),
    INT32(struct sadmm_shape_pair, shape_b),
    REAL(struct sadmm_shape_pair, friction),
};
TABLE(sadmm_friction_fields, "a pair's friction", friction_list);

static const struct sadmm_field off_list[] = {
    OTHER("body_a"),
    OTHER("body_b"),
};
TABLE(sadmm_off_fields, "a pair without contact", off_list);

/* ---- from fields to JSON ----------------------------------------------------------------------------------------- */

const struct sadmm_field *sadmm_find_field(const struct sadmm_fields *fields, const char *name)
{
    for (size_t k = 0; k < fields->count; ++k)
        if (strcmp(fields->list[k].name, name) == 0) return &fields->list[k];
    return NULL;
}

json_t *sadmm_json_real(double x) { return isfinite(x) ? json_real(x) : json_null(); }

json_t *sadmm_json_reals(const double *x, size_t count)
{
    json_t *array = json_array();
    for (size_t k = 0; k < count; ++k)
        if (json_array_append_new(array, sadmm_json_real(x[k])) != 0) {
            json_decref(array);
            return NULL;
        }
    return array;
}

static json_t *value_of(const struct sadmm_field *field, const void *from)
{
    if (field->kind == FIELD_OTHER) return json_null(); /* of some tables all are, and there is nothing to write */
    const char *const at = (const char *)from + field->offset;
    int32_t number;
    uint32_t bits;
    bool flag;
    switch (field->kind) {
    case FIELD_REALS:
        return field->count == 1 ? sadmm_json_real(*(const double *)(const void *)at)
                                 : sadmm_json_reals((const double *)(const void *)at, (size_t)field->count);
    case FIELD_OR_INFINITY:
    case FIELD_OR_NAN: return sadmm_json_real(*(const double *)(const void *)at);
    case FIELD_BOOL: memcpy(&flag, at, sizeof flag); return json_boolean(flag);
    case FIELD_INT32: memcpy(&number, at, sizeof number); return json_integer(number);
    case FIELD_UINT32: memcpy(&bits, at, sizeof bits); return json_integer(bits);
    case FIELD_NAME:
        memcpy(&number, at, sizeof number);
        return number >= 0 && number < field->count ? json_string(field->names[number]) : json_null();
    case FIELD_OTHER: break;
    }
    return json_null();
}

bool sadmm_write_fields(json_t *object, const struct sadmm_fields *fields, const void *from)
{
    for (size_t k = 0; k < fields->count; ++k)
        if (json_object_set_new(object, fields->list[k].name, value_of(&fields->list[k], from)) != 0) return false;
    return true;
}

bool sadmm_json_add_build(json_t *object)
{
    return json_object_set_new(object, "version", json_string(sadmm_version())) == 0 &&
           json_object_set_new(object, "commit", json_string(sadmm_build_commit())) == 0 &&
           json_object_set_new(object, "compiler", json_string(sadmm_build_compiler())) == 0;
}
