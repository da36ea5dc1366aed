/* The solution of an island: impulses of contacts, multipliers of rows and velocities (core/solve/ncp_solve.c). */
#ifndef SADMM_CUDA_STEP_NCP_SEARCH_H
#define SADMM_CUDA_STEP_NCP_SEARCH_H

#include "ncp_interior.h"
#include "ncp_load.h"
#include "ncp_response.h"

/* As in core/solve/ncp_solve.c: contacts that cannot be met give by this share of their response; a solution of so many
 * times the energy that is expected is held against that of contacts that give; the regularisation of contacts, m/s, of
 * the one with the largest load. */
#define NCP_GIVES 1e-2
#define NCP_MOST_ENERGY 10
#define NCP_REGULARISATION 3e-12

/* How often rows that are not met without one get a number, in one solve. */
enum { NCP_ROUNDS = 8 };

/* ---- the dense problem ------------------------------------------------------------------------------------------- */

static __device__ __noinline__ void find_contact_velocity(const ncp_island &s, int32_t i, double u[3])
{
    const ncp_contact *c = &s.contact[i];
    for (int k = 0; k < 3; ++k) {
        double row[6];
        u[k] = c->given[k];
        for (int side = 0; side < 2; ++side) {
            if (c->node[side] < 0) continue;
            contact_row(*c, k, side, row);
            u[k] += six_product(row, s.node[c->node[side]].velocity);
        }
    }
}

/* Has a row to get a number? Where it is not met without one, or is not at a bound. */
static __device__ __forceinline__ bool asks_for_number(const ncp_row &row)
{
    if (row.role != NCP_BOUNDED || row.number >= 0) return false;
    const double to = articulation_clamp(row.lambda - row.u / row.response, row.lo, row.hi);
    const bool at_bound = row.lambda == row.lo || row.lambda == row.hi;
    return !at_bound || !(fabs(row.lambda - to) * row.response <= NCP_ENOUGH / 10);
}

/* Rows that ask for numbers get them, in their order. Did any? */
static __device__ __noinline__ bool number_rows(ncp_island *s, ncp_shared *shared)
{
    const int32_t before = s->laws;
    if (s->bounded == 0) return false;
    if (ncp_thread() < WARP) {
        int32_t laws = before;
        for (int32_t first = 0; first < s->bounded; first += WARP) {
            const int32_t i = first + ncp_thread(), r = i < s->bounded ? s->bounded_row[i] : -1;
            const bool asks = r >= 0 && asks_for_number(s->row[r]);
            const unsigned lanes = __ballot_sync((unsigned)ALL_LANES, asks);
            if (asks) {
                ncp_row *row = &s->row[r];
                const int32_t law = laws + __popc(lanes & ((1u << ncp_thread()) - 1));
                row->number = law + 2 * s->contacts;
                s->law[law] = {row->number, 1, r, row->response, 0, row->lo, row->hi, row->gain, row->compliance};
            }
            laws += __popc(lanes);
        }
        if (ncp_thread() == 0) shared->count = laws;
    }
    ncp_barrier();
    const int32_t laws = shared->count;
    put(s->laws, laws);
    put(s->numbers, 2 * s->contacts + laws);
    ncp_barrier();
    return laws > before;
}

/* Memory of the dense problem. Every thread has read what it had before. */
static __device__ bool take_numbers(ncp_island *s, ncp_memory *memory)
{
    const size_t n = (size_t)s->numbers;
    const int32_t stride = s->numbers | 1;
    put(s->lambda, take<double>(memory, n));
    put(s->u, take<double>(memory, n));
    put(s->step, take<double>(memory, n));
    put(s->moved, take<double>(memory, n));
    put(s->best_lambda, take<double>(memory, n));
    put(s->best_u, take<double>(memory, n));
    put(s->D, take<double>(memory, 9 * (size_t)s->laws));
    put(s->list, take<int32_t>(memory, n));
    put(s->pivot, take<int32_t>(memory, n));
    put(s->stride, stride);
    put(s->G, take<double>(memory, n * (size_t)stride));
    ncp_barrier();
    return !memory->full;
}

/* lambda as it is; u by the velocities. */
static __device__ __noinline__ void load_numbers(const ncp_island &s)
{
    each(s.contacts, [&](int32_t i) {
        for (int k = 0; k < 3; ++k) s.lambda[3 * i + k] = s.impulse[3 * i + k];
        find_contact_velocity(s, i, s.u + 3 * i);
    });
    each(s.laws - s.contacts, [&](int32_t i) {
        const ncp_row *row = &s.row[s.law[s.contacts + i].of];
        s.lambda[row->number] = row->lambda;
        s.u[row->number] = row->u;
    });
    ncp_barrier();
}

/* Impulses and multipliers are what has been found. */
static __device__ void store_numbers(const ncp_island &s)
{
    each(s.numbers, [&](int32_t n) {
        if (n < 3 * s.contacts) s.impulse[n] = s.lambda[n];
        else s.row[s.law[n - 2 * s.contacts].of].lambda = s.lambda[n];
    });
    ncp_barrier();
}

/* Contacts give by a share of their response. */
static __device__ void regularise(const ncp_island &s, double share)
{
    each(3 * s.contacts, [&](int32_t n) {
        const double more = share * s.law[n / 3].response;
        s.G[n * s.stride + n] += more;
        s.u[n] += more * s.lambda[n];
    });
    ncp_barrier();
}

/* That of the contact with the largest load is NCP_REGULARISATION, m/s, by any of them. */
static __device__ double regularisation_of(const ncp_island &s, ncp_shared *shared)
{
    double own = 0;
    each(3 * s.contacts, [&](int32_t n) { own = fmax(own, s.law[n / 3].response * fabs(s.impulse[n])); });
    const double most = most_of(own, shared);
    return NCP_REGULARISATION < most ? NCP_REGULARISATION / most : 0;
}

/* The natural map of all laws, of contacts that give by `share`. */
static __device__ __noinline__ double map_of_all(const ncp_island &s, double share, ncp_shared *shared)
{
    double own = 0;
    each(s.contacts, [&](int32_t i) {
        double u[3];
        find_contact_velocity(s, i, u);
        for (int k = 0; k < 3; ++k) u[k] += share * s.law[i].response * s.impulse[3 * i + k];
        const double map = natural_map_of(s.law[i], s.impulse + 3 * i, u);
        if (!(map <= own)) own = map;
    });
    each(s.bounded, [&](int32_t i) {
        const int32_t r = s.bounded_row[i];
        const ncp_row *row = &s.row[r];
        const ncp_law law = {0, 1, r, row->response, 0, row->lo, row->hi, row->gain, row->compliance};
        const double map = natural_map_of(law, &row->lambda, &row->u);
        if (!(map <= own)) own = map;
    });
    return most_of(own, shared);
}

/* ---- the search -------------------------------------------------------------------------------------------------- */

/* From where impulses and multipliers are. gives: contacts do. Returns the natural map of what is found. */
static __device__ __noinline__ double search(const cuda_view &v, ncp_island *s, const ncp_memory &memory, bool gives,
                                             double *budget, ncp_shared *shared)
{
    double map = INFINITY, share = NCP_GIVES;
    solve_trees(v, *s);
#pragma unroll 1
    for (int round = 0; round < NCP_ROUNDS; ++round) {
        const bool more = number_rows(s, shared);
        if (!gives) share = round > 0 ? fmin(share, regularisation_of(*s, shared)) : regularisation_of(*s, shared);
        map = map_of_all(*s, gives ? share : 0, shared);
        if (!(map > NCP_ENOUGH / 10) || s->numbers > NCP_NUMBERS || (round > 0 && !more && !(map > NCP_ENOUGH)))
            return map;
        if (NCP_LEAST_STEPS * elimination_of(s->numbers) > *budget) return INFINITY;
        ncp_memory left = memory;
        if (!take_numbers(s, &left)) return INFINITY;
        const ncp_memory before = left;
        if (!lay_ways(v, s, &left, shared)) return INFINITY;
        find_responses(v, *s);
        left = before; /* ways are not needed any more */
        put(s->M, take<double>(&left, (size_t)s->numbers * (size_t)stride_of(s->numbers)));
        if (left.full) return INFINITY;
        load_numbers(*s);
        regularise(*s, share);
        const int steps = NCP_LEAVES_HARD ? (int)NCP_LEAST_STEPS : (int)NCP_FROM_START;
        bool ended;
        const double found = take_steps(*s, steps, budget, shared, &ended);
        if (NCP_LEAVES_HARD && !(ended && found <= NCP_ENOUGH)) return INFINITY; /* others would go on */
        if (!(found <= NCP_ENOUGH)) {
            (void)go_inside(*s, left, budget, shared);
            (void)take_steps(*s, NCP_FROM_INSIDE, budget, shared, &ended);
        }
        store_numbers(*s);
        solve_trees(v, *s);
    }
    return map_of_all(*s, gives ? share : 0, shared);
}

/* From nothing. */
static __device__ __noinline__ void forget(ncp_island *s)
{
    each(3 * s->contacts, [&](int32_t n) { s->impulse[n] = 0; });
    each(s->bounded, [&](int32_t i) {
        ncp_row *row = &s->row[s->bounded_row[i]];
        row->lambda = articulation_clamp(0, row->lo, row->hi);
    });
    ncp_barrier();
}

/* Twice the energy of the island's motion; what forces alone, and all at the speed of corrections, would give it. */
static __device__ __noinline__ void find_energies(const cuda_view &v, const ncp_island &s, double *now,
                                                  double *expected)
{
    const double speed = v.model.settings->correction_speed;
    each(s.bodies, [&](int32_t n) {
        ncp_node *node = &s.node[n];
        const double *w = node->velocity + 3, *I = node->own.inertia;
        node->now.p[0] = node->own.mass * dot3(node->velocity, node->velocity) +
                      w[0] * (I[0] * w[0] + I[3] * w[1] + I[4] * w[2]) +
                      w[1] * (I[3] * w[0] + I[1] * w[1] + I[5] * w[2]) +
                      w[2] * (I[4] * w[0] + I[5] * w[1] + I[2] * w[2]);
        const vec3 moved = v3_scale(v3_load(node->own.b), 1 / node->own.mass), turn = v3_load(node->own.b + 3);
        node->now.p[1] = node->own.mass * (v3_norm2(moved) + speed * speed) +
                      v3_dot(turn, m3_solve(inertia_of(node->own), turn));
    });
    ncp_barrier();
    *now = *expected = 0;
    for (int32_t n = 0; n < s.bodies; ++n) *now += s.node[n].now.p[0], *expected += s.node[n].now.p[1];
    ncp_barrier();
}

/* A solution is kept, or is that again. */
static __device__ __noinline__ void keep_solution(const ncp_island &s)
{
    each(3 * s.contacts, [&](int32_t n) { s.kept[n] = s.impulse[n]; });
    each(s.rows, [&](int32_t r) { s.kept[3 * s.contacts + r] = s.row[r].lambda; });
    ncp_barrier();
}
static __device__ __noinline__ void take_kept(const cuda_view &v, const ncp_island &s)
{
    each(3 * s.contacts, [&](int32_t n) { s.impulse[n] = s.kept[n]; });
    each(s.rows, [&](int32_t r) { s.row[r].lambda = s.kept[3 * s.contacts + r]; });
    ncp_barrier();
    solve_trees(v, s);
}

/* Is what is this far from the laws, m/s, a solution: is it what rounding leaves of the forces of drives, if the
 * tolerance allows that? */
static __device__ __noinline__ bool is_enough(const cuda_view &v, const ncp_island &s, double map)
{
    double most = 0;
    if (!(map > NCP_ENOUGH)) return true;
    if (!(map <= v.model.settings->tolerance)) return false;
    for (int32_t r = 0; r < s.rows; ++r) {
        const ncp_row *row = &s.row[r];
        if (isfinite(row->lo) && isfinite(row->hi)) most = fmax(most, fabs(row->lambda) * row->response);
    }
    return map <= NCP_DRIVE_ROUNDING * most;
}

/* Is it solved? By impulses, multipliers and velocities as they are then. A solution of much energy, as drives may ask
 * for, stays where contacts that give do not have less than half of it. */
static __device__ __noinline__ bool search_all(const cuda_view &v, ncp_island *s, const ncp_memory &memory,
                                               double *budget, ncp_shared *shared)
{
    double energy, expected, given;
    const double map = search(v, s, memory, false, budget, shared);
    if (NCP_LEAVES_HARD && !(map < INFINITY)) return false;
    const bool solved = is_enough(v, *s, map);
    put(s->missed, false);
    find_energies(v, *s, &energy, &expected);
    if (solved && energy <= NCP_MOST_ENERGY * expected) return true;
    keep_solution(*s);
    forget(s);
    const double map_of_given = search(v, s, memory, true, budget, shared);
    if (NCP_LEAVES_HARD && !(map_of_given < INFINITY)) return false;
    const bool gives = is_enough(v, *s, map_of_given);
    find_energies(v, *s, &given, &expected);
    if (gives && !(solved && given > energy / 2)) {
        put(s->missed, !(map_of_all(*s, 0, shared) <= v.model.settings->tolerance));
        return true;
    }
    if (solved) take_kept(v, *s);
    return solved;
}

#endif
