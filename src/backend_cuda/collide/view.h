/* Contact finding on the device: the kernels' view, the pipeline's insides.
 *
 *   grid     where the Morton grid lies, from a sample of the bodies               one block
 *   place    pose, box and filter of every shape                                   a thread a shape
 *   tree     Morton codes, radix sort, Karras' hierarchy, boxes bottom up          (few shapes: not needed)
 *   pairs    candidates: boxes overlap and the pair may meet                       a thread a shape, or tiles of pairs
 *            (a pair with a mesh is listed; a warp of `expand` finds its triangles: meshes.cu)
 *   sort     candidates by (slot of a, slot of b, subshape), the host's order
 *   hits     where they are planned (hits_view.h): swept bodies hit each other, and the candidates are searched for
 *            again
 *   narrow   the last step's pair (a hint or a search), manifold by candidate     a thread a candidate
 *            (where there are hulls or meshes two kernels of their own: narrow_listed.h)
 *   seams    where shapes have neighbours: manifolds that their union does not have  the same, then eight lanes
 *            (plain: by narrow itself)
 *   scan     where each candidate's contacts go                                    (few candidates: by emit itself)
 *   emit     pairs and points in world terms, the last step's impulses             eight threads a candidate
 *            (few candidates: with all that some need; many: kernels after it for points that roll, and for
 *            impulses from triangle to triangle)
 *
 * In a step of several sub-steps the first one searches for candidates of the whole step (collision_reach); the others
 * go from `place`, which sees to it that these are enough, to `narrow` at once, and know the pair that a candidate goes
 * on from. `narrow` then passes over candidates that do not meet in its sub-step, so that contacts are those of a step
 * by itself.
 *
 * Candidates are appended in any order (an integer counter) and then sorted: keys are unique, so the result does not
 * depend on timing. The counter also counts what does not fit, hence a stage whose capacity is too small says exactly
 * how much it needs: the kernels after it do nothing, the host, which reads the counts once at the end of the stage,
 * grows it and repeats it. Launches are sized by the capacities (the host does not know the counts).
 *
 * Small scenes are a matter of latency, not of work: few launches, and blocks so small that they spread over the whole
 * chip. With a small capacity a candidate's place in the order is found by counting the smaller ones, and emit adds up
 * the contacts before its own: two launches where a radix sort and a scan need some eight. With a larger one the sort
 * takes all of it; unused candidates are all ones and go to the end. What takes the time is one load that waits for
 * another: kernels ask at once for all that they may need, before it is known whether they do, and only then test.
 *
 * A candidate is a pair of subshapes of a pair of shapes (sadmm_geometry): where every shape has one subshape, a pair.
 * Triangles are the subshapes of a mesh. Shapes are checked when they are taken over (input.cu), so that
 * collision_table.h lists every pair that meets; one that it does not list would have no contacts.
 *
 * Double throughout, with the host pipeline's own inline formulas (proxy.h, pair_manifold.h, contact_match.h,
 * contact_emit.h): the same operations in the same order, compiled without contraction of a * b + c, so that the
 * contacts are the host's bit for bit. tests/test_cuda_collision.c holds the two together.
 */
#ifndef SADMM_CUDA_COLLIDE_VIEW_H
#define SADMM_CUDA_COLLIDE_VIEW_H

#include <cuda_runtime.h>

#include "backend_cuda/device/gravity.h"
#include "backend_cuda/device/layout.h"
#include "backend_cuda/device/pdl.h"
#include "backend_cuda/device/wide.h"
#include "collision/convex/gjk.h"
#include "collision/find/contact_emit.h"
#include "collision/find/seam.h"
#include "find.h"

enum {
    COLLISION_THREADS = 256, /* a block */
    GRID_SAMPLES = 128,
    PLACE_THREADS = 32,      /* every access is a sector a thread: what counts is how many multiprocessors share them */
    NARROW_THREADS = 32,     /* long chains of arithmetic, many registers, ... */
    NARROW_BLOCKS = 12,      /* ... but not so many that fewer blocks than this are on a multiprocessor */
    TILE_ROWS = 128,         /* all pairs: leaves of a block, one a thread, ... */
    TILE_COLUMNS = 64,       /* ... and later ones that each is tested against, a bit each */
    SMALL_TILE_ROWS = 32,    /* the same of few shapes, ... */
    SMALL_TILE_COLUMNS = 16,
    SMALL_TILES_BELOW = 1024, /* ... which are so few */
    TREE_THREADS = 64,       /* chains of loads: what counts is how many multiprocessors share them */
    MESH_THREADS = 32,       /* the same: walks through meshes */
    RANK_KEYS = 32,          /* sort by counting: keys of a block, ... */
    RANK_SHARES = 8,         /* ... into how many shares the others are split, ... */
    RANK_CHUNK = 1024,       /* ... and how many are staged at a time */
    EMIT_CANDIDATES = 32,    /* of a block */
    POINT_LANES = SADMM_MANIFOLD_POINTS,
    GENERAL_THREADS = 32,      /* emit_general: long chains of loads, on as many multiprocessors as there are, ... */
    GENERAL_LANES = 2,         /* ... two lanes a candidate, since few have more points, ... */
    GENERAL_BLOCKS = 4096,     /* ... and so many blocks at most, that go on to others: as a rule there are none */
    MORTON_BITS = 10         /* an axis: finer cells would part no more bodies, and sorting costs by the bit */
};

/* What decides whether two shapes may meet at all. */
struct alignas(16) collision_filter {
    uint32_t category, mask;
    int32_t body;
    int32_t kind; /* geometry_rank, + FILTER_MOVES */
};
enum { FILTER_RANK = 0xff, FILTER_MOVES = 0x100 };

/* A shape that is no plane, with all that is asked of it when candidates are searched for: what lies elsewhere would be
 * another round to memory, for one pair after the other. */
struct alignas(16) collision_leaf {
    struct sadmm_box3 box;
    double velocity[3], thin;      /* as the proxy's */
    struct collision_filter filter;
    int32_t slot, subshapes;
    int32_t group_low, group_high; /* a leaf that meets every group spans all */
};

/* A leaf or an inner node of the tree. Inner nodes come first: [0, leaves - 1), then leaves in tree order. A walk goes
 * to `child` where boxes and groups meet, else to `next`: the node after the whole subtree, -1 at the end. It needs no
 * stack, and a walk that starts at a leaf's `next` sees later leaves only. Boxes are rounded outwards, so that a node
 * is one sector of memory; whether two leaves meet is decided by their own boxes. */
struct alignas(32) collision_node {
    float lo[3], hi[3];
    int32_t child; /* inner node: its left child; leaf: its number */
    int32_t next;
};

/* Of the leaves below a node. Read only where there are several groups. */
struct alignas(8) collision_groups {
    int32_t low, high;
};

/* Key of a leaf: class, group, Morton code. Small movers come first, large ones and static shapes last: a walk searches
 * for later leaves only, so that no single thread finds everything that a large shape touches. */
enum { LEAF_CLASS_BITS = 2, LEAF_LARGE = 1, LEAF_STATIC = 2 };

/* Where the Morton grid lies. Only speed depends on it. */
struct collision_grid {
    double origin[3], scale;
};

/* Numbers of the step, or the sub-step. */
struct collision_step {
    double dt, margin, gravity;
};

/* Where a shape may be in the sub-steps to come: its box, larger by as much as velocities are likely to change, on its
 * way with the velocity that the step begins with. Boxes that stay in their reaches meet only where these do; a shape
 * that leaves its own aborts the step, which is then repeated with candidates searched for in every sub-step. */
struct collision_reach {
    struct sadmm_box3 box; /* at the step's start */
    double velocity[3];
};

/* A manifold on its way from narrow to emit, in whole pieces (device/wide.h). */
struct alignas(16) found_point {
    vec3 position;
    real separation;
};
struct alignas(16) found_head {
    vec3 normal;
    double time_offset;
    uint32_t cache;
    int32_t count;
};
enum { FOUND_FEATURES = 4 }; /* of a piece */
struct alignas(16) found_features {
    uint32_t of[FOUND_FEATURES];
};
struct found_manifold {
    found_head head;
    found_point points[SADMM_MANIFOLD_POINTS]; /* beyond `count`: not written */
    found_features features[SADMM_MANIFOLD_POINTS / FOUND_FEATURES];
};

struct collision_set {
    struct sadmm_contact_pair *pairs;
    struct sadmm_contact_point *points;
    struct sadmm_contact_migration *migrations; /* as points */
    uint64_t *keys; /* of the pairs: slot of a << 32 | slot of b; as often as the two have a manifold */
    struct sadmm_cuda_contact_counts *counts;
};

/* What kernels see: device memory. */
struct collision_view {
    const struct sadmm_shape *shapes;              /* by slot */
    const struct sadmm_geometry *geometries;       /* by handle */
    const double *hulls;                           /* shape data (collision/hull/hull_data.h); NULL: no shape is a hull,
                                                      or a mesh */
    const struct sadmm_collision_body *bodies;     /* by body slot */
    const uint32_t *present;                       /* slots: leaves, then planes */
    const uint64_t *planes;                        /* (group + 1) << 32 | slot, sorted */
    const uint64_t *disabled_pairs, *friction_pairs;
    const double *friction_values;
    struct seam_view seams;                        /* neighbours of shapes; first is NULL: there are none */
    int32_t leaf_count, plane_count, disabled_count, friction_count;
    int32_t mesh_count;                            /* shapes */
    int32_t shared_planes;                         /* the first ones: of group -1 */
    int32_t shared_leaves;                         /* the last ones of `grouped`: likewise */
    const uint64_t *grouped;                       /* group << 32 | number of a leaf, sorted; NULL: pairs are not found
                                                      group by group */
    struct collision_step step;
    int32_t substeps, substep;                     /* of the step; 1: what concerns sub-steps is left out */
    int32_t group_bits;                            /* of the leaf keys */
    double large;                                  /* radius from which a mover is large, m */
    int32_t body_count;                            /* slots */
    bool pdl;                                      /* kernels are launched with PDL (device/pdl.h) */
    bool hides;                                    /* the narrow phase itself sees to seams */
    uint8_t *is_listed;                            /* by candidate; not NULL: seams of listed ones are seen to later */
    bool carries;                                  /* what makes points also lets them slide over meshes */
    struct collision_grid *grid;                   /* of this step */
    int32_t *abort_code;                           /* not NULL and not 0: do nothing */
    const double *dt, *gravity;                    /* not NULL: of the step, in the place of step's (step_of) */
    struct cuda_gravities gravities;               /* in the place of these (step_of_shape) */
    const double *threshold;                       /* of restitution, m/s; not NULL: is any pair fast (COUNT_FAST)? */

    struct sadmm_proxy *proxies;                   /* by slot */
    struct collision_filter *filters;              /* of planes, by slot */
    struct collision_leaf *placed;                 /* as `present`; with sub-steps: what the whole step reaches */
    struct sadmm_box3 *boxes;                      /* sub-steps: of this one, by slot */
    struct collision_reach *reaches;               /* and of all to come */
    uint64_t *leaf_keys;                           /* by leaf; sorted: tree order. NULL: there is no tree */
    uint32_t *leaf_numbers;                        /* in `placed` */
    struct collision_node *nodes;                  /* 2 leaves - 1 */
    struct collision_groups *groups;               /* of nodes */
    int32_t *parents;                              /* of nodes; -1: the root */
    int32_t *arrivals;                             /* at inner nodes, bottom up */

    unsigned long long *candidate_count;           /* found, whether they fit or not; listed; mesh_pairs; general; is
                                                      any fast? (COUNT_) */
    uint64_t *mesh_pairs;                          /* first_candidate of pairs with a mesh, of which there may be as
                                                      many as candidates; as they come */
    double *touches;                               /* by candidate, of triangles and pairs that are fast:
                                                      mesh_first_touch */
    int32_t *listed;                               /* candidates that the narrow phase does by themselves */
    struct gjk_walk *walks;                       /* as listed: what of each is done */
    uint64_t *found;                               /* candidates as they come, packed (candidate_of) */
    uint64_t *candidates;                          /* sorted */
    int32_t candidate_capacity;
    int32_t slot_bits, subshape_bits;              /* of a candidate; subshape_bits is 0 where every shape has one
                                                      subshape */
    struct found_manifold *manifolds;              /* by candidate; not written where there are no points */
    int32_t *matches;                              /* by candidate: pair of the last step, or -1 */
    int32_t *pair_of;                              /* by candidate: its pair in the new set; without: the next one */
    uint8_t *sizes;                                /* points by candidate; 0 beyond the last, SIZES_BEYOND of them */
    int32_t *general;                              /* candidates whose contacts emit_general makes; as they come */
    uint64_t *places;                              /* exclusive sums of pairs << 32 | points */

    struct collision_set before, after;
    int32_t point_capacity;
};

static __device__ __forceinline__ bool aborted(const collision_view &v) { return v.abort_code && *v.abort_code != 0; }

/* To be fetched early: some of it may have to come from memory. */
static __device__ __forceinline__ collision_step step_of(const collision_view &v)
{
    struct collision_step step = v.step;
    if (!v.dt) return step;
    step.dt = *v.dt;
    step.gravity = *v.gravity;
    return step;
}

/* For a shape, or a pair of it, gravity is that of the world which it is in. step: step_of, fetched before it is known
 * which shape that is. */
static __device__ __forceinline__ collision_step step_of_shape(const collision_view &v, collision_step step,
                                                               uint32_t slot)
{
    if (v.gravities.of) step.gravity = own_gravity_size(v.gravities, slot);
    return step;
}

/* The time that candidates are searched for: of the whole step. */
static __device__ __forceinline__ double time_of_candidates(const collision_view &v, const collision_step &step)
{
    return step.dt * v.substeps;
}

/* A candidate, unpacked from slot of a, slot of b, subshape. */
struct candidate {
    uint32_t a, b, subshape;
};
static __device__ __forceinline__ candidate candidate_of(const collision_view &v, uint64_t key)
{
    const uint64_t shapes = key >> v.subshape_bits;
    const candidate c = {(uint32_t)(shapes >> v.slot_bits), (uint32_t)(shapes & ((UINT64_C(1) << v.slot_bits) - 1)),
                         (uint32_t)(key & ((UINT64_C(1) << v.subshape_bits) - 1))};
    return c;
}
static __device__ __forceinline__ uint64_t first_candidate(const collision_view &v, uint32_t a, uint32_t b)
{
    return ((uint64_t)a << v.slot_bits | b) << v.subshape_bits;
}
/* Candidates of a pair: they follow the first one; 0: it is one with a mesh. subshapes: of the two shapes. */
static __device__ __forceinline__ uint32_t candidates_of(const collision_view &v, int32_t a, int32_t b)
{
    return v.subshape_bits > 0 ? (uint32_t)a * (uint32_t)b : 1;
}

/* Counters. */
enum { COUNT_FOUND, COUNT_LISTED, COUNT_MESH_PAIRS, COUNT_GENERAL, COUNT_FAST, COUNTERS };

/* Candidates that the kernels after the pairs stage work on: none when they did not all fit. */
static __device__ __forceinline__ int32_t usable_candidates(const collision_view &v)
{
    unsigned long long found = *v.candidate_count;
    if (aborted(v)) return 0;
    return found <= (unsigned long long)v.candidate_capacity ? (int32_t)found : 0;
}

static __device__ __forceinline__ int64_t collision_thread(int block)
{
    return (int64_t)blockIdx.x * block + threadIdx.x;
}

/* Blocks of a row of tiles: the first has the planes. width: of a tile. */
static __host__ __device__ __forceinline__ int32_t tile_columns(int32_t leaves, int32_t width)
{
    return 1 + (leaves + width - 1) / width;
}

/* Sizes are read in words of four; and one more than the capacity is scanned: its place is the sum of all. */
enum { SIZES_BEYOND = 4 };

/* A kernel's shared memory: one struct. */
#ifdef SADMM_CUDA_EMULATED
#define COLLISION_SHARED(type, name) struct type &name = *(struct type *)cuda_emulation_shared()
#else
#define COLLISION_SHARED(type, name) __shared__ struct type name
#endif

/* A kernel and how it is launched. */
struct collision_launch {
    void (*kernel)(const collision_view);
    int threads;   /* a block */
    size_t shared; /* bytes; what the emulated device must know */
    const char *name;
};

/* The narrow phase (narrow_listed.h). */
struct narrow_kernels {
    struct collision_launch at_once, at_once_first, at_once_again, listed;
    struct collision_launch touch, touch_first, touch_again; /* with meshes (touch.h) */
};

/* The kernels, each beside what it does. */
struct collision_kernels {
    struct collision_launch place[2], place_first[2], place_again[2]; /* of few shapes, of many (by_warp_from) */
    struct collision_launch grid, build, refit, clear, walk, tiles, small_tiles, groups, rank,
        expand, expand_first, seams, listed_seams, emit, emit_few, emit_general, carry;
    struct narrow_kernels plain, with_hulls, with_meshes, with_smooth; /* by what kinds of shapes there are */
    int expand_warps; /* expand is launched for */
};
void COLLISION(broad_phase_kernels)(struct collision_kernels *kernels);
void COLLISION(sort_kernels)(struct collision_kernels *kernels);
void COLLISION(narrow_phase_kernels)(struct collision_kernels *kernels);
void COLLISION(narrow_hulls_kernels)(struct collision_kernels *kernels);
void COLLISION(narrow_meshes_kernels)(struct collision_kernels *kernels);
void COLLISION(narrow_smooth_kernels)(struct collision_kernels *kernels);
void COLLISION(mesh_kernels)(struct collision_kernels *kernels);
void COLLISION(seam_kernels)(struct collision_kernels *kernels);
void COLLISION(matching_kernels)(struct collision_kernels *kernels);

#endif
