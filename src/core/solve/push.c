#include "push.h"

#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "core/model/islands.h"
#include "core/model/push_law.h"
#include "schedule.h"

/* Of a pair: its island, and what it adds to it. */
struct push_pair {
    struct push_share share;
    int32_t label;
};

struct sadmm_push {
    const struct sadmm_kernels *kernels; /* of `context`, on `device` */
    struct sadmm_context *context;
    int device;
    int32_t *label;          /* all bodies: islands */
    int32_t *index;          /* all bodies: among those that are pushed, -1: none of them */
    struct push_share *sums; /* all bodies, at labels: of islands */
    struct push_pair *pairs; /* all pairs */

    /* Those that are, ascending: the second problem. */
    struct sadmm_system system;
    struct sadmm_contact_set contacts;
    int32_t *bodies, *first; /* of the step; the first one of its island, as these are numbered */
    struct sadmm_rigid *rigid;
    double *velocity, *support_motion; /* x 6 */
    double *way;                       /* x 6: v_1 - v_0 */
    struct push_island *islands;
    bool *free; /* its island is in the air */
};

struct sadmm_push *sadmm_push_create(void) { return (struct sadmm_push *)sadmm_alloc(1, sizeof(struct sadmm_push)); }

void sadmm_push_destroy(struct sadmm_push *p)
{
    if (!p) return;
    if (p->context) p->kernels->destroy(p->context);
    sadmm_contact_set_free(&p->contacts);
    void *blocks[] = {p->label, p->index, p->sums, p->pairs, p->bodies, p->first, p->rigid,
                      p->velocity, p->support_motion, p->way, p->islands, p->free};
    for (size_t k = 0; k < sizeof blocks / sizeof *blocks; ++k) sadmm_free(blocks[k]);
    sadmm_free(p);
}

int32_t sadmm_push_count(const struct sadmm_push *p) { return p->system.body_count; }

/* ---- which islands ----------------------------------------------------------------------------------------------- */

struct choosing {
    struct sadmm_push *push;
    const struct sadmm_system *system;
    const struct sadmm_settings *settings;
    double gravity; /* its size */
};

static void find_pair(const struct choosing *c, size_t index)
{
    const struct sadmm_settings *s = c->settings;
    const struct sadmm_contact_pair *pair = &c->system->contacts->pairs[index];
    struct push_pair *found = &c->push->pairs[index];
    const struct sadmm_contact_point *points = &c->system->contacts->points[pair->first];
    double separation = points[0].separation; /* the deepest point is pushed fastest */
    for (int32_t k = 1; k < pair->count; ++k)
        separation = points[k].separation < separation ? points[k].separation : separation;
    const double speed = push_speed(s, separation),
                 pull = speed > 0 ? push_pull(c->system->rigid, pair, c->gravity, s->method == SADMM_METHOD_PAPER) : 0;
    found->share = push_share_of(pair, speed, s->correction_factor, pull * s->dt);
    found->label = c->push->label[pair->body_a >= 0 ? pair->body_a : pair->body_b];
}

static void find_share(void *argument, int thread, int threads)
{
    const struct choosing *c = (const struct choosing *)argument;
    size_t begin, end;
    sadmm_share(c->system->contacts->pair_count, thread, threads, &begin, &end);
    for (size_t p = begin; p < end; ++p) find_pair(c, p);
}

static void add_up(struct sadmm_push *p, size_t pairs)
{
    for (size_t k = 0; k < pairs; ++k) {
        struct push_share *sum = &p->sums[p->pairs[k].label];
        sum->bits |= p->pairs[k].share.bits;
        sum->units += p->pairs[k].share.units;
    }
}

/* Is the island of the body pushed? */
static bool is_pushed(const struct sadmm_push *p, int32_t body)
{
    const struct push_share *sum = &p->sums[p->label[body]];
    return push_is_due(sum->bits, sum->units);
}

static sadmm_status number_bodies(struct sadmm_push *p, int32_t all, struct sadmm_error *error)
{
    int32_t count = 0;
    for (int32_t i = 0; i < all; ++i) count += is_pushed(p, i);
    p->system.body_count = count;
    if (count == 0) return SADMM_OK;
    const size_t n = (size_t)count;
    if (!SADMM_GROW(p->index, 0, (size_t)all) || !SADMM_GROW(p->bodies, 0, n) || !SADMM_GROW(p->first, 0, n) ||
        !SADMM_GROW(p->free, 0, n) || !SADMM_GROW(p->rigid, 0, n) || !SADMM_GROW(p->velocity, 0, 6 * n) ||
        !SADMM_GROW(p->support_motion, 0, 6 * n) || !SADMM_GROW(p->way, 0, 6 * n) || !SADMM_GROW(p->islands, 0, n)) {
        p->system.body_count = 0;
        return sadmm_fail_memory(error, "bodies that overlap");
    }
    count = 0;
    for (int32_t i = 0; i < all; ++i) {
        p->index[i] = -1;
        if (!is_pushed(p, i)) continue;
        p->index[i] = count;
        p->bodies[count] = i;
        p->free[count] = !(p->sums[p->label[i]].bits & PUSH_STANDS);
        p->first[count++] = p->index[p->label[i]]; /* the smallest of the island: it has its number */
    }
    return SADMM_OK;
}

static int32_t index_of(const struct sadmm_push *p, int32_t body) { return body >= 0 ? p->index[body] : body; }

static bool pair_is_pushed(const struct sadmm_push *p, const struct sadmm_contact_pair *pair)
{
    return p->index[pair->body_a >= 0 ? pair->body_a : pair->body_b] >= 0;
}

/* e of the step's problem: what overlaps is not to come nearer, and no more. */
static void hold_back(const struct choosing *c)
{
    for (size_t p = 0; p < c->system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &c->system->contacts->pairs[p];
        if (!pair_is_pushed(c->push, pair)) continue;
        for (int32_t k = pair->first; k < pair->first + pair->count; ++k) {
            struct sadmm_contact_point *point = &c->system->contacts->points[k];
            point->error = push_speed(c->settings, point->separation);
        }
    }
}

sadmm_status sadmm_push_choose(struct sadmm_push *p, struct sadmm_system *system,
                               const struct sadmm_settings *settings, int threads, struct sadmm_error *error)
{
    const size_t n = (size_t)system->body_count, pairs = system->contacts->pair_count;
    struct choosing choosing = {p, system, settings, size3(settings->gravity)};
    p->system.body_count = 0;
    if (!SADMM_GROW(p->label, 0, n) || !SADMM_GROW(p->sums, 0, n) || !SADMM_GROW(p->pairs, 0, pairs))
        return sadmm_fail_memory(error, "bodies that overlap");
    sadmm_islands(system, p->label);
    system->islands = p->label;
    memset(p->sums, 0, n * sizeof *p->sums);
    for (size_t k = 0; k < sadmm_row_constraint_count(system); ++k) {
        const struct sadmm_row_constraint *rows = &system->rows->constraints[k];
        p->sums[p->label[rows->body_a >= 0 ? rows->body_a : rows->body_b]].bits |= PUSH_ROWS;
    }
    sadmm_parallel(system->team, sadmm_pass_threads(threads, pairs), find_share, &choosing);
    add_up(p, pairs);
    TRY(number_bodies(p, system->body_count, error));
    if (p->system.body_count > 0) hold_back(&choosing);
    return SADMM_OK;
}

/* ---- the second problem ------------------------------------------------------------------------------------------ */

static sadmm_status gather_contacts(struct sadmm_push *p, const struct sadmm_contact_set *from,
                                    struct sadmm_error *error)
{
    struct sadmm_contact_set *to = &p->contacts;
    size_t pairs = 0, points = 0;
    for (size_t k = 0; k < from->pair_count; ++k) {
        if (!pair_is_pushed(p, &from->pairs[k])) continue;
        ++pairs;
        points += (size_t)from->pairs[k].count;
    }
    if (!SADMM_GROW(to->pairs, 0, pairs) || !SADMM_GROW(to->points, 0, points))
        return sadmm_fail_memory(error, "contacts that overlap");
    to->pair_count = to->point_count = 0;
    to->dt = from->dt;
    for (size_t k = 0; k < from->pair_count; ++k) {
        if (!pair_is_pushed(p, &from->pairs[k])) continue;
        struct sadmm_contact_pair *pair = &to->pairs[to->pair_count++];
        *pair = from->pairs[k];
        pair->first = (int32_t)to->point_count;
        pair->body_a = index_of(p, pair->body_a);
        pair->body_b = index_of(p, pair->body_b);
        for (int32_t j = 0; j < pair->count; ++j) {
            struct sadmm_contact_point *point = &to->points[to->point_count++];
            *point = from->points[from->pairs[k].first + j];
            point->error = 0;
            point->migrates = 0;
        }
    }
    return SADMM_OK;
}

static void gather_bodies(struct sadmm_push *p, const struct sadmm_system *from)
{
    for (int32_t k = 0; k < p->system.body_count; ++k) {
        const size_t i = (size_t)p->bodies[k], at = 6 * (size_t)k;
        p->rigid[k] = from->rigid[i];
        memcpy(p->velocity + at, from->velocity + 6 * i, 6 * sizeof *p->velocity);
        if (from->support_motion)
            memcpy(p->support_motion + at, from->support_motion + 6 * i, 6 * sizeof *p->support_motion);
    }
}

static sadmm_status choose_kernels(struct sadmm_push *p, const struct sadmm_kernels *kernels, int device,
                                   struct sadmm_error *error)
{
    if (p->kernels == kernels && p->device == device && p->context) return SADMM_OK;
    if (p->context) p->kernels->destroy(p->context);
    p->context = NULL;
    p->kernels = kernels;
    p->device = device;
    return kernels->create(device, &p->context, error);
}

enum { PUSH_ITERATIONS = 20 };

struct sadmm_settings sadmm_push_settings(const struct sadmm_settings *step)
{
    struct sadmm_settings own = *step;
    own.measure_residuals = own.certify = own.recover_wrenches = false;
    if (own.tolerance > 0 && own.iterations > PUSH_ITERATIONS) own.iterations = PUSH_ITERATIONS;
    own.tolerance = 0;      /* what is left of an overlap is the next step's */
    own.penalty_period = 0; /* it goes on from a solution: where nothing moves, balancing residuals is no guide */
    return own;
}

sadmm_status sadmm_push_solve(struct sadmm_push *p, const struct sadmm_kernels *kernels, int device,
                              const struct sadmm_system *system, int contact_rows,
                              const struct sadmm_settings *step_settings, struct sadmm_error *error)
{
    const struct sadmm_settings settings = sadmm_push_settings(step_settings);
    struct sadmm_solve_report report;
    TRY(choose_kernels(p, kernels, device, error));
    TRY(gather_contacts(p, system->contacts, error));
    gather_bodies(p, system);
    p->system = (struct sadmm_system){
        .team = system->team,
        .body_count = p->system.body_count,
        .rigid = p->rigid,
        .velocity = p->velocity,
        .kinematic = system->kinematic,
        .kinematic_count = system->kinematic_count,
        .support_motion = system->support_motion ? p->support_motion : NULL,
        .contacts = &p->contacts,
        .uneven = system->uneven,
    };
    struct sadmm_plan plan = sadmm_plan_make(&p->system, &settings);
    plan.contact_rows = contact_rows;
    TRY(sadmm_schedule_solve(kernels, p->context, &p->system, &settings, &plan, NULL, &report, error));
    for (int32_t k = 0; k < p->system.body_count; ++k)
        for (size_t j = 0; j < 6; ++j)
            p->way[6 * (size_t)k + j] =
                p->velocity[6 * (size_t)k + j] - system->velocity[6 * (size_t)p->bodies[k] + j];
    return SADMM_OK;
}

/* ---- the way ----------------------------------------------------------------------------------------------------- */

/* The place about which an island is turned. */
static vec3 place_of(const struct sadmm_push *p, int32_t k) { return v3_load(p->rigid[p->first[k]].position); }

void sadmm_push_move(const struct sadmm_push *p, double dt, struct sadmm_rigid *next)
{
    const int32_t n = p->system.body_count;
    memset(p->islands, 0, (size_t)n * sizeof *p->islands);
    for (int32_t k = 0; k < n; ++k)
        push_move_body(&next[p->bodies[k]], p->way + 6 * (size_t)k, dt, place_of(p, k),
                       p->free[k] ? &p->islands[p->first[k]] : NULL);
    for (int32_t k = 0; k < n; ++k)
        if (p->free[k] && p->first[k] == k) push_find_turn(&p->islands[k]);
    for (int32_t k = 0; k < n; ++k)
        if (p->free[k]) push_turn_body(&p->islands[p->first[k]], place_of(p, k), &next[p->bodies[k]]);
}
