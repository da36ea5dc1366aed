/* The impact of two bodies at the points where they touch, at one moment: Newton's law along the normal, Coulomb's
 * across it, for all points at once.
 *
 *     0 <= lambda_n  _|_  x_n+ - bounce >= 0,     |lambda_t| <= mu lambda_n, opposite to x_t+,     x+ = x- + G lambda
 *
 * bounce is epsilon times the speed of approach at points that approach faster than the threshold, 0 at slower ones,
 * and what parts may not come back faster than epsilon times that. Friction can make this law give energy (Kane's
 * paradox, impact.h): epsilon is then lowered to the largest value that does not. Double on every precision. */
#ifndef SADMM_MATH_HIT_H
#define SADMM_MATH_HIT_H

#include "impact.h"

enum { HIT_POINTS = 8, HIT_SWEEPS = 4000, HIT_HALVINGS = 40 };
/* The sweeps end where they change the impulses by less than this share. */
#define HIT_ROUNDING 1e-14

/* One of two bodies: what an impulse changes. */
struct hit_body {
    double inverse_mass;  /* 1/kg; 0: nothing moves it */
    mat3 inverse_inertia; /* world, 1/(kg m^2) */
    vec3 linear, angular; /* velocity before, m/s, rad/s */
};

struct hit {
    struct hit_body body[2]; /* a, b: the normal points from a to b */
    mat3 frame;              /* rows n, t1, t2 */
    double friction, restitution, threshold;
    int count;
    vec3 arm[2][HIT_POINTS];  /* from the centres of mass, m, world */
    vec3 impulse[HIT_POINTS]; /* out: on b, in the frame, N s */
};

/* Velocity of b's point relative to a's. */
SADMM_INLINE vec3 hit_velocity(const struct hit *h, int k)
{
    const vec3 a = v3_add(h->body[0].linear, v3_cross(h->body[0].angular, h->arm[0][k])),
               b = v3_add(h->body[1].linear, v3_cross(h->body[1].angular, h->arm[1][k]));
    return m3_mul(h->frame, v3_sub(b, a));
}

/* What an impulse (world) at point j changes x by at point k, in the frame. */
SADMM_INLINE vec3 hit_response(const struct hit *h, int k, int j, vec3 impulse)
{
    vec3 sum = v3(0, 0, 0);
    int side;
    for (side = 0; side < 2; ++side) {
        const vec3 turn = m3_mul(h->body[side].inverse_inertia, v3_cross(h->arm[side][j], impulse));
        sum = v3_add(sum, v3_madd(v3_cross(turn, h->arm[side][k]), h->body[side].inverse_mass, impulse));
    }
    return m3_mul(h->frame, sum);
}

/* G, in the frame: G[k][j] maps the impulse at j to the change at k. x: velocities before. */
struct hit_system {
    mat3 G[HIT_POINTS][HIT_POINTS];
    vec3 x[HIT_POINTS];
    double tangent[HIT_POINTS]; /* the largest response across the normal */
};

SADMM_INLINE void hit_system_of(const struct hit *h, struct hit_system *s)
{
    int k, j, c;
    for (k = 0; k < h->count; ++k) {
        s->x[k] = hit_velocity(h, k);
        for (j = 0; j < h->count; ++j) {
            vec3 column[3];
            for (c = 0; c < 3; ++c) column[c] = hit_response(h, k, j, h->frame.r[c]);
            s->G[k][j].r[0] = v3(column[0].x, column[1].x, column[2].x);
            s->G[k][j].r[1] = v3(column[0].y, column[1].y, column[2].y);
            s->G[k][j].r[2] = v3(column[0].z, column[1].z, column[2].z);
        }
        {
            const mat3 *G = &s->G[k][k];
            const real half = (G->r[1].y - G->r[2].z) / 2;
            s->tangent[k] = (double)((G->r[1].y + G->r[2].z) / 2 + real_sqrt(half * half + G->r[1].z * G->r[1].z));
        }
    }
}

SADMM_INLINE vec3 hit_after(const struct hit_system *s, int count, const vec3 lambda[HIT_POINTS], int k)
{
    vec3 x = s->x[k];
    int j;
    for (j = 0; j < count; ++j) x = v3_add(x, m3_mul(s->G[k][j], lambda[j]));
    return x;
}

/* The normal speed that a point has to leave with, at least. */
SADMM_INLINE double hit_bounce(const struct hit *h, double x, double restitution)
{
    return x < -h->threshold || x > 0 ? -restitution * x : 0;
}

/* One sweep over the points, normal and tangent each by its own response. Returns the change over the size. */
SADMM_INLINE double hit_sweep(const struct hit *h, const struct hit_system *s, double restitution,
                              vec3 lambda[HIT_POINTS])
{
    double size = 0, change = 0;
    int k;
    for (k = 0; k < h->count; ++k) {
        const vec3 old = lambda[k];
        vec3 x = hit_after(s, h->count, lambda, k);
        lambda[k].x = real_max(old.x - (x.x - hit_bounce(h, s->x[k].x, restitution)) / s->G[k][k].r[0].x, 0);
        x = v3_add(x, v3_scale(v3(s->G[k][k].r[0].x, s->G[k][k].r[1].x, s->G[k][k].r[2].x), lambda[k].x - old.x));
        {
            const real y[3] = {lambda[k].x, old.y - x.y / s->tangent[k], old.z - x.z / s->tangent[k]};
            real out[3];
            contact_project_rows(y, h->friction, out);
            lambda[k] = v3(out[0], out[1], out[2]);
        }
        size = max_of(size, v3_max_abs(lambda[k]));
        change = max_of(change, v3_max_abs(v3_sub(lambda[k], old)));
    }
    return size > 0 ? change / size : 0;
}

/* Twice the energy that the law gives, J, less what may be rounding; `lambda` starts from what it holds. */
SADMM_INLINE double hit_gain(const struct hit *h, const struct hit_system *s, double restitution,
                             vec3 lambda[HIT_POINTS])
{
    double gain = 0, most = 0;
    int k;
    for (k = 0; k < HIT_SWEEPS && hit_sweep(h, s, restitution, lambda) > HIT_ROUNDING; ++k) {}
    for (k = 0; k < h->count; ++k) {
        const vec3 after = hit_after(s, h->count, lambda, k);
        gain += v3_dot(lambda[k], v3_add(after, s->x[k]));
        most += v3_norm(lambda[k]) * (v3_norm(s->x[k]) + v3_norm(after));
    }
    return gain - IMPACT_NOTHING * most;
}

SADMM_INLINE void hit_solve(struct hit *h)
{
    struct hit_system s;
    double low = 0, high = h->restitution;
    int k;
    hit_system_of(h, &s);
    for (k = 0; k < h->count; ++k) h->impulse[k] = v3(0, 0, 0);
    if (hit_gain(h, &s, high, h->impulse) <= 0) return;
    for (k = 0; k < HIT_HALVINGS; ++k) {
        const double middle = (low + high) / 2;
        if (hit_gain(h, &s, middle, h->impulse) <= 0) low = middle;
        else high = middle;
    }
    hit_gain(h, &s, low, h->impulse);
}

/* The impulse at a point on side 0 or 1, in the world. */
SADMM_INLINE vec3 hit_impulse(const struct hit *h, int k, int side)
{
    const vec3 f = m3_tmul(h->frame, h->impulse[k]);
    return side ? f : v3_neg(f);
}

/* Velocities after. */
SADMM_INLINE void hit_apply(const struct hit *h, int side, vec3 *linear, vec3 *angular)
{
    const struct hit_body *body = &h->body[side];
    vec3 force = v3(0, 0, 0), torque = v3(0, 0, 0);
    int k;
    for (k = 0; k < h->count; ++k) {
        const vec3 f = hit_impulse(h, k, side);
        force = v3_add(force, f);
        torque = v3_add(torque, v3_cross(h->arm[side][k], f));
    }
    *linear = v3_madd(body->linear, body->inverse_mass, force);
    *angular = v3_add(body->angular, m3_mul(body->inverse_inertia, torque));
}

#endif
