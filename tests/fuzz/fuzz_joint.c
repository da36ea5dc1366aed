/* Joints, couplings, gears and springs' tables of a world: the input is a program of calls with ordinary, extreme and
 * wrong definitions, stale ids, and memory that runs out. Whatever the calls:
 *
 *   - a call that fails leaves joints, bodies and their states as they were, and says why
 *   - after a step that succeeds every state of a body and of a joint is finite, and a joint gives one body the
 *     opposite of what it gives the other
 *   - what was set is what is read, and a joint is there until it or one of its bodies is removed
 * / */
#include <string.h>

#include "bytes.h"
#include "core/base/memory.h"
#include "subadmm/coupling.h"
#include "subadmm/gear.h"
#include "subadmm/joint.h"
#include "subadmm/problem.h"
#include "subadmm/world.h"

enum { BODIES = 5, MAX_JOINTS = 8, MAX_CALLS = 48, MAX_STEPS = 12, IDS = 16, COORDINATES = 6 };

struct machine {
    struct bytes in;
    sadmm_world *world;
    sadmm_problem *problem;
    sadmm_body_id bodies[BODIES];
    sadmm_joint_id joints[IDS];
    int joint_ids; /* ever made; the last IDS of them are kept, removed ones too */
    sadmm_coupling_id couplings[IDS];
    sadmm_gear_id gears[IDS];
    int coupling_ids, gear_ids;
    int steps;
};

/* ---- what a failed call must not change -------------------------------------------------------------------------- */

struct picture {
    uint64_t states, joints, others; /* others: couplings, gears */
    int32_t bodies, count;
};

static uint64_t mix(uint64_t hash, const void *data, size_t size)
{
    const uint8_t *byte = data;
    for (size_t k = 0; k < size; ++k) hash = (hash ^ byte[k]) * UINT64_C(0x100000001b3);
    return hash;
}

static uint64_t mix_coordinate(uint64_t hash, const sadmm_joint_coordinate *c)
{
    const double numbers[] = {c->lower,         c->upper,       c->target_position, c->target_speed,
                              c->drive_stiffness, c->drive_damping, c->drive_force,  c->friction,
                              c->spring_stiffness, c->spring_damping, c->spring_rest,
                              c->armature};
    hash = mix(hash, numbers, sizeof numbers);
    hash = mix(hash, &c->drive, sizeof c->drive);
    return mix(hash, &c->limited, sizeof c->limited);
}

static uint64_t inspect_others(sadmm_world *world)
{
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    for (int32_t k = 0; k < sadmm_world_coupling_count(world); ++k) {
        sadmm_coupling_id id;
        sadmm_coupling_def def;
        sadmm_coupling_state state;
        MUST(sadmm_world_coupling_at(world, k, &id) == SADMM_OK, "coupling %d", k);
        MUST(sadmm_world_coupling_def(world, id, &def) == SADMM_OK, "coupling %d", k);
        MUST(sadmm_world_coupling_state(world, id, &state) == SADMM_OK, "coupling %d", k);
        hash = mix(hash, def.target_position, sizeof def.target_position);
        hash = mix(hash, def.target_velocity, sizeof def.target_velocity);
        hash = mix(hash, &def.linear_stiffness, sizeof def.linear_stiffness);
        hash = mix(hash, &def.max_torque, sizeof def.max_torque);
        hash = mix(hash, &def.enabled, sizeof def.enabled);
        hash = mix(hash, &state, sizeof state);
    }
    for (int32_t k = 0; k < sadmm_world_gear_count(world); ++k) {
        sadmm_gear_id id;
        sadmm_gear_def def;
        sadmm_gear_state state;
        MUST(sadmm_world_gear_at(world, k, &id) == SADMM_OK, "gear %d", k);
        MUST(sadmm_world_gear_def(world, id, &def) == SADMM_OK, "gear %d", k);
        MUST(sadmm_world_gear_state(world, id, &state) == SADMM_OK, "gear %d", k);
        hash = mix(hash, &def.ratio, sizeof def.ratio);
        hash = mix(hash, &def.enabled, sizeof def.enabled);
        hash = mix(hash, &state, sizeof state);
    }
    return hash;
}

static struct picture inspect(sadmm_world *world)
{
    struct picture p = {.joints = UINT64_C(0xcbf29ce484222325)};
    MUST(sadmm_world_state_hash(world, &p.states) == SADMM_OK, "state hash");
    p.bodies = sadmm_world_body_count(world);
    p.count = sadmm_world_joint_count(world);
    for (int32_t k = 0; k < p.count; ++k) {
        sadmm_joint_id id;
        sadmm_joint_def def;
        sadmm_joint_state state;
        MUST(sadmm_world_joint_at(world, k, &id) == SADMM_OK, "joint %d", k);
        MUST(sadmm_world_joint_def(world, id, &def) == SADMM_OK, "joint %d", k);
        MUST(sadmm_world_joint_state(world, id, &state) == SADMM_OK, "joint %d", k);
        p.joints = mix(p.joints, &id, sizeof id);
        p.joints = mix(p.joints, &def.kind, sizeof def.kind);
        p.joints = mix(p.joints, &def.locks, sizeof def.locks);
        p.joints = mix(p.joints, &def.length, sizeof def.length);
        p.joints = mix(p.joints, &def.enabled, sizeof def.enabled);
        p.joints = mix(p.joints, &def.break_force, sizeof def.break_force);
        p.joints = mix(p.joints, &def.break_torque, sizeof def.break_torque);
        p.joints = mix(p.joints, def.position_a, sizeof def.position_a);
        p.joints = mix(p.joints, def.orientation_b, sizeof def.orientation_b);
        for (int c = 0; c < COORDINATES; ++c) p.joints = mix_coordinate(p.joints, &def.coordinates[c]);
        p.joints = mix(p.joints, &state, offsetof(sadmm_joint_state, broken)); /* doubles alone */
        p.joints = mix(p.joints, &state.broken, sizeof state.broken);
        for (int c = 0; c < COORDINATES; ++c) {
            double numbers[2][SADMM_MOST_SPRING_POINTS];
            int32_t points;
            MUST(sadmm_world_joint_spring_table(world, id, c, numbers[0], numbers[1], &points) == SADMM_OK, "a table");
            for (int n = 0; n < 2; ++n) p.joints = mix(p.joints, numbers[n], (size_t)points * sizeof **numbers);
        }
    }
    p.others = inspect_others(world);
    return p;
}

static double farther(double most, const double *x)
{
    for (int k = 0; k < 3; ++k) most = fmax(most, fabs(x[k]));
    return most;
}

static void must_be_sound(struct machine *m)
{
    double most = 0; /* any finite state may be set; differences of such may not be finite */
    for (int k = 0; k < BODIES; ++k) {
        sadmm_body_state s;
        sadmm_status status = sadmm_world_body_state(m->world, m->bodies[k], &s);
        MUST(status == SADMM_OK || status == SADMM_ERROR_STALE_ID, "body %d", k);
        if (status != SADMM_OK) continue;
        MUST(all_finite(s.position, 3) && all_finite(s.orientation, 4) && all_finite(s.linear_velocity, 3) &&
                 all_finite(s.angular_velocity, 3),
             "body %d", k);
        most = farther(farther(farther(most, s.position), s.linear_velocity), s.angular_velocity);
    }
    for (int32_t k = 0; most < 1e100 && k < sadmm_world_joint_count(m->world); ++k) {
        sadmm_joint_id id;
        sadmm_joint_state s;
        MUST(sadmm_world_joint_at(m->world, k, &id) == SADMM_OK, "joint %d", k);
        MUST(sadmm_world_joint_state(m->world, id, &s) == SADMM_OK, "joint %d", k);
        MUST(all_finite(s.position, 6) && all_finite(s.speed, 6) && all_finite(s.point, 3),
             "joint %d: position %g %g %g %g %g %g, speed %g %g %g %g %g %g, point %g", k, s.position[0], s.position[1],
             s.position[2], s.position[3], s.position[4], s.position[5], s.speed[0], s.speed[1], s.speed[2], s.speed[3],
             s.speed[4], s.speed[5], s.point[0]);
        MUST(all_finite(s.lock_force, 6) && all_finite(s.limit_force, 6) && all_finite(s.drive_force, 6) &&
                 all_finite(s.friction_force, 6) && all_finite(s.spring_force, 6) &&
                 all_finite(s.armature_force, 6) && all_finite(s.wrench_joint, 6),
             "joint %d", k);
        for (int j = 0; j < 6; ++j)
            MUST(s.wrench_a[j] == -s.wrench_b[j] && isfinite(s.wrench_b[j]), "joint %d: %g, %g", k, s.wrench_a[j],
                 s.wrench_b[j]);
    }
    for (int32_t k = 0; most < 1e100 && k < sadmm_world_coupling_count(m->world); ++k) {
        sadmm_coupling_id id;
        sadmm_coupling_state s;
        MUST(sadmm_world_coupling_at(m->world, k, &id) == SADMM_OK, "coupling %d", k);
        MUST(sadmm_world_coupling_state(m->world, id, &s) == SADMM_OK, "coupling %d", k);
        MUST(all_finite(s.reaction_force, 3) && all_finite(s.reaction_torque, 3) && all_finite(s.body_force, 3) &&
                 all_finite(s.body_torque, 3) && all_finite(s.rotation_error, 3),
             "coupling %d", k);
    }
    sadmm_step_report report;
    MUST(sadmm_world_report(m->world, &report) == SADMM_OK, "report");
    MUST(report.joints >= 0 && report.joints <= sadmm_world_joint_count(m->world), "%d joints", report.joints);
    const sadmm_certificate *c = &report.certificate;
    if (sadmm_world_settings(m->world).certify)
        MUST(isfinite(c->ncp_max) && c->ncp_max >= 0 && isfinite(c->momentum_max) && c->momentum_max >= 0,
             "natural map %g, momentum %g", c->ncp_max, c->momentum_max);
}

/* ---- arguments --------------------------------------------------------------------------------------------------- */

static sadmm_body_id take_body(struct machine *m)
{
    const int which = take_choice(&m->in, BODIES + 1);
    return which < BODIES ? m->bodies[which] : (sadmm_body_id){0, 0};
}

static sadmm_joint_id take_joint(struct machine *m)
{
    sadmm_joint_id none = {take_choice(&m->in, 16) == 15 ? take_byte(&m->in) : 0, 1};
    return m->joint_ids == 0 || none.slot ? none
                                          : m->joints[take_choice(&m->in, m->joint_ids < IDS ? m->joint_ids : IDS)];
}

static double take_gain(struct bytes *in)
{
    return take_rarely(in, 16) ? take_extreme(in) : take_scale(in, 1e-3, 1e12);
}

static void take_coordinate(struct bytes *in, sadmm_joint_coordinate *c)
{
    const int what = take_byte(in);
    if (what & 1) {
        c->limited = true;
        c->lower = take_choice(in, 8) ? -take_scale(in, 1e-3, 10) : -INFINITY;
        c->upper = take_choice(in, 8) ? take_number(in, -1, 1) : INFINITY;
    }
    if (what & 2) {
        c->drive = (sadmm_drive)(take_rarely(in, 32) ? take_byte(in) : take_choice(in, SADMM_DRIVE_COUNT));
        c->target_position = take_number(in, -4, 4);
        c->target_speed = take_number(in, -10, 10);
        c->drive_stiffness = take_gain(in);
        c->drive_damping = take_gain(in);
        if (take_choice(in, 2)) c->drive_force = take_gain(in);
    }
    if (what & 4) c->friction = take_choice(in, 4) ? take_number(in, 0, 10) : take_gain(in);
    if (what & 16) c->armature = take_gain(in);
    if (what & 8) {
        c->spring_stiffness = take_gain(in);
        c->spring_damping = take_choice(in, 2) ? take_gain(in) : 0;
        c->spring_rest = take_number(in, -1, 1);
    }
}

static sadmm_joint_def take_joint_def(struct machine *m)
{
    struct bytes *in = &m->in;
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = (sadmm_joint_kind)(take_rarely(in, 64) ? take_byte(in) : take_choice(in, SADMM_JOINT_KIND_COUNT));
    def.locks = take_byte(in);
    if (!take_rarely(in, 16)) def.locks &= 63;
    def.body_a = take_body(m);
    def.body_b = take_body(m);
    if (take_choice(in, 4)) {
        double at[3], q[4];
        take_vector(in, -1, 1, at);
        take_orientation(in, q);
        /* where it cannot, the frames are at the centres, which need not fit */
        (void)sadmm_world_place_joint(m->world, &def, at, q);
    } else {
        take_vector(in, -1, 1, def.position_a);
        take_vector(in, -1, 1, def.position_b);
        take_orientation(in, def.orientation_a);
        take_orientation(in, def.orientation_b);
    }
    if (take_choice(in, 4) == 3) def.length = take_number(in, 0, 2);
    def.collide = take_choice(in, 2);
    def.enabled = take_choice(in, 8) != 7;
    if (take_choice(in, 4) == 3) def.break_force = take_gain(in);
    if (take_choice(in, 4) == 3) def.break_torque = take_gain(in);
    for (int k = 0; k < COORDINATES; ++k)
        if (take_choice(in, 4) == 3) take_coordinate(in, &def.coordinates[k]);
    return def;
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

static sadmm_status add_joint(struct machine *m)
{
    const sadmm_joint_def def = take_joint_def(m);
    sadmm_joint_def read;
    sadmm_joint_id id;
    const bool null = take_rarely(&m->in, 64);
    if (sadmm_world_joint_count(m->world) >= MAX_JOINTS) return SADMM_OK;
    sadmm_status status = sadmm_world_add_joint(m->world, null ? NULL : &def, &id);
    if (status != SADMM_OK) return status;
    m->joints[m->joint_ids++ % IDS] = id;
    MUST(sadmm_world_joint_def(m->world, id, &read) == SADMM_OK, "a new joint");
    MUST(read.kind == def.kind && read.enabled == def.enabled && read.collide == def.collide &&
             memcmp(read.position_a, def.position_a, sizeof def.position_a) == 0,
         "a new joint");
    return SADMM_OK;
}

static sadmm_status set_coordinate(struct machine *m)
{
    sadmm_joint_id id = take_joint(m);
    const int32_t index = take_rarely(&m->in, 32) ? take_byte(&m->in) - 128 : take_choice(&m->in, COORDINATES);
    sadmm_joint_coordinate coordinate = sadmm_joint_def_default().coordinates[0];
    sadmm_joint_def read;
    take_coordinate(&m->in, &coordinate);
    sadmm_status status = sadmm_world_set_joint_coordinate(m->world, id, index, &coordinate);
    if (status != SADMM_OK) return status;
    MUST(sadmm_world_joint_def(m->world, id, &read) == SADMM_OK, "a coordinate that was set");
    MUST(mix_coordinate(1, &read.coordinates[index]) == mix_coordinate(1, &coordinate), "a coordinate that was set");
    return SADMM_OK;
}

static sadmm_coupling_id take_coupling(struct machine *m)
{
    const int kept = m->coupling_ids < IDS ? m->coupling_ids : IDS;
    return kept && !take_rarely(&m->in, 16) ? m->couplings[take_choice(&m->in, kept)] : (sadmm_coupling_id){0, 1};
}

static sadmm_status add_coupling(struct machine *m)
{
    struct bytes *in = &m->in;
    sadmm_coupling_def def = sadmm_coupling_def_default();
    sadmm_coupling_id id;
    def.body = take_body(m);
    take_vector(in, -1, 1, def.position);
    take_orientation(in, def.orientation);
    take_vector(in, -2, 2, def.target_position);
    take_orientation(in, def.target_orientation);
    take_vector(in, -1, 1, def.target_velocity + 3);
    def.linear_stiffness = take_gain(in);
    def.linear_damping = take_gain(in);
    def.angular_stiffness = take_gain(in);
    def.angular_damping = take_gain(in);
    if (take_choice(in, 2)) def.max_force = take_gain(in);
    if (take_choice(in, 2)) def.max_torque = take_gain(in);
    def.enabled = take_choice(in, 8) != 7;
    if (sadmm_world_coupling_count(m->world) >= MAX_JOINTS) return SADMM_OK;
    const sadmm_status status = sadmm_world_add_coupling(m->world, &def, &id);
    if (status == SADMM_OK) m->couplings[m->coupling_ids++ % IDS] = id;
    return status;
}

static sadmm_status change_coupling(struct machine *m)
{
    struct bytes *in = &m->in;
    const sadmm_coupling_id id = take_coupling(m);
    const double gains[2] = {take_gain(in), take_gain(in)};
    double at[3], q[4], velocity[6];
    switch (take_choice(in, 8)) {
    case 0: return sadmm_world_remove_coupling(m->world, id);
    case 1: return sadmm_world_set_coupling_enabled(m->world, id, take_choice(in, 2));
    case 2: return sadmm_world_set_coupling_limits(m->world, id, gains[0], gains[1]);
    case 3: return sadmm_world_set_coupling_gains(m->world, id, gains[0], gains[1], 1, 0);
    default:
        take_vector(in, -2, 2, at);
        take_orientation(in, q);
        take_vector(in, -1, 1, velocity);
        take_vector(in, -10, 10, velocity + 3);
        return sadmm_world_set_coupling_target(m->world, id, at, q, take_choice(in, 2) ? velocity : NULL);
    }
}

static sadmm_status change_gear(struct machine *m)
{
    struct bytes *in = &m->in;
    sadmm_gear_def def = sadmm_gear_def_default();
    sadmm_gear_id id = {0, 1};
    const int kept = m->gear_ids < IDS ? m->gear_ids : IDS;
    const int what = take_choice(in, 4);
    if (what < 2) {
        if (kept) id = m->gears[take_choice(in, kept)];
        return what ? sadmm_world_set_gear_enabled(m->world, id, take_choice(in, 2))
                    : sadmm_world_remove_gear(m->world, id);
    }
    def.joint_1 = take_joint(m);
    def.joint_2 = take_joint(m);
    def.coordinate_1 = take_choice(in, COORDINATES);
    def.coordinate_2 = take_choice(in, COORDINATES);
    def.ratio = take_number(in, -4, 4);
    if (take_choice(in, 2)) def.offset = take_number(in, -1, 1);
    if (sadmm_world_gear_count(m->world) >= MAX_JOINTS) return SADMM_OK;
    const sadmm_status status = sadmm_world_add_gear(m->world, &def, &id);
    if (status == SADMM_OK) m->gears[m->gear_ids++ % IDS] = id;
    return status;
}

static sadmm_status set_table(struct machine *m)
{
    struct bytes *in = &m->in;
    const sadmm_joint_id id = take_joint(m);
    const int32_t index = take_choice(in, COORDINATES);
    double positions[8], forces[8], at = -1;
    const int32_t count = take_choice(in, 9);
    for (int32_t k = 0; k < count; ++k) {
        positions[k] = take_rarely(in, 32) ? take_extreme(in) : at;
        forces[k] = take_rarely(in, 32) ? take_extreme(in) : take_in(in, -1e6, 1e6);
        at += take_scale(in, 1e-6, 1);
    }
    return sadmm_world_set_joint_spring_table(m->world, id, index, positions, forces, count);
}

static sadmm_status set_state(struct machine *m)
{
    sadmm_body_state s;
    sadmm_body_id id = take_body(m);
    take_vector(&m->in, -2, 2, s.position);
    take_orientation(&m->in, s.orientation);
    take_vector(&m->in, -10, 10, s.linear_velocity);
    take_vector(&m->in, -100, 100, s.angular_velocity);
    return sadmm_world_set_body_state(m->world, id, &s);
}

static sadmm_status set_settings(struct machine *m)
{
    sadmm_settings s = sadmm_world_settings(m->world);
    switch (take_choice(&m->in, 8)) {
    case 0: s.dt = take_scale(&m->in, 1e-5, 0.1); break;
    case 1: s.method = (sadmm_method)take_choice(&m->in, 2); break;
    case 2: s.iterations = take_byte(&m->in); break;
    case 3: s.substeps = take_choice(&m->in, 4); break;
    case 4: s.certify = take_choice(&m->in, 2); break;
    case 5: s.correction_speed = take_number(&m->in, 0, 1e3); break;
    case 6: s.ncp_points = take_byte(&m->in); break; /* some beyond the range */
    default: take_vector(&m->in, -20, 20, s.gravity); break;
    }
    return sadmm_world_set_settings(m->world, &s);
}

static sadmm_status step(struct machine *m)
{
    if (m->steps >= MAX_STEPS) return SADMM_OK;
    ++m->steps;
    sadmm_status status = sadmm_world_step(m->world);
    if (status != SADMM_OK) return status;
    sadmm_test_fail_allocations_after(-1);
    must_be_sound(m);
    return SADMM_OK;
}

static sadmm_status freeze(struct machine *m)
{
    sadmm_certificate certificate;
    sadmm_status status = sadmm_world_freeze(m->world, m->problem);
    if (status != SADMM_OK) return status;
    sadmm_test_fail_allocations_after(-1);
    status = sadmm_problem_certify(m->problem, &certificate);
    MUST(status == SADMM_OK || status == SADMM_ERROR_NON_FINITE, "%s", sadmm_problem_message(m->problem));
    return SADMM_OK;
}

static sadmm_status make_call(struct machine *m)
{
    sadmm_joint_id joint;
    switch (take_choice(&m->in, 21)) {
    case 0: case 1: case 2: case 3: return add_joint(m);
    case 4: return sadmm_world_remove_joint(m->world, take_joint(m));
    case 5:
        joint = take_joint(m);
        return sadmm_world_set_joint_enabled(m->world, joint, take_choice(&m->in, 2));
    case 6: case 7: return set_coordinate(m);
    case 8: return take_rarely(&m->in, 4) ? sadmm_world_remove_body(m->world, take_body(m)) : set_state(m);
    case 9: return set_settings(m);
    case 10: return freeze(m);
    case 16: return add_coupling(m);
    case 17: case 18: return change_coupling(m);
    case 19: return change_gear(m);
    case 20: return set_table(m);
    default: return step(m);
    }
}

/* A row of bodies, one of them static, one at times kinematic, light and heavy ones, boxes with three moments; the
 * first two touch. */
static void add_bodies(struct machine *m)
{
    for (int k = 0; k < BODIES; ++k) {
        sadmm_body_def def = sadmm_body_def_default();
        sadmm_shape_def shape = sadmm_shape_def_default();
        const int kind = take_choice(&m->in, 8);
        def.type = k == 2                ? SADMM_BODY_STATIC
                   : k == 1 && kind == 7 ? SADMM_BODY_KINEMATIC
                                         : SADMM_BODY_DYNAMIC;
        def.mass = kind == 0 ? 1e-3 : kind == 1 ? 1e3 : 1;
        shape.type = SADMM_SHAPE_BOX;
        for (int j = 0; j < 3; ++j) shape.size[j] = kind == 2 ? 0.25 : 0.1 * (j + 2);
        sadmm_box_inertia(def.mass, shape.size, def.inertia);
        def.position[0] = 0.5 * k;
        MUST(sadmm_world_add_body(m->world, &def, &m->bodies[k]) == SADMM_OK, "%s", sadmm_world_message(m->world));
        MUST(sadmm_world_add_shape(m->world, m->bodies[k], &shape, NULL) == SADMM_OK, "a shape");
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct machine m;
    memset(&m, 0, sizeof m);
    m.in = bytes_of(data, size);

    sadmm_world_def def = sadmm_world_def_default();
    const int backend = take_choice(&m.in, 8);
    def.backend = backend == 0 ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU;
    def.precision = backend < 5 ? SADMM_F64 : SADMM_F32;
    def.settings.threads = 1;
    def.settings.iterations = 8;
    MUST(sadmm_world_create(&def, &m.world) == SADMM_OK, "a world");
    MUST(sadmm_problem_create(&m.problem) == SADMM_OK, "a problem");
    add_bodies(&m);

    for (int call = 0; call < MAX_CALLS && bytes_left(&m.in); ++call) {
        const struct picture before = inspect(m.world);
        if (take_rarely(&m.in, 32)) sadmm_test_fail_allocations_after(take_choice(&m.in, 32));
        sadmm_status status = make_call(&m);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) continue;
        MUST(status > SADMM_OK && status < SADMM_STATUS_COUNT, "status %d", (int)status);
        MUST(sadmm_world_message(m.world)[0], "%s without a message", sadmm_status_name(status));
        const struct picture after = inspect(m.world);
        MUST(after.states == before.states && after.bodies == before.bodies, "%s: a body changed",
             sadmm_status_name(status));
        MUST(after.joints == before.joints && after.count == before.count, "%s: a joint changed",
             sadmm_status_name(status));
        MUST(after.others == before.others, "%s: a coupling or a gear changed", sadmm_status_name(status));
    }
    sadmm_problem_destroy(m.problem);
    sadmm_world_destroy(m.world);
    return 0;
}
