/* The world as a step reads it: dynamic bodies in slot order, bodies and shapes as collision sees them, the system. */
#include <math.h>
#include <string.h>

#include "collision/base/bounds.h"
#include "core/base/barrier.h"
#include "core/base/definition_fields.h"
#include "core/base/memory.h"
#include "core/math/weight.h"
#include "core/model/extrapolation.h"
#include "core/model/forces.h"
#include "coupling_step.h"
#include "gather.h"
#include "joint_rows.h"
#include "kinematic.h"

static bool moves(const sadmm_world *world, size_t slot)
{
    return sadmm_ids_has(&world->body_ids, slot) && world->bodies[slot].type == SADMM_BODY_DYNAMIC;
}

static int32_t count_moving(const sadmm_world *world, size_t begin, size_t end)
{
    int32_t count = 0;
    for (size_t slot = begin; slot < end; ++slot) count += moves(world, slot);
    return count;
}

/* A body as collision sees it. */
static void place(struct sadmm_collision_body *out, const struct sadmm_rigid *rigid, bool dynamic,
                  const sadmm_settings *settings)
{
    memcpy(out->position, rigid->position, sizeof out->position);
    memcpy(out->orientation, rigid->orientation, sizeof out->orientation);
    memcpy(out->velocity, rigid->velocity, sizeof out->velocity);
    out->acceleration[0] = out->acceleration[1] = out->inertia = 0;
    out->mean = dynamic ? rigid->mean : 1;
    if (!dynamic) return;
    out->acceleration[0] = forces_acceleration(rigid, settings->gravity, settings->dt);
    out->acceleration[1] = forces_angular_acceleration(rigid, settings->dt);
    out->inertia = v3_max_abs(v3_load(rigid->inertia));
}

/* Where the solve for a dynamic body starts. dt: of the sub-step. */
static void start_body(sadmm_world *world, int32_t i, const struct sadmm_rigid *rigid,
                       const struct sadmm_extrapolation *extrapolation, double dt)
{
    double *velocity = world->velocity + 6 * (size_t)i;
    world->start.rigid[i] = *rigid;
    extrapolation_start(rigid, extrapolation, dt, velocity);
    memcpy(world->start.velocity + 6 * (size_t)i, velocity, 6 * sizeof *velocity);
}

/* Of bodies. */
struct mass_range {
    double lightest, heaviest;
};

/* Slots [begin, end), whose dynamic bodies are `dynamic` and the following. */
static struct mass_range gather_slots(sadmm_world *world, size_t begin, size_t end, int32_t dynamic)
{
    struct mass_range range = {INFINITY, 0};
    const sadmm_settings settings = sadmm_settings_of_substep(&world->def.settings);
    for (size_t slot = begin; slot < end; ++slot) {
        struct sadmm_world_body *body = &world->bodies[slot];
        struct sadmm_collision_body *out = &world->collision_bodies[slot];
        out->placed = body->extrapolation.placed;
        out->environment = body->environment;
        out->system_body = body->system_body = -1;
        place(out, &body->rigid, moves(world, slot), &settings);
        if (!moves(world, slot)) continue;
        out->system_body = body->system_body = dynamic;
        start_body(world, dynamic, &body->rigid, &body->extrapolation, settings.dt);
        if (settings.substeps > 1) world->extrapolation[dynamic] = body->extrapolation;
        world->slot_of[dynamic++] = (int32_t)slot;
        range.lightest = min_of(range.lightest, body->rigid.mass);
        range.heaviest = max_of(range.heaviest, body->rigid.mass);
    }
    return range;
}

static int last_threads(const sadmm_world *world) /* by the contacts of the last step */
{
    return sadmm_plan_threads(&world->team, world->def.settings.threads, world->contacts.point_count);
}

struct gathering {
    sadmm_world *world;
    struct sadmm_barrier barrier;
    int32_t moving[SADMM_MOST_THREADS]; /* dynamic bodies in each member's share of the slots; */
    struct mass_range masses[SADMM_MOST_THREADS]; /* theirs */
};

static void gather_share(void *argument, int thread, int threads)
{
    struct gathering *g = (struct gathering *)argument;
    size_t begin, end;
    int32_t first = 0;
    sadmm_share(g->world->body_ids.slots, thread, threads, &begin, &end);
    g->moving[thread] = count_moving(g->world, begin, end);
    sadmm_barrier_wait(&g->barrier, threads);
    for (int t = 0; t < thread; ++t) first += g->moving[t];
    g->masses[thread] = gather_slots(g->world, begin, end, first);
}

sadmm_status sadmm_world_gather(sadmm_world *world)
{
    /* One at least: a system without bodies is still one of rigid bodies. */
    size_t n = (size_t)world->dynamic_count + 1, slots = world->body_ids.slots;
    const size_t several = world->def.settings.substeps > 1 ? n : 0;
    if (!SADMM_GROW(world->collision_bodies, 0, slots) || !SADMM_GROW(world->start.rigid, 0, n) ||
        !SADMM_GROW(world->next, 0, n) || !SADMM_GROW(world->velocity, 0, 6 * n) ||
        !SADMM_GROW(world->wrench, 0, 6 * n) || !SADMM_GROW(world->start.velocity, 0, 6 * n) ||
        !SADMM_GROW(world->extrapolation, 0, several) || !SADMM_GROW(world->wrench_sum, 0, 6 * several) ||
        !SADMM_GROW(world->slot_of, 0, n))
        return sadmm_fail_memory(&world->error, "the step");
    struct gathering g;
    g.world = world;
    g.barrier = (struct sadmm_barrier){0};
    const int ran =
        sadmm_parallel(&world->team, sadmm_pass_threads(last_threads(world), slots), gather_share, &g);
    struct mass_range masses = g.masses[0];
    for (int t = 1; t < ran; ++t) {
        masses.lightest = min_of(masses.lightest, g.masses[t].lightest);
        masses.heaviest = max_of(masses.heaviest, g.masses[t].heaviest);
    }
    world->uneven_masses = weight_is_uneven(masses.lightest, masses.heaviest);
    TRY(sadmm_world_gather_kinematic(world));
    sadmm_world_begin_couplings(world);
    return sadmm_world_begin_joints(world);
}

struct turning {
    sadmm_world *world;
    int substep;
};

static void turn_share(void *argument, int thread, int threads)
{
    const struct turning *turning = (const struct turning *)argument;
    sadmm_world *world = turning->world;
    const sadmm_settings settings = sadmm_settings_of_substep(&world->def.settings);
    const double dt = settings.dt;
    size_t begin, end;
    sadmm_share((size_t)world->dynamic_count, thread, threads, &begin, &end);
    for (size_t i = begin; i < end; ++i) {
        const struct sadmm_rigid *next = &world->next[i];
        extrapolation_keep(&world->extrapolation[i], &world->start.rigid[i], next, dt);
        start_body(world, (int32_t)i, next, &world->extrapolation[i], dt);
        place(&world->collision_bodies[world->slot_of[i]], next, true, &settings);
    }
    if (!world->plan.wrenches) return;
    for (size_t k = 6 * begin; k < 6 * end; ++k)
        world->wrench_sum[k] = (turning->substep > 0 ? world->wrench_sum[k] : 0) + world->wrench[k];
}

void sadmm_world_turn(sadmm_world *world, int substep)
{
    struct turning turning = {world, substep};
    sadmm_parallel(&world->team, sadmm_pass_threads(world->plan.threads, (size_t)world->dynamic_count), turn_share,
                   &turning);
    sadmm_world_turn_kinematic(world);
}

void sadmm_world_swap_starts(sadmm_world *world)
{
    const struct sadmm_step_start start = world->start;
    world->start = world->last_start;
    world->last_start = start;
}

struct sadmm_collision_input sadmm_world_collision_input(const sadmm_world *world, int substep)
{
    const sadmm_settings settings = sadmm_settings_of_substep(&world->def.settings);
    const bool jointed = sadmm_pair_table_count(&world->jointed_pairs) > 0;
    struct sadmm_collision_input input = {
        .shapes = world->shapes,
        .shape_count = world->shape_ids.slots,
        .geometries = world->geometries,
        .geometry_count = world->shape_ids.slots,
        .hulls = world->shape_data.doubles > 0 ? world->shape_data.blocks : NULL,
        .hull_doubles = world->shape_data.doubles,
        .hull_revision = world->shape_data.revision + world->shape_changes,
        .bodies = world->collision_bodies,
        .body_count = world->body_ids.slots,
        .dt = settings.dt,
        .substeps_left = settings.substeps - 1 - substep,
        .margin = world->def.contact_margin,
        .threads = last_threads(world),
        .disabled_body_pairs = jointed ? world->filtered_pairs : world->disabled_pairs.keys,
        .disabled_body_pair_count = jointed ? world->filtered_count : sadmm_pair_table_count(&world->disabled_pairs),
        .friction_pairs = world->friction_pairs.keys,
        .friction_values = world->friction_pairs.values,
        .friction_pair_count = sadmm_pair_table_count(&world->friction_pairs),
        .gravity = gravity_size(settings.gravity),
        .since = world->hit_since,
    };
    return input;
}

struct sadmm_system sadmm_world_system(sadmm_world *world)
{
    struct sadmm_system system = {
        .team = &world->team,
        .body_count = world->dynamic_count,
        .rigid = world->start.rigid,
        .velocity = world->velocity,
        .contacts = &world->contacts,
        .first = !world->stepped,
        .uneven = world->uneven_masses,
        .kinematic = world->start.kinematic,
        .kinematic_count = world->start.kinematic_count,
        .rows = world->start.rows.constraint_count > 0 ? &world->start.rows : NULL,
    };
    return system;
}

sadmm_status sadmm_world_not_finite(sadmm_world *world, int32_t body)
{
    return sadmm_world_slot_not_finite(world, world->slot_of[body]);
}
