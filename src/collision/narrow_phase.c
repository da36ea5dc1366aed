#include "narrow_phase.h"

#include "core/base/memory.h"
#include "contact_carry.h"
#include "pair_manifold.h"

static uint64_t pair_key_of(const struct sadmm_contact_pair *pair)
{
    return (uint64_t)(uint32_t)pair->shape_a << 32 | (uint32_t)pair->shape_b;
}

static size_t first_pair_from(const struct sadmm_contact_set *set, uint64_t key)
{
    size_t low = 0, high = set->pair_count;
    while (low < high) {
        size_t mid = low + (high - low) / 2;
        if (pair_key_of(&set->pairs[mid]) < key) low = mid + 1;
        else high = mid;
    }
    return low;
}

static bool find_key(const uint64_t *keys, size_t count, uint64_t key, size_t *at)
{
    size_t low = 0, high = count;
    while (low < high) {
        size_t mid = low + (high - low) / 2;
        if (keys[mid] < key) low = mid + 1;
        else high = mid;
    }
    *at = low;
    return low < count && keys[low] == key;
}

static uint64_t unordered_key(uint32_t a, uint32_t b) { return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a; }

static double pair_friction(const struct sadmm_collision_input *input, uint32_t a, uint32_t b, double mu_a, double mu_b)
{
    size_t at;
    if (input->friction_pair_count &&
        find_key(input->friction_pairs, input->friction_pair_count, unordered_key(a, b), &at))
        return input->friction_values[at];
    return mu_a == mu_b ? mu_a : sqrt(mu_a * mu_b);
}

static void rotate(const double R[9], vec3 v, double out[3])
{
    for (int k = 0; k < 3; ++k)
        out[k] = R[3 * k] * (double)v.x + R[3 * k + 1] * (double)v.y + R[3 * k + 2] * (double)v.z;
}

/* Write the manifold as a pair with its points; room is there. */
static void emit(const struct sadmm_candidates *c, const struct sadmm_collision_input *input, uint32_t a, uint32_t b,
                 const struct manifold *m, const struct sadmm_contact_set *old_set,
                 const struct sadmm_contact_pair *old, struct sadmm_contact_set *out)
{
    const struct sadmm_proxy *pa = &c->proxies[a], *pb = &c->proxies[b];
    struct sadmm_contact_pair *pair = &out->pairs[out->pair_count++];
    double between[3];

    pair->body_a = pa->system_body;
    pair->body_b = pb->system_body;
    pair->shape_a = (int32_t)a;
    pair->shape_b = (int32_t)b;
    pair->first = (int32_t)out->point_count;
    pair->count = m->count;
    rotate(pb->R, m->normal, pair->normal);
    pair->friction = pair_friction(input, a, b, pa->friction, pb->friction);
    pair->restitution = pa->restitution > pb->restitution ? pa->restitution : pb->restitution;
    pair->cache = m->cache;
    pair->revision = word_of_pair(pa->revision, pb->revision);
    pair->placed = word_of_pair(pa->placed, pb->placed);
    pair->reserved = 0;
    for (int k = 0; k < 3; ++k) between[k] = pb->com[k] - pa->com[k];

    for (int i = 0; i < m->count; ++i) {
        const struct manifold_point *from = &m->points[i];
        struct sadmm_contact_point *point = &out->points[out->point_count++];
        double p[3];
        rotate(pb->R, from->position, p);
        for (int k = 0; k < 3; ++k) {
            double arm = p[k] + pb->arm[k];
            point->arm_b[k] = pair->body_b >= 0 ? arm : 0;
            point->arm_a[k] = pair->body_a >= 0 ? arm + between[k] : 0;
            point->impulse[k] = 0;
        }
        point->gap = (double)from->separation;
        point->error = 0;
        point->feature = from->feature;
        point->reserved = 0;
        if (!old) continue;
        for (int32_t j = 0; j < old->count; ++j) {
            const struct sadmm_contact_point *before = &old_set->points[old->first + j];
            if (before->feature != from->feature) continue;
            impulse_carry(old->normal, before->impulse, pair->normal, pair->friction,
                          step_ratio(input->dt, old_set->dt), point->impulse);
            break;
        }
    }
}

bool sadmm_narrow_phase(const struct sadmm_candidates *c, const struct sadmm_collision_input *input, size_t begin,
                        size_t end, const struct sadmm_contact_set *old, struct sadmm_contact_set *out)
{
    size_t next = begin < end ? first_pair_from(old, c->list.keys[begin]) : 0;
    struct manifold m;

    for (size_t i = begin; i < end; ++i) {
        uint64_t key = c->list.keys[i];
        uint32_t a = (uint32_t)(key >> 32), b = (uint32_t)key;
        const struct sadmm_proxy *pa = &c->proxies[a], *pb = &c->proxies[b];
        const struct sadmm_contact_pair *before = NULL;
        struct pair_pose pose;
        double limit;
        size_t at;

        if (!sadmm_candidate_meets(c, input, a, b)) continue;
        if (input->disabled_body_pair_count &&
            find_key(input->disabled_body_pairs, input->disabled_body_pair_count,
                     unordered_key((uint32_t)pa->body, (uint32_t)pb->body), &at))
            continue;
        while (next < old->pair_count && pair_key_of(&old->pairs[next]) < key) ++next;
        if (next < old->pair_count && pair_key_of(&old->pairs[next]) == key &&
            old->pairs[next].revision == word_of_pair(pa->revision, pb->revision))
            before = &old->pairs[next];

        limit = proxy_limit(pa, pb, input->margin, input->gravity, input->dt);
        pose = pair_pose(pa->type == SADMM_SHAPE_PLANE, pa->R, pa->x, pb->R, pb->x);
        pair_manifold(pa->type, v3_load(pa->size), pb->type, v3_load(pb->size), &pose, (real)limit,
                      before && before->placed == word_of_pair(pa->placed, pb->placed) ? before->cache : 0, &m);
        if (m.count == 0) continue;
        if (!sadmm_grow((void **)&out->pairs, &out->pair_capacity, out->pair_count, out->pair_count + 1,
                        sizeof *out->pairs) ||
            !sadmm_grow((void **)&out->points, &out->point_capacity, out->point_count,
                        out->point_count + SADMM_MANIFOLD_POINTS, sizeof *out->points))
            return false;
        emit(c, input, a, b, &m, old, before, out);
    }
    return true;
}
