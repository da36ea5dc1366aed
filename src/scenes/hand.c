#include "hand.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "compound.h"
#include "core/math/quat.h"
#include "pull.h"
#include "subadmm/joint.h"

static const double pi = 3.14159265358979323846;
enum { X, Y, Z };

/* ---- geometry, m ------------------------------------------------------------------------------------------------- */

static const double palm_half[3] = {0.045, 0.04, 0.012};
static const double grip_at[3] = {0.055, 0, -0.085};    /* the middle between the pads, in the palm's frame */
static const double pad_half[3] = {0.01, 0.007, 0.006}; /* along the finger, across it, thickness */
static const double bone = 0.007, last_bone = 0.004;     /* radii; a finger's last bone is thinner than its pad */
/* kg m^2: of bones, which the flesh and tendons about them turn with. With the bare bones' moments (2e-7) 60 iterations
 * leave 0.5 N of error in what the hand feels. Pads have their own. */
static const double least_moment = 1e-5;
enum { META, KNUCKLE, PROXIMAL, MIDDLE, DISTAL, PAD };

/* From its root in the palm a finger's first link goes to its knuckle; two more reach for the pad's place in the plane
 * y = const of the palm, the fourth points down and carries the pad in its middle, where it turns to lie flat on what
 * it presses. */
struct finger {
    double root[3], knuckle[3];     /* palm frame */
    double proximal, middle, distal; /* lengths */
    double pad_side;                /* +1: the pad is in front of what is held, -1: behind */
    double bow;                     /* which way the middle joint bows: +1 up and out for fingers, -1 for the thumb */
    double strength;                /* factor of stiffness and torque: the thumb holds against four */
};

static const struct finger fingers[SADMM_HAND_FINGERS] = {
    {{-0.03, -0.045, -0.012}, {0.005, 0, -0.015}, 0.03, 0.03, 0.03, -1, -1, 4},
    {{0, -0.027, 0}, {0.045, -0.027, 0}, 0.055, 0.045, 0.03, 1, 1, 1},
    {{0, -0.009, 0}, {0.045, -0.009, 0}, 0.055, 0.045, 0.03, 1, 1, 1},
    {{0, 0.009, 0}, {0.045, 0.009, 0}, 0.055, 0.045, 0.03, 1, 1, 1},
    {{0, 0.027, 0}, {0.045, 0.027, 0}, 0.055, 0.045, 0.03, 1, 1, 1},
};

/* One link: joined to `parent` (index, parents come first) at `offset` in the parent's frame, turned by `yaw` about the
 * parent's z, then by the joint's angle about `axis`. Its frame begins at the joint; its part lies along x. */
struct link {
    int parent;
    double offset[3], yaw;
    int axis;
    struct sadmm_part part; /* in the link's frame, centred at its centre of mass */
    sadmm_joint_coordinate drive;
};

static const double z_to_x[4] = {0.70710678118654752440, 0, 0.70710678118654752440, 0};

static struct sadmm_part capsule_part(double length, double radius, double mass)
{
    struct sadmm_part part =
        sadmm_part_at(SADMM_SHAPE_CAPSULE, length / 2, 0, 0, radius, fabs(length) / 2, 0, mass);
    memcpy(part.shape.orientation, z_to_x, sizeof z_to_x);
    return part;
}

static struct sadmm_part sphere_part(double radius, double mass)
{
    return sadmm_part_at(SADMM_SHAPE_SPHERE, 0, 0, 0, radius, 0, 0, mass);
}

static struct sadmm_part box_part(const double half[3], double x, double mass)
{
    return sadmm_part_at(SADMM_SHAPE_BOX, x, 0, 0, half[0], half[1], half[2], mass);
}

/* A drive that holds an angle: N m/rad, of at most `torque` N m, damped over 20 ms. */
static sadmm_joint_coordinate muscle(double stiffness, double torque)
{
    return (sadmm_joint_coordinate){
        .drive = SADMM_DRIVE_POSITION, .drive_stiffness = stiffness, .drive_damping = 0.02 * stiffness,
        .drive_force = torque,
    };
}

static void set_finger(const struct finger *f, int first, struct link *links)
{
    const double across[3] = {f->knuckle[0] - f->root[0], f->knuckle[1] - f->root[1], f->knuckle[2] - f->root[2]};
    const double yaw = atan2(across[1], across[0]), flat = hypot(across[0], across[1]);
    struct link *l = links + first;
    l[META] = (struct link){.parent = 0, .yaw = yaw, .axis = Z, .part = capsule_part(flat, bone, 0.02)};
    memcpy(l[META].offset, f->root, sizeof f->root);
    l[KNUCKLE] = (struct link){.parent = first, .offset = {flat, 0, across[2]}, .yaw = -yaw, .axis = Z,
                               .part = sphere_part(bone, 0.01)};
    l[PROXIMAL] = (struct link){.parent = first + KNUCKLE, .axis = Y, .part = capsule_part(f->proximal, bone, 0.025)};
    l[MIDDLE] = (struct link){.parent = first + PROXIMAL, .offset = {f->proximal, 0, 0}, .axis = Y,
                              .part = capsule_part(f->middle, bone, 0.02)};
    l[DISTAL] = (struct link){.parent = first + MIDDLE, .offset = {f->middle, 0, 0}, .axis = Y,
                              .part = capsule_part(f->distal, last_bone, 0.015)};
    l[PAD] = (struct link){.parent = first + DISTAL, .offset = {f->distal + pad_half[0], 0, 0}, .axis = Y,
                           .part = box_part(pad_half, 0, 0.01)};
    for (int k = 0; k < SADMM_FINGER_LINKS; ++k)
        l[k].drive = k == PAD ? muscle(0.5 * f->strength, 0.5 * f->strength)
                              : muscle(40 * f->strength, 3 * f->strength);
    l[META].drive = l[KNUCKLE].drive = muscle(200, 20);
}

/* Palm, wrist (flexion, deviation, roll with the forearm), fingers. */
static void set_links(struct link links[SADMM_HAND_LINKS])
{
    links[0] = (struct link){.parent = -1, .part = box_part(palm_half, 0, 0.3)};
    links[1] = (struct link){.parent = 0, .offset = {-0.055, 0, 0}, .axis = Y, .part = sphere_part(0.012, 0.05)};
    links[2] = (struct link){.parent = 1, .axis = Z, .part = sphere_part(0.012, 0.05)};
    links[3] = (struct link){.parent = 2, .axis = X, .part = capsule_part(-0.2, 0.025, 0.4)};
    for (int k = 1; k <= SADMM_WRIST_LINKS; ++k) links[k].drive = muscle(100, 30);
    for (int k = 0; k < SADMM_HAND_FINGERS; ++k)
        set_finger(&fingers[k], 1 + SADMM_WRIST_LINKS + k * SADMM_FINGER_LINKS, links);
    for (int k = 0; k < SADMM_HAND_LINKS; ++k) {
        links[k].part.shape.friction = 1;
        links[k].part.shape.category = 2; /* links do not meet each other */
        links[k].part.shape.mask = ~2u;
    }
}

/* ---- poses ------------------------------------------------------------------------------------------------------- */

static struct sadmm_frame palm_of(const struct sadmm_grip *grip)
{
    struct sadmm_frame f = sadmm_frame_world();
    f = sadmm_frame_moved(f, grip->position[0], grip->position[1], grip->position[2]);
    f = sadmm_frame_turned(f, Z, grip->yaw);
    return sadmm_frame_moved(f, -grip_at[0], -grip_at[1], -grip_at[2]);
}

/* Angles of a finger whose pad faces what is held at `opening` (m): the two links from the knuckle reach for a point
 * right above the pad (two sides and the way to it make a triangle; beyond their reach they are straight), the others
 * point down. Positive angles about y turn x down. */
static void bend_finger(const struct finger *f, double opening, double angles[SADMM_FINGER_LINKS])
{
    const double a = f->proximal, b = f->middle;
    const double ahead = grip_at[0] + f->pad_side * (opening / 2 + pad_half[2]) - f->knuckle[0];
    const double down = -grip_at[2] - pad_half[0] - f->distal + f->knuckle[2];
    const double square = ahead * ahead + down * down;
    const double bend = f->bow * acos(fmin(fmax((square - a * a - b * b) / (2 * a * b), -1), 1));
    const double lift = atan2(down, ahead) - atan2(b * sin(bend), a + b * cos(bend));
    const double bent[SADMM_FINGER_LINKS] = {0, 0, lift, bend, pi / 2 - lift - bend, 0};
    memcpy(angles, bent, sizeof bent);
}

static void set_angles(const struct sadmm_grip *grip, double angles[SADMM_HAND_LINKS])
{
    for (int k = 0; k <= SADMM_WRIST_LINKS; ++k) angles[k] = 0;
    for (int k = 0; k < SADMM_HAND_FINGERS; ++k)
        bend_finger(&fingers[k], grip->opening, angles + 1 + SADMM_WRIST_LINKS + k * SADMM_FINGER_LINKS);
}

/* ---- building ---------------------------------------------------------------------------------------------------- */

static sadmm_status join(sadmm_world *world, sadmm_body_id parent, sadmm_body_id child, struct sadmm_frame at,
                         const struct link *link, const double back[3], double angle, struct sadmm_error *error)
{
    static const double s = 0.70710678118654752440;
    static const double to_axis[3][4] = {{s, 0, s, 0}, {s, -s, 0, 0}, {1, 0, 0, 0}}; /* z to x, to y, to z */
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = SADMM_JOINT_REVOLUTE;
    def.body_a = parent;
    def.body_b = child;
    /* the frame of angle 0, on both */
    struct sadmm_frame zero = sadmm_frame_turned(at, link->axis, -angle);
    q_store(q_normalize(q_mul(q_load(zero.orientation), q_load(to_axis[link->axis]))), zero.orientation);
    sadmm_status status = sadmm_world_place_joint(world, &def, zero.origin, zero.orientation);
    memcpy(def.position_b, back, sizeof def.position_b);
    memcpy(def.orientation_b, to_axis[link->axis], sizeof def.orientation_b);
    def.coordinates[5] = link->drive;
    def.coordinates[5].target_position = angle;
    if (status == SADMM_OK) status = sadmm_world_add_joint(world, &def, NULL);
    return sadmm_scene_world_error(world, status, error);
}

/* A link's body: its centre of mass at the part's, its axes the link's. */
static sadmm_status add_link(sadmm_world *world, struct sadmm_frame at, const struct link *link, const char *name,
                             sadmm_body_id *id, struct sadmm_error *error)
{
    struct sadmm_part part = link->part;
    sadmm_body_def body = sadmm_body_def_default();
    double inertia[3];
    const double *centre = link->part.shape.position;
    const struct sadmm_frame middle = sadmm_frame_moved(at, centre[0], centre[1], centre[2]);
    sadmm_part_inertia(&part, inertia);
    const bool along_x = part.shape.type == SADMM_SHAPE_CAPSULE, box = part.shape.type == SADMM_SHAPE_BOX;
    body.mass = part.mass;
    body.name = name;
    for (int k = 0; k < 3; ++k) body.inertia[k] = fmax(box ? 0 : least_moment, inertia[along_x ? 2 - k : k]);
    memcpy(body.position, middle.origin, sizeof body.position);
    memcpy(body.orientation, middle.orientation, sizeof body.orientation);
    memset(part.shape.position, 0, sizeof part.shape.position);
    sadmm_status status = sadmm_world_add_body(world, &body, id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, *id, &part.shape, NULL);
    return sadmm_scene_world_error(world, status, error);
}

/* As "ring finger knuckle". */
static void name_of(int link, char name[64])
{
    static const char *const palm_names[] = {"palm", "wrist", "wrist", "forearm"};
    static const char *const finger_names[] = {"thumb", "forefinger", "middle finger", "ring finger", "little finger"};
    static const char *const names[] = {"metacarpal", "knuckle", "proximal", "middle", "distal", "tip"};
    const int of = link - 1 - SADMM_WRIST_LINKS;
    if (of < 0)
        snprintf(name, 64, "%s", palm_names[link]);
    else
        snprintf(name, 64, "%s %s", finger_names[of / SADMM_FINGER_LINKS], names[of % SADMM_FINGER_LINKS]);
}

sadmm_status sadmm_add_hand(sadmm_world *world, const struct sadmm_grip *grip, struct sadmm_error *error)
{
    struct link links[SADMM_HAND_LINKS];
    double angles[SADMM_HAND_LINKS];
    struct sadmm_frame frames[SADMM_HAND_LINKS];
    sadmm_body_id ids[SADMM_HAND_LINKS];
    sadmm_status status = SADMM_OK;
    set_links(links);
    set_angles(grip, angles);
    frames[0] = palm_of(grip);
    for (int k = 0; k < SADMM_HAND_LINKS && status == SADMM_OK; ++k) {
        const struct link *l = &links[k];
        if (k > 0) {
            struct sadmm_frame at = frames[l->parent];
            at = sadmm_frame_moved(at, l->offset[0], l->offset[1], l->offset[2]);
            frames[k] = sadmm_frame_turned(sadmm_frame_turned(at, Z, l->yaw), l->axis, angles[k]);
        }
        char name[64];
        name_of(k, name);
        status = add_link(world, frames[k], l, name, &ids[k], error);
    }
    for (int k = 1; k < SADMM_HAND_LINKS && status == SADMM_OK; ++k) {
        const double *centre = links[k].part.shape.position, back[3] = {-centre[0], -centre[1], -centre[2]};
        status = join(world, ids[links[k].parent], ids[k], frames[k], &links[k], back, angles[k], error);
    }
    sadmm_coupling_def gains = sadmm_coupling_def_default();
    gains.linear_stiffness = 2e4, gains.linear_damping = 600, gains.max_force = 200;
    gains.angular_stiffness = 300, gains.angular_damping = 9, gains.max_torque = 20;
    return status == SADMM_OK ? sadmm_add_pull(world, ids[0], frames[0], &gains, error) : status;
}

sadmm_status sadmm_move_hand(sadmm_world *world, int32_t first_joint, int32_t coupling, const struct sadmm_grip *now,
                             const struct sadmm_grip *next, double dt, struct sadmm_error *error)
{
    struct link links[SADMM_HAND_LINKS];
    double angles[SADMM_HAND_LINKS], ahead[SADMM_HAND_LINKS];
    sadmm_status status = sadmm_move_pull(world, coupling, palm_of(now), palm_of(next), dt, error);
    if (status != SADMM_OK) return status;
    set_links(links);
    set_angles(now, angles);
    set_angles(next, ahead);
    for (int k = 1 + SADMM_WRIST_LINKS; k < SADMM_HAND_LINKS && status == SADMM_OK; ++k) {
        sadmm_joint_id id;
        sadmm_joint_coordinate drive = links[k].drive;
        if (links[k].axis != Y) continue; /* held at 0 */
        drive.target_position = angles[k];
        drive.target_speed = (ahead[k] - angles[k]) / dt;
        status = sadmm_world_joint_at(world, first_joint + k - 1, &id);
        if (status == SADMM_OK) status = sadmm_world_set_joint_coordinate(world, id, 5, &drive);
    }
    return sadmm_scene_world_error(world, status, error);
}
