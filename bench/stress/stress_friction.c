/* Friction: Coulomb's law to its edges, whatever the direction, the step and the force. */
#include "stress.h"

/* A plate of 1 kg, so low that it does not tip at a friction of 10; its faces touch the ground. */
static sadmm_body_id add_plate(struct stress *s, const double orientation[4], const double normal[3], double mu,
                               const double velocity[3])
{
    struct stress_body plate = {.shape = SADMM_SHAPE_BOX, .size = {0.5, 0.5, 0.02}, .mass = 1, .friction = mu};
    for (int k = 0; k < 3; ++k) plate.position[k] = 0.02 * normal[k], plate.velocity[k] = velocity[k];
    for (int k = 0; k < 4; ++k) plate.orientation[k] = orientation[k];
    return stress_add(s, &plate);
}

/* On slopes a little less and a little steeper than the friction angle: it holds, or slides by (g sin a - mu g cos a)
 * t^2 / 2. */
static const char *const slopes[] = {"holds", "slides"};

static void slope(struct stress *s)
{
    const double edge = s->value > 0 ? atan(s->value) : 0.3, angle = s->variant ? 1.02 * edge : 0.98 * edge,
                 a = s->variant ? STRESS_G * (sin(angle) - s->value * cos(angle)) : 0,
                 normal[3] = {sin(angle), 0, cos(angle)}, none[3] = {0}, seconds = stress_seconds(s, 0.5, 5);
    double turn[4];
    if (s->variant == 0 && s->value == 0) { /* nothing holds it: a level floor */
        stress_open(s, STRESS_G);
        stress_add_plane(s, NULL, 0, 0);
        const double up[3] = {0, 0, 1}, level[4] = {1, 0, 0, 0};
        const sadmm_body_id plate = add_plate(s, level, up, 0, none);
        while (s->time < seconds && stress_step(s)) {}
        stress_check(s, "way, m", fabs(stress_state(s, plate).position[0]), s->def.settings.tolerance * seconds);
        return;
    }
    stress_turn(1, angle, turn);
    stress_open(s, STRESS_G);
    stress_add_plane(s, turn, s->value, 0);
    const sadmm_body_id plate = add_plate(s, turn, normal, s->value, none);
    while (s->time < seconds && stress_step(s)) {
        const double *x = stress_state(s, plate).position, way = x[0] * cos(angle) - x[2] * sin(angle),
                     right = a * s->time * s->time / 2;
        /* each step's change of speed is to the tolerance: at worst all of them add up */
        stress_check(s, "way from the formula, m", fabs(way - right),
                     s->def.settings.tolerance * (1 + seconds / stress_dt(s)) * seconds / 2 +
                         right * stress_by(s, 1e-9, 1e-6));
        stress_check(s, "off the slope, m", fabs(x[0] * normal[0] + x[2] * normal[2] - 0.02), 2e-5);
    }
}

/* It slides at 2 m/s in a direction of sixteen until friction has stopped it, after v^2 / (2 mu g). */
enum { HEADINGS = 16 };

static void headings(struct stress *s)
{
    const double speed = 2, mu = s->value, right = speed * speed / (2 * mu * STRESS_G), level[4] = {1, 0, 0, 0},
                 up[3] = {0, 0, 1}, stop = mu * STRESS_G * stress_dt(s) * stress_dt(s);
    double least = INFINITY, most = 0;
    for (int k = 0; k < HEADINGS && stress_ok(s); ++k) {
        const double angle = 2 * M_PI * (k + 0.37) / HEADINGS, along[3] = {cos(angle), sin(angle), 0},
                     velocity[3] = {speed * along[0], speed * along[1], 0};
        stress_open(s, STRESS_G);
        stress_add_plane(s, NULL, mu, 0);
        const sadmm_body_id plate = add_plate(s, level, up, mu, velocity);
        while (s->time < speed / (mu * STRESS_G) + 0.1 && stress_step(s)) {}
        const double *x = stress_state(s, plate).position, way = x[0] * along[0] + x[1] * along[1];
        stress_check(s, "way from the formula, m", fabs(way - right), stop + 1e-5 + stress_rounding(s, speed, s->time));
        stress_check(s, "beside its line, m", fabs(x[1] * along[0] - x[0] * along[1]), 1e-5);
        least = fmin(least, way);
        most = fmax(most, way);
    }
    stress_check(s, "spread of directions, m", most - least,
                 2e-5 + stress_rounding(s, speed, s->time));
}

/* The same by steps of other lengths: within the step in which it stops, the way is of first order. */
static void any_step(struct stress *s)
{
    const double mu = 0.5, speed = 2, right = speed * speed / (2 * mu * STRESS_G), level[4] = {1, 0, 0, 0},
                 up[3] = {0, 0, 1}, velocity[3] = {speed, 0, 0}, dt = s->value;
    s->def.settings.dt = dt;
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, mu, 0);
    const sadmm_body_id plate = add_plate(s, level, up, mu, velocity);
    while (s->time < speed / (mu * STRESS_G) + 2 * dt && stress_step(s)) {}
    stress_check(s, "way from the formula, m", fabs(stress_state(s, plate).position[0] - right),
                 mu * STRESS_G * dt * dt + 1e-5 + stress_rounding(s, speed, s->time));
}

static const struct stress_case cases[] = {
    {.name = "slope",
     .about = "a plate at 0.98 and 1.02 of its friction angle: it holds, or slides by Coulomb's law",
     .parameter = "friction",
     .values = {0, 0.01, 0.1, 0.5, 1, 3, 10},
     .value_count = 7,
     .quick = 0x4b,
     .variants = slopes,
     .variant_count = 2,
     .run = slope},
    {.name = "headings",
     .about = "a plate slides in sixteen directions: one way, v^2 / (2 mu g), in a straight line",
     .parameter = "friction",
     .values = {0.1, 0.5, 1, 5},
     .value_count = 4,
     .quick = 0x2,
     .run = headings},
    {.name = "step_sliding",
     .about = "a plate slides until it stops, steps short and long: the way is v^2 / (2 mu g)",
     .parameter = "dt, s",
     .values = {1e-5, 1e-4, 1e-3, 5e-3, 1.0 / 60, 0.05, 0.1},
     .value_count = 7,
     .quick = 0x7c,
     .run = any_step},
};
const struct stress_group stress_friction = {cases, sizeof cases / sizeof *cases};
