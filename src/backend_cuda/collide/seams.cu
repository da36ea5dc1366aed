/* Seams by kernels of their own (narrow_seams.h): with hulls and meshes, and where hits come between them and the
 * narrow phase. One is for pairs that are not listed, and runs beside the kernel that makes those that are
 * (narrow_listed.h), whose own seams come after it.
 *
 * A thread a candidate sees that the first point of nearly all is not hidden. The few others take a long time, with
 * everything beside each of their points: eight lanes take one of them, a point or a direction each. */
#include "narrow.h"

enum { SEAM_LANES = POINT_LANES };
static_assert((int)SEAM_LANES == (int)SEAM_DIRECTIONS, "a lane has a point, and a direction");

/* A manifold that is there: what its points have in common. */
struct seam_pair {
    struct candidate own;
    found_head head;
};

static __device__ __forceinline__ seam_pair seam_pair_of(const collision_view &v, int64_t i)
{
    const seam_pair pair = {candidate_of(v, v.candidates[i]), load_wide(&v.manifolds[i].head)};
    return pair;
}

/* Point k, on the piece's surface. */
static __device__ __forceinline__ vec3 point_of(const collision_view &v, int64_t i, const seam_pair &pair,
                                                const struct seam_piece &piece, bool of_a, int k)
{
    const found_point point = load_wide(&v.manifolds[i].points[k]);
    return seam_point(&piece, &v.proxies[pair.own.a], &v.proxies[pair.own.b], pair.head.normal, pair.head.time_offset,
                      point.position, point.separation, of_a);
}

static __device__ __forceinline__ bool piece_of(const collision_view &v, const seam_pair &pair, bool of_a,
                                                struct seam_piece *piece)
{
    return seam_piece_of(&v.seams, v.proxies, v.hulls, pair.own.a, pair.own.b, pair.own.subshape, of_a, piece);
}

static __device__ __forceinline__ vec3 direction_of(const collision_view &v, const seam_pair &pair,
                                                    const struct seam_piece &piece, bool of_a)
{
    return seam_direction(&piece, &v.proxies[pair.own.b], pair.head.normal, of_a);
}

/* Is the first point of candidate i hidden? */
static __device__ __forceinline__ bool may_hide(const collision_view &v, int64_t i)
{
    const uint64_t key = v.candidates[i];
    if (v.sizes[i] == 0) return false;
    const struct candidate own = candidate_of(v, key);
    const uint32_t *first = v.seams.first, a = first[own.a], a_end = first[own.a + 1], b = first[own.b],
                   b_end = first[own.b + 1];
    if (a == a_end && b == b_end) return false;
    const seam_pair pair = seam_pair_of(v, i);
    for (int of_a = 0; of_a < 2; ++of_a) {
        struct seam_piece piece;
        if (piece_of(v, pair, of_a, &piece) &&
            seam_hides_point(&piece, point_of(v, i, pair, piece, of_a, 0), direction_of(v, pair, piece, of_a)))
            return true;
    }
    return false;
}

/* Do all lanes of this one's group say so? Every lane of the warp comes here. */
static __device__ __forceinline__ bool group_says(bool says, int group)
{
    return (__ballot_sync(0xffffffffu, says) >> (SEAM_LANES * group) & ((1u << SEAM_LANES) - 1)) ==
           (1u << SEAM_LANES) - 1;
}

/* seam_hides_at, of candidate i, by the lanes of a group; i < 0: none. Every lane of the warp comes here. */
static __device__ __noinline__ bool hidden_at(const collision_view &v, int64_t i, bool of_a, int group, int lane)
{
    seam_pair pair = {};
    struct seam_piece piece = {};
    vec3 x = {}, u = {};
    bool hidden = false;
    if (i >= 0) {
        pair = seam_pair_of(v, i);
        hidden = piece_of(v, pair, of_a, &piece);
    }
    if (hidden) {
        u = direction_of(v, pair, piece, of_a);
        if (lane < pair.head.count) {
            x = point_of(v, i, pair, piece, of_a, lane);
            hidden = seam_hides_point(&piece, x, u);
        }
    }
    hidden = group_says(hidden, group);
    for (int k = 0; k < SADMM_MANIFOLD_POINTS && __ballot_sync(0xffffffffu, hidden && k < pair.head.count) != 0; ++k) {
        const int from = SEAM_LANES * group + k;
        const vec3 at = v3(__shfl_sync(0xffffffffu, x.x, from, WARP_LANES),
                           __shfl_sync(0xffffffffu, x.y, from, WARP_LANES),
                           __shfl_sync(0xffffffffu, x.z, from, WARP_LANES));
        bool says = hidden;
        if (hidden && k < pair.head.count) {
            says = seam_hides_beside(&piece, at, u, lane);
            bool there = true;
            for (int flat = lane; says && there; flat += SEAM_LANES)
                says = !seam_is_corner_at(&piece, flat, at, u, &there);
        }
        hidden = group_says(says, group);
    }
    return hidden;
}

/* Candidate i of each lane, whose manifold is there; -1: none. Every lane of the warp comes here. */
static __device__ __forceinline__ void hide_seams_of_warp(const collision_view &v, int64_t i)
{
    const int group = (int)threadIdx.x % WARP_LANES / SEAM_LANES, lane = (int)threadIdx.x % SEAM_LANES;
    for (unsigned left = __ballot_sync(0xffffffffu, i >= 0 && may_hide(v, i)); left != 0;) {
        unsigned own = left;
        for (int k = 0; k < WARP_LANES / SEAM_LANES; ++k) {
            if (k < group) own &= own - 1;
            left &= left - 1;
        }
        const int from = own ? __ffs((int)own) - 1 : 0;
        const int32_t number = __shfl_sync(0xffffffffu, (int32_t)i, from, WARP_LANES);
        const int64_t candidate = own ? number : -1;
        bool hidden = hidden_at(v, candidate, false, group, lane);
        hidden |= hidden_at(v, hidden ? -1 : candidate, true, group, lane);
        if (hidden && lane == 0) v.sizes[candidate] = 0;
    }
}

static __global__ void __launch_bounds__(NARROW_THREADS) seam_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_only_if(v.pdl);
    const int64_t i = collision_thread(NARROW_THREADS);
    hide_seams_of_warp(v, i < usable_candidates(v) && !(v.is_listed && v.is_listed[i]) ? i : -1);
}

static __global__ void __launch_bounds__(NARROW_THREADS) listed_seam_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_only_if(v.pdl);
    const int64_t i = collision_thread(NARROW_THREADS);
    hide_seams_of_warp(v, i < usable_candidates(v) && i < (int64_t)v.candidate_count[COUNT_LISTED] ? v.listed[i] : -1);
}

void COLLISION(seam_kernels)(struct collision_kernels *kernels)
{
    kernels->seams = {seam_kernel, NARROW_THREADS, 0, "seams"};
    kernels->listed_seams = {listed_seam_kernel, NARROW_THREADS, 0, "seams of listed pairs"};
}
