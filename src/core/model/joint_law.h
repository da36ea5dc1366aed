/* A joint's laws in a step: its definition and its bodies as scalar rows (math/row.h; docs/internals/algorithm.md,
 * "Joints"). Jacobians where the bodies are halfway through the step by their velocities at its start, laws from the
 * errors at its start. Coordinates are independent of each other, so that a lane of a device may take one. In
 * double. */
#ifndef SADMM_CORE_MODEL_JOINT_LAW_H
#define SADMM_CORE_MODEL_JOINT_LAW_H

#include <math.h>

#include "core/base/definition_fields.h"
#include "core/math/joint.h"
#include "core/math/joint_table.h"
#include "core/math/max.h"
#include "core/math/rigid.h"
#include "forces.h"
#include "spin.h"
#include "subadmm/joint.h"
#include "system.h"

/* What acts along a coordinate of a joint, each by a row of its own. */
enum sadmm_joint_role {
    SADMM_ROLE_LOCK,
    SADMM_ROLE_LOWER,
    SADMM_ROLE_UPPER,
    SADMM_ROLE_DRIVE,
    SADMM_ROLE_FRICTION,
    SADMM_ROLE_SPRING,
    SADMM_ROLE_ARMATURE,
    SADMM_ROLE_COUNT
};

/* What a joint keeps from step to step. */
struct sadmm_joint_memory {
    double force[SADMM_ROLE_COUNT][JOINT_COORDINATES]; /* on b along the coordinate: what the next step starts from */
    double angle[JOINT_COORDINATES];                   /* of those that wind, at the step's start */
    double wrench[6], point[3];                        /* as in sadmm_joint_state, on b */
    double local[6];                                   /* the wrench along the axes of a's frame */
    double left[JOINT_COORDINATES];                    /* of locks: articulation_left of their rows; 0: not reported */
    double expected[JOINT_COORDINATES];                /* of locks and springs: e, and w of the step before, if */
    double missed[JOINT_COORDINATES];                  /* `followed`; */
    double ahead[JOINT_COORDINATES];                   /* of locks: s of the step at hand (joint_foresee) */
    bool trapezoid_off;                                /* its bodies were moved by the velocities of the step's end */
    bool followed;                                     /* its bodies were left with what the laws make of them */
    bool broken;                                       /* it gave more than it bears */
};

/* A joint as a backend that keeps the world has it. */
struct sadmm_resident_joint {
    sadmm_joint_def def;
    int32_t constraints;         /* that its rows may take, of up to six each */
    int32_t body[2];             /* dynamic body, or a kinematic one (base/contact_set.h); -1: it does not move, and its
                                    frame is in the world */
    struct joint_frame frame[2];
    int32_t coupling;            /* number of the coupling whose target its frame a is; -1: none */
    int32_t table[JOINT_COORDINATES];  /* of a coordinate's spring: where its positions begin, then loads, among all */
    int32_t points[JOINT_COORDINATES]; /* tables' numbers (solve/resident.h); its points, 0: it has none */
};

/* The joint's row that a row of the step is. */
struct sadmm_joint_source {
    int32_t joint;
    int8_t role, coordinate, sign;
    double separation, slack; /* of limits: at the step's start, m or rad; what the turning of the row makes of it in a
                                 step. Of any row, slack: INFINITY where the step does not resolve its turning. Of
                                 springs, separation: the way to where a steep part of a table stops the coordinate,
                                 INFINITY: none does */
    double prescribed;        /* the row's rate due to sides of prescribed motion; it is in the bias */
};

/* A radial joint's coordinate 0 is a distance. */
SADMM_INLINE bool joint_is_radial(sadmm_joint_kind kind)
{
    return kind == SADMM_JOINT_DISTANCE || kind == SADMM_JOINT_SPRING || kind == SADMM_JOINT_LINK;
}

/* A coordinate's members as numbers, and back: what passes from the host to a device. */
enum { JOINT_COORDINATE_NUMBERS = SADMM_COORDINATE_FIELDS_COUNT };
SADMM_INLINE void joint_coordinate_numbers(const sadmm_joint_coordinate *c, double x[JOINT_COORDINATE_NUMBERS])
{
    int k = 0;
#define JOINT_PUT(X, kind, role, name, ...) x[k++] = JOINT_PUT_##kind(c->name);
#define JOINT_PUT_REAL(value) value
#define JOINT_PUT_BOUND(value) value
#define JOINT_PUT_FLAG(value) value ? 1 : 0
#define JOINT_PUT_DRIVE(value) (double)(int)value
    SADMM_COORDINATE_FIELDS(JOINT_PUT, )
}
SADMM_INLINE void joint_coordinate_take(const double x[JOINT_COORDINATE_NUMBERS], sadmm_joint_coordinate *c)
{
    int k = 0;
#define JOINT_TAKE(X, kind, role, name, ...) c->name = JOINT_TAKE_##kind(x[k++]);
#define JOINT_TAKE_REAL(x) x
#define JOINT_TAKE_BOUND(x) x
#define JOINT_TAKE_FLAG(x) (x) != 0
#define JOINT_TAKE_DRIVE(x) (sadmm_drive)(int)(x)
    SADMM_COORDINATE_FIELDS(JOINT_TAKE, )
}

/* ---- bodies and geometry ----------------------------------------------------------------------------------------- */

/* What a joint has at one end. */
struct joint_body {
    int32_t system_body;             /* -1: it does not move */
    const struct sadmm_rigid *rigid; /* at the step's start; NULL: the frame is in the world */
    bool prescribed;                 /* it is no body of the system and goes by its velocity, whatever acts on it; */
    bool target;                     /* it is a coupling's target: of a (joint_hold_translations) */
};

SADMM_INLINE struct joint_end joint_end_on(const struct joint_frame *frame, const struct sadmm_rigid *rigid)
{
    struct joint_end end;
    if (rigid) return joint_end_of(frame, v3_load(rigid->position), q_load(rigid->orientation));
    end.point = end.arm = frame->position;
    end.orientation = frame->orientation;
    return end;
}

/* One body of a joint in a step. */
struct joint_side {
    int32_t system_body;             /* -1: it does not move, or as prescribed */
    const struct sadmm_rigid *rigid; /* at the step's start; NULL: the static world */
    bool prescribed;
    double velocity[6], middle[6];   /* at the start; halfway, before anything acts */
    double free[6];                  /* halfway, once gravity has acted alone */
    quat turned;                     /* its orientation halfway */
};

struct acting_joint {
    struct joint_side side[2];
    struct joint_geometry start, middle; /* middle: but its values */
    quat frame;                          /* of a, in the middle */
};

/* by: spin_of_system of a body that is solved for, NULL: not known. */
SADMM_INLINE struct joint_side joint_side_by(struct joint_body body, const struct spin_system *by,
                                             const struct sadmm_settings *settings)
{
    struct joint_side side;
    struct rigid_spin spin;
    int k;
    side.system_body = body.system_body;
    side.rigid = body.rigid;
    side.prescribed = body.prescribed;
    side.turned.w = 1;
    side.turned.x = side.turned.y = side.turned.z = 0;
    for (k = 0; k < 6; ++k)
        side.velocity[k] = side.middle[k] = side.free[k] =
            body.system_body >= 0 || body.prescribed ? body.rigid->velocity[k] : 0;
    if (body.prescribed)
        side.turned = rigid_turn(q_load(body.rigid->orientation), v3_load(side.velocity + 3), settings->dt / 2);
    if (body.system_body < 0) return side;
    if (by && !rolling_turns_on(body.rigid) && !rigid_is_isotropic(v3_load(body.rigid->inertia))) {
        spin.orientation = by->orientation;
        spin.angular = by->angular;
    } else {
        spin = spin_halfway(body.rigid, settings->dt);
    }
    side.turned = spin.orientation;
    v3_store(spin.angular, side.middle + 3);
    forces_free(side.rigid, side.middle, settings->gravity, settings->dt, side.free);
    return side;
}

SADMM_INLINE struct joint_side joint_side_of(struct joint_body body, const struct sadmm_settings *settings)
{
    return joint_side_by(body, NULL, settings);
}

/* Its frame after half a step. */
SADMM_INLINE struct joint_end joint_end_halfway(const struct joint_frame *frame, const struct joint_side *side,
                                                double dt)
{
    return joint_end_of(frame, rigid_move(v3_load(side->rigid->position), v3_load(side->velocity), dt / 2),
                        side->turned);
}

/* From a coupling's target, translations are by its origin's velocity alone, along axes that stay where they are in the
 * middle of the step: a damper that went round with the frame would push what is beside it outwards, without bound. */
SADMM_INLINE void joint_hold_translations(const struct joint_end start[2], struct acting_joint *acting)
{
    const vec3 way = v3_sub(start[1].point, start[0].point);
    int k;
    acting->start.arm_a = acting->middle.arm_a = v3(0, 0, 0);
    for (k = 0; k < 3; ++k) {
        acting->start.axis[k] = acting->middle.axis[k];
        acting->start.value[k] = v3_dot(acting->middle.axis[k], way);
    }
}

/* acting->side: of its bodies; target: that of a is a coupling's. */
SADMM_INLINE void joint_act_between(const sadmm_joint_def *def, const struct joint_frame frame[2], bool target,
                                    const struct sadmm_settings *settings, struct acting_joint *acting)
{
    const int radial = joint_is_radial(def->kind);
    struct joint_end start[2], middle[2];
    int s;
    for (s = 0; s < 2; ++s) {
        const struct joint_side *side = &acting->side[s];
        start[s] = middle[s] = joint_end_on(&frame[s], side->rigid);
        if (side->system_body >= 0 || side->prescribed) middle[s] = joint_end_halfway(&frame[s], side, settings->dt);
    }
    acting->start = joint_geometry_of(&start[0], &start[1], def->locks, radial);
    acting->middle = joint_axes_of(&middle[0], &middle[1], def->locks, radial);
    acting->frame = middle[0].orientation;
    if (target) joint_hold_translations(start, acting);
}
SADMM_INLINE struct acting_joint joint_act(const sadmm_joint_def *def, const struct joint_frame frame[2],
                                           const struct joint_body body[2], const struct sadmm_settings *settings)
{
    struct acting_joint acting;
    int s;
    for (s = 0; s < 2; ++s) acting.side[s] = joint_side_of(body[s], settings);
    joint_act_between(def, frame, body[0].target, settings, &acting);
    return acting;
}

/* The step's row of coordinate k on a side. */
SADMM_INLINE void joint_step_row(const struct acting_joint *acting, int s, int k, double row[6])
{
    vec3 linear, angular;
    const double sign = s ? 1 : -1;
    joint_row(&acting->middle, k, s ? acting->middle.arm_b : acting->middle.arm_a, &linear, &angular);
    v3_store(v3_scale(linear, sign), row);
    v3_store(v3_scale(angular, sign), row + 3);
}

SADMM_INLINE double joint_row_product(const double row[6], const double v[6])
{
    double sum = 0;
    int j;
    for (j = 0; j < 6; ++j) sum += row[j] * v[j];
    return sum;
}

/* How fast a coordinate changes by the velocities of a and b. */
SADMM_INLINE double joint_rate(const struct joint_geometry *geometry, int coordinate, const double a[6],
                               const double b[6])
{
    double rate = 0;
    int s;
    for (s = 0; s < 2; ++s) {
        const double *v = s ? b : a;
        vec3 linear, angular;
        double own;
        joint_row(geometry, coordinate, s ? geometry->arm_b : geometry->arm_a, &linear, &angular);
        own = v3_dot(linear, v3_load(v)) + v3_dot(angular, v3_load(v + 3));
        rate += s ? own : -own;
    }
    return rate;
}

/* row A^-1 row^T of a rigid body. */
SADMM_INLINE double joint_response(const struct joint_side *side, const double row[6])
{
    const double *inertia = side->rigid->inertia;
    const vec3 turn = m3_tmul(q_matrix(side->turned), v3_load(row + 3));
    return v3_norm2(v3_load(row)) / side->rigid->mass + turn.x * turn.x / inertia[0] + turn.y * turn.y / inertia[1] +
           turn.z * turn.z / inertia[2];
}

/* ---- one coordinate ---------------------------------------------------------------------------------------------- */

/* A row's law (math/row.h): sign times coordinate k, by its role. */
struct joint_law {
    int role, coordinate, sign;
    double gain, bias, compliance, lo, hi;
    double separation, slack, prescribed; /* sadmm_joint_source */
};

/* Two limits, drive, friction, spring and armature of a coordinate that is free. */
enum { JOINT_COORDINATE_LAWS = 6 };

struct joint_laws {
    struct joint_law law[JOINT_COORDINATE_LAWS];
    double expected, missed, ahead; /* what the joint keeps */
    int count;
};

/* Of one coordinate, what its laws are made of. */
struct joint_moving {
    const struct sadmm_joint_memory *memory;
    double value, before; /* and its rate, at the step's start */
    double free;          /* its rate at the end, if nothing but gravity and wrenches acted; this, reach and response
                             not where it is locked */
    double turning;       /* what the row's rate halfway is more, before anything acts: axes, arms and bodies turn */
    double turned;        /* what the rate at the end is more than the row's, so far as the law counts it */
    double prescribed;    /* the rate due to sides of prescribed motion */
    bool turns;           /* by more than a step resolves: its bodies will be moved by the velocities of the step's
                             end, */
    bool late;            /* as they were in the last step, too */
    double most_missed;   /* joint_most_missed, of locks and springs whose joint is `followed` */
    double reach;         /* it may move by so much */
    double response;
    double dt, most;      /* most: speed of corrections */
};

SADMM_INLINE void joint_add_law(struct joint_laws *laws, const struct joint_moving *m, int role, int k, int sign,
                                double gain, double bias, double compliance, double lo, double hi, double separation)
{
    struct joint_law *law = &laws->law[laws->count++];
    law->role = role, law->coordinate = k, law->sign = sign;
    law->gain = gain, law->bias = bias, law->compliance = compliance;
    law->lo = lo, law->hi = hi;
    law->separation = separation;
    law->prescribed = sign * m->prescribed;
    law->slack = m->turns ? INFINITY
               : role == SADMM_ROLE_LOWER || role == SADMM_ROLE_UPPER ? 2 * m->dt * fabs(m->turning) : 0;
}

/* Half a step resolves turning by up to this many rad. Beyond it positions that move by means of velocities gain
 * energy: what turns by an angle t in half a step, with a share s of its speed in points that are off its axis, gains
 * as (s t^2)^2 (docs/internals/algorithm.md, "Large turns"). */
#define JOINT_MOST_TURN 0.05 /* measured: bench/constants.py, mechanisms motion */
/* What rounding makes of speeds is no turning. */
#define JOINT_NO_TURN 1e-9

/* The square of how fast a body's mass turns about its centre: twice the energy, by its mass. */
SADMM_INLINE double joint_spin2(const struct joint_side *side)
{
    vec3 w;
    if (side->system_body < 0) return 0;
    w = m3_tmul(q_matrix(q_load(side->rigid->orientation)), v3_load(side->velocity + 3));
    return (w.x * w.x * side->rigid->inertia[0] + w.y * w.y * side->rigid->inertia[1] +
            w.z * w.z * side->rigid->inertia[2]) /
           side->rigid->mass;
}

/* Does the row of coordinate k turn by more? turning: what its rate by the velocities at the start changes by in half a
 * step. It is held against the speeds that turn: of its points around the bodies and of the bodies about their centres,
 * and of one point past the other where the axis does. A top turns fast, and its point hardly. */
SADMM_INLINE bool joint_turns(const struct acting_joint *acting, int k, bool radial, double turning, double dt)
{
    const struct joint_geometry *g = &acting->start;
    const vec3 va = v3_load(acting->side[0].velocity), vb = v3_load(acting->side[1].velocity),
               turn_a = v3_load(acting->side[0].velocity + 3), turn_b = v3_load(acting->side[1].velocity + 3),
               around_b = v3_cross(turn_b, g->arm_b);
    vec3 arm = g->arm_a, around_a;
    double past, axis, around, turn;
    if (k >= 3)
        return fabs(turning) > JOINT_MOST_TURN * v3_norm(v3_sub(turn_b, turn_a)) +
                                   JOINT_NO_TURN * (v3_norm(turn_a) + v3_norm(turn_b));
    if (radial && k == 0) arm = v3_madd(arm, -g->value[0], g->axis[0]); /* to a's own point */
    around_a = v3_cross(turn_a, arm);
    if (!(radial && k == 0)) { /* most rows: what the bodies' own spin and the point's speed add is not needed to say
                                  no */
        const double half = dt / 2 * turning, most = JOINT_MOST_TURN * JOINT_MOST_TURN;
        if (half * half * max_of(v3_norm2(turn_a), v3_norm2(turn_b)) <=
            most * most * (v3_norm2(around_a) + v3_norm2(around_b)))
            return false;
    }
    around = sqrt(v3_norm2(around_a) + joint_spin2(&acting->side[0])) +
             sqrt(v3_norm2(around_b) + joint_spin2(&acting->side[1]));
    past = v3_norm(v3_sub(v3_add(vb, around_b), v3_add(va, around_a)));
    axis = dt / 2 * (radial && k == 0 ? past / max_of(g->value[0], JOINT_LEAST_LENGTH) : v3_norm(turn_a));
    turn = max_of(axis, dt / 2 * max_of(v3_norm(turn_a), v3_norm(turn_b)));
    if (axis < JOINT_MOST_TURN) past *= axis / JOINT_MOST_TURN;
    return (fabs(turning) - JOINT_NO_TURN * (v3_norm(va) + v3_norm(vb) + around)) * turn >
           JOINT_MOST_TURN * JOINT_MOST_TURN * (around + past);
}

/* What joint_turns asks of most rows, which is the same for all of a joint that are not radial: of rotations, their
 * most turning; of translations, squares of how fast bodies turn and of the speeds around them. */
struct joint_turn_bounds {
    double rotation, turn2, around2;
};
SADMM_INLINE struct joint_turn_bounds joint_turn_bounds_of(const struct acting_joint *acting)
{
    const struct joint_geometry *g = &acting->start;
    const vec3 turn_a = v3_load(acting->side[0].velocity + 3), turn_b = v3_load(acting->side[1].velocity + 3);
    struct joint_turn_bounds out;
    out.rotation = JOINT_MOST_TURN * v3_norm(v3_sub(turn_b, turn_a)) +
                   JOINT_NO_TURN * (v3_norm(turn_a) + v3_norm(turn_b));
    out.turn2 = max_of(v3_norm2(turn_a), v3_norm2(turn_b));
    out.around2 = v3_norm2(v3_cross(turn_a, g->arm_a)) + v3_norm2(v3_cross(turn_b, g->arm_b));
    return out;
}
SADMM_INLINE bool joint_turns_within(const struct joint_turn_bounds *bounds, int k, double turning, double dt)
{
    const double half = dt / 2 * turning, most = JOINT_MOST_TURN * JOINT_MOST_TURN;
    return k >= 3 ? !(fabs(turning) > bounds->rotation) : half * half * bounds->turn2 <= most * most * bounds->around2;
}

/* What a lock misses. With d = g/dt of its error g, its rate u at the start and the feedback c its law is
 *
 *     J (v_0 + v) = u - c + s,     so     d' = d + (u - c + s)/2 + p,     u' = -c + s + q
 *
 * with p and q of second order, what J halfway does not see of the motion's curvature. With s = 0 a steady motion has
 * c = w, w = p + q/2: an error that follows the lock's force, which does work of third order, always of one sign, and
 * energy grows without end. As the next step begins w is known, from what was expected:
 *
 *     w = (d' + u'/2) - e,     e = d + u/2 + (J v + J v_0 - u)
 *
 * with J v as solved for: a row that cannot follow its s would wind it up. s takes away the w of the step at hand,
 * foreseen from the last two. What is left is of higher order; as w is foreseen with some of its change to come, it
 * takes energy rather than giving it. */
#define JOINT_FORESIGHT 1.25 /* with 1 hinges gain in the long run, with 1.5 they lose twice as much (bench: stress) */

/* More than this, of what rows turn by in a step, is no curvature of a motion: bodies have been struck or set
 * elsewhere. */
#define JOINT_MOST_MISSED 0.5

/* Nor does it follow a body's spin that turns it by more than this in a step, rad: a fast top's. */
#define JOINT_MOST_FOLLOWED 0.2

SADMM_INLINE double joint_most_missed_by(const struct joint_turn_bounds *bounds, int k, double dt)
{
    if (dt * dt * bounds->turn2 > JOINT_MOST_FOLLOWED * JOINT_MOST_FOLLOWED) return 0;
    return JOINT_MOST_MISSED * dt * (k >= 3 ? bounds->turn2 : sqrt(bounds->turn2 * bounds->around2));
}

/* Coordinates that a law holds. */
SADMM_INLINE bool joint_foresees(const sadmm_joint_def *def, int k)
{
    return def->locks >> k & 1 || def->coordinates[k].spring_stiffness > 0;
}

/* Of the role whose row's J v they expect. */
SADMM_INLINE bool joint_role_foresees(int role) { return role == SADMM_ROLE_LOCK || role == SADMM_ROLE_SPRING; }

/* With sides of prescribed motion none: what they do next is not known. */
SADMM_INLINE bool joint_is_prescribed(const struct acting_joint *acting)
{
    return acting->side[0].prescribed || acting->side[1].prescribed;
}

SADMM_INLINE double joint_most_missed(const struct acting_joint *acting, int k, bool radial, double dt)
{
    const struct joint_geometry *g = &acting->start;
    const struct joint_turn_bounds bounds = joint_turn_bounds_of(acting);
    const double most = joint_most_missed_by(&bounds, k, dt);
    vec3 past;
    if (joint_is_prescribed(acting)) return 0;
    if (!(radial && k == 0)) return most;
    past = v3_sub(v3_add(v3_load(acting->side[1].velocity), v3_cross(v3_load(acting->side[1].velocity + 3), g->arm_b)),
                  v3_add(v3_load(acting->side[0].velocity), v3_cross(v3_load(acting->side[0].velocity + 3), g->arm_a)));
    return most + JOINT_MOST_MISSED * dt * v3_norm2(past) / max_of(g->value[0], JOINT_LEAST_LENGTH);
}

/* s, of the above. now: d + u/2; missed: w, 0 where it is not known. */
SADMM_INLINE double joint_foresee(const struct sadmm_joint_memory *memory, int k, double now, double most,
                                  double *missed)
{
    const double last = memory->missed[k], w = now - memory->expected[k];
    *missed = 0;
    if (!memory->followed || !(fabs(w) <= most)) return 0;
    *missed = w;
    return last == 0 ? -w : JOINT_FORESIGHT * (last - w) - w;
}

/* J v of a row by what the step has solved for; NULL: the side does not move, or as prescribed. */
SADMM_INLINE double joint_solved_rate(const double row_a[6], const double row_b[6], const double *a, const double *b)
{
    return (a ? joint_row_product(row_a, a) : 0) + (b ? joint_row_product(row_b, b) : 0);
}

/* Rates of a coordinate: at the start; of the step's row, by velocities at the start, halfway, and free, of sides that
 * move by forces; of those that move as prescribed; the row's response. free, response: not where it is locked, whose
 * law does not ask how it would move. */
struct joint_coordinate_rates {
    double before, start, middle, free, prescribed, response;
};

/* turns: joint_turns. */
SADMM_INLINE struct joint_moving joint_moving_by(const sadmm_joint_def *def, const struct sadmm_joint_memory *memory,
                                                 const struct acting_joint *acting, int k,
                                                 const struct joint_coordinate_rates *rates, bool turns,
                                                 const struct sadmm_settings *settings)
{
    const double middle = rates->middle + rates->prescribed, free = rates->free + rates->prescribed;
    struct joint_moving m;
    m.memory = memory;
    m.dt = settings->dt;
    m.most = settings->correction_speed;
    m.response = rates->response;
    m.value = acting->start.value[k];
    if (joint_winds(def->locks, k)) m.value = joint_unwind(m.value, memory->angle[k]);
    if (k == 0 && def->locks & 1 && joint_is_radial(def->kind)) m.value -= def->length;
    m.before = rates->before;
    m.prescribed = rates->prescribed;
    m.turning = middle - m.before;
    m.turns = turns;
    m.free = free - m.turning;
    m.late = memory->trapezoid_off || m.turns;
    m.turned = (m.late ? 0 : m.turning) + m.prescribed; /* the solve's rates are of its bodies alone */
    m.reach = 2 * m.dt * max_of(fabs(m.before), fabs(free));
    m.most_missed = joint_foresees(def, k) && memory->followed
                      ? joint_most_missed(acting, k, joint_is_radial(def->kind), settings->dt) : 0;
    return m;
}

SADMM_INLINE struct joint_moving joint_moving_of(const sadmm_joint_def *def, const struct sadmm_joint_memory *memory,
                                                 const struct acting_joint *acting, int k,
                                                 const struct sadmm_settings *settings)
{
    const struct joint_side *a = &acting->side[0], *b = &acting->side[1];
    const bool locked = def->locks >> k & 1;
    struct joint_coordinate_rates r = {0, 0, 0, 0, 0, 0};
    int s;
    r.before = joint_rate(&acting->start, k, a->velocity, b->velocity);
    for (s = 0; s < 2; ++s) {
        double row[6];
        if (acting->side[s].system_body < 0 && !acting->side[s].prescribed) continue;
        joint_step_row(acting, s, k, row);
        if (acting->side[s].prescribed) {
            r.prescribed += joint_row_product(row, acting->side[s].velocity);
            continue;
        }
        r.start += joint_row_product(row, acting->side[s].velocity);
        r.middle += joint_row_product(row, acting->side[s].middle);
        if (locked) continue;
        r.free += joint_row_product(row, acting->side[s].free);
        r.response += joint_response(&acting->side[s], row);
    }
    return joint_moving_by(def, memory, acting, k, &r,
                           joint_turns(acting, k, joint_is_radial(def->kind), r.start + r.prescribed - r.before,
                                       settings->dt),
                           settings);
}

SADMM_INLINE void joint_add_limits(struct joint_laws *laws, const struct joint_moving *m, int k,
                                   const sadmm_joint_coordinate *c)
{
    int upper;
    for (upper = 0; upper < 2; ++upper) {
        const int role = upper ? SADMM_ROLE_UPPER : SADMM_ROLE_LOWER, sign = upper ? -1 : 1;
        const double separation = upper ? c->upper - m->value : m->value - c->lower;
        const bool pressed = m->memory->force[role][k] != 0;
        double speed;
        if (separation > m->reach && !pressed) continue;
        /* it may close what is left in the step; once it presses it is held as what is locked is */
        speed = separation >= 0 && !pressed ? separation / m->dt : joint_feedback(separation, m->dt, m->most);
        if (isfinite(speed))
            joint_add_law(laws, m, role, k, sign, 1, sign * m->turned + speed, 0, 0, INFINITY, separation);
    }
}

/* ahead: s; as stiff as it is, it is a lock. */
SADMM_INLINE void joint_add_spring(struct joint_laws *laws, const struct joint_moving *m, int k, int role,
                                   double stiffness, double damping, double rest, double speed, double most,
                                   double ahead)
{
    const double own = joint_late(stiffness, damping, m->response, m->dt), late = m->late ? 1 : own;
    double gain, bias;
    joint_spring(stiffness, damping, m->value - rest, speed, m->before, m->dt, late,
                 late + joint_lead(stiffness, damping, own, m->dt), &gain, &bias);
    if (ahead != 0) ahead *= own * m->dt * stiffness / (m->dt * stiffness + damping);
    joint_add_law(laws, m, role, k, 1, gain, bias + gain * (m->turned - ahead), 1, -most, most, INFINITY);
}

/* The way that a spring with a table is predicted to go in the step. One that gave nothing meets what moves freely;
 * else the rate goes on but for what its force changes by. */
SADMM_INLINE struct joint_table_way joint_way_of(const struct joint_moving *m, int k, const sadmm_joint_coordinate *c,
                                                 const struct joint_table *table)
{
    const double dt = m->dt, give = m->response * dt * dt, /* m that 1 N moves the coordinate by */
                 pull = give * c->spring_stiffness, drag = m->response * dt * c->spring_damping,
                 force = m->memory->force[SADMM_ROLE_SPRING][k],
                 meant = force == 0 ? dt * m->free : dt * m->before - give * force;
    return joint_table_go(table, m->value, 1 + pull + drag, give,
                          (1 + drag) * m->value + pull * c->spring_rest + meant);
}

/* The spring of a coordinate with a table, beside which spring_stiffness acts. */
SADMM_INLINE void joint_add_table_spring(struct joint_laws *laws, const struct joint_moving *m, int k,
                                         const sadmm_joint_coordinate *c, const struct joint_table *table)
{
    const double stiffness = c->spring_stiffness, damping = c->spring_damping;
    const struct joint_table_way way = joint_way_of(m, k, c, table);
    const double own = joint_late(stiffness + way.steepest, damping, m->response, m->dt),
                 late = m->late ? 1 : own,
                 lead = way.points > 0 ? 0 : joint_lead(stiffness + way.steepest, damping, own, m->dt);
    const struct joint_table_line line = joint_table_line_of(table, m->value, &way, own > 0);
    const double most = line.most.load + stiffness * (line.most.at - c->spring_rest),
                 least = line.least.load + stiffness * (line.least.at - c->spring_rest);
    double load = line.load + stiffness * (line.at - c->spring_rest), gain, bias;
    /* no row has a gain below 0: a load that falls is taken as it is halfway */
    if (line.slope < 0) load += line.slope * way.length / 2;
    joint_spring(stiffness + max_of(0, line.slope), damping, m->value - line.at, 0, m->before, m->dt, late, late + lead,
                 &gain, &bias);
    joint_add_law(laws, m, SADMM_ROLE_SPRING, k, 1, gain, bias + m->dt * load + gain * m->turned, 1,
                  line.most.given ? -m->dt * most : -INFINITY, line.least.given ? -m->dt * least : INFINITY,
                  own > 0 ? way.length : INFINITY);
}

/* Of coordinate k; table: of its spring, NULL where it has none. A locked one has one law; what is locked comes first
 * in a joint's rows, for it is held together. */
SADMM_INLINE void joint_coordinate_laws(const sadmm_joint_def *def, int k, const struct joint_moving *m,
                                        const struct joint_table *table, struct joint_laws *laws)
{
    const sadmm_joint_coordinate *c = &def->coordinates[k];
    const double drive = c->drive_force * m->dt, friction = c->friction * m->dt;
    laws->count = 0;
    laws->expected = laws->missed = laws->ahead = 0;
    if (joint_foresees(def, k)) {
        const double now = m->value / m->dt + m->before / 2;
        if (!m->late) laws->ahead = joint_foresee(m->memory, k, now, m->most_missed, &laws->missed);
        laws->expected = now + m->turning; /* with J v once it is known */
    }
    if (def->locks >> k & 1) {
        const double feedback = joint_feedback(m->value, m->dt, m->most);
        joint_add_law(laws, m, SADMM_ROLE_LOCK, k, 1, 1, m->turned + feedback - laws->ahead, 0, -INFINITY, INFINITY, 0);
        return;
    }
    if (c->limited) joint_add_limits(laws, m, k, c);
    if (c->drive == SADMM_DRIVE_SPEED && drive > 0)
        joint_add_law(laws, m, SADMM_ROLE_DRIVE, k, 1, 1, m->turned - c->target_speed, 0, -drive, drive, 0);
    if (c->drive == SADMM_DRIVE_POSITION && drive > 0)
        joint_add_spring(laws, m, k, SADMM_ROLE_DRIVE, c->drive_stiffness, c->drive_damping, c->target_position,
                         c->target_speed, drive, 0);
    if (friction > 0) joint_add_law(laws, m, SADMM_ROLE_FRICTION, k, 1, 1, m->turned, 0, -friction, friction, 0);
    if (table) joint_add_table_spring(laws, m, k, c, table);
    else if (c->spring_stiffness > 0 || c->spring_damping > 0)
        joint_add_spring(laws, m, k, SADMM_ROLE_SPRING, c->spring_stiffness, c->spring_damping, c->spring_rest, 0,
                         INFINITY, laws->ahead);
    if (c->armature > 0) /* lambda = -armature (rate at the end - rate at the start) */
        joint_add_law(laws, m, SADMM_ROLE_ARMATURE, k, 1, c->armature, c->armature * (m->turned - m->before), 1,
                      -INFINITY, INFINITY, 0);
}

/* Does the joint have coordinate k? */
SADMM_INLINE bool joint_has_coordinate(const sadmm_joint_def *def, int k)
{
    return k == 0 || def->locks >> k & 1 || !joint_is_radial(def->kind);
}

/* May a coordinate have these limits? */
SADMM_INLINE bool joint_limits_fit(double lower, double upper)
{
    return lower <= upper && lower < INFINITY && upper > -INFINITY;
}

/* Most laws that the joint may have in a step. */
SADMM_INLINE int joint_most_laws(const sadmm_joint_def *def)
{
    int count = 0, k;
    for (k = 0; k < JOINT_COORDINATES; ++k) {
        const sadmm_joint_coordinate *c = &def->coordinates[k];
        if (!joint_has_coordinate(def, k)) continue;
        count += def->locks >> k & 1 ? 1
                                     : (c->limited ? 2 : 0) + (c->drive != SADMM_DRIVE_OFF) + (c->friction > 0) +
                                           (c->spring_stiffness > 0 || c->spring_damping > 0) + (c->armature > 0);
    }
    return count;
}

/* ---- the solution ------------------------------------------------------------------------------------------------ */

SADMM_INLINE void joint_forget_forces(struct sadmm_joint_memory *memory)
{
    int k, role;
    for (k = 0; k < JOINT_COORDINATES; ++k) {
        for (role = 0; role < SADMM_ROLE_COUNT; ++role) memory->force[role][k] = 0;
        memory->wrench[k] = memory->local[k] = 0;
        if (k < 3) memory->point[k] = 0;
    }
    memory->followed = false;
}

/* A row's multiplier, as a force and as what it is in the world, about the joint's point; axis: in the middle of the
 * step. */
SADMM_INLINE void joint_keep_row(struct sadmm_joint_memory *memory, const vec3 axis[JOINT_COORDINATES], int role,
                                 int coordinate, double force)
{
    double *part = memory->wrench + (coordinate < 3 ? 0 : 3);
    memory->force[role][coordinate] = force;
    part[0] += force * axis[coordinate].x;
    part[1] += force * axis[coordinate].y;
    part[2] += force * axis[coordinate].z;
}

/* All rows of the joint are in its wrench. */
SADMM_INLINE void joint_end_wrench(struct sadmm_joint_memory *memory, const sadmm_joint_def *def, quat frame)
{
    const mat3 axes = q_matrix(frame);
    int part;
    for (part = 0; part < 2; ++part)
        v3_store(m3_tmul(axes, v3_load(memory->wrench + 3 * part)), memory->local + 3 * part);
    memory->broken = memory->broken || v3_norm(v3_load(memory->wrench)) > def->break_force ||
                     v3_norm(v3_load(memory->wrench + 3)) > def->break_torque;
}

#endif
