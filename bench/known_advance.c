#include "known_make.h"

#include <math.h>

#include "core/math/quat.h"

static const double g = 9.81;

/* ---- events ---------------------------------------------------------------------------------------------------- */

/* Until the next one. */
static double event_in(const struct known_motion *m, double now)
{
    const sadmm_body_state *a = &m->system.bodies[0].state, *b = &m->system.bodies[1].state;
    switch (m->event) {
    case EVENT_STOPS:
    case EVENT_GRIPS: return m->event_time > now ? m->event_time - now : HUGE_VAL;
    case EVENT_HITS_GROUND: {
        const double down = -a->linear_velocity[2], room = fmax(0, a->position[2] - m->scale);
        const double next = (sqrt(down * down + 2 * g * room) - down) / g;
        return down > 0 || next > 1e-3 * sqrt(m->scale / g) ? next : HUGE_VAL; /* there may be no end to them */
    }
    case EVENT_HITS_BALL: {
        const vec3 way = v3_sub(v3_load(b->position), v3_load(a->position)),
                   speed = v3_sub(v3_load(b->linear_velocity), v3_load(a->linear_velocity));
        const double reach = m->shapes[0].size[0] + m->shapes[1].size[0], along = v3_dot(way, speed),
                     square = v3_norm2(speed), root = along * along - square * (v3_norm2(way) - reach * reach);
        return along < 0 && root > 0 ? (-along - sqrt(root)) / square : HUGE_VAL;
    }
    case EVENT_NONE: break;
    }
    return HUGE_VAL;
}

static vec3 speed_at(const sadmm_body_state *s, vec3 arm)
{
    return v3_add(v3_load(s->linear_velocity), v3_cross(v3_load(s->angular_velocity), arm));
}

/* Newton's law along the normal and Coulomb's across it, of balls; a: -1: the ground. */
static void hit(struct known_motion *m, int a, int b, vec3 normal)
{
    const vec3 none = v3(0, 0, 0);
    vec3 arm[2] = {none, v3_scale(normal, -m->shapes[b].size[0])}, x = none;
    double by_mass = 0, across = 0;
    if (a >= 0) arm[0] = v3_scale(normal, m->shapes[a].size[0]);
    for (int s = 0; s < 2; ++s) {
        const int i = s ? b : a;
        if (i < 0) continue;
        const struct exact_body *body = &m->system.bodies[i];
        x = v3_madd(x, s ? 1 : -1, speed_at(&body->state, arm[s]));
        by_mass += 1 / body->mass;
        across += 1 / body->mass + v3_norm2(arm[s]) / body->inertia[0];
    }
    const double speed = v3_dot(x, normal), push = -(1 + m->restitution) * speed / by_mass;
    const vec3 slip = v3_madd(x, -speed, normal);
    const double size = v3_norm(slip), drag = size > 0 ? fmin(size / across, m->friction * push) / size : 0;
    const vec3 impulse = v3_madd(v3_scale(normal, push), -drag, slip);
    for (int s = 0; s < 2; ++s) {
        const int i = s ? b : a;
        if (i < 0) continue;
        struct exact_body *body = &m->system.bodies[i];
        const double sign = s ? 1 : -1;
        double *v = body->state.linear_velocity, *w = body->state.angular_velocity;
        v3_store(v3_madd(v3_load(v), sign / body->mass, impulse), v);
        v3_store(v3_madd(v3_load(w), sign / body->inertia[0], v3_cross(arm[s], impulse)), w);
    }
    m->system.least_load = fmin(m->system.least_load, m->system.bodies[b].mass * fabs(speed));
}

static void happen(struct known_motion *m)
{
    sadmm_body_state *a = &m->system.bodies[0].state, *b = &m->system.bodies[1].state;
    switch (m->event) {
    case EVENT_STOPS:
        for (int k = 0; k < 3; ++k) a->linear_velocity[k] = m->system.gravity[k] = 0;
        break;
    case EVENT_GRIPS: m->system.links[0].hold = EXACT_GRIPS; break;
    case EVENT_HITS_GROUND: hit(m, -1, 0, v3(0, 0, 1)); break;
    case EVENT_HITS_BALL: {
        const vec3 way = v3_sub(v3_load(b->position), v3_load(a->position));
        hit(m, 0, 1, v3_scale(way, 1 / v3_norm(way)));
    }
    case EVENT_NONE: break;
    }
}

/* In steps that are short against the slowest motion: energies stay to 1e-6 (tests/test_order.c). */
static void integrate(struct known_motion *m, double seconds)
{
    const int steps = (int)ceil(seconds / (4e-3 * sqrt(m->scale / g)));
    for (int k = 0; k < steps; ++k) exact_step(&m->system, seconds / steps);
}

void known_motion_advance(struct known_motion *m, double *now, double seconds)
{
    const double end = *now + seconds;
    for (double next = event_in(m, *now); *now + next < end; next = event_in(m, *now)) {
        integrate(m, next);
        *now += next;
        if (m->event == EVENT_STOPS || m->event == EVENT_GRIPS) *now = m->event_time;
        happen(m);
    }
    integrate(m, end - *now);
    *now = end;
}
