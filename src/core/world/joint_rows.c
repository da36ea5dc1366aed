/* Joints as constraint rows (docs/algorithm.md, section 10): Jacobians where the bodies are halfway through the step by
 * their velocities at its start, laws from the errors at its start, multipliers from the forces of the last step. */
#include <string.h>

#include "core/base/memory.h"
#include "core/math/rigid.h"
#include "core/model/forces.h"
#include "core/model/steady.h"
#include "world_internal.h"

/* Six locks, or for each free coordinate two limits, drive, friction, spring and armature. */
enum { MOST_JOINT_ROWS = 6 * JOINT_COORDINATES };

bool sadmm_joint_is_radial(sadmm_joint_kind kind)
{
    return kind == SADMM_JOINT_DISTANCE || kind == SADMM_JOINT_SPRING || kind == SADMM_JOINT_LINK;
}

struct joint_end sadmm_joint_end(const struct joint_frame *frame, const struct sadmm_rigid *rigid)
{
    const struct joint_end end = {frame->position, frame->position, frame->orientation};
    return rigid ? joint_end_of(frame, v3_load(rigid->position), q_load(rigid->orientation)) : end;
}

/* One body of a joint in a step. */
struct side {
    int32_t system_body;             /* -1: it is not solved for */
    bool moves;                      /* it is not static */
    const struct sadmm_rigid *rigid; /* at the step's start; NULL: the static world */
    double velocity[6], free[6];     /* at the start; at the end of free motion */
    quat back;                       /* what turns the row's torque to where the body's moments are (docs) */
};

struct acting_joint {
    struct side side[2];
    struct joint_geometry start, middle;
    quat frame; /* of a, in the middle */
};

static struct side side_of(const sadmm_world *world, int32_t slot, const sadmm_settings *settings)
{
    struct side side = {.system_body = -1, .back = {1, 0, 0, 0}};
    if (slot < 0) return side;
    const struct sadmm_world_body *body = &world->bodies[slot];
    side.rigid = &body->rigid;
    if (body->type == SADMM_BODY_STATIC) return side;
    side.moves = true;
    if (body->type == SADMM_BODY_KINEMATIC) {
        side.rigid = &world->driven[sadmm_driven(body->system_body)].rigid;
        memcpy(side.velocity, side.rigid->velocity, sizeof side.velocity);
        memcpy(side.free, side.velocity, sizeof side.free);
        return side;
    }
    side.system_body = body->system_body;
    side.rigid = &world->start.rigid[side.system_body];
    memcpy(side.velocity, side.rigid->velocity, sizeof side.velocity);
    forces_free(side.rigid, settings->gravity, settings->dt, side.free);
    if (!rigid_is_isotropic(v3_load(side.rigid->inertia)))
        side.back = q_exp(v3_scale(v3_load(side.velocity + 3), -settings->dt / 2));
    return side;
}

/* Where the side's body is after half a step. */
static struct sadmm_rigid halfway(const struct side *side, double dt)
{
    struct sadmm_rigid rigid = *side->rigid;
    v3_store(rigid_move(v3_load(rigid.position), v3_load(side->velocity), dt / 2), rigid.position);
    q_store(rigid_turn(q_load(rigid.orientation), v3_load(side->velocity + 3), dt / 2), rigid.orientation);
    return rigid;
}

static struct acting_joint prepare(const sadmm_world *world, const struct sadmm_world_joint *joint,
                                   const sadmm_settings *settings)
{
    const int radial = sadmm_joint_is_radial(joint->def.kind);
    struct acting_joint acting;
    struct joint_end start[2], middle[2];
    for (int s = 0; s < 2; ++s) {
        struct side *side = &acting.side[s];
        *side = side_of(world, joint->body[s], settings);
        start[s] = middle[s] = sadmm_joint_end(&joint->frame[s], side->rigid);
        if (!side->moves) continue;
        const struct sadmm_rigid rigid = halfway(side, settings->dt);
        middle[s] = sadmm_joint_end(&joint->frame[s], &rigid);
    }
    acting.start = joint_geometry_of(&start[0], &start[1], joint->def.locks, radial);
    acting.middle = joint_geometry_of(&middle[0], &middle[1], joint->def.locks, radial);
    acting.frame = middle[0].orientation;
    return acting;
}

/* The step's row of coordinate k on a side. */
static void step_row(const struct acting_joint *acting, int s, int k, double row[6])
{
    vec3 linear, angular;
    joint_row(&acting->middle, k, s ? acting->middle.arm_b : acting->middle.arm_a, &linear, &angular);
    const double sign = s ? 1 : -1;
    v3_store(v3_scale(linear, sign), row);
    v3_store(v3_scale(q_turn(acting->side[s].back, angular), sign), row + 3);
}

static double product(const double row[6], const double v[6])
{
    double sum = 0;
    for (int j = 0; j < 6; ++j) sum += row[j] * v[j];
    return sum;
}

double sadmm_joint_rate(const struct joint_geometry *geometry, int coordinate, const double *a, const double *b)
{
    const double *v[2] = {a, b};
    double rate = 0;
    for (int s = 0; s < 2; ++s) {
        vec3 linear, angular;
        joint_row(geometry, coordinate, s ? geometry->arm_b : geometry->arm_a, &linear, &angular);
        const double own = v3_dot(linear, v3_load(v[s])) + v3_dot(angular, v3_load(v[s] + 3));
        rate += s ? own : -own;
    }
    return rate;
}

/* row A^-1 row^T of a rigid body. */
static double response(const struct side *side, const double row[6])
{
    const double *inertia = side->rigid->inertia;
    const vec3 turn = m3_tmul(q_matrix(q_load(side->rigid->orientation)), v3_load(row + 3));
    return v3_norm2(v3_load(row)) / side->rigid->mass + turn.x * turn.x / inertia[0] + turn.y * turn.y / inertia[1] +
           turn.z * turn.z / inertia[2];
}

/* ---- laws -------------------------------------------------------------------------------------------------------- */

struct law {
    int role, coordinate, sign;
    double gain, bias, compliance, lo, hi;
    double gap, slack; /* of limits */
};

/* Of one coordinate, what its laws are made of. */
struct moving {
    const struct sadmm_joint_memory *memory;
    double value, before; /* and its rate, at the step's start */
    double turning;       /* what the row's rate by the velocities at the start is more: axes and arms turn */
    double turned;        /* what the rate at the end is more than the row's, so far as the law counts it */
    double reach;         /* it may move by so much */
    double response;
    double dt, most;      /* most: speed of corrections */
};

struct laws {
    struct law law[MOST_JOINT_ROWS];
    int count;
};

static void add_law(struct laws *laws, struct law law) { laws->law[laws->count++] = law; }

static struct moving moving_of(const struct sadmm_world_joint *joint, const struct acting_joint *acting, int k,
                               const sadmm_settings *settings)
{
    const struct side *a = &acting->side[0], *b = &acting->side[1];
    struct moving m = {.memory = &joint->next, .dt = settings->dt, .most = settings->correction_speed};
    double middle = 0, free = 0;
    m.value = acting->start.value[k];
    if (joint_winds(joint->def.locks, k)) m.value = joint_unwind(m.value, joint->next.angle[k]);
    if (k == 0 && joint->def.locks & 1 && sadmm_joint_is_radial(joint->def.kind)) m.value -= joint->def.length;
    m.before = sadmm_joint_rate(&acting->start, k, a->velocity, b->velocity);
    for (int s = 0; s < 2; ++s) {
        double row[6];
        if (!acting->side[s].moves) continue;
        step_row(acting, s, k, row);
        middle += product(row, acting->side[s].velocity);
        free += product(row, acting->side[s].free);
        if (acting->side[s].system_body >= 0) m.response += response(&acting->side[s], row);
    }
    m.turning = middle - m.before;
    m.turned = joint->next.leads_stay ? 0 : m.turning;
    m.reach = 2 * m.dt * fmax(fabs(m.before), fabs(free));
    return m;
}

static void add_limits(struct laws *laws, const struct moving *m, int k, const sadmm_joint_coordinate *c)
{
    for (int upper = 0; upper < 2; ++upper) {
        const int role = upper ? SADMM_ROLE_UPPER : SADMM_ROLE_LOWER, sign = upper ? -1 : 1;
        const double gap = upper ? c->upper - m->value : m->value - c->lower;
        const bool pressed = m->memory->force[role][k] != 0;
        if (gap > m->reach && !pressed) continue;
        /* it may close what is left in the step; once it presses it is held as what is locked is */
        const double speed = gap >= 0 && !pressed ? gap / m->dt : joint_feedback(gap, m->dt, m->most);
        if (isfinite(speed))
            add_law(laws, (struct law){role, k, sign, 1, sign * m->turned + speed, 0, 0, INFINITY, gap,
                                       2 * m->dt * fabs(m->turning)});
    }
}

static void add_spring(struct laws *laws, const struct moving *m, int k, int role, double stiffness, double damping,
                       double rest, double speed, double most)
{
    const double late = m->memory->leads_stay ? 1 : joint_late(stiffness, damping, m->response, m->dt);
    struct law law = {.role = role, .coordinate = k, .sign = 1, .compliance = 1, .lo = -most, .hi = most};
    joint_spring(stiffness, damping, m->value - rest, speed, m->before, m->dt, late, &law.gain, &law.bias);
    law.bias += law.gain * m->turned;
    add_law(laws, law);
}

static void add_free(struct laws *laws, const struct moving *m, int k, const sadmm_joint_coordinate *c)
{
    const double drive = c->drive_force * m->dt, friction = c->friction * m->dt;
    if (c->limited) add_limits(laws, m, k, c);
    if (c->drive == SADMM_DRIVE_SPEED && drive > 0)
        add_law(laws, (struct law){SADMM_ROLE_DRIVE, k, 1, 1, m->turned - c->target_speed, 0, -drive, drive, 0, 0});
    if (c->drive == SADMM_DRIVE_POSITION && drive > 0)
        add_spring(laws, m, k, SADMM_ROLE_DRIVE, c->drive_stiffness, c->drive_damping, c->target_position,
                   c->target_speed, drive);
    if (friction > 0)
        add_law(laws, (struct law){SADMM_ROLE_FRICTION, k, 1, 1, m->turned, 0, -friction, friction, 0, 0});
    if (c->spring_stiffness > 0 || c->spring_damping > 0)
        add_spring(laws, m, k, SADMM_ROLE_SPRING, c->spring_stiffness, c->spring_damping, c->spring_rest, 0, INFINITY);
    if (c->armature > 0) /* lambda = -armature (rate at the end - rate at the start) */
        add_law(laws, (struct law){SADMM_ROLE_ARMATURE, k, 1, c->armature, c->armature * (m->turned - m->before), 1,
                                   -INFINITY, INFINITY, 0, 0});
}

/* Locked coordinates first: they are held together. */
static void find_laws(struct sadmm_world_joint *joint, const struct acting_joint *acting,
                      const sadmm_settings *settings, struct laws *laws)
{
    laws->count = 0;
    for (int k = 0; k < JOINT_COORDINATES; ++k) {
        if (!(joint->def.locks >> k & 1)) continue;
        const struct moving m = moving_of(joint, acting, k, settings);
        add_law(laws, (struct law){SADMM_ROLE_LOCK, k, 1, 1, m.turned + joint_feedback(m.value, m.dt, m.most), 0,
                                   -INFINITY, INFINITY, 0, 0});
    }
    for (int k = 0; k < (sadmm_joint_is_radial(joint->def.kind) ? 1 : JOINT_COORDINATES); ++k) {
        if (joint->def.locks >> k & 1) continue;
        const struct moving m = moving_of(joint, acting, k, settings);
        if (joint_winds(joint->def.locks, k)) joint->next.angle[k] = m.value;
        add_free(laws, &m, k, &joint->def.coordinates[k]);
    }
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

static bool add_constraints(sadmm_world *world, int32_t slot, const struct acting_joint *acting,
                            const struct laws *laws, double dt)
{
    struct sadmm_rows *rows = &world->start.rows;
    const struct sadmm_world_joint *joint = &world->joints[slot];
    const size_t all = rows->row_count + (size_t)laws->count;
    if (!sadmm_grow(&world->joint_sources, &world->joint_source_capacity, rows->row_count, all,
                    sizeof *world->joint_sources) ||
        !sadmm_grow(&world->start.multiplier, &world->start.multiplier_capacity, rows->row_count, all,
                    sizeof *world->start.multiplier))
        return false;
    for (int i = 0; i < laws->count; ++i) {
        const struct law *law = &laws->law[i];
        if (i % SADMM_MAX_ROWS == 0) {
            const int left = laws->count - i, count = left < SADMM_MAX_ROWS ? left : SADMM_MAX_ROWS;
            if (sadmm_rows_add(rows, count, acting->side[0].system_body, acting->side[1].system_body) < 0)
                return false;
        }
        const size_t r = all - (size_t)laws->count + (size_t)i;
        double driven = 0;
        for (int s = 0; s < 2; ++s) {
            double *row = (s ? rows->jacobian_b : rows->jacobian_a) + 6 * r, given[6];
            const bool solved = acting->side[s].system_body >= 0;
            if (!acting->side[s].moves) continue;
            if (!solved) row = given;
            step_row(acting, s, law->coordinate, row);
            for (int j = 0; j < 6; ++j) row[j] *= law->sign;
            if (!solved) driven += product(row, acting->side[s].velocity);
        }
        sadmm_row_set(rows, (int32_t)r, law->gain, law->bias + law->gain * driven, law->compliance, law->lo, law->hi);
        rows->lambda[r] = world->start.multiplier[r] =
            law->sign * joint->next.force[law->role][law->coordinate] * dt;
        world->joint_sources[r] = (struct sadmm_joint_source){slot, (int8_t)law->role, (int8_t)law->coordinate,
                                                              (int8_t)law->sign, law->gap, law->slack, driven};
    }
    return true;
}

static void forget_forces(struct sadmm_joint_memory *memory)
{
    memset(memory->force, 0, sizeof memory->force);
    memset(memory->wrench, 0, sizeof memory->wrench);
    memset(memory->point, 0, sizeof memory->point);
    memset(memory->local, 0, sizeof memory->local);
}

sadmm_status sadmm_world_make_rows(sadmm_world *world, const sadmm_settings *settings)
{
    sadmm_rows_clear(&world->start.rows);
    world->joints_acting = 0;
    for (size_t slot = 0; world->joint_count > 0 && slot < world->joint_slots; ++slot) {
        struct sadmm_world_joint *joint = &world->joints[slot];
        struct laws laws;
        if (!joint->alive || !joint->def.enabled) continue;
        const struct acting_joint acting = prepare(world, joint, settings);
        find_laws(joint, &acting, settings, &laws);
        world->joints_acting += laws.count > 0;
        if (!add_constraints(world, (int32_t)slot, &acting, &laws, settings->dt))
            return sadmm_fail_memory(&world->error, "the joints' rows");
        forget_forces(&joint->next); /* the solution tells */
    }
    return SADMM_OK;
}

/* ---- from step to step ------------------------------------------------------------------------------------------- */

/* Both lists, sorted; a pair that is in both stands there twice. */
static sadmm_status filter_pairs(sadmm_world *world)
{
    const struct sadmm_pair_table *own = &world->disabled_pairs, *joined = &world->joined_pairs;
    const size_t count = own->count + joined->count;
    if (joined->count == 0) return SADMM_OK;
    if (!sadmm_grow_empty(&world->filtered_pairs, &world->filtered_capacity, count, sizeof *world->filtered_pairs))
        return sadmm_fail_memory(&world->error, "pairs of joined bodies");
    for (size_t k = 0, i = 0, j = 0; k < count; ++k) {
        const bool from_own = j == joined->count || (i < own->count && own->keys[i] < joined->keys[j]);
        world->filtered_pairs[k] = from_own ? own->keys[i++] : joined->keys[j++];
    }
    world->filtered_count = count;
    return SADMM_OK;
}

sadmm_status sadmm_world_begin_joints(sadmm_world *world)
{
    for (size_t slot = 0; world->joint_count > 0 && slot < world->joint_slots; ++slot) {
        struct sadmm_world_joint *joint = &world->joints[slot];
        joint->next = joint->last;
        if (!joint->def.enabled) forget_forces(&joint->next);
    }
    return filter_pairs(world);
}

/* What a force along coordinate k is in the world, about the joint's point. */
static void add_wrench(const struct joint_geometry *geometry, int k, double force, double wrench[6])
{
    for (int j = 0; j < 3; ++j) wrench[(k < 3 ? 0 : 3) + j] += force * v3_part(geometry->axis[k], j);
}

/* All rows of the joint are in its wrench. */
static void end_wrench(struct sadmm_world_joint *joint, const struct acting_joint *acting)
{
    struct sadmm_joint_memory *memory = &joint->next;
    const mat3 frame = q_matrix(acting->frame);
    for (int part = 0; part < 2; ++part)
        v3_store(m3_tmul(frame, v3_load(memory->wrench + 3 * part)), memory->local + 3 * part);
    memory->broken = memory->broken || v3_norm(v3_load(memory->wrench)) > joint->def.break_force ||
                     v3_norm(v3_load(memory->wrench + 3)) > joint->def.break_torque;
}

void sadmm_world_keep_rows(sadmm_world *world, const sadmm_settings *settings)
{
    const struct sadmm_rows *rows = &world->start.rows;
    struct sadmm_world_joint *joint = NULL;
    struct acting_joint acting;
    for (size_t r = 0; r < rows->row_count; ++r) {
        const struct sadmm_joint_source *source = &world->joint_sources[r];
        if (!joint || joint != &world->joints[source->joint]) {
            if (joint) end_wrench(joint, &acting);
            joint = &world->joints[source->joint];
            acting = prepare(world, joint, settings);
            v3_store(acting.middle.point, joint->next.point);
        }
        const double force = source->sign * rows->lambda[r] / settings->dt;
        joint->next.force[source->role][source->coordinate] = force;
        add_wrench(&acting.middle, source->coordinate, force, joint->next.wrench);
    }
    if (joint) end_wrench(joint, &acting);
}

static void commit_joint(struct sadmm_world_joint *joint)
{
    joint->last = joint->next;
    joint->def.enabled = joint->def.enabled && !joint->last.broken;
}

void sadmm_world_commit_joints(sadmm_world *world)
{
    for (size_t slot = 0; world->joint_count > 0 && slot < world->joint_slots; ++slot)
        if (world->joints[slot].alive) commit_joint(&world->joints[slot]);
}
