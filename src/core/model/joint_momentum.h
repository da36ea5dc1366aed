/* Momentum and energy of islands with joints (docs/internals/algorithm.md, "Momentum"). Iterations that are cut short
 * leave some of the momentum out, weights of the block direct solve keep more, and bodies without the trapezoid
 * correction go other ways than impulses between them were made for. So it is restored once all of that is known:
 * velocities at the end of the step change by a rigid motion of the whole island about where its bodies are then, which
 * no joint feels and no contact between them. What it should be follows from b, what bodies are halfway, and the
 * impulses' places there: of static contacts, and of rows of joints with what does not move by itself. Where the
 * correction is off, an airborne island is moved as a whole to where its centre of mass gets to by the mean of its
 * velocities: a weight halfway would turn it about any other point. And where rows turn by more than a step resolves it
 * is left with no more energy than in free motion. In double. */
#ifndef SADMM_CORE_MODEL_JOINT_MOMENTUM_H
#define SADMM_CORE_MODEL_JOINT_MOMENTUM_H

#include "core/math/momentum.h"
#include "joint_trapezoid.h"
#include "system_math.h"

/* Is there something to restore? bits: of an island, but for ISLAND_ANCHORED where that is not known yet. What nothing
 * touches has it already, but where the stiffness of joints holds on to some, or they have been closed; and what hangs
 * on rows that turn by more than a step resolves (joint_law.h) has neither its impulses nor its weight where they
 * act. */
SADMM_INLINE bool joint_island_is_floating(int bits)
{
    if (!(bits & ISLAND_ARTICULATED) || bits & ISLAND_ANCHORED) return false;
    if (bits & ISLAND_MOORED) return bits & (ISLAND_TOUCHED | ISLAND_TRAPEZOID_OFF) && !(bits & ISLAND_TURNS);
    return (bits & (ISLAND_TOUCHED | ISLAND_TRAPEZOID_OFF | ISLAND_STRAYS | ISLAND_CLOSED)) != 0;
}

/* Sums over an island; then what restores it: velocities times `factor`, the rigid motion in sums.now, and what all of
 * it is moved by. */
struct joint_momentum {
    struct momentum_sums sums;
    double energy, free_energy; /* twice the kinetic energy: at the end; of free motion, b . A^-1 b */
    double halfway[3];          /* sum m d halfway */
    double factor, shift[3];
};
enum { JOINT_MOMENTUM_SUMS = MOMENTUM_SUMS + 5 };

/* Where a body is halfway, from the island's origin. */
SADMM_INLINE void joint_halfway(const struct sadmm_rigid *from, const double origin[3], double dt, double d[3])
{
    int k;
    for (k = 0; k < 3; ++k) d[k] = from->position[k] - origin[k] + dt / 2 * from->velocity[k];
}

SADMM_INLINE double joint_free_energy(double mass, sym3 inertia, const double b[6])
{
    const vec3 angular = v3_load(b + 3);
    mat3 rows;
    rows.r[0] = v3(inertia.xx, inertia.xy, inertia.xz);
    rows.r[1] = v3(inertia.xy, inertia.yy, inertia.yz);
    rows.r[2] = v3(inertia.xz, inertia.yz, inertia.zz);
    return dot3(b, b) / mass + v3_dot(angular, m3_solve(rows, angular));
}

/* A body that the step moves to this pose and velocity. spin: halfway; bits: of its island, whose energies are read
 * where rows of it turn by more than a step resolves. */
SADMM_INLINE void joint_add_momentum_by(struct joint_momentum *to, const struct sadmm_rigid *from,
                                        const struct spin_system *spin, const double position[3],
                                        const double orientation[4], const double velocity[6], const double origin[3],
                                        int bits, const struct sadmm_settings *settings)
{
    const bool energies = (bits & ISLAND_TURNS) != 0;
    const double none[6] = {0, 0, 0, 0, 0, 0};
    double mass, b[6], halfway[3], end[3], A[PACKED6];
    /* stiffness of joints moves no momentum to anything */
    sym3 inertia;
    int k;
    if (energies || rolling_turns_on(from) || rolling_is_stiff(from))
        inertia = sadmm_rigid_body_by(from, spin, rolling_is_stiff(from), settings, &mass, b);
    else mass = sadmm_rigid_load(from, spin, settings, b);
    if (energies) to->free_energy += joint_free_energy(mass, inertia, b);
    joint_halfway(from, origin, settings->dt, halfway);
    inertia = rigid_world_inertia(q_matrix(q_load(orientation)),
                                  v3_scale(v3_load(from->inertia), forces_damping_of(from, 1, settings->dt).mass));
    if (rolling_is_stiff(from)) inertia = s3_add(inertia, sadmm_stiffness(from, settings->dt)); /* as in b */
    if (energies)
        to->energy += mass * dot3(velocity, velocity) +
                      v3_dot(v3_load(velocity + 3), s3_mul(inertia, v3_load(velocity + 3)));
    for (k = 0; k < PACKED6; ++k) A[k] = 0;
    A[0] = A[2] = A[5] = mass;
    A[9] = inertia.xx, A[14] = inertia.yy, A[20] = inertia.zz;
    A[13] = inertia.xy, A[18] = inertia.xz, A[19] = inertia.yz;
    for (k = 0; k < 3; ++k) end[k] = position[k] - origin[k];
    momentum_add_body(&to->sums, end, A, velocity, none);
    for (k = 0; k < 6; ++k) to->sums.free[k] += b[k];
    for (k = 0; k < 3; ++k) to->halfway[k] += mass * halfway[k];
    add_cross(halfway, b, 1, to->sums.free + 3);
}

/* turned: its orientation halfway (spin.h). */
SADMM_INLINE void joint_add_momentum(struct joint_momentum *to, const struct sadmm_rigid *from,
                                     const double turned[4], const double position[3],
                                     const double orientation[4], const double velocity[6], const double origin[3],
                                     int bits, const struct sadmm_settings *settings)
{
    const struct spin_system spin = spin_system_at(from, turned, settings->dt);
    joint_add_momentum_by(to, from, &spin, position, orientation, velocity, origin, bits, settings);
}

/* The points of a static contact pair of its body; */
SADMM_INLINE void joint_add_static_point(struct joint_momentum *to, const double normal[3], double friction,
                                         const struct sadmm_rigid *body, const double arm[3], const double origin[3],
                                         double dt)
{
    double r[3];
    int k;
    joint_halfway(body, origin, dt, r);
    for (k = 0; k < 3; ++k) r[k] += arm[k];
    momentum_add_contact(to->sums.gram, normal, friction, r);
}

/* and a row with the static world, or a body of prescribed motion: it acts if it has a multiplier. */
SADMM_INLINE void joint_add_static_row(struct joint_momentum *to, const double jacobian[6], double lambda,
                                       const struct sadmm_rigid *body, const double origin[3], double dt)
{
    double d[3];
    if (lambda == 0) return;
    joint_halfway(body, origin, dt, d);
    momentum_add_row(to->sums.gram, jacobian, d);
}

/* An airborne island whose trapezoid correction is off: sums are about where its bodies are before they are moved. */
SADMM_INLINE void joint_find_shift(struct joint_momentum *of, double dt)
{
    struct momentum_sums *s = &of->sums;
    int k;
    for (k = 0; k < 3; ++k) of->shift[k] = (of->halfway[k] + dt / 2 * s->free[k] - s->moment[k]) / s->mass;
    add_cross(of->shift, s->free, -1, s->free + 3);
}

/* As a whole an island may turn by so much in half a step, rad. What turns by more, and whose rows turn by more than a
 * step resolves, is left alone: joints open by so much that its inertia is another one after each step. */
#define JOINT_MOST_WHOLE_TURN 0.25 /* measured: bench/constants.py, mechanisms motion */

SADMM_INLINE bool joint_turns_as_a_whole(const struct momentum_motions *motions, double dt)
{
    double turn[3] = {0, 0, 0};
    int k, j;
    for (k = 0; k < motions->count; ++k)
        for (j = 0; j < 3; ++j) turn[j] += dt / 2 * motions->free[k] * motions->motion[k][j + 3];
    return size3(turn) > JOINT_MOST_WHOLE_TURN;
}

/* What is left of how bodies move against each other, so that an island in the air has no more energy than in free
 * motion, or, where springs and drives act, than the step has left it with. */
SADMM_INLINE double joint_slowing(const struct joint_momentum *of, const struct momentum_motions *motions, int bits)
{
    const double most = bits & ISLAND_POWERED ? max_of(of->energy, of->free_energy) : of->free_energy;
    double now = 0, free = 0;
    int k;
    for (k = 0; k < motions->count; ++k) {
        now += motions->now[k] * motions->now[k];
        free += motions->free[k] * motions->free[k];
    }
    if (free + of->energy - now <= most) return 1;
    return free < most ? sqrt((most - free) / (of->energy - now)) : 0;
}

/* What restores the island. bits: of the island. */
SADMM_INLINE void joint_restoring(struct joint_momentum *of, int bits, double dt)
{
    const bool airborne = of->sums.gram[MOMENTUM_CONTACTS] == 0;
    struct momentum_motions motions;
    of->factor = 1;
    of->shift[0] = of->shift[1] = of->shift[2] = 0;
    if (airborne && bits & ISLAND_TRAPEZOID_OFF) joint_find_shift(of, dt);
    momentum_find_motions(&of->sums, &motions);
    if (bits & ISLAND_TURNS && (!airborne || joint_turns_as_a_whole(&motions, dt))) motions.count = 0;
    else if (bits & ISLAND_TURNS) of->factor = joint_slowing(of, &motions, bits);
    momentum_restoring(&motions, of->factor, of->sums.now);
}

SADMM_INLINE void joint_restore(const struct joint_momentum *by, double position[3], const double origin[3],
                                double velocity[6])
{
    double d[3];
    int k;
    for (k = 0; k < 3; ++k) d[k] = position[k] - origin[k];
    momentum_move(by->sums.now, by->factor, d, velocity);
    for (k = 0; k < 3; ++k) position[k] += by->shift[k];
}

#endif
