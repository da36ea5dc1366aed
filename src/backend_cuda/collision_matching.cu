/* Manifolds to contacts: world terms, and the last step's impulses by feature. Eight threads take a candidate, one a
 * point; the first one writes the pair as well. */
#include "collision_internal.h"

static __device__ double pair_friction(const collision_view &v, uint32_t a, uint32_t b, double mu_a, double mu_b)
{
    if (v.friction_count > 0) {
        const int64_t at = find_key(v.friction_pairs, v.friction_count, unordered_key(a, b));
        if (at >= 0) return v.friction_values[at];
    }
    return mu_a == mu_b ? mu_a : sqrt(mu_a * mu_b);
}

static __global__ void __launch_bounds__(COLLISION_THREADS) emit_kernel(const __grid_constant__ collision_view v)
{
    const int64_t thread = collision_thread(COLLISION_THREADS), i = thread / POINT_LANES;
    const int32_t lane = (int32_t)(thread % POINT_LANES);
    if (halted(v)) return;
    const uint64_t total = v.places[v.candidate_room];
    if (thread == 0) {
        v.after.counts->candidates = (int64_t)*v.candidate_count;
        v.after.counts->pairs = (int32_t)(total >> 32);
        v.after.counts->points = (int32_t)(uint32_t)total;
    }
    if (i >= usable_candidates(v) || (int32_t)(uint32_t)total > v.point_room) return;
    const int32_t count = (int32_t)(uint32_t)v.sizes[i];
    if (lane >= count) return;

    const uint64_t key = v.candidates[i];
    const uint32_t a = (uint32_t)(key >> v.slot_bits), b = (uint32_t)(key & ((UINT64_C(1) << v.slot_bits) - 1));
    const int32_t at = (int32_t)(v.places[i] >> 32), first = (int32_t)(uint32_t)v.places[i];
    const struct sadmm_proxy *pa = &v.proxies[a], *pb = &v.proxies[b];
    const struct manifold *m = &v.manifolds[i];
    const double friction = pair_friction(v, a, b, pa->friction, pb->friction);
    double normal[3];
    rotate_to_world(pb->R, m->normal, normal);

    if (lane == 0) {
        struct sadmm_contact_pair pair;
        pair.body_a = pa->system_body;
        pair.body_b = pb->system_body;
        pair.shape_a = (int32_t)a;
        pair.shape_b = (int32_t)b;
        pair.first = first;
        pair.count = count;
        for (int k = 0; k < 3; ++k) pair.normal[k] = normal[k];
        pair.friction = friction;
        pair.restitution = fmax(pa->restitution, pb->restitution);
        pair.cache = m->cache;
        pair.reserved = revision_of_pair(pa->revision, pb->revision);
        v.after.pairs[at] = pair;
        v.after.keys[at] = ordered_key(a, b);
    }

    const struct manifold_point from = m->points[lane];
    struct sadmm_contact_point point;
    double p[3];
    rotate_to_world(pb->R, from.position, p);
    for (int k = 0; k < 3; ++k) {
        const double arm = p[k] + pb->arm[k], between = pb->com[k] - pa->com[k];
        point.arm_b[k] = pb->system_body >= 0 ? arm : 0;
        point.arm_a[k] = pa->system_body >= 0 ? arm + between : 0;
        point.impulse[k] = 0;
    }
    point.gap = from.separation;
    point.error = 0;
    point.feature = from.feature;
    point.reserved = 0;
    const int32_t match = v.matches[i];
    if (match >= 0) {
        const struct sadmm_contact_pair *old = &v.before.pairs[match];
        for (int32_t k = 0; k < old->count; ++k) {
            const struct sadmm_contact_point *before = &v.before.points[old->first + k];
            if (before->feature != from.feature) continue;
            impulse_carry(old->normal, before->impulse, normal, friction, point.impulse);
            break;
        }
    }
    v.after.points[first + lane] = point;
}

void COLLISION(matching_kernels)(struct collision_kernels *kernels)
{
    kernels->emit = emit_kernel;
}
