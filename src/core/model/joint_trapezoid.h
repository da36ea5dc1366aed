/* Where joints let bodies go (docs/internals/algorithm.md, "Time stepping of rows"): all bodies of an island with
 * joints move by the mean of their velocities before and after the step, or all by those after it (math/trapezoid.h),
 * or they would come apart. In double. */
#ifndef SADMM_CORE_MODEL_JOINT_TRAPEZOID_H
#define SADMM_CORE_MODEL_JOINT_TRAPEZOID_H

#include "body_trapezoid.h"
#include "core/base/contact_set.h"
#include "joint_law.h"
#include "rolling.h"
#include "spin.h"

/* Of islands. TOUCHED: by a contact; ANCHORED: by one, or by a joint, that leaves it no motion (math/momentum.h);
 * RESTORED: on a device, its momentum is (joint_momentum.h); TURNS: rows of it turn by more than a step resolves;
 * POWERED: springs, drives or armatures act; MOORED: rows hold it to what does not move by itself; STRAYS: joints
 * stiffen its bodies; CLOSED: its joints have been closed. */
enum {
    ISLAND_ARTICULATED = 1,
    ISLAND_TRAPEZOID_OFF = 2,
    ISLAND_TOUCHED = 4,
    ISLAND_ANCHORED = 8,
    ISLAND_RESTORED = 16,
    ISLAND_TURNS = 32,
    ISLAND_POWERED = 64,
    ISLAND_MOORED = 128,
    ISLAND_STRAYS = 256,
    ISLAND_CLOSED = 512
};

/* Joints of such islands may be opened by more than the order of the step: it is loaded beyond what explicit forces
 * bear (stiffening.h), or a row turns by more than a step resolves. Others are not closed (joint_close.h), since a body
 * that is moved to close a joint has another orientation for its spin. */
SADMM_INLINE bool joint_island_may_open(int bits) { return (bits & (ISLAND_STRAYS | ISLAND_TURNS)) != 0; }

/* Are its bodies left with what the laws of locks make of them (joint_foresee)? Not if joints may be closed, or are
 * because they fold, or bodies have an inertia that is none. */
SADMM_INLINE bool joint_island_is_followed(int bits)
{
    return !(bits & (ISLAND_TRAPEZOID_OFF | ISLAND_CLOSED)) && !joint_island_may_open(bits);
}

/* A body as the step ends. */
struct joint_trapezoid {
    const struct sadmm_rigid *rigid; /* at the start; NULL: it does not move */
    double velocity[6], correction[6];
};

/* velocity: the solution; rigid NULL: not read. */
SADMM_INLINE struct joint_trapezoid joint_trapezoid_of(const struct sadmm_rigid *rigid, const double *velocity,
                                                       double dt)
{
    struct joint_trapezoid out;
    double before[6];
    int k;
    out.rigid = rigid;
    for (k = 0; k < 6; ++k) {
        out.velocity[k] = rigid ? velocity[k] : 0;
        out.correction[k] = 0;
    }
    if (!rigid) return out;
    spin_before(rigid, dt, before);
    body_trapezoid(rigid, before, velocity, out.correction);
    return out;
}

/* Of a pair of shapes in an island with joints, points with the solution's impulses: what one of them adds; is the
 * trapezoid correction off after all of them, since it would make a contact penetrate or a body rests on one? */
SADMM_INLINE void joint_contact_touches(const double normal[3], const struct sadmm_contact_point *point,
                                        const struct sadmm_contact_migration *migration,
                                        const struct joint_trapezoid bodies[2], const struct sadmm_settings *settings,
                                        struct trapezoid_touch *touch)
{
    const struct rolling_halfway at = rolling_halfway_of(normal, point, migration);
    const double *const v[2] = {bodies[0].velocity, bodies[1].velocity},
                 *const own[2] = {bodies[0].correction, bodies[1].correction};
    double correction[2], size[2], moves[2] = {0, 0}, rest[2] = {0, 0};
    int s;
    for (s = 0; s < 2; ++s) {
        const struct joint_trapezoid *body = &bodies[s];
        const double *arm = s ? at.arm_b : at.arm_a;
        size[s] = trapezoid_size(body->correction, arm);
        if (!body->rigid) continue;
        moves[s] = trapezoid_speed(body->rigid->velocity, body->velocity, arm);
        rest[s] = trapezoid_rest_speed(settings->gravity, body->rigid->gravity_scale, body->rigid->wrench,
                                       body->rigid->mass, settings->dt);
    }
    const struct trapezoid_separation separation = body_point_way(&at, point, v, own, correction);
    trapezoid_add_point(touch, separation, dot3(normal, point->impulse), correction, size, moves, rest, settings->dt,
                        settings->slop);
}
SADMM_INLINE bool joint_contacts_hold(const struct trapezoid_touch *touch, const struct joint_trapezoid bodies[2])
{
    const int supported = TOUCH_SUPPORTED | TOUCH_MOVED;
    bool holds = touch->island & TOUCH_PENETRATES;
    int s;
    for (s = 0; s < 2; ++s) holds = holds || (bodies[s].rigid && (touch->body[s] & supported) == TOUCH_SUPPORTED);
    return holds;
}

SADMM_INLINE bool joint_row_has_table(const struct sadmm_joint_source *source)
{
    return source->role == SADMM_ROLE_SPRING && source->separation < INFINITY;
}

/* Is the row a limit that presses, or a spring's table? */
SADMM_INLINE bool joint_row_limits(const struct sadmm_joint_source *source, double lambda)
{
    const bool limit = source->role == SADMM_ROLE_LOWER || source->role == SADMM_ROLE_UPPER;
    return (limit && lambda > 0) || joint_row_has_table(source);
}

/* Would the trapezoid correction move the joint beyond a limit that it has just reached, or beyond where a spring's
 * table stops it? (A limit that presses all the time, a stone on a string, is met by the mean of both velocities, too.)
 * row_a, row_b: the row's Jacobians. Bodies are read where joint_row_limits. */
SADMM_INLINE bool joint_limit_penetrates(const struct sadmm_joint_source *source, double lambda, const double row_a[6],
                                         const double row_b[6], const struct joint_trapezoid bodies[2],
                                         const struct sadmm_settings *settings)
{
    const bool table = joint_row_has_table(source);
    const double margin = source->slack + TRAPEZOID_SLOP * settings->slop;
    double correction = 0, speed = source->prescribed, way;
    int s, j;
    if (!joint_row_limits(source, lambda)) return false;
    for (s = 0; s < 2; ++s) {
        const double *row = s ? row_b : row_a;
        for (j = 0; j < 6; ++j) {
            correction += row[j] * bodies[s].correction[j];
            speed += row[j] * bodies[s].velocity[j];
        }
    }
    way = settings->dt * (speed - correction);
    if (!table) return source->separation + way < (source->separation < 0 ? source->separation : 0) - margin;
    return lambda < 0 ? way > max_of(source->separation, 0) + margin : -way > max_of(-source->separation, 0) + margin;
}

/* The coordinate in which a row holds a body to what does not move by itself, as a bit. */
SADMM_INLINE int joint_mooring(const struct sadmm_joint_source *source, double lambda,
                               const struct joint_trapezoid bodies[2])
{
    const bool moors = !bodies[0].rigid || !bodies[1].rigid;
    return moors && (source->role == SADMM_ROLE_LOCK || lambda != 0) ? 1 << source->coordinate : 0;
}
/* Bits of a constraint's rows: all coordinates, which leave its island no motion. */
#define JOINT_MOORED_WHOLLY 63

/* What a row says of its island. */
SADMM_INLINE int joint_row_touches(const struct sadmm_joint_source *source, double lambda, const double row_a[6],
                                   const double row_b[6], const struct joint_trapezoid bodies[2],
                                   const struct sadmm_settings *settings)
{
    const bool powers = source->role == SADMM_ROLE_DRIVE || source->role == SADMM_ROLE_SPRING ||
                        source->role == SADMM_ROLE_ARMATURE;
    const int bits = (joint_mooring(source, lambda, bodies) ? ISLAND_MOORED : 0) | (powers ? ISLAND_POWERED : 0);
    if (source->slack == INFINITY) return bits | ISLAND_TRAPEZOID_OFF | ISLAND_TURNS;
    return joint_limit_penetrates(source, lambda, row_a, row_b, bodies, settings) ? bits | ISLAND_TRAPEZOID_OFF : bits;
}

/* Position, orientation and velocity at the end, by the solution v. halfway: its orientation then (spin.h). What was
 * hit, which no joint holds, goes to its place by the velocity that it ends with. */
SADMM_INLINE void joint_move(const struct sadmm_rigid *from, const double halfway[4], const double v[6],
                             bool trapezoid_off, double dt, double position[3], double orientation[4],
                             double velocity[6])
{
    double mean[6];
    int k;
    for (k = 0; k < 6; ++k)
        mean[k] = trapezoid_off || (k < 3 && from->was_hit) ? v[k] : (from->velocity[k] + v[k]) / 2;
    spin_move_from(from, halfway, v, mean, trapezoid_off, dt, position, orientation, velocity);
}

#endif
