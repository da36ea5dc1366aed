/* Manifolds that the union of neighbouring shapes does not have are left out (collision/seam.h): a kernel of its own
 * after the narrow phase, launched where shapes have neighbours, so that other worlds' kernels need nothing for it. */
#include "narrow.h"

static __device__ __forceinline__ struct manifold load_manifold(const collision_view &v, int64_t i)
{
    const struct found_manifold &from = v.manifolds[i];
    const found_head head = load_wide(&from.head);
    struct manifold m;
    m.normal = head.normal;
    m.time_offset = head.time_offset;
    m.cache = head.cache;
    m.count = head.count;
    for (int k = 0; k < head.count; ++k) {
        const found_point point = load_wide(&from.points[k]);
        m.points[k] = {point.position, point.separation, 0};
    }
    return m;
}

static __global__ void __launch_bounds__(NARROW_THREADS) seam_kernel(const __grid_constant__ collision_view v)
{
    pdl_wait_only_if(v.pdl);
    /* What takes the time are rounds to memory: what can be asked for together is. */
    const int64_t i = collision_thread(NARROW_THREADS), readable = i < v.candidate_capacity ? i : 0;
    const uint64_t key = v.candidates[readable];
    const uint8_t size = v.sizes[readable];
    if (i >= usable_candidates(v) || size == 0) return;
    const struct candidate own = candidate_of(v, key);
    const uint32_t *first = v.seams.first, a = first[own.a], a_end = first[own.a + 1], b = first[own.b],
                   b_end = first[own.b + 1];
    if (a == a_end && b == b_end) return;
    const struct manifold m = load_manifold(v, i);
    if (seam_hides(&v.seams, v.proxies, v.hulls, own.a, own.b, own.subshape, &m)) v.sizes[i] = 0;
}

void COLLISION(seam_kernels)(struct collision_kernels *kernels)
{
    kernels->seams = {seam_kernel, NARROW_THREADS, 0, "seams"};
}
