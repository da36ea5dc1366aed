#include "push.h"

#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/parallel.h"
#include "core/math/array3.h"
#include "core/math/contact.h"
#include "core/math/rigid.h"
#include "core/model/islands.h"
#include "schedule.h"

/* Of a pair: its island; how much of gravity its push takes (contact_push_takes), 0: it has none; is it with what is
 * not dynamic, and has it friction then? */
struct push_pair {
    double takes;
    int32_t label;
    bool stands, rests;
};

/* Pushes add up on the way from the ground: of an island, at its label, their sum, the largest, and over how many pairs
 * such ways begin; whether gravity takes velocities back at all; whether it has constraints given by rows. */
struct push_sum {
    double takes, most;
    int32_t ways;
    bool rests, rows;
};

/* Of an island, at the first of its bodies among those that are pushed. */
struct push_island {
    double mass;
    vec3 middle, turn; /* sum of m d, about that body's place; what pushes have changed the angular momentum by */
    sym3 inertia;      /* about that place */
};

struct sadmm_push {
    const struct sadmm_kernels *kernels; /* of `context` */
    struct sadmm_context *context;
    int32_t *label;          /* all bodies: islands */
    int32_t *index;          /* all bodies: among those that are pushed, -1: none of them */
    struct push_sum *sums;   /* all bodies, at labels */
    struct push_pair *pairs; /* all pairs */
    size_t label_capacity, index_capacity, sum_capacity, pair_capacity;

    /* Those that are, ascending: the second problem. */
    struct sadmm_system system;
    struct sadmm_contact_set contacts;
    int32_t *bodies, *first; /* of the step; the first one of its island, as these are numbered */
    struct sadmm_rigid *rigid;
    double *velocity, *carried; /* x 6 */
    double *way;                /* x 6: v_1 - v_0 */
    struct push_island *islands;
    bool *free;                 /* its island is in the air */
    size_t body_capacity, first_capacity, rigid_capacity, velocity_capacity, carried_capacity, way_capacity,
        island_capacity, free_capacity;
};

struct sadmm_push *sadmm_push_create(void) { return (struct sadmm_push *)sadmm_alloc(1, sizeof(struct sadmm_push)); }

void sadmm_push_destroy(struct sadmm_push *p)
{
    if (!p) return;
    if (p->context) p->kernels->destroy(p->context);
    sadmm_contact_set_free(&p->contacts);
    void *blocks[] = {p->label, p->index, p->sums, p->pairs, p->bodies, p->first, p->rigid,
                      p->velocity, p->carried, p->way, p->islands, p->free};
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

static double push_speed(const struct sadmm_settings *s, double gap)
{
    const double e = contact_error(gap, s->dt, s->baumgarte, s->slop, s->correction_speed);
    return e < 0 ? -e : 0;
}

/* In the method `paper` impulses creep: velocities follow a push down by no more than 0.3 of gravity. */
#define PUSH_PAPER_SHARE 0.25

/* The least acceleration by which gravity takes back a velocity of one of the pair's bodies. */
static double pull_of(const struct choosing *c, const struct sadmm_contact_pair *pair)
{
    double scale = INFINITY;
    if (pair->body_a >= 0) scale = fmin(scale, c->system->rigid[pair->body_a].gravity_scale);
    if (pair->body_b >= 0) scale = fmin(scale, c->system->rigid[pair->body_b].gravity_scale);
    return scale * c->gravity * (c->settings->method == SADMM_METHOD_PAPER ? PUSH_PAPER_SHARE : 1);
}

static void find_pair(const struct choosing *c, size_t index)
{
    const struct sadmm_settings *s = c->settings;
    const struct sadmm_contact_pair *pair = &c->system->contacts->pairs[index];
    struct push_pair *found = &c->push->pairs[index];
    const struct sadmm_contact_point *points = &c->system->contacts->points[pair->first];
    double gap = points[0].gap; /* the deepest point is pushed fastest */
    for (int32_t k = 1; k < pair->count; ++k) gap = points[k].gap < gap ? points[k].gap : gap;
    const double speed = push_speed(s, gap);
    found->takes = speed > 0 ? contact_push_takes(speed, s->baumgarte, pull_of(c, pair) * s->dt) : 0;
    found->label = c->push->label[pair->body_a >= 0 ? pair->body_a : pair->body_b];
    found->stands = pair->body_a < 0 || pair->body_b < 0;
    found->rests = found->stands && pair->friction > 0;
}

static void find_share(void *argument, int thread, int threads)
{
    const struct choosing *c = (const struct choosing *)argument;
    size_t begin, end;
    sadmm_share(c->system->contacts->pair_count, thread, threads, &begin, &end);
    for (size_t p = begin; p < end; ++p) find_pair(c, p);
}

/* In the order of pairs. */
static void add_up(struct sadmm_push *p, size_t pairs)
{
    for (size_t k = 0; k < pairs; ++k) {
        const struct push_pair *pair = &p->pairs[k];
        struct push_sum *sum = &p->sums[pair->label];
        sum->ways += pair->stands;
        sum->rests = sum->rests || pair->rests;
        sum->takes += pair->takes;
        if (pair->takes > sum->most) sum->most = pair->takes;
    }
}

/* Is the island of the body pushed? */
static bool is_pushed(const struct sadmm_push *p, int32_t body)
{
    const struct push_sum *sum = &p->sums[p->label[body]];
    if (sum->rows || sum->most == 0) return false;
    return !sum->rests || sum->most > 1 || sum->takes > sum->ways;
}

static sadmm_status number_bodies(struct sadmm_push *p, int32_t all, struct sadmm_error *error)
{
    int32_t count = 0;
    for (int32_t i = 0; i < all; ++i) count += is_pushed(p, i);
    p->system.body_count = count;
    if (count == 0) return SADMM_OK;
    const size_t n = (size_t)count;
    if (!sadmm_grow_empty(&p->index, &p->index_capacity, (size_t)all, sizeof *p->index) ||
        !sadmm_grow_empty(&p->bodies, &p->body_capacity, n, sizeof *p->bodies) ||
        !sadmm_grow_empty(&p->first, &p->first_capacity, n, sizeof *p->first) ||
        !sadmm_grow_empty(&p->free, &p->free_capacity, n, sizeof *p->free) ||
        !sadmm_grow_empty(&p->rigid, &p->rigid_capacity, n, sizeof *p->rigid) ||
        !sadmm_grow_empty(&p->velocity, &p->velocity_capacity, 6 * n, sizeof *p->velocity) ||
        !sadmm_grow_empty(&p->carried, &p->carried_capacity, 6 * n, sizeof *p->carried) ||
        !sadmm_grow_empty(&p->way, &p->way_capacity, 6 * n, sizeof *p->way) ||
        !sadmm_grow_empty(&p->islands, &p->island_capacity, n, sizeof *p->islands)) {
        p->system.body_count = 0;
        return sadmm_fail_memory(error, "bodies that overlap");
    }
    count = 0;
    for (int32_t i = 0; i < all; ++i) {
        p->index[i] = -1;
        if (!is_pushed(p, i)) continue;
        p->index[i] = count;
        p->bodies[count] = i;
        p->free[count] = p->sums[p->label[i]].ways == 0;
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
            point->error = push_speed(c->settings, point->gap);
        }
    }
}

sadmm_status sadmm_push_choose(struct sadmm_push *p, struct sadmm_system *system,
                               const struct sadmm_settings *settings, int threads, struct sadmm_error *error)
{
    const size_t n = (size_t)system->body_count, pairs = system->contacts->pair_count;
    struct choosing choosing = {p, system, settings, size3(settings->gravity)};
    p->system.body_count = 0;
    if (!sadmm_grow_empty(&p->label, &p->label_capacity, n, sizeof *p->label) ||
        !sadmm_grow_empty(&p->sums, &p->sum_capacity, n, sizeof *p->sums) ||
        !sadmm_grow_empty(&p->pairs, &p->pair_capacity, pairs, sizeof *p->pairs))
        return sadmm_fail_memory(error, "bodies that overlap");
    sadmm_islands(system, p->label);
    system->islands = p->label;
    memset(p->sums, 0, n * sizeof *p->sums);
    for (size_t k = 0; k < sadmm_row_constraint_count(system); ++k) {
        const struct sadmm_row_constraint *rows = &system->rows->constraints[k];
        p->sums[p->label[rows->body_a >= 0 ? rows->body_a : rows->body_b]].rows = true;
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
    if (!sadmm_grow_empty(&to->pairs, &to->pair_capacity, pairs, sizeof *to->pairs) ||
        !sadmm_grow_empty(&to->points, &to->point_capacity, points, sizeof *to->points))
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
        if (from->carried) memcpy(p->carried + at, from->carried + 6 * i, 6 * sizeof *p->carried);
    }
}

static sadmm_status choose_kernels(struct sadmm_push *p, const struct sadmm_kernels *kernels, struct sadmm_error *error)
{
    if (p->kernels == kernels && p->context) return SADMM_OK;
    if (p->context) p->kernels->destroy(p->context);
    p->context = NULL;
    p->kernels = kernels;
    return kernels->create(0, &p->context, error);
}

sadmm_status sadmm_push_solve(struct sadmm_push *p, const struct sadmm_kernels *kernels,
                              const struct sadmm_system *system, const struct sadmm_settings *step_settings,
                              struct sadmm_error *error)
{
    sadmm_settings settings = *step_settings;
    struct sadmm_solve_report report;
    TRY(choose_kernels(p, kernels, error));
    TRY(gather_contacts(p, system->contacts, error));
    gather_bodies(p, system);
    p->system = (struct sadmm_system){
        .team = system->team,
        .body_count = p->system.body_count,
        .rigid = p->rigid,
        .velocity = p->velocity,
        .driven = system->driven,
        .driven_count = system->driven_count,
        .carried = system->carried ? p->carried : NULL,
        .contacts = &p->contacts,
    };
    settings.measure_residuals = settings.certify = settings.recover_wrenches = false;
    settings.penalty_period = 0; /* it goes on from a solution: where nothing moves, balancing residuals is no guide */
    const struct sadmm_plan plan = sadmm_plan_make(&p->system, &settings);
    TRY(sadmm_schedule_solve(kernels, p->context, &p->system, &settings, &plan, &report, error));
    for (int32_t k = 0; k < p->system.body_count; ++k)
        for (size_t j = 0; j < 6; ++j)
            p->way[6 * (size_t)k + j] =
                p->velocity[6 * (size_t)k + j] - system->velocity[6 * (size_t)p->bodies[k] + j];
    return SADMM_OK;
}

/* ---- the way ----------------------------------------------------------------------------------------------------- */

/* m (|d|^2 1 - d d^T) */
static void add_arm_inertia(double m, vec3 d, sym3 *to)
{
    to->xx += m * (d.y * d.y + d.z * d.z);
    to->yy += m * (d.x * d.x + d.z * d.z);
    to->zz += m * (d.x * d.x + d.y * d.y);
    to->xy -= m * d.x * d.y;
    to->xz -= m * d.x * d.z;
    to->yz -= m * d.y * d.z;
}

/* R diag(inertia) R^T of a body where it is. */
static sym3 inertia_of(const struct sadmm_rigid *body)
{
    return rigid_world_inertia(q_matrix(q_load(body->orientation)), v3_load(body->inertia));
}

/* Moves a body; its island, if it is in the air, gets to know. */
static void move(const struct sadmm_push *p, int32_t k, double dt, struct sadmm_rigid *next)
{
    struct sadmm_rigid *body = &next[p->bodies[k]];
    const double *way = p->way + 6 * (size_t)k;
    const vec3 v = v3_load(body->velocity), w = v3_load(body->velocity + 3), before = v3_load(body->position),
               after = rigid_move(before, v3_load(way), dt), spin = s3_mul(inertia_of(body), w);
    v3_store(after, body->position);
    q_store(rigid_turn(q_load(body->orientation), v3_load(way + 3), dt), body->orientation);
    if (!p->free[k]) return;
    struct push_island *island = &p->islands[p->first[k]];
    const sym3 inertia = inertia_of(body);
    const vec3 d = v3_sub(after, v3_load(p->rigid[p->first[k]].position));
    island->mass += body->mass;
    island->middle = v3_madd(island->middle, body->mass, d);
    island->turn = v3_add(island->turn, v3_add(v3_cross(v3_sub(after, before), v3_scale(v, body->mass)),
                                               v3_sub(s3_mul(inertia, w), spin)));
    island->inertia.xx += inertia.xx, island->inertia.yy += inertia.yy, island->inertia.zz += inertia.zz;
    island->inertia.xy += inertia.xy, island->inertia.xz += inertia.xz, island->inertia.yz += inertia.yz;
    add_arm_inertia(body->mass, d, &island->inertia);
}

/* In place of `turn` the turn about the middle that takes it back, rad/s; in place of `middle` where that is. */
static void find_turn(struct push_island *island)
{
    island->middle = v3_scale(island->middle, 1 / island->mass);
    add_arm_inertia(-island->mass, island->middle, &island->inertia);
    const sym3 s = island->inertia;
    const mat3 m = {{v3(s.xx, s.xy, s.xz), v3(s.xy, s.yy, s.yz), v3(s.xz, s.yz, s.zz)}};
    island->turn = v3_max_abs(island->turn) > 0 ? m3_solve(m, v3_neg(island->turn)) : v3(0, 0, 0);
}

void sadmm_push_move(const struct sadmm_push *p, double dt, struct sadmm_rigid *next)
{
    const int32_t n = p->system.body_count;
    memset(p->islands, 0, (size_t)n * sizeof *p->islands);
    for (int32_t k = 0; k < n; ++k) move(p, k, dt, next);
    for (int32_t k = 0; k < n; ++k)
        if (p->free[k] && p->first[k] == k) find_turn(&p->islands[k]);
    for (int32_t k = 0; k < n; ++k) {
        if (!p->free[k]) continue;
        const struct push_island *island = &p->islands[p->first[k]];
        struct sadmm_rigid *body = &next[p->bodies[k]];
        const vec3 d = v3_sub(v3_sub(v3_load(body->position), v3_load(p->rigid[p->first[k]].position)), island->middle);
        v3_store(v3_add(v3_load(body->velocity), v3_cross(island->turn, d)), body->velocity);
        v3_store(v3_add(v3_load(body->velocity + 3), island->turn), body->velocity + 3);
    }
}
