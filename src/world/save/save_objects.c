/* What a world is made of, in a saved one. */
#include <math.h>
#include <string.h>

#include "collision/hull/hull.h"
#include "collision/mesh/mesh.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "core/base/utf8.h"
#include "core/model/rolling.h"
#include "save_objects.h"
#include "world/objects/body.h"
#include "world/objects/coupling.h"
#include "world/objects/gear.h"
#include "world/objects/joint.h"
#include "world/objects/shape.h"
#include "world/step/kinematic.h"

/* A member that is added has to be listed below. */
#define LISTED(type, size) \
    _Static_assert(sizeof(type) == (size), #type " has other members than the list of a saved world")
LISTED(struct sadmm_rigid, 320);
LISTED(struct sadmm_extrapolation, 72);
LISTED(struct sadmm_joint_memory, 560);

enum { MOST_SLOTS = 1 << 28 };

static void fail_memory(struct sadmm_archive *archive)
{
    if (archive->status == SADMM_OK) archive->status = sadmm_fail_memory(archive->error, "the state of a world");
}

static bool pairs_fit(const struct sadmm_pair_table *table, size_t count, size_t slots)
{
    for (size_t k = 0; k < count; ++k) {
        const uint64_t low = table->keys[k] >> 32, high = table->keys[k] & UINT32_MAX;
        if (high >= slots || low >= high || (k > 0 && table->keys[k - 1] >= table->keys[k]) ||
            !(table->values[k] >= 0 && table->values[k] <= 1e9))
            return false;
    }
    return true;
}

static void archive_pair_table(struct sadmm_archive *archive, struct sadmm_pair_table *table, size_t slots)
{
    size_t count = sadmm_pair_table_count(table), values;
    if (!archive->reading && sadmm_pair_table_list(table, archive->error) != SADMM_OK) {
        archive->status = SADMM_ERROR_OUT_OF_MEMORY;
        return;
    }
    values = count;
    sadmm_archive_array(archive, &table->keys, &count, sizeof *table->keys, SIZE_MAX);
    sadmm_archive_array(archive, &table->values, &values, sizeof *table->values, SIZE_MAX);
    if (!archive->reading ||
        !sadmm_archive_expect(archive, values == count && pairs_fit(table, count, slots), "pairs of bodies or shapes"))
        return;
    for (size_t k = 0; k < count && archive->status == SADMM_OK; ++k)
        if (sadmm_pair_table_set(table, table->keys[k], table->values[k], archive->error) != SADMM_OK)
            fail_memory(archive);
}

/* ---- settings and definitions ------------------------------------------------------------------------------------ */

static void archive_field(struct sadmm_archive *archive, const struct sadmm_field *field, void *at)
{
    switch (field->kind) {
    case SADMM_FIELD_REALS:
    case SADMM_FIELD_TURN:
    case SADMM_FIELD_BOUND:
    case SADMM_FIELD_MEASURED: sadmm_archive_bytes(archive, at, (size_t)field->count * sizeof(double)); break;
    case SADMM_FIELD_WHOLE: sadmm_archive_bytes(archive, at, sizeof(int)); break;
    case SADMM_FIELD_BITS: sadmm_archive_bytes(archive, at, sizeof(uint32_t)); break;
    case SADMM_FIELD_NAMED: sadmm_archive_bytes(archive, at, sizeof(sadmm_method)); break; /* as all enumerations */
    case SADMM_FIELD_ID: sadmm_archive_bytes(archive, at, sizeof(sadmm_body_id)); break;   /* as all ids */
    case SADMM_FIELD_FLAG: sadmm_archive_flag(archive, (bool *)at); break;
    case SADMM_FIELD_OTHER: break; /* the caller's */
    }
}

static void archive_fields(struct sadmm_archive *archive, const struct sadmm_field *fields, size_t count, void *object)
{
    for (size_t k = 0; k < count; ++k) archive_field(archive, &fields[k], (char *)object + fields[k].offset);
}

void sadmm_archive_settings(struct sadmm_archive *archive, sadmm_settings *s)
{
    archive_fields(archive, sadmm_settings_table, SADMM_SETTING_COUNT, s);
    if (archive->reading && archive->status == SADMM_OK)
        sadmm_archive_expect(archive, sadmm_settings_validate(s, archive->error) == SADMM_OK, "settings");
}

static void archive_def(struct sadmm_archive *archive, sadmm_world_def *def)
{
    SADMM_ARCHIVE(archive, def->backend);
    SADMM_ARCHIVE(archive, def->precision);
    SADMM_ARCHIVE(archive, def->device);
    SADMM_ARCHIVE(archive, def->contact_margin);
    sadmm_archive_settings(archive, &def->settings);
    if (archive->reading)
        sadmm_archive_expect(archive,
                             (unsigned)def->backend < SADMM_BACKEND_COUNT && (unsigned)def->precision <= SADMM_F64 &&
                                 def->device >= 0 && def->contact_margin >= 0 && def->contact_margin <= 1,
                             "the definition of a world");
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

static void archive_name(struct sadmm_archive *archive, char **name)
{
    size_t length = archive->reading || !*name ? 0 : strlen(*name);
    sadmm_archive_count(archive, &length, 1, SADMM_NAME_SIZE - 1);
    if (archive->reading && (length == 0 || !sadmm_archive_room(archive, name, length + 1, 1))) return;
    if (length > 0) sadmm_archive_bytes(archive, *name, length);
    if (archive->reading && length > 0 && archive->status == SADMM_OK)
        sadmm_archive_expect(archive, sadmm_utf8_fit(*name, length) == length, "the name of a body");
}

static bool body_fits(const sadmm_world *world, const struct sadmm_world_body *body, struct sadmm_error *error)
{
    const struct sadmm_rigid *rigid = &body->rigid;
    const bool dynamic = body->type == SADMM_BODY_DYNAMIC;
    sadmm_body_state state;
    double ignored[4];
    memcpy(state.position, rigid->position, sizeof state.position);
    memcpy(state.orientation, rigid->orientation, sizeof state.orientation);
    memcpy(state.linear_velocity, rigid->velocity, sizeof state.linear_velocity);
    memcpy(state.angular_velocity, rigid->velocity + 3, sizeof state.angular_velocity);
    if ((unsigned)body->type > SADMM_BODY_KINEMATIC || body->environment < (dynamic ? 0 : -1) ||
        sadmm_world_check_body_state(body, &state, ignored, error) != SADMM_OK)
        return false;
    if (dynamic && (sadmm_world_check_mass(world, rigid->mass, rigid->inertia, error) != SADMM_OK ||
                    sadmm_world_check_wrench(rigid->wrench, rigid->wrench + 3, error) != SADMM_OK ||
                    !(rigid->damping[0] >= 0 && rigid->damping[1] >= 0)))
        return false;
    if (body->target.set &&
        (!sadmm_all_finite(body->target.position, 3) ||
         sadmm_check_orientation("orientation", body->target.orientation, ignored, error) != SADMM_OK))
        return false;
    if (!sadmm_all_finite(rigid->owed, 6) || !sadmm_all_finite(rigid->stiffness, 6) ||
        (rigid->rolls & ~(ROLLING_OWES | ROLLING_IS_STIFF | ROLLING_TURNS_ON)))
        return false;
    return sadmm_all_finite(&rigid->gravity_scale, 1) && sadmm_all_finite(rigid->damping, 2) &&
           sadmm_all_finite(body->extrapolation.change, 6) && body->extrapolation.dt >= 0 &&
           sadmm_all_finite(&body->extrapolation.dt, 1) && body->extrapolation.streak[0] >= 0 &&
           body->extrapolation.streak[1] >= 0 && sadmm_all_finite(body->contact_wrench, 6);
}

static void archive_body(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_body *body = &world->bodies[slot];
    sadmm_archive_flag(archive, &body->alive);
    SADMM_ARCHIVE(archive, body->generation);
    if (!body->alive) return;
    SADMM_ARCHIVE(archive, body->type);
    SADMM_ARCHIVE(archive, body->environment);
    rolling_clear(&body->rigid); /* equal worlds have equal saves */
    SADMM_ARCHIVE(archive, body->rigid);
    SADMM_ARCHIVE(archive, body->contact_wrench);
    SADMM_ARCHIVE(archive, body->extrapolation);
    sadmm_archive_flag(archive, &body->target.set);
    SADMM_ARCHIVE(archive, body->target.position);
    SADMM_ARCHIVE(archive, body->target.orientation);
    archive_name(archive, &body->name);
    if (!archive->reading) return;
    body->system_body = -1;
    if (archive->status != SADMM_OK ||
        !sadmm_archive_expect(archive, body_fits(world, body, archive->error), "a body")) {
        body->alive = false;
        return;
    }
    ++world->body_count;
    world->dynamic_count += body->type == SADMM_BODY_DYNAMIC;
    sadmm_slots_take(&world->bodies_taken, slot);
    if (body->type == SADMM_BODY_KINEMATIC) sadmm_world_count_kinematic(world, 1);
}

/* ---- shapes ------------------------------------------------------------------------------------------------------ */

/* The hulls and meshes of the shapes, in the order in which a shape is the first one of them. */
struct owners {
    const void **of; /* writing: sadmm_hull or sadmm_mesh; reading: likewise, new ones */
    bool *is_mesh;
    size_t count;
    struct sadmm_key_tree numbers; /* writing: by address */
};

static const void *owner_of(const sadmm_world *world, size_t slot)
{
    const struct sadmm_world_block_shape *kept = &world->block_shapes[slot];
    return kept->hull ? (const void *)kept->hull : kept->mesh;
}

static bool has_owner(const sadmm_world *world, size_t slot)
{
    const int32_t type = world->geometries[world->shapes[slot].geometry].type;
    return world->shapes[slot].alive && (type == SADMM_SHAPE_HULL || type == SADMM_SHAPE_MESH);
}

/* Its number; NULL: it has none yet. */
static const double *find_owner(const struct owners *owners, const void *owner)
{
    return sadmm_key_tree_find(&owners->numbers, (uintptr_t)owner);
}

static void list_owners(struct sadmm_archive *archive, const sadmm_world *world, struct owners *owners)
{
    for (size_t slot = 0; slot < world->shape_slots; ++slot) {
        if (!has_owner(world, slot)) continue;
        const void *owner = owner_of(world, slot);
        if (find_owner(owners, owner)) continue;
        if (!sadmm_key_tree_reserve(&owners->numbers) || !SADMM_GROW(owners->of, owners->count, owners->count + 1) ||
            !SADMM_GROW(owners->is_mesh, owners->count, owners->count + 1)) {
            fail_memory(archive);
            return;
        }
        sadmm_key_tree_set(&owners->numbers, (uintptr_t)owner, (double)owners->count);
        owners->of[owners->count] = owner;
        owners->is_mesh[owners->count++] = world->block_shapes[slot].mesh != NULL;
    }
}

static void archive_owners(struct sadmm_archive *archive, const sadmm_world *world, struct owners *owners)
{
    if (!archive->reading) list_owners(archive, world, owners);
    size_t count = owners->count;
    sadmm_archive_count(archive, &count, 64, MOST_SLOTS);
    if (archive->reading && !(sadmm_archive_room(archive, &owners->of, count, sizeof *owners->of) &&
                              sadmm_archive_room(archive, &owners->is_mesh, count, sizeof *owners->is_mesh)))
        return;
    for (size_t k = 0; k < count && archive->status == SADMM_OK; ++k) {
        sadmm_hull *hull = archive->reading ? NULL : (sadmm_hull *)owners->of[k];
        sadmm_mesh *mesh = archive->reading ? NULL : (sadmm_mesh *)owners->of[k];
        sadmm_archive_flag(archive, &owners->is_mesh[k]);
        if (owners->is_mesh[k]) sadmm_mesh_archive(archive, &mesh);
        else sadmm_hull_archive(archive, &hull);
        if (!archive->reading) continue;
        owners->of[k] = owners->is_mesh[k] ? (const void *)mesh : hull;
        owners->count = k + 1;
    }
}

static void release_owners(const struct sadmm_archive *archive, struct owners *owners)
{
    for (size_t k = 0; k < owners->count && archive->reading; ++k) {
        if (owners->is_mesh[k]) sadmm_mesh_release((const sadmm_mesh *)owners->of[k]);
        else sadmm_hull_release((const sadmm_hull *)owners->of[k]);
    }
    sadmm_free(owners->of);
    sadmm_free(owners->is_mesh);
    sadmm_key_tree_free(&owners->numbers);
}

/* What a shape is, in its own terms; reading: where contact finding has it, too. */
struct kept_shape {
    sadmm_shape_def def;
    uint64_t owner; /* of HULL and MESH */
    double position[3], orientation[4];
    uint32_t revision;
    int32_t body;
};

static struct kept_shape keep_shape(const sadmm_world *world, size_t slot, const struct owners *owners)
{
    const struct sadmm_shape *shape = &world->shapes[slot];
    const struct sadmm_geometry *geometry = &world->geometries[shape->geometry];
    struct kept_shape kept = {.def = {.type = (sadmm_shape_type)geometry->type,
                                      .friction = shape->friction,
                                      .restitution = shape->restitution,
                                      .category = shape->category,
                                      .mask = shape->mask,
                                      .sensor = shape->sensor},
                              .revision = shape->revision,
                              .body = shape->body};
    const bool owned = has_owner(world, slot);
    memcpy(kept.def.size, geometry->size, sizeof kept.def.size);
    memcpy(kept.position, shape->position, sizeof kept.position);
    memcpy(kept.orientation, shape->orientation, sizeof kept.orientation);
    memcpy(kept.def.position, owned ? world->block_shapes[slot].position : shape->position, sizeof kept.def.position);
    memcpy(kept.def.orientation, owned ? world->block_shapes[slot].orientation : shape->orientation,
           sizeof kept.def.orientation);
    if (owned) kept.owner = (uint64_t)*find_owner(owners, owner_of(world, slot));
    return kept;
}

/* Apart from what sadmm_world_put_shape checks. */
static bool shape_fits(const sadmm_world *world, const struct kept_shape *kept, const struct owners *owners,
                       struct sadmm_error *error)
{
    const sadmm_shape_def *def = &kept->def;
    const bool mesh = def->type == SADMM_SHAPE_MESH, owned = mesh || def->type == SADMM_SHAPE_HULL;
    double ignored[4];
    if (kept->body < 0 || (size_t)kept->body >= world->body_slots || !world->bodies[kept->body].alive) return false;
    if (!owned) /* contact finding has it where it is */
        return memcmp(def->position, kept->position, sizeof kept->position) == 0 &&
               memcmp(def->orientation, kept->orientation, sizeof kept->orientation) == 0;
    return kept->owner < owners->count && owners->is_mesh[kept->owner] == mesh && sadmm_all_finite(kept->position, 3) &&
           sadmm_check_orientation("orientation", kept->orientation, ignored, error) == SADMM_OK;
}

static sadmm_status put_shape(struct sadmm_archive *archive, sadmm_world *world, size_t slot, struct kept_shape *kept,
                              const struct owners *owners)
{
    const bool hull = kept->def.type == SADMM_SHAPE_HULL, mesh = kept->def.type == SADMM_SHAPE_MESH;
    if (!sadmm_archive_expect(archive, shape_fits(world, kept, owners, archive->error), "a shape"))
        return archive->status;
    if (hull) kept->def.hull = (const sadmm_hull *)owners->of[kept->owner];
    if (mesh) kept->def.mesh = (const sadmm_mesh *)owners->of[kept->owner];
    TRY(sadmm_world_put_shape(world, slot, kept->body, &kept->def, archive->error));
    /* An orientation that is normalised once more may be another one, in its last bit. */
    struct sadmm_shape *shape = &world->shapes[slot];
    memcpy(shape->position, kept->position, sizeof shape->position);
    memcpy(shape->orientation, kept->orientation, sizeof shape->orientation);
    shape->revision = kept->revision;
    if (hull || mesh)
        memcpy(world->block_shapes[slot].orientation, kept->def.orientation, sizeof kept->def.orientation);
    return SADMM_OK;
}

static void archive_shape(struct sadmm_archive *archive, sadmm_world *world, size_t slot, const struct owners *owners)
{
    bool alive = !archive->reading && world->shapes[slot].alive;
    struct kept_shape kept = {.revision = 0};
    sadmm_archive_flag(archive, &alive);
    SADMM_ARCHIVE(archive, world->shape_generations[slot]);
    if (!alive) return;
    if (!archive->reading) kept = keep_shape(world, slot, owners);
    archive_fields(archive, sadmm_shape_table, SADMM_SHAPE_FIELDS_COUNT, &kept.def);
    SADMM_ARCHIVE(archive, kept.owner);
    SADMM_ARCHIVE(archive, kept.position);
    SADMM_ARCHIVE(archive, kept.orientation);
    SADMM_ARCHIVE(archive, kept.revision);
    SADMM_ARCHIVE(archive, kept.body);
    if (!archive->reading || archive->status != SADMM_OK) return;
    const sadmm_status status = put_shape(archive, world, slot, &kept, owners);
    sadmm_archive_expect(archive, status != SADMM_ERROR_INVALID_ARGUMENT, "a shape");
    if (archive->status == SADMM_OK) archive->status = status;
}

static void archive_shapes(struct sadmm_archive *archive, sadmm_world *world)
{
    struct owners owners = {.count = 0};
    size_t slots = world->shape_slots;
    archive_owners(archive, world, &owners);
    sadmm_archive_count(archive, &slots, 5, MOST_SLOTS);
    if (archive->reading && !sadmm_world_reserve_shapes(world, slots)) fail_memory(archive);
    if (archive->status == SADMM_OK) {
        world->shape_slots = slots;
        for (size_t slot = 0; slot < slots && archive->status == SADMM_OK; ++slot)
            archive_shape(archive, world, slot, &owners);
    }
    SADMM_ARCHIVE(archive, world->shape_revisions);
    release_owners(archive, &owners);
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

static void archive_joint_def(struct sadmm_archive *archive, sadmm_joint_def *def)
{
    archive_fields(archive, sadmm_joint_table, SADMM_JOINT_FIELDS_COUNT, def);
    for (int k = 0; k < JOINT_COORDINATES; ++k)
        archive_fields(archive, sadmm_coordinate_table, SADMM_COORDINATE_FIELDS_COUNT, &def->coordinates[k]);
}

static void archive_joint_memory(struct sadmm_archive *archive, struct sadmm_joint_memory *m)
{
    SADMM_ARCHIVE(archive, m->force);
    SADMM_ARCHIVE(archive, m->angle);
    SADMM_ARCHIVE(archive, m->wrench);
    SADMM_ARCHIVE(archive, m->point);
    SADMM_ARCHIVE(archive, m->local);
    SADMM_ARCHIVE(archive, m->left);
    sadmm_archive_flag(archive, &m->trapezoid_off);
    sadmm_archive_flag(archive, &m->broken);
}

static void archive_table(struct sadmm_archive *archive, sadmm_world *world, struct sadmm_world_joint *joint, int k)
{
    int32_t *count = &joint->table_count[k];
    sadmm_archive_count32(archive, count, 2 * sizeof(double), SADMM_MOST_SPRING_POINTS);
    const size_t numbers = 2 * (size_t)*count;
    if (archive->reading && (numbers == 0 || !sadmm_archive_room(archive, &joint->table[k], numbers, sizeof(double)))) {
        *count = 0;
        return;
    }
    if (numbers > 0) sadmm_archive_bytes(archive, joint->table[k], numbers * sizeof(double));
    if (!archive->reading) return;
    world->table_count += *count > 0;
    sadmm_archive_expect(archive,
                         sadmm_world_check_table(joint->table[k], joint->table[k] + *count, *count, archive->error) ==
                             SADMM_OK,
                         "a spring's table");
}

/* The body that a joint is on, and its id. */
static bool side_fits(const sadmm_world *world, int32_t slot, sadmm_body_id id)
{
    if (slot == -1) return id.slot == 0;
    return slot >= 0 && (size_t)slot < world->body_slots && world->bodies[slot].alive &&
           id.slot == (uint32_t)slot + 1 && id.generation == world->bodies[slot].generation;
}

static bool joint_fits(const sadmm_world *world, const struct sadmm_world_joint *joint, struct sadmm_error *error)
{
    const sadmm_joint_def *def = &joint->def;
    const struct joint_frame *frame = joint->frame;
    int dynamic = 0;
    for (int s = 0; s < 2; ++s) {
        if (!side_fits(world, joint->body[s], s ? def->body_b : def->body_a)) return false;
        dynamic += joint->body[s] >= 0 && world->bodies[joint->body[s]].type == SADMM_BODY_DYNAMIC;
        const double numbers[] = {frame[s].position.x,    frame[s].position.y,    frame[s].position.z,
                                  frame[s].orientation.w, frame[s].orientation.x, frame[s].orientation.y,
                                  frame[s].orientation.z};
        if (!sadmm_all_finite(numbers, 7)) return false;
    }
    if (dynamic == 0 || joint->body[0] == joint->body[1]) return false;
    if (sadmm_world_check_joint_def(def, error) != SADMM_OK) return false;
    for (int role = 0; role < SADMM_ROLE_COUNT; ++role)
        if (!sadmm_all_finite(joint->last.force[role], JOINT_COORDINATES)) return false;
    return sadmm_all_finite(joint->last.angle, JOINT_COORDINATES) && sadmm_all_finite(joint->last.wrench, 6) &&
           sadmm_all_finite(joint->last.point, 3) && sadmm_all_finite(joint->last.local, 6) &&
           sadmm_all_finite(joint->last.left, JOINT_COORDINATES);
}

static void archive_joint(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_joint *joint = &world->joints[slot];
    sadmm_archive_flag(archive, &joint->alive);
    SADMM_ARCHIVE(archive, joint->generation);
    if (!joint->alive) return;
    SADMM_ARCHIVE(archive, joint->coupling);
    archive_joint_def(archive, &joint->def);
    SADMM_ARCHIVE(archive, joint->body);
    SADMM_ARCHIVE(archive, joint->frame);
    for (int k = 0; k < JOINT_COORDINATES; ++k) archive_table(archive, world, joint, k);
    archive_joint_memory(archive, &joint->last);
    if (!archive->reading) return;
    ++world->joint_count;
    if (archive->status == SADMM_OK &&
        sadmm_archive_expect(archive, joint_fits(world, joint, archive->error), "a joint"))
        sadmm_world_link_joint(world, slot);
}

static void archive_joints(struct sadmm_archive *archive, sadmm_world *world)
{
    size_t slots = world->joint_slots;
    sadmm_archive_count(archive, &slots, 5, MOST_SLOTS);
    if (archive->reading && !sadmm_world_reserve_joints(world, slots)) {
        fail_memory(archive);
        return;
    }
    world->joint_slots = slots;
    for (size_t slot = 0; slot < slots && archive->status == SADMM_OK; ++slot) archive_joint(archive, world, slot);
    archive_pair_table(archive, &world->jointed_pairs, world->body_slots);
}

/* ---- gears and couplings ----------------------------------------------------------------------------------------- */

static bool gear_fits(const sadmm_world *world, const struct sadmm_world_gear *gear, struct sadmm_error *error)
{
    const sadmm_gear_def *def = &gear->def;
    return sadmm_world_check_gear(world, def, error) == SADMM_OK && gear->joint[0] == def->joint_1.slot - 1 &&
           gear->joint[1] == def->joint_2.slot - 1 && sadmm_all_finite(&def->offset, 1) &&
           sadmm_all_finite(&gear->last.force, 1);
}

static void archive_gear(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_gear *gear = &world->gears[slot];
    uint64_t joint[2] = {gear->joint[0], gear->joint[1]};
    sadmm_archive_flag(archive, &gear->alive);
    SADMM_ARCHIVE(archive, gear->generation);
    if (!gear->alive) return;
    archive_fields(archive, sadmm_gear_table, SADMM_GEAR_FIELDS_COUNT, &gear->def);
    SADMM_ARCHIVE(archive, joint);
    SADMM_ARCHIVE(archive, gear->last);
    if (!archive->reading) return;
    for (int s = 0; s < 2; ++s) gear->joint[s] = (size_t)joint[s];
    ++world->gear_count;
    if (archive->status == SADMM_OK && sadmm_archive_expect(archive, gear_fits(world, gear, archive->error), "a gear"))
        sadmm_world_link_gear(world, slot);
}

static void archive_gears(struct sadmm_archive *archive, sadmm_world *world)
{
    size_t slots = world->gear_slots;
    sadmm_archive_count(archive, &slots, 5, MOST_SLOTS);
    if (archive->reading && !(sadmm_archive_room(archive, &world->gears, slots, sizeof *world->gears) &&
                              sadmm_slots_reserve(&world->gears_taken, slots))) {
        fail_memory(archive);
        return;
    }
    world->gear_slots = slots;
    for (size_t slot = 0; slot < slots && archive->status == SADMM_OK; ++slot) archive_gear(archive, world, slot);
}

/* A target moves on by its velocity, beyond where one may be set. */
static bool target_fits(const struct sadmm_rigid *target, struct sadmm_error *error)
{
    double ignored[4];
    return sadmm_all_finite(target->position, 3) && sadmm_all_finite(target->velocity, 6) &&
           sadmm_check_orientation("orientation", target->orientation, ignored, error) == SADMM_OK;
}

static bool coupling_fits(const sadmm_world *world, size_t slot, struct sadmm_error *error)
{
    const struct sadmm_world_coupling *coupling = &world->couplings[slot];
    if (coupling->joint >= world->joint_slots) return false;
    const struct sadmm_world_joint *joint = &world->joints[coupling->joint];
    return joint->alive && joint->coupling == (int32_t)slot + 1 && joint->body[0] == -1 &&
           side_fits(world, joint->body[1], coupling->def.body) &&
           sadmm_world_check_coupling(&coupling->def, error) == SADMM_OK &&
           target_fits(&coupling->last.target, error) && sadmm_all_finite(coupling->last.reaction, 6) &&
           sadmm_all_finite(coupling->last.body, 6);
}

static void archive_coupling(struct sadmm_archive *archive, sadmm_world *world, size_t slot)
{
    struct sadmm_world_coupling *coupling = &world->couplings[slot];
    uint64_t joint = coupling->joint;
    sadmm_archive_flag(archive, &coupling->alive);
    SADMM_ARCHIVE(archive, coupling->generation);
    if (!coupling->alive) return;
    archive_fields(archive, sadmm_coupling_table, SADMM_COUPLING_FIELDS_COUNT, &coupling->def);
    SADMM_ARCHIVE(archive, joint);
    SADMM_ARCHIVE(archive, coupling->last.target.position);
    SADMM_ARCHIVE(archive, coupling->last.target.orientation);
    SADMM_ARCHIVE(archive, coupling->last.target.velocity);
    SADMM_ARCHIVE(archive, coupling->last.reaction);
    SADMM_ARCHIVE(archive, coupling->last.body);
    if (!archive->reading) return;
    coupling->joint = (size_t)joint;
    ++world->coupling_count;
    sadmm_slots_take(&world->couplings_taken, slot);
    if (archive->status == SADMM_OK)
        sadmm_archive_expect(archive, coupling_fits(world, slot, archive->error), "a coupling");
}

static void archive_couplings(struct sadmm_archive *archive, sadmm_world *world)
{
    size_t slots = world->coupling_slots, of_couplings = 0;
    sadmm_archive_count(archive, &slots, 5, MOST_SLOTS);
    if (archive->reading && !(sadmm_archive_room(archive, &world->couplings, slots, sizeof *world->couplings) &&
                              sadmm_slots_reserve(&world->couplings_taken, slots))) {
        fail_memory(archive);
        return;
    }
    world->coupling_slots = slots;
    for (size_t slot = 0; slot < slots && archive->status == SADMM_OK; ++slot) archive_coupling(archive, world, slot);
    for (size_t slot = 0; slot < world->joint_slots; ++slot)
        of_couplings += world->joints[slot].alive && world->joints[slot].coupling;
    if (archive->reading)
        sadmm_archive_expect(archive, of_couplings == (size_t)world->coupling_count, "the joints of couplings");
}

/* ---- all --------------------------------------------------------------------------------------------------------- */

void sadmm_archive_objects(struct sadmm_archive *archive, sadmm_world *world)
{
    size_t slots = world->body_slots;
    archive_def(archive, &world->def);
    sadmm_archive_count(archive, &slots, 5, MOST_SLOTS);
    if (archive->reading && !(sadmm_archive_room(archive, &world->bodies, slots, sizeof *world->bodies) &&
                              sadmm_slots_reserve(&world->bodies_taken, slots))) {
        fail_memory(archive);
        return;
    }
    world->body_slots = slots;
    for (size_t slot = 0; slot < slots && archive->status == SADMM_OK; ++slot) archive_body(archive, world, slot);
    archive_shapes(archive, world);
    archive_pair_table(archive, &world->disabled_pairs, world->body_slots);
    archive_pair_table(archive, &world->friction_pairs, world->shape_slots);
    archive_joints(archive, world);
    archive_gears(archive, world);
    archive_couplings(archive, world);
}
