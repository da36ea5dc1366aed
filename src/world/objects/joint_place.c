/* A joint that is no part of a loop parts what its bodies are joined to into two sides. One of them moves as a rigid
 * body, and its bodies' velocities with it, so that no other joint sees a difference. It is b's, unless that is held by
 * the world. */
#include "joint_place.h"

#include <math.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "core/math/rigid.h"
#include "core/model/joint_law.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"

static const double MOST_POSITION = 1e9, MOST_SPEED = 1e9;

/* ---- reading ----------------------------------------------------------------------------------------------------- */

static struct joint_end end_of(const sadmm_world *world, const struct sadmm_world_joint *joint, int side)
{
    const int32_t body = joint->body[side];
    return joint_end_on(&joint->frame[side], body >= 0 ? &world->bodies[body].rigid : NULL);
}

struct joint_geometry sadmm_world_joint_geometry(const sadmm_world *world, const struct sadmm_world_joint *joint)
{
    const struct joint_end a = end_of(world, joint, 0), b = end_of(world, joint, 1);
    return joint_geometry_of(&a, &b, joint->def.locks, joint_is_radial(joint->def.kind));
}

void sadmm_world_read_joint_motion(const sadmm_world *world, const struct sadmm_world_joint *joint, double position[6],
                                   double speed[6])
{
    static const double still[6];
    const struct joint_geometry geometry = sadmm_world_joint_geometry(world, joint);
    const double *v[2];
    for (int s = 0; s < 2; ++s) v[s] = joint->body[s] >= 0 ? world->bodies[joint->body[s]].rigid.velocity : still;
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        position[k] = joint_winds(joint->def.locks, k) ? joint_unwind(geometry.value[k], joint->last.angle[k])
                                                       : geometry.value[k];
        speed[k] = joint_rate(&geometry, k, v[0], v[1]);
    }
    if (joint_is_radial(joint->def.kind) && joint->def.locks & 1) position[0] -= joint->def.length;
}

/* ---- sides ------------------------------------------------------------------------------------------------------- */

static bool is_dynamic(const sadmm_world *world, int32_t body)
{
    return body >= 0 && world->bodies[body].type == SADMM_BODY_DYNAMIC;
}

static void reach(sadmm_world *world, int32_t body)
{
    if (world->placing.seen[body] == world->placing.call) return;
    world->placing.seen[body] = world->placing.call;
    world->placing.bodies[world->placing.count++] = body;
}

/* Bodies that a side of the joint is joined to without it, into `placing`. False: the world holds one of them, or the
 * other side is among them. */
static bool find_side(sadmm_world *world, size_t slot, int side)
{
    const struct sadmm_world_joint *joint = &world->joints[slot];
    if (!is_dynamic(world, joint->body[side])) return false;
    if (++world->placing.call == 0) memset(world->placing.seen, 0, world->placing.marks * sizeof *world->placing.seen);
    world->placing.count = 0;
    reach(world, joint->body[side]);
    for (size_t n = 0; n < world->placing.count; ++n) {
        uint32_t name = world->bodies[world->placing.bodies[n]].first_joint;
        while (name) {
            const uint32_t at = (name - 1) / 2, on = (name - 1) % 2;
            const struct sadmm_world_joint *other = &world->joints[at];
            name = other->on_body[on].next;
            if (at == slot || !other->def.enabled || !other->def.locks) continue;
            if (!is_dynamic(world, other->body[1 - on])) return false;
            reach(world, other->body[1 - on]);
        }
    }
    return !is_dynamic(world, joint->body[1 - side]) ||
           world->placing.seen[joint->body[1 - side]] != world->placing.call;
}

/* *side: the one that moves, -1: none, for the joint is part of a loop. */
static sadmm_status find_moving_side(sadmm_world *world, size_t slot, int *side)
{
    const size_t bodies = world->body_ids.slots;
    if (!SADMM_GROW(world->placing.seen, world->placing.marks, bodies) || !SADMM_GROW(world->placing.bodies, 0, bodies))
        return sadmm_fail_memory(&world->error, "the bodies of a joint");
    world->placing.marks = bodies > world->placing.marks ? bodies : world->placing.marks;
    *side = find_side(world, slot, 1) ? 1 : find_side(world, slot, 0) ? 0 : -1;
    return SADMM_OK;
}

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static bool is_free(const struct sadmm_world_joint *joint, int k) { return !(joint->def.locks >> k & 1); }

static bool differs(const struct sadmm_world_joint *joint, const double *x, const double *now, bool locked)
{
    for (int k = 0; k < JOINT_COORDINATES; ++k)
        if (is_free(joint, k) != locked && x[k] != now[k]) return true;
    return false;
}

static sadmm_status check_numbers(const struct sadmm_world_joint *joint, const double *x, double most,
                                  struct sadmm_error *error)
{
    for (int k = 0; k < JOINT_COORDINATES; ++k)
        if (is_free(joint, k) && !(fabs(x[k]) <= most))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "column %d = %g: must be in [%g, %g]", k, x[k],
                              -most, most);
    return SADMM_OK;
}

/* Why a joint cannot be set; NULL: it can. */
static sadmm_status find_why_not(sadmm_world *world, size_t slot, const char **why)
{
    const struct sadmm_world_joint *joint = &world->joints[slot];
    int side;
    *why = joint_is_radial(joint->def.kind) ? "holds a distance" : !joint->def.enabled ? "is not enabled" : NULL;
    if (*why) return SADMM_OK;
    TRY(find_moving_side(world, slot, &side));
    if (side < 0) *why = "is part of a loop";
    return SADMM_OK;
}

/* Is the row to be set? Noted for that: what is set before it may change its numbers by rounding. Where the joint
 * cannot be set free coordinates must be as they are, and locked ones stay. */
static sadmm_status note_row(sadmm_world *world, size_t slot, const double *row, const double *now)
{
    const struct sadmm_world_joint *joint = &world->joints[slot];
    const size_t joints = world->joint_ids.slots;
    const char *why = NULL;
    if (!SADMM_GROW(world->placing.changes, 0, joints)) return sadmm_fail_memory(&world->error, "joints");
    const bool free = differs(joint, row, now, false), any = free || differs(joint, row, now, true);
    if (any) TRY(find_why_not(world, slot, &why));
    if (free && why)
        return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT, "the joint %s: its bodies' states must be set",
                          why);
    world->placing.changes[slot] = any && !why;
    return SADMM_OK;
}

sadmm_status sadmm_world_check_joint_positions(sadmm_world *world, size_t slot, const double position[6])
{
    static const double half_turn = 3.1415926535897936; /* with what rounding may leave */
    const struct sadmm_world_joint *joint = &world->joints[slot];
    double now[6], speed[6];
    sadmm_world_read_joint_motion(world, joint, now, speed);
    TRY(check_numbers(joint, position, MOST_POSITION, &world->error));
    const double turn = v3_norm(v3_load(position + 3));
    if (joint_locked_rotations(joint->def.locks) == 0 && turn > half_turn)
        return sadmm_fail(&world->error, SADMM_ERROR_INVALID_ARGUMENT,
                          "columns 3 to 5 are a rotation by %.17g rad: must be at most half a turn", turn);
    return note_row(world, slot, position, now);
}

sadmm_status sadmm_world_check_joint_speeds(sadmm_world *world, size_t slot, const double speed[6])
{
    const struct sadmm_world_joint *joint = &world->joints[slot];
    double position[6], now[6];
    sadmm_world_read_joint_motion(world, joint, position, now);
    TRY(check_numbers(joint, speed, MOST_SPEED, &world->error));
    return note_row(world, slot, speed, now);
}

/* ---- setting ----------------------------------------------------------------------------------------------------- */

/* b's frame in a's. */
static quat rotation_of(uint32_t locks, const double x[6])
{
    const int odd = joint_odd_rotation(locks), first = (odd + 1) % 3, second = (odd + 2) % 3;
    double turn[2][3] = {{0}};
    switch (joint_locked_rotations(locks)) {
    case 0: return q_exp(v3_load(x + 3));
    case 1: /* about an axis of a's, then about one of b's */
        turn[0][first] = x[3 + first], turn[1][second] = x[3 + second];
        return q_mul(q_exp(v3_load(turn[0])), q_exp(v3_load(turn[1])));
    case 2: turn[0][odd] = x[3 + odd]; return q_exp(v3_load(turn[0]));
    default: return q_exp(v3(0, 0, 0));
    }
}

struct twist {
    vec3 linear, angular; /* at the body's centre of mass */
};

static struct twist twist_of(const sadmm_world *world, int32_t body)
{
    const double *v = body >= 0 ? world->bodies[body].rigid.velocity : NULL;
    return v ? (struct twist){v3_load(v), v3_load(v + 3)} : (struct twist){v3(0, 0, 0), v3(0, 0, 0)};
}

/* That of the moving body, by the other one's and the joint's speeds, where they are now. */
static struct twist moving_twist(const sadmm_world *world, const struct sadmm_world_joint *joint, int side,
                                 const double speed[6])
{
    const struct joint_geometry g = sadmm_world_joint_geometry(world, joint);
    const struct twist other = twist_of(world, joint->body[1 - side]);
    const vec3 arm = side ? g.arm_b : g.arm_a, other_arm = side ? g.arm_a : g.arm_b;
    const mat3 axes = {{g.axis[3], g.axis[4], g.axis[5]}};
    vec3 linear = v3(0, 0, 0);
    for (int k = 0; k < 3; ++k)
        if (is_free(joint, k)) linear = v3_madd(linear, speed[k], g.axis[k]);
    const vec3 rates = v3(is_free(joint, 3) ? speed[3] : 0, is_free(joint, 4) ? speed[4] : 0,
                          is_free(joint, 5) ? speed[5] : 0),
               angular = m3_solve(axes, rates);
    const double sign = side ? 1 : -1;
    const vec3 spin = v3_madd(other.angular, sign, angular),
               at_point = v3_madd(v3_add(other.linear, v3_cross(other.angular, other_arm)), sign, linear);
    return (struct twist){v3_sub(at_point, v3_cross(spin, arm)), spin};
}

/* A side as it was: its joint's frame and the twist of the body that has it. */
struct side_motion {
    struct joint_end end;
    vec3 center;
    struct twist twist;
};

/* The bodies of the side move with their joint's frame from `old` to `end`. */
static sadmm_status move_side(sadmm_world *world, const struct side_motion *old, const struct joint_end *end)
{
    const quat turn = q_normalize(q_mul(end->orientation, q_conjugate(old->end.orientation)));
    for (size_t n = 0; n < world->placing.count; ++n) {
        const int32_t body = world->placing.bodies[n];
        const struct sadmm_rigid *rigid = &world->bodies[body].rigid;
        sadmm_body_state state;
        const vec3 arm = v3_sub(v3_load(rigid->position), old->end.point);
        v3_store(v3_add(end->point, q_turn(turn, arm)), state.position);
        q_store(q_normalize(q_mul(turn, q_load(rigid->orientation))), state.orientation);
        /* as seen from the joint's body */
        const vec3 v = v3_load(rigid->velocity), w = v3_load(rigid->velocity + 3),
                   from = v3_sub(v3_load(rigid->position), old->center),
                   carried = v3_add(old->twist.linear, v3_cross(old->twist.angular, from));
        v3_store(q_turn(turn, v3_sub(v, carried)), state.linear_velocity);
        v3_store(q_turn(turn, v3_sub(w, old->twist.angular)), state.angular_velocity);
        TRY(sadmm_world_set_body_state(world, sadmm_world_body_id(world, (size_t)body), &state));
    }
    return SADMM_OK;
}

/* To the velocities of the side's bodies that of a rigid body is added. */
static sadmm_status add_twist(sadmm_world *world, vec3 center, struct twist added)
{
    for (size_t n = 0; n < world->placing.count; ++n) {
        const int32_t body = world->placing.bodies[n];
        const sadmm_body_id id = sadmm_world_body_id(world, (size_t)body);
        sadmm_body_state state;
        TRY(sadmm_world_body_state(world, id, &state));
        const vec3 from = v3_sub(v3_load(state.position), center);
        v3_store(v3_add(v3_load(state.linear_velocity), v3_add(added.linear, v3_cross(added.angular, from))),
                 state.linear_velocity);
        v3_store(v3_add(v3_load(state.angular_velocity), added.angular), state.angular_velocity);
        TRY(sadmm_world_set_body_state(world, id, &state));
    }
    return SADMM_OK;
}

sadmm_status sadmm_world_set_joint_positions(sadmm_world *world, size_t slot, const double position[6])
{
    struct sadmm_world_joint *joint = &world->joints[slot];
    double now[6], speed[6], wanted[6];
    int side;
    if (!world->placing.changes[slot]) return SADMM_OK;
    sadmm_world_read_joint_motion(world, joint, now, speed);
    TRY(find_moving_side(world, slot, &side));
    TRY(sadmm_world_detach(world)); /* the joint's turns are part of what a backend was given */
    for (int k = 0; k < JOINT_COORDINATES; ++k) wanted[k] = is_free(joint, k) ? position[k] : 0;
    const struct joint_end other = end_of(world, joint, 1 - side);
    const quat relative = rotation_of(joint->def.locks, wanted);
    const vec3 way = v3_load(wanted);
    struct joint_end end;
    if (side) {
        end.orientation = q_normalize(q_mul(other.orientation, relative));
        end.point = v3_add(other.point, q_turn(other.orientation, way));
    } else {
        end.orientation = q_normalize(q_mul(other.orientation, q_conjugate(relative)));
        end.point = v3_sub(other.point, q_turn(end.orientation, way));
    }
    const int32_t body = joint->body[side];
    const struct side_motion old = {end_of(world, joint, side), v3_load(world->bodies[body].rigid.position),
                                    twist_of(world, body)};
    TRY(move_side(world, &old, &end));
    for (int k = 0; k < JOINT_COORDINATES; ++k)
        if (joint_winds(joint->def.locks, k)) joint->last.angle[k] = wanted[k];
    return add_twist(world, v3_load(world->bodies[body].rigid.position), moving_twist(world, joint, side, speed));
}

sadmm_status sadmm_world_set_joint_speeds(sadmm_world *world, size_t slot, const double speed[6])
{
    const struct sadmm_world_joint *joint = &world->joints[slot];
    int side;
    if (!world->placing.changes[slot]) return SADMM_OK;
    TRY(find_moving_side(world, slot, &side));
    const int32_t body = joint->body[side];
    const struct twist from = twist_of(world, body), to = moving_twist(world, joint, side, speed);
    return add_twist(world, v3_load(world->bodies[body].rigid.position),
                     (struct twist){v3_sub(to.linear, from.linear), v3_sub(to.angular, from.angular)});
}
