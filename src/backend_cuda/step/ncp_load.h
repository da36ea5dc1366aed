/* An island as the step has it (ncp_island.h): nodes of its bodies, rows of their joints, contacts. */
#ifndef SADMM_CUDA_STEP_NCP_LOAD_H
#define SADMM_CUDA_STEP_NCP_LOAD_H

#include "core/model/articulation.h"
#include "move.h"
#include "ncp_tree.h"

/* Nodes of a part's trees. right: becomes false where they are not all of this island. */
static __device__ __noinline__ void make_tree(const cuda_view &v, const ncp_island &s, int32_t part, int32_t base,
                                              bool *right)
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

/* Nodes by level. False: there is no room. */
static __device__ __noinline__ bool order_nodes(ncp_island *s, int32_t levels, ncp_memory *memory)
{
    int32_t *const order = take<int32_t>(memory, (size_t)s->bodies),
                   *const level_first = take<int32_t>(memory, (size_t)levels + 1);
    if (memory->full) return false;
    put(s->order, order);
    put(s->level_first, level_first);
    put(s->levels, levels);
    each(s->bodies, [&](int32_t n) {
        const int32_t level = s->node[n].level;
        int32_t before = 0;
        for (int32_t k = 0; k < s->bodies; ++k) {
            const int32_t other = s->node[k].level;
            before += other < level || (other == level && k < n);
        }
        order[before] = n;
    });
    each(levels + 1, [&](int32_t level) {
        int32_t before = 0;
        for (int32_t k = 0; k < s->bodies; ++k) before += s->node[k].level < level;
        level_first[level] = before;
    });
    ncp_barrier();
    return true;
}

/* Nodes of its bodies, but for what joints say. False: a part is no tree. */
static __device__ __noinline__ bool make_nodes(const cuda_view &v, ncp_island *s, ncp_memory *memory,
                                               ncp_shared *shared)
{
    bool right = true;
    int32_t *const of = take<int32_t>(memory, (size_t)s->bodies), *const at = take<int32_t>(memory, (size_t)s->bodies);
    ncp_node *const node = take<ncp_node>(memory, (size_t)s->bodies);
    if (memory->full) return false;
    put(s->of, of);
    put(s->at, at);
    put(s->node, node);
    put(shared->parts, 0);
    ncp_barrier();
    each(s->bodies, [&](int32_t t) {
        const int32_t body = v.graph.body_of[s->first_slot + t], part = v.ncp.part_of[body];
        const bool is_first = part < 0 || v.joints.parts[part].label - 1 == body;
        of[t] = !is_first ? 0 : part < 0 ? 1 : v.ncp.parts[part].nodes;
        if (part >= 0 && v.ncp.parts[part].nodes == 0) right = false;
        if (part >= 0 && is_first) atomicAdd(&shared->parts, 1);
    });
    if (any_of(!right, shared) || shared->parts > NCP_PARTS) return false;
    if (add_up(s->bodies, of, at, &shared->count) != s->bodies) return false;
    int32_t parts = 0, levels = 1;
#pragma unroll 1
    for (int32_t t = 0; t < s->bodies; ++t) {
        if (of[t] == 0) continue;
        const int32_t body = v.graph.body_of[s->first_slot + t], part = v.ncp.part_of[body], base = at[t];
        if (part >= 0) {
            const int32_t own = v.ncp.parts[part].levels;
            levels = own > levels ? own : levels;
            if (ncp_thread() == 0) shared->part[parts] = part;
            ++parts;
            make_tree(v, *s, part, base, &right);
        } else if (ncp_thread() == 0) {
            ncp_node *node = &s->node[base];
            node->body = body;
            node->parent = node->child = node->sibling = -1;
            node->first_joint = node->joints = node->level = 0;
        }
    }
    ncp_barrier();
    each(s->bodies, [&](int32_t n) {
        ncp_node *node = &s->node[n];
        v.ncp.number[node->body] = n;
        node->own = v.joints.bodies[node->body];
        node->bound = 0;
        for (int32_t j = node->first_joint; j < node->first_joint + node->joints; ++j) {
            const int32_t code = v.ncp.joints[j];
            const struct sadmm_row_constraint *constraint = &v.raw.constraints[code / 2];
            if (constraint->count == 0) continue;
            if (!constraint->rigid) right = false;
            node->bound = 1;
            for (int k = 0; k < 3; ++k) node->offset[k] = code % 2 ? constraint->offset[k] : -constraint->offset[k];
        }
    });
    if (any_of(!right, shared)) return false;
    return order_nodes(s, levels, memory);
}

static __device__ __forceinline__ int32_t role_of(const struct raw_row &law, bool of_joint)
{
    const bool bounded = law.lo > -INFINITY || law.hi < INFINITY;
    return of_joint && sadmm_law_is_coupled(law.compliance, law.lo, law.hi) ? NCP_LOCK
           : law.gain == 0 || !(law.hi > law.lo)                            ? NCP_FIXED
           : of_joint && !bounded && law.compliance > 0                     ? NCP_SOFT
                                                                            : NCP_BOUNDED;
}

/* What a row says, but for what follows from directions. */
static __device__ __noinline__ void load_row(const cuda_view &v, const ncp_island &s, ncp_row *row, bool after)
{
    const struct raw_row &law = v.raw.rows[row->slot];
    const double start = after ? (double)v.rows.data[row->slot].lambda : v.model.warm_start ? law.lambda : 0;
    double response[2] = {0, 0};
    for (int k = 0; k < 6; ++k) row->jacobian[k] = law.jacobian[row->side][k];
    row->gain = law.gain, row->bias = law.bias, row->compliance = law.compliance;
    row->lo = law.lo, row->hi = law.hi;
    row->number = -1;
    row->role = role_of(law, row->node >= 0);
    row->lambda = articulation_clamp(row->role == NCP_FIXED && law.compliance > 0 ? -law.bias / law.compliance : start,
                                     law.lo, law.hi);
    if (row->role == NCP_SOFT) return;
    for (int side = 0; side < 2; ++side) {
        const int32_t n = side_of_gear(v, row->slot, side);
        if (n >= 0) response[side] = own_response(s.node[n].own, law.jacobian[side]);
    }
    row->response = law.gain * articulation_scale_of(response[0], response[1]) + law.compliance;
    if (row->role == NCP_BOUNDED && !(row->response > 0)) row->role = NCP_FIXED;
}

/* Calls f(slot, side, role, which) for the rows of a node's joints, each by one of its eight lanes. which: of a lock,
 * how many locks come before it; of another row, how many others. *locks, *others: all of them. live: there is such a
 * node. Every lane of the warp comes here. */
template <class F>
static __device__ __forceinline__ void each_joint_row(const cuda_view &v, const ncp_node &node, int lane, bool live,
                                                      int32_t *locks, int32_t *others, const F &f)
{
    const int shift = ncp_thread() % WARP / LANES * LANES;
    const unsigned lanes = (1u << LANES) - 1, before = (1u << lane) - 1;
    int32_t j = node.first_joint;
    *locks = *others = 0;
    while (__ballot_sync((unsigned)ALL_LANES, live && j < node.first_joint + node.joints) != 0) {
        const bool more = live && j < node.first_joint + node.joints;
        const int32_t code = v.ncp.joints[more ? j : 0], slot = code / 2 * SADMM_MAX_ROWS + lane;
        const bool is = more && lane < v.raw.constraints[code / 2].count;
        const int32_t role = is ? role_of(v.raw.rows[slot], true) : -1;
        const unsigned lock = __ballot_sync((unsigned)ALL_LANES, role == NCP_LOCK) >> shift & lanes,
                       other = __ballot_sync((unsigned)ALL_LANES, is && role != NCP_LOCK) >> shift & lanes;
        const int32_t locks_before = *locks + __popc(lock & before), others_before = *others + __popc(other & before);
        if (is) f(slot, code % 2, role, role == NCP_LOCK ? locks_before : others_before);
        *locks += __popc(lock);
        *others += __popc(other);
        j += more;
    }
}

/* Locks of a node's joints, to M and `held`; how many other rows there are. False: too many. */
static __device__ __noinline__ bool load_locks(const cuda_view &v, ncp_node *node, int lane, bool live)
{
    int32_t locks, others;
    each_joint_row(v, *node, lane, live, &locks, &others, [&](int32_t slot, int side, int32_t role, int32_t which) {
        const struct raw_row &law = v.raw.rows[slot];
        if (role != NCP_LOCK || which >= 6) return;
        for (int k = 0; k < 6; ++k) node->M[6 * which + k] = law.jacobian[side][k];
        node->held[which] = -law.bias / law.gain;
        node->lock[which] = 2 * slot + side;
    });
    if (live && lane == 0) node->rows = others, node->locks[0] = locks;
    return locks <= 6;
}

/* The other ones. */
static __device__ __noinline__ void load_rows(const cuda_view &v, const ncp_island &s, int32_t n, int lane, bool live,
                                              bool after)
{
    int32_t locks, others;
    each_joint_row(v, s.node[n], lane, live, &locks, &others,
                   [&](int32_t slot, int side, int32_t role, int32_t which) {
                       if (role == NCP_LOCK) return;
                       ncp_row *row = &s.row[s.node[n].first_row + which];
                       row->slot = slot, row->side = side, row->node = n;
                       load_row(v, s, row, after);
                   });
}

/* Rows of the gears of the island's parts; returns how many. */
static __device__ __noinline__ int32_t list_gears(const cuda_view &v, const ncp_shared *shared, ncp_row *rows)
{
    int32_t count = 0;
    for (int32_t k = 0; k < shared->parts; ++k) {
        const struct cuda_ncp_part plan = v.ncp.parts[shared->part[k]];
        for (int32_t g = plan.first_gear; g < plan.first_gear + plan.gears; ++g) {
            const int32_t constraint = v.ncp.joints[g];
            for (int32_t r = 0; r < v.raw.constraints[constraint].count; ++r, ++count) {
                if (!rows || ncp_thread() > 0) continue;
                rows[count].slot = constraint * SADMM_MAX_ROWS + r;
                rows[count].node = -1;
                rows[count].side = rows[count].along = 0;
            }
        }
    }
    return count;
}

/* Rows, and directions that locks leave. False: there is no room, or locks are not those of one joint. */
static __device__ __noinline__ bool make_rows(const cuda_view &v, ncp_island *s, ncp_memory *memory, bool after,
                                              ncp_shared *shared)
{
    bool right = true;
    each_eight(s->bodies, [&](int32_t n, int lane) {
        right = load_locks(v, &s->node[n < 0 ? 0 : n], lane, n >= 0) && right;
    });
    if (any_of(!right, shared)) return false;
    each(s->bodies, [&](int32_t n) {
        ncp_node *node = &s->node[n];
        right = sort_locks(node, node->locks[0]) && right;
        s->of[n] = node->rows;
    });
    if (any_of(!right, shared)) return false;
    const int32_t first_gear = add_up(s->bodies, s->of, s->at, &shared->count);
    each(s->bodies, [&](int32_t n) {
        ncp_node *node = &s->node[n];
        node->first_row = s->at[n];
        s->of[n] = node->free * (13 + 2 * node->free + node->rows);
    });
    const int32_t pool = add_up(s->bodies, s->of, s->at, &shared->count);
    const int32_t rows = first_gear + list_gears(v, shared, nullptr);
    ncp_row *const row = take_large<ncp_row>(memory, (size_t)rows);
    int32_t *const bounded_row = take_large<int32_t>(memory, (size_t)rows);
    double *const numbers = take<double>(memory, (size_t)pool);
    if (memory->full) return false;
    put(s->first_gear, first_gear);
    put(s->rows, rows);
    put(s->row, row);
    put(s->bounded_row, bounded_row);
    put(s->pool, numbers);
    (void)list_gears(v, shared, row + first_gear);
    ncp_barrier();
    each_eight(s->bodies, [&](int32_t n, int lane) { load_rows(v, *s, n < 0 ? 0 : n, lane, n >= 0, after); });
    ncp_barrier();
    each(rows - first_gear, [&](int32_t r) { load_row(v, *s, &row[first_gear + r], after); });
    each(s->bodies, [&](int32_t n) {
        ncp_node *node = &s->node[n];
        int32_t at = s->at[n];
        node->pool = at;
        node->loads = 0;
        find_directions(*s, *node);
        meet_locks(node);
        at += node->free * (13 + 2 * node->free);
        for (int32_t r = node->first_row; r < node->first_row + node->rows; ++r, at += node->free) {
            row[r].along = at;
            node->loads += row[r].role != NCP_SOFT;
        }
    });
    ncp_barrier();
    each(first_gear, [&](int32_t r) {
        const ncp_node &node = s->node[row[r].node];
        for (int i = 0; i < node.free; ++i)
            numbers[row[r].along + i] = six_product(row[r].jacobian, directions_of(*s, node) + 6 * i);
    });
    ncp_barrier();
    put(s->bounded,
        make_list(rows, bounded_row, &shared->count, [&](int32_t r) { return row[r].role == NCP_BOUNDED; }));
    return true;
}

/* Does this side of a pair speak for it? */
static __device__ __forceinline__ bool speaks(const cuda_view &v, int32_t code)
{
    return code / 2 < v.contacts.pair_capacity && (code % 2 == 0 || v.raw.pairs[code / 2].body_a < 0);
}

static __device__ __noinline__ void make_contact(const cuda_view &v, const ncp_island &s, int32_t pair_at, int32_t k,
                                                 ncp_contact *c, ncp_law *law, double impulse[3], bool after)
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
static __device__ __noinline__ bool make_contacts(const cuda_view &v, ncp_island *s, ncp_memory *memory, bool after,
                                                  ncp_shared *shared)
{
    each(s->bodies, [&](int32_t t) {
        const int32_t slot = s->first_slot + t;
        int32_t points = 0;
        for (int32_t at = v.graph.offsets[slot]; at < v.graph.offsets[slot + 1]; ++at)
            if (speaks(v, v.graph.incident[at])) points += v.raw.pairs[v.graph.incident[at] / 2].count;
        s->of[t] = points;
    });
    const int32_t contacts = add_up(s->bodies, s->of, s->at, &shared->count);
    if (contacts > NCP_CONTACTS || contacts > v.ncp.points) return false;
    ncp_contact *const contact = take<ncp_contact>(memory, (size_t)contacts);
    double *const impulse = take<double>(memory, 3 * (size_t)contacts),
                  *const kept = take<double>(memory, 3 * (size_t)contacts + (size_t)s->rows);
    ncp_law *const laws = take<ncp_law>(memory, (size_t)(contacts + s->bounded));
    if (memory->full) return false;
    put(s->contacts, contacts);
    put(s->contact, contact);
    put(s->impulse, impulse);
    put(s->kept, kept);
    put(s->law, laws);
    each(s->bodies, [&](int32_t t) {
        const int32_t slot = s->first_slot + t;
        int32_t k = s->at[t];
        for (int32_t at = v.graph.offsets[slot]; at < v.graph.offsets[slot + 1]; ++at) {
            const int32_t code = v.graph.incident[at];
            if (!speaks(v, code)) continue;
            for (int32_t point = 0; point < v.raw.pairs[code / 2].count; ++point, ++k)
                contact[k].pair = code / 2, contact[k].point = point; /* of the pair, for now */
        }
    });
    ncp_barrier();
    each(contacts, [&](int32_t k) {
        ncp_law *law = &laws[k];
        make_contact(v, *s, contact[k].pair, contact[k].point, &contact[k], law, impulse + 3 * k, after);
        law->first = 3 * k, law->count = 3, law->of = k;
    });
    ncp_barrier();
    return true;
}

#endif
