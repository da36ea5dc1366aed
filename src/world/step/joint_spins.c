/* How bodies turn in a step (core/model/spin.h), four at once. */
#include "core/math/lanes.h"
#include "joint_kernels.h"

enum { LANES = 4 };
static inline lanes least(lanes a, lanes b) { return lanes_choose(a < b, a, b); }
static inline lanes most(lanes a, lanes b) { return lanes_choose(a > b, a, b); }
static inline lanes size(lanes a) { return lanes_choose(a < 0, -a, a); }
static inline lanes largest(struct lanes3 a) { return most(size(a.x), most(size(a.y), size(a.z))); }
static inline bool any(lanes_mask which) { return (which[0] | which[1]) | (which[2] | which[3]); }

static inline struct lanes3 turned_back(const struct lanes_matrix *R, struct lanes3 v) /* m3_tmul */
{
    const struct lanes3 *r = R->r;
    return (struct lanes3){r[0].x * v.x + v.y * r[1].x + v.z * r[2].x, r[0].y * v.x + v.y * r[1].y + v.z * r[2].y,
                           r[0].z * v.x + v.y * r[1].z + v.z * r[2].z};
}
static inline struct lanes3 each(struct lanes3 a, struct lanes3 b)
{
    return (struct lanes3){a.x * b.x, a.y * b.y, a.z * b.z};
}

/* rigid_mean_spin */
static inline struct lanes3 mean_spin(struct lanes3 w, struct lanes3 c)
{
    const lanes rate = largest(c) * largest(w), faster = rate * rate * rate;
    const lanes_mask slow = rate < (real)0.5;
    lanes error = lanes_fill(1);
    struct lanes3 m = w;
    lanes_mask on = {-1, -1, -1, -1};
    do {
        struct lanes3 next = m;
        for (int k = 0; k < 2; ++k) {
            next.x = w.x - c.x * (next.y * next.z);
            next.y = w.y - c.y * (next.z * next.x);
            next.z = w.z - c.z * (next.x * next.y);
        }
        m.x = lanes_choose(on, next.x, m.x), m.y = lanes_choose(on, next.y, m.y), m.z = lanes_choose(on, next.z, m.z);
        error *= faster;
        on &= (error > SADMM_EPSILON) & slow;
    } while (any(on));
    return m;
}

struct turning {
    struct lanes_quat q;
    struct lanes_matrix R;
    struct lanes3 own;
};

/* As bodies are turned, with spins in the world. */
static inline struct turning turning_of(const double *const orientation[LANES], struct lanes3 spin)
{
    lanes q[4];
    struct turning t;
    lanes_gather(orientation, q);
    t.q = (struct lanes_quat){q[0], q[1], q[2], q[3]};
    t.R = lanes_matrix_of(t.q);
    t.own = turned_back(&t.R, spin);
    return t;
}

/* rigid_tumble_on. Returns where it is not that: of bodies whose moments are equal, that do not turn or turn far. */
static inline lanes_mask tumble(struct turning *t, struct lanes3 inertia, double dt)
{
    const struct lanes3 p = each(inertia, t->own);
    const lanes energy2 = lanes3_dot(p, t->own), momentum2 = lanes3_dot(p, p), half = lanes_fill(dt / 2),
                lo = least(inertia.x, least(inertia.y, inertia.z)), hi = most(inertia.x, most(inertia.y, inertia.z)),
                square = lanes_fill(dt * dt) * ((lo + hi) * energy2 - momentum2);
    const lanes_mask other = (hi - lo <= lanes_fill(4 * SADMM_EPSILON) * hi) | ~(largest(t->own) > 0) |
                         ~(lanes_fill(4) * square <= lo * hi);
    const lanes rate2 = energy2 / momentum2 * energy2, y = half * half * rate2, z = least(y, lanes_fill(0.0625)),
                tangent = (lanes_fill(10395) - z * (lanes_fill(1260) - lanes_fill(21) * z)) /
                          (lanes_fill(10395) - z * (lanes_fill(4725) - z * (lanes_fill(210) - z))),
                stretched = half * tangent;
    const struct lanes3 c = {stretched * ((inertia.z - inertia.y) / inertia.x),
                             stretched * ((inertia.x - inertia.z) / inertia.y),
                             stretched * ((inertia.y - inertia.x) / inertia.z)},
                        m = mean_spin(t->own, c);
    const struct lanes_quat q = lanes_quat_mul(
        t->q, (struct lanes_quat){lanes_fill(1), stretched * m.x, stretched * m.y, stretched * m.z});
    const lanes two = lanes_fill(2);
    t->q = lanes_quat_normalize(q);
    t->own = (struct lanes3){m.x * two - t->own.x, m.y * two - t->own.y, m.z * two - t->own.z};
    t->R = lanes_matrix_of(t->q);
    return other;
}

static inline struct lanes3 inertia_of(const struct sadmm_rigid *const body[LANES])
{
    const double *const from[LANES] = {body[0]->inertia, body[1]->inertia, body[2]->inertia, body[3]->inertia};
    lanes to[4];
    lanes_gather(from, to);
    return (struct lanes3){to[0], to[1], to[2]};
}

/* Of four bodies; others than these four numbers: `ahead`, which is 0. */
static inline lanes_mask find_four(const struct sadmm_rigid *const body[LANES], double dt, double *const out[LANES])
{
    const double *const at[LANES] = {body[0]->orientation, body[1]->orientation, body[2]->orientation,
                                     body[3]->orientation},
                 *const spin[LANES] = {body[0]->velocity + 3, body[1]->velocity + 3, body[2]->velocity + 3,
                                       body[3]->velocity + 3};
    const struct lanes3 inertia = inertia_of(body);
    lanes w[4];
    lanes_gather(spin, w);
    struct turning t = turning_of(at, (struct lanes3){w[0], w[1], w[2]});
    const struct lanes3 momentum = lanes_turn(&t.R, each(inertia, t.own));
    const lanes_mask other = tumble(&t, inertia, dt / 2);
    const struct lanes3 angular = lanes_turn(&t.R, t.own), *r = t.R.r;
    const lanes zero = lanes_fill(0);
    lanes_scatter(t.q.w, t.q.x, t.q.y, t.q.z, out, 0);
    lanes_scatter(r[0].x, r[0].y, r[0].z, r[1].x, out, 4);
    lanes_scatter(r[1].y, r[1].z, r[2].x, r[2].y, out, 8);
    lanes_scatter(r[2].z, angular.x, angular.y, angular.z, out, 12);
    lanes_scatter(momentum.x, momentum.y, momentum.z, zero, out, 16);
    for (int k = 0; k < LANES; ++k) out[k][20] = out[k][21] = 0;
    return other;
}

_Static_assert(sizeof(struct spin_system) == 22 * sizeof(double), "what find_four writes");

void SADMM_KERNEL(joint_spins)(const struct sadmm_rigid *bodies, size_t count, double dt, struct spin_system *out)
{
    for (size_t first = 0; first < count; first += LANES) {
        const struct sadmm_rigid *body[LANES];
        struct spin_system rest[LANES];
        double *to[LANES];
        for (size_t k = 0; k < LANES; ++k) {
            const bool there = first + k < count;
            body[k] = &bodies[there ? first + k : first];
            to[k] = (double *)(there ? &out[first + k] : &rest[k]);
        }
        const lanes_mask other = find_four(body, dt, to);
        for (size_t k = 0; k < LANES && first + k < count; ++k)
            if (other[k] || rolling_turns_on(body[k])) out[first + k] = spin_of_system(body[k], dt);
    }
}

void SADMM_KERNEL(joint_moves)(const struct joint_movement *bodies, size_t count, double dt)
{
    for (size_t first = 0; first < count; first += LANES) {
        struct joint_movement all[LANES];
        for (size_t k = 0; k < LANES; ++k) all[k] = bodies[first + k < count ? first + k : first];
        const struct sadmm_rigid *const body[LANES] = {all[0].from, all[1].from, all[2].from, all[3].from};
        const double *const at[LANES] = {all[0].halfway, all[1].halfway, all[2].halfway, all[3].halfway},
                     *const spin[LANES] = {all[0].velocity + 2, all[1].velocity + 2, all[2].velocity + 2,
                                           all[3].velocity + 2};
        lanes w[4], orientation[4];
        lanes_gather(spin, w);
        struct turning t = turning_of(at, (struct lanes3){w[1], w[2], w[3]});
        const lanes_mask other = tumble(&t, inertia_of(body), dt / 2);
        const struct lanes3 angular = lanes_turn(&t.R, t.own);
        orientation[0] = t.q.w, orientation[1] = t.q.x, orientation[2] = t.q.y, orientation[3] = t.q.z;
        lanes_transpose(orientation);
        for (size_t k = 0; k < LANES && first + k < count; ++k) {
            const double *v = all[k].velocity, *before = body[k]->velocity;
            struct sadmm_rigid *next = all[k].next;
            if (other[k] || rolling_turns_on(body[k])) {
                joint_move(body[k], all[k].halfway, v, false, dt, next->position, next->orientation, next->velocity);
                continue;
            }
            for (int j = 0; j < 3; ++j) {
                next->position[j] = body[k]->position[j] + dt * ((before[j] + v[j]) / 2);
                next->velocity[j] = v[j];
            }
            lanes_put(orientation[k], next->orientation);
            next->velocity[3] = angular.x[k], next->velocity[4] = angular.y[k], next->velocity[5] = angular.z[k];
        }
    }
}
