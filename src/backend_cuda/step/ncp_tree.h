/* The trees of an island: what joints leave free, the factor, and solves with it (core/solve/articulation_tree.h has
 * the formulas). Nodes of a level side by side. */
#ifndef SADMM_CUDA_STEP_NCP_TREE_H
#define SADMM_CUDA_STEP_NCP_TREE_H

#include "ncp_island.h"

/* How far the axes of locks may be off being unit and perpendicular. */
#define NCP_PERPENDICULAR 1e-9

/* ---- what joints leave free -------------------------------------------------------------------------------------- */

static __device__ __forceinline__ const double *lock_row(const ncp_node &node, int kind, int i)
{
    return node.M + 6 * node.place[3 * kind + i];
}

/* Lock `at` of M. */
static __device__ __forceinline__ bool add_lock(ncp_node *node, int at, int32_t lock)
{
    const double *row = node->M + 6 * at;
    const bool moves = dot3(row, row) > 0.5;
    const int part = moves ? 0 : 3, kind = moves ? 0 : 1;
    if (node->locks[kind] == 3 || !(fabs(dot3(row + part, row + part) - 1) < NCP_PERPENDICULAR) ||
        (!moves && dot3(row, row) != 0))
        return false;
    for (int i = 0; i < node->locks[kind]; ++i)
        if (!(fabs(dot3(row + part, lock_row(*node, kind, i) + part)) < NCP_PERPENDICULAR)) return false;
    node->place[3 * kind + node->locks[kind]] = (int8_t)at;
    node->lock[3 * kind + node->locks[kind]++] = lock;
    return true;
}

/* `count` locks, and how many directions they leave. False: they are not those of one joint. */
static __device__ __noinline__ bool sort_locks(ncp_node *node, int32_t count)
{
    int32_t lock[6];
    bool right = true;
    for (int i = 0; i < 6; ++i) lock[i] = node->lock[i];
    node->locks[0] = node->locks[1] = 0;
#pragma unroll 1
    for (int i = 0; i < count; ++i) right = add_lock(node, i, lock[i]) && right;
    node->free = 6 - node->locks[0] - node->locks[1];
    return right;
}

/* Unit axes perpendicular to `count` given ones; how many. */
static __device__ __forceinline__ int complete_axes(double axis[3][3], int count)
{
    if (count == 0) {
        for (int i = 0; i < 3; ++i)
            for (int k = 0; k < 3; ++k) axis[i][k] = i == k;
        return 3;
    }
    if (count == 1) {
        const vec3 n = v3_load(axis[0]);
        vec3 t, b;
        v3_tangents(n, &t, &b);
        v3_store(t, axis[0]);
        v3_store(b, axis[1]);
        return 2;
    }
    if (count == 2) {
        v3_store(v3_cross(v3_load(axis[0]), v3_load(axis[1])), axis[0]);
        return 1;
    }
    return 0;
}

/* Directions: translations that no lock forbids; rotations likewise, about where the locked translations are. */
static __device__ __noinline__ void find_directions(const ncp_island &s, const ncp_node &node)
{
    double axis[3][3], *S = directions_of(s, node);
    for (int kind = 0; kind < 2; ++kind) {
        for (int i = 0; i < node.locks[kind]; ++i)
            for (int k = 0; k < 3; ++k) axis[i][k] = lock_row(node, kind, i)[3 * kind + k];
        const int count = complete_axes(axis, node.locks[kind]);
        for (int i = 0; i < count; ++i, S += 6) {
            for (int k = 0; k < 6; ++k) S[k] = k / 3 == kind ? axis[i][k % 3] : 0;
            for (int l = 0; kind == 1 && l < node.locks[0]; ++l) {
                const double *row = lock_row(node, 0, l), way = dot3(row + 3, axis[i]);
                for (int k = 0; k < 3; ++k) S[k] -= way * row[k];
            }
        }
    }
}

/* s: locks ask for gain x + bias = 0; `held` has -bias / gain. */
static __device__ __noinline__ void meet_locks(ncp_node *node)
{
    double *met = node->met;
    for (int k = 0; k < 6; ++k) met[k] = 0;
    for (int kind = 1; kind >= 0; --kind)
        for (int i = 0; i < node->locks[kind]; ++i) {
            const double *row = lock_row(*node, kind, i),
                         target = node->held[node->place[3 * kind + i]] - (kind ? 0 : dot3(row + 3, met + 3));
            for (int k = 0; k < 3; ++k) met[3 * kind + k] += target * row[3 * kind + k];
        }
}

/* ---- the factor -------------------------------------------------------------------------------------------------- */

/* Row k of A and of what children hand on, X^T M X. */
static __device__ __forceinline__ void gather_inertia(const ncp_island &s, const ncp_node &node, int k, double sum[6])
{
    const struct cuda_articulation_body *body = &node.own;
#pragma unroll
    for (int q = 0; q < 6; ++q) { /* as rigid_entry of step/articulation_block.h */
        const int i = k - 3, j = q - 3;
        sum[q] = k < 3 || q < 3 ? (k == q ? body->mass : 0) : body->inertia[i == j ? i : i + j + 2];
    }
#pragma unroll 1
    for (int32_t n = node.child; n >= 0; n = s.node[n].sibling) {
        const ncp_node *child = &s.node[n];
        if (!child->bound) continue;
        const double *M = child->M, *r = child->offset;
        const int i = k % 3, a = (i + 1) % 3, b = (i + 2) % 3;
        if (k < 3) {
            const double *row = M + 6 * i;
#pragma unroll
            for (int c = 0; c < 3; ++c) {
                const int d = (c + 1) % 3, e = (c + 2) % 3;
                sum[c] += row[c];
                sum[3 + c] += row[3 + c] - (row[d] * r[e] - row[e] * r[d]);
            }
        } else {
            const double *wl = M + 6 * k, *up = M + 6 * a, *down = M + 6 * b, ra = r[a], rb = r[b];
#pragma unroll
            for (int c = 0; c < 3; ++c) {
                const int d = (c + 1) % 3, e = (c + 2) % 3;
                const double *row = M + 6 * c;
                sum[c] += row[3 + i] - (row[a] * rb - row[b] * ra);
                sum[3 + c] += wl[3 + c] - (wl[d] * r[e] - wl[e] * r[d]) +
                              (ra * (down[3 + c] - (down[d] * r[e] - down[e] * r[d])) -
                               rb * (up[3 + c] - (up[d] * r[e] - up[e] * r[d])));
            }
        }
    }
}

/* Row k of D = S^T U + the laws of rows with compliance, and what these say at s. */
static __device__ void enter_stiffness(const ncp_island &s, ncp_node *node, int k)
{
    const int n = node->free;
    double *D = stiffness_of(s, *node) + k * n, load = 0;
#pragma unroll 1
    for (int j = 0; j < n; ++j) D[j] = six_product(directions_of(s, *node) + 6 * k, forces_of(s, *node) + 6 * j);
#pragma unroll 1
    for (int32_t r = node->first_row; r < node->first_row + node->rows; ++r) {
        const ncp_row *row = &s.row[r];
        if (row->role != NCP_SOFT) continue;
        const double *g = s.pool + row->along, share = row->gain / row->compliance * g[k];
#pragma unroll 1
        for (int j = 0; j < n; ++j) D[j] += share * g[j];
        load -= g[k] * (row->bias + row->gain * six_product(row->jacobian, node->met)) / row->compliance;
    }
    soft_of(s, *node)[k] = load;
}

/* Column k of H = D^-1; a lane has the factor by itself, in registers, of 6 x 6. */
static __device__ __noinline__ void invert_column(const ncp_island &s, const ncp_node &node, int k)
{
    const int n = node.free;
    const double *D = stiffness_of(s, node);
    double *H = inverse_of(s, node), L[36], x[6];
    if (n == 1) {
        H[0] = D[0] > 0 ? 1 / D[0] : 0;
        return;
    }
#pragma unroll
    for (int i = 0; i < 6; ++i)
#pragma unroll
        for (int j = 0; j <= i; ++j) L[6 * i + j] = i < n ? D[i * n + j] : i == j;
    ldl6_factor(L, L);
#pragma unroll
    for (int i = 0; i < 6; ++i) x[i] = i == k;
    ldl6_solve(L, x, x);
#pragma unroll
    for (int i = 0; i < 6; ++i)
        if (i < n) H[i * n + k] = x[i];
}

/* Row k of what is handed on: M - U H U^T. */
static __device__ __forceinline__ void hand_on_inertia(const ncp_island &s, ncp_node *node, int k, double M[6])
{
    const double *U = forces_of(s, *node), *H = inverse_of(s, *node);
    const int n = node->free;
#pragma unroll 1
    for (int j = 0; j < n; ++j) {
        double share = 0;
#pragma unroll 1
        for (int i = 0; i < n; ++i) share += U[6 * i + k] * H[i * n + j];
#pragma unroll
        for (int c = 0; c < 6; ++c) M[c] -= share * U[6 * j + c];
    }
#pragma unroll
    for (int c = 0; c < 6; ++c) node->M[6 * k + c] = M[c];
}

static __device__ __forceinline__ void factor_node(const ncp_island &s, ncp_node *node, int k, bool live)
{
    const bool free = live && k < node->free;
    double M[6];
    if (live) {
        const double *S = directions_of(s, *node);
        double *U = forces_of(s, *node);
        gather_inertia(s, *node, k, M);
#pragma unroll 1
        for (int i = 0; i < node->free; ++i) U[6 * i + k] = six_product(M, S + 6 * i);
        node->held[k] = six_product(M, node->met);
    }
    __syncwarp((unsigned)ALL_LANES);
    if (free) enter_stiffness(s, node, k);
    __syncwarp((unsigned)ALL_LANES);
    if (free) invert_column(s, *node, k);
    __syncwarp((unsigned)ALL_LANES);
    if (live && is_carried(*node)) hand_on_inertia(s, node, k, M);
}

static __device__ __noinline__ void factor_trees(const ncp_island &s)
{
#pragma unroll 1
    for (int32_t level = s.levels - 1; level >= 0; --level)
        each_node(s, level, [&](ncp_node *node, int k, bool live) { factor_node(s, node, k, live); });
}

/* ---- velocities -------------------------------------------------------------------------------------------------- */

/* Number k of a load at a place r further on, which is carried to where r is from. */
static __device__ __forceinline__ double carried(const double r[3], const double p[6], int k)
{
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    return k < 3 ? p[k] : p[k] + (r[a] * p[b] - r[b] * p[a]);
}

/* b and what contacts and rows without a joint of their own do, at a node. */
static __device__ __forceinline__ double outer_load(const cuda_view &v, const ncp_island &s, int32_t n, int k)
{
    double sum = s.node[n].own.b[k];
#pragma unroll 1
    for (int32_t i = 0; i < s.contacts; ++i) {
        const ncp_contact *c = &s.contact[i];
#pragma unroll
        for (int side = 0; side < 2; ++side) {
            if (c->node[side] != n) continue;
            const double *f = s.impulse + 3 * i;
            double force[3];
            for (int j = 0; j < 3; ++j)
                force[j] = c->frame[j] * f[0] + c->frame[3 + j] * f[1] + c->frame[6 + j] * f[2];
            const double *arm = c->arm[side];
            const double turn[3] = {arm[1] * force[2] - arm[2] * force[1], arm[2] * force[0] - arm[0] * force[2],
                                    arm[0] * force[1] - arm[1] * force[0]},
                         load = k == 0 ? force[0] : k == 1 ? force[1] : k == 2 ? force[2]
                              : k == 3 ? turn[0] : k == 4 ? turn[1] : turn[2];
            sum += side ? load : -load;
        }
    }
#pragma unroll 1
    for (int32_t r = s.first_gear; r < s.rows; ++r)
        for (int side = 0; side < 2; ++side)
            if (side_of_gear(v, s.row[r].slot, side) == n)
                sum += v.raw.rows[s.row[r].slot].jacobian[side][k] * s.row[r].lambda;
    return sum;
}

/* On its way to the root: q by itself, and what is handed on. */
static __device__ __forceinline__ void pass_down(const ncp_island &s, ncp_node *node, int k, bool live)
{
    const bool free = live && k < node->free;
    struct ncp_passing *now = &node->now;
    const double *H = inverse_of(s, *node) + k * node->free;
    double p = 0;
    if (live) {
        p = now->load[k];
#pragma unroll 1
        for (int32_t n = node->child; n >= 0; n = s.node[n].sibling)
            if (s.node[n].bound) p += carried(s.node[n].offset, s.node[n].now.up, k);
        p -= node->held[k];
        now->p[k] = p;
    }
    __syncwarp((unsigned)ALL_LANES);
    if (free) {
        double t = six_product(directions_of(s, *node) + 6 * k, now->p) + soft_of(s, *node)[k];
#pragma unroll 1
        for (int32_t r = node->first_row; node->loads && r < node->first_row + node->rows; ++r) {
            const ncp_row *row = &s.row[r];
            if (row->role != NCP_SOFT) t += s.pool[row->along + k] * row->lambda;
        }
        now->t[k] = t;
    }
    __syncwarp((unsigned)ALL_LANES);
    if (free) now->q[k] = along(node->free, H, now->t);
    __syncwarp((unsigned)ALL_LANES);
    if (!live || !is_carried(*node)) return;
    const double *U = forces_of(s, *node) + k;
#pragma unroll 1
    for (int i = 0; i < node->free; ++i) p -= U[6 * i] * now->q[i];
    now->up[k] = p;
}

static __device__ __forceinline__ void pass_up(const ncp_island &s, ncp_node *node, int k, bool live)
{
    const bool held = live && is_carried(*node), free = held && k < node->free;
    struct ncp_passing *now = &node->now;
    double sum = live ? node->met[k] : 0;
    if (held) {
        const double *v = s.node[node->parent].velocity, *r = node->offset;
        const int a = (k + 1) % 3, b = (k + 2) % 3;
        const double own = k < 3 ? v[k] + (v[3 + a] * r[b] - v[3 + b] * r[a]) : v[k];
        now->p[k] = own;
        sum += own;
    }
    __syncwarp((unsigned)ALL_LANES);
    if (free) now->t[k] = six_product(forces_of(s, *node) + 6 * k, now->p);
    __syncwarp((unsigned)ALL_LANES);
    if (free) now->q[k] -= along(node->free, inverse_of(s, *node) + k * node->free, now->t);
    __syncwarp((unsigned)ALL_LANES);
    if (!live) return;
    const double *S = directions_of(s, *node) + k;
#pragma unroll 1
    for (int i = 0; i < node->free; ++i) sum += S[6 * i] * now->q[i];
    node->velocity[k] = sum;
}

static __device__ __forceinline__ double law_rate(const cuda_view &v, const ncp_island &s, const ncp_row &row)
{
    return row.gain * rate_of(v, s, row) + row.bias;
}

/* Velocities for impulses and multipliers of rows with numbers as they are; what these rows' laws say of them. */
static __device__ __noinline__ void solve_trees(const cuda_view &v, const ncp_island &s)
{
    each_eight(s.bodies, [&](int32_t n, int k) {
        if (n >= 0 && k < 6) s.node[n].now.load[k] = outer_load(v, s, n, k);
    });
    ncp_barrier();
#pragma unroll 1
    for (int32_t level = s.levels - 1; level >= 0; --level)
        each_node(s, level, [&](ncp_node *node, int k, bool live) { pass_down(s, node, k, live); });
#pragma unroll 1
    for (int32_t level = 0; level < s.levels; ++level)
        each_node(s, level, [&](ncp_node *node, int k, bool live) { pass_up(s, node, k, live); });
    each(s.bounded, [&](int32_t i) {
        ncp_row *row = &s.row[s.bounded_row[i]];
        row->u = law_rate(v, s, *row) + row->compliance * row->lambda;
    });
    ncp_barrier();
}

/* What a joint does to its body is what its motion and loads say; less what its other rows do, that is its locks'. */
static __device__ __forceinline__ void store_locks(const cuda_view &v, const ncp_island &s, ncp_node *node, int k,
                                                   bool live)
{
    struct ncp_passing *now = &node->now;
    double F = 0;
    if (live) {
        const struct cuda_articulation_body *body = &node->own;
        const double *w = node->velocity + 3, *I = body->inertia;
        F = k < 3    ? body->mass * node->velocity[k]
            : k == 3 ? I[0] * w[0] + I[3] * w[1] + I[4] * w[2]
            : k == 4 ? I[3] * w[0] + I[1] * w[1] + I[5] * w[2]
                     : I[4] * w[0] + I[5] * w[1] + I[2] * w[2];
        F -= now->load[k];
#pragma unroll 1
        for (int32_t n = node->child; n >= 0; n = s.node[n].sibling)
            if (s.node[n].bound) F += carried(s.node[n].offset, s.node[n].now.up, k);
        now->up[k] = F;
#pragma unroll 1
        for (int32_t r = node->first_row; r < node->first_row + node->rows; ++r)
            F -= s.row[r].jacobian[k] * s.row[r].lambda;
        now->p[k] = F;
    }
#pragma unroll 1
    for (int kind = 0; kind < 2; ++kind) {
        __syncwarp((unsigned)ALL_LANES);
        if (live && k < node->locks[kind]) {
            const int32_t lock = node->lock[3 * kind + k];
            const double *row = v.raw.rows[lock / 2].jacobian[lock % 2];
            v.joints.solution[lock / 2] = now->t[k] = dot3(row + 3 * kind, now->p + 3 * kind);
        }
        __syncwarp((unsigned)ALL_LANES);
        if (kind > 0 || !live || k < 3) continue;
#pragma unroll 1
        for (int i = 0; i < node->locks[0]; ++i) {
            const int32_t lock = node->lock[i];
            F -= now->t[i] * v.raw.rows[lock / 2].jacobian[lock % 2][k];
        }
        now->p[k] = F;
    }
}

/* Multipliers of rows. */
static __device__ __noinline__ void store_rows(const cuda_view &v, const ncp_island &s)
{
    each(s.rows, [&](int32_t r) {
        ncp_row *row = &s.row[r];
        if (row->role == NCP_SOFT) row->lambda = -law_rate(v, s, *row) / row->compliance;
    });
    ncp_barrier();
#pragma unroll 1
    for (int32_t level = s.levels - 1; level >= 0; --level)
        each_node(s, level, [&](ncp_node *node, int k, bool live) { store_locks(v, s, node, k, live); });
    each(s.rows, [&](int32_t r) { v.joints.solution[s.row[r].slot] = s.row[r].lambda; });
}

#endif
