/* What a world gives out of its last step: contacts and the frozen problem. */
#include <string.h>

#include "contacts.h"
#include "core/base/check.h"
#include "core/base/memory.h"
#include "core/model/system_math.h"
#include "world/resident/resident.h"
#include "world/state/contact_place.h"
#include "world/state/ids.h"

int32_t sadmm_world_readable_contacts(const sadmm_world *world)
{
    if (!world->contacts_readable) return 0;
    return (world->resident.contacts_behind ? world->report.contacts : (int32_t)world->contacts.point_count) +
           (int32_t)(world->start.hit_count - world->start.hit_first);
}

int32_t sadmm_world_contact_count(sadmm_world *world)
{
    if (!world) return 0;
    sadmm_world_synchronise_quietly(world);
    return sadmm_world_readable_contacts(world);
}

/* Pairs are in point order: the pair of a point by bisection. */
static size_t pair_of(const struct sadmm_contact_set *contacts, int32_t point)
{
    size_t low = 0, high = contacts->pair_count;
    while (high - low > 1) {
        size_t middle = low + (high - low) / 2;
        if (contacts->pairs[middle].first <= point)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void read_common(const sadmm_world *world, int32_t shape_a, int32_t shape_b, const double normal[3],
                        const double impulse[3], double dt, sadmm_contact *out)
{
    out->shape_a = sadmm_world_shape_id(world, (size_t)shape_a);
    out->shape_b = sadmm_world_shape_id(world, (size_t)shape_b);
    out->body_a = sadmm_world_body_of(world, shape_a);
    out->body_b = sadmm_world_body_of(world, shape_b);
    for (int k = 0; k < 3; ++k) {
        out->normal[k] = normal[k];
        out->impulse[k] = impulse[k];
        out->force[k] = impulse[k] / dt;
    }
}

static void read_hit(const sadmm_world *world, const struct sadmm_world_hit *hit, double dt, sadmm_contact *out)
{
    read_common(world, hit->shape_a, hit->shape_b, hit->normal, hit->impulse, dt, out);
    memcpy(out->position, hit->position, sizeof out->position);
    out->separation = 0;
    out->friction = hit->friction;
    out->feature = hit->feature;
    out->triangle = sadmm_world_contact_triangle(world, hit->shape_b, hit->subshape);
}

static void read_contact(const sadmm_world *world, const struct sadmm_contact_pair *pair, int32_t index,
                         double dt, sadmm_contact *out)
{
    const struct sadmm_contact_point *point = &world->contacts.points[index];
    read_common(world, pair->shape_a, pair->shape_b, pair->normal, point->impulse, dt, out);
    sadmm_world_contact_position(world, pair, point, out->position);
    out->separation = point->separation;
    out->friction = pair->friction;
    out->feature = point->feature;
    out->triangle = sadmm_world_contact_triangle(world, pair->shape_b, pair->subshape);
}

static sadmm_status check_range(sadmm_world *world, int32_t first, int32_t count)
{
    const int32_t total = sadmm_world_readable_contacts(world);
    if (first < 0 || count < 0 || first > total - count)
        return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT,
                          "first = %d, count = %d: must be contacts of the last step, which has %d", first, count,
                          total);
    return SADMM_OK;
}

void sadmm_world_copy_contacts(const sadmm_world *world, int32_t first, int32_t count, sadmm_contact *contacts)
{
    const double dt = sadmm_settings_of_substep(&world->step_settings).dt;
    const int32_t points = (int32_t)world->contacts.point_count;
    size_t p = pair_of(&world->contacts, first);
    for (int32_t k = first; k < first + count; ++k) {
        if (k >= points) {
            read_hit(world, &world->start.hits[world->start.hit_first + (size_t)(k - points)], dt,
                     &contacts[k - first]);
            continue;
        }
        while (k >= world->contacts.pairs[p].first + world->contacts.pairs[p].count) ++p;
        read_contact(world, &world->contacts.pairs[p], k, dt, &contacts[k - first]);
    }
}

sadmm_status sadmm_world_contacts(sadmm_world *world, int32_t first, int32_t count, sadmm_contact *contacts)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_world_synchronise(world));
    TRY(check_range(world, first, count));
    if (count == 0) return SADMM_OK;
    TRY(sadmm_check_given(contacts, "contacts", &world->error));
    TRY(sadmm_world_download_contacts(world));
    sadmm_world_copy_contacts(world, first, count, contacts);
    return SADMM_OK;
}

sadmm_status sadmm_world_contact_errors(sadmm_world *world, int32_t first, int32_t count, double *errors)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_world_synchronise(world));
    TRY(check_range(world, first, count));
    if (count == 0) return SADMM_OK;
    TRY(sadmm_check_given(errors, "errors", &world->error));
    if (world->certified_step != world->report.step)
        return sadmm_fail(&world->error, SADMM_ERROR_UNAVAILABLE,
                          "errors of contacts: the last step had none measured; settings.certify asks for them");
    for (int32_t k = first; k < first + count; ++k) /* hits are solved by themselves, to rounding */
        errors[k - first] =
            k < (int32_t)world->contacts.point_count ? world->certificate_workspace.contact_errors[k] : 0;
    return SADMM_OK;
}

/* The rows of joints, with the multipliers that the step started from. */
static void freeze_rows(const struct sadmm_step_start *start, sadmm_problem_block *blocks, double *lambda)
{
    for (size_t k = 0; k < start->rows.constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &start->rows.constraints[k];
        sadmm_rows_block(&start->rows, k, &blocks[k]);
        for (int32_t r = 0; r < constraint->count; ++r)
            lambda[6 * k + (size_t)r] = start->multiplier[constraint->first + r];
    }
}

/* What a frozen problem is made of. */
struct frozen {
    double *A, *b, *v, *lambda;
    sadmm_problem_contact *contacts;
    sadmm_problem_block *blocks;
};

static sadmm_status freeze(const sadmm_world *world, sadmm_problem *problem, const struct frozen *f)
{
    size_t n = (size_t)world->plan.bodies;
    const sadmm_settings settings = sadmm_settings_of_substep(&world->step_settings);
    struct sadmm_system system = {.body_count = world->plan.bodies,
                                  .rigid = world->start.rigid,
                                  .kinematic = world->start.kinematic,
                                  .kinematic_count = world->start.kinematic_count};
    for (size_t i = 0; i < n; ++i) {
        sadmm_system_body(&system, &settings, (int32_t)i, f->A + 36 * i, f->b + 6 * i);
        memcpy(f->v + 6 * i, world->start.velocity + 6 * i, 6 * sizeof *f->v);
    }
    for (size_t p = 0; p < world->contacts.pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &world->contacts.pairs[p];
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
            const struct sadmm_contact_point *point = &world->contacts.points[k];
            sadmm_problem_contact *contact = &f->contacts[k];
            contact->body_a = pair->body_a >= 0 ? pair->body_a : -1;
            contact->body_b = pair->body_b >= 0 ? pair->body_b : -1;
            v3_store(sadmm_kinematic_part(&system, pair, point), contact->velocity);
            memcpy(contact->normal, pair->normal, sizeof contact->normal);
            memcpy(contact->arm_a, point->arm_a, sizeof contact->arm_a);
            memcpy(contact->arm_b, point->arm_b, sizeof contact->arm_b);
            contact->error = sadmm_contact_e(&system, &settings, pair, &world->contacts.points[pair->first],
                                             k - pair->first);
            contact->friction = pair->friction;
        }
    }
    freeze_rows(&world->start, f->blocks, f->lambda);
    sadmm_status status = sadmm_problem_set_bodies(problem, world->plan.bodies, f->A, f->b, f->v);
    if (status != SADMM_OK) return status;
    status = sadmm_problem_set_contacts(problem, (int32_t)world->contacts.point_count, f->contacts,
                                        world->start.impulse);
    if (status != SADMM_OK) return status;
    return sadmm_problem_set_blocks(problem, (int32_t)world->start.rows.constraint_count, f->blocks, f->lambda);
}

sadmm_status sadmm_world_freeze(sadmm_world *world, sadmm_problem *problem)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    TRY(sadmm_check_given(problem, "problem", error));
    TRY(sadmm_world_download_contacts(world));
    if (!world->stepped || !world->contacts_readable)
        return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE,
                          "there is no step to freeze: none was made yet, or something was removed since");
    const size_t n = (size_t)world->plan.bodies, points = world->contacts.point_count,
                 blocks = world->start.rows.constraint_count;
    struct frozen f;
    f.A = (double *)sadmm_alloc(48 * n + 6 * blocks, sizeof *f.A);
    f.contacts = (sadmm_problem_contact *)sadmm_alloc(points, sizeof *f.contacts);
    f.blocks = (sadmm_problem_block *)sadmm_alloc(blocks, sizeof *f.blocks);
    const bool allocated = f.A && f.contacts && f.blocks;
    sadmm_status status = SADMM_OK;
    if (allocated) {
        f.b = f.A + 36 * n;
        f.v = f.b + 6 * n;
        f.lambda = f.v + 6 * n;
        status = freeze(world, problem, &f);
        if (status != SADMM_OK) sadmm_fail(error, status, "%s", sadmm_problem_message(problem));
    } else {
        status = sadmm_fail_memory(error, "the frozen problem");
    }
    sadmm_free(f.A);
    sadmm_free(f.contacts);
    sadmm_free(f.blocks);
    return status;
}
