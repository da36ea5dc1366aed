/* A world that a backend keeps (resident.h): steps are enqueued there, and the host's copy follows on demand.
 *
 *     loaded           the backend has the world. States and wrenches set meanwhile are remembered as edits and go along
 *                      with the next step; any other change first takes the world back, and the next step loads it anew.
 *     running          steps were enqueued whose end nobody has waited for
 *     bodies_behind,   the host's bodies, or contacts with everything else about the last step, are older than the
 *     contacts_behind  backend's: getters pull them, once
 */
#include <string.h>

#include "core/base/clock.h"
#include "core/base/memory.h"
#include "core/model/settings.h"
#include "core/model/steady.h"
#include "core/solve/certificate.h"
#include "world_internal.h"

/* A resident step is enqueued with all of its looks, and those that nobody needs any more take time as well. */
enum { MOST_LOOKS = 64 };

bool sadmm_world_may_reside(const sadmm_world *world)
{
    /* Of the stop rules a backend looks at the certificate's in the method FAST alone; and the loads of a first step are
     * predicted on the host. */
    const sadmm_settings *s = &world->def.settings;
    const bool fast = s->method == SADMM_METHOD_FAST, few_looks = (s->iterations - 1) / s->check_period < MOST_LOOKS;
    if (fast && !world->stepped) return false;
    return world->kernels->resident && s->residual_tolerance <= 0 &&
           (s->certificate_tolerance <= 0 || (fast && few_looks));
}

/* ---- edits ------------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_world_edit_room(sadmm_world *world)
{
    if (!world->resident.loaded) return SADMM_OK;
    if (!sadmm_grow((void **)&world->resident.edits, &world->resident.edit_capacity, world->resident.edit_count,
                    world->resident.edit_count + 1, sizeof *world->resident.edits))
        return sadmm_fail_memory(&world->error, "a change of a body");
    return SADMM_OK;
}

void sadmm_world_edit(sadmm_world *world, const struct sadmm_world_body *body, uint32_t what)
{
    if (!world->resident.loaded) return;
    struct sadmm_resident_edit *edit = &world->resident.edits[world->resident.edit_count++];
    edit->body = body->system_body;
    edit->what = what;
    memcpy(edit->position, body->rigid.position, sizeof edit->position);
    memcpy(edit->orientation, body->rigid.orientation, sizeof edit->orientation);
    memcpy(edit->velocity, body->rigid.velocity, sizeof edit->velocity);
    memcpy(edit->wrench, body->rigid.wrench, sizeof edit->wrench);
}

static void apply(struct sadmm_world_body *body, const struct sadmm_resident_edit *edit)
{
    struct sadmm_rigid *rigid = &body->rigid;
    if (edit->what & SADMM_EDIT_STATE) {
        steady_place(&body->steady, rigid, edit->position, edit->orientation);
        memcpy(rigid->position, edit->position, sizeof rigid->position);
        memcpy(rigid->orientation, edit->orientation, sizeof rigid->orientation);
        memcpy(rigid->velocity, edit->velocity, sizeof rigid->velocity);
    }
    if (edit->what & SADMM_EDIT_WRENCH) memcpy(rigid->wrench, edit->wrench, sizeof rigid->wrench);
}

/* ---- to the backend ---------------------------------------------------------------------------------------------- */

/* The world as it is now. What the last step started from stays: it can be read until a step is done. */
static sadmm_status load(sadmm_world *world)
{
    size_t n = (size_t)world->dynamic_count;
    sadmm_world_swap_starts(world);
    sadmm_status status = sadmm_world_gather(world);
    sadmm_world_swap_starts(world);
    TRY(status);
    if (!sadmm_grow((void **)&world->resident.steady, &world->resident.steady_capacity, 0, n + 1,
                    sizeof *world->resident.steady))
        return sadmm_fail_memory(&world->error, "the step");
    for (size_t i = 0; i < n; ++i) world->resident.steady[i] = world->bodies[world->slot_of[i]].steady;
    struct sadmm_collision_input input = sadmm_world_collision_input(world);
    struct sadmm_resident_world whole = {
        .input = &input,
        .body_count = world->dynamic_count,
        .rigid = world->last_start.rigid,
        .steady = world->resident.steady,
        .slot_of = world->slot_of,
        .contacts = &world->contacts,
    };
    TRY(world->kernels->resident->load(world->context, &whole, &world->def.settings, &world->error));
    world->resident.loaded = true;
    world->resident.done = world->resident.repeats = 0;
    world->resident.edit_count = 0;
    return SADMM_OK;
}

static sadmm_status certify(sadmm_world *world)
{
    TRY(sadmm_world_pull_bodies(world));
    TRY(sadmm_world_pull_contacts(world));
    struct sadmm_system system = sadmm_world_system(world);
    double begin = sadmm_clock_ms();
    TRY(sadmm_certify_with(&world->certificate_workspace, &system, &world->step_settings, &world->report.certificate,
                           &world->error));
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

sadmm_status sadmm_world_resident_step(sadmm_world *world, bool wait)
{
    const struct sadmm_resident_kernels *backend = world->kernels->resident;
    const sadmm_settings *settings = &world->def.settings;
    double begin = sadmm_clock_ms();
    TRY(take_failed(world));
    bool other = !sadmm_settings_equal(&world->resident.settings, settings);
    if (other) TRY(sadmm_world_settle(world));
    if (!world->resident.loaded) TRY(load(world));
    if (world->resident.edit_count > 0) {
        TRY(backend->edit(world->context, world->resident.edits, world->resident.edit_count, &world->error));
        world->resident.edit_count = 0;
        world->resident.bodies_behind = true;
    }
    world->resident.settings = *settings;
    sadmm_status status = backend->step(world->context, settings, &world->error);
    world->resident.running = true;
    if (status != SADMM_OK) { /* of this step or an earlier one: how far the world has got */
        struct sadmm_error kept = world->error;
        sadmm_status waited = sadmm_world_settle(world);
        if (waited == SADMM_OK) world->error = kept;
        return waited == SADMM_OK ? status : waited;
    }
    if (!wait && !settings->certify) return SADMM_OK;
    TRY(sadmm_world_settle(world));
    world->report.ms.total = sadmm_clock_ms() - begin; /* what the caller waited */
    return settings->certify ? certify(world) : SADMM_OK;
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
    world->stepped = world->contacts_readable = true;
    world->plan = done->plan;
    world->step_settings = world->resident.settings;
    sadmm_world_report_steps(world, steps, done);
}

static sadmm_status wait_for_steps(sadmm_world *world)
{
    struct sadmm_resident_report report = {.culprit = -1};
    if (!world->resident.running) return SADMM_OK;
    world->resident.running = false;
    sadmm_status status = world->kernels->resident->wait(world->context, &report, &world->error);
    take_report(world, &report);
    /* The step that failed may have written over what the last one started from: only a copy on the host is left. */
    if (status != SADMM_OK && world->resident.contacts_behind) world->contacts_readable = false;
    return status == SADMM_ERROR_NON_FINITE && report.culprit >= 0 ? sadmm_world_not_finite(world, report.culprit)
                                                                   : status;
}

sadmm_status sadmm_world_settle(sadmm_world *world)
{
    TRY(take_failed(world));
    return wait_for_steps(world);
}

void sadmm_world_settle_quietly(sadmm_world *world)
{
    if (world->resident.failed.status == SADMM_OK && wait_for_steps(world) != SADMM_OK) world->resident.failed = world->error;
}

sadmm_status sadmm_world_pull_bodies(sadmm_world *world)
{
    TRY(sadmm_world_settle(world));
    if (!world->resident.bodies_behind) return SADMM_OK;
    TRY(world->kernels->resident->read_bodies(world->context, world->next, world->resident.steady,
                                              world->plan.wrenches ? world->wrench : NULL, &world->error));
    for (int32_t i = 0; i < world->dynamic_count; ++i) {
        struct sadmm_world_body *body = &world->bodies[world->slot_of[i]];
        body->rigid = world->next[i];
        body->steady = world->resident.steady[i];
        if (world->plan.wrenches)
            memcpy(body->contact_wrench, world->wrench + 6 * (size_t)i, sizeof body->contact_wrench);
    }
    for (size_t k = 0; k < world->resident.edit_count; ++k)
        apply(&world->bodies[world->slot_of[world->resident.edits[k].body]], &world->resident.edits[k]);
    world->resident.bodies_behind = false;
    return SADMM_OK;
}

sadmm_status sadmm_world_pull_contacts(sadmm_world *world)
{
    const struct sadmm_resident_kernels *backend = world->kernels ? world->kernels->resident : NULL;
    TRY(sadmm_world_settle(world));
    if (!world->resident.contacts_behind) return SADMM_OK;
    size_t count = (size_t)world->report.contacts, n = (size_t)world->dynamic_count;
    struct sadmm_step_start *start = &world->start;
    if (!sadmm_grow((void **)&start->rigid, &start->rigid_capacity, 0, n + 1, sizeof *start->rigid) ||
        !sadmm_grow((void **)&start->velocity, &start->velocity_capacity, 0, 6 * (n + 1), sizeof *start->velocity) ||
        !sadmm_grow((void **)&start->impulse, &start->impulse_capacity, 0, 3 * count, sizeof *start->impulse))
        return sadmm_fail_memory(&world->error, "the step's starting impulses");
    TRY(backend->read_contacts(world->context, &world->contacts, &world->error));
    TRY(backend->read_start(world->context, start->rigid, start->velocity, start->impulse, &world->error));
    TRY(backend->read_bodies(world->context, world->next, NULL, NULL, &world->error));
    for (size_t i = 0; i < n; ++i)
        memcpy(world->velocity + 6 * i, world->next[i].velocity, 6 * sizeof *world->velocity);
    world->resident.contacts_behind = false;
    return SADMM_OK;
}

sadmm_status sadmm_world_take_back(sadmm_world *world)
{
    if (!world->resident.loaded) return SADMM_OK;
    TRY(sadmm_world_pull_bodies(world));
    TRY(sadmm_world_pull_contacts(world));
    world->resident.loaded = false;
    world->resident.edit_count = 0;
    return SADMM_OK;
}
