/* One time step: the whole of the paper's Fig. 4, seen from above.
 *
 *     gather        dynamic bodies in slot order -> rigid[], collision bodies (gather.c)
 *     find_contacts broad phase, pair manifolds, matching with the last step
 *     plan          what this step needs (plan.c)
 *     solve         assembly, iterations (schedule.c)
 *     finish        integrate (Q), wrenches (R)
 *     certify       if asked for
 *     commit        states back into the slots; nothing before this line changes a body
 *
 * A backend that keeps the world runs the same schedule on its own (resident.c).
 */
#include <math.h>
#include <string.h>

#include "core/base/clock.h"
#include "core/base/memory.h"
#include "core/solve/registry.h"
#include "core/model/steady.h"
#include "world_internal.h"

/* Settled boxes have about ten contacts each; AUTO needs an order of magnitude before the first contact is known. */
enum { EXPECTED_CONTACTS_PER_BODY = 8 };

sadmm_status sadmm_world_choose_backend(sadmm_world *world)
{
    if (world->context) return SADMM_OK;
    int64_t expected = (int64_t)world->dynamic_count * EXPECTED_CONTACTS_PER_BODY;
    TRY(sadmm_backend_choose(world->def.backend, world->def.precision, expected, &world->kernels,
                             world->why, sizeof world->why, &world->error));
    return world->kernels->create(world->def.device, &world->context, &world->error);
}

static sadmm_status find_contacts(sadmm_world *world)
{
    struct sadmm_collision_input input = sadmm_world_collision_input(world);
    return sadmm_collision_find(world->collision, &input, &world->contacts, &world->error);
}

/* The starting impulses, which the solve replaces, and the deepest penetration: one pass over the points. */
static sadmm_status keep_start(sadmm_world *world, double *depth)
{
    const struct sadmm_contact_point *points = world->contacts.points;
    const size_t count = world->contacts.point_count;
    const int threads = sadmm_pass_threads(world->plan.threads, count);
    double deepest = 0;
    (void)threads;
    if (!sadmm_grow((void **)&world->start_impulse, &world->start_impulse_capacity, 0, 3 * count,
                    sizeof *world->start_impulse))
        return sadmm_fail_memory(&world->error, "the step's starting impulses");
#pragma omp parallel for schedule(static) num_threads(threads) if (threads > 1) reduction(max : deepest)
    for (size_t k = 0; k < count; ++k) {
        memcpy(world->start_impulse + 3 * k, points[k].impulse, 3 * sizeof *world->start_impulse);
        const double own = points[k].gap < 0 ? -points[k].gap : 0; /* a gap of 0 is 0 deep, not -0 */
        deepest = own > deepest ? own : deepest;
    }
    *depth = deepest;
    return SADMM_OK;
}

static bool finite_state(const struct sadmm_rigid *body)
{
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += body->position[k] - body->position[k];
    for (int k = 0; k < 4; ++k) sum += body->orientation[k] - body->orientation[k];
    for (int k = 0; k < 6; ++k) sum += body->velocity[k] - body->velocity[k];
    return sum == 0;
}

static sadmm_status check_next(sadmm_world *world)
{
    for (int32_t i = 0; i < world->dynamic_count; ++i)
        if (!finite_state(&world->next[i])) return sadmm_world_not_finite(world, i);
    return SADMM_OK;
}

/* The solve found something that is not finite: name a body of it. */
static sadmm_status name_culprit(sadmm_world *world)
{
    for (size_t k = 0; k < 6 * (size_t)world->dynamic_count; ++k)
        if (!isfinite(world->velocity[k])) return sadmm_world_not_finite(world, (int32_t)(k / 6));
    for (size_t p = 0; p < world->contacts.pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &world->contacts.pairs[p];
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k)
            for (int j = 0; j < 3; ++j)
                if (!isfinite(world->contacts.points[k].impulse[j]))
                    return sadmm_world_not_finite(world, pair->body_b >= 0 ? pair->body_b : pair->body_a);
    }
    return SADMM_ERROR_NON_FINITE;
}

static void commit(sadmm_world *world)
{
    const int threads = sadmm_pass_threads(world->plan.threads, (size_t)world->dynamic_count);
    (void)threads;
#pragma omp parallel for schedule(static) num_threads(threads) if (threads > 1)
    for (int32_t i = 0; i < world->dynamic_count; ++i) {
        struct sadmm_world_body *body = &world->bodies[world->slot_of[i]];
        steady_keep(&body->steady, &body->rigid, &world->next[i]);
        body->rigid = world->next[i];
        if (world->plan.wrenches) memcpy(body->contact_wrench, world->wrench + 6 * (size_t)i, sizeof body->contact_wrench);
    }
    world->stepped = true;
    world->contacts_readable = true;
}

/* Everything that may fail; the report is written on the way. *found: the contacts have been replaced. */
static sadmm_status try_step(sadmm_world *world, sadmm_step_report *report, bool *found)
{
    const struct sadmm_kernels *kernels = world->kernels;
    const sadmm_settings *settings = &world->def.settings;
    struct sadmm_solve_report solve = {0};
    double begin = sadmm_clock_ms();

    TRY(sadmm_world_gather(world));
    TRY(find_contacts(world));
    *found = true;
    double collided = sadmm_clock_ms();

    struct sadmm_system system = sadmm_world_system(world);
    world->plan = sadmm_plan_make(&system, settings);
    double depth = 0;
    TRY(keep_start(world, &depth));
    sadmm_status status = sadmm_schedule_solve(kernels, world->context, &system, settings, &world->plan, &solve,
                                               &report->ms, &world->error);
    if (status == SADMM_ERROR_NON_FINITE) return name_culprit(world);
    TRY(status);
    double solved = sadmm_clock_ms();

    TRY(kernels->integrate(world->context, world->next, &world->error));
    TRY(check_next(world));
    if (world->plan.wrenches) TRY(kernels->recover_wrenches(world->context, world->wrench, &world->error));
    double end = sadmm_clock_ms();

    report->certificate = solve.certificate;
    if (world->plan.certificate)
        TRY(sadmm_certify_with(&world->certificate_workspace, &system, settings, &report->certificate, &world->error));
    report->certify_ms = world->plan.certificate ? sadmm_clock_ms() - end : 0;

    report->backend = solve.backend;
    report->precision = solve.precision;
    report->threads = solve.threads;
    report->bodies = world->dynamic_count;
    report->contacts = (int32_t)world->contacts.point_count;
    report->pairs = (int32_t)world->contacts.pair_count;
    report->iterations = solve.iterations;
    report->iterations_mean = solve.iterations;
    report->converged = solve.converged;
    report->limited = solve.limited;
    report->residual = solve.residual;
    report->penetration_max = depth;
    report->ms.collide = collided - begin;
    report->ms.finish = end - solved;
    report->ms.total = end - begin;
    return SADMM_OK;
}

/* A step made by the host, kernel by kernel. */
static sadmm_status host_step(sadmm_world *world)
{
    sadmm_step_report report = world->report;
    bool found = false;
    TRY(sadmm_world_take_back(world));
    sadmm_status status = try_step(world, &report, &found);
    if (status != SADMM_OK) {
        world->contacts_readable = false;
        if (found) sadmm_collision_undo(world->collision, &world->contacts);
        return status;
    }
    commit(world);
    world->step_settings = world->def.settings;
    report.step = world->report.step + 1;
    report.time = world->report.time + world->def.settings.dt;
    world->report = report;
    return SADMM_OK;
}

sadmm_status sadmm_world_step(sadmm_world *world)
{
    TRY(sadmm_world_choose_backend(world));
    return sadmm_world_may_reside(world) ? sadmm_world_resident_step(world, true) : host_step(world);
}

sadmm_status sadmm_world_step_async(sadmm_world *world)
{
    TRY(sadmm_world_choose_backend(world));
    return sadmm_world_may_reside(world) ? sadmm_world_resident_step(world, false) : host_step(world);
}

sadmm_status sadmm_world_wait(sadmm_world *world) { return sadmm_world_settle(world); }

sadmm_status sadmm_world_report(const sadmm_world *world, sadmm_step_report *report)
{
    if (!report) return sadmm_fail((struct sadmm_error *)&world->error, SADMM_ERROR_INVALID_ARGUMENT, "report is NULL");
    TRY(sadmm_world_settle(world));
    *report = world->report;
    return SADMM_OK;
}

/* FNV-1a over the bit patterns. */
static uint64_t hash_doubles(uint64_t hash, const double *x, int count)
{
    for (int k = 0; k < count; ++k) {
        uint64_t bits;
        memcpy(&bits, &x[k], sizeof bits);
        for (int byte = 0; byte < 8; ++byte) {
            hash ^= bits >> (8 * byte) & 0xff;
            hash *= UINT64_C(0x100000001b3);
        }
    }
    return hash;
}

uint64_t sadmm_world_state_hash(const sadmm_world *world)
{
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    if (sadmm_world_pull_bodies(world) != SADMM_OK) return 0;
    for (size_t slot = 0; slot < world->body_slots; ++slot) {
        const struct sadmm_world_body *body = &world->bodies[slot];
        if (!body->alive) continue;
        hash = hash_doubles(hash, body->rigid.position, 3);
        hash = hash_doubles(hash, body->rigid.orientation, 4);
        hash = hash_doubles(hash, body->rigid.velocity, 6);
    }
    return hash;
}
