#include "impulse_initialisation.h"

#include <math.h>
#include <string.h>

#include "core/math/dense6.h"
#include "core/model/islands.h"
#include "core/base/memory.h"
#include "core/model/system_math.h"

enum { MOST_SUPPORTS = 64 };
/* Stiffness of supports over the body's mass: a body that is stopped keeps one part in this of its motion. With what is
 * handed down the motion of a light body under a heavy one is far larger than any in the scene: where it keeps more
 * than KEPT of its own free motion it is stopped again, by impulses that are one part in STIFF of the first. */
#define STIFF 1e7
#define KEPT 1e-4
enum { STOPS = 3 };
/* Impulses outside of their cone by this share of the largest one: the supports' softness and rounding. */
#define CONE_SLACK 1e-6
/* Errors up to this share of the motion to be stopped are left to the iteration. */
#define LEFT_OVER 1e-3

struct initialisation {
    struct sadmm_system *system;
    const struct sadmm_settings *settings;
    int32_t *offsets, *incident; /* body -> its pairs: (bodies + 2), twice the pairs */
    int32_t *depth, *order;      /* contacts between a body and the ground, 0: none lead there; bodies, nearest first */
    int32_t *label;              /* islands */
    bool *failed;                /* of islands, at their labels */
    double *momentum;            /* bodies x 6: b and what was handed down */
    int32_t reached;             /* bodies in `order` */
};

/* A contact that stops a body. */
struct support {
    const struct sadmm_contact_pair *pair;
    struct sadmm_contact_point *point;
    vec3 normal, arm, impulse; /* towards the body, from its centre, on it */
};

static int32_t other_body(const struct sadmm_contact_pair *pair, int32_t i)
{
    return pair->body_a == i ? pair->body_b : pair->body_a;
}

static void list_pairs(struct initialisation *p)
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
static void find_depths(struct initialisation *p)
{
    const struct sadmm_contact_set *contacts = p->system->contacts;
    for (int32_t i = 0; i < p->system->body_count; ++i) {
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

static vec3 point_velocity(const double v[6], vec3 arm) { return v3_add(v3_load(v), v3_cross(v3_load(v + 3), arm)); }

/* Contacts with nearer ones that the body would move into with velocity v; -1: one of them has to push it off. */
static int find_supports(const struct initialisation *p, int32_t i, const double v[6],
                         struct support supports[MOST_SUPPORTS])
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
            double closing = -v3_dot(s->normal, point_velocity(v, s->arm));
            double e = sadmm_contact_e(p->system, p->settings, pair, &contacts->points[pair->first], k);
            if (e < -LEFT_OVER * fabs(closing)) return -1;
            count += e < LEFT_OVER * closing;
        }
    }
    return count;
}

static void add_impulse(double g[6], vec3 arm, vec3 impulse)
{
    vec3 torque = v3_cross(arm, impulse);
    g[0] += impulse.x, g[1] += impulse.y, g[2] += impulse.z;
    g[3] += torque.x, g[4] += torque.y, g[5] += torque.z;
}

/* Size of v as the speed of what has its energy. */
static double speed(const double A[36], const double v[6])
{
    double momentum[6];
    dense6_mul(A, v, momentum);
    return sqrt(dense6_dot(momentum, v) / ((A[0] + A[7] + A[14]) / 3));
}

/* The least impulses that stop the body: those of stiff dampers; `own`: speed of its free motion. False where contacts
 * cannot give them. */
static bool hold(const double A[36], const double momentum[6], double own, struct support *supports, int count,
                 double v[6])
{
    static const double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double M[36], L[36], left[6], largest = 0, stiffness = STIFF * (A[0] + A[7] + A[14]) / 3;
    memcpy(M, A, sizeof M);
    for (int k = 0; k < count; ++k)
        for (int axis = 0; axis < 3; ++axis) {
            double row[6] = {0};
            add_impulse(row, supports[k].arm, v3_load(axes[axis]));
            for (int r = 0; r < 6; ++r)
                for (int c = 0; c <= r; ++c) M[6 * r + c] += stiffness * row[r] * row[c];
        }
    if (!dense6_cholesky(M, L)) return false;
    for (int k = 0; k < count; ++k) supports[k].impulse = v3(0, 0, 0);
    memcpy(left, momentum, sizeof left);
    for (int stops = 0; stops < STOPS; ++stops) {
        dense6_solve(L, left, v);
        for (int k = 0; k < count; ++k)
            supports[k].impulse = v3_madd(supports[k].impulse, -stiffness, point_velocity(v, supports[k].arm));
        if (speed(A, v) <= KEPT * own) break;
        dense6_mul(A, v, left);
    }
    for (int k = 0; k < count; ++k) largest = fmax(largest, v3_norm(supports[k].impulse));
    for (int k = 0; k < count; ++k) {
        vec3 within = contact_project(supports[k].impulse, supports[k].normal, supports[k].pair->friction);
        if (v3_norm(v3_sub(within, supports[k].impulse)) > CONE_SLACK * largest) return false;
    }
    return true;
}

/* A body's supports take what it brings and hand it on. False where they cannot stop it. */
static bool stop(struct initialisation *p, int32_t i)
{
    struct support supports[MOST_SUPPORTS];
    double A[36], b[6], L[36], *momentum = &p->momentum[6 * (size_t)i], *v = &p->system->velocity[6 * (size_t)i];
    sadmm_system_body(p->system, p->settings, i, A, b);
    if (!dense6_cholesky(A, L)) return false;
    dense6_solve(L, b, v);
    double own = speed(A, v);
    dense6_solve(L, momentum, v);
    double before = speed(A, v);
    int count = find_supports(p, i, v, supports);
    if (count < 0 || !hold(A, momentum, own, supports, count, v) || speed(A, v) > LEFT_OVER * before) return false;
    for (int k = 0; k < count; ++k) {
        const struct support *s = &supports[k];
        int32_t other = other_body(s->pair, i);
        bool is_b = s->pair->body_b == i;
        v3_store(is_b ? s->impulse : v3_neg(s->impulse), s->point->impulse);
        if (other >= 0)
            add_impulse(&p->momentum[6 * (size_t)other], v3_load(is_b ? s->point->arm_a : s->point->arm_b),
                        v3_neg(s->impulse));
    }
    return true;
}

/* Islands that were not stopped start from nothing. */
static void forget_failures(struct initialisation *p)
{
    struct sadmm_system *system = p->system;
    for (size_t at = 0; at < system->contacts->pair_count; ++at) {
        const struct sadmm_contact_pair *pair = &system->contacts->pairs[at];
        if (!p->failed[p->label[pair->body_a >= 0 ? pair->body_a : pair->body_b]]) continue;
        for (int k = 0; k < pair->count; ++k)
            memset(system->contacts->points[pair->first + k].impulse, 0, 3 * sizeof(double));
    }
    for (int32_t i = 0; i < system->body_count; ++i) {
        double A[36], b[6], L[36];
        if (!p->failed[p->label[i]]) continue;
        sadmm_system_body(system, p->settings, i, A, b);
        if (dense6_cholesky(A, L)) dense6_solve(L, b, &system->velocity[6 * (size_t)i]);
    }
}

static void initialise(struct initialisation *p)
{
    struct sadmm_system *system = p->system;
    for (size_t k = 0; k < system->contacts->point_count; ++k)
        memset(system->contacts->points[k].impulse, 0, sizeof system->contacts->points[k].impulse);
    for (size_t k = 0; system->rows && k < system->rows->row_count; ++k) system->rows->lambda[k] = 0;
    list_pairs(p);
    find_depths(p);
    sadmm_islands(system, p->label);
    for (size_t k = 0; k < sadmm_row_constraint_count(system); ++k) { /* impulses of rows are not initialised */
        const struct sadmm_row_constraint *constraint = &system->rows->constraints[k];
        p->failed[p->label[constraint->body_a >= 0 ? constraint->body_a : constraint->body_b]] = true;
    }
    /* what moves stops nothing */
    for (size_t k = 0; system->kinematic_count > 0 && k < system->contacts->pair_count; ++k) {
        const struct sadmm_contact_pair *pair = &system->contacts->pairs[k];
        if (sadmm_pair_gives_energy(system, pair))
            p->failed[p->label[pair->body_a >= 0 ? pair->body_a : pair->body_b]] = true;
    }
    for (int32_t i = 0; i < system->body_count; ++i) {
        double A[36];
        sadmm_system_body(system, p->settings, i, A, &p->momentum[6 * (size_t)i]);
        if (!p->depth[i]) p->failed[p->label[i]] = true;
    }
    for (int32_t k = p->reached; k-- > 0;) {
        int32_t i = p->order[k];
        if (!p->failed[p->label[i]] && !stop(p, i)) p->failed[p->label[i]] = true;
    }
    forget_failures(p);
}

sadmm_status sadmm_impulses_initialise(struct sadmm_system *system, const struct sadmm_settings *settings,
                                       struct sadmm_error *error)
{
    size_t n = (size_t)system->body_count;
    struct initialisation p = {.system = system, .settings = settings};
    p.offsets = sadmm_alloc(n + 2, sizeof *p.offsets);
    p.incident = sadmm_alloc(2 * system->contacts->pair_count, sizeof *p.incident);
    p.depth = sadmm_alloc(n, sizeof *p.depth);
    p.order = sadmm_alloc(n, sizeof *p.order);
    p.label = sadmm_alloc(n, sizeof *p.label);
    p.failed = sadmm_alloc(n, sizeof *p.failed);
    p.momentum = sadmm_alloc(6 * n, sizeof *p.momentum);
    bool allocated = p.offsets && p.incident && p.depth && p.order && p.label && p.failed && p.momentum;
    if (allocated) initialise(&p);
    sadmm_free(p.offsets);
    sadmm_free(p.incident);
    sadmm_free(p.depth);
    sadmm_free(p.order);
    sadmm_free(p.label);
    sadmm_free(p.failed);
    sadmm_free(p.momentum);
    return allocated ? SADMM_OK : sadmm_fail_memory(error, "the initial impulses");
}
