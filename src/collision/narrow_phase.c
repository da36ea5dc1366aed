#include "narrow_phase.h"

#include "core/base/memory.h"
#include "contact_emit.h"
#include "pair_manifold.h"

/* Write the manifold as a pair with its points; there is capacity. `before`: the pair that it goes on from, or NULL. */
static void emit(const struct sadmm_candidates *c, const struct sadmm_collision_input *input, uint32_t a, uint32_t b,
                 uint32_t child, const struct manifold *m, const struct sadmm_contact_set *old,
                 const struct sadmm_contact_pair *before, struct sadmm_contact_set *out)
{
    const struct sadmm_proxy *pa = &c->proxies[a], *pb = &c->proxies[b];
    struct sadmm_contact_pair *pair = &out->pairs[out->pair_count++];
    const double friction = contact_friction(input->friction_pairs, input->friction_values,
                                             (int64_t)input->friction_pair_count, a, b, pa, pb);
    double normal[3];

    rotate_to_world(pb->R, m->normal, normal);
    contact_emit_pair(a, b, child, pa, pb, m, normal, friction, (int32_t)out->point_count, pair);
    for (int i = 0; i < m->count; ++i) {
        struct sadmm_contact_point *point = &out->points[out->point_count++];
        contact_emit_point(pa, pb, &m->points[i], point);
        if (before) contact_carry(before, old->points, old->dt, i, normal, friction, input->dt, point);
    }
}

static bool is_disabled(const struct sadmm_collision_input *input, const struct sadmm_proxy *a, const struct sadmm_proxy *b)
{
    return input->disabled_body_pair_count &&
           find_key(input->disabled_body_pairs, (int64_t)input->disabled_body_pair_count,
                    unordered_key((uint32_t)a->body, (uint32_t)b->body)) >= 0;
}

bool sadmm_narrow_phase(const struct sadmm_candidates *c, const struct sadmm_collision_input *input, size_t begin,
                        size_t end, const struct sadmm_contact_set *old, struct sadmm_contact_set *out)
{
    const uint64_t first = begin < end ? c->list.keys[begin] : 0;
    size_t next = (size_t)contact_lower_bound(old->pairs, 0, (int64_t)old->pair_count, first, 0);
    struct manifold m;

    for (size_t i = begin; i < end; ++i) {
        const uint64_t key = c->list.keys[i];
        const uint32_t a = (uint32_t)(key >> 32), b = (uint32_t)key;
        const struct sadmm_proxy *pa = &c->proxies[a], *pb = &c->proxies[b];

        if (!sadmm_candidate_meets(c, input, a, b) || is_disabled(input, pa, pb)) continue;
        const uint32_t children = pair_children(&pa->geometry, &pb->geometry);
        const double limit = proxy_limit(pa, pb, input->margin, input->gravity, input->dt);
        const struct pair_pose pose = pair_pose(pa->geometry.type == SADMM_SHAPE_PLANE, pa->R, pa->x, pb->R, pb->x);
        for (uint32_t child = 0; child < children; ++child) {
            const struct sadmm_contact_pair *before = NULL;
            while (next < old->pair_count && contact_is_before(&old->pairs[next], key, child)) ++next;
            if (next < old->pair_count && contact_shapes(&old->pairs[next]) == key &&
                contact_goes_on(&old->pairs[next], child, pa, pb))
                before = &old->pairs[next];
            pair_manifold(&pa->geometry, &pb->geometry, child, &pose, (real)limit,
                          before ? contact_memory(before, pa, pb) : 0, &m);
            if (m.count == 0) continue;
            if (!sadmm_grow((void **)&out->pairs, &out->pair_capacity, out->pair_count, out->pair_count + 1,
                            sizeof *out->pairs) ||
                !sadmm_grow((void **)&out->points, &out->point_capacity, out->point_count,
                            out->point_count + SADMM_MANIFOLD_POINTS, sizeof *out->points))
                return false;
            emit(c, input, a, b, child, &m, old, before, out);
        }
    }
    return true;
}
