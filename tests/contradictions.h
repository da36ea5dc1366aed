/* Worlds whose joints, or they and contacts, ask for what no motion meets, by too little to open by more than a step
 * closes. */
#ifndef SADMM_TESTS_CONTRADICTIONS_H
#define SADMM_TESTS_CONTRADICTIONS_H

#include "scene_tools.h"

enum contradiction {
    TWO_WELDS,
    TWO_WORLD_WELDS,
    TWO_DISTANCES,
    PULLED_WELDS,  /* to the world, and to a kinematic body that leaves at 1 cm/s */
    DRIVEN_LIMIT,  /* a drive of unlimited force, at a limit */
    DRIVEN_GEAR,   /* two, and a gear that has one turn against the other */
    LOCKED_LIMITS, /* a slide with one place, and a weld in another one */
    WELDS_ON_FLOOR, /* a box that rests, clamped in two places */
    WELD_IN_FLOOR,  /* clamped, and 1 cm deep in the floor */
    CONTRADICTIONS
};

static const double contradiction = 1e-4; /* m; m/s, rad/s */

static inline sadmm_body_id add_welded_box(sadmm_world *world, sadmm_body_type type, double x, double z)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_body_id id;
    def.type = type;
    def.mass = type == SADMM_BODY_DYNAMIC ? 1 : 0;
    for (int j = 0; j < 3; ++j) def.inertia[j] = def.mass * 0.1 * 0.1 * 2 / 3, shape.size[j] = 0.1;
    def.position[0] = x, def.position[2] = z;
    shape.type = SADMM_SHAPE_BOX;
    MUST(world, sadmm_world_add_body(world, &def, &id));
    MUST(world, sadmm_world_add_shape(world, id, &shape, NULL));
    return id;
}

/* b, placed in a's frame, or in the world's. */
static inline sadmm_joint_id join_at(sadmm_world *world, sadmm_joint_kind kind, const sadmm_body_id *a,
                                     sadmm_body_id b, double x, double z, const sadmm_joint_coordinate *along)
{
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_joint_id id;
    joint.kind = kind;
    if (a) joint.body_a = *a;
    joint.body_b = b;
    if (kind == SADMM_JOINT_DISTANCE) joint.length = x;
    else joint.position_a[0] = x, joint.position_a[2] = z;
    if (along) joint.coordinates[kind == SADMM_JOINT_REVOLUTE ? 5 : 2] = *along;
    MUST(world, sadmm_world_add_joint(world, &joint, &id));
    return id;
}

static inline void add_driven_gear(sadmm_world *world, sadmm_body_id a, sadmm_body_id b, bool consistent)
{
    sadmm_joint_coordinate turn = sadmm_joint_def_default().coordinates[0];
    sadmm_gear_def gear = sadmm_gear_def_default();
    turn.drive = SADMM_DRIVE_SPEED;
    turn.target_speed = contradiction;
    gear.joint_1 = join_at(world, SADMM_JOINT_REVOLUTE, NULL, a, 0, 1, &turn), gear.coordinate_1 = 5;
    gear.joint_2 = join_at(world, SADMM_JOINT_REVOLUTE, NULL, b, 1, 1, &turn), gear.coordinate_2 = 5;
    gear.ratio = consistent ? -1 : 1; /* q_1 + ratio q_2 stays */
    MUST(world, sadmm_world_add_gear(world, &gear, NULL));
}

/* consistent: the same rows, which agree. Beside them a pendulum, whose joint is no concern of theirs. */
static inline sadmm_world *contradict(const sadmm_world_def *def, enum contradiction kind, bool consistent)
{
    const double off = consistent ? 0 : contradiction,
                 z = kind == WELDS_ON_FLOOR              ? 0.1
                     : kind == WELD_IN_FLOOR ? 0.1 - 100 * off
                                             : 1;
    sadmm_world *world = create_world(def);
    const sadmm_body_id pendulum = add_welded_box(world, SADMM_BODY_DYNAMIC, 5, 1);
    const sadmm_body_id a = add_welded_box(world, SADMM_BODY_DYNAMIC, 0, z);
    sadmm_joint_coordinate along = sadmm_joint_def_default().coordinates[0];
    sadmm_joint_def hinge = sadmm_joint_def_default();
    const double pivot[3] = {5, 0, 1.5}, level[4] = {sqrt(0.5), sqrt(0.5), 0, 0};
    hinge.kind = SADMM_JOINT_REVOLUTE, hinge.body_b = pendulum;
    MUST(world, sadmm_world_place_joint(world, &hinge, pivot, level));
    MUST(world, sadmm_world_add_joint(world, &hinge, NULL));
    if (kind == WELDS_ON_FLOOR || kind == WELD_IN_FLOOR) add_floor(world, 0.5);
    if (kind == TWO_WELDS || kind == TWO_DISTANCES || kind == DRIVEN_GEAR || kind == PULLED_WELDS) {
        sadmm_body_id b = add_welded_box(world, kind == PULLED_WELDS ? SADMM_BODY_KINEMATIC : SADMM_BODY_DYNAMIC, 1, z);
        if (kind == PULLED_WELDS && !consistent) {
            sadmm_body_state state = body_state(world, b);
            state.linear_velocity[0] = 0.01;
            MUST(world, sadmm_world_set_body_state(world, b, &state));
        }
        if (kind == PULLED_WELDS) {
            join_at(world, SADMM_JOINT_FIXED, NULL, a, 0, z, NULL);
            join_at(world, SADMM_JOINT_FIXED, &b, a, -1, 0, NULL);
        } else if (kind == DRIVEN_GEAR) {
            add_driven_gear(world, a, b, consistent);
        } else {
            const sadmm_joint_kind joint = kind == TWO_WELDS ? SADMM_JOINT_FIXED : SADMM_JOINT_DISTANCE;
            for (int k = 0; k < 2; ++k) join_at(world, joint, &a, b, 1 + k * off, 0, NULL);
        }
        return world;
    }
    if (kind == DRIVEN_LIMIT) { /* z of the slide is the world's */
        along.limited = true, along.lower = -1, along.upper = 0;
        along.drive = SADMM_DRIVE_SPEED, along.target_speed = consistent ? 0 : contradiction;
        join_at(world, SADMM_JOINT_PRISMATIC, NULL, a, 0, z, &along);
        return world;
    }
    join_at(world, SADMM_JOINT_FIXED, NULL, a, 0, z, NULL);
    if (kind == LOCKED_LIMITS) {
        along.limited = true, along.lower = along.upper = off;
        join_at(world, SADMM_JOINT_PRISMATIC, NULL, a, 0, z, &along);
    } else join_at(world, SADMM_JOINT_FIXED, NULL, a, kind == WELD_IN_FLOOR ? 0 : off, z, NULL);
    return world;
}

#endif
