/* Springs, dampers and drives, as stiff as their ranges allow: implicit, so stable by any step. */
#include "stress.h"

static const char *const laws[] = {"spring", "drive"};

/* A body of 1 kg on a vertical slide with a spring or a position drive, let go 0.1 m above where it has no force. */
static void slide(struct stress *s, double stiffness, double damping)
{
    const double height = 0.1, seconds = stress_seconds(s, 2, 50), rest = -STRESS_G / stiffness,
                 start = STRESS_G * height + stiffness * height * height / 2;
    struct stress_body body = {.shape = SADMM_SHAPE_SPHERE, .size = {0.1}, .mass = 1, .position = {0, 0, height}};
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_joint_coordinate *along = &joint.coordinates[2];
    stress_open(s, STRESS_G);
    joint.kind = SADMM_JOINT_PRISMATIC;
    joint.body_b = stress_add(s, &body);
    if (s->variant == 0) {
        along->spring_stiffness = stiffness;
        along->spring_damping = damping;
        along->spring_rest = -height; /* the coordinate is 0 where the body starts */
    } else {
        along->drive = SADMM_DRIVE_POSITION;
        along->drive_stiffness = stiffness;
        along->drive_damping = damping;
        along->target_position = -height;
    }
    stress_join(s, &joint, 0, 0, height, NULL);
    while (s->time < seconds && stress_step(s)) {
        const sadmm_body_state state = stress_state(s, joint.body_b);
        const double z = state.position[2], v = state.linear_velocity[2],
                     energy = v * v / 2 + STRESS_G * z + stiffness * z * z / 2;
        stress_check(s, "energy over the start, share", energy / start - 1, stress_by(s, 1e-9, 1e-5));
        stress_check(s, "beside the slide, m", hypot(state.position[0], state.position[1]), 1e-6);
    }
    /* it creeps towards its rest by exp(-k t / c) where the damper rules, else by half of c */
    const double rate = damping > 2 * sqrt(stiffness) ? stiffness / damping : damping / 2;
    if (rate * seconds > 30)
        stress_check(s, "from its rest, m", fabs(stress_state(s, joint.body_b).position[2] - rest),
                     stress_by(s, 1e-8, 1e-6) + 1e-6 * fabs(rest));
    else if (damping > 0 && stiffness < 1e-6 * damping)
        stress_check(s, "way of what a damper holds, m", fabs(stress_state(s, joint.body_b).position[2] - height),
                     STRESS_G / damping * seconds * (1 + 1e-6) + 1e-6 * seconds);
}

static void stiff(struct stress *s) { slide(s, s->value, 0); }
static void damped(struct stress *s) { slide(s, 1, s->value); }
static void both(struct stress *s) { slide(s, s->value, 1e-3 * s->value); }

/* Two bodies in free space on a spring between two points: it swings, and turns with them. */
static void free_spring(struct stress *s)
{
    const double seconds = stress_seconds(s, 2, 50), stiffness = s->value, pull = 0.01;
    struct stress_body body = {.shape = SADMM_SHAPE_BOX,
                               .size = {0.1, 0.05, 0.03},
                               .mass = 1,
                               .ghost = true,
                               .position = {-0.5, 0, 0},
                               .velocity = {0, -0.1, 0.2},
                               .spin = {1, 0.5, -0.3}};
    sadmm_joint_def joint = sadmm_joint_def_default();
    stress_open(s, 0);
    joint.kind = SADMM_JOINT_SPRING;
    joint.body_a = stress_add(s, &body);
    body.mass = 3;
    body.position[0] = 0.5;
    body.velocity[1] = 0.1;
    joint.body_b = stress_add(s, &body);
    joint.position_a[0] = 0.1;
    joint.position_b[0] = -0.1;
    joint.coordinates[0].spring_stiffness = stiffness;
    joint.coordinates[0].spring_rest = 0.8 - pull;
    sadmm_joint_id id = {0, 0};
    if (stress_ok(s)) stress_must(s, sadmm_world_add_joint(s->world, &joint, &id));
    const struct stress_sums begin = stress_sum(s);
    const double start = begin.kinetic + stiffness * pull * pull / 2;
    while (s->time < seconds && stress_step(s)) {
        const struct stress_sums now = stress_sum(s);
        const double stretch = stress_joint_state(s, id).position[0] - (0.8 - pull),
                     energy = now.kinetic + stiffness * stretch * stretch / 2;
        stress_check(s, "energy over the start, share", energy / start - 1, stress_by(s, 1e-3, 1e-3));
        stress_check(s, "momentum, share", stress_distance(now.momentum, begin.momentum) / now.momentum_scale,
                     stress_by(s, 1e-9, 1e-4));
        stress_check(s, "angular momentum, share", stress_distance(now.turning, begin.turning) / now.turning_scale,
                     stress_by(s, 1e-9, 1e-4));
    }
}

static const struct stress_case cases[] = {
    {.name = "stiffness",
     .about = "a body on a spring or drive: it never has more energy than at the start",
     .parameter = "N/m",
     .values = {1, 1e3, 1e6, 1e9, 1e12},
     .value_count = 5,
     .quick = 0x15,
     .variants = laws,
     .variant_count = 2,
     .run = stiff},
    {.name = "damping",
     .about = "a body on a weak spring with a damper: no more energy, no more way than gravity gives",
     .parameter = "N s/m",
     .values = {1, 1e3, 1e6, 1e9},
     .value_count = 4,
     .quick = 0xa,
     .variants = laws,
     .variant_count = 2,
     .run = damped},
    {.name = "stiff_damped",
     .about = "both, c = 1 ms k: it comes to rest at -m g / k",
     .parameter = "N/m",
     .values = {1e3, 1e6, 1e9, 1e12},
     .value_count = 4,
     .quick = 0x9,
     .variants = laws,
     .variant_count = 2,
     .run = both},
    {.name = "free_spring",
     .about = "two bodies swing and turn on a spring: energy, both momenta",
     .parameter = "N/m",
     .values = {10, 1e4, 1e8, 1e12},
     .value_count = 4,
     .quick = 0x5,
     .run = free_spring},
};
const struct stress_group stress_springs = {cases, sizeof cases / sizeof *cases};
