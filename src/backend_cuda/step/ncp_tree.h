/* The trees of an island: what joints leave free, the factor, and solves with it (core/solve/articulation_tree.h has
 * the formulas). Nodes of a level side by side. */
#ifndef SADMM_CUDA_STEP_NCP_TREE_H
#define SADMM_CUDA_STEP_NCP_TREE_H

#include "ncp_island.h"

/* How far the axes of locks may be off being unit and perpendicular. */
#define NCP_PERPENDICULAR 1e-9

/* ---- what joints leave free -------------------------------------------------------------------------------------- */

static __device__ __forceinline__ const double *lock_row(const ncp_island &s, const ncp_node &node, int kind, int i)
{
    return s.row[node.lock[3 * kind + i]].jacobian;
}

static __device__ __forceinline__ bool add_lock(const ncp_island &s, ncp_node *node, int32_t r)
{
    const double *row = s.row[r].jacobian;
    const bool moves = dot3(row, row) > 0.5;
    const int at = moves ? 0 : 3, kind = moves ? 0 : 1;
    if (node->locks[kind] == 3 || !(fabs(dot3(row + at, row + at) - 1) < NCP_PERPENDICULAR) ||
        (!moves && dot3(row, row) != 0))
        return false;
    for (int i = 0; i < node->locks[kind]; ++i)
        if (!(fabs(dot3(row + at, lock_row(s, *node, kind, i) + at)) < NCP_PERPENDICULAR)) return false;
    node->lock[3 * kind + node->locks[kind]++] = r;
    return true;
}

/* Locks, and how many directions they leave. False: they are not those of one joint. */
static __device__ bool find_locks(const ncp_island &s, ncp_node *node)
{
    bool right = true;
    node->locks[0] = node->locks[1] = 0;
    for (int32_t r = node->first_row; r < node->first_row + node->rows; ++r)
        if (s.row[r].role == NCP_LOCK && !add_lock(s, node, r)) right = false;
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
static __device__ void find_directions(const ncp_island &s, const ncp_node &node)
{
    double axis[3][3], *S = directions_of(s, node);
    for (int kind = 0; kind < 2; ++kind) {
        for (int i = 0; i < node.locks[kind]; ++i)
            for (int k = 0; k < 3; ++k) axis[i][k] = lock_row(s, node, kind, i)[3 * kind + k];
        const int count = complete_axes(axis, node.locks[kind]);
        for (int i = 0; i < count; ++i, S += 6) {
            for (int k = 0; k < 6; ++k) S[k] = k / 3 == kind ? axis[i][k % 3] : 0;
            for (int l = 0; kind == 1 && l < node.locks[0]; ++l) {
                const double *row = lock_row(s, node, 0, l), way = dot3(row + 3, axis[i]);
                for (int k = 0; k < 3; ++k) S[k] -= way * row[k];
            }
        }
    }
}

/* s: locks ask for gain x + bias = 0. */
static __device__ void meet_locks(const ncp_island &s, ncp_node *node)
{
    double *met = node->met;
    for (int k = 0; k < 6; ++k) met[k] = 0;
    for (int kind = 1; kind >= 0; --kind)
        for (int i = 0; i < node->locks[kind]; ++i) {
            const ncp_row *row = &s.row[node->lock[3 * kind + i]];
            const double *axis = row->jacobian + 3 * kind,
                         target = -row->bias / row->gain - (kind ? 0 : dot3(row->jacobian + 3, met + 3));
            for (int k = 0; k < 3; ++k) met[3 * kind + k] += target * axis[k];
        }
}

/* ---- the factor -------------------------------------------------------------------------------------------------- */

/* Row k of M += X^T M X of what a child hands on. */
static __device__ void gather_inertia(const ncp_island &s, ncp_node *node, int k)
{
    double sum[6];
    for (int c = 0; c < 6; ++c) sum[c] = node->M[6 * k + c];
    for (int32_t n = node->child; n >= 0; n = s.node[n].sibling) {
        const ncp_node *child = &s.node[n];
        if (!child->bound) continue;
        const double *M = child->M, *r = child->offset;
        const int i = k % 3, a = (i + 1) % 3, b = (i + 2) % 3;
        if (k < 3) {
            const double *row = M + 6 * i;
            for (int c = 0; c < 3; ++c) {
                const int d = (c + 1) % 3, e = (c + 2) % 3;
                sum[c] += row[c];
                sum[3 + c] += row[3 + c] - (row[d] * r[e] - row[e] * r[d]);
            }
        } else {
            const double *wl = M + 6 * k;
            for (int c = 0; c < 3; ++c) {
                const int d = (c + 1) % 3, e = (c + 2) % 3;
                const double *row = M + 6 * c, *up = M + 6 * a, *down = M + 6 * b;
                sum[c] += row[3 + i] - (row[a] * r[b] - row[b] * r[a]);
                sum[3 + c] += wl[3 + c] - (wl[d] * r[e] - wl[e] * r[d]) +
                              (r[a] * (down[3 + c] - (down[d] * r[e] - down[e] * r[d])) -
                               r[b] * (up[3 + c] - (up[d] * r[e] - up[e] * r[d])));
            }
        }
    }
    for (int c = 0; c < 6; ++c) node->M[6 * k + c] = sum[c];
}

/* Row k of D = S^T U + the laws of rows with compliance. */
static __device__ void enter_stiffness(const ncp_island &s, const ncp_node &node, int k)
{
    const int n = node.free;
    double *D = stiffness_of(s, node) + k * n;
    for (int j = 0; j < n; ++j) D[j] = six_product(directions_of(s, node) + 6 * k, forces_of(s, node) + 6 * j);
    for (int32_t r = node.first_row; r < node.first_row + node.rows; ++r) {
        const ncp_row *row = &s.row[r];
        if (row->role != NCP_SOFT) continue;
        const double *g = s.pool + row->along, share = row->gain / row->compliance * g[k];
        for (int j = 0; j < n; ++j) D[j] += share * g[j];
    }
}

/* Column k of H = D^-1; a lane has the factor by itself, in registers, of 6 x 6. */
static __device__ void invert_column(const ncp_island &s, const ncp_node &node, int k)
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

/* Row k of M becomes that of what is handed on: M - U H U^T. */
static __device__ void hand_on_inertia(const ncp_island &s, ncp_node *node, int k)
{
    const double *U = forces_of(s, *node), *H = inverse_of(s, *node);
    const int n = node->free;
    for (int j = 0; j < n; ++j) {
        double share = 0;
        for (int i = 0; i < n; ++i) share += U[6 * i + k] * H[i * n + j];
        for (int c = 0; c < 6; ++c) node->M[6 * k + c] -= share * U[6 * j + c];
    }
}

static __device__ void factor_trees(const ncp_island &s)
{
    each(s.bodies * 36, [&](int32_t t) { /* as rigid_entry of step/articulation_block.h */
        ncp_node *node = &s.node[t / 36];
        const struct cuda_articulation_body *body = &node->own;
        const int k = t % 36 / 6, q = t % 6, i = k - 3, j = q - 3;
        node->M[t % 36] = k < 3 || q < 3 ? (k == q ? body->mass : 0) : body->inertia[i == j ? i : i + j + 2];
    });
    __syncthreads();
#pragma unroll 1
    for (int32_t level = s.levels - 1; level >= 0; --level) {
        each_lane(s, level, [&](ncp_node *node, int k) { gather_inertia(s, node, k); });
        each_lane(s, level, [&](ncp_node *node, int k) {
            const double *S = directions_of(s, *node);
            double *U = forces_of(s, *node);
            for (int i = 0; i < node->free; ++i) U[6 * i + k] = six_product(node->M + 6 * k, S + 6 * i);
            node->held[k] = six_product(node->M + 6 * k, node->met);
        });
        each_lane(s, level, [&](ncp_node *node, int k) {
            if (k < node->free) enter_stiffness(s, *node, k);
        });
        each_lane(s, level, [&](ncp_node *node, int k) {
            if (k < node->free) invert_column(s, *node, k);
        });
        each_lane(s, level, [&](ncp_node *node, int k) {
            if (is_carried(*node)) hand_on_inertia(s, node, k);
        });
    }
}

/* ---- velocities -------------------------------------------------------------------------------------------------- */

/* b and what contacts and rows without a joint of their own do, at a node. */
static __device__ __forceinline__ double outer_load(const cuda_view &v, const ncp_island &s, int32_t n, int k)
{
    double sum = s.node[n].own.b[k];
    for (int32_t i = 0; i < s.contacts; ++i) {
        const ncp_contact *c = &s.contact[i];
        for (int side = 0; side < 2; ++side) {
            if (c->node[side] != n) continue;
            const double *f = s.impulse + 3 * i;
            double force[3];
            for (int j = 0; j < 3; ++j)
                force[j] = c->frame[j] * f[0] + c->frame[3 + j] * f[1] + c->frame[6 + j] * f[2];
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            const double *arm = c->arm[side], load = k < 3 ? force[k] : arm[a] * force[b] - arm[b] * force[a];
            sum += side ? load : -load;
        }
    }
    for (int32_t r = s.first_gear; r < s.rows; ++r)
        for (int side = 0; side < 2; ++side)
            if (side_of_gear(v, s.row[r].slot, side) == n)
                sum += v.raw.rows[s.row[r].slot].jacobian[side][k] * s.row[r].lambda;
    return sum;
}

/* On its way to the root: q by itself, and what is handed on. */
static __device__ void pass_down(const ncp_island &s, ncp_node *node)
{
    const double *S = directions_of(s, *node), *U = forces_of(s, *node), *H = inverse_of(s, *node);
    double p[6], t[6];
    for (int k = 0; k < 6; ++k) p[k] = node->load[k];
    for (int32_t n = node->child; n >= 0; n = s.node[n].sibling)
        if (s.node[n].bound) add_load(s.node[n].offset, s.node[n].up, p);
    for (int k = 0; k < 6; ++k) p[k] -= node->held[k];
    for (int i = 0; i < node->free; ++i) t[i] = six_product(S + 6 * i, p);
    for (int32_t r = node->first_row; r < node->first_row + node->rows; ++r) {
        const ncp_row *row = &s.row[r];
        if (row->role == NCP_LOCK) continue;
        const double *g = s.pool + row->along,
                     by = row->role != NCP_SOFT
                              ? row->lambda
                              : -(row->bias + row->gain * six_product(row->jacobian, node->met)) / row->compliance;
        for (int i = 0; i < node->free; ++i) t[i] += g[i] * by;
    }
    for (int i = 0; i < node->free; ++i) node->q[i] = along(node->free, H + i * node->free, t);
    if (!is_carried(*node)) return;
    for (int k = 0; k < 6; ++k) {
        double up = p[k];
        for (int i = 0; i < node->free; ++i) up -= U[6 * i + k] * node->q[i];
        node->up[k] = up;
    }
}

static __device__ void pass_up(const ncp_island &s, ncp_node *node)
{
    const double *S = directions_of(s, *node), *U = forces_of(s, *node), *H = inverse_of(s, *node);
    double held[6] = {0, 0, 0, 0, 0, 0}, pull[6], q[6];
    for (int i = 0; i < node->free; ++i) q[i] = node->q[i];
    if (is_carried(*node)) {
        carry(node->offset, s.node[node->parent].velocity, held);
        for (int i = 0; i < node->free; ++i) pull[i] = six_product(U + 6 * i, held);
        for (int i = 0; i < node->free; ++i) q[i] -= along(node->free, H + i * node->free, pull);
    }
    for (int k = 0; k < 6; ++k) {
        double sum = held[k] + node->met[k];
        for (int i = 0; i < node->free; ++i) sum += S[6 * i + k] * q[i];
        node->velocity[k] = sum;
    }
}

/* Velocities for impulses and multipliers of rows with numbers as they are; what these rows' laws say of them. */
static __device__ void solve_trees(const cuda_view &v, const ncp_island &s)
{
    each(s.bodies * LANES, [&](int32_t t) {
        if (t % LANES < 6) s.node[t / LANES].load[t % LANES] = outer_load(v, s, t / LANES, t % LANES);
    });
    __syncthreads();
#pragma unroll 1
    for (int32_t level = s.levels - 1; level >= 0; --level)
        each_node(s, level, [&](ncp_node *node) { pass_down(s, node); });
#pragma unroll 1
    for (int32_t level = 0; level < s.levels; ++level) each_node(s, level, [&](ncp_node *node) { pass_up(s, node); });
    each(s.rows, [&](int32_t r) {
        ncp_row *row = &s.row[r];
        if (row->role == NCP_LOCK) return;
        const double x = row->gain * rate_of(v, s, *row) + row->bias;
        if (row->role == NCP_SOFT) row->lambda = -x / row->compliance;
        row->u = x + row->compliance * row->lambda;
    });
    __syncthreads();
}

/* Multipliers of locks: what a joint does to its body is what its motion and loads say, less what the other rows do. */
static __device__ void store_locks(const cuda_view &v, const ncp_island &s)
{
#pragma unroll 1
    for (int32_t level = s.levels - 1; level >= 0; --level)
        each_node(s, level, [&](ncp_node *node) {
            const struct cuda_articulation_body *body = &node->own;
            const double *w = node->velocity + 3, *I = body->inertia;
            double F[6];
            for (int k = 0; k < 3; ++k) F[k] = body->mass * node->velocity[k];
            F[3] = I[0] * w[0] + I[3] * w[1] + I[4] * w[2];
            F[4] = I[3] * w[0] + I[1] * w[1] + I[5] * w[2];
            F[5] = I[4] * w[0] + I[5] * w[1] + I[2] * w[2];
            for (int k = 0; k < 6; ++k) F[k] -= node->load[k];
            for (int32_t n = node->child; n >= 0; n = s.node[n].sibling)
                if (s.node[n].bound) add_load(s.node[n].offset, s.node[n].up, F);
            for (int k = 0; k < 6; ++k) node->up[k] = F[k];
            for (int32_t r = node->first_row; r < node->first_row + node->rows; ++r)
                for (int k = 0; s.row[r].role != NCP_LOCK && k < 6; ++k) F[k] -= s.row[r].jacobian[k] * s.row[r].lambda;
            for (int kind = 0; kind < 2; ++kind)
                for (int i = 0; i < node->locks[kind]; ++i) {
                    ncp_row *lock = &s.row[node->lock[3 * kind + i]];
                    const double *row = lock->jacobian, found = dot3(row + 3 * kind, F + 3 * kind);
                    lock->lambda = found;
                    for (int k = 3; k < 6; ++k) F[k] -= found * row[k];
                }
        });
    each(s.rows, [&](int32_t r) { v.joints.solution[s.row[r].slot] = s.row[r].lambda; });
}

#endif
