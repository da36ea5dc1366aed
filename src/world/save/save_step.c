/* The last step of a world, in a saved one: what the next one starts from, and what can be read of it. */
#include <math.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "save_objects.h"
#include "save_step.h"

/* A body of the step, as contacts and rows name it. */
static bool side_fits(const sadmm_world *world, int32_t body)
{
    return body >= -1 ? body < world->plan.bodies : sadmm_kinematic(body) < world->start.kinematic_count;
}

/* ---- contacts ---------------------------------------------------------------------------------------------------- */

static bool shape_fits(const sadmm_world *world, int32_t slot)
{
    return slot >= 0 && (world->contacts_readable ? sadmm_ids_has(&world->shape_ids, (size_t)slot)
                                                  : (size_t)slot < world->shape_ids.slots);
}

/* A triangle of a mesh: read-outs look it up. */
static bool subshape_fits(const sadmm_world *world, const struct sadmm_contact_pair *pair)
{
    if (!world->contacts_readable) return true;
    const struct sadmm_geometry *geometry = &world->geometries[world->shapes[pair->shape_b].geometry];
    if (geometry->type != SADMM_SHAPE_MESH) return true;
    return (int64_t)pair->subshape < sadmm_mesh_triangle_count(world->block_shapes[pair->shape_b].mesh);
}

static bool migration_fits(const struct sadmm_contact_migration *m)
{
    return sadmm_all_finite(m->normal, 3) && sadmm_all_finite(m->arm_a, 3) && sadmm_all_finite(m->arm_b, 3) &&
           m->radius >= 0 && isfinite(m->radius);
}

static bool contacts_fit(const sadmm_world *world)
{
    const struct sadmm_contact_set *set = &world->contacts;
    size_t points = 0;
    for (size_t k = 0; k < set->pair_count; ++k) {
        const struct sadmm_contact_pair *pair = &set->pairs[k], *before = k > 0 ? pair - 1 : NULL;
        if (pair->count < 1 || pair->count > SADMM_MAX_POINTS || (size_t)pair->first != points ||
            !shape_fits(world, pair->shape_a) || !shape_fits(world, pair->shape_b) || !subshape_fits(world, pair) ||
            !side_fits(world, pair->body_a) || !side_fits(world, pair->body_b) ||
            (pair->body_a < 0 && pair->body_b < 0) || !sadmm_all_finite(pair->normal, 3) || !(pair->friction >= 0) ||
            !(pair->restitution >= 0))
            return false;
        if (before && (before->shape_a > pair->shape_a ||
                       (before->shape_a == pair->shape_a &&
                        (before->shape_b > pair->shape_b ||
                         (before->shape_b == pair->shape_b && before->subshape >= pair->subshape)))))
            return false;
        points += (size_t)pair->count;
    }
    if (points != set->point_count) return false;
    for (size_t k = 0; k < points; ++k) {
        const struct sadmm_contact_point *point = &set->points[k];
        if (!sadmm_all_finite(point->impulse, 3) || !sadmm_all_finite(point->arm_a, 3) ||
            !sadmm_all_finite(point->arm_b, 3) || !isfinite(point->separation) || !isfinite(point->error) ||
            point->migrates > MIGRATES_ON || (point->migrates && !migration_fits(&set->migrations[k])))
            return false;
    }
    return set->dt >= 0 && isfinite(set->dt);
}

/* Of the points that have one. */
static void archive_migrations(struct sadmm_archive *archive, struct sadmm_contact_set *set)
{
    if (archive->reading && archive->status == SADMM_OK) {
        set->migrating = 0;
        for (size_t k = 0; k < set->point_count; ++k) set->migrating += set->points[k].migrates != 0;
        if (set->migrating > 0 && !sadmm_contact_set_reserve_migrations(set, set->point_count)) {
            archive->status = sadmm_fail_memory(archive->error, "the state of a world");
            return;
        }
    }
    for (size_t k = 0; k < set->point_count && archive->status == SADMM_OK; ++k)
        if (set->points[k].migrates) SADMM_ARCHIVE(archive, set->migrations[k]);
}

static void archive_contacts(struct sadmm_archive *archive, sadmm_world *world)
{
    struct sadmm_contact_set *set = &world->contacts;
    _Static_assert(sizeof *set->pairs == 80 && sizeof *set->points == 96, "no padding");
    sadmm_archive_array(archive, &set->pairs, &set->pair_count, sizeof *set->pairs, INT32_MAX);
    sadmm_archive_array(archive, &set->points, &set->point_count, sizeof *set->points, INT32_MAX);
    SADMM_ARCHIVE(archive, set->dt);
    archive_migrations(archive, set);
    if (archive->reading && archive->status == SADMM_OK)
        sadmm_archive_expect(archive, contacts_fit(world), "contacts");
}

/* Hits that can be read. */
static bool hits_fit(const sadmm_world *world)
{
    if (world->start.hit_first > world->start.hit_count) return false;
    for (size_t k = 0; k < world->start.hit_count; ++k) {
        const struct sadmm_world_hit *hit = &world->start.hits[k];
        const struct sadmm_contact_pair pair = {.shape_b = hit->shape_b, .subshape = hit->subshape};
        if (!shape_fits(world, hit->shape_a) || !shape_fits(world, hit->shape_b) || !subshape_fits(world, &pair) ||
            !sadmm_all_finite(hit->position, 3) || !sadmm_all_finite(hit->normal, 3) ||
            !sadmm_all_finite(hit->impulse, 3))
            return false;
    }
    return true;
}

static void archive_hits(struct sadmm_archive *archive, sadmm_world *world)
{
    struct sadmm_step_start *start = &world->start;
    _Static_assert(sizeof *start->hits == 168, "no padding");
    sadmm_archive_array(archive, &start->hits, &start->hit_count, sizeof *start->hits, INT32_MAX);
    SADMM_ARCHIVE(archive, start->hit_first);
    if (archive->reading && archive->status == SADMM_OK) sadmm_archive_expect(archive, hits_fit(world), "hits");
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

static bool rows_fit(const sadmm_world *world)
{
    const struct sadmm_rows *rows = &world->start.rows;
    size_t count = 0;
    for (size_t k = 0; k < rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *c = &rows->constraints[k];
        if (c->count < 1 || c->count > SADMM_MAX_ROWS || (size_t)c->first != count || !side_fits(world, c->body_a) ||
            !side_fits(world, c->body_b))
            return false;
        count += (size_t)c->count;
    }
    return count == rows->row_count;
}

static void archive_rows(struct sadmm_archive *archive, sadmm_world *world)
{
    struct sadmm_rows *rows = &world->start.rows;
    size_t constraints = rows->constraint_count, count = rows->row_count;
    sadmm_archive_count(archive, &constraints, 25, INT32_MAX);
    sadmm_archive_count(archive, &count, 19 * sizeof(double), INT32_MAX);
    if (archive->reading && archive->status == SADMM_OK) {
        if (!sadmm_rows_reserve(rows, constraints, count) || !SADMM_GROW(world->start.multiplier, 0, count)) {
            archive->status = sadmm_fail_memory(archive->error, "the state of a world");
            return;
        }
        rows->constraint_count = constraints;
        rows->row_count = count;
    }
    if (archive->status != SADMM_OK) return;
    for (size_t k = 0; k < constraints; ++k) {
        struct sadmm_row_constraint *c = &rows->constraints[k];
        SADMM_ARCHIVE(archive, c->body_a);
        SADMM_ARCHIVE(archive, c->body_b);
        SADMM_ARCHIVE(archive, c->first);
        SADMM_ARCHIVE(archive, c->count);
        sadmm_archive_flag(archive, &c->cone);
        SADMM_ARCHIVE(archive, c->friction);
    }
    double *const columns[] = {rows->gain, rows->bias, rows->compliance, rows->lo, rows->hi, rows->lambda,
                               world->start.multiplier};
    if (count > 0) {
        sadmm_archive_bytes(archive, rows->jacobian_a, 6 * count * sizeof(double));
        sadmm_archive_bytes(archive, rows->jacobian_b, 6 * count * sizeof(double));
        for (size_t k = 0; k < sizeof columns / sizeof *columns; ++k)
            sadmm_archive_bytes(archive, columns[k], count * sizeof(double));
    }
    if (archive->reading && archive->status == SADMM_OK)
        sadmm_archive_expect(archive, rows_fit(world), "rows of joints");
}

/* ---- plan, start, report ----------------------------------------------------------------------------------------- */

_Static_assert(sizeof(struct sadmm_plan) == 40 && sizeof(sadmm_step_report) == 232,
               "a plan, or a report, has other members than the list of a saved world");

static void archive_plan(struct sadmm_archive *archive, struct sadmm_plan *plan)
{
    bool *const flags[] = {&plan->rows_apart, &plan->rigid, &plan->gyroscopic, &plan->warm_start, &plan->warm,
                           &plan->penalty_updates, &plan->initialise, &plan->weight_updates, &plan->energy_limit,
                           &plan->momentum, &plan->residuals, &plan->wrenches, &plan->certificate};
    SADMM_ARCHIVE(archive, plan->bodies);
    SADMM_ARCHIVE(archive, plan->pairs);
    SADMM_ARCHIVE(archive, plan->points);
    SADMM_ARCHIVE(archive, plan->row_constraints);
    SADMM_ARCHIVE(archive, plan->contact_rows);
    SADMM_ARCHIVE(archive, plan->threads);
    for (size_t k = 0; k < sizeof flags / sizeof *flags; ++k) sadmm_archive_flag(archive, flags[k]);
}

/* A number of steps that more can be added to. */
static bool counts_on(int64_t steps) { return steps >= 0 && steps <= INT64_MAX / 2; }

static void archive_report(struct sadmm_archive *archive, sadmm_step_report *r)
{
    SADMM_ARCHIVE(archive, r->backend);
    SADMM_ARCHIVE(archive, r->precision);
    SADMM_ARCHIVE(archive, r->threads);
    SADMM_ARCHIVE(archive, r->step);
    SADMM_ARCHIVE(archive, r->time);
    SADMM_ARCHIVE(archive, r->bodies);
    SADMM_ARCHIVE(archive, r->joints);
    SADMM_ARCHIVE(archive, r->couplings);
    SADMM_ARCHIVE(archive, r->contacts);
    SADMM_ARCHIVE(archive, r->pairs);
    SADMM_ARCHIVE(archive, r->iterations);
    SADMM_ARCHIVE(archive, r->iterations_mean);
    SADMM_ARCHIVE(archive, r->error);
    SADMM_ARCHIVE(archive, r->error_kind);
    SADMM_ARCHIVE(archive, r->unsolved);
    sadmm_archive_flag(archive, &r->converged);
    SADMM_ARCHIVE(archive, r->limited);
    SADMM_ARCHIVE(archive, r->repeated);
    SADMM_ARCHIVE(archive, r->penetration_max);
    SADMM_ARCHIVE(archive, r->joint_drift);
    SADMM_ARCHIVE(archive, r->residual);
    SADMM_ARCHIVE(archive, r->certificate);
    if (archive->reading)
        sadmm_archive_expect(archive,
                             (unsigned)r->backend < SADMM_BACKEND_COUNT && (unsigned)r->precision <= SADMM_F64 &&
                                 (unsigned)r->error_kind < SADMM_STEP_ERROR_COUNT && counts_on(r->step) &&
                                 counts_on(r->repeated) && isfinite(r->time) && r->contacts >= 0,
                             "the report of a step");
}

/* Times are left out: they are no state, and equal states are to give equal bytes. */
void sadmm_archive_step(struct sadmm_archive *archive, sadmm_world *world)
{
    struct sadmm_step_start *start = &world->start;
    sadmm_archive_flag(archive, &world->stepped);
    sadmm_archive_flag(archive, &world->contacts_readable);
    archive_report(archive, &world->report);
    if (!world->stepped) return;
    sadmm_archive_settings(archive, &world->step_settings);
    archive_plan(archive, &world->plan);
    const bool readable = world->contacts_readable;
    size_t bodies = readable ? (size_t)world->plan.bodies : 0, numbers = 6 * bodies,
           kinematic = 6 * (size_t)start->kinematic_count;
    if (archive->reading)
        sadmm_archive_expect(archive, world->plan.bodies >= 0, "the plan of a step"); /* bodies may have come since */
    sadmm_archive_array(archive, &start->kinematic, &kinematic, sizeof(double), INT32_MAX);
    start->kinematic_count = (int32_t)(kinematic / 6);
    /* Without contacts that can be read nothing of this can. */
    sadmm_archive_array(archive, &start->rigid, &bodies, sizeof *start->rigid, INT32_MAX);
    sadmm_archive_array(archive, &start->velocity, &numbers, sizeof(double), INT32_MAX);
    if (archive->reading)
        sadmm_archive_expect(archive, numbers == 6 * bodies && (!readable || bodies == (size_t)world->plan.bodies),
                             "the start of a step");
    archive_contacts(archive, world);
    numbers = readable ? 3 * world->contacts.point_count : 0;
    sadmm_archive_array(archive, &start->impulse, &numbers, sizeof(double), INT32_MAX);
    if (archive->reading)
        sadmm_archive_expect(archive, !readable || numbers == 3 * world->contacts.point_count, "the start of a step");
    archive_hits(archive, world);
    if (readable) archive_rows(archive, world);
}
