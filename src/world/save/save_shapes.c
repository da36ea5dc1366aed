#include "save_shapes.h"

#include <string.h>

#include "collision/hull/hull.h"
#include "collision/mesh/mesh.h"
#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "save_parts.h"
#include "world/objects/shape.h"

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
    return type == SADMM_SHAPE_HULL || type == SADMM_SHAPE_MESH;
}

/* Its number; NULL: it has none yet. */
static const double *find_owner(const struct owners *owners, const void *owner)
{
    return sadmm_key_tree_find(&owners->numbers, (uintptr_t)owner);
}

static void list_owners(struct sadmm_archive *archive, const sadmm_world *world, struct owners *owners)
{
    for (SADMM_OBJECTS(slot, &world->shape_ids)) {
        if (!has_owner(world, slot)) continue;
        const void *owner = owner_of(world, slot);
        if (find_owner(owners, owner)) continue;
        if (!sadmm_key_tree_reserve(&owners->numbers) || !SADMM_GROW(owners->of, owners->count, owners->count + 1) ||
            !SADMM_GROW(owners->is_mesh, owners->count, owners->count + 1)) {
            sadmm_archive_fail_memory(archive);
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
    sadmm_archive_count(archive, &count, 64, INT32_MAX);
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
    memcpy(kept.def.surface_velocity, world->surfaces + 3 * slot, sizeof kept.def.surface_velocity);
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
    if (kept->body < 0 || !sadmm_ids_has(&world->body_ids, (size_t)kept->body)) return false;
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
    struct kept_shape kept = {.revision = 0};
    if (!archive->reading) kept = keep_shape(world, slot, owners);
    sadmm_archive_fields(archive, sadmm_shape_table, SADMM_SHAPE_FIELDS_COUNT, &kept.def);
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

void sadmm_archive_shapes(struct sadmm_archive *archive, sadmm_world *world)
{
    struct owners owners = {.count = 0};
    const struct sadmm_id_pool *ids = &world->shape_ids;
    archive_owners(archive, world, &owners);
    if (sadmm_archive_ids(archive, &world->shape_ids, &world->shapes, sizeof *world->shapes) &&
        (!archive->reading ||
         (sadmm_archive_room(archive, &world->geometries, ids->slots, sizeof *world->geometries) &&
          sadmm_archive_room(archive, &world->shape_links, ids->slots, sizeof *world->shape_links) &&
          sadmm_archive_room(archive, &world->surfaces, 3 * ids->slots, sizeof *world->surfaces))))
        for (SADMM_OBJECTS(slot, ids))
            if (archive->status == SADMM_OK) archive_shape(archive, world, slot, &owners);
    SADMM_ARCHIVE(archive, world->shape_revisions);
    release_owners(archive, &owners);
}
