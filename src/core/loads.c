#include "loads.h"

#include <math.h>
#include <string.h>

#include "dense6.h"
#include "memory.h"
#include "system_math.h"

enum { MOST_SUPPORTS = 64, SWEEPS = 20 };
/* Stiffness of the supports over the body's mass: a supported body keeps one part in this of its motion. */
#define STIFF 1e7
/* Of the largest impulse: less beyond its cone is the supports' softness. */
#define CONE_SLACK 1e-6

struct predictor {
    struct sadmm_system *system;
    const struct sadmm_settings *settings;
    int32_t *offsets, *incident; /* body -> its pairs: (bodies + 2), twice the pairs */
    int32_t *depth, *order;      /* contacts between a body and the ground; bodies, nearest first, `reached` of them */
    double *momentum;            /* bodies x 6: b and what was handed down */
    int32_t reached;
};

/* A contact of the body at hand with something nearer to the ground. */
struct support {
    const struct sadmm_contact_pair *pair;
    struct sadmm_contact_point *point;
    vec3 normal, arm, impulse; /* towards the body, from its centre, on it */
    double error;
};

static int32_t other_body(const struct sadmm_contact_pair *pair, int32_t i)
{
    return pair->body_a == i ? pair->body_b : pair->body_a;
}

static void list_pairs(struct predictor *p)
{
    const struct sadmm_contact_set *contacts = p->system->contacts;
    for (size_t k = 0; k < contacts->pair_count; ++k)
        for (int side = 0; side < 2; ++side) {
            int32_t body = side ? contacts->pairs[k].body_b : contacts->pairs[k].body_a;
            if (body >= 0) ++p->offsets[body + 2];
        }
    for (int32_t i = 0; i < p->system->body_count; ++i) p->offsets[i + 2] += p->offsets[i + 1];
    for (size_t k = 0; k < contacts->pair_count; ++k)
        for (int side = 0; side < 2; ++side) {
            int32_t body = side ? contacts->pairs[k].body_b : contacts->pairs[k].body_a;
            if (body >= 0) p->incident[p->offsets[body + 1]++] = (int32_t)k;
        }
}

/* Breadth first from the ground. */
static void find_depths(struct predictor *p)
{
    const struct sadmm_contact_set *contacts = p->system->contacts;
    for (int32_t i = 0; i < p->system->body_count; ++i) {
        p->depth[i] = 0;
        for (int32_t at = p->offsets[i]; at < p->offsets[i + 1] && !p->depth[i]; ++at)
            if (other_body(&contacts->pairs[p->incident[at]], i) < 0) p->depth[i] = 1;
        if (p->depth[i]) p->order[p->reached++] = i;
    }
    for (int32_t next = 0; next < p->reached; ++next) {
        int32_t i = p->order[next];
        for (int32_t at = p->offsets[i]; at < p->offsets[i + 1]; ++at) {
            int32_t other = other_body(&contacts->pairs[p->incident[at]], i);
            if (other < 0 || p->depth[other]) continue;
            p->depth[other] = p->depth[i] + 1;
            p->order[p->reached++] = other;
        }
    }
}

/* x + e n of a support, the other side at rest. */
static vec3 approach(const struct support *s, const double v[6])
{
    return v3_madd(v3_add(v3_load(v), v3_cross(v3_load(v + 3), s->arm)), s->error, s->normal);
}

static void add_impulse(double g[6], vec3 arm, vec3 impulse, double sign)
{
    vec3 torque = v3_cross(arm, impulse);
    g[0] += sign * impulse.x, g[1] += sign * impulse.y, g[2] += sign * impulse.z;
    g[3] += sign * torque.x, g[4] += sign * torque.y, g[5] += sign * torque.z;
}

/* Those that the body would move into with velocity v. */
static int find_supports(const struct predictor *p, int32_t i, const double v[6], struct support supports[MOST_SUPPORTS])
{
    const struct sadmm_contact_set *contacts = p->system->contacts;
    int count = 0;
    for (int32_t at = p->offsets[i]; at < p->offsets[i + 1]; ++at) {
        const struct sadmm_contact_pair *pair = &contacts->pairs[p->incident[at]];
        int32_t other = other_body(pair, i);
        if (other >= 0 && p->depth[other] >= p->depth[i]) continue;
        bool is_b = pair->body_b == i;
        for (int k = 0; k < pair->count && count < MOST_SUPPORTS; ++k) {
            struct support *s = &supports[count];
            s->pair = pair;
            s->point = &contacts->points[pair->first + k];
            s->normal = v3_scale(v3_load(pair->normal), is_b ? 1 : -1);
            s->arm = v3_load(is_b ? s->point->arm_b : s->point->arm_a);
            s->error = sadmm_contact_e(p->system, p->settings, pair, s->point);
            s->impulse = v3(0, 0, 0);
            count += v3_dot(s->normal, approach(s, v)) < 0;
        }
    }
    return count;
}

/* All supports hold, in all directions: the least impulses that stop the body. False where they would pull or slip. */
static bool hold(const double A[36], double mass, const double momentum[6], struct support *supports, int count, double v[6])
{
    double M[36], L[36], g[6], largest = 0, beta = STIFF * mass;
    memcpy(M, A, sizeof M);
    memcpy(g, momentum, sizeof g);
    for (int k = 0; k < count; ++k) {
        vec3 axes[3] = {v3(1, 0, 0), v3(0, 1, 0), v3(0, 0, 1)};
        for (int axis = 0; axis < 3; ++axis) {
            vec3 m = v3_cross(supports[k].arm, axes[axis]);
            const double row[6] = {axes[axis].x, axes[axis].y, axes[axis].z, m.x, m.y, m.z};
            for (int r = 0; r < 6; ++r)
                for (int c = 0; c <= r; ++c) M[6 * r + c] += beta * row[r] * row[c];
        }
        add_impulse(g, supports[k].arm, supports[k].normal, -beta * supports[k].error);
    }
    if (!dense6_cholesky(M, L)) return false;
    dense6_solve(L, g, v);
    for (int k = 0; k < count; ++k) {
        supports[k].impulse = v3_scale(approach(&supports[k], v), -beta);
        largest = fmax(largest, v3_norm(supports[k].impulse));
    }
    for (int k = 0; k < count; ++k) {
        vec3 kept = contact_project(supports[k].impulse, supports[k].normal, supports[k].pair->friction);
        if (v3_norm(v3_sub(kept, supports[k].impulse)) > CONE_SLACK * largest) return false;
        supports[k].impulse = kept;
    }
    return true;
}

/* Contact by contact, Gauss and Seidel's way. */
static void sweep(const double factor[36], double v[6], struct support *supports, int count)
{
    double response[MOST_SUPPORTS];
    for (int k = 0; k < count; ++k) {
        vec3 axes[3] = {v3(1, 0, 0), v3(0, 1, 0), v3(0, 0, 1)};
        response[k] = 0;
        for (int axis = 0; axis < 3; ++axis) {
            double g[6] = {0}, y[6];
            add_impulse(g, supports[k].arm, axes[axis], 1);
            dense6_forward(factor, g, y);
            response[k] += dense6_dot(y, y);
        }
        supports[k].impulse = v3(0, 0, 0);
    }
    for (int s = 0; s < SWEEPS; ++s)
        for (int k = 0; k < count; ++k) {
            vec3 wanted = v3_madd(supports[k].impulse, -1 / response[k], approach(&supports[k], v));
            vec3 next = contact_project(wanted, supports[k].normal, supports[k].pair->friction);
            double g[6] = {0}, change[6];
            add_impulse(g, supports[k].arm, v3_sub(next, supports[k].impulse), 1);
            dense6_solve(factor, g, change);
            for (int j = 0; j < 6; ++j) v[j] += change[j];
            supports[k].impulse = next;
        }
}

/* The supports take what the body brings and hand it down. */
static void settle(struct predictor *p, int32_t i)
{
    struct support supports[MOST_SUPPORTS];
    double A[36], b[6], factor[36], *momentum = &p->momentum[6 * (size_t)i], *v = &p->system->velocity[6 * (size_t)i];
    sadmm_system_body(p->system, p->settings, i, A, b);
    if (!dense6_cholesky(A, factor)) return;
    dense6_solve(factor, momentum, v);
    int count = p->depth[i] ? find_supports(p, i, v, supports) : 0;
    if (count == 0) return;
    double free[6];
    memcpy(free, v, sizeof free);
    if (!hold(A, (A[0] + A[7] + A[14]) / 3, momentum, supports, count, v)) {
        memcpy(v, free, sizeof free);
        sweep(factor, v, supports, count);
    }
    memcpy(free, momentum, sizeof free);
    for (int k = 0; k < count; ++k) {
        const struct support *s = &supports[k];
        int32_t other = other_body(s->pair, i);
        bool is_b = s->pair->body_b == i;
        v3_store(is_b ? s->impulse : v3_neg(s->impulse), s->point->impulse);
        add_impulse(free, s->arm, s->impulse, 1);
        if (other >= 0)
            add_impulse(&p->momentum[6 * (size_t)other], v3_load(is_b ? s->point->arm_a : s->point->arm_b), s->impulse, -1);
    }
    dense6_solve(factor, free, v); /* what was cut off by the cone shows in v */
}

sadmm_status sadmm_loads_predict(struct sadmm_system *system, const struct sadmm_settings *settings,
                                 struct sadmm_error *error)
{
    size_t n = (size_t)system->body_count;
    struct predictor p = {.system = system, .settings = settings};
    p.offsets = sadmm_alloc(n + 2, sizeof *p.offsets);
    p.incident = sadmm_alloc(2 * system->contacts->pair_count, sizeof *p.incident);
    p.depth = sadmm_alloc(n, sizeof *p.depth);
    p.order = sadmm_alloc(n, sizeof *p.order);
    p.momentum = sadmm_alloc(6 * n, sizeof *p.momentum);
    bool room = p.offsets && p.incident && p.depth && p.order && p.momentum;
    if (room) {
        for (size_t k = 0; k < system->contacts->point_count; ++k)
            memset(system->contacts->points[k].impulse, 0, sizeof system->contacts->points[k].impulse);
        list_pairs(&p);
        find_depths(&p);
        for (int32_t i = 0; i < system->body_count; ++i) {
            double A[36];
            sadmm_system_body(system, settings, i, A, &p.momentum[6 * (size_t)i]);
            if (!p.depth[i]) settle(&p, i);
        }
        for (int32_t k = p.reached; k-- > 0;) settle(&p, p.order[k]);
    }
    sadmm_free(p.offsets);
    sadmm_free(p.incident);
    sadmm_free(p.depth);
    sadmm_free(p.order);
    sadmm_free(p.momentum);
    return room ? SADMM_OK : sadmm_fail_memory(error, "the loads to start from");
}
