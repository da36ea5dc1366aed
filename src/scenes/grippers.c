/* N parallel-jaw grippers, each with an object in an environment of its own: they close on it, lift it by 0.2 m, shake
 * it for two seconds and hold it. Objects are boxes, balls and capsules of 0.2 to 1 kg, held by friction between two
 * fingers of 50 g.
 *
 * Forces: a finger's drive (2500 N/m, its target 12 mm inside the object) gives 30 N. Two hold 2 mu 30 N = 48 N; the
 * heaviest object asks for m (g + a) = 1 kg (9.81 + 9) m/s^2, with a = (2 pi 3 Hz)^2 x 25 mm the shake's. */
#include <math.h>

#include "core/math/vec3.h"
#include "core/math/quat.h"
#include "family.h"
#include "pull.h"
#include "subadmm/joint.h"

static const double spacing = 0.4;           /* m, between grippers */
static const double palm_height = 0.1;       /* m, of the palm's centre, open */
static const double finger[3] = {0.008, 0.012, 0.04}, palm[3] = {0.06, 0.02, 0.015}; /* half extents, m */
static const double finger_at[3] = {0.048, 0, -0.055}; /* m, from the palm: 5 mm above the ground */
static const double squeeze = 0.012;         /* m, of a finger's target into the object */
static const double lift = 0.2, swing = 0.025; /* m */
static const double times[] = {0.2, 0.7, 0.9, 1.9, 2.0, 4.0, 5.0}; /* s: close from, to; lift; shake; end */
enum { CLOSE, CLOSED, LIFT, LIFTED, SHAKE, SHAKEN, END };
enum { BODIES = 4, PALM = 0, LEFT, RIGHT, OBJECT };
static const double pi = 3.14159265358979323846;

/* ---- what stands in environment i ------------------------------------------------------------------------------- */

struct object {
    sadmm_shape_def shape;
    double mass, height; /* kg; m, of its centre on the ground */
    double reach;        /* m, half its width between the fingers */
};

static struct object object_of(long i)
{
    const long kind = i % 3, size = i / 3 % 4, weight = i % 5;
    struct object o = {.shape = sadmm_shape_def_default(), .mass = 0.2 * (double)(weight + 1)};
    const double r = 0.015 + 0.004 * (double)size;
    o.shape.friction = 0.8;
    o.shape.size[0] = r;
    o.height = o.reach = r;
    if (kind == 0) {
        o.shape.type = SADMM_SHAPE_BOX;
        o.shape.size[1] = 0.02;
        o.shape.size[2] = o.height = 0.025;
    } else if (kind == 1) {
        o.shape.type = SADMM_SHAPE_SPHERE;
    } else { /* lies, along y */
        o.shape.type = SADMM_SHAPE_CAPSULE;
        o.shape.size[1] = 0.02;
        o.shape.orientation[0] = o.shape.orientation[1] = sqrt(0.5);
    }
    return o;
}

static void set_inertia(const struct object *o, double inertia[3])
{
    switch (o->shape.type) {
    case SADMM_SHAPE_SPHERE: sadmm_sphere_inertia(o->mass, o->shape.size[0], inertia); break;
    case SADMM_SHAPE_CAPSULE: {
        double along_z[3];
        sadmm_capsule_inertia(o->mass, o->shape.size[0], o->shape.size[1], along_z);
        inertia[0] = inertia[2] = along_z[0];
        inertia[1] = along_z[2];
        break;
    }
    default: sadmm_box_inertia(o->mass, o->shape.size, inertia);
    }
}

static void place_of(const struct sadmm_scene *scene, long i, double *x, double *y)
{
    const long row = lround(ceil(sqrt((double)scene->n)));
    *x = spacing * (double)(i % row);
    *y = spacing * (double)(i / row);
}

/* Where the palm of gripper i is led to at time t (s). Each shakes in a direction of its own, and turns to and fro. */
static struct sadmm_frame palm_at(const struct sadmm_scene *scene, long i, double t)
{
    double x, y;
    place_of(scene, i, &x, &y);
    const double up = lift * sadmm_smooth((t - times[LIFT]) / (times[LIFTED] - times[LIFT]));
    const double on = sadmm_smooth((t - times[SHAKE]) / 0.3) * sadmm_smooth((times[SHAKEN] - t) / 0.3);
    const double wave = on * sin(2 * pi * 3 * (t - times[SHAKE])), slow = on * sin(2 * pi * (t - times[SHAKE]));
    const double turn = 2.4 * (double)i, rise = 0.5 * (double)(i % 4);
    struct sadmm_frame at = sadmm_frame_moved(sadmm_frame_world(), x, y, palm_height + up);
    at = sadmm_frame_moved(at, swing * wave * cos(turn) * cos(rise), swing * wave * sin(turn) * cos(rise),
                           swing * wave * sin(rise));
    return sadmm_frame_turned(at, (int)(i % 3), 0.4 * slow);
}

static double closed_by(long i, double t)
{
    const double way = finger_at[0] - finger[0] - object_of(i).reach + squeeze;
    return way * sadmm_smooth((t - times[CLOSE]) / (times[CLOSED] - times[CLOSE]));
}

static sadmm_joint_coordinate finger_drive(double target, double speed)
{
    return (sadmm_joint_coordinate){
        .limited = true, .lower = -0.05, .upper = 0.05, .drive = SADMM_DRIVE_POSITION, .target_position = target,
        .target_speed = speed, .drive_stiffness = 2500, .drive_damping = 25, .drive_force = 60,
    };
}

/* ---- building ---------------------------------------------------------------------------------------------------- */

static sadmm_status add_part(sadmm_world *world, long i, double x, double y, double z, double mass,
                             const double inertia[3], const sadmm_shape_def *shape, sadmm_body_id *id,
                             struct sadmm_error *error)
{
    sadmm_body_def body = sadmm_body_def_default();
    body.environment = (int32_t)i;
    body.mass = mass;
    v3_store(v3_load(inertia), body.inertia);
    v3_store(v3(x, y, z), body.position);
    sadmm_status status = sadmm_world_add_body(world, &body, id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, *id, shape, NULL);
    return sadmm_scene_world_error(world, status, error);
}

static sadmm_status add_box(sadmm_world *world, long i, double x, double y, double z, double mass, const double half[3],
                            sadmm_body_id *id, struct sadmm_error *error)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    double inertia[3];
    sadmm_box_inertia(mass, half, inertia);
    shape.type = SADMM_SHAPE_BOX;
    shape.friction = 0.8;
    v3_store(v3_load(half), shape.size);
    return add_part(world, i, x, y, z, mass, inertia, &shape, id, error);
}

static sadmm_status slide_finger(sadmm_world *world, sadmm_body_id hand, sadmm_body_id slider,
                                 struct sadmm_error *error)
{
    static const double z_to_x[4] = {0.70710678118654752440, 0, 0.70710678118654752440, 0};
    sadmm_joint_def def = sadmm_joint_def_default();
    sadmm_body_state at;
    def.kind = SADMM_JOINT_PRISMATIC;
    def.body_a = hand;
    def.body_b = slider;
    def.coordinates[2] = finger_drive(0, 0);
    sadmm_status status = sadmm_world_body_state(world, slider, &at);
    if (status == SADMM_OK) status = sadmm_world_place_joint(world, &def, at.position, z_to_x);
    if (status == SADMM_OK) status = sadmm_world_add_joint(world, &def, NULL);
    return sadmm_scene_world_error(world, status, error);
}

static sadmm_status add_gripper(const struct sadmm_scene *scene, sadmm_world *world, long i, struct sadmm_error *error)
{
    const struct object o = object_of(i);
    double x, y, inertia[3];
    sadmm_body_id hand, left, right, object;
    place_of(scene, i, &x, &y);
    set_inertia(&o, inertia);
    const double z = palm_height + finger_at[2];
    sadmm_status status = add_box(world, i, x, y, palm_height, 0.5, palm, &hand, error);
    if (status == SADMM_OK) status = add_box(world, i, x - finger_at[0], y, z, 0.05, finger, &left, error);
    if (status == SADMM_OK) status = add_box(world, i, x + finger_at[0], y, z, 0.05, finger, &right, error);
    if (status == SADMM_OK)
        status = add_part(world, i, x, y, o.height, o.mass, inertia, &o.shape, &object, error);
    if (status == SADMM_OK) status = slide_finger(world, hand, left, error);
    if (status == SADMM_OK) status = slide_finger(world, hand, right, error);
    return status;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    sadmm_coupling_def gains = sadmm_coupling_def_default();
    gains.linear_stiffness = 2e4, gains.linear_damping = 400, gains.max_force = 500;
    gains.angular_stiffness = 200, gains.angular_damping = 4, gains.max_torque = 20;
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.8, error);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) status = add_gripper(scene, world, i, error);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        sadmm_body_id hand;
        status = sadmm_scene_world_error(world, sadmm_world_body_at(world, (int32_t)(1 + BODIES * i + PALM), &hand),
                                         error);
        if (status == SADMM_OK) status = sadmm_add_pull(world, hand, palm_at(scene, i, 0), &gains, error);
    }
    return status;
}

/* ---- the script -------------------------------------------------------------------------------------------------- */

static sadmm_status before_step(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                struct sadmm_error *error)
{
    const double dt = scene->def.settings.dt, t = (double)step * dt;
    sadmm_status status = SADMM_OK;
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        const double way = closed_by(i, t), speed = (closed_by(i, t + dt) - way) / dt;
        for (int side = 0; side < 2 && status == SADMM_OK && t <= times[LIFT]; ++side) {
            const double sign = side == 0 ? 1 : -1;
            const sadmm_joint_coordinate drive = finger_drive(sign * way, sign * speed);
            sadmm_joint_id id;
            status = sadmm_world_joint_at(world, (int32_t)(2 * i + side), &id);
            if (status == SADMM_OK) status = sadmm_world_set_joint_coordinate(world, id, 2, &drive);
            status = sadmm_scene_world_error(world, status, error);
        }
        if (status == SADMM_OK)
            status = sadmm_move_pull(world, (int32_t)i, palm_at(scene, i, t), palm_at(scene, i, t + dt), dt, error);
    }
    return status;
}

/* ---- success ----------------------------------------------------------------------------------------------------- */

/* Every object is where it was in its gripper when that closed: it has slipped by 5 mm at most, fingers that give way
 * under its weight included. */
static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const double t = (double)step * scene->def.settings.dt, most = 0.005;
    double lowest = INFINITY, slip = 0;
    long held = 0;
    if (step > 0 && t < times[LIFTED] - 1e-9) return SADMM_OK;
    for (long i = 0; i < scene->n && step > 0; ++i) {
        sadmm_body_state hand, object;
        sadmm_body_id ids[2];
        sadmm_status status = sadmm_world_body_at(world, (int32_t)(1 + BODIES * i + PALM), &ids[0]);
        if (status == SADMM_OK) status = sadmm_world_body_at(world, (int32_t)(1 + BODIES * i + OBJECT), &ids[1]);
        if (status == SADMM_OK) status = sadmm_world_body_state(world, ids[0], &hand);
        if (status == SADMM_OK) status = sadmm_world_body_state(world, ids[1], &object);
        if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
        const double height = object_of(i).height;
        const vec3 apart = v3_sub(v3_load(object.position), v3_load(hand.position));
        const vec3 in_hand = m3_tmul(q_matrix(q_load(hand.orientation)), apart);
        const double off = v3_norm(v3_sub(in_hand, v3(0, 0, height - palm_height)));
        held += off <= most;
        slip = fmax(slip, off);
        lowest = fmin(lowest, object.position[2] - height);
    }
    struct sadmm_scene_task *task = &result->tasks[0];
    result->task_count = 1;
    result->memory[0] = fmax(result->memory[0], slip);
    task->name = "hold";
    task->figure_count = 3;
    task->figures[0] = (struct sadmm_scene_figure){"held", "", (double)held};
    task->figures[1] = (struct sadmm_scene_figure){"lifted", "m", step > 0 ? lowest : 0};
    task->figures[2] = (struct sadmm_scene_figure){"slip", "m", result->memory[0]};
    task->finished = t >= times[END] - 1e-9;
    task->passed = task->finished && held == scene->n && lowest > 0.9 * lift && result->memory[0] <= most;
    return SADMM_OK;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_grippers = {
    .info = {
        .name = "grippers",
        .arguments = "[:N]",
        .description = "N parallel-jaw grippers grasp, lift, shake and hold an object each (N in [1, 10000], "
                       "default 16)",
        .duration = 5,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 60},
    },
    .n_default = 16, .n_min = 1, .n_max = 10000,
    .configure = configure,
    .fill = fill,
    .before_step = before_step,
    .observe = observe,
};
