/* An island as the step has it (ncp_island.h): nodes of its bodies, rows of their joints, contacts. */
#ifndef SADMM_CUDA_STEP_NCP_LOAD_H
#define SADMM_CUDA_STEP_NCP_LOAD_H

#include "core/model/articulation.h"
#include "move.h"
#include "ncp_tree.h"

/* Nodes of a part's trees. right: becomes false where they are not all of this island. */
static __device__ void make_tree(const cuda_view &v, const ncp_island &s, int32_t part, int32_t base, bool *right)
{
    const struct cuda_ncp_part plan = v.ncp.parts[part];
    each(plan.nodes, [&](int32_t n) {
        const struct cuda_ncp_node from = v.ncp.nodes[plan.first + n];
        ncp_node *node = &s.node[base + n];
        node->body = from.body;
        node->parent = from.parent < 0 ? -1 : base + from.parent;
        node->child = from.child < 0 ? -1 : base + from.child;
        node->sibling = from.sibling < 0 ? -1 : base + from.sibling;
        node->first_joint = from.first_joint, node->joints = from.joints, node->level = from.level;
        if (v.graph.label[from.body] != s.label) *right = false; /* a joint has no rows at the time */
    });
}

/* Nodes of its bodies, but for what joints say. False: a part is no tree. */
static __device__ bool make_nodes(const cuda_view &v, ncp_island *s, ncp_memory *memory, ncp_shared *shared)
{
    bool right = true;
    if (threadIdx.x == 0) shared->parts = 0;
    __syncthreads();
    each(s->bodies, [&](int32_t t) {
        const int32_t body = v.graph.body_of[s->first_slot + t], part = v.ncp.part_of[body];
        const bool is_first = part < 0 || v.joints.parts[part].label - 1 == body;
        shared->of[t] = !is_first ? 0 : part < 0 ? 1 : v.ncp.parts[part].nodes;
        if (part >= 0 && v.ncp.parts[part].nodes == 0) right = false;
        if (part >= 0 && is_first) atomicAdd(&shared->parts, 1);
    });
    if (any_of(!right, shared) || shared->parts > NCP_PARTS) return false;
    if (add_up(s->bodies, shared->of, shared->at, &shared->count) != s->bodies) return false;
    s->node = take<ncp_node>(memory, (size_t)s->bodies);
    if (memory->full) return false;
    s->levels = 1;
    int32_t parts = 0;
#pragma unroll 1
    for (int32_t t = 0; t < s->bodies; ++t) {
        if (shared->of[t] == 0) continue;
        const int32_t body = v.graph.body_of[s->first_slot + t], part = v.ncp.part_of[body], base = shared->at[t];
        if (part >= 0) {
            const int32_t levels = v.ncp.parts[part].levels;
            s->levels = levels > s->levels ? levels : s->levels;
            if (threadIdx.x == 0) shared->part[parts] = part;
            ++parts;
            make_tree(v, *s, part, base, &right);
        } else if (threadIdx.x == 0) {
            ncp_node *node = &s->node[base];
            node->body = body;
            node->parent = node->child = node->sibling = -1;
            node->first_joint = node->joints = node->level = 0;
        }
    }
    __syncthreads();
    each(s->bodies, [&](int32_t n) {
        ncp_node *node = &s->node[n];
        int32_t rows = 0;
        v.ncp.number[node->body] = n;
        node->own = v.joints.bodies[node->body];
        node->bound = 0;
        for (int32_t j = node->first_joint; j < node->first_joint + node->joints; ++j) {
            const int32_t code = v.ncp.joints[j];
            const struct sadmm_row_constraint *constraint = &v.raw.constraints[code / 2];
            if (constraint->count == 0) continue;
            rows += constraint->count;
            if (!constraint->rigid) right = false;
            node->bound = 1;
            for (int k = 0; k < 3; ++k) node->offset[k] = code % 2 ? constraint->offset[k] : -constraint->offset[k];
        }
        node->rows = rows;
        shared->of[n] = rows;
    });
    return !any_of(!right, shared);
}

/* What a row says, but for what follows from directions. */
static __device__ void load_row(const cuda_view &v, const ncp_island &s, ncp_row *row, bool after)
{
    const struct raw_row law = v.raw.rows[row->slot];
    const bool fixed = law.gain == 0 || !(law.hi > law.lo), bounded = law.lo > -INFINITY || law.hi < INFINITY;
    const double start = after ? (double)v.rows.data[row->slot].lambda : v.model.warm_start ? law.lambda : 0;
    double response[2] = {0, 0};
    for (int k = 0; k < 6; ++k) row->jacobian[k] = row->side ? law.jacobian[1][k] : law.jacobian[0][k];
    row->gain = law.gain, row->bias = law.bias, row->compliance = law.compliance;
    row->lo = law.lo, row->hi = law.hi;
    row->number = -1;
    row->role = row->node >= 0 && sadmm_law_is_coupled(law.compliance, law.lo, law.hi) ? NCP_LOCK
                : fixed                                                                ? NCP_FIXED
                : row->node >= 0 && !bounded && law.compliance > 0                     ? NCP_SOFT
                                                                                       : NCP_BOUNDED;
    row->lambda = articulation_clamp(fixed && law.compliance > 0 ? -law.bias / law.compliance : start, law.lo, law.hi);
    if (row->role == NCP_LOCK || row->role == NCP_SOFT) return;
    for (int side = 0; side < 2; ++side) {
        const int32_t n = side_of_gear(v, row->slot, side);
        if (n >= 0) response[side] = own_response(s.node[n].own, law.jacobian[side]);
    }
    row->response = law.gain * articulation_scale_of(response[0], response[1]) + law.compliance;
    if (row->role == NCP_BOUNDED && !(row->response > 0)) row->role = NCP_FIXED;
}

/* Rows of the gears of the island's parts; returns how many. */
static __device__ int32_t list_gears(const cuda_view &v, const ncp_island &s, const ncp_shared *shared, ncp_row *rows)
{
    int32_t count = 0;
    for (int32_t k = 0; k < shared->parts; ++k) {
        const struct cuda_ncp_part plan = v.ncp.parts[shared->part[k]];
        for (int32_t g = plan.first_gear; g < plan.first_gear + plan.gears; ++g) {
            const int32_t constraint = v.ncp.joints[g];
            for (int32_t r = 0; r < v.raw.constraints[constraint].count; ++r, ++count) {
                if (!rows || threadIdx.x > 0) continue;
                rows[count].slot = constraint * SADMM_MAX_ROWS + r;
                rows[count].node = -1;
                rows[count].side = rows[count].along = 0;
            }
        }
    }
    (void)s;
    return count;
}

/* Rows, and directions that locks leave. False: there is no room, or locks are not those of one joint. */
static __device__ bool make_rows(const cuda_view &v, ncp_island *s, ncp_memory *memory, bool after,
                                 ncp_shared *shared)
{
    bool right = true;
    s->first_gear = add_up(s->bodies, shared->of, shared->at, &shared->count);
    s->rows = s->first_gear + list_gears(v, *s, shared, nullptr);
    s->row = take<ncp_row>(memory, (size_t)s->rows);
    if (memory->full) return false;
    each(s->bodies, [&](int32_t n) {
        ncp_node *node = &s->node[n];
        int32_t at = node->first_row = shared->at[n];
        for (int32_t j = node->first_joint; j < node->first_joint + node->joints; ++j) {
            const int32_t code = v.ncp.joints[j], count = v.raw.constraints[code / 2].count;
            for (int32_t k = 0; k < count; ++k, ++at) {
                s->row[at].slot = code / 2 * SADMM_MAX_ROWS + k;
                s->row[at].side = code % 2;
                s->row[at].node = n;
            }
        }
    });
    (void)list_gears(v, *s, shared, s->row + s->first_gear);
    __syncthreads();
    each(s->rows, [&](int32_t r) { load_row(v, *s, &s->row[r], after); });
    __syncthreads();
    each(s->bodies, [&](int32_t n) {
        ncp_node *node = &s->node[n];
        if (!find_locks(*s, node)) right = false;
        shared->of[n] = node->free * (12 + 2 * node->free + node->rows - node->locks[0] - node->locks[1]);
    });
    if (any_of(!right, shared)) return false;
    s->pool = take<double>(memory, (size_t)add_up(s->bodies, shared->of, shared->at, &shared->count));
    if (memory->full) return false;
    each(s->bodies, [&](int32_t n) {
        ncp_node *node = &s->node[n];
        node->pool = shared->at[n];
        find_directions(*s, *node);
        meet_locks(*s, node);
        int32_t at = node->pool + node->free * (12 + 2 * node->free);
        for (int32_t r = node->first_row; r < node->first_row + node->rows; ++r) {
            if (s->row[r].role == NCP_LOCK) continue;
            s->row[r].along = at;
            at += node->free;
        }
    });
    __syncthreads();
    each(s->first_gear, [&](int32_t r) {
        const ncp_row *row = &s->row[r];
        const ncp_node &node = s->node[row->node];
        for (int i = 0; row->role != NCP_LOCK && i < node.free; ++i)
            s->pool[row->along + i] = six_product(row->jacobian, directions_of(*s, node) + 6 * i);
    });
    __syncthreads();
    return true;
}

/* Does this side of a pair speak for it? */
static __device__ __forceinline__ bool speaks(const cuda_view &v, int32_t code)
{
    return code / 2 < v.contacts.pair_capacity && (code % 2 == 0 || v.raw.pairs[code / 2].body_a < 0);
}

static __device__ void make_contact(const cuda_view &v, const ncp_island &s, int32_t pair_at, int32_t k, ncp_contact *c,
                                    ncp_law *law, double impulse[3], bool after)
{
    const struct sadmm_contact_pair *pair = &v.raw.pairs[pair_at];
    const struct sadmm_contact_point *points = &v.raw.points[pair->first];
    const struct sadmm_settings settings = *v.model.settings;
    const mat3 frame = sadmm_contact_frame(pair->normal);
    vec3 start = after ? point_impulse(v.contacts, pair_at, k) : v3_load(points[k].impulse);
    if (!after && !v.model.warm_start) start = v3(0, 0, 0);
    c->pair = pair_at, c->point = pair->first + k;
    c->node[0] = node_of_body(v, pair->body_a);
    c->node[1] = node_of_body(v, pair->body_b);
    for (int i = 0; i < 3; ++i) v3_store(frame.r[i], c->frame + 3 * i);
    for (int i = 0; i < 3; ++i) c->arm[0][i] = points[k].arm_a[i], c->arm[1][i] = points[k].arm_b[i];
    v3_store(m3_mul(frame, sadmm_kinematic_part(&v.raw.system, pair, &points[k])), c->given);
    c->given[0] += sadmm_contact_e(&v.raw.system, &settings, pair, points, k);
    v3_store(m3_mul(frame, start), impulse);
    law->response = 0;
    for (int i = 0; i < 3; ++i) {
        double response = 0, row[6];
        for (int side = 0; side < 2; ++side) {
            if (c->node[side] < 0) continue;
            contact_row(*c, i, side, row);
            response += own_response(s.node[c->node[side]].own, row);
        }
        if (i == 0 || pair->friction > 0) law->response = fmax(law->response, response);
    }
    law->friction = pair->friction;
    law->gain = 1, law->compliance = 0;
}

/* Contacts, and laws of theirs. False: there are too many, or there is no room. */
static __device__ bool make_contacts(const cuda_view &v, ncp_island *s, ncp_memory *memory, bool after,
                                     ncp_shared *shared)
{
    each(s->bodies, [&](int32_t t) {
        const int32_t slot = s->first_slot + t;
        int32_t points = 0;
        for (int32_t at = v.graph.offsets[slot]; at < v.graph.offsets[slot + 1]; ++at)
            if (speaks(v, v.graph.incident[at])) points += v.raw.pairs[v.graph.incident[at] / 2].count;
        shared->of[t] = points;
    });
    s->contacts = add_up(s->bodies, shared->of, shared->at, &shared->count);
    if (s->contacts > NCP_CONTACTS || s->contacts > v.ncp.points) return false;
    int32_t bounded = 0;
    for (int32_t r = 0; r < s->rows; ++r) bounded += s->row[r].role == NCP_BOUNDED;
    const size_t laws = (size_t)(s->contacts + bounded);
    s->contact = take<ncp_contact>(memory, (size_t)s->contacts);
    s->impulse = take<double>(memory, 3 * (size_t)s->contacts);
    s->kept = take<double>(memory, 3 * (size_t)s->contacts + (size_t)s->rows);
    s->law = take<ncp_law>(memory, laws);
    if (memory->full) return false;
    each(s->bodies, [&](int32_t t) {
        const int32_t slot = s->first_slot + t;
        int32_t k = shared->at[t];
        for (int32_t at = v.graph.offsets[slot]; at < v.graph.offsets[slot + 1]; ++at) {
            const int32_t code = v.graph.incident[at];
            if (!speaks(v, code)) continue;
            for (int32_t point = 0; point < v.raw.pairs[code / 2].count; ++point, ++k)
                s->contact[k].pair = code / 2, s->contact[k].point = point; /* of the pair, for now */
        }
    });
    __syncthreads();
    each(s->contacts, [&](int32_t k) {
        ncp_law *law = &s->law[k];
        make_contact(v, *s, s->contact[k].pair, s->contact[k].point, &s->contact[k], law, s->impulse + 3 * k, after);
        law->first = 3 * k, law->count = 3, law->of = k;
    });
    __syncthreads();
    return true;
}

#endif
