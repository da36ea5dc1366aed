/* A world that a backend keeps (resident.h): steps are enqueued there, and the host's copy follows on demand.
 *
 *     loaded           the backend has the world. States and wrenches set meanwhile are updates, which go along with
 *                      the next step; any other change first detaches the world, and the next step loads it again.
 *     running          steps were enqueued whose end nobody has waited for
 *     bodies_behind,   the host's bodies, or contacts with everything else about the last step, are older than the
 *     contacts_behind  backend's: getters download them, once
 *
 * What was set is in the host's bodies at once, however far behind they are; `set_at` says whether that is newer than
 * what a download brings. So the host's world is a whole one at any time, and what is left when a device is lost.
 */
#include <string.h>

#include "core/base/clock.h"
#include "core/base/memory.h"
#include "core/model/extrapolation.h"
#include "core/model/forces.h"
#include "core/solve/certificate.h"
#include "resident.h"
#include "resident_joints.h"
#include "resident_kinematic.h"
#include "world/state/report.h"
#include "world/step/decide.h"
#include "world/step/gather.h"
#include "world/step/hits.h"
#include "world/step/kinematic.h"

/* A step on the device is enqueued with all of its convergence checks, and those that nobody needs any more take time
 * as well. */
enum { MOST_CHECKS = 64 };

bool sadmm_world_may_reside(const sadmm_world *world)
{
    /* Of the stop rules a backend checks the tolerance in the method FAST alone; and the impulses of a first step
     * are initialised on the host. */
    const sadmm_settings settings = sadmm_settings_of_substep(&world->def.settings), *s = &settings;
    const bool fast = s->method == SADMM_METHOD_FAST,
               few_checks = (s->iterations - 1) / s->check_period < MOST_CHECKS / s->substeps;
    if (fast && !world->stepped) return false;
    if (sadmm_world_decides(world)) return false; /* between finding and solving, by the host */
    return world->kernels->resident && s->residual_tolerance <= 0 && (s->tolerance <= 0 || (fast && few_checks));
}

/* ---- updates ----------------------------------------------------------------------------------------------------- */

/* The body itself holds what was set last; of a kind the next step takes it along once, however often it was set. */
static void mark(sadmm_world *world, struct sadmm_world_body *body, uint32_t kinds)
{
    if (kinds && !body->dirty)
        world->resident.dirty[world->resident.dirty_count++] = (uint32_t)(body - world->bodies);
    body->dirty |= kinds;
}

void sadmm_world_update(sadmm_world *world, struct sadmm_world_body *body, enum sadmm_update_kind kind)
{
    if (!world->resident.loaded) return;
    mark(world, body, UINT32_C(1) << kind);
    body->set_at[kind] = world->resident.enqueued;
}

/* What was set for steps that have not been done goes along with the next one. */
static void update_body_again(sadmm_world *world, struct sadmm_world_body *body)
{
    for (int kind = 0; kind < SADMM_BODY_UPDATES; ++kind) {
        if (body->set_at[kind] < world->resident.done) continue;
        mark(world, body, UINT32_C(1) << kind);
        body->set_at[kind] = world->resident.done;
    }
}

static void update_again(sadmm_world *world)
{
    for (int32_t i = 0; i < world->dynamic_count; ++i) update_body_again(world, &world->bodies[world->slot_of[i]]);
    for (int32_t k = 0; k < world->kinematic_count; ++k)
        update_body_again(world, &world->bodies[world->kinematic_slots[k]]);
    sadmm_world_update_joints_again(world);
}

static void forget_updates(sadmm_world *world)
{
    for (size_t k = 0; k < world->resident.dirty_count; ++k) world->bodies[world->resident.dirty[k]].dirty = 0;
    world->resident.dirty_count = 0;
    sadmm_world_forget_joint_updates(world);
}

static void put_update(const sadmm_world *world, struct sadmm_resident_update *update,
                       const struct sadmm_world_body *body, enum sadmm_update_kind kind)
{
    const struct sadmm_rigid *rigid = &body->rigid;
    memset(update, 0, sizeof *update);
    update->kind = kind;
    update->target = body->system_body;
    if (kind == SADMM_UPDATE_STATE) {
        memcpy(update->values, rigid->position, sizeof rigid->position);
        memcpy(update->values + 3, rigid->orientation, sizeof rigid->orientation);
        memcpy(update->values + 7, rigid->velocity, sizeof rigid->velocity);
    } else if (kind == SADMM_UPDATE_TARGET) {
        update->values[0] = body->target.set;
        memcpy(update->values + 1, body->target.position, sizeof body->target.position);
        memcpy(update->values + 4, body->target.orientation, sizeof body->target.orientation);
        update->values[8] = world->def.settings.dt;
    } else {
        memcpy(update->values, rigid->wrench, sizeof rigid->wrench);
        update->values[6] = rigid->gravity_scale;
        memcpy(update->values + 7, rigid->damping, sizeof rigid->damping);
    }
}

static sadmm_status list_updates(sadmm_world *world, size_t *count)
{
    *count = 0;
    if (!SADMM_GROW(world->resident.updates, 0, SADMM_BODY_UPDATES * world->resident.dirty_count))
        return sadmm_fail_memory(&world->error, "changes of bodies");
    for (size_t k = 0; k < world->resident.dirty_count; ++k) {
        const struct sadmm_world_body *body = &world->bodies[world->resident.dirty[k]];
        for (int kind = 0; kind < SADMM_BODY_UPDATES; ++kind)
            if (body->dirty >> kind & 1)
                put_update(world, &world->resident.updates[(*count)++], body, (enum sadmm_update_kind)kind);
    }
    return sadmm_world_list_joint_updates(world, count);
}

/* ---- to the backend ---------------------------------------------------------------------------------------------- */

/* Nothing of it is on its way: what it is now goes along with the world. */
static void begin_updates(struct sadmm_world_body *body)
{
    body->dirty = 0;
    for (int kind = 0; kind < SADMM_BODY_UPDATES; ++kind) body->set_at[kind] = -1;
}

/* Which bodies joints hold. */
static sadmm_status list_held(sadmm_world *world)
{
    if (!SADMM_GROW(world->resident.held, 0, world->body_ids.slots)) return sadmm_fail_memory(&world->error, "hits");
    if (world->body_ids.slots > 0) memset(world->resident.held, 0, world->body_ids.slots);
    sadmm_world_mark_held(world, world->resident.held, 1);
    return SADMM_OK;
}

/* The world as it is now. What the last step started from stays: it can be read until a step is done. */
static sadmm_status load(sadmm_world *world)
{
    size_t n = (size_t)world->dynamic_count, kinematic = (size_t)world->kinematic_count;
    sadmm_world_swap_starts(world);
    sadmm_status status = sadmm_world_gather(world);
    sadmm_world_swap_starts(world);
    TRY(status);
    if (!SADMM_GROW(world->resident.extrapolation, 0, n + 1) ||
        !SADMM_GROW(world->resident.dirty, 0, n + kinematic + 1))
        return sadmm_fail_memory(&world->error, "the step");
    for (size_t i = 0; i < n; ++i) {
        struct sadmm_world_body *body = &world->bodies[world->slot_of[i]];
        world->resident.extrapolation[i] = body->extrapolation;
        begin_updates(body);
    }
    for (size_t k = 0; k < kinematic; ++k) begin_updates(&world->bodies[world->kinematic_slots[k]]);
    TRY(sadmm_world_list_kinematic(world));
    TRY(sadmm_world_list_joints(world));
    TRY(sadmm_world_list_gears(world));
    TRY(list_held(world));
    struct sadmm_collision_input input = sadmm_world_collision_input(world, 0);
    struct sadmm_resident_world whole = {
        .input = &input,
        .body_count = world->dynamic_count,
        .rigid = world->last_start.rigid,
        .extrapolation = world->resident.extrapolation,
        .slot_of = world->slot_of,
        .kinematic_count = world->kinematic_count,
        .kinematic = world->resident.kinematic,
        .contacts = &world->contacts,
        .joint_count = world->resident.joint_count,
        .joints = world->resident.joints,
        .joint_memory = world->resident.memory,
        .table_numbers = world->resident.table_numbers,
        .tables = world->resident.tables,
        .coupling_count = world->resident.coupling_count,
        .coupling_memory = world->resident.coupling_memory,
        .gear_count = world->resident.gear_count,
        .gears = world->resident.gears,
        .gear_force = world->resident.gear_force,
        .held = world->resident.held,
        .time = world->report.time,
        .copies = world->resident.copies,
        .gravities = world->resident.gravities,
    };
    TRY(world->kernels->resident->load(world->context, &whole, &world->def.settings, &world->error));
    world->resident.loaded = true;
    world->resident.enqueued = world->resident.done = world->resident.repeats = 0;
    world->resident.dirty_count = 0;
    for (size_t k = 0; k < kinematic; ++k) {
        struct sadmm_world_body *body = &world->bodies[world->kinematic_slots[k]];
        if (body->target.set) sadmm_world_update(world, body, SADMM_UPDATE_TARGET);
    }
    world->resident.kept_step = world->report.step;
    world->resident.kept_time = world->report.time;
    return SADMM_OK;
}

static sadmm_status certify(sadmm_world *world)
{
    TRY(sadmm_world_download_bodies(world));
    TRY(sadmm_world_download_contacts(world));
    struct sadmm_system system = sadmm_world_system(world);
    const sadmm_settings settings = sadmm_settings_of_substep(&world->step_settings);
    double begin = sadmm_clock_ms();
    TRY(sadmm_certify_with(&world->certificate_workspace, &system, &settings, &world->report.certificate,
                           &world->error));
    world->certified_step = world->report.step;
    world->report.certify_ms = sadmm_clock_ms() - begin;
    return SADMM_OK;
}

/* An error that a call without a status has left. */
static sadmm_status take_failed(sadmm_world *world)
{
    struct sadmm_error failed = world->resident.failed;
    if (failed.status == SADMM_OK) return SADMM_OK;
    world->resident.failed.status = SADMM_OK;
    return sadmm_fail(&world->error, failed.status, "%s", failed.message);
}

static sadmm_status synchronise(sadmm_world *world, sadmm_status status);

/* Load the world if need be, and enqueue a step. */
static sadmm_status enqueue(sadmm_world *world)
{
    const struct sadmm_resident_kernels *backend = world->kernels->resident;
    size_t count;
    if (!world->resident.loaded) TRY(load(world));
    TRY(list_updates(world, &count));
    sadmm_status status =
        backend->step(world->context, &world->def.settings, world->resident.updates, count, &world->error);
    world->resident.running = true;
    if (status != SADMM_OK)
        return synchronise(world, status); /* of this step or an earlier one: how far has the world got? */
    ++world->resident.enqueued;
    forget_updates(world);
    return SADMM_OK;
}

sadmm_status sadmm_world_resident_step(sadmm_world *world, bool wait)
{
    const bool certified = world->def.settings.certify && !world->resident.gravities; /* the host knows of one */
    double begin = sadmm_clock_ms();
    TRY(take_failed(world));
    TRY(sadmm_world_contain(world, enqueue(world)));
    if (!wait && !certified) return SADMM_OK;
    TRY(sadmm_world_synchronise(world));
    world->report.ms.total = sadmm_clock_ms() - begin; /* what the caller waited */
    return certified ? certify(world) : SADMM_OK;
}

/* ---- from the backend -------------------------------------------------------------------------------------------- */

static void take_report(sadmm_world *world, const struct sadmm_resident_report *done)
{
    int64_t steps = done->done - world->resident.done;
    world->report.repeated += done->repeats - world->resident.repeats;
    world->resident.repeats = done->repeats;
    if (steps <= 0) return;
    world->resident.done = done->done;
    world->resident.bodies_behind = world->resident.contacts_behind = true;
    world->start.hit_count = world->start.hit_first = 0;
    world->resident.hits_behind = true;
    world->resident.joints_behind = world->resident.joint_count > 0;
    world->stepped = world->contacts_readable = true;
    world->plan = done->plan;
    world->step_settings = done->settings;
    sadmm_world_report_steps(world, steps, done);
}

/* Hits of the last step, for who reads contacts, or events. */
static sadmm_status download_hits(sadmm_world *world)
{
    const struct sadmm_resident_kernels *backend = world->kernels->resident;
    struct sadmm_step_start *start = &world->start;
    size_t count, first;
    if (!world->resident.hits_behind) return SADMM_OK;
    for (;;) {
        TRY(backend->read_hits(world->context, start->hits, SADMM_ROOM(start->hits), &count, &first, &world->error));
        if (count <= SADMM_ROOM(start->hits)) break;
        if (!SADMM_GROW(start->hits, 0, count)) return sadmm_fail_memory(&world->error, "hits");
    }
    start->hit_count = count;
    start->hit_first = first;
    world->resident.hits_behind = false;
    return SADMM_OK;
}

/* `status`: of the call before, or SADMM_OK. The error of a step that failed is returned once. */
static sadmm_status synchronise(sadmm_world *world, sadmm_status status)
{
    struct sadmm_resident_report report = {.offending_body = -1};
    if (!world->resident.running) return status;
    world->resident.running = false;
    const struct sadmm_error before = world->error;
    const sadmm_status waited = world->kernels->resident->wait(world->context, &report, &world->error);
    if (waited == SADMM_OK) world->error = before;
    else status = waited;
    take_report(world, &report);
    if (status == SADMM_OK) status = download_hits(world);
    if (status != SADMM_OK) {
        /* The step that failed may have written over what the last one started from: only a copy on the host is
         * left. */
        if (world->resident.contacts_behind) world->contacts_readable = false;
        update_again(world);
    }
    world->resident.enqueued = world->resident.done;
    if (status != SADMM_ERROR_NON_FINITE || report.offending_body == -1) return status;
    if (!sadmm_body_is_kinematic(report.offending_body)) return sadmm_world_not_finite(world, report.offending_body);
    return sadmm_world_slot_not_finite(world, world->kinematic_slots[sadmm_kinematic(report.offending_body)]);
}

/* The backend does not change forces, nor a state that was set after the last step. */
static sadmm_status download_bodies(sadmm_world *world)
{
    TRY(synchronise(world, SADMM_OK));
    if (!world->resident.bodies_behind) return SADMM_OK;
    TRY(world->kernels->resident->read_bodies(world->context, world->next, world->resident.extrapolation,
                                              world->plan.wrenches ? world->wrench : NULL, &world->error));
    for (int32_t i = 0; i < world->dynamic_count; ++i) {
        struct sadmm_world_body *body = &world->bodies[world->slot_of[i]];
        forces_copy(&world->next[i], &body->rigid);
        body->extrapolation = world->resident.extrapolation[i];
        if (body->set_at[SADMM_UPDATE_STATE] < world->resident.done) body->rigid = world->next[i];
        else extrapolation_place(&body->extrapolation, &world->next[i], body->rigid.position, body->rigid.orientation);
        if (world->plan.wrenches)
            memcpy(body->contact_wrench, world->wrench + 6 * (size_t)i, sizeof body->contact_wrench);
    }
    TRY(sadmm_world_read_kinematic(world));
    sadmm_world_moved(world);
    world->resident.bodies_behind = false;
    world->resident.kept_step = world->report.step;
    world->resident.kept_time = world->report.time;
    return SADMM_OK;
}

/* Contacts last: they are the old ones until all is there. */
static sadmm_status download_contacts(sadmm_world *world)
{
    const struct sadmm_resident_kernels *backend = world->kernels ? world->kernels->resident : NULL;
    TRY(synchronise(world, SADMM_OK));
    if (!world->resident.contacts_behind) return SADMM_OK;
    size_t count = (size_t)world->report.contacts, n = (size_t)world->dynamic_count;
    struct sadmm_step_start *start = &world->start;
    if (!SADMM_GROW(start->rigid, 0, n + 1) || !SADMM_GROW(start->velocity, 0, 6 * (n + 1)) ||
        !SADMM_GROW(start->impulse, 0, 3 * count))
        return sadmm_fail_memory(&world->error, "the step's starting impulses");
    TRY(backend->read_start(world->context, start->rigid, start->velocity, start->impulse, &world->error));
    TRY(sadmm_world_read_kinematic_start(world));
    TRY(backend->read_bodies(world->context, world->next, NULL, NULL, &world->error));
    for (size_t i = 0; i < n; ++i)
        memcpy(world->velocity + 6 * i, world->next[i].velocity, 6 * sizeof *world->velocity);
    TRY(sadmm_world_read_rows(world));
    TRY(backend->read_contacts(world->context, &world->contacts, &world->error));
    world->resident.contacts_behind = false;
    return SADMM_OK;
}

static sadmm_status download_joints(sadmm_world *world)
{
    TRY(synchronise(world, SADMM_OK));
    if (!world->resident.joints_behind) return SADMM_OK;
    TRY(sadmm_world_read_joints(world));
    world->resident.joints_behind = false;
    return SADMM_OK;
}

static sadmm_status detach(sadmm_world *world)
{
    if (!world->resident.loaded) return SADMM_OK;
    TRY(download_bodies(world));
    TRY(download_contacts(world));
    TRY(download_joints(world));
    world->resident.loaded = false;
    forget_updates(world);
    return SADMM_OK;
}

/* ---- a device that fails ----------------------------------------------------------------------------------------- */

/* A call may fail and the next one succeed: then nothing is lost. Steps whose end the backend cannot report have not
 * been done. */
static bool save(sadmm_world *world)
{
    world->resident.running = true;
    return synchronise(world, SADMM_OK) != SADMM_ERROR_DEVICE && detach(world) == SADMM_OK;
}

/* The steps after the bodies were read last are lost; what was set since then is in the bodies. */
static void fall_back(sadmm_world *world)
{
    world->contacts_readable =
        world->contacts_readable && !world->resident.bodies_behind && !world->resident.contacts_behind;
    world->report.step = world->resident.kept_step;
    world->report.time = world->resident.kept_time;
    world->stepped = world->report.step > 0;
    world->resident.loaded = world->resident.running = false;
    world->resident.bodies_behind = world->resident.contacts_behind = world->resident.joints_behind = false;
    forget_updates(world);
}

sadmm_status sadmm_world_contain(sadmm_world *world, sadmm_status status)
{
    if (status != SADMM_ERROR_DEVICE || !world->context) return status;
    const struct sadmm_error cause = world->error;
    if (world->resident.loaded && !save(world)) fall_back(world);
    world->kernels->destroy(world->context);
    world->context = NULL;
    sadmm_push_destroy(world->push); /* it has a context of the same device */
    world->push = NULL;
    return sadmm_fail(&world->error, SADMM_ERROR_DEVICE, "%s; the world is as after step %lld", cause.message,
                      (long long)world->report.step);
}

sadmm_status sadmm_world_synchronise(sadmm_world *world)
{
    TRY(take_failed(world));
    return sadmm_world_contain(world, synchronise(world, SADMM_OK));
}

void sadmm_world_synchronise_quietly(sadmm_world *world)
{
    if (world->resident.failed.status != SADMM_OK) return;
    if (sadmm_world_contain(world, synchronise(world, SADMM_OK)) != SADMM_OK) world->resident.failed = world->error;
}

sadmm_status sadmm_world_download_bodies(sadmm_world *world)
{
    TRY(take_failed(world));
    return sadmm_world_contain(world, download_bodies(world));
}

sadmm_status sadmm_world_download_contacts(sadmm_world *world)
{
    TRY(take_failed(world));
    return sadmm_world_contain(world, download_contacts(world));
}

sadmm_status sadmm_world_read_touching(sadmm_world *world, struct sadmm_touching_shapes *touching)
{
    return sadmm_world_contain(world,
                               world->kernels->resident->read_touching(world->context, touching, &world->error));
}

sadmm_status sadmm_world_download_joints(sadmm_world *world)
{
    TRY(take_failed(world));
    return sadmm_world_contain(world, download_joints(world));
}

sadmm_status sadmm_world_detach(sadmm_world *world)
{
    TRY(take_failed(world));
    return sadmm_world_contain(world, detach(world));
}
