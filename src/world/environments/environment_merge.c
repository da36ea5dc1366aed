#include "environment_merge.h"

#include <string.h>

#include "core/base/memory.h"
#include "core/model/forces.h"
#include "core/model/joint_law.h"
#include "environment_backend.h"
#include "subadmm/coupling.h"
#include "subadmm/gear.h"
#include "world/objects/joint_slots.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"

/* ---- numbers of objects ------------------------------------------------------------------------------------------ */

/* The template's objects of a kind: their slots in order, and by slot which one it is. */
static sadmm_status list_slots(const struct sadmm_id_pool *ids, struct sadmm_environment_slots *out,
                               struct sadmm_error *error)
{
    out->slots = (size_t *)sadmm_alloc((size_t)ids->count, sizeof *out->slots);
    out->numbers = (int32_t *)sadmm_alloc(ids->slots, sizeof *out->numbers);
    if (!out->slots || !out->numbers) return sadmm_fail_memory(error, "environments");
    for (SADMM_OBJECTS(slot, ids)) {
        out->numbers[slot] = out->count;
        out->slots[out->count++] = slot;
    }
    return SADMM_OK;
}

/* In the merged world, the slot of an environment's object that is in `slot` of the template; -1 stays. */
static int32_t slot_in(const struct sadmm_environment_slots *of, int32_t environment, int32_t slot)
{
    return slot < 0 ? slot : environment * of->count + of->numbers[slot];
}

static int32_t template_slot(const struct sadmm_environment_slots *of, int32_t slot)
{
    return slot < 0 ? slot : (int32_t)of->slots[slot % of->count];
}

/* Bodies of a step, dynamic and kinematic ones, are numbered in the order of their slots. */
static int32_t step_body_in(const sadmm_world *world, int32_t environment, int32_t body)
{
    if (body >= 0) return environment * world->dynamic_count + body;
    return body == -1 ? -1 : body - environment * world->kinematic_count;
}

static int32_t template_step_body(const sadmm_world *world, int32_t environment, int32_t body)
{
    if (body >= 0) return body - environment * world->dynamic_count;
    return body == -1 ? -1 : body + environment * world->kinematic_count;
}

int32_t sadmm_environments_of_body(const struct sadmm_environments *environments, size_t slot)
{
    return (int32_t)slot / environments->merged.bodies.count;
}

/* ---- the merged world -------------------------------------------------------------------------------------------- */

/* The environments that the template's own bodies are in: how many, and which of them a body is in. */
static sadmm_status list_groups(struct sadmm_environments *environments, const sadmm_world *world,
                                struct sadmm_error *error)
{
    struct sadmm_merged_world *merged = &environments->merged;
    bool everywhere = false;
    merged->groups = (int32_t *)sadmm_alloc((size_t)merged->bodies.count, sizeof *merged->groups);
    int32_t *first = (int32_t *)sadmm_alloc((size_t)merged->bodies.count, sizeof *first);
    if (!merged->groups || !first) {
        sadmm_free(first);
        return sadmm_fail_memory(error, "environments");
    }
    for (int32_t i = 0; i < merged->bodies.count; ++i) {
        const int32_t own = world->bodies[merged->bodies.slots[i]].environment;
        int32_t group = 0;
        everywhere = everywhere || own < 0;
        if (own >= 0) {
            while (group < merged->group_count && first[group] != own) ++group;
            if (group == merged->group_count) first[merged->group_count++] = own;
        }
        merged->groups[i] = group;
    }
    sadmm_free(first);
    if (!everywhere || merged->group_count <= 1) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE,
                      "environments on CUDA: a world whose bodies are in %d environments must have none in "
                      "environment -1", merged->group_count);
}

static sadmm_status copy_bodies(struct sadmm_environments *environments, sadmm_world *from, int32_t environment)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *to = merged->world;
    const int32_t groups = merged->group_count > 1 ? merged->group_count : 1;
    for (int32_t i = 0; i < merged->bodies.count; ++i) {
        sadmm_body_def def = sadmm_body_def_default();
        sadmm_body_id id;
        TRY(sadmm_world_body_def_sized(from, sadmm_world_body_id(from, merged->bodies.slots[i]), &def, sizeof def));
        def.name = NULL; /* names and user data are the template's */
        def.user_data = NULL;
        def.environment = environment * groups + merged->groups[i];
        TRY(sadmm_world_add_body(to, &def, &id));
        to->bodies[id.slot - 1].rigid = from->bodies[merged->bodies.slots[i]].rigid;
    }
    return SADMM_OK;
}

/* As it is made from its definition, and then the very numbers and the revision of the template's. */
static sadmm_status copy_shapes(struct sadmm_environments *environments, sadmm_world *from, int32_t environment)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *to = merged->world;
    for (int32_t i = 0; i < merged->shapes.count; ++i) {
        const size_t slot = merged->shapes.slots[i];
        const struct sadmm_shape *own = &from->shapes[slot];
        const int32_t body = slot_in(&merged->bodies, environment, own->body);
        sadmm_shape_def def = sadmm_shape_def_default();
        sadmm_shape_id id;
        TRY(sadmm_world_shape_def_sized(from, sadmm_world_shape_id(from, slot), &def, sizeof def, NULL));
        def.name = NULL;
        def.user_data = NULL;
        TRY(sadmm_world_add_shape(to, sadmm_world_body_id(to, (size_t)body), &def, &id));
        struct sadmm_shape *made = &to->shapes[id.slot - 1];
        struct sadmm_geometry *geometry = &to->geometries[made->geometry];
        const uint32_t block = geometry->hull;
        memcpy(made->position, own->position, sizeof made->position);
        memcpy(made->orientation, own->orientation, sizeof made->orientation);
        made->revision = own->revision;
        *geometry = from->geometries[own->geometry];
        geometry->hull = block;
    }
    to->shape_revisions = from->shape_revisions;
    return SADMM_OK;
}

static sadmm_body_id body_id_in(const struct sadmm_environments *environments, int32_t environment, int32_t slot)
{
    const sadmm_body_id none = {0, 0};
    const struct sadmm_merged_world *merged = &environments->merged;
    return slot < 0 ? none : sadmm_world_body_id(merged->world, (size_t)slot_in(&merged->bodies, environment, slot));
}

static sadmm_status copy_joints(struct sadmm_environments *environments, const sadmm_world *from, int32_t environment)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *to = merged->world;
    for (int32_t i = 0; i < merged->joints.count; ++i) {
        const struct sadmm_world_joint *own = &from->joints[merged->joints.slots[i]];
        struct sadmm_world_joint made = {.def = own->def, .frame = {own->frame[0], own->frame[1]}, .last = own->last};
        size_t slot;
        for (int s = 0; s < 2; ++s) made.body[s] = slot_in(&merged->bodies, environment, own->body[s]);
        made.def.body_a = body_id_in(environments, environment, own->body[0]);
        made.def.body_b = body_id_in(environments, environment, own->body[1]);
        TRY(sadmm_world_insert_joint(to, &made, &slot));
        for (int k = 0; k < JOINT_COORDINATES; ++k) {
            const size_t numbers = 2 * (size_t)own->table_count[k];
            if (!own->table[k]) continue;
            double *table = (double *)sadmm_alloc(numbers, sizeof *table);
            if (!table) return sadmm_fail_memory(&to->error, "a table of a spring");
            memcpy(table, own->table[k], numbers * sizeof *table);
            sadmm_world_put_table(to, slot, k, table, own->table_count[k]);
        }
    }
    return SADMM_OK;
}

static sadmm_status copy_gears(struct sadmm_environments *environments, sadmm_world *from, int32_t environment)
{
    const struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *to = merged->world;
    for (SADMM_OBJECTS(slot, &from->gear_ids)) {
        const struct sadmm_world_gear *own = &from->gears[slot];
        sadmm_gear_def def = sadmm_gear_def_default();
        sadmm_gear_id id;
        size_t joint[2];
        TRY(sadmm_world_gear_def_sized(from, sadmm_world_gear_id(from, slot), &def, sizeof def));
        for (int k = 0; k < 2; ++k) joint[k] = (size_t)slot_in(&merged->joints, environment, (int32_t)own->joint[k]);
        def.name = NULL;
        def.user_data = NULL;
        def.joint_1 = sadmm_world_joint_id(to, joint[0]);
        def.joint_2 = sadmm_world_joint_id(to, joint[1]);
        TRY(sadmm_world_add_gear(to, &def, &id));
        to->gears[id.slot - 1].last = own->last;
    }
    return SADMM_OK;
}

static sadmm_status copy_couplings(struct sadmm_environments *environments, sadmm_world *from, int32_t environment)
{
    sadmm_world *to = environments->merged.world;
    for (SADMM_OBJECTS(slot, &from->coupling_ids)) {
        const struct sadmm_world_coupling *own = &from->couplings[slot];
        sadmm_coupling_def def = sadmm_coupling_def_default();
        sadmm_coupling_id id;
        TRY(sadmm_world_coupling_def_sized(from, sadmm_world_coupling_id(from, slot), &def, sizeof def));
        def.name = NULL;
        def.user_data = NULL;
        def.body = body_id_in(environments, environment, own->joint.body[1]);
        TRY(sadmm_world_add_coupling(to, &def, &id));
        struct sadmm_world_coupling *made = &to->couplings[id.slot - 1];
        memcpy(made->def.orientation, own->def.orientation, sizeof made->def.orientation);
        made->joint.frame[1] = own->joint.frame[1];
        made->joint.last = own->joint.last;
        made->last = own->last;
    }
    return SADMM_OK;
}

static sadmm_status copy_pairs(struct sadmm_pair_table *to, struct sadmm_pair_table *from,
                               const struct sadmm_environment_slots *slots, int32_t environment,
                               struct sadmm_error *error)
{
    const size_t count = sadmm_pair_table_count(from);
    for (size_t k = 0; k < count; ++k) {
        double value;
        const uint64_t key = sadmm_pair_table_at(from, k, &value);
        const int32_t a = slot_in(slots, environment, (int32_t)(key >> 32)),
                      b = slot_in(slots, environment, (int32_t)(uint32_t)key);
        TRY(sadmm_pair_table_set(to, sadmm_pair_key((size_t)a, (size_t)b), value, error));
    }
    return SADMM_OK;
}

static sadmm_status copy_objects(struct sadmm_environments *environments, sadmm_world *from, int32_t environment)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *to = merged->world;
    TRY(copy_bodies(environments, from, environment));
    TRY(copy_shapes(environments, from, environment));
    TRY(copy_joints(environments, from, environment));
    TRY(copy_gears(environments, from, environment));
    TRY(copy_couplings(environments, from, environment));
    TRY(copy_pairs(&to->disabled_pairs, &from->disabled_pairs, &merged->bodies, environment, &to->error));
    return copy_pairs(&to->friction_pairs, &from->friction_pairs, &merged->shapes, environment, &to->error);
}

sadmm_status sadmm_environments_merge(struct sadmm_environments *environments, struct sadmm_error *error)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *from = environments->worker[0].world;
    const size_t count = (size_t)environments->count;
    sadmm_world_def def = from->def;
    def.backend = SADMM_BACKEND_CPU; /* until it has the template's, which is there */
    def.settings = environments->settings;
    TRY(list_slots(&from->body_ids, &merged->bodies, error));
    TRY(list_slots(&from->shape_ids, &merged->shapes, error));
    TRY(list_slots(&from->joint_ids, &merged->joints, error));
    TRY(list_groups(environments, from, error));
    if ((double)environments->count * (merged->group_count > 1 ? merged->group_count : 1) > INT32_MAX)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "environments: %d times %d of the template's own",
                          environments->count, merged->group_count);
    merged->progress = (struct sadmm_environment_progress *)sadmm_alloc(count, sizeof *merged->progress);
    merged->contacts = (struct sadmm_contact_set *)sadmm_alloc(count, sizeof *merged->contacts);
    merged->replaced = (bool *)sadmm_alloc(count, sizeof *merged->replaced);
    merged->unwritten = (bool *)sadmm_alloc(count, sizeof *merged->unwritten);
    if (!merged->progress || !merged->contacts || !merged->replaced || !merged->unwritten)
        return sadmm_fail_memory(error, "environments");
    const sadmm_status status = sadmm_world_create(&def, &merged->world);
    if (status != SADMM_OK) return sadmm_fail(error, status, "%s", sadmm_last_message());
    merged->world->def.backend = from->def.backend;
    merged->world->kernels = from->kernels;
    merged->world->team = environments->team;
    for (int32_t e = 0; e < environments->count; ++e)
        if (copy_objects(environments, from, e) != SADMM_OK)
            return sadmm_fail(error, merged->world->error.status, "%s", merged->world->error.message);
    /* Impulses of a first step are not initialised: an environment that begins again begins like all others. */
    merged->world->stepped = true;
    merged->world->plan = from->plan;
    return SADMM_OK;
}

void sadmm_environments_free_merged(struct sadmm_environments *environments)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world_destroy(merged->world);
    for (int32_t e = 0; merged->contacts && e < environments->count; ++e)
        sadmm_contact_set_free(&merged->contacts[e]);
    sadmm_contact_set_free(&merged->spare);
    void *blocks[] = {merged->bodies.slots,    merged->bodies.numbers, merged->shapes.slots, merged->shapes.numbers,
                      merged->joints.slots,    merged->joints.numbers, merged->groups,       merged->progress,
                      merged->contacts,        merged->replaced,       merged->refusals,     merged->measures,
                      merged->kept,            merged->unwritten,      merged->gravities,  merged->left_last};
    for (size_t k = 0; k < sizeof blocks / sizeof *blocks; ++k) sadmm_free(blocks[k]);
}

/* ---- an environment of it ---------------------------------------------------------------------------------------- */

/* Pairs [*begin, *end) are of the environment. */
static void find_pairs(const struct sadmm_environments *environments, int32_t environment, size_t *begin, size_t *end)
{
    const struct sadmm_contact_set *set = &environments->merged.world->contacts;
    const int64_t shapes = environments->merged.shapes.count;
    for (int side = 0; side < 2; ++side) {
        const int64_t first = shapes * (environment + side);
        size_t low = 0, high = set->pair_count;
        while (low < high) {
            const size_t middle = low + (high - low) / 2;
            if (set->pairs[middle].shape_a < first) low = middle + 1;
            else high = middle;
        }
        *(side ? end : begin) = low;
    }
}

static sadmm_status reserve_contacts(struct sadmm_contact_set *set, size_t pairs, size_t points, bool migrate,
                                     struct sadmm_error *error)
{
    if (SADMM_GROW(set->pairs, 0, pairs) && SADMM_GROW(set->points, 0, points) &&
        (!migrate || sadmm_contact_set_reserve_migrations(set, points)))
        return SADMM_OK;
    return sadmm_fail_memory(error, "contacts");
}

/* Pairs [begin, end) of a set after those of another one, which has room. */
static void append_pairs(struct sadmm_contact_set *to, const struct sadmm_contact_set *from, size_t begin, size_t end)
{
    for (size_t p = begin; p < end; ++p) {
        const struct sadmm_contact_pair *own = &from->pairs[p];
        struct sadmm_contact_pair *pair = &to->pairs[to->pair_count++];
        *pair = *own;
        pair->first = (int32_t)to->point_count;
        for (int32_t k = own->first; k < own->first + own->count; ++k) {
            const size_t at = to->point_count++;
            to->points[at] = from->points[k];
            if (!from->points[k].migrates) continue;
            to->migrations[at] = from->migrations[k];
            ++to->migrating;
        }
    }
}

static size_t points_of(const struct sadmm_contact_set *set, size_t begin, size_t end)
{
    return begin == end ? 0 : (size_t)(set->pairs[end - 1].first + set->pairs[end - 1].count - set->pairs[begin].first);
}

static void begin_contacts(struct sadmm_contact_set *set) { set->pair_count = set->point_count = set->migrating = 0; }

static sadmm_status take_contacts(struct sadmm_environments *environments, sadmm_world *world, int32_t environment)
{
    const struct sadmm_merged_world *merged = &environments->merged;
    const struct sadmm_contact_set *all = &merged->world->contacts;
    struct sadmm_contact_set *set = &world->contacts;
    size_t begin, end;
    find_pairs(environments, environment, &begin, &end);
    TRY(reserve_contacts(set, end - begin, points_of(all, begin, end), all->migrating > 0, &world->error));
    begin_contacts(set);
    append_pairs(set, all, begin, end);
    set->dt = all->dt;
    for (size_t p = 0; p < set->pair_count; ++p) {
        struct sadmm_contact_pair *pair = &set->pairs[p];
        pair->shape_a = template_slot(&merged->shapes, pair->shape_a);
        pair->shape_b = template_slot(&merged->shapes, pair->shape_b);
        pair->body_a = template_step_body(world, environment, pair->body_a);
        pair->body_b = template_step_body(world, environment, pair->body_b);
    }
    return SADMM_OK;
}

bool sadmm_environments_report(const struct sadmm_environments *environments, int32_t environment,
                               sadmm_step_report *report)
{
    const struct sadmm_merged_world *merged = &environments->merged;
    const struct sadmm_environment_progress *progress = &merged->progress[environment];
    const struct sadmm_copy_measures *own = merged->measured ? &merged->measures[environment] : NULL;
    const bool checked = merged->world->step_settings.tolerance > 0;
    *report = progress->moved ? merged->world->report : progress->report;
    report->step = progress->step;
    report->time = progress->time;
    if (!progress->moved) return true;
    report->bodies = environments->worker[0].world->dynamic_count;
    report->error = own ? own->error : -1;
    report->error_kind = own ? SADMM_STEP_ERROR_LAW : SADMM_STEP_ERROR_NONE;
    report->unsolved = own && checked ? own->unsolved : -1;
    report->converged = own && checked && own->unsolved == 0;
    report->penetration_max = own ? own->penetration_max : 0;
    report->joint_drift = own ? own->joint_drift : 0;
    if (own) {
        report->iterations = own->iterations;
        report->contacts = own->contacts;
    }
    return own != NULL;
}

static bool takes_part(const struct sadmm_world_joint *joint)
{
    return joint->def.enabled && !joint->last.broken && joint_most_laws(&joint->def) > 0;
}

static void take_report(const struct sadmm_environments *environments, sadmm_world *world, int32_t environment)
{
    const struct sadmm_environment_progress *progress = &environments->merged.progress[environment];
    world->stepped = progress->stepped;
    (void)sadmm_environments_report(environments, environment, &world->report);
    if (!progress->moved) return;
    world->plan = environments->merged.world->plan;
    world->plan.bodies = world->dynamic_count;
    world->report.joints = world->report.couplings = 0;
    for (SADMM_OBJECTS(slot, &world->joint_ids))
        world->report.joints += takes_part(&world->joints[slot]);
    for (SADMM_OBJECTS(slot, &world->coupling_ids))
        world->report.couplings += takes_part(&world->couplings[slot].joint);
    world->plan.pairs = world->report.pairs = (int32_t)world->contacts.pair_count;
    world->plan.points = world->report.contacts = (int32_t)world->contacts.point_count;
}

sadmm_status sadmm_environments_take(struct sadmm_environments *environments, sadmm_world *world, int32_t environment)
{
    const struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *all = merged->world;
    const size_t bodies = (size_t)merged->bodies.count, joints = (size_t)merged->joints.count,
                 e = (size_t)environment;
    if (sadmm_environments_measure(environments) != SADMM_OK)
        return sadmm_fail(&world->error, environments->error.status, "%s", environments->error.message);
    sadmm_status status = sadmm_world_download_bodies(all);
    if (status == SADMM_OK) status = sadmm_world_download_contacts(all);
    if (status == SADMM_OK) status = sadmm_world_download_joints(all);
    if (status != SADMM_OK) return sadmm_fail(&world->error, status, "%s", all->error.message);
    for (size_t i = 0; i < bodies; ++i) {
        struct sadmm_world_body *to = &world->bodies[merged->bodies.slots[i]];
        const struct sadmm_world_body *from = &all->bodies[bodies * e + i];
        to->rigid = from->rigid;
        to->extrapolation = from->extrapolation;
        to->target = from->target;
        memcpy(to->contact_wrench, from->contact_wrench, sizeof to->contact_wrench);
    }
    for (size_t i = 0; i < joints; ++i) {
        struct sadmm_world_joint *to = &world->joints[merged->joints.slots[i]];
        const struct sadmm_world_joint *from = &all->joints[joints * e + i];
        to->last = from->last;
        to->def.enabled = from->def.enabled;
    }
    size_t gear = (size_t)world->gear_ids.count * e, coupling = (size_t)world->coupling_ids.count * e;
    for (SADMM_OBJECTS(slot, &world->gear_ids)) world->gears[slot].last = all->gears[gear++].last;
    for (SADMM_OBJECTS(slot, &world->coupling_ids)) {
        world->couplings[slot].last = all->couplings[coupling].last;
        world->couplings[slot].joint.last = all->couplings[coupling++].joint.last;
    }
    TRY(take_contacts(environments, world, environment));
    take_report(environments, world, environment);
    sadmm_environment_state_taken(world);
    return SADMM_OK;
}

static bool is_placed(const struct sadmm_world_body *a, const struct sadmm_world_body *b)
{
    return memcmp(a->rigid.position, b->rigid.position, sizeof a->rigid.position) == 0 &&
           memcmp(a->rigid.orientation, b->rigid.orientation, sizeof a->rigid.orientation) == 0;
}

/* What input arrays give a body stays. */
static void put_body(struct sadmm_world_body *to, const struct sadmm_world_body *from)
{
    const struct sadmm_rigid before = to->rigid;
    to->rigid = from->rigid;
    forces_copy(&to->rigid, &before);
    to->rigid.mass = before.mass;
    memcpy(to->rigid.inertia, before.inertia, sizeof before.inertia);
    to->extrapolation = from->extrapolation;
    to->target = from->target;
    memcpy(to->contact_wrench, from->contact_wrench, sizeof to->contact_wrench);
}

static sadmm_status put_contacts(struct sadmm_environments *environments, const sadmm_world *world,
                                 int32_t environment)
{
    struct sadmm_merged_world *merged = &environments->merged;
    const struct sadmm_contact_set *from = &world->contacts;
    struct sadmm_contact_set *set = &merged->contacts[environment];
    TRY(reserve_contacts(set, from->pair_count, from->point_count, from->migrating > 0, &environments->error));
    begin_contacts(set);
    append_pairs(set, from, 0, from->pair_count);
    set->dt = from->dt;
    for (size_t p = 0; p < set->pair_count; ++p) {
        struct sadmm_contact_pair *pair = &set->pairs[p];
        pair->shape_a = slot_in(&merged->shapes, environment, pair->shape_a);
        pair->shape_b = slot_in(&merged->shapes, environment, pair->shape_b);
        pair->body_a = step_body_in(world, environment, pair->body_a);
        pair->body_b = step_body_in(world, environment, pair->body_b);
    }
    merged->replaced[environment] = merged->any_replaced = true;
    return SADMM_OK;
}

sadmm_status sadmm_environments_put(struct sadmm_environments *environments, sadmm_world *world, int32_t environment)
{
    struct sadmm_merged_world *merged = &environments->merged;
    sadmm_world *all = merged->world;
    const size_t bodies = (size_t)merged->bodies.count, joints = (size_t)merged->joints.count,
                 e = (size_t)environment;
    if (sadmm_environments_measure(environments) != SADMM_OK)
        return sadmm_fail(&world->error, environments->error.status, "%s", environments->error.message);
    const sadmm_status status = sadmm_world_detach(all);
    if (status != SADMM_OK) return sadmm_fail(&world->error, status, "%s", all->error.message);
    TRY(put_contacts(environments, world, environment));
    for (size_t i = 0; i < bodies; ++i) {
        const struct sadmm_world_body *from = &world->bodies[merged->bodies.slots[i]];
        struct sadmm_world_body *to = &all->bodies[bodies * e + i];
        merged->static_moved = merged->static_moved || (from->type == SADMM_BODY_STATIC && !is_placed(to, from));
        put_body(to, from);
    }
    for (size_t i = 0; i < joints; ++i) {
        const struct sadmm_world_joint *from = &world->joints[merged->joints.slots[i]];
        struct sadmm_world_joint *to = &all->joints[joints * e + i];
        to->last = from->last;
        to->def.enabled = from->def.enabled;
    }
    size_t gear = (size_t)world->gear_ids.count * e, coupling = (size_t)world->coupling_ids.count * e;
    for (SADMM_OBJECTS(slot, &world->gear_ids)) all->gears[gear++].last = world->gears[slot].last;
    for (SADMM_OBJECTS(slot, &world->coupling_ids)) {
        all->couplings[coupling].last = world->couplings[slot].last;
        all->couplings[coupling++].joint.last = world->couplings[slot].joint.last;
    }
    merged->progress[environment] = (struct sadmm_environment_progress){
        world->report.step, world->report.time, world->stepped, false, world->report};
    sadmm_world_moved(all);
    return SADMM_OK;
}

/* Impulses of a step of another length are taken over in proportion, as steps do. */
static void fit_impulses(struct sadmm_contact_set *set, double dt)
{
    const double ratio = set->dt > 0 && dt > 0 ? dt / set->dt : 1;
    if (ratio == 1) return;
    for (size_t k = 0; k < set->point_count; ++k)
        for (int i = 0; i < 3; ++i) set->points[k].impulse[i] *= ratio;
}

sadmm_status sadmm_environments_put_contacts(struct sadmm_environments *environments)
{
    struct sadmm_merged_world *merged = &environments->merged;
    if (!merged->world || !merged->any_replaced) return SADMM_OK;
    struct sadmm_contact_set *now = &merged->world->contacts, *next = &merged->spare;
    size_t pairs = now->pair_count, points = now->point_count, migrating = now->migrating;
    for (int32_t e = 0; e < environments->count; ++e) {
        if (!merged->replaced[e]) continue;
        pairs += merged->contacts[e].pair_count;
        points += merged->contacts[e].point_count;
        migrating += merged->contacts[e].migrating;
    }
    TRY(reserve_contacts(next, pairs, points, migrating > 0, &environments->error));
    begin_contacts(next);
    next->dt = now->dt;
    size_t at = 0;
    for (int32_t e = 0; e < environments->count; ++e) {
        struct sadmm_contact_set *own = &merged->contacts[e];
        size_t begin, end;
        if (!merged->replaced[e]) continue;
        find_pairs(environments, e, &begin, &end);
        append_pairs(next, now, at, begin);
        at = end;
        if (next->dt == 0) next->dt = own->dt;
        fit_impulses(own, next->dt);
        append_pairs(next, own, 0, own->pair_count);
        sadmm_contact_set_free(own);
        memset(own, 0, sizeof *own);
        merged->replaced[e] = false;
    }
    append_pairs(next, now, at, now->pair_count);
    merged->any_replaced = false;
    const struct sadmm_contact_set before = *now;
    *now = *next;
    *next = before;
    merged->world->contacts_readable = false;
    merged->world->certified_step = -1;
    merged->world->start.hit_count = merged->world->start.hit_first = 0;
    return SADMM_OK;
}

/* ---- contacts ---------------------------------------------------------------------------------------------------- */

void sadmm_environments_rename_contact(const struct sadmm_environments *environments, sadmm_contact *contact,
                                       int32_t *environment)
{
    const struct sadmm_merged_world *merged = &environments->merged;
    const sadmm_world *world = environments->worker[0].world;
    const size_t shapes[2] = {contact->shape_a.slot - 1, contact->shape_b.slot - 1},
                 bodies[2] = {contact->body_a.slot - 1, contact->body_b.slot - 1};
    *environment = (int32_t)(shapes[0] / (size_t)merged->shapes.count);
    contact->shape_a = sadmm_world_shape_id(world, (size_t)template_slot(&merged->shapes, (int32_t)shapes[0]));
    contact->shape_b = sadmm_world_shape_id(world, (size_t)template_slot(&merged->shapes, (int32_t)shapes[1]));
    contact->body_a = sadmm_world_body_id(world, (size_t)template_slot(&merged->bodies, (int32_t)bodies[0]));
    contact->body_b = sadmm_world_body_id(world, (size_t)template_slot(&merged->bodies, (int32_t)bodies[1]));
}
