/* Manifolds that the union of neighbouring shapes does not have are left out (collision/find/seam.h): in plain worlds
 * by the thread that has made them, since a kernel more takes longer than what a few pairs need; in others, whose
 * kernels are short of registers, by kernels of their own (seams.cu). A function, which other worlds' candidates do not
 * come to. */
#ifndef SADMM_CUDA_COLLIDE_NARROW_SEAMS_H
#define SADMM_CUDA_COLLIDE_NARROW_SEAMS_H

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

/* Candidate i, whose manifold is there. */
static __device__ __noinline__ void hide_seams(const collision_view &v, int64_t i)
{
    /* What takes the time are rounds to memory: what can be asked for together is. */
    const uint64_t key = v.candidates[i];
    const uint8_t size = v.sizes[i];
    if (size == 0) return;
    const struct candidate own = candidate_of(v, key);
    const uint32_t *first = v.seams.first, a = first[own.a], a_end = first[own.a + 1], b = first[own.b],
                   b_end = first[own.b + 1];
    if (a == a_end && b == b_end) return;
    const struct manifold m = load_manifold(v, i);
    if (seam_hides(&v.seams, v.proxies, v.hulls, own.a, own.b, own.subshape, &m)) v.sizes[i] = 0;
}

#endif
