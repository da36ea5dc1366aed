#include "environment_backend.h"

#include <string.h>

#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "core/model/kinematic.h"
#include "core/model/settings.h"
#include "environment_checks.h"
#include "environment_numbers.h"
#include "world/objects/body_check.h"
#include "world/resident/resident.h"
#include "world/step.h"

static const struct sadmm_resident_kernels *kernels_of(const struct sadmm_environments *environments)
{
    return environments->merged.world->kernels->resident;
}

/* The merged world's error is the call's. */
static sadmm_status pass(struct sadmm_environments *environments, sadmm_status status)
{
    sadmm_world *world = environments->merged.world;
    if (status == SADMM_OK) return SADMM_OK;
    status = sadmm_world_contain(world, status);
    return sadmm_fail(&environments->error, status, "%s", world->error.message);
}

/* ---- what the backend knows -------------------------------------------------------------------------------------- */

static sadmm_status upload(struct sadmm_environments *environments, const void *from, size_t bytes, void **to)
{
    sadmm_world *world = environments->merged.world;
    const struct sadmm_resident_kernels *kernels = kernels_of(environments);
    sadmm_status status = kernels->allocate(world->context, bytes, to, &world->error);
    if (status == SADMM_OK && from) status = kernels->to_backend(world->context, *to, from, bytes, &world->error);
    if (status != SADMM_OK) {
        if (*to) kernels->release(world->context, *to);
        *to = NULL;
    }
    return pass(environments, status);
}

/* A body as contacts of the first environment name it; numbers of other objects are what they are. */
static sadmm_status list_objects(struct sadmm_environments *environments)
{
    struct sadmm_merged_world *merged = &environments->merged;
    const sadmm_world *from = environments->worker[0].world;
    const size_t bodies = (size_t)merged->bodies.count, couplings = (size_t)from->coupling_ids.count,
                 joints = (size_t)merged->joints.count, shapes = (size_t)merged->shapes.count,
                 most = joints > couplings ? joints : couplings, others = shapes > most ? shapes : most;
    int32_t *list = (int32_t *)sadmm_alloc(bodies + others, sizeof *list), dynamic = 0, kinematic = 0;
    if (!list) return sadmm_fail_memory(&environments->error, "environments");
    for (size_t i = 0; i < bodies; ++i) {
        const sadmm_body_type type = from->bodies[merged->bodies.slots[i]].type;
        list[i] = type == SADMM_BODY_DYNAMIC     ? dynamic++
                  : type == SADMM_BODY_KINEMATIC ? sadmm_kinematic(kinematic++)
                                                 : -1;
    }
    for (size_t i = 0; i < others; ++i) list[bodies + i] = (int32_t)i;
    const sadmm_status status =
        upload(environments, list, (bodies + others) * sizeof *list, (void **)&merged->objects);
    sadmm_free(list);
    return status;
}

sadmm_status sadmm_environments_open_backend(struct sadmm_environments *environments)
{
    struct sadmm_merged_world *merged = &environments->merged;
    const sadmm_world *from = environments->worker[0].world;
    TRY(pass(environments, sadmm_world_choose_backend(merged->world)));
    if (!kernels_of(environments)->allocate) return SADMM_OK;
    merged->copies = (struct sadmm_resident_copies){.count = environments->count,
                                                    .bodies = from->dynamic_count,
                                                    .kinematic = from->kinematic_count,
                                                    .shapes = merged->shapes.count,
                                                    .joints = merged->joints.count,
                                                    .couplings = from->coupling_ids.count,
                                                    .gears = from->gear_ids.count};
    merged->world->resident.copies = &merged->copies;
    merged->refusals = (uint8_t *)sadmm_alloc((size_t)environments->count, 1);
    merged->left_last = (uint8_t *)sadmm_alloc((size_t)environments->count, 1);
    merged->measures =
        (struct sadmm_copy_measures *)sadmm_alloc((size_t)environments->count, sizeof *merged->measures);
    if (!merged->refusals || !merged->left_last || !merged->measures)
        return sadmm_fail_memory(&environments->error, "environments");
    TRY(list_objects(environments));
    TRY(upload(environments, NULL, (size_t)environments->count, (void **)&merged->left));
    TRY(upload(environments, NULL, (size_t)environments->count, (void **)&merged->refused));
    merged->has_backend = true;
    return SADMM_OK;
}

sadmm_status sadmm_environments_check_backend(struct sadmm_environments *environments)
{
    if (!environments->merged.has_backend || environments->merged.world->context) return SADMM_OK;
    return sadmm_fail(&environments->error, SADMM_ERROR_DEVICE, "the device has failed: make the environments anew");
}

static void release(struct sadmm_environments *environments, void *memory)
{
    const sadmm_world *world = environments->merged.world;
    if (memory && world->context) kernels_of(environments)->release(world->context, memory);
}

void sadmm_environments_close_backend(struct sadmm_environments *environments)
{
    struct sadmm_merged_world *merged = &environments->merged;
    if (!merged->world || !merged->world->kernels) return;
    for (size_t k = 0; k < environments->kept_count; ++k) sadmm_environments_forget_kept(environments, k);
    release(environments, (void *)merged->objects);
    release(environments, merged->left);
    release(environments, merged->refused);
}

/* ---- arrays ------------------------------------------------------------------------------------------------------ */

static size_t bytes_of(const struct sadmm_environments *environments, const struct sadmm_bound_array *bound)
{
    return (size_t)environments->count * bound->numbers *
           (bound->precision == SADMM_F64 ? sizeof(double) : sizeof(float));
}

sadmm_status sadmm_environments_place_array(struct sadmm_environments *environments, struct sadmm_bound_array *bound)
{
    bound->values = bound->host;
    if (!environments->merged.has_backend) return SADMM_OK;
    TRY(upload(environments, bound->host, bytes_of(environments, bound), &bound->values));
    bound->in_backend = true;
    return SADMM_OK;
}

void sadmm_environments_release_array(struct sadmm_environments *environments, struct sadmm_bound_array *bound)
{
    if (bound->in_backend) release(environments, bound->values);
    sadmm_free(bound->host);
    sadmm_free(bound->start);
    sadmm_free(bound->given);
}

sadmm_status sadmm_environments_push_array(struct sadmm_environments *environments, struct sadmm_bound_array *bound)
{
    sadmm_world *world = environments->merged.world;
    if (!bound->in_backend) return SADMM_OK;
    bound->host_behind = false;
    return pass(environments, kernels_of(environments)->to_backend(world->context, bound->values, bound->host,
                                                                   bytes_of(environments, bound), &world->error));
}

/* Input arrays are the caller's to write to, at any time. */
sadmm_status sadmm_environments_pull_array(struct sadmm_environments *environments, struct sadmm_bound_array *bound)
{
    sadmm_world *world = environments->merged.world;
    if (!bound->in_backend || (!bound->host_behind && !sadmm_environments_is_input(bound->array))) return SADMM_OK;
    bound->host_behind = false;
    return pass(environments, kernels_of(environments)->from_backend(world->context, bound->host, bound->values,
                                                                     bytes_of(environments, bound), &world->error));
}

bool sadmm_environments_may_exchange(const struct sadmm_environments *environments,
                                     const struct sadmm_bound_array *bound)
{
    return bound->in_backend && environments->merged.world->resident.loaded &&
           kernels_of(environments)->has_array((int32_t)bound->array, sadmm_environments_is_input(bound->array));
}

/* What is in range of an array that the backend takes in: of the first column, and of the others. */
static void find_range(struct sadmm_resident_array *array)
{
    const struct sadmm_field *field = NULL, *others = NULL;
    switch ((sadmm_array)array->array) {
    case SADMM_ARRAY_BODY_INERTIA:
        field = SADMM_BODY_FIELD(mass);
        others = SADMM_BODY_FIELD(inertia);
        break;
    case SADMM_ARRAY_SHAPE_MATERIAL:
        field = SADMM_SHAPE_FIELD(friction);
        others = SADMM_SHAPE_FIELD(restitution);
        break;
    case SADMM_ARRAY_BODY_GRAVITY_SCALE: field = SADMM_BODY_FIELD(gravity_scale); break;
    case SADMM_ARRAY_BODY_DAMPING: field = SADMM_BODY_FIELD(linear_damping); break;
    case SADMM_ARRAY_JOINT_TARGET_POSITION: field = SADMM_COORDINATE_FIELD(target_position); break;
    case SADMM_ARRAY_JOINT_TARGET_SPEED: field = SADMM_COORDINATE_FIELD(target_speed); break;
    case SADMM_ARRAY_JOINT_DRIVE_STIFFNESS: field = SADMM_COORDINATE_FIELD(drive_stiffness); break;
    case SADMM_ARRAY_JOINT_DRIVE_DAMPING: field = SADMM_COORDINATE_FIELD(drive_damping); break;
    case SADMM_ARRAY_JOINT_DRIVE_LIMIT: field = SADMM_COORDINATE_FIELD(drive_force); break;
    case SADMM_ARRAY_JOINT_FRICTION: field = SADMM_COORDINATE_FIELD(friction); break;
    case SADMM_ARRAY_JOINT_SPRING_STIFFNESS: field = SADMM_COORDINATE_FIELD(spring_stiffness); break;
    case SADMM_ARRAY_JOINT_SPRING_DAMPING: field = SADMM_COORDINATE_FIELD(spring_damping); break;
    case SADMM_ARRAY_JOINT_SPRING_REST: field = SADMM_COORDINATE_FIELD(spring_rest); break;
    case SADMM_ARRAY_JOINT_ARMATURE: field = SADMM_COORDINATE_FIELD(armature); break;
    default: break;
    }
    if (!others) others = field;
    array->lo[0] = field ? field->lo : -SADMM_WRENCH_LIMIT;
    array->hi[0] = field ? field->hi : SADMM_WRENCH_LIMIT;
    array->lo[1] = others ? others->lo : -SADMM_WRENCH_LIMIT;
    array->hi[1] = others ? others->hi : SADMM_WRENCH_LIMIT;
    if (array->array == SADMM_ARRAY_GRAVITY) array->hi[0] = SADMM_GRAVITY_LIMIT; /* of its size */
}

static bool is_of_bodies(sadmm_array array)
{
    return array == SADMM_ARRAY_BODY_STATE || array == SADMM_ARRAY_BODY_WRENCH ||
           array == SADMM_ARRAY_BODY_CONTACT_WRENCH || array == SADMM_ARRAY_BODY_ACCELERATION ||
           array == SADMM_ARRAY_BODY_GRAVITY_SCALE || array == SADMM_ARRAY_BODY_DAMPING ||
           array == SADMM_ARRAY_BODY_INERTIA;
}

static sadmm_status upload_marks(struct sadmm_environments *environments)
{
    struct sadmm_merged_world *merged = &environments->merged;
    const size_t count = (size_t)environments->count;
    if (memcmp(merged->left_last, environments->marked, count) == 0) return SADMM_OK;
    TRY(pass(environments, kernels_of(environments)->to_backend(merged->world->context, merged->left,
                                                                environments->marked, count, &merged->world->error)));
    memcpy(merged->left_last, environments->marked, count);
    return SADMM_OK;
}

sadmm_status sadmm_environments_exchange(struct sadmm_environments *environments, struct sadmm_bound_array *bound)
{
    struct sadmm_merged_world *merged = &environments->merged;
    const bool in = sadmm_environments_is_input(bound->array);
    struct sadmm_resident_array array = {
        .array = (int32_t)bound->array,
        .rows = sadmm_environments_rows(environments, bound->array),
        .columns = sadmm_array_columns(bound->array),
        .single = bound->precision == SADMM_F32,
        .values = bound->values,
        .objects = merged->objects + (is_of_bodies(bound->array) ? 0 : merged->bodies.count),
    };
    if (array.rows == 0) return SADMM_OK;
    find_range(&array);
    TRY(upload_marks(environments));
    bound->host_behind = true;
    bound->given_unknown = bound->given_unknown || in;
    /* limits are checked against each other: those that are both an environment's own are taken together */
    if (bound->array == SADMM_ARRAY_JOINT_UPPER && sadmm_environments_bound(environments, SADMM_ARRAY_JOINT_LOWER, -1))
        return SADMM_OK;
    const struct sadmm_bound_array *upper =
        bound->array == SADMM_ARRAY_JOINT_LOWER
            ? sadmm_environments_bound(environments, SADMM_ARRAY_JOINT_UPPER, -1)
            : NULL;
    if (upper) {
        array.upper = upper->values;
        array.upper_single = upper->precision == SADMM_F32;
    }
    return pass(environments, kernels_of(environments)->exchange(merged->world->context, &merged->copies, &array, in,
                                                                 merged->left, merged->refused, environments->stream,
                                                                 &merged->world->error));
}

bool sadmm_environments_may_have_gravities(const struct sadmm_environments *environments)
{
    return environments->merged.has_backend && sadmm_world_may_reside(environments->merged.world);
}

/* With the next step the backend takes over the world anew, with them. */
sadmm_status sadmm_environments_open_gravities(struct sadmm_environments *environments)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *world = merged->world;
    const size_t count = (size_t)environments->count;
    if (merged->gravities) return SADMM_OK;
    TRY(pass(environments, sadmm_world_detach(world)));
    merged->gravities = (double *)sadmm_alloc(count, 3 * sizeof *merged->gravities);
    if (!merged->gravities) return sadmm_fail_memory(&environments->error, "gravity of environments");
    for (size_t e = 0; e < count; ++e)
        memcpy(merged->gravities + 3 * e, environments->settings.gravity, 3 * sizeof *merged->gravities);
    world->resident.gravities = merged->gravities;
    return SADMM_OK;
}

/* The last step's, while nothing else has changed the world. */
sadmm_status sadmm_environments_measure(struct sadmm_environments *environments)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *world = merged->world;
    if (!merged->measurable || !merged->has_backend || !world->resident.loaded) return SADMM_OK;
    merged->measurable = false;
    TRY(pass(environments, kernels_of(environments)->measure(world->context, &merged->copies, merged->measures,
                                                             &world->error)));
    merged->measured = true;
    return SADMM_OK;
}

sadmm_status sadmm_environments_wait_backend(struct sadmm_environments *environments)
{
    sadmm_world *world = environments->merged.world;
    struct sadmm_resident_view ignored;
    if (!environments->merged.has_backend || !world->resident.loaded) return SADMM_OK;
    return pass(environments, kernels_of(environments)->view(world->context, &ignored, &world->error));
}

sadmm_status sadmm_environments_find_refused(struct sadmm_environments *environments, bool *any)
{
    struct sadmm_merged_world *merged = &environments->merged;
    const size_t count = (size_t)environments->count;
    const struct sadmm_resident_kernels *kernels = kernels_of(environments);
    sadmm_world *world = merged->world;
    TRY(pass(environments,
             kernels->from_backend(world->context, merged->refusals, merged->refused, count, &world->error)));
    *any = memchr(merged->refusals, 1, count) != NULL;
    if (!*any) return SADMM_OK;
    uint8_t *none = (uint8_t *)sadmm_alloc(count, 1);
    if (!none) return sadmm_fail_memory(&environments->error, "environments");
    const sadmm_status status = kernels->to_backend(world->context, merged->refused, none, count, &world->error);
    sadmm_free(none);
    return pass(environments, status);
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

/* The worker's world as the backend would have it. */
struct listed_state {
    struct sadmm_rigid *rigid;
    struct sadmm_extrapolation *extrapolation;
    double *wrench, *kinematic_wrench, *gear_force;
    struct sadmm_kinematic_body *kinematic;
    struct sadmm_joint_memory *joints;
    struct sadmm_coupling_memory *couplings;
    uint8_t *enabled;
};

static void free_listed(struct listed_state *list)
{
    void *blocks[] = {list->rigid,     list->extrapolation, list->wrench,    list->kinematic_wrench, list->gear_force,
                      list->kinematic, list->joints,        list->couplings, list->enabled};
    for (size_t k = 0; k < sizeof blocks / sizeof *blocks; ++k) sadmm_free(blocks[k]);
}

static bool reserve_listed(const struct sadmm_resident_copies *n, struct listed_state *list)
{
    const size_t bodies = (size_t)n->bodies, kinematic = (size_t)n->kinematic, joints = (size_t)n->joints,
                 couplings = (size_t)n->couplings;
    list->rigid = (struct sadmm_rigid *)sadmm_alloc(bodies, sizeof *list->rigid);
    list->extrapolation = (struct sadmm_extrapolation *)sadmm_alloc(bodies, sizeof *list->extrapolation);
    list->wrench = (double *)sadmm_alloc(6 * bodies, sizeof *list->wrench);
    list->kinematic = (struct sadmm_kinematic_body *)sadmm_alloc(kinematic, sizeof *list->kinematic);
    list->kinematic_wrench = (double *)sadmm_alloc(6 * kinematic, sizeof *list->kinematic_wrench);
    list->joints = (struct sadmm_joint_memory *)sadmm_alloc(joints + couplings, sizeof *list->joints);
    list->enabled = (uint8_t *)sadmm_alloc(joints, 1);
    list->couplings = (struct sadmm_coupling_memory *)sadmm_alloc(couplings, sizeof *list->couplings);
    list->gear_force = (double *)sadmm_alloc((size_t)n->gears, sizeof *list->gear_force);
    return list->rigid && list->extrapolation && list->wrench && list->kinematic && list->kinematic_wrench &&
           list->joints && list->enabled && list->couplings && list->gear_force;
}

static void list_state(const sadmm_world *world, struct listed_state *list)
{
    size_t dynamic = 0, kinematic = 0, joint = 0, gear = 0, coupling = 0;
    for (SADMM_OBJECTS(slot, &world->body_ids)) {
        const struct sadmm_world_body *body = &world->bodies[slot];
        if (body->type == SADMM_BODY_DYNAMIC) {
            list->rigid[dynamic] = body->rigid;
            list->extrapolation[dynamic] = body->extrapolation;
            memcpy(list->wrench + 6 * dynamic++, body->contact_wrench, sizeof body->contact_wrench);
        } else if (body->type == SADMM_BODY_KINEMATIC) {
            struct sadmm_kinematic_body *to = &list->kinematic[kinematic];
            *to = (struct sadmm_kinematic_body){
                .rigid = body->rigid, .extrapolation = body->extrapolation, .target = body->target.set};
            memcpy(to->position, body->target.position, sizeof to->position);
            memcpy(to->orientation, body->target.orientation, sizeof to->orientation);
            to->dt = world->def.settings.dt;
            memcpy(list->kinematic_wrench + 6 * kinematic++, body->contact_wrench, sizeof body->contact_wrench);
        }
    }
    for (SADMM_OBJECTS(slot, &world->joint_ids)) {
        list->enabled[joint] = world->joints[slot].def.enabled;
        list->joints[joint++] = world->joints[slot].last;
    }
    for (SADMM_OBJECTS(slot, &world->coupling_ids)) {
        list->joints[joint++] = world->couplings[slot].joint.last;
        list->couplings[coupling++] = world->couplings[slot].last;
    }
    for (SADMM_OBJECTS(slot, &world->gear_ids)) list->gear_force[gear++] = world->gears[slot].last.force;
}

/* The state of the worker's world, shapes numbered as they are in the merged world. */
static sadmm_status keep(struct sadmm_environments *environments, struct sadmm_kept_block *kept)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *world = environments->worker[0].world;
    struct listed_state list = {0};
    sadmm_status status = reserve_listed(&merged->copies, &list)
                              ? SADMM_OK
                              : sadmm_fail_memory(&environments->error, "the state of an environment");
    if (status == SADMM_OK) {
        list_state(world, &list);
        for (size_t p = 0; p < world->contacts.pair_count; ++p) {
            struct sadmm_contact_pair *pair = &world->contacts.pairs[p];
            pair->shape_a = merged->shapes.numbers[pair->shape_a];
            pair->shape_b = merged->shapes.numbers[pair->shape_b];
        }
        const struct sadmm_resident_state state = {list.rigid,     list.extrapolation, list.wrench,
                                                   list.kinematic, list.kinematic_wrench, list.joints,
                                                   list.enabled,   list.couplings,     list.gear_force,
                                                   &world->contacts};
        status = pass(environments, kernels_of(environments)->keep_state(merged->world->context, &merged->copies,
                                                                         &state, &kept->block, &merged->world->error));
        kept->report = world->report;
        kept->stepped = world->stepped;
    }
    if (status == SADMM_OK) {
        kept->enabled = list.enabled;
        list.enabled = NULL;
    }
    free_listed(&list);
    return status;
}

/* The template's worker becomes what is kept, and is another one then. */
static sadmm_status find_block(struct sadmm_environments *environments, int32_t state)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *world = environments->worker[0].world;
    if (!SADMM_GROW(merged->kept, merged->kept_count, (size_t)state + 1))
        return sadmm_fail_memory(&environments->error, "the state of an environment");
    if (merged->kept_count <= (size_t)state) merged->kept_count = (size_t)state + 1;
    if (merged->kept[state].block) return SADMM_OK;
    const sadmm_status status = sadmm_environment_state_load(world, &environments->kept[state]);
    if (status != SADMM_OK) return sadmm_fail(&environments->error, status, "%s", world->error.message);
    return keep(environments, &merged->kept[state]);
}

void sadmm_environments_forget_kept(struct sadmm_environments *environments, size_t state)
{
    struct sadmm_merged_world *merged = &environments->merged;
    if (state >= merged->kept_count) return;
    release(environments, merged->kept[state].block);
    sadmm_free(merged->kept[state].enabled);
    merged->kept[state].block = merged->kept[state].enabled = NULL;
}

/* The host's copy of the world is behind, of all of it. */
static void set_behind(sadmm_world *world)
{
    world->resident.bodies_behind = world->resident.contacts_behind = true;
    world->resident.joints_behind = world->resident.joint_count > 0;
    world->contacts_readable = false;
    world->certified_step = -1;
    world->start.hit_count = world->start.hit_first = 0;
    world->resident.hits_behind = false;
}

/* What was set of bodies and joints is on its way with the next step, and would be over what a state gives them. */
static bool has_updates(const sadmm_world *world)
{
    return world->resident.dirty_count > 0 || world->resident.dirty_joint_count > 0 || world->resident.gears_dirty;
}

sadmm_status sadmm_environments_put_kept(struct sadmm_environments *environments, const int32_t *which, int32_t count,
                                         const int32_t *states, bool *done)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *world = merged->world;
    *done = false;
    if (!merged->has_backend || !world->resident.loaded || has_updates(world) || merged->static_moved) return SADMM_OK;
    TRY(sadmm_environments_measure(environments)); /* of those that go on */
    void **blocks = (void **)sadmm_alloc((size_t)count, sizeof *blocks);
    int32_t *all = (int32_t *)sadmm_alloc((size_t)count, sizeof *all);
    sadmm_status status =
        blocks && all ? SADMM_OK : sadmm_fail_memory(&environments->error, "states of environments");
    for (int32_t k = 0; status == SADMM_OK && k < count; ++k) {
        status = find_block(environments, states ? states[k] : 0);
        if (status == SADMM_OK) blocks[k] = merged->kept[states ? states[k] : 0].block;
        if (status == SADMM_OK) all[k] = which ? which[k] : k;
    }
    if (status == SADMM_OK) status = pass(environments, sadmm_world_synchronise(world));
    merged->measurable = false;
    if (status == SADMM_OK)
        status = pass(environments, kernels_of(environments)->put_states(world->context, &merged->copies, count, all,
                                                                         blocks, done, &world->error));
    for (int32_t k = 0; status == SADMM_OK && *done && k < count; ++k) {
        const struct sadmm_kept_block *kept = &merged->kept[states ? states[k] : 0];
        merged->progress[all[k]] = (struct sadmm_environment_progress){kept->report.step, kept->report.time,
                                                                       kept->stepped, false, kept->report};
        sadmm_environments_take_mark(environments, all[k]);
        const size_t joints = (size_t)merged->joints.count;
        for (size_t j = 0; j < joints; ++j)
            world->joints[joints * (size_t)all[k] + j].def.enabled = kept->enabled[j];
    }
    if (status == SADMM_OK && *done) set_behind(world);
    sadmm_free(blocks);
    sadmm_free(all);
    return status;
}
