/* The islands of the dense contact solve, and what is kept of them through the iterations. */
#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/model/islands.h"
#include "core/model/system_math.h"
#include "ncp_island.h"

/* What an island takes that some iterations have not solved: in piles of boxes that fall, so many steps of Newton's or
 * from an interior point in the mean. */
enum { EXPECTED_STEPS = 100 };

static int32_t island_of(const struct sadmm_ncp *d, int32_t body_a, int32_t body_b)
{
    return d->label[body_a >= 0 ? body_a : body_b];
}

/* Lists by island, ascending: its bodies from the first one, which is its label, its pairs. Last ones are kept
 * meanwhile in `number` and `points`. */
static void list_islands(struct sadmm_ncp *d, const struct sadmm_system *system)
{
    const struct sadmm_contact_set *contacts = system->contacts;
    for (int32_t i = 0; i < system->body_count; ++i) {
        const int32_t label = d->label[i];
        d->next_body[i] = d->first_pair[i] = -1;
        if (label != i) d->next_body[d->number[label]] = i;
        d->number[label] = i;
    }
    for (size_t p = 0; p < contacts->pair_count; ++p) {
        const int32_t label = island_of(d, contacts->pairs[p].body_a, contacts->pairs[p].body_b);
        d->next_pair[p] = -1;
        if (d->first_pair[label] < 0) d->first_pair[label] = (int32_t)p;
        else d->next_pair[d->points[label]] = (int32_t)p;
        d->points[label] = (int32_t)p;
    }
}

/* What is known of them: how many points they have, and whether they are whole parts with rows and nothing else has
 * rows. Constraints may be left out of parts (articulation.h), and parts be connected by constraints that have no rows
 * at the time: a slack rope. Such islands are left to the iteration. Rows without a part are counted in `number`. */
static void describe_islands(struct sadmm_ncp *d, const struct sadmm_articulations *articulations,
                             const struct sadmm_system *system, const struct sadmm_row_constraint *slots)
{
    const struct sadmm_contact_set *contacts = system->contacts;
    const size_t n = (size_t)system->body_count;
    memset(d->points, 0, n * sizeof *d->points);
    memset(d->number, 0, n * sizeof *d->number);
    memset(d->kind, 0, n);
    for (size_t p = 0; p < contacts->pair_count; ++p)
        d->points[island_of(d, contacts->pairs[p].body_a, contacts->pairs[p].body_b)] += contacts->pairs[p].count;
    for (size_t k = 0; k < system->rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *constraint = &system->rows->constraints[k];
        if (constraint->body_a >= 0 || constraint->body_b >= 0)
            d->number[island_of(d, constraint->body_a, constraint->body_b)] += constraint->count;
    }
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        const struct articulation_structure *s = &articulations->parts[k].view.s;
        const int32_t label = d->label[s->body[0]];
        if (d->number[label] > 0) d->kind[label] |= ISLAND_ARTICULATED;
        for (int32_t e = 1; e < s->bodies; ++e)
            if (d->label[s->body[e]] != label)
                d->kind[label] |= ISLAND_LEFT, d->kind[d->label[s->body[e]]] |= ISLAND_LEFT;
        for (int32_t p = 0; p < s->columns; ++p) d->number[label] -= slots[s->constraint[p]].count;
    }
    for (size_t i = 0; i < n; ++i)
        if (d->number[i] != 0) d->kind[i] |= ISLAND_LEFT;
}

bool sadmm_ncp_takes(const struct sadmm_ncp *d, int32_t label, const struct sadmm_settings *settings)
{
    return !(d->kind[label] & (ISLAND_LEFT | ISLAND_SOLVED | ISLAND_LATER)) && d->points[label] > 0 &&
           d->points[label] <= settings->ncp_points;
}

/* Room for any of them. */
static bool make_room(struct sadmm_ncp *d, const struct sadmm_articulations *articulations,
                      const struct sadmm_system *system, const struct sadmm_settings *settings)
{
    const size_t n = (size_t)system->body_count;
    size_t points = 0, states = 0, depth = 1;
    for (size_t i = 0; i < n; ++i)
        if (sadmm_ncp_takes(d, (int32_t)i, settings) && (size_t)d->points[i] > points) points = (size_t)d->points[i];
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        states += (size_t)(SADMM_MAX_ROWS * articulations->parts[k].view.s.columns);
        if ((size_t)articulations->parts[k].tree.depth > depth) depth = (size_t)articulations->parts[k].tree.depth;
    }
    const size_t size = 3 * points + MOST_ACTIVE;
    return SADMM_GROW(d->bodies, 0, n) && SADMM_GROW(d->contacts, 0, points) &&
           SADMM_GROW(d->laws, 0, points + MOST_ACTIVE) &&
           SADMM_GROW(d->parts, 0, (size_t)articulations->order.parts) &&
           SADMM_GROW(d->numbers, 0, 4 * size + size * size + ncp_work_size(size) + 12 * n) &&
           SADMM_GROW(d->first_node, 0, (size_t)articulations->order.parts + 1) &&
           SADMM_GROW(d->passed, 0, 2 * depth * (points + MOST_ACTIVE)) && SADMM_GROW(d->passed_at, 0, 2 * n) &&
           SADMM_GROW(d->passed_counts, 0, size) && SADMM_GROW(d->rows, 0, 2 * system->rows->row_count) &&
           SADMM_GROW(d->states, 0, 2 * states + 1);
}

bool sadmm_ncp_make_lists(struct sadmm_ncp *d, const struct sadmm_ncp_input *input, const struct sadmm_system *system)
{
    const size_t n = (size_t)system->body_count, pairs = system->contacts->pair_count;
    if (!SADMM_GROW(d->label, 0, n) || !SADMM_GROW(d->number, 0, n) || !SADMM_GROW(d->next_body, 0, n) ||
        !SADMM_GROW(d->points, 0, n) || !SADMM_GROW(d->first_pair, 0, n) || !SADMM_GROW(d->kind, 0, n) ||
        !SADMM_GROW(d->error, 0, n) || !SADMM_GROW(d->next_pair, 0, pairs))
        return false;
    for (size_t i = 0; i < n; ++i) d->error[i] = -1;
    sadmm_islands(system, d->label);
    list_islands(d, system);
    describe_islands(d, input->articulations, system, input->slots);
    return make_room(d, input->articulations, system, input->settings);
}

void sadmm_ncp_add_missed(double *error, double missed)
{
    if (*error < 0) return;
    *error = !(missed < HUGE_VAL) ? -1 : missed > *error ? missed : *error;
}

static void find_solved_without_contacts(struct sadmm_ncp *d, const struct sadmm_ncp_input *input)
{
    const struct sadmm_articulations *articulations = input->articulations;
    const struct sadmm_system *system = input->system;
    for (int32_t k = 0; k < articulations->order.parts; ++k) {
        const int32_t label = d->label[articulations->parts[k].view.s.body[0]];
        if (!articulations->parts[k].kept && d->points[label] == 0) d->kind[label] |= ISLAND_LEFT;
    }
    for (int32_t i = 0; i < system->body_count; ++i) {
        const int32_t label = d->label[i];
        if (d->points[label] > 0 || (d->kind[label] & ISLAND_LEFT)) continue;
        if (!(d->kind[label] & ISLAND_SOLVED)) d->error[label] = 0;
        d->kind[label] |= ISLAND_SOLVED;
        if (articulations->part[i] >= 0)
            sadmm_ncp_add_missed(&d->error[label], articulations->parts[articulations->part[i]].missed);
        if (articulations->part[i] >= 0 || d->kind[label] & ISLAND_ARTICULATED) continue;
        double A[36], b[6];
        sadmm_system_body(system, input->settings, i, A, b);
        ldl6_factor(A, A);
        ldl6_solve(A, b, system->velocity + 6 * (size_t)i);
    }
}

void sadmm_ncp_choose_islands(struct sadmm_ncp *d, const struct sadmm_ncp_input *input)
{
    bool all = input->system->rows->constraint_count > 0;
    int64_t points = 0;
    find_solved_without_contacts(d, input);
    for (int32_t i = 0; i < input->system->body_count; ++i) {
        all = all && (d->kind[d->label[i]] & ISLAND_SOLVED || sadmm_ncp_takes(d, d->label[i], input->settings));
        if (d->label[i] == i && !(d->kind[i] & (ISLAND_ARTICULATED | ISLAND_SOLVED))) points += d->points[i];
    }
    all = all && points <= input->settings->ncp_points;
    for (int32_t i = 0; !all && i < input->system->body_count; ++i)
        if (!(d->kind[i] & (ISLAND_ARTICULATED | ISLAND_SOLVED))) d->kind[i] |= ISLAND_LATER;
}

void sadmm_ncp_leave_to_iterations(struct sadmm_ncp *d, const struct sadmm_system *system)
{
    for (int32_t i = 0; i < system->body_count; ++i) {
        if (d->kind[i] & ISLAND_ARTICULATED) continue;
        d->kind[i] = d->kind[i] & ISLAND_LEFT || d->points[i] == 0 ? ISLAND_LEFT : ISLAND_LATER;
        d->error[i] = -1;
    }
}

void sadmm_ncp_choose_later(struct sadmm_ncp *d, const struct sadmm_ncp_input *input)
{
    const double tolerance = input->settings->tolerance;
    for (int32_t i = 0; i < input->system->body_count; ++i) {
        if (d->kind[i] & (ISLAND_ARTICULATED | ISLAND_LEFT) || d->label[i] != i) continue;
        const bool due = input->errors && tolerance > 0 && sadmm_solve_errors_above(input->errors, i, tolerance);
        d->kind[i] = due ? 0 : ISLAND_LEFT;
    }
}

bool sadmm_ncp_has(const struct sadmm_ncp *d, int32_t label, const struct sadmm_settings *settings, double *work)
{
    *work = EXPECTED_STEPS * ncp_factor_work(3.0 * d->points[label]);
    return d->known && (d->kind[label] & ISLAND_SOLVED ||
                        (!(d->kind[label] & ISLAND_LEFT) && d->points[label] <= settings->ncp_points));
}

double sadmm_ncp_error(const struct sadmm_ncp *d, int32_t label) { return d->error[label]; }

bool sadmm_ncp_keep(struct sadmm_ncp *d, const struct sadmm_system *system)
{
    const size_t numbers = 6 * (size_t)system->body_count, rows = system->rows->row_count,
                 points = system->contacts->point_count;
    if (!SADMM_GROW(d->kept, 0, numbers + rows + 3 * points)) return false;
    memcpy(d->kept, system->velocity, numbers * sizeof *d->kept);
    if (rows > 0) memcpy(d->kept + numbers, system->rows->lambda, rows * sizeof *d->kept);
    for (size_t k = 0; k < points; ++k)
        memcpy(d->kept + numbers + rows + 3 * k, system->contacts->points[k].impulse, 3 * sizeof *d->kept);
    return true;
}

bool sadmm_ncp_is_solved(const struct sadmm_ncp *d, int32_t body_a, int32_t body_b)
{
    return (body_a >= 0 || body_b >= 0) && d->kind[island_of(d, body_a, body_b)] & ISLAND_SOLVED;
}

void sadmm_ncp_take_kept(const struct sadmm_ncp *d, const struct sadmm_system *system)
{
    const size_t numbers = 6 * (size_t)system->body_count, rows = system->rows->row_count;
    for (int32_t i = 0; i < system->body_count; ++i)
        if (sadmm_ncp_is_solved(d, i, i))
            memcpy(system->velocity + 6 * (size_t)i, d->kept + 6 * (size_t)i, 6 * sizeof *d->kept);
    for (size_t k = 0; k < system->rows->constraint_count; ++k) {
        const struct sadmm_row_constraint *c = &system->rows->constraints[k];
        if (sadmm_ncp_is_solved(d, c->body_a, c->body_b))
            memcpy(system->rows->lambda + c->first, d->kept + numbers + (size_t)c->first,
                   (size_t)c->count * sizeof *d->kept);
    }
    for (size_t p = 0; p < system->contacts->pair_count; ++p) {
        const struct sadmm_contact_pair *pair = &system->contacts->pairs[p];
        for (int32_t k = pair->first;
             sadmm_ncp_is_solved(d, pair->body_a, pair->body_b) && k < pair->first + pair->count; ++k)
            memcpy(system->contacts->points[k].impulse, d->kept + numbers + rows + 3 * (size_t)k,
                   3 * sizeof *d->kept);
    }
}

const double *sadmm_ncp_factor(const struct island *s, int32_t number)
{
    struct ncp_body *body = &s->d->bodies[number];
    if (body->factored) return body->factor;
    double A[36];
    sadmm_system_body(s->system, s->settings, body->body, A, body->b);
    ldl6_factor(A, body->factor);
    body->factored = true;
    return body->factor;
}
