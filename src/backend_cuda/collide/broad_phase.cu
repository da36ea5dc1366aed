/* Candidates: from shapes and bodies to the pairs whose boxes overlap.
 *
 * The hierarchy is Karras' (Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees, HPG 2012) over
 * sorted keys, ties broken by position. An inner node i covers a range of leaves that begins or ends at i; the right
 * child of a node split after leaf r is numbered r + 1. The node after a subtree whose last leaf is r is therefore
 * either inner node r + 1 or leaf r + 1, and the keys around r say which: walks need no stack (the observation is
 * Prokopenko and Lebrun-Grandie's, Revising Apetrei's Bounding Volume Hierarchy Construction Algorithm to Allow
 * Stackless Traversal).
 */
#include "batch.h"
#include "collision/shapes/geometry.h"

/* ---- place ----------------------------------------------------------------------------------------------------- */

/* Two zero bits after each of the low 10. */
static __device__ uint32_t spread(uint32_t x)
{
    x = (x | x << 16) & 0x030000ffu;
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

static __device__ uint32_t morton(const struct collision_grid &layout, const double x[3])
{
    const double most = (double)((1 << MORTON_BITS) - 1);
    uint32_t code = 0;
    for (int k = 0; k < 3; ++k) {
        double cell = (x[k] - layout.origin[k]) * layout.scale;
        /* what is far away, and what is no number, goes to the edge */
        uint32_t at = cell > 0 ? (uint32_t)(cell < most ? cell : most) : 0;
        code |= spread(at) << k;
    }
    return code;
}

struct grid_sample {
    double samples[3][GRID_SAMPLES], bounds[2][3];
};

/* The grid covers three times what holds nine in ten of a sample of the movers: a body far away must not spoil it. One
 * block; a thread takes an axis of the body of its share of the slots and finds the rank by comparing with all. */
static __global__ void __launch_bounds__(3 * GRID_SAMPLES) grid_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    COLLISION_SHARED(grid_sample, shared);
    const int t = (int)threadIdx.x % GRID_SAMPLES, axis = (int)threadIdx.x / GRID_SAMPLES;
    const int32_t slot = (int32_t)((int64_t)v.body_count * t / GRID_SAMPLES);
    const bool stands = v.body_count <= t || v.bodies[slot].system_body < 0;
    const double here = stands ? HUGE_VAL : v.bodies[slot].position[axis]; /* sorts to the end */
    shared.samples[axis][t] = here;
    if (t < 2) shared.bounds[t][axis] = 0;
    __syncthreads();
    int rank = 0, count = 0;
    for (int other = 0; other < GRID_SAMPLES; ++other) {
        const double there = shared.samples[axis][other];
        count += there < HUGE_VAL;
        rank += there < here || (there == here && other < t);
    }
    if (!stands && rank == count / 20) shared.bounds[0][axis] = here;
    if (!stands && rank == count - 1 - count / 20) shared.bounds[1][axis] = here;
    __syncthreads();
    if (threadIdx.x > 0) return;
    double range = 0;
    for (int k = 0; k < 3; ++k) range = max_of(range, shared.bounds[1][k] - shared.bounds[0][k]);
    for (int k = 0; k < 3; ++k)
        v.grid->origin[k] = 0.5 * (shared.bounds[0][k] + shared.bounds[1][k]) - 1.5 * range;
    v.grid->scale = range > 0 && range < HUGE_VAL ? (double)(1 << MORTON_BITS) / (3 * range) : 0;
}

/* A shape's box without its sweep. */
static __device__ struct sadmm_box3 core_of(const struct sadmm_box3 &box, const double velocity[3], double dt)
{
    struct sadmm_box3 core;
    for (int k = 0; k < 3; ++k) {
        core.lo[k] = box.lo[k] - downward(velocity[k] * dt);
        core.hi[k] = box.hi[k] - upward(velocity[k] * dt);
    }
    return core;
}

/* How much larger a reach is than the box: a share of the radius; for what stops, or is set off as fast, what it goes
 * in the step, up to another share (beyond, the candidates of all that moves fast would be too many); and rotation. */
static const double REACH_SHARE = 0.1, MOST_STOP_SHARE = 0.25;

static __device__ double reach_beyond(const struct sadmm_proxy &proxy, double whole, int32_t substeps)
{
    const double radius = geometry_radius(&proxy.geometry), way = v3_norm(v3_load(proxy.velocity)) * whole,
                 most = MOST_STOP_SHARE * radius;
    if (!sadmm_body_moves(proxy.system_body)) return 0;
    return REACH_SHARE * radius + (way < most ? way : most) + (substeps - 1) * proxy.spin;
}

/* The reach, and the box that it sweeps in the whole step. box: of the sub-step. */
static __device__ struct sadmm_box3 make_reach(const collision_view &v, const struct sadmm_proxy &proxy,
                                               const struct sadmm_box3 &box, double dt, struct collision_reach *out)
{
    const double whole = dt * v.substeps, beyond = reach_beyond(proxy, whole, v.substeps);
    const struct sadmm_box3 core = core_of(box, proxy.velocity, dt);
    struct sadmm_box3 swept;
    for (int k = 0; k < 3; ++k) {
        out->box.lo[k] = core.lo[k] - beyond;
        out->box.hi[k] = core.hi[k] + beyond;
        out->velocity[k] = proxy.velocity[k];
        swept.lo[k] = out->box.lo[k] + downward(proxy.velocity[k] * whole);
        swept.hi[k] = out->box.hi[k] + upward(proxy.velocity[k] * whole);
    }
    return swept;
}

/* Of the reach: the rest is for rounding. */
static const double REACH_USED = 0.99;

/* Is the shape within its reach at both ends of this sub-step? Comparisons are written so that NaN fails them. */
static __device__ bool is_within(const struct collision_reach &reach, const struct sadmm_proxy &proxy,
                                 const struct sadmm_box3 &box, double dt, int32_t substep)
{
    const struct sadmm_box3 core = core_of(box, proxy.velocity, dt);
    bool within = true;
    for (int k = 0; k < 3; ++k) {
        const double spare = (1 - REACH_USED) * REACH_SHARE * geometry_radius(&proxy.geometry),
                     now = substep * dt * reach.velocity[k], then = (substep + 1) * dt * reach.velocity[k],
                     way = dt * proxy.velocity[k];
        within = within && reach.box.lo[k] + now + spare <= core.lo[k] && core.hi[k] <= reach.box.hi[k] + now - spare &&
                 reach.box.lo[k] + then + spare <= core.lo[k] + way &&
                 core.hi[k] + way <= reach.box.hi[k] + then - spare;
    }
    return within;
}

/* By which find of a step shapes are placed. */
enum place_for { PLACE_ONE, PLACE_FIRST, PLACE_AGAIN };

struct placed_pieces : warp_pieces<10> {}; /* COLLISION_SHARED takes the name of a struct */

/* A lane's record, by the lane or, where there are many, by the warp (nullptr: it has none). */
template <bool MANY, class T>
static __device__ __forceinline__ void store_placed(const T &from, T *to, placed_pieces *shared)
{
    if constexpr (MANY) store_of_warp(from, to, shared);
    else if (to) store_wide(from, to);
}

/* The first kernel of a find also resets the counter of the candidates. Lanes without a shape come along. */
template <int FOR, bool MANY>
static __global__ void __launch_bounds__(PLACE_THREADS) place_kernel(const __grid_constant__ collision_view v)
{
    static_assert(PLACE_THREADS == 32, "a block is a warp");
    pdl_wait_if(v.pdl);
    COLLISION_SHARED(placed_pieces, memory);
    placed_pieces *const shared = MANY ? &memory : nullptr;
    const int64_t i = collision_thread(PLACE_THREADS);
    const bool stops = aborted(v), is_there = i < v.leaf_count + v.plane_count, is_leaf = i < v.leaf_count;
    const struct collision_step all = step_of(v);
    const uint32_t slot = is_there ? v.present[i] : 0; /* at once, not after what comes next */
    if (stops) return;
    const struct collision_step step = step_of_shape(v, all, slot);
    if (i == 0 && FOR != PLACE_AGAIN) v.candidate_count[COUNT_FOUND] = v.candidate_count[COUNT_MESH_PAIRS] = 0;
    if (i == 0) v.candidate_count[COUNT_LISTED] = v.candidate_count[COUNT_GENERAL] = v.candidate_count[COUNT_FAST] = 0;
    struct sadmm_proxy proxy;
    struct collision_leaf leaf;
    bool moves = false;
    if (is_there) {
        const struct sadmm_shape &shape = v.shapes[slot];
        const struct sadmm_collision_body body = load_wide(&v.bodies[shape.body]);
        const struct proxy_turn turn = proxy_turn_of(&shape, &body, step.dt);
        moves = body.system_body >= 0;
        proxy_place(&shape, &v.geometries[shape.geometry], &body, &turn, step.dt, step.margin, step.gravity, &proxy,
                    &leaf.box);
        leaf.filter = {shape.category, shape.mask, shape.body,
                       geometry_rank(proxy.geometry.type) | (moves ? FILTER_MOVES : 0)};
        leaf.group_low = body.environment < 0 ? INT32_MIN : body.environment;
        leaf.group_high = body.environment < 0 ? INT32_MAX : body.environment;
    }
    store_placed<MANY>(proxy, is_there ? &v.proxies[slot] : nullptr, shared);
    if (FOR != PLACE_ONE) store_placed<MANY>(leaf.box, is_leaf ? &v.boxes[slot] : nullptr, shared);
    if (FOR == PLACE_AGAIN) {
        if (is_leaf && sadmm_body_moves(proxy.system_body) &&
            !is_within(v.reaches[slot], proxy, leaf.box, step.dt, v.substep))
            *v.abort_code = ABORT_REACH;
        return;
    }
    if (is_there && !is_leaf) v.filters[slot] = leaf.filter;

    if (is_leaf) {
        if (FOR == PLACE_FIRST) leaf.box = make_reach(v, proxy, leaf.box, step.dt, &v.reaches[slot]);
        for (int k = 0; k < 3; ++k) leaf.velocity[k] = proxy.velocity[k];
        leaf.thin = proxy.thin;
        leaf.slot = (int32_t)slot;
        leaf.subshapes = proxy.geometry.subshapes;
    }
    store_placed<MANY>(leaf, is_leaf ? &v.placed[i] : nullptr, shared);
    if (!v.leaf_keys || !is_leaf) return;

    const uint64_t group = leaf.group_low < 0 ? 0 : (uint64_t)leaf.group_low;
    uint64_t key = geometry_radius(&proxy.geometry) >= v.large ? LEAF_LARGE : 0;
    if (!moves) key = LEAF_STATIC;
    v.leaf_keys[i] = (key << v.group_bits | group) << 3 * MORTON_BITS | morton(*v.grid, proxy.x);
    v.leaf_numbers[i] = (uint32_t)i;
}

/* ---- tree ------------------------------------------------------------------------------------------------------ */

/* Length of the prefix that leaves i and j have in common, positions included; -1 when j is none. */
static __device__ __forceinline__ int common(const collision_view &v, int32_t i, int32_t j)
{
    if (j < 0 || j >= v.leaf_count) return -1;
    uint64_t difference = v.leaf_keys[i] ^ v.leaf_keys[j];
    return difference ? leading_zeros(difference) : 64 + leading_zeros((uint64_t)(uint32_t)(i ^ j));
}

/* The node after a subtree whose last leaf is r. */
static __device__ __forceinline__ int32_t node_after(const collision_view &v, int32_t r)
{
    const int32_t first_leaf = v.leaf_count - 1;
    if (r == v.leaf_count - 1) return -1;
    return common(v, r + 1, r + 2) > common(v, r, r + 1) ? r + 1 : first_leaf + r + 1;
}

static __global__ void __launch_bounds__(TREE_THREADS) build_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    const int64_t thread = collision_thread(TREE_THREADS);
    if (thread >= v.leaf_count) return;
    const int32_t i = (int32_t)thread, first_leaf = v.leaf_count - 1;

    const int32_t number = (int32_t)v.leaf_numbers[i];
    const struct collision_leaf &leaf = v.placed[number];
    struct collision_node node;
    for (int k = 0; k < 3; ++k) {
        node.lo[k] = round_down(leaf.box.lo[k]);
        node.hi[k] = round_up(leaf.box.hi[k]);
    }
    node.child = number;
    node.next = node_after(v, i);
    v.nodes[first_leaf + i] = node;
    v.groups[first_leaf + i] = {leaf.group_low, leaf.group_high};
    if (i == 0) v.parents[0] = -1;
    if (i >= first_leaf) return;

    /* the range: from i towards the neighbour with more in common, as far as more is shared than with the other one */
    const int32_t d = common(v, i, i + 1) > common(v, i, i - 1) ? 1 : -1;
    const int least = common(v, i, i - d);
    int32_t reach = 2, length = 0;
    while (common(v, i, i + reach * d) > least) reach *= 2;
    for (int32_t step = reach / 2; step > 0; step /= 2)
        if (common(v, i, i + (length + step) * d) > least) length += step;
    const int32_t j = i + length * d, low = i < j ? i : j, high = i < j ? j : i;

    /* the split: the last leaf that shares more with the first one than the whole range does */
    const int shared = common(v, low, high);
    int32_t split = 0, span = high - low;
    for (int32_t step = span; step > 1;) {
        step = (step + 1) / 2;
        if (split + step < span && common(v, low, low + split + step) > shared) split += step;
    }
    split += low;
    const int32_t left = split == low ? first_leaf + split : split;
    const int32_t right = split + 1 == high ? first_leaf + split + 1 : split + 1;
    v.nodes[i].child = left;
    v.nodes[i].next = node_after(v, high);
    v.parents[left] = i;
    v.parents[right] = i;
    v.arrivals[i] = 0;
}

/* What the build has left of an inner node, and stays: fetched a level ahead. */
struct refit_links {
    int32_t left, next, parent;
};
static __device__ __forceinline__ refit_links links_of(const collision_view &v, int32_t at)
{
    const int32_t node = at >= 0 ? at : 0;
    const refit_links links = {v.nodes[node].child, v.nodes[node].next, v.parents[node]};
    return links;
}

/* Boxes from the leaves up: of two children the one that arrives last goes on. Smallest and largest do not depend on
 * the order. A node's right child is the node after its left one. */
static __global__ void __launch_bounds__(TREE_THREADS) refit_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    const int64_t thread = collision_thread(TREE_THREADS);
    if (thread >= v.leaf_count) return;
    int32_t from = v.leaf_count - 1 + (int32_t)thread, at = v.parents[from];
    struct collision_node own = v.nodes[from];
    struct collision_groups groups = v.groups[from];
    struct refit_links links = links_of(v, at);
    while (at >= 0) {
        struct collision_node *node = &v.nodes[at];
        if (arrive(&v.arrivals[at]) == 0) return;
        const int32_t other = from == links.left ? own.next : links.left, above = links.parent;
        const struct collision_node sibling = v.nodes[other];
        own.next = links.next;
        links = links_of(v, above);
        for (int k = 0; k < 3; ++k) {
            node->lo[k] = own.lo[k] = fminf(own.lo[k], sibling.lo[k]);
            node->hi[k] = own.hi[k] = fmaxf(own.hi[k], sibling.hi[k]);
        }
        if (v.group_bits > 0) {
            const struct collision_groups b = v.groups[other];
            groups = {groups.low < b.low ? groups.low : b.low, groups.high > b.high ? groups.high : b.high};
            v.groups[at] = groups;
        }
        from = at;
        at = above;
    }
}

/* ---- pairs ----------------------------------------------------------------------------------------------------- */

/* What a radix sort of the whole capacity needs. */
static __global__ void __launch_bounds__(COLLISION_THREADS) clear_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    const int64_t i = collision_thread(COLLISION_THREADS);
    if (i < v.candidate_capacity) v.found[i] = ~UINT64_C(0);
}

/* Tests of pairs are without branches: each would wait for its own load. */

static __device__ __forceinline__ bool filters_meet(const collision_filter &a, const collision_filter &b)
{
    return (a.body != b.body) & ((a.category & b.mask) != 0) & ((b.category & a.mask) != 0) &
           (((a.kind | b.kind) & FILTER_MOVES) != 0);
}

static __device__ __forceinline__ bool is_enabled(const collision_view &v, const collision_filter &a,
                                                  const collision_filter &b)
{
    return v.disabled_count == 0 ||
           find_key(v.disabled_pairs, v.disabled_count, unordered_key((uint32_t)a.body, (uint32_t)b.body)) < 0;
}

/* boxes_overlap, and the groups. */
static __device__ __forceinline__ bool leaves_overlap(const struct collision_leaf &a, const struct collision_leaf &b)
{
    bool overlap = (a.group_low <= b.group_high) & (b.group_low <= a.group_high);
    for (int k = 0; k < 3; ++k) overlap = overlap & (a.box.lo[k] <= b.box.hi[k]) & (b.box.lo[k] <= a.box.hi[k]);
    return overlap;
}

/* Of leaves that overlap: boxes_meet, and what else keeps two shapes apart. */
static __device__ __forceinline__ bool leaves_meet(const collision_view &v, const struct collision_leaf &a,
                                                   const struct collision_leaf &b, double dt)
{
    bool meet = filters_meet(a.filter, b.filter);
    for (int k = 0; k < 3; ++k)
        meet = meet & (intervals_meet(a.box.lo[k], a.box.hi[k], b.box.lo[k], b.box.hi[k], a.velocity[k] * dt,
                                      b.velocity[k] * dt) != 0);
    return meet && is_enabled(v, a.filter, b.filter);
}

/* The first candidate of two shapes: the one of the lower (rank, slot) is a. */
static __device__ __forceinline__ uint64_t candidate_key(const collision_view &v, const struct collision_leaf &a,
                                                         const struct collision_leaf &b)
{
    const int rank_a = a.filter.kind & FILTER_RANK, rank_b = b.filter.kind & FILTER_RANK;
    const uint32_t slot_a = (uint32_t)a.slot, slot_b = (uint32_t)b.slot;
    const bool ordered = rank_a < rank_b || (rank_a == rank_b && slot_a < slot_b);
    return first_candidate(v, ordered ? slot_a : slot_b, ordered ? slot_b : slot_a);
}

/* A pair whose candidates are the triangles of a mesh. */
static __device__ __forceinline__ void list_mesh_pair(const collision_view &v, uint64_t first)
{
    const unsigned long long at = reserve(v.candidate_count + COUNT_MESH_PAIRS, 1);
    if (at < (unsigned)v.candidate_capacity) v.mesh_pairs[at] = first;
}

/* The candidates of a pair; count: candidates_of. */
static __device__ __forceinline__ void add_pair(const collision_view &v, struct batch *out, uint64_t first,
                                                uint32_t count)
{
    if (count > 0) add(v, out, first, count);
    else list_mesh_pair(v, first);
}

/* A part of what a pair with a plane reaches (proxy_plane_reach). */
static __device__ __forceinline__ double leaf_plane_reach(const struct collision_leaf &leaf,
                                                          const struct collision_step &step)
{
    return shape_reach(step.margin, leaf.thin, 0, fall_of(step.gravity, step.dt));
}

/* By itself: worlds that are no environments should not pay in registers. */
static __device__ __noinline__ double own_plane_reach(const collision_view &v, const struct collision_step &step,
                                                      const struct collision_leaf &leaf)
{
    return leaf_plane_reach(leaf, step_of_shape(v, step, (uint32_t)leaf.slot));
}

/* The planes that a mover meets: those of every group, and those of its own. */
static __device__ void add_planes(const collision_view &v, const struct collision_step &step, struct batch *out,
                                  const struct collision_leaf &leaf)
{
    const uint32_t slot = (uint32_t)leaf.slot;
    if (v.plane_count == 0 || !(leaf.filter.kind & FILTER_MOVES)) return;
    const double reach = v.gravities.of ? own_plane_reach(v, step, leaf) : leaf_plane_reach(leaf, step);
    const bool grouped = v.shared_planes < v.plane_count && leaf.group_low == leaf.group_high;
    for (int pass = 0; pass < (grouped ? 2 : 1); ++pass) {
        const uint64_t group = pass == 0 ? 0 : (uint64_t)leaf.group_low + 1;
        int64_t i = pass == 0 ? 0 : lower_bound(v.planes, v.plane_count, group << 32);
        for (; i < v.plane_count && v.planes[i] >> 32 == group; ++i) {
            const uint32_t plane = (uint32_t)v.planes[i];
            const struct sadmm_proxy &proxy = v.proxies[plane];
            const struct collision_filter filter = v.filters[plane];
            const bool near = proxy_plane_meets(&proxy, &leaf.box, reach);
            if ((filters_meet(filter, leaf.filter) & near) && is_enabled(v, filter, leaf.filter))
                add(v, out, first_candidate(v, plane, slot),
                    candidates_of(v, proxy.geometry.subshapes, leaf.subshapes));
        }
    }
}

static __device__ __forceinline__ bool nodes_meet(const struct collision_node &a, const struct collision_node &b)
{
    return (a.lo[0] <= b.hi[0]) & (b.lo[0] <= a.hi[0]) & (a.lo[1] <= b.hi[1]) & (b.lo[1] <= a.hi[1]) &
           (a.lo[2] <= b.hi[2]) & (b.lo[2] <= a.hi[2]);
}

/* Leaves that the walk of a thread has come to. They are tested together: while one lane of a warp tests, the others
 * wait, and they come to leaves at different times. */
enum { WALK_LEAVES = 24 };
struct walk_leaves {
    int32_t numbers[WALK_LEAVES][TREE_THREADS];
};

static __device__ __forceinline__ void test_pair(const collision_view &v, const struct collision_leaf &leaf,
                                                 const struct collision_leaf &other, double dt, struct batch *out)
{
    if (leaves_overlap(leaf, other) & leaves_meet(v, leaf, other, dt))
        add_pair(v, out, candidate_key(v, leaf, other), candidates_of(v, leaf.subshapes, other.subshapes));
}

/* The first `count` leaves of this thread's list; the next one is fetched while one is tested. */
static __device__ void test_leaves(const collision_view &v, const struct collision_leaf &leaf, double dt,
                                   const struct walk_leaves &list, int count, struct batch *out)
{
    struct collision_leaf next = v.placed[count > 0 ? list.numbers[0][threadIdx.x] : 0];
    for (int k = 0; k < count; ++k) {
        const struct collision_leaf other = next;
        if (k + 1 < count) next = v.placed[list.numbers[k + 1][threadIdx.x]];
        test_pair(v, leaf, other, dt, out);
    }
}

/* One leaf against the planes and the later leaves of the tree. Static leaves come last and do not meet each other. */
static __device__ void walk(const collision_view &v, int32_t i, struct walk_leaves *list, struct batch *out)
{
    const int32_t first_leaf = v.leaf_count - 1;
    const struct collision_step step = step_of(v);
    const struct collision_node start = v.nodes[first_leaf + i];
    const struct collision_leaf leaf = v.placed[start.child];
    const double dt = time_of_candidates(v, step);
    const bool grouped = v.group_bits > 0;
    int count = 0;
    if (!(leaf.filter.kind & FILTER_MOVES)) return;
    add_planes(v, step, out, leaf);
    for (int32_t at = start.next; at >= 0;) {
        const struct collision_node node = v.nodes[at];
        bool meet = nodes_meet(start, node);
        count_visit();
        if (grouped) {
            const struct collision_groups groups = v.groups[at];
            meet = meet & (leaf.group_low <= groups.high) & (groups.low <= leaf.group_high);
        }
        if (meet && at >= first_leaf) {
            list->numbers[count++][threadIdx.x] = node.child;
            if (count == WALK_LEAVES) {
                test_leaves(v, leaf, dt, *list, count, out);
                count = 0;
            }
        }
        at = meet && at < first_leaf ? node.child : node.next;
    }
    test_leaves(v, leaf, dt, *list, count, out);
}

static __global__ void __launch_bounds__(TREE_THREADS) walk_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    COLLISION_SHARED(walk_leaves, shared);
    const int64_t thread = collision_thread(TREE_THREADS);
    struct batch out;
    if (aborted(v)) return;
    out.count = 0;
    if (thread < v.leaf_count) walk(v, (int32_t)thread, &shared, &out);
    finish_batches(v, out);
}

/* Where groups are small: a leaf against the planes, the later leaves of its group, and those of every group. */
static __device__ void find_in_group(const collision_view &v, int32_t at, struct batch *out)
{
    const struct collision_step step = step_of(v);
    const double dt = time_of_candidates(v, step);
    const uint64_t own = v.grouped[at];
    const struct collision_leaf leaf = v.placed[(uint32_t)own];
    const int32_t first_shared = v.leaf_count - v.shared_leaves;
    add_planes(v, step, out, leaf);
    for (int32_t next = at + 1; next < v.leaf_count;) {
        const uint64_t number = v.grouped[next];
        if (next < first_shared && number >> 32 != own >> 32) {
            next = first_shared;
            continue;
        }
        test_pair(v, leaf, v.placed[(uint32_t)number], dt, out);
        ++next;
    }
}

static __global__ void __launch_bounds__(TREE_THREADS) groups_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    const int64_t thread = collision_thread(TREE_THREADS);
    struct batch out;
    if (aborted(v)) return;
    out.count = 0;
    if (thread < v.leaf_count) find_in_group(v, (int32_t)thread, &out);
    finish_batches(v, out);
}

/* All pairs, in tiles: ROWS leaves, one a thread, against COLUMNS others, which lie in shared memory; later ones only.
 * A row's first block has the planes instead. */
template <int COLUMNS> struct tile {
    struct collision_leaf leaves[COLUMNS];
};

/* The row's candidates with planes. */
static __device__ void tile_of_planes(const collision_view &v, const struct collision_step &step,
                                      const struct collision_leaf &leaf, bool is_there)
{
    struct batch out;
    out.count = 0;
    if (is_there) add_planes(v, step, &out, leaf);
    finish_batches(v, out);
}

/* Bits [begin, end) of 64. */
static __device__ __forceinline__ uint64_t bits_between(int32_t begin, int32_t end)
{
    const uint64_t all = ~UINT64_C(0), from = begin < 64 ? all << begin : 0, to = end < 64 ? all << end : 0;
    return from & ~to;
}

/* Which of the others meet leaf i, a bit each: of numbers from `first` on, `count` of them. The loop goes over all that
 * there is place for, so that it unrolls. */
template <int COLUMNS>
static __device__ __forceinline__ uint64_t hits_of(const collision_view &v, const struct collision_step &step,
                                                   const struct collision_leaf &leaf, int32_t i, int32_t first,
                                                   int32_t count, const struct collision_leaf *others)
{
    const double dt = time_of_candidates(v, step);
    uint64_t hits = 0;
    for (int j = 0; j < COLUMNS; ++j) hits |= (uint64_t)leaves_overlap(leaf, others[j]) << j;
    hits &= bits_between(i >= first ? i - first + 1 : 0, count);
    for (uint64_t left = hits; left; left &= left - 1)
        if (!leaves_meet(v, leaf, others[trailing_zeros(left)], dt)) hits ^= left & (0 - left);
    return hits;
}

/* The candidates of a leaf's hits. All threads of a warp together. */
static __device__ __forceinline__ void write_hits(const collision_view &v, const struct collision_leaf &leaf,
                                                  uint64_t hits, const struct collision_leaf *others)
{
    unsigned total = (unsigned)bits_set(hits);
    if (v.subshape_bits > 0) {
        total = 0;
        for (uint64_t left = hits; left; left &= left - 1)
            total += candidates_of(v, leaf.subshapes, others[trailing_zeros(left)].subshapes);
    }
    unsigned long long at = reserve_by_warp(v.candidate_count, total);
    for (; hits; hits &= hits - 1) {
        const struct collision_leaf &other = others[trailing_zeros(hits)];
        const uint32_t count = candidates_of(v, leaf.subshapes, other.subshapes);
        const uint64_t first = candidate_key(v, leaf, other);
        for (uint32_t subshape = 0; subshape < count; ++subshape) store_candidate(v, at++, first + subshape);
        if (count == 0) list_mesh_pair(v, first);
    }
}

template <int ROWS, int COLUMNS>
static __global__ void __launch_bounds__(ROWS) tiles_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_if(v.pdl);
    COLLISION_SHARED(tile<COLUMNS>, shared);
    const int32_t t = (int32_t)threadIdx.x, columns = tile_columns(v.leaf_count, COLUMNS);
    const int32_t row = (int32_t)blockIdx.x / columns, column = (int32_t)blockIdx.x % columns - 1;
    const int32_t i = row * ROWS + t, first = column * COLUMNS;
    const int32_t count = v.leaf_count - first < COLUMNS ? v.leaf_count - first : COLUMNS;
    struct collision_leaf leaf;
    if (column >= 0 && first + COLUMNS - 1 <= row * ROWS) return;
    /* all at once: no part waits for another */
    const bool stops = aborted(v);
    const struct collision_step step = step_of(v);
    if (i < v.leaf_count) leaf = v.placed[i];
    if (column >= 0 && t < count) shared.leaves[t] = v.placed[first + t];
    if (stops) return;
    if (column < 0) {
        tile_of_planes(v, step, leaf, i < v.leaf_count);
        return;
    }
    __syncthreads();
    const uint64_t hits = i < v.leaf_count ? hits_of<COLUMNS>(v, step, leaf, i, first, count, shared.leaves) : 0;
    write_hits(v, leaf, hits, shared.leaves);
}

void COLLISION(broad_phase_kernels)(struct collision_kernels *kernels)
{
    kernels->grid = {grid_kernel, 3 * GRID_SAMPLES, sizeof(struct grid_sample), "grid of the tree"};
    const auto placing = [](void (*kernel)(const collision_view)) -> collision_launch {
        return {kernel, PLACE_THREADS, sizeof(placed_pieces), "placing of the shapes"};
    };
    kernels->place[0] = placing(place_kernel<PLACE_ONE, false>);
    kernels->place_first[0] = placing(place_kernel<PLACE_FIRST, false>);
    kernels->place_again[0] = placing(place_kernel<PLACE_AGAIN, false>);
    kernels->place[1] = placing(place_kernel<PLACE_ONE, true>);
    kernels->place_first[1] = placing(place_kernel<PLACE_FIRST, true>);
    kernels->place_again[1] = placing(place_kernel<PLACE_AGAIN, true>);
    kernels->build = {build_kernel, TREE_THREADS, 0, "build of the tree"};
    kernels->refit = {refit_kernel, TREE_THREADS, 0, "boxes of the tree"};
    kernels->clear = {clear_kernel, COLLISION_THREADS, 0, "reset of the candidates"};
    kernels->walk = {walk_kernel, TREE_THREADS, sizeof(struct walk_leaves), "candidates by the tree"};
    kernels->groups = {groups_kernel, TREE_THREADS, 0, "candidates of environments"};
    kernels->tiles = {tiles_kernel<TILE_ROWS, TILE_COLUMNS>, TILE_ROWS, sizeof(struct tile<TILE_COLUMNS>),
                      "candidates of all pairs"};
    kernels->small_tiles = {tiles_kernel<SMALL_TILE_ROWS, SMALL_TILE_COLUMNS>, SMALL_TILE_ROWS,
                            sizeof(struct tile<SMALL_TILE_COLUMNS>), "candidates of all pairs"};
}
