#include "articulation.h"

#include <math.h>
#include <string.h>

#include "articulation_part.h"
#include "asked_energy.h"
#include "articulation_variants.h"
#include "core/base/memory.h"
#include "core/model/joint_close.h"
#include "core/model/system_math.h"

/* One call. */
struct solving {
    struct sadmm_articulations *j;
    const struct sadmm_system *system;
    const struct sadmm_row_constraint *slots;
    size_t slot_count;
    const struct sadmm_settings *settings;
};

struct sadmm_articulations *sadmm_articulations_create(void)
{
    return (struct sadmm_articulations *)sadmm_alloc(1, sizeof(struct sadmm_articulations));
}

void sadmm_articulations_destroy(struct sadmm_articulations *j)
{
    if (!j) return;
    sadmm_articulation_order_free(&j->order);
    void *blocks[] = {j->bodies,        j->parts,       j->part,        j->entry, j->work,         j->impulse,
                      j->kept_velocity, j->kept_lambda, j->kept_states, j->nodes, j->tree_numbers, j->tree_rows};
    for (size_t k = 0; k < sizeof blocks / sizeof *blocks; ++k) sadmm_free(blocks[k]);
    sadmm_free(j);
}

void sadmm_articulations_begin(struct sadmm_articulations *j) { j->kept = false; }

/* ---- structure --------------------------------------------------------------------------------------------------- */

static bool same_graph(const struct solving *s)
{
    const struct sadmm_articulations *j = s->j;
    if (j->constraints != s->slot_count || j->body_count != s->system->body_count) return false;
    for (size_t k = 0; k < s->slot_count; ++k)
        if (j->bodies[2 * k] != s->slots[k].body_a || j->bodies[2 * k + 1] != s->slots[k].body_b) return false;
    return true;
}

static bool make_tree_room(struct sadmm_articulations *j, size_t members, size_t columns)
{
    const size_t rows = SADMM_MAX_ROWS * columns;
    return SADMM_GROW(j->nodes, 0, members) && SADMM_GROW(j->tree_rows, 0, rows) &&
           SADMM_GROW(j->tree_numbers, 0, 3 * members + columns + 3 * rows);
}

/* Where the tree's arrays are of a part that comes after so many bodies and columns of all. */
static struct articulation_tree tree_at(const struct sadmm_articulations *j, size_t members, size_t columns, size_t all,
                                        size_t all_columns)
{
    int32_t *const rows = j->tree_numbers + all + all_columns;
    return (struct articulation_tree){.node = j->nodes + members,
                                      .node_of = j->tree_numbers + members,
                                      .joint = j->tree_numbers + all + columns,
                                      .soft = rows + SADMM_MAX_ROWS * columns,
                                      .row_of = rows + SADMM_MAX_ROWS * (all_columns + columns),
                                      .acting = rows + SADMM_MAX_ROWS * (2 * all_columns + columns),
                                      .row = j->tree_rows + SADMM_MAX_ROWS * columns};
}

/* Views, and which bodies they have. */
static bool make_parts(struct sadmm_articulations *j, size_t bodies)
{
    const size_t parts = (size_t)j->order.parts;
    size_t work = 0, members = 0, columns = 0;
    for (int32_t k = 0; k < j->order.parts; ++k) {
        const struct articulation_structure s = sadmm_articulation_part(&j->order, k);
        work += articulation_work_size(&s);
        members += (size_t)s.bodies;
        columns += (size_t)s.columns;
    }
    if (!SADMM_GROW(j->parts, 0, parts) || !SADMM_GROW(j->work, 0, work) ||
        !SADMM_GROW(j->kept_states, 0, SADMM_MAX_ROWS * columns) || !SADMM_GROW(j->impulse, 0, 12 * members) ||
        !SADMM_GROW(j->kept_velocity, 0, 6 * members) || !make_tree_room(j, members, columns))
        return false;
    for (size_t i = 0; i < bodies; ++i) j->part[i] = -1;
    const size_t all = members, all_columns = columns;
    /* and parents: members each */
    int32_t *const queue = j->tree_numbers + all + (1 + 3 * SADMM_MAX_ROWS) * all_columns;
    work = members = columns = 0;
    j->loops = false;
    for (int32_t k = 0; k < j->order.parts; ++k) {
        const struct articulation_structure s = sadmm_articulation_part(&j->order, k);
        j->parts[k] = (struct articulation_part){.view = articulation_view_at(&s, j->work + work),
                                                 .loop = articulation_has_loop(&s),
                                                 .impulse = j->impulse + 6 * members,
                                                 .without = j->impulse + 6 * (all + members),
                                                 .kept_velocity = j->kept_velocity + 6 * members,
                                                 .kept_state = j->kept_states + SADMM_MAX_ROWS * columns};
        j->loops = j->loops || j->parts[k].loop;
        j->parts[k].kernels = sadmm_articulation_kernels_best();
        j->parts[k].tree = tree_at(j, members, columns, all, all_columns);
        sadmm_articulation_tree_make(&s, queue, queue + s.bodies, &j->parts[k].tree);
        for (int32_t e = 0; e < s.bodies; ++e) {
            j->part[s.body[e]] = k;
            j->entry[s.body[e]] = e;
        }
        work += articulation_work_size(&s);
        members += (size_t)s.bodies;
        columns += (size_t)s.columns;
    }
    return true;
}

static bool find_order(const struct solving *s)
{
    struct sadmm_articulations *j = s->j;
    const size_t n = s->slot_count, bodies = (size_t)s->system->body_count;
    if (same_graph(s)) return true;
    j->constraints = 0;
    if (!SADMM_GROW(j->bodies, 0, 2 * n) || !SADMM_GROW(j->part, 0, bodies) || !SADMM_GROW(j->entry, 0, bodies))
        return false;
    for (size_t k = 0; k < n; ++k) {
        j->bodies[2 * k] = s->slots[k].body_a;
        j->bodies[2 * k + 1] = s->slots[k].body_b;
    }
    if (!sadmm_articulation_order_make(&j->order, j->bodies, (int32_t)n, s->system->body_count,
                                       SADMM_ARTICULATION_AROUND))
        return false;
    if (!make_parts(j, bodies)) {
        sadmm_articulation_order_free(&j->order); /* no parts without their views */
        return false;
    }
    j->constraints = n;
    j->body_count = s->system->body_count;
    return true;
}

/* ---- what there is ----------------------------------------------------------------------------------------------- */

/* What is done with a side of a pair at a body of a part, number `entry` of it. */
typedef void on_side(struct articulation_part *, const struct sadmm_contact_point *, int32_t count, int side,
                     size_t entry);

static void each_contact(const struct solving *s, on_side *f)
{
    const struct sadmm_contact_set *contacts = s->system->contacts;
    const struct sadmm_articulations *j = s->j;
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p];
        for (int side = 0; side < 2; ++side) {
            const int32_t body = side ? pair->body_b : pair->body_a;
            if (body < 0 || j->part[body] < 0 || j->parts[j->part[body]].renewed) continue;
            f(&j->parts[j->part[body]], &contacts->points[pair->first], pair->count, side, (size_t)j->entry[body]);
        }
    }
}

static const double *arm_of(const struct sadmm_contact_point *point, int side)
{
    return side ? point->arm_b : point->arm_a;
}

static void add_impulse(struct articulation_part *part, const struct sadmm_contact_point *points, int32_t count,
                        int side, size_t entry)
{
    part->touched = true;
    part->points += count;
    for (int32_t p = 0; p < count; ++p)
        for (size_t k = 0; k < 6; ++k)
            part->impulse[6 * entry + k] +=
                articulation_point_load(arm_of(&points[p], side), points[p].impulse, side, (int)k);
}

/* C, to A where the part is solved. */
static void add_weight(struct articulation_part *part, const struct sadmm_contact_point *points, int32_t count,
                       int side, size_t entry)
{
    double *A = part->view.factor + 36 * entry, load = 0;
    if (!(part->speed > 0)) return;
    for (int32_t p = 0; p < count; ++p) load += v3_norm(v3_load(points[p].impulse));
    const double B = articulation_contact_weight(load, count, part->speed);
    for (int32_t p = 0; B > 0 && p < count; ++p)
        for (int k = 0; k < 6; ++k)
            for (int q = 0; q <= k; ++q) {
                const double more = B * articulation_point_entry(arm_of(&points[p], side), k, q);
                A[6 * k + q] += more;
                if (q < k) A[6 * q + k] += more;
            }
}

static void find_impulses(const struct solving *s)
{
    struct sadmm_articulations *j = s->j;
    for (int32_t k = 0; k < j->order.parts; ++k) {
        struct articulation_part *part = &j->parts[k];
        if (part->renewed) continue;
        part->touched = false;
        part->points = 0;
        memset(part->impulse, 0, 6 * (size_t)part->view.s.bodies * sizeof *part->impulse);
    }
    each_contact(s, add_impulse);
}

/* ---- before and after the iterations ----------------------------------------------------------------------------- */

/* What the momentum misses is the contacts' to mend in the paper's method: its velocity is not the one that goes with
 * the impulses (docs/internals/algorithm.md, "Positions"), and rows alone would have to carry the difference. */
static void leave_to_contacts(const struct articulation_view *v)
{
    memset(v->residual, 0, 6 * (size_t)v->s.bodies * sizeof *v->residual);
}

/* solved: else the iterations' end is better than what they began with. */
static void keep_part(const struct solving *s, struct articulation_part *part, bool solved)
{
    const struct articulation_view *v = &part->view;
    part->kept = solved;
    memcpy(part->kept_state, v->state, (size_t)(SADMM_MAX_ROWS * v->s.columns));
    for (int32_t e = 0; e < v->s.bodies; ++e)
        memcpy(part->kept_velocity + 6 * e, s->system->velocity + 6 * v->s.body[e], 6 * sizeof(double));
    EACH_ARTICULATION_ROW(s->slots, v, r, from) s->j->kept_lambda[from] = s->system->rows->lambda[from];
}

static void take_kept(const struct solving *s, const struct articulation_part *part)
{
    const struct articulation_view *v = &part->view;
    for (int32_t e = 0; e < v->s.bodies; ++e)
        memcpy(s->system->velocity + 6 * v->s.body[e], part->kept_velocity + 6 * e, 6 * sizeof(double));
    EACH_ARTICULATION_ROW(s->slots, v, r, from) s->system->rows->lambda[from] = s->j->kept_lambda[from];
}

/* Has its tree solved it in this step, for the velocities and impulses that it was loaded with, and with no C? */
static bool can_be_renewed(const struct articulation_part *part, const struct sadmm_settings *settings)
{
    return part->kept && part->by_tree && part->for_ncp && !part->gave &&
           !(part->touched && settings->method == SADMM_METHOD_PAPER);
}

/* Is it as it was solved before the iterations? No contact touches it. */
static bool is_solved(const struct articulation_part *part) { return part->kept && !part->touched; }

static bool has_any(const struct articulation_part *part, const uint8_t *bodies)
{
    bool any = false;
    for (int32_t e = 0; e < part->view.s.bodies; ++e) any = any || bodies[part->view.s.body[e]];
    return any;
}

/* Twice the energy of a body at v, once the part is solved: its factor is A then, or A's. */
static double energy2_of(const struct articulation_part *part, int32_t e, const double v[6])
{
    const double *A = part->view.factor + 36 * (size_t)e;
    double sum = 0;
    for (int k = 0; k < 6; ++k) {
        double along = v[k];
        for (int i = k + 1; i < 6 && !part->by_tree; ++i) along += A[6 * i + k] * v[i];
        sum += part->by_tree ? v[k] * six_product(A + 6 * k, v) : along * along / A[7 * k];
    }
    return sum;
}

/* How a row responds to its multiplier, were its bodies free; as energy2_of. */
static double response_of(const struct articulation_part *part, int32_t r)
{
    const struct articulation_view *v = &part->view;
    double sum = 0;
    for (int side = 0; side < 2; ++side) {
        const int32_t e = v->s.side[2 * (r / SADMM_MAX_ROWS) + side];
        double L[36];
        if (e < 0) continue;
        if (part->by_tree) ldl6_factor(v->factor + 36 * (size_t)e, L);
        sum += ldl6_inverse_product(part->by_tree ? L : v->factor + 36 * (size_t)e, v->rows[r].jacobian[side]);
    }
    return sum;
}

/* Twice the energy that its bodies have from forces alone. */
static double free_energy2(const struct solving *s, const struct articulation_part *part, struct asked_energy *whole)
{
    const struct articulation_view *v = &part->view;
    double sum = 0;
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        double A[36], b[6];
        sadmm_system_body(s->system, s->settings, v->s.body[e], A, b);
        asked_energy_add_body(whole, A, s->system->rigid[v->s.body[e]].position);
        ldl6_factor(A, A);
        sum += ldl6_inverse_product(A, b);
    }
    return sum;
}

/* What its rows ask for, if all of them followed. */
static double asked_energy2(const struct solving *s, const struct articulation_part *part,
                            const struct asked_energy *whole)
{
    double sum = 0;
    EACH_ARTICULATION_ROW(s->slots, &part->view, r, from)
        sum += asked_energy_of_row(whole, s->system->rows, (size_t)from, response_of(part, r));
    return sum;
}

/* As a dense contact solve's result (ncp_solve.c): rows make no more than ten times the energy that they ask for. */
static bool has_too_much_energy(const struct solving *s, const struct articulation_part *part)
{
    static const double most = 10;
    const struct articulation_view *v = &part->view;
    const double speed = s->settings->correction_speed;
    struct asked_energy whole = asked_energy_begin();
    double energy = 0, correcting = 0;
    if (!s->system->rigid) return false;
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        double velocity[6];
        for (int k = 0; k < 6; ++k) velocity[k] = v->velocity[6 * e + k] + v->dv[6 * e + k];
        energy += energy2_of(part, e, velocity);
        const double A = v->factor[36 * (size_t)e];
        correcting += speed * speed * (part->by_tree ? A : 1 / A);
    }
    if (energy <= most * correcting) return false;
    const double made = sqrt(energy) - sqrt(free_energy2(s, part, &whole));
    return made > sqrt(most * correcting) && made > sqrt(most * (correcting + asked_energy2(s, part, &whole)));
}

/* Nothing meets its rows, or only what throws its bodies about: those with bounds give. Impulses are bounded then. */
static bool solve_giving(const struct solving *s, struct articulation_part *part, bool exact)
{
    part->gives = true;
    memset(part->impulse, 0, 6 * (size_t)part->view.s.bodies * sizeof *part->impulse); /* no contact touches it */
    sadmm_articulation_part_load(part, s->system, s->settings, s->slots);
    part->gave = sadmm_articulation_part_solve(part, NULL, exact);
    part->gives = false;
    return part->gave;
}

sadmm_status sadmm_articulations_solve(struct sadmm_articulations *articulations, const struct sadmm_system *system,
                                       const struct sadmm_row_constraint *slots, size_t slot_count,
                                       const struct sadmm_settings *settings, const uint8_t *stiffened, bool after,
                                       struct sadmm_error *error)
{
    const struct solving s = {articulations, system, slots, slot_count, settings};
    if (!find_order(&s) || !SADMM_GROW(articulations->kept_lambda, 0, system->rows->row_count))
        return sadmm_fail_memory(error, "articulations");
    const bool kept = after && articulations->kept; /* by the same contacts */
    bool solves = false;
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        struct articulation_part *part = &articulations->parts[k];
        part->speed = 0;
        part->left = stiffened && !has_any(part, stiffened);
        part->renewed = stiffened && !part->left && can_be_renewed(part, settings);
        if (part->left || part->renewed) continue;
        part->kept = kept && part->kept;
        solves = solves || !is_solved(part);
    }
    if (solves) find_impulses(&s);
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        struct articulation_part *part = &articulations->parts[k];
        if (part->left) continue;
        if (part->renewed) {
            sadmm_articulation_part_renew(part, system, settings, stiffened);
            continue;
        }
        if (is_solved(part)) continue;
        sadmm_articulation_part_load(part, system, settings, slots);
        part->for_ncp = !after && part->by_tree && part->points <= settings->ncp_points;
        if (part->points > 0 && !part->for_ncp) sadmm_articulation_part_find_speed(part);
    }
    if (solves) each_contact(&s, add_weight);
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        struct articulation_part *part = &articulations->parts[k];
        if (part->left) continue;
        if (!part->renewed && is_solved(part)) {
            take_kept(&s, part);
            continue;
        }
        const bool leaves = part->touched && settings->method == SADMM_METHOD_PAPER;
        if (leaves) leave_to_contacts(&part->view);
        const bool exact = settings->ncp_points > 0;
        bool solved = sadmm_articulation_part_solve(part, part->kept ? part->kept_state : NULL, exact);
        part->gave = false;
        if (exact && !part->touched && (!solved || has_too_much_energy(&s, part)))
            solved = solve_giving(&s, part, exact);
        /* Rows that are not solved are left as they are: velocities that go with multipliers beyond their bounds have
         * energy from nowhere. */
        if (solved) sadmm_articulation_part_store(&part->view, system, slots);
        part->loaded = solved && part->for_ncp && !leaves;
        if (!after) keep_part(&s, part, solved);
    }
    articulations->kept = !after;
    return SADMM_OK;
}

sadmm_status sadmm_articulations_find_none(struct sadmm_articulations *articulations, const struct sadmm_system *system,
                                           struct sadmm_error *error)
{
    const struct solving s = {.j = articulations, .system = system};
    return find_order(&s) ? SADMM_OK : sadmm_fail_memory(error, "articulations");
}

bool sadmm_articulations_has_loops(const struct sadmm_articulations *articulations)
{
    bool loops = false;
    for (int32_t k = 0; articulations->loops && k < articulations->order.parts; ++k)
        loops = loops || (articulations->parts[k].loop && !articulations->parts[k].by_tree);
    return loops;
}

void sadmm_articulations_find_left(const struct sadmm_articulations *articulations,
                                   const struct sadmm_row_constraint *slots, double *left)
{
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        const struct articulation_view *v = &articulations->parts[k].view;
        if (!articulations->parts[k].loop || articulations->parts[k].by_tree) continue;
        EACH_ARTICULATION_ROW(slots, v, r, from) left[from] = articulation_left(v, r);
    }
}

void sadmm_articulations_mark_parts(const struct sadmm_articulations *articulations, uint8_t *bodies)
{
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        const struct articulation_part *part = &articulations->parts[k];
        if (!has_any(part, bodies)) continue;
        for (int32_t e = 0; e < part->view.s.bodies; ++e) bodies[part->view.s.body[e]] = true;
    }
}

/* ---- at the end of a step ---------------------------------------------------------------------------------------- */

static void move_by(const struct articulation_view *v, struct sadmm_rigid *bodies)
{
    for (int32_t e = 0; e < v->s.bodies; ++e) {
        struct sadmm_rigid *body = &bodies[v->s.body[e]];
        joint_close_move(v->dv + 6 * (size_t)e, body->position, body->orientation);
    }
}

static void change_speeds(const struct articulation_view *v, struct sadmm_rigid *bodies)
{
    for (int32_t e = 0; e < v->s.bodies; ++e)
        for (int k = 0; k < 6; ++k) bodies[v->s.body[e]].velocity[k] += v->dv[6 * e + k];
}

static void close_part(const struct solving *s, struct articulation_part *part, bool speeds, struct sadmm_rigid *bodies)
{
    const struct articulation_view *v = &part->view;
    memset(part->impulse, 0, 6 * (size_t)v->s.bodies * sizeof *part->impulse);
    memset(v->velocity, 0, 6 * (size_t)v->s.bodies * sizeof *v->velocity);
    for (int32_t e = 0; speeds && e < v->s.bodies; ++e)
        memcpy(v->velocity + 6 * (size_t)e, bodies[v->s.body[e]].velocity, 6 * sizeof *v->velocity);
    sadmm_articulation_part_load_at(part, s->system, s->settings, s->slots);
    leave_to_contacts(v); /* nothing but the errors moves bodies */
    if (!sadmm_articulation_part_solve(part, NULL, true)) return;
    if (speeds) change_speeds(v, bodies);
    else move_by(v, bodies);
}

sadmm_status sadmm_articulations_close(struct sadmm_articulations *articulations, const struct sadmm_system *system,
                                       const struct sadmm_row_constraint *slots, size_t slot_count,
                                       const struct sadmm_settings *settings, const uint8_t *opened, bool speeds,
                                       struct sadmm_rigid *bodies, struct sadmm_error *error)
{
    const struct solving s = {articulations, system, slots, slot_count, settings};
    if (!find_order(&s)) return sadmm_fail_memory(error, "articulations");
    for (int32_t k = 0; k < articulations->order.parts; ++k)
        if (has_any(&articulations->parts[k], opened)) close_part(&s, &articulations->parts[k], speeds, bodies);
    return SADMM_OK;
}
