/* Many numbers in one call: a row a body, shape, joint or coupling, or one. A kind says how wide it is, what its rows
 * are of, and how one of them is read, checked and set; the rest is the same for all. */
#include "subadmm/arrays.h"

#include <string.h>

#include "body_check.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/solve/resident.h"
#include "coupling.h"
#include "joint.h"
#include "joint_place.h"
#include "shape.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"
#include "world/state/shape_form.h"
#include "world/state/report.h"

enum owner { OF_BODY, OF_SHAPE, OF_JOINT, OF_COUPLING, OF_WORLD };
enum { STATE_COLUMNS = 13 };

struct array_kind {
    const char *name;
    int32_t columns;
    enum owner owner;
    sadmm_status (*get)(sadmm_world *world, size_t slot, double *row);
    /* NULL: read only. `check`: may the row be set? */
    sadmm_status (*check)(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error);
    sadmm_status (*set)(sadmm_world *world, size_t slot, const double *row);
};

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static bool dynamic(const sadmm_world *world, size_t slot) { return world->bodies[slot].type == SADMM_BODY_DYNAMIC; }

static void store_motion(const struct sadmm_rigid *rigid, double *row)
{
    memcpy(row, rigid->position, 3 * sizeof *row);
    memcpy(row + 3, rigid->orientation, 4 * sizeof *row);
    memcpy(row + 7, rigid->velocity, 6 * sizeof *row);
}

static sadmm_body_state state_of(const double *row)
{
    sadmm_body_state state;
    memcpy(state.position, row, sizeof state.position);
    memcpy(state.orientation, row + 3, sizeof state.orientation);
    memcpy(state.linear_velocity, row + 7, sizeof state.linear_velocity);
    memcpy(state.angular_velocity, row + 10, sizeof state.angular_velocity);
    return state;
}

static sadmm_status get_state(sadmm_world *world, size_t slot, double *row)
{
    store_motion(&world->bodies[slot].rigid, row);
    return SADMM_OK;
}

static sadmm_status check_state(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    const sadmm_body_state state = state_of(row);
    double ignored[4];
    return sadmm_world_check_body_state(&world->bodies[slot], &state, ignored, error);
}

static sadmm_status set_state(sadmm_world *world, size_t slot, const double *row)
{
    const struct sadmm_world_body *body = &world->bodies[slot];
    const sadmm_body_state state = state_of(row);
    double now[STATE_COLUMNS];
    store_motion(&body->rigid, now);
    /* Such a body is part of what a backend was given once. */
    if (body->type == SADMM_BODY_STATIC && memcmp(now, row, sizeof now) == 0) return SADMM_OK;
    return sadmm_world_set_body_state(world, sadmm_world_body_id(world, slot), &state);
}

static sadmm_status get_wrench(sadmm_world *world, size_t slot, double *row)
{
    memcpy(row, world->bodies[slot].rigid.wrench, 6 * sizeof *row);
    return SADMM_OK;
}

/* Of bodies that are not dynamic: 0, as it is read. */
static sadmm_status check_none(sadmm_world *world, size_t slot, const double *row, int count, struct sadmm_error *error)
{
    for (int k = 0; k < count; ++k)
        if (!(row[k] == 0))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "column %d = %g: must be 0, for the body is %s", k,
                              row[k], sadmm_body_type_names[world->bodies[slot].type]);
    return SADMM_OK;
}

static sadmm_status check_wrench(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    return dynamic(world, slot) ? sadmm_world_check_wrench(row, row + 3, error)
                                : check_none(world, slot, row, 6, error);
}

static sadmm_status set_wrench(sadmm_world *world, size_t slot, const double *row)
{
    return dynamic(world, slot) ? sadmm_world_set_body_wrench(world, sadmm_world_body_id(world, slot), row, row + 3)
                                : SADMM_OK;
}

static sadmm_status get_contact_wrench(sadmm_world *world, size_t slot, double *row)
{
    const struct sadmm_world_body *body = &world->bodies[slot];
    if (world->stepped && !world->plan.wrenches)
        return sadmm_fail(&world->error, SADMM_ERROR_UNAVAILABLE,
                          "contact wrenches: settings.recover_wrenches was false");
    if (world->stepped && body->type != SADMM_BODY_STATIC) memcpy(row, body->contact_wrench, 6 * sizeof *row);
    else memset(row, 0, 6 * sizeof *row);
    return SADMM_OK;
}

static sadmm_status get_inertia(sadmm_world *world, size_t slot, double *row)
{
    row[0] = world->bodies[slot].rigid.mass;
    memcpy(row + 1, world->bodies[slot].rigid.inertia, 3 * sizeof *row);
    return SADMM_OK;
}

static sadmm_status check_inertia(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    return dynamic(world, slot) ? sadmm_world_check_mass(world, row[0], row + 1, error)
                                : check_none(world, slot, row, 4, error);
}

static sadmm_status set_inertia(sadmm_world *world, size_t slot, const double *row)
{
    return dynamic(world, slot) ? sadmm_world_set_body_mass(world, sadmm_world_body_id(world, slot), row[0], row + 1)
                                : SADMM_OK;
}

static sadmm_status get_gravity_scale(sadmm_world *world, size_t slot, double *row)
{
    row[0] = dynamic(world, slot) ? world->bodies[slot].rigid.gravity_scale : 0;
    return SADMM_OK;
}

static sadmm_status check_gravity_scale(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    return dynamic(world, slot) ? sadmm_numbers_check(SADMM_BODY_FIELD(gravity_scale), row, "column 0", error)
                                : check_none(world, slot, row, 1, error);
}

static sadmm_status set_gravity_scale(sadmm_world *world, size_t slot, const double *row)
{
    return dynamic(world, slot) ? sadmm_world_set_body_gravity_scale(world, sadmm_world_body_id(world, slot), row[0])
                                : SADMM_OK;
}

static sadmm_status get_damping(sadmm_world *world, size_t slot, double *row)
{
    for (int k = 0; k < 2; ++k) row[k] = dynamic(world, slot) ? world->bodies[slot].rigid.damping[k] : 0;
    return SADMM_OK;
}

static sadmm_status check_damping(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    if (!dynamic(world, slot)) return check_none(world, slot, row, 2, error);
    TRY(sadmm_numbers_check(SADMM_BODY_FIELD(linear_damping), row, "column 0", error));
    return sadmm_numbers_check(SADMM_BODY_FIELD(angular_damping), row + 1, "column 1", error);
}

static sadmm_status set_damping(sadmm_world *world, size_t slot, const double *row)
{
    return dynamic(world, slot) ? sadmm_world_set_body_damping(world, sadmm_world_body_id(world, slot), row[0], row[1])
                                : SADMM_OK;
}

static sadmm_status get_acceleration(sadmm_world *world, size_t slot, double *row)
{
    const struct sadmm_extrapolation *last = &world->bodies[slot].extrapolation;
    const double dt = last->dt;
    for (int k = 0; k < 6; ++k) row[k] = dynamic(world, slot) && dt > 0 ? last->change[k] / dt : 0;
    return SADMM_OK;
}

/* ---- shapes ------------------------------------------------------------------------------------------------------ */

static sadmm_status get_material(sadmm_world *world, size_t slot, double *row)
{
    row[0] = world->shapes[slot].friction;
    row[1] = world->shapes[slot].restitution;
    return SADMM_OK;
}

static sadmm_status check_material(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    (void)world;
    (void)slot;
    TRY(sadmm_numbers_check(SADMM_SHAPE_FIELD(friction), row, "column 0", error));
    return sadmm_numbers_check(SADMM_SHAPE_FIELD(restitution), row + 1, "column 1", error);
}

static sadmm_status set_material(sadmm_world *world, size_t slot, const double *row)
{
    const struct sadmm_shape *shape = &world->shapes[slot];
    if (row[0] == shape->friction && row[1] == shape->restitution) return SADMM_OK;
    return sadmm_world_set_shape_material(world, sadmm_world_shape_id(world, slot), row[0], row[1]);
}

static sadmm_status get_size(sadmm_world *world, size_t slot, double *row)
{
    sadmm_world_read_shape_size(world, slot, row);
    return SADMM_OK;
}

static sadmm_status check_size(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    return sadmm_world_check_shape_size(world, slot, row, error);
}

static sadmm_status set_size(sadmm_world *world, size_t slot, const double *row)
{
    return sadmm_world_set_shape_size(world, sadmm_world_shape_id(world, slot), row);
}

static sadmm_status get_frame(sadmm_world *world, size_t slot, double *row)
{
    sadmm_world_read_shape_frame(world, slot, row);
    return SADMM_OK;
}

static sadmm_status check_frame(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    (void)world;
    (void)slot;
    return sadmm_world_check_shape_frame(row, row + 3, error);
}

static sadmm_status set_frame(sadmm_world *world, size_t slot, const double *row)
{
    return sadmm_world_set_shape_frame(world, sadmm_world_shape_id(world, slot), row, row + 3);
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

#define GET_OF_JOINT(name, member)                                                      \
    static sadmm_status name(sadmm_world *world, size_t slot, double *row)              \
    {                                                                                   \
        sadmm_joint_state state;                                                        \
        TRY(sadmm_world_joint_state(world, sadmm_world_joint_id(world, slot), &state)); \
        memcpy(row, state.member, sizeof state.member);                                 \
        return SADMM_OK;                                                                \
    }
GET_OF_JOINT(get_joint_drive_force, drive_force)
GET_OF_JOINT(get_joint_wrench, wrench_b)

static sadmm_status get_joint_position(sadmm_world *world, size_t slot, double *row)
{
    double speed[6];
    sadmm_world_read_joint_motion(world, &world->joints[slot], row, speed);
    return SADMM_OK;
}

static sadmm_status check_joint_position(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    (void)error; /* the world's */
    return sadmm_world_check_joint_positions(world, slot, row);
}

static sadmm_status get_joint_speed(sadmm_world *world, size_t slot, double *row)
{
    double position[6];
    sadmm_world_read_joint_motion(world, &world->joints[slot], position, row);
    return SADMM_OK;
}

static sadmm_status check_joint_speed(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    (void)error; /* the world's */
    return sadmm_world_check_joint_speeds(world, slot, row);
}

#define COORDINATES_OF_JOINT(member)                                                                                  \
    static sadmm_status get_##member(sadmm_world *world, size_t slot, double *row)                                    \
    {                                                                                                                 \
        for (int k = 0; k < JOINT_COORDINATES; ++k) row[k] = world->joints[slot].def.coordinates[k].member;           \
        return SADMM_OK;                                                                                              \
    }                                                                                                                 \
    static sadmm_status check_##member(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error) \
    {                                                                                                                 \
        for (int32_t k = 0; k < JOINT_COORDINATES; ++k) {                                                             \
            sadmm_joint_coordinate coordinate = world->joints[slot].def.coordinates[k];                               \
            if (row[k] == coordinate.member) continue;                                                                \
            coordinate.member = row[k];                                                                               \
            TRY(sadmm_world_check_coordinate(&world->joints[slot], k, &coordinate, error));                           \
        }                                                                                                             \
        return SADMM_OK;                                                                                              \
    }                                                                                                                 \
    static sadmm_status set_##member(sadmm_world *world, size_t slot, const double *row)                              \
    {                                                                                                                 \
        struct sadmm_world_joint *joint = &world->joints[slot];                                                       \
        for (int32_t k = 0; k < JOINT_COORDINATES; ++k) {                                                             \
            if (row[k] == joint->def.coordinates[k].member) continue;                                                 \
            joint->def.coordinates[k].member = row[k];                                                                \
            TRY(sadmm_world_take_update(world, joint, (enum sadmm_joint_update)k));                                   \
        }                                                                                                             \
        return SADMM_OK;                                                                                              \
    }
COORDINATES_OF_JOINT(target_position)
COORDINATES_OF_JOINT(target_speed)
COORDINATES_OF_JOINT(lower)
COORDINATES_OF_JOINT(upper)
COORDINATES_OF_JOINT(drive_stiffness)
COORDINATES_OF_JOINT(drive_damping)
COORDINATES_OF_JOINT(drive_force)
COORDINATES_OF_JOINT(friction)
COORDINATES_OF_JOINT(spring_stiffness)
COORDINATES_OF_JOINT(spring_damping)
COORDINATES_OF_JOINT(spring_rest)
COORDINATES_OF_JOINT(armature)

static sadmm_status get_joint_frame(sadmm_world *world, size_t slot, double *row)
{
    sadmm_world_read_joint_frames(&world->joints[slot], row);
    return SADMM_OK;
}

static sadmm_status check_joint_frame(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    (void)world;
    (void)slot;
    return sadmm_world_check_joint_frames(row, error);
}

static sadmm_status set_joint_frame(sadmm_world *world, size_t slot, const double *row)
{
    return sadmm_world_set_joint_frames(world, &world->joints[slot], row);
}

/* ---- couplings --------------------------------------------------------------------------------------------------- */

static sadmm_status get_target(sadmm_world *world, size_t slot, double *row)
{
    store_motion(&world->couplings[slot].last.target, row);
    return SADMM_OK;
}

static sadmm_status check_target(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    struct sadmm_rigid ignored;
    (void)world;
    (void)slot;
    return sadmm_world_check_target(row, row + 3, row + 7, &ignored, error);
}

static sadmm_status set_target(sadmm_world *world, size_t slot, const double *row)
{
    return sadmm_world_set_coupling_target(world, sadmm_world_coupling_id(world, slot), row, row + 3, row + 7);
}

static sadmm_status get_reaction(sadmm_world *world, size_t slot, double *row)
{
    memcpy(row, world->couplings[slot].last.reaction, 6 * sizeof *row);
    return SADMM_OK;
}

/* ---- the world --------------------------------------------------------------------------------------------------- */

static sadmm_status get_gravity(sadmm_world *world, size_t slot, double *row)
{
    (void)slot;
    memcpy(row, world->def.settings.gravity, 3 * sizeof *row);
    return SADMM_OK;
}

static sadmm_status check_gravity(sadmm_world *world, size_t slot, const double *row, struct sadmm_error *error)
{
    sadmm_settings settings = world->def.settings;
    (void)slot;
    memcpy(settings.gravity, row, sizeof settings.gravity);
    return sadmm_settings_validate(&settings, error);
}

static sadmm_status set_gravity(sadmm_world *world, size_t slot, const double *row)
{
    (void)slot;
    memcpy(world->def.settings.gravity, row, sizeof world->def.settings.gravity);
    return SADMM_OK;
}

static sadmm_status get_report(sadmm_world *world, size_t slot, double *row)
{
    (void)slot;
    TRY(sadmm_world_synchronise(world));
    sadmm_report_numbers(&world->report, row);
    return SADMM_OK;
}

/* ---- all --------------------------------------------------------------------------------------------------------- */

#define COORDINATE_KIND(name, member) {name, 6, OF_JOINT, get_##member, check_##member, set_##member}

static const struct array_kind kinds[SADMM_ARRAY_COUNT] = {
    [SADMM_ARRAY_BODY_STATE] = {"body_state", STATE_COLUMNS, OF_BODY, get_state, check_state, set_state},
    [SADMM_ARRAY_BODY_WRENCH] = {"body_wrench", 6, OF_BODY, get_wrench, check_wrench, set_wrench},
    [SADMM_ARRAY_BODY_CONTACT_WRENCH] = {"body_contact_wrench", 6, OF_BODY, get_contact_wrench, NULL, NULL},
    [SADMM_ARRAY_BODY_INERTIA] = {"body_inertia", 4, OF_BODY, get_inertia, check_inertia, set_inertia},
    [SADMM_ARRAY_JOINT_POSITION] = {"joint_position", 6, OF_JOINT, get_joint_position, check_joint_position,
                                    sadmm_world_set_joint_positions},
    [SADMM_ARRAY_JOINT_SPEED] = {"joint_speed", 6, OF_JOINT, get_joint_speed, check_joint_speed,
                                 sadmm_world_set_joint_speeds},
    [SADMM_ARRAY_JOINT_DRIVE_FORCE] = {"joint_drive_force", 6, OF_JOINT, get_joint_drive_force, NULL, NULL},
    [SADMM_ARRAY_JOINT_WRENCH] = {"joint_wrench", 6, OF_JOINT, get_joint_wrench, NULL, NULL},
    [SADMM_ARRAY_JOINT_TARGET_POSITION] = COORDINATE_KIND("joint_target_position", target_position),
    [SADMM_ARRAY_JOINT_TARGET_SPEED] = COORDINATE_KIND("joint_target_speed", target_speed),
    [SADMM_ARRAY_COUPLING_TARGET] = {"coupling_target", 13, OF_COUPLING, get_target, check_target, set_target},
    [SADMM_ARRAY_COUPLING_REACTION] = {"coupling_reaction", 6, OF_COUPLING, get_reaction, NULL, NULL},
    [SADMM_ARRAY_BODY_GRAVITY_SCALE] = {"body_gravity_scale", 1, OF_BODY, get_gravity_scale, check_gravity_scale,
                                        set_gravity_scale},
    [SADMM_ARRAY_BODY_DAMPING] = {"body_damping", 2, OF_BODY, get_damping, check_damping, set_damping},
    [SADMM_ARRAY_BODY_ACCELERATION] = {"body_acceleration", 6, OF_BODY, get_acceleration, NULL, NULL},
    [SADMM_ARRAY_JOINT_LOWER] = COORDINATE_KIND("joint_lower", lower),
    [SADMM_ARRAY_JOINT_UPPER] = COORDINATE_KIND("joint_upper", upper),
    [SADMM_ARRAY_JOINT_DRIVE_STIFFNESS] = COORDINATE_KIND("joint_drive_stiffness", drive_stiffness),
    [SADMM_ARRAY_JOINT_DRIVE_DAMPING] = COORDINATE_KIND("joint_drive_damping", drive_damping),
    [SADMM_ARRAY_JOINT_DRIVE_LIMIT] = COORDINATE_KIND("joint_drive_limit", drive_force),
    [SADMM_ARRAY_JOINT_FRICTION] = COORDINATE_KIND("joint_friction", friction),
    [SADMM_ARRAY_JOINT_SPRING_STIFFNESS] = COORDINATE_KIND("joint_spring_stiffness", spring_stiffness),
    [SADMM_ARRAY_JOINT_SPRING_DAMPING] = COORDINATE_KIND("joint_spring_damping", spring_damping),
    [SADMM_ARRAY_JOINT_SPRING_REST] = COORDINATE_KIND("joint_spring_rest", spring_rest),
    [SADMM_ARRAY_JOINT_ARMATURE] = COORDINATE_KIND("joint_armature", armature),
    [SADMM_ARRAY_SHAPE_MATERIAL] = {"shape_material", 2, OF_SHAPE, get_material, check_material, set_material},
    [SADMM_ARRAY_GRAVITY] = {"gravity", 3, OF_WORLD, get_gravity, check_gravity, set_gravity},
    [SADMM_ARRAY_REPORT] = {"report", 8, OF_WORLD, get_report, NULL, NULL},
    [SADMM_ARRAY_SHAPE_SIZE] = {"shape_size", 3, OF_SHAPE, get_size, check_size, set_size},
    [SADMM_ARRAY_SHAPE_FRAME] = {"shape_frame", 7, OF_SHAPE, get_frame, check_frame, set_frame},
    [SADMM_ARRAY_JOINT_FRAME] = {"joint_frame", SADMM_JOINT_FRAME_NUMBERS, OF_JOINT, get_joint_frame,
                                 check_joint_frame, set_joint_frame},
};

static const struct array_kind *kind_of(sadmm_array array)
{
    return (unsigned)array < SADMM_ARRAY_COUNT ? &kinds[array] : NULL;
}

const char *sadmm_array_name(sadmm_array array) { return kind_of(array) ? kind_of(array)->name : ""; }
int32_t sadmm_array_columns(sadmm_array array) { return kind_of(array) ? kind_of(array)->columns : 0; }
bool sadmm_array_is_settable(sadmm_array array) { return kind_of(array) && kind_of(array)->set; }

/* Whose objects have the rows; NULL: it is one row, of the world. */
static const struct sadmm_id_pool *ids_of(const sadmm_world *world, const struct array_kind *kind)
{
    switch (kind->owner) {
    case OF_BODY: return &world->body_ids;
    case OF_SHAPE: return &world->shape_ids;
    case OF_JOINT: return &world->joint_ids;
    case OF_COUPLING: return &world->coupling_ids;
    case OF_WORLD: break;
    }
    return NULL;
}

/* The slot of a row; of the row after that of `slot`. */
static size_t slot_of(const struct sadmm_id_pool *ids, int32_t row) { return ids ? sadmm_ids_at(ids, row) : 0; }
static size_t slot_after(const struct sadmm_id_pool *ids, size_t slot)
{
    return ids ? sadmm_ids_from(ids, slot + 1) : slot + 1;
}

int32_t sadmm_world_array_rows(const sadmm_world *world, sadmm_array array)
{
    const struct array_kind *kind = kind_of(array);
    if (!kind || !world) return 0;
    return kind->owner == OF_WORLD ? 1 : ids_of(world, kind)->count;
}

/* The array, its range and its numbers, and all that is needed from a device. */
static sadmm_status begin(sadmm_world *world, sadmm_array array, int32_t first, int32_t count, const double *values)
{
    struct sadmm_error *error = &world->error;
    const int32_t rows = sadmm_world_array_rows(world, array);
    if (!kind_of(array))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "array = %d: must be in [0, %d)", (int)array,
                          SADMM_ARRAY_COUNT);
    if (first < 0 || count < 0 || first > rows || count > rows - first)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "first = %d, count = %d: must be rows of the array, which has %d", first, count, rows);
    if (count > 0) TRY(sadmm_check_given(values, "values", error));
    TRY(sadmm_world_download_bodies(world));
    return sadmm_world_download_joints(world);
}

sadmm_status sadmm_world_get_array(sadmm_world *world, sadmm_array array, int32_t first, int32_t count, double *values)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(begin(world, array, first, count, values));
    const struct array_kind *kind = &kinds[array];
    const struct sadmm_id_pool *ids = ids_of(world, kind);
    size_t slot = count > 0 ? slot_of(ids, first) : 0;
    for (int32_t row = 0; row < count; ++row, slot = slot_after(ids, slot))
        TRY(kind->get(world, slot, values + (size_t)row * (size_t)kind->columns));
    return SADMM_OK;
}

/* The row that an error is of. */
static sadmm_status fail_row(sadmm_world *world, int32_t row, sadmm_status status)
{
    const struct sadmm_error cause = world->error;
    return sadmm_fail(&world->error, status, "values, row %d: %s", row, cause.message);
}

sadmm_status sadmm_world_set_array(sadmm_world *world, sadmm_array array, int32_t first, int32_t count,
                                   const double *values)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(begin(world, array, first, count, values));
    const struct array_kind *kind = &kinds[array];
    const struct sadmm_id_pool *ids = ids_of(world, kind);
    if (!kind->set)
        return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT, "array = %d: must be one that can be set",
                          (int)array);
    for (int setting = 0; setting < 2; ++setting) {
        size_t slot = count > 0 ? slot_of(ids, first) : 0;
        for (int32_t row = 0; row < count; ++row, slot = slot_after(ids, slot)) {
            const double *given = values + (size_t)row * (size_t)kind->columns;
            const sadmm_status status =
                setting ? kind->set(world, slot, given) : kind->check(world, slot, given, &world->error);
            if (status != SADMM_OK) return fail_row(world, row, status);
        }
    }
    return SADMM_OK;
}

/* ---- in a device's memory ---------------------------------------------------------------------------------------- */

static sadmm_status unavailable(sadmm_world *world, const char *why)
{
    return sadmm_fail(&world->error, SADMM_ERROR_UNAVAILABLE, "arrays of a device: %s", why);
}

sadmm_status sadmm_world_device_array(sadmm_world *world, sadmm_array array, sadmm_device_array *out)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_check_given(out, "out", &world->error));
    if (array != SADMM_ARRAY_BODY_STATE && array != SADMM_ARRAY_BODY_CONTACT_WRENCH)
        return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT,
                          "array = %d: must be SADMM_ARRAY_BODY_STATE or SADMM_ARRAY_BODY_CONTACT_WRENCH", (int)array);
    TRY(sadmm_world_synchronise(world));
    if (world->kernels && !world->kernels->resident) return unavailable(world, "the backend has no memory of its own");
    if (!world->resident.loaded || world->resident.done == 0)
        return unavailable(world, "the world is not there until the backend has made steps, from the first or from the "
                                  "last change on that is no state or wrench");
    if (world->resident.dirty_count > 0)
        return unavailable(world, "a state or a wrench was set that no step has taken along yet");
    if (array == SADMM_ARRAY_BODY_CONTACT_WRENCH && !world->plan.wrenches)
        return unavailable(world, "settings.recover_wrenches was false");
    struct sadmm_resident_view view;
    TRY(sadmm_world_contain(world, world->kernels->resident->view(world->context, &view, &world->error)));
    const bool state = array == SADMM_ARRAY_BODY_STATE;
    *out = (sadmm_device_array){
        .values = state ? view.rigid->position : view.wrench,
        .rows = world->dynamic_count,
        .columns = kinds[array].columns,
        .stride = state ? (int64_t)(sizeof *view.rigid / sizeof(double)) : kinds[array].columns,
        .device = world->def.device,
        .stream = view.stream,
    };
    return SADMM_OK;
}

sadmm_status sadmm_world_dynamic_bodies(sadmm_world *world, int32_t *indices, int32_t capacity, int32_t *count)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_check_given(count, "count", &world->error));
    *count = world->dynamic_count;
    if (!indices && capacity == 0) return SADMM_OK;
    TRY(sadmm_check_given(indices, "indices", &world->error));
    if (capacity < world->dynamic_count)
        return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT,
                          "capacity = %d: must be at least %d, the number of dynamic bodies", capacity,
                          world->dynamic_count);
    int32_t index = 0;
    for (SADMM_OBJECTS(slot, &world->body_ids)) {
        if (dynamic(world, slot)) *indices++ = index;
        ++index;
    }
    return SADMM_OK;
}
