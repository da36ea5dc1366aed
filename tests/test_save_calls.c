/* Saved worlds after any sequence of calls. Two worlds get the same calls with the same arguments, drawn at random, and
 * the second one is replaced again and again by what was saved of the first: every call ends alike in both, and all
 * that is kept of them is the same to the bit. Calls that fail are among them: wrong arguments, ids of what is gone,
 * steps that end without finite numbers or without memory. */
#include <stdint.h>

#include "core/base/memory.h"
#include "core/model/joint_law.h"
#include "fixed_work.h"
#include "scene_tools.h"

enum { RUNS = 16, CALLS = 400, MOST_BODIES = 14, MOST_JOINTS = 16 };
enum { HEADER = 272 }; /* of a saved world: its size and checksum are at the end of it */

/* ---- what is drawn ----------------------------------------------------------------------------------------------- */

struct draw {
    uint64_t state;
};

static uint64_t bits(struct draw *d)
{
    d->state += UINT64_C(0x9e3779b97f4a7c15);
    uint64_t x = d->state;
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

static int below(struct draw *d, int n) { return (int)(bits(d) % (uint64_t)n); }
static bool rarely(struct draw *d, int n) { return below(d, n) == 0; }
static double number(struct draw *d, double low, double high)
{
    return low + (high - low) * ((double)(bits(d) >> 11) * 0x1p-53);
}
static double scale(struct draw *d, double low, double high) { return exp(number(d, log(low), log(high))); }

static void vector(struct draw *d, double size, double *x, int count)
{
    for (int k = 0; k < count; ++k) x[k] = number(d, -size, size);
}

static void turn(struct draw *d, double q[4])
{
    double norm = 0;
    vector(d, 1, q, 4);
    for (int k = 0; k < 4; ++k) norm += q[k] * q[k];
    for (int k = 0; k < 4; ++k) q[k] /= sqrt(norm);
    if (!(norm > 0.01) || rarely(d, 3)) q[0] = 1, q[1] = q[2] = q[3] = 0;
}

/* Of one object in three; the next call writes over it. */
static const char *any_name(struct draw *d)
{
    static char name[8];
    if (!rarely(d, 3)) return NULL;
    snprintf(name, sizeof name, "n%d", below(d, 256));
    return name;
}

/* ---- ids: of what is there as a rule, or of what is gone or never was -------------------------------------------- */

#define TAKE_ID(name, type, count_of, at)                                           \
    static type name(struct draw *d, sadmm_world *world)                            \
    {                                                                               \
        type id = {(uint32_t)below(d, 20), (uint32_t)below(d, 3)};                  \
        const int pick = below(d, 1 << 20), count = count_of(world);                \
        if (!rarely(d, 40) && count > 0) MUST(world, at(world, pick % count, &id)); \
        return id;                                                                  \
    }
TAKE_ID(any_body, sadmm_body_id, sadmm_world_body_count, sadmm_world_body_at)
TAKE_ID(any_shape, sadmm_shape_id, sadmm_world_shape_count, sadmm_world_shape_at)
TAKE_ID(any_joint, sadmm_joint_id, sadmm_world_joint_count, sadmm_world_joint_at)
TAKE_ID(any_gear, sadmm_gear_id, sadmm_world_gear_count, sadmm_world_gear_at)
TAKE_ID(any_coupling, sadmm_coupling_id, sadmm_world_coupling_count, sadmm_world_coupling_at)

/* ---- bodies and shapes ------------------------------------------------------------------------------------------- */

/* A hull, NULL where the library was built without what makes them. */
static sadmm_hull *make_hull(struct draw *d)
{
    static const double corners[6][3] = {{0, 0, 0.3},  {0.3, 0, 0},  {0, 0.3, 0},
                                         {-0.3, 0, 0}, {0, -0.2, 0}, {0, 0, -0.2}};
    sadmm_hull_def def = sadmm_hull_def_default();
    sadmm_hull *hull;
    def.points = corners[0], def.point_count = (size_t)(5 + below(d, 2));
    def.convex_radius = below(d, 2) ? 0.02 : 0;
    sadmm_test_fail_allocations_after(-1); /* that is for worlds */
    return sadmm_hull_create(&def, &hull) == SADMM_OK ? hull : NULL;
}

static sadmm_mesh *make_mesh(struct draw *d)
{
    static const double square[5][3] = {{-5, -5, 0}, {5, -5, 0}, {5, 5, 0}, {-5, 5, 0}, {0, 0, 0.4}};
    static const int32_t triangles[4][3] = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    static const double heights[9] = {0, 0.3, 0, 0.3, 0, 0.3, 0, 0.3, 0};
    sadmm_mesh *mesh;
    sadmm_mesh_def def = {sizeof def, square[0], 5, triangles[0], 4};
    sadmm_heightfield_def field = {sizeof field, heights, 3, 3, {3, 3}};
    sadmm_test_fail_allocations_after(-1);
    ck_assert_int_eq(below(d, 2) ? sadmm_mesh_create(&def, &mesh) : sadmm_heightfield_create(&field, &mesh), SADMM_OK);
    return mesh;
}

/* That of a shape of the world: its hull or mesh is that of another one then. */
static bool take_block(struct draw *d, sadmm_world *world, sadmm_shape_def *def)
{
    const sadmm_shape_id id = any_shape(d, world);
    sadmm_shape_def other;
    if (sadmm_world_shape_def(world, id, &other, NULL) != SADMM_OK || other.type != def->type) return false;
    def->hull = other.hull, def->mesh = other.mesh;
    return true;
}

static sadmm_status add_shape_to(struct draw *d, sadmm_world *world, sadmm_body_id body)
{
    static const sadmm_shape_type smooth[] = {SADMM_SHAPE_SPHERE,   SADMM_SHAPE_BOX,  SADMM_SHAPE_CAPSULE,
                                              SADMM_SHAPE_CYLINDER, SADMM_SHAPE_CONE, SADMM_SHAPE_ELLIPSOID};
    sadmm_shape_def def = sadmm_shape_def_default();
    const int kind = below(d, 10);
    def.name = any_name(d);
    def.type = kind == 9   ? SADMM_SHAPE_PLANE
               : kind == 8 ? SADMM_SHAPE_MESH
               : kind == 7 ? SADMM_SHAPE_HULL
                           : smooth[kind % 6];
    for (int k = 0; k < 3; ++k) def.size[k] = number(d, 0.05, 0.3);
    if (rarely(d, 3)) vector(d, 0.3, def.position, 3);
    if (rarely(d, 3)) turn(d, def.orientation);
    def.friction = rarely(d, 4) ? number(d, 0, 2) : 0.5;
    def.restitution = rarely(d, 4) ? number(d, -0.05, 1) : 0;
    if (rarely(d, 8)) def.category = (uint32_t)below(d, 4), def.mask = (uint32_t)below(d, 4);
    def.sensor = rarely(d, 10);
    sadmm_hull *hull = NULL;
    sadmm_mesh *mesh = NULL;
    if (!take_block(d, world, &def)) {
        if (def.type == SADMM_SHAPE_HULL) def.hull = hull = make_hull(d);
        if (def.type == SADMM_SHAPE_MESH) def.mesh = mesh = make_mesh(d);
    }
    const sadmm_status status = sadmm_world_add_shape(world, body, &def, NULL);
    sadmm_hull_destroy(hull);
    sadmm_mesh_destroy(mesh);
    return status;
}

static sadmm_status add_shape(struct draw *d, sadmm_world *world) { return add_shape_to(d, world, any_body(d, world)); }

static void take_motion(struct draw *d, double position[3], double orientation[4], double linear[3], double angular[3])
{
    vector(d, 1, position, 3);
    position[2] += 1;
    turn(d, orientation);
    vector(d, 1, linear, 3);
    vector(d, 3, angular, 3);
    if (rarely(d, 20)) position[below(d, 3)] = scale(d, 1, 1e9);
    if (rarely(d, 20)) linear[below(d, 3)] = scale(d, 1, 1e6);
    if (rarely(d, 20)) angular[below(d, 3)] = scale(d, 1, 1e6);
}

static sadmm_status add_body(struct draw *d, sadmm_world *world)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_body_id id;
    const int kind = below(d, 8);
    if (sadmm_world_body_count(world) >= MOST_BODIES) return sadmm_world_remove_body(world, any_body(d, world));
    def.type = kind == 0 ? SADMM_BODY_STATIC : kind == 1 ? SADMM_BODY_KINEMATIC : SADMM_BODY_DYNAMIC;
    def.mass = rarely(d, 8) ? scale(d, 1e-9, 1e12) : 1;
    sadmm_sphere_inertia(def.mass, 0.2, def.inertia);
    if (rarely(d, 3)) def.inertia[below(d, 3)] *= number(d, 0.3, 2.1);
    take_motion(d, def.position, def.orientation, def.linear_velocity, def.angular_velocity);
    if (def.type == SADMM_BODY_STATIC)
        for (int k = 0; k < 3; ++k) def.linear_velocity[k] = def.angular_velocity[k] = 0;
    def.environment = rarely(d, 6) ? below(d, 3) - 1 : 0;
    if (rarely(d, 4)) def.gravity_scale = number(d, -1, 2);
    if (rarely(d, 4)) def.linear_damping = number(d, 0, 3), def.angular_damping = number(d, 0, 3);
    if (rarely(d, 3)) def.name = "a body's name";
    const sadmm_status status = sadmm_world_add_body(world, &def, &id);
    return status == SADMM_OK && !rarely(d, 5) ? add_shape_to(d, world, id) : status;
}

static sadmm_status set_state(struct draw *d, sadmm_world *world)
{
    const sadmm_body_id id = any_body(d, world);
    sadmm_body_state state;
    double big[3];
    const bool far = rarely(d, 20);
    take_motion(d, state.position, state.orientation, state.linear_velocity, state.angular_velocity);
    vector(d, 1, big, 3);
    const double size = scale(d, 1, rarely(d, 3) ? 1e308 : 1e12);
    double *part = below(d, 2) ? state.position : below(d, 2) ? state.linear_velocity : state.angular_velocity;
    for (int k = 0; far && k < 3; ++k) part[k] = size * big[k];
    return sadmm_world_set_body_state(world, id, &state);
}

static sadmm_status push_body(struct draw *d, sadmm_world *world)
{
    const sadmm_body_id id = any_body(d, world);
    double x[3], y[3];
    vector(d, rarely(d, 20) ? 1e15 : 5, x, 3);
    vector(d, 1, y, 3);
    switch (below(d, 4)) {
    case 0: return sadmm_world_set_body_wrench(world, id, x, y);
    case 1: return sadmm_world_add_body_force_at(world, id, x, y);
    case 2: return sadmm_world_apply_body_impulse_at(world, id, x, y);
    default: return sadmm_world_set_body_wrench(world, id, y, x);
    }
}

static sadmm_status change_body(struct draw *d, sadmm_world *world)
{
    const sadmm_body_id id = any_body(d, world);
    double x[3], q[4];
    vector(d, 1, x, 3);
    turn(d, q);
    switch (below(d, 5)) {
    case 0: return sadmm_world_set_body_gravity_scale(world, id, 3 * x[0]);
    case 1: return sadmm_world_set_body_damping(world, id, x[0] + 0.8, x[1] + 0.8);
    case 2: return sadmm_world_set_body_mass(world, id, 1 + x[0], (double[]){0.1, 0.1 + 0.05 * x[1], 0.1});
    case 3: return sadmm_world_set_body_pair_contact(world, id, any_body(d, world), below(d, 2));
    default: x[2] += 1; return sadmm_world_move_body(world, id, x, q);
    }
}

static sadmm_status change_shape(struct draw *d, sadmm_world *world)
{
    const sadmm_shape_id id = any_shape(d, world);
    double size[3], place[3], way[4];
    for (int k = 0; k < 3; ++k) size[k] = number(d, 0.05, 0.3), place[k] = number(d, -0.2, 0.2);
    if (!rarely(d, 3)) size[2] = 0; /* as many as there may be */
    if (!rarely(d, 3)) size[1] = size[2] = 0;
    turn(d, way);
    switch (below(d, 6)) {
    case 0: return sadmm_world_set_shape_material(world, id, number(d, 0, 1), number(d, 0, 1.1));
    case 3: return sadmm_world_set_shape_size(world, id, size);
    case 4: return sadmm_world_set_shape_frame(world, id, place, way);
    case 1: return sadmm_world_set_pair_friction(world, id, any_shape(d, world), rarely(d, 2) ? -1 : number(d, 0, 1));
    case 2: return sadmm_world_remove_shape(world, id);
    default: return add_shape(d, world);
    }
}

/* ---- joints, gears, couplings ------------------------------------------------------------------------------------ */

static sadmm_joint_coordinate coordinate(struct draw *d)
{
    sadmm_joint_coordinate c = {.drive_force = rarely(d, 2) ? INFINITY : number(d, 0, 20)};
    c.limited = below(d, 2);
    c.lower = rarely(d, 4) ? -INFINITY : number(d, -1, 0);
    c.upper = rarely(d, 4) ? INFINITY : number(d, -0.05, 1);
    c.drive = (sadmm_drive)below(d, SADMM_DRIVE_COUNT);
    c.target_position = number(d, -1, 1);
    c.target_speed = number(d, -1, 1);
    c.drive_stiffness = scale(d, 1e-2, 1e6);
    c.drive_damping = scale(d, 1e-2, 1e3);
    if (rarely(d, 2)) c.friction = number(d, 0, 2);
    if (rarely(d, 2)) c.spring_stiffness = scale(d, 1e-2, 1e6);
    if (rarely(d, 2)) c.spring_damping = scale(d, 1e-2, 1e3);
    if (rarely(d, 4)) c.spring_rest = number(d, -1, 1);
    if (rarely(d, 4)) c.armature = scale(d, 1e-3, 10);
    return c;
}

/* The mask of what a kind leaves free, as far as coordinates are set here. */
static sadmm_status add_joint(struct draw *d, sadmm_world *world)
{
    sadmm_joint_def def = sadmm_joint_def_default();
    double x[3], q[4];
    if (sadmm_world_joint_count(world) >= MOST_JOINTS) return sadmm_world_remove_joint(world, any_joint(d, world));
    def.name = any_name(d);
    def.kind = (sadmm_joint_kind)below(d, SADMM_JOINT_KIND_COUNT);
    def.locks = (uint32_t)below(d, 64);
    def.body_b = any_body(d, world);
    if (!rarely(d, 4)) def.body_a = any_body(d, world);
    vector(d, 0.5, def.position_a, 3);
    vector(d, 0.5, def.position_b, 3);
    turn(d, def.orientation_a);
    vector(d, 1, x, 3);
    turn(d, q);
    if (!rarely(d, 3)) (void)sadmm_world_place_joint(world, &def, x, q);
    if (joint_is_radial(def.kind)) {
        vector(d, 0.5, def.position_b, 3);
        if (rarely(d, 4)) def.length = number(d, -0.05, 1);
    }
    def.collide = rarely(d, 3);
    def.enabled = !rarely(d, 6);
    if (rarely(d, 4)) def.break_force = number(d, 0, 50);
    if (rarely(d, 4)) def.break_torque = number(d, 0, 50);
    if (rarely(d, 2)) def.coordinates[below(d, 6)] = coordinate(d);
    return sadmm_world_add_joint(world, &def, NULL);
}

static sadmm_status set_table(struct draw *d, sadmm_world *world)
{
    double positions[6], forces[6], at = number(d, -1, 0);
    const int count = rarely(d, 3) ? 0 : 2 + below(d, 5);
    for (int k = 0; k < 6; ++k) {
        positions[k] = at += number(d, 0.01, 0.5);
        forces[k] = number(d, -5, 5);
    }
    const sadmm_joint_id id = any_joint(d, world);
    return sadmm_world_set_joint_spring_table(world, id, below(d, 6), positions, forces, count);
}

static sadmm_status change_joint(struct draw *d, sadmm_world *world)
{
    const sadmm_joint_coordinate c = coordinate(d);
    const sadmm_joint_id id = any_joint(d, world);
    switch (below(d, 5)) {
    case 0: return sadmm_world_set_joint_enabled(world, id, below(d, 2));
    case 1:
    case 2: return sadmm_world_set_joint_coordinate(world, id, below(d, 7), &c);
    case 3: return set_table(d, world);
    default: return add_joint(d, world);
    }
}

static sadmm_status change_gear(struct draw *d, sadmm_world *world)
{
    sadmm_gear_def def = sadmm_gear_def_default();
    const int what = below(d, 8);
    if (what == 0) return sadmm_world_remove_gear(world, any_gear(d, world));
    if (what == 1) {
        const sadmm_gear_id id = any_gear(d, world);
        return sadmm_world_set_gear_enabled(world, id, below(d, 2));
    }
    def.name = any_name(d);
    def.joint_1 = any_joint(d, world);
    def.joint_2 = any_joint(d, world);
    def.coordinate_1 = below(d, 6);
    def.coordinate_2 = below(d, 6);
    def.ratio = number(d, -3, 3);
    if (rarely(d, 3)) def.offset = number(d, -1, 1);
    def.enabled = !rarely(d, 4);
    return sadmm_world_add_gear(world, &def, NULL);
}

static sadmm_status add_coupling(struct draw *d, sadmm_world *world)
{
    sadmm_coupling_def def = sadmm_coupling_def_default();
    def.name = any_name(d);
    def.body = any_body(d, world);
    vector(d, 0.3, def.position, 3);
    turn(d, def.orientation);
    take_motion(d, def.target_position, def.target_orientation, def.target_velocity, def.target_velocity + 3);
    def.linear_stiffness = scale(d, 1, 1e4), def.linear_damping = scale(d, 1, 1e3);
    def.angular_stiffness = scale(d, 1, 1e4), def.angular_damping = scale(d, 1, 1e3);
    if (rarely(d, 3)) def.max_force = number(d, 0, 50);
    if (rarely(d, 3)) def.max_torque = number(d, 0, 50);
    return sadmm_world_add_coupling(world, &def, NULL);
}

static sadmm_status change_coupling(struct draw *d, sadmm_world *world)
{
    const sadmm_coupling_id id = any_coupling(d, world);
    double x[3], q[4], v[6];
    take_motion(d, x, q, v, v + 3);
    if (rarely(d, 4)) v[0] = scale(d, 1, 1e9); /* its target goes where none may be set */
    if (rarely(d, 4)) x[0] = 1e9;
    switch (below(d, 7)) {
    case 0: return sadmm_world_remove_coupling(world, id);
    case 1: return sadmm_world_set_coupling_target(world, id, x, q, below(d, 4) ? v : NULL);
    case 2: return sadmm_world_set_coupling_gains(world, id, 10 * v[0], 3, 10, 3);
    case 3: return sadmm_world_set_coupling_limits(world, id, 10 * fabs(v[0]), INFINITY);
    case 4: return sadmm_world_set_coupling_enabled(world, id, below(d, 3));
    default: return sadmm_world_coupling_count(world) < 4 ? add_coupling(d, world) : SADMM_OK;
    }
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

static sadmm_status set_settings(struct draw *d, sadmm_world *world)
{
    sadmm_settings s = sadmm_world_settings(world);
    switch (below(d, 16)) {
    case 0: s.dt = scale(d, 1e-6, rarely(d, 4) ? 2 : 0.02); break;
    case 1: s.substeps = below(d, 5); break;
    case 2: s.method = (sadmm_method)below(d, 2); break;
    case 3: s.iterations = 1 + below(d, 30); break;
    case 4: s.warm_start = below(d, 2); break;
    case 5: s.ncp_points = below(d, 2) ? 64 : 0; break;
    case 6: s.certify = below(d, 2); break;
    case 7: s.recover_wrenches = below(d, 2); break;
    case 8: s.measure_residuals = below(d, 2); break;
    case 9: s.residual_tolerance = number(d, -1e-7, 1e-6); break;
    case 10: s.tolerance = number(d, -1e-7, 1e-6); break;
    case 11: vector(d, 10, s.gravity, 3); break;
    case 12: s.penalty_update_warm = below(d, 2); break;
    case 13: s.relaxation = number(d, 1, 2); break;
    case 14: s.correction_speed = number(d, 0, 3); break;
    default:
        s.dt = 0.005;
        s.gravity[0] = s.gravity[1] = 0;
        s.gravity[2] = -9.81;
        break;
    }
    return sadmm_world_set_settings(world, &s);
}

static sadmm_status set_backend(struct draw *d, sadmm_world *world)
{
    const sadmm_backend backend = rarely(d, 3) ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU;
    return sadmm_world_set_backend(world, backend, (sadmm_precision)below(d, 2), 0);
}

static sadmm_status read_something(struct draw *d, sadmm_world *world)
{
    const sadmm_ray ray = {{number(d, -1, 1), number(d, -1, 1), 4}, {number(d, -1, 1), number(d, -1, 1), -3}, INFINITY};
    sadmm_ray_hit hit;
    sadmm_event events[4];
    int32_t count;
    int64_t dropped;
    const sadmm_joint_id joint = any_joint(d, world);
    sadmm_joint_state state;
    switch (below(d, 4)) {
    case 0: return sadmm_world_cast_ray(world, &ray, NULL, &hit);
    case 1: return sadmm_world_take_events(world, 4, events, &count, &dropped);
    case 2: return sadmm_world_record_events(world, below(d, 20) - 1);
    default: return sadmm_world_joint_state(world, joint, &state);
    }
}

static sadmm_status step(struct draw *d, sadmm_world *world)
{
    (void)d;
    return sadmm_world_step(world);
}

static sadmm_status remove_body(struct draw *d, sadmm_world *world)
{
    return sadmm_world_remove_body(world, any_body(d, world));
}

static sadmm_status (*const calls[])(struct draw *d, sadmm_world *world) = {
    step,
    step,
    step,
    step,
    step,
    step,
    step,
    step,
    step,
    step,
    step,
    step,
    add_body,
    add_body,
    remove_body,
    set_state,
    set_state,
    push_body,
    change_body,
    change_body,
    change_shape,
    change_joint,
    change_joint,
    add_joint,
    change_gear,
    change_gear,
    change_coupling,
    change_coupling,
    set_settings,
    set_settings,
    set_backend,
    read_something,
};

/* ---- two worlds -------------------------------------------------------------------------------------------------- */

struct saved {
    unsigned char *bytes;
    size_t size;
};

static struct saved save_world(sadmm_world *world)
{
    struct saved saved = {0};
    size_t size;
    MUST(world, sadmm_world_save(world, NULL, 0, &saved.size));
    saved.bytes = malloc(saved.size);
    ck_assert_ptr_nonnull(saved.bytes);
    MUST(world, sadmm_world_save(world, saved.bytes, saved.size, &size));
    ck_assert_uint_eq(size, saved.size);
    return saved;
}

static void expect_same(const struct saved *a, const struct saved *b, const char *what, int run, int call)
{
    size_t at = HEADER;
    while (at < a->size && at < b->size && a->bytes[at] == b->bytes[at]) ++at;
    ck_assert_msg(a->size == b->size && at == a->size,
                  "run %d, call %d, %s: states of %zu and %zu bytes differ from byte %zu on", run, call, what, a->size,
                  b->size, at);
}

/* `other` (or another world in its place) becomes what `world` is. */
static void hand_over(struct draw *d, sadmm_world *world, sadmm_world **other, int run, int call)
{
    struct saved saved = save_world(world);
    if (rarely(d, 2)) {
        const sadmm_world_def def = fixed_world_def();
        sadmm_world_destroy(*other);
        *other = create_world(&def);
    }
    const sadmm_status status = sadmm_world_restore(*other, saved.bytes, saved.size);
    ck_assert_msg(status == SADMM_OK, "run %d, call %d: not restored: %s", run, call, sadmm_world_message(*other));
    struct saved again = save_world(*other);
    expect_same(&saved, &again, "restored", run, call);
    free(saved.bytes);
    free(again.bytes);
}

static void expect_same_contacts(sadmm_world *a, sadmm_world *b)
{
    const int32_t count = sadmm_world_contact_count(a);
    ck_assert_int_eq(sadmm_world_contact_count(b), count);
    sadmm_contact *of_a = calloc((size_t)count + 1, sizeof *of_a), *of_b = calloc((size_t)count + 1, sizeof *of_b);
    MUST(a, sadmm_world_contacts(a, 0, count, of_a));
    MUST(b, sadmm_world_contacts(b, 0, count, of_b));
    ck_assert_mem_eq(of_a, of_b, (size_t)count * sizeof *of_a);
    free(of_a);
    free(of_b);
}

static void expect_same_problem(sadmm_world *a, sadmm_world *b)
{
    sadmm_problem *problem[2];
    sadmm_certificate certificate[2];
    sadmm_status status[2];
    memset(certificate, 0, sizeof certificate);
    for (int k = 0; k < 2; ++k) {
        ck_assert_int_eq(sadmm_problem_create(&problem[k]), SADMM_OK);
        status[k] = sadmm_world_freeze(k ? b : a, problem[k]);
        if (status[k] == SADMM_OK) status[k] = sadmm_problem_certify(problem[k], &certificate[k]);
        sadmm_problem_destroy(problem[k]);
    }
    ck_assert_int_eq(status[0], status[1]);
    ck_assert_mem_eq(&certificate[0], &certificate[1], sizeof certificate[0]);
}

static void compare(sadmm_world *world, sadmm_world *other, int run, int call)
{
    struct saved a = save_world(world), b = save_world(other);
    expect_same(&a, &b, "after a call", run, call);
    expect_same_contacts(world, other);
    expect_same_problem(world, other);
    free(a.bytes);
    free(b.bytes);
}

/* False: memory has run out, `other` did not get that call. */
static bool make_call(struct draw *d, sadmm_world *world, sadmm_world *other, int run, int call, int counts[])
{
    const int which = below(d, (int)(sizeof calls / sizeof *calls));
    const bool short_of_memory = rarely(d, 10);
    struct draw same = *d;
    if (short_of_memory) sadmm_test_fail_allocations_after(below(&same, 10));
    *d = same;
    const sadmm_status status = calls[which](d, world);
    sadmm_test_fail_allocations_after(-1);
    ++counts[status];
    if (status == SADMM_ERROR_OUT_OF_MEMORY) return false;
    const sadmm_status again = calls[which](&same, other);
    ck_assert_msg(status == again && same.state == d->state, "run %d, call %d (%d): %s, and %s (%s; %s)", run, call,
                  which, sadmm_status_name(status), sadmm_status_name(again), sadmm_world_message(world),
                  sadmm_world_message(other));
    return true;
}

START_TEST(goes_on_after_any_calls)
{
    struct draw d = {(uint64_t)_i * 1000003 + 17};
    sadmm_world_def def = fixed_world_def();
    def.backend = _i % 4 == 3 ? SADMM_BACKEND_REF : SADMM_BACKEND_CPU;
    def.precision = _i % 3 == 2 && def.backend == SADMM_BACKEND_CPU ? SADMM_F32 : SADMM_F64;
    def.settings.threads = 1;
    sadmm_world *world = create_world(&def), *other = create_world(&def);
    int counts[SADMM_STATUS_COUNT] = {0};
    for (int call = 0; call < CALLS; ++call)
        if (!make_call(&d, world, other, _i, call, counts) || rarely(&d, 3)) hand_over(&d, world, &other, _i, call);
        else if (rarely(&d, 3)) compare(world, other, _i, call);
    ck_assert_int_gt(counts[SADMM_OK], CALLS / 2);
    ck_assert_int_gt(counts[SADMM_ERROR_INVALID_ARGUMENT], 0);
    ck_assert_int_gt(counts[SADMM_ERROR_STALE_ID], 0);
    sadmm_world_destroy(world);
    sadmm_world_destroy(other);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("saved worlds after any calls");
    TCase *cases = tcase_create("saved worlds after any calls");
    const char *runs = getenv("SADMM_TEST_RUNS");
    tcase_set_timeout(cases, 600);
    tcase_add_loop_test(cases, goes_on_after_any_calls, 0, runs ? atoi(runs) : RUNS);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
