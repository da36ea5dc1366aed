#include "fields.h"

#include <math.h>
#include <string.h>

#include "core/base/definition_fields.h"
#include "core/base/settings_fields.h"

#define COUNT(list) (sizeof(list) / sizeof *(list))

/* ---- tables ------------------------------------------------------------------------------------------------------ */

#define MEMBER(type, kind, name) \
    {#name, SADMM_KIND_##kind, SADMM_IS_PLAIN, offsetof(type, name), 0, 0, SADMM_ENDS_ANY, ""}
#define OTHER(name) {name, SADMM_KIND_OTHER, SADMM_IS_OWN, 0, 0, 0, SADMM_ENDS_ANY, ""}
#define TABLE(table, what, list) const struct sadmm_fields table = {what, list, COUNT(list)}

/* Of a list: what files have under its own name; what of it is a field there. */
#define LISTED(type, kind, role, name, ...) LISTED_##role(type, kind, name)
#define LISTED_PLAIN(type, kind, name) MEMBER(type, kind, name),
#define LISTED_NUMBER(type, kind, name) MEMBER(type, kind, name),
#define LISTED_PLAN(type, kind, name) MEMBER(type, kind, name),
#define LISTED_OWN(type, kind, name) OTHER(#name),
#define LISTED_DYNAMIC(type, kind, name) OTHER(#name), /* sadmm_dynamic_fields */
#define LISTED_HIDDEN(type, kind, name)
/* Of a body's list: what dynamic ones have alone. */
#define DYNAMIC(type, kind, role, name, ...) DYNAMIC_##role(type, kind, name)
#define DYNAMIC_PLAIN(type, kind, name)
#define DYNAMIC_OWN(type, kind, name)
#define DYNAMIC_HIDDEN(type, kind, name)
#define DYNAMIC_DYNAMIC(type, kind, name) MEMBER(type, kind, name),

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
    {"precision", SADMM_FIELD_NAMED, SADMM_PRECISION_COUNT, sadmm_precision_names, SADMM_IS_PLAIN,
     offsetof(sadmm_world_def, precision), 0, 0, SADMM_ENDS_ANY, ""},
    MEMBER(sadmm_world_def, REAL, contact_margin),
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

#define OF_METHOD(X, value, name) \
    {name, SADMM_KIND_WHOLE, SADMM_IS_PLAIN, (size_t)(value) * sizeof(int), 0, 0, SADMM_ENDS_ANY, ""},
static const struct sadmm_field method_list[] = {SADMM_METHODS(OF_METHOD, )};
TABLE(sadmm_method_fields, "what goes by method", method_list);

static const struct sadmm_field settings_list[] = {SADMM_SETTINGS(LISTED, sadmm_settings)};
TABLE(sadmm_settings_fields, "settings", settings_list);

static const struct sadmm_field body_list[] = {
    OTHER("index"),
    SADMM_BODY_FIELDS(LISTED, sadmm_body_def)
    OTHER("density"),
    OTHER("force"), /* sadmm_load_fields */
    OTHER("torque"),
    OTHER("move"),
    OTHER("shapes"),
};
TABLE(sadmm_body_fields, "a body", body_list);

static const struct sadmm_field dynamic_list[] = {SADMM_BODY_FIELDS(DYNAMIC, sadmm_body_def)};
TABLE(sadmm_dynamic_fields, "a body", dynamic_list);

static const struct sadmm_field load_list[] = {
    MEMBER(struct sadmm_body_load, VECTOR, force),
    MEMBER(struct sadmm_body_load, VECTOR, torque),
};
TABLE(sadmm_load_fields, "a body", load_list);

static const struct sadmm_field move_list[] = {
    MEMBER(sadmm_body_state, VECTOR, position),
    MEMBER(sadmm_body_state, TURN, orientation),
};
TABLE(sadmm_move_fields, "a move", move_list);

static const struct sadmm_field shape_list[] = {OTHER("index"), SADMM_SHAPE_FIELDS(LISTED, sadmm_shape_def)};
TABLE(sadmm_shape_fields, "a shape", shape_list);

static const struct sadmm_field hull_list[] = {OTHER("points"), SADMM_HULL_FIELDS(LISTED, sadmm_hull_def)};
TABLE(sadmm_hull_fields, "a hull", hull_list);

static const struct sadmm_field mesh_list[] = {
    OTHER("vertices"),
    OTHER("triangles"),
    OTHER("heights"),
    OTHER("spacing"),
};
TABLE(sadmm_mesh_fields, "a mesh", mesh_list);

static const struct sadmm_field joint_list[] = {SADMM_JOINT_FIELDS(LISTED, sadmm_joint_def)};
TABLE(sadmm_joint_fields, "a joint", joint_list);

static const struct sadmm_field coordinate_list[] = {
    OTHER("limits"),
    SADMM_COORDINATE_FIELDS(LISTED, sadmm_joint_coordinate)
    OTHER("spring_table"),
};
TABLE(sadmm_coordinate_fields, "a coordinate", coordinate_list);

static const struct sadmm_field table_list[] = {
    OTHER("positions"),
    OTHER("forces"),
};
TABLE(sadmm_table_fields, "a spring table", table_list);

static const struct sadmm_field coupling_list[] = {SADMM_COUPLING_FIELDS(LISTED, sadmm_coupling_def)};
TABLE(sadmm_coupling_fields, "a coupling", coupling_list);

static const struct sadmm_field gear_list[] = {SADMM_GEAR_FIELDS(LISTED, sadmm_gear_def)};
TABLE(sadmm_gear_fields, "a gear", gear_list);

static const struct sadmm_field friction_list[] = {
    OTHER("body_a"),
    MEMBER(struct sadmm_shape_pair, WHOLE, shape_a),
    OTHER("body_b"),
    MEMBER(struct sadmm_shape_pair, WHOLE, shape_b),
    MEMBER(struct sadmm_shape_pair, REAL, friction),
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
    /* of some tables all are, and there is nothing to write */
    if (field->kind == SADMM_FIELD_OTHER) return json_null();
    const char *const at = (const char *)from + field->offset;
    int32_t number;
    uint32_t bits;
    bool flag;
    switch (field->kind) {
    case SADMM_FIELD_REALS:
    case SADMM_FIELD_TURN:
        return field->count == 1 ? sadmm_json_real(*(const double *)(const void *)at)
                                 : sadmm_json_reals((const double *)(const void *)at, (size_t)field->count);
    case SADMM_FIELD_BOUND:
    case SADMM_FIELD_MEASURED: return sadmm_json_real(*(const double *)(const void *)at);
    case SADMM_FIELD_FLAG: memcpy(&flag, at, sizeof flag); return json_boolean(flag);
    case SADMM_FIELD_WHOLE: memcpy(&number, at, sizeof number); return json_integer(number);
    case SADMM_FIELD_BITS: memcpy(&bits, at, sizeof bits); return json_integer(bits);
    case SADMM_FIELD_NAMED:
        memcpy(&number, at, sizeof number);
        return number >= 0 && number < field->count ? json_string(field->names[number]) : json_null();
    case SADMM_FIELD_ID:
    case SADMM_FIELD_OTHER: break;
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
