/* A car on four driven wheels, the front two steered, drives over bumps, up a slope, and around a circle. Every wheel
 * turns on a hinge at a hub; the hub slides up and down under the chassis, held by a spring with a damper between
 * limits, and those in front turn about the same axis. Measured: speed, how far springs travel, how high the car
 * climbs, and its turn rate, which without slip is speed over radius. */
#include <math.h>
#include <stdio.h>

#include <subadmm/subadmm.h>

enum { WHEELS = 4 };
static const double wheel_radius = 0.3, half_track = 0.75, chassis_height = 0.6;
static const double wheel_x[WHEELS] = {1.2, 1.2, -1.2, -1.2}, wheel_side[WHEELS] = {1, -1, 1, -1};
static const double upright[4] = {1, 0, 0, 0},
                    across[4] = {0.70710678118654752, -0.70710678118654752, 0, 0}; /* turns z to y */

struct car {
    sadmm_world *world;
    sadmm_body_id chassis;
    sadmm_joint_id springs[WHEELS], axles[WHEELS];
};

#define DO(call)                                      \
    do {                                              \
        const sadmm_status status_ = (call);          \
        if (status_ != SADMM_OK) return status_;      \
    } while (0)

/* ---- the road ---------------------------------------------------------------------------------------------------- */

static const double slope = 0.2; /* rad */
static const double slope_start = 18, slope_length = 10, plateau_length = 40;

static sadmm_status add_road_part(sadmm_world *world, sadmm_body_id road, sadmm_shape_type type, const double size[3],
                                  double x, double z, const double orientation[4])
{
    sadmm_shape_def part = sadmm_shape_def_default();
    part.type = type;
    part.friction = 1;
    part.position[0] = x;
    part.position[2] = z;
    for (int k = 0; k < 3; ++k) part.size[k] = size[k];
    for (int k = 0; k < 4; ++k) part.orientation[k] = orientation[k];
    return sadmm_world_add_shape(world, road, &part, NULL);
}

static sadmm_status add_road(sadmm_world *world)
{
    const double none[3] = {0}, bump[3] = {0.4, 5, 0}, ramp[3] = {slope_length / 2, 5, 0.5},
                 plateau[3] = {plateau_length / 2, 30, 0.5}, tilt[4] = {cos(slope / 2), 0, -sin(slope / 2), 0};
    const double height = slope_length * sin(slope), end = slope_start + slope_length * cos(slope);
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_body_id road;
    body.type = SADMM_BODY_STATIC;
    body.name = "road";
    DO(sadmm_world_add_body(world, &body, &road));
    DO(add_road_part(world, road, SADMM_SHAPE_PLANE, none, 0, 0, upright));
    for (int k = 0; k < 3; ++k) /* they rise 6 cm above the road */
        DO(add_road_part(world, road, SADMM_SHAPE_CYLINDER, bump, 9 + 2 * k, -0.34, across));
    DO(add_road_part(world, road, SADMM_SHAPE_BOX, ramp, slope_start + ramp[0] * cos(slope) + ramp[2] * sin(slope),
                     ramp[0] * sin(slope) - ramp[2] * cos(slope), tilt));
    return add_road_part(world, road, SADMM_SHAPE_BOX, plateau, end + plateau[0], height - plateau[2], upright);
}

/* ---- the car ----------------------------------------------------------------------------------------------------- */

static sadmm_status add_part(sadmm_world *world, const char *name, double mass, sadmm_shape_type type,
                             const double size[3], const double position[3], sadmm_body_id *id)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    sadmm_mass solid;
    body.name = name;
    shape.type = type;
    shape.friction = 1;
    for (int k = 0; k < 3; ++k) shape.size[k] = size[k];
    for (int k = 0; k < 3; ++k) body.position[k] = position[k];
    if (type == SADMM_SHAPE_CYLINDER) /* a wheel: its axis is the body's y */
        for (int k = 0; k < 4; ++k) shape.orientation[k] = across[k];
    DO(sadmm_shape_mass(&shape, 1, &solid));
    body.mass = mass;
    /* the principal moments belong to axes of their own, which a body's frame has */
    for (int k = 0; k < 3; ++k) body.inertia[k] = solid.inertia[k] * mass / solid.mass;
    for (int k = 0; k < 4; ++k) body.orientation[k] = solid.orientation[k];
    for (int k = 0; k < 3; ++k) shape.position[k] = 0;
    double centre[3] = {0, 0, 0};
    DO(sadmm_mass_pose_in_body(&solid, centre, shape.orientation));
    DO(sadmm_world_add_body(world, &body, id));
    return sadmm_world_add_shape(world, *id, &shape, NULL);
}

/* A hub that slides along the chassis' z, in front turns about it, too. */
static sadmm_status add_suspension(struct car *car, int k, sadmm_body_id hub, const double place[3])
{
    static const char *const names[WHEELS] = {"spring front left", "spring front right", "spring rear left",
                                              "spring rear right"};
    const double load = 800 * 9.81 / WHEELS; /* N, of the chassis on a wheel */
    sadmm_joint_def joint = sadmm_joint_def_default();
    sadmm_joint_coordinate *travel = &joint.coordinates[2], *steering = &joint.coordinates[5];
    joint.name = names[k];
    joint.kind = wheel_x[k] > 0 ? SADMM_JOINT_CYLINDRICAL : SADMM_JOINT_PRISMATIC;
    joint.body_a = car->chassis;
    joint.body_b = hub;
    travel->spring_stiffness = 4e4;               /* N/m */
    travel->spring_damping = 3e3;                 /* N s/m */
    travel->spring_rest = -load / 4e4;            /* m: the load takes it to 0 */
    travel->limited = true;
    travel->lower = -0.12, travel->upper = 0.12;  /* m */
    if (joint.kind == SADMM_JOINT_CYLINDRICAL) {
        steering->drive = SADMM_DRIVE_POSITION;
        steering->drive_stiffness = 2e4; /* N m/rad */
        steering->drive_damping = 5e2;   /* N m s/rad */
    }
    DO(sadmm_world_place_joint(car->world, &joint, place, upright));
    return sadmm_world_add_joint(car->world, &joint, &car->springs[k]);
}

static sadmm_status add_wheel(struct car *car, int k)
{
    static const double hub_size[3] = {0.1, 0.05, 0.1}, wheel_size[3] = {0.3, 0.1, 0};
    const double place[3] = {wheel_x[k], wheel_side[k] * half_track, wheel_radius};
    sadmm_body_id hub, wheel;
    sadmm_joint_def axle = sadmm_joint_def_default();
    DO(add_part(car->world, "hub", 15, SADMM_SHAPE_BOX, hub_size, place, &hub));
    DO(add_part(car->world, "wheel", 20, SADMM_SHAPE_CYLINDER, wheel_size, place, &wheel));
    DO(add_suspension(car, k, hub, place));
    axle.kind = SADMM_JOINT_REVOLUTE;
    axle.body_a = hub;
    axle.body_b = wheel;
    axle.coordinates[5].drive = SADMM_DRIVE_SPEED;
    axle.coordinates[5].drive_force = 250; /* N m */
    DO(sadmm_world_place_joint(car->world, &axle, place, across));
    return sadmm_world_add_joint(car->world, &axle, &car->axles[k]);
}

static sadmm_status add_car(struct car *car)
{
    static const double size[3] = {1.6, 0.5, 0.2}, place[3] = {0, 0, 0.6};
    DO(add_part(car->world, "chassis", 800, SADMM_SHAPE_BOX, size, place, &car->chassis));
    for (int k = 0; k < WHEELS; ++k) DO(add_wheel(car, k));
    return SADMM_OK;
}

/* Speed of the middle of the rear axle (m/s) and turn rate (rad/s): every wheel rolls along its own circle. */
static sadmm_status steer(struct car *car, double speed, double turn_rate)
{
    for (int k = 0; k < WHEELS; ++k) {
        sadmm_joint_def joint;
        const double along = speed - turn_rate * wheel_side[k] * half_track, aside = turn_rate * (wheel_x[k] + 1.2);
        DO(sadmm_world_joint_def(car->world, car->axles[k], &joint));
        joint.coordinates[5].target_speed = hypot(along, aside) / wheel_radius;
        DO(sadmm_world_set_joint_coordinate(car->world, car->axles[k], 5, &joint.coordinates[5]));
        if (wheel_x[k] < 0) continue;
        DO(sadmm_world_joint_def(car->world, car->springs[k], &joint));
        joint.coordinates[5].target_position = atan2(aside, along);
        DO(sadmm_world_set_joint_coordinate(car->world, car->springs[k], 5, &joint.coordinates[5]));
    }
    return SADMM_OK;
}

/* ---- the drive --------------------------------------------------------------------------------------------------- */

struct measured {
    double flat_speed; /* m/s, before the bumps */
    double travel;     /* m, the most that a spring went either way */
    double height;     /* m, that the chassis has climbed */
    double turn_rate;  /* rad/s, mean over the last two seconds */
};

static sadmm_status look(struct car *car, double time, struct measured *m)
{
    sadmm_body_state state;
    DO(sadmm_world_body_state(car->world, car->chassis, &state));
    const double speed = hypot(state.linear_velocity[0], state.linear_velocity[1]);
    for (int k = 0; k < WHEELS; ++k) {
        sadmm_joint_state spring;
        DO(sadmm_world_joint_state(car->world, car->springs[k], &spring));
        m->travel = fmax(m->travel, fabs(spring.position[2]));
    }
    if (state.position[0] < 7) m->flat_speed = speed;
    m->height = state.position[2] - chassis_height;
    if (time > 11) m->turn_rate += state.angular_velocity[2] / 400;
    if (fmod(time + 1e-9, 1) < 0.004)
        printf("%4.0f s: %5.2f m/s at x = %5.1f m, y = %5.1f m, height %5.2f m\n", time, speed, state.position[0],
               state.position[1], m->height);
    return SADMM_OK;
}

static sadmm_status drive(struct car *car, struct measured *m)
{
    const double speed = 5, radius = 10; /* m/s, m */
    DO(add_road(car->world));
    DO(add_car(car));
    DO(steer(car, speed, 0));
    for (int step = 1; step <= 2600; ++step) { /* of 5 ms */
        if (step == 1800) DO(steer(car, speed, speed / radius));
        DO(sadmm_world_step(car->world));
        DO(look(car, step * 0.005, m));
    }
    return SADMM_OK;
}

static int expect(const char *what, double value, double low, double high)
{
    const int good = value >= low && value <= high;
    printf("%s: %.3f%s\n", what, value, good ? "" : "  NOT AS EXPECTED");
    return !good;
}

int main(void)
{
    const sadmm_world_def def = sadmm_world_def_default();
    struct car car;
    struct measured m = {0, 0, 0, 0};
    if (sadmm_world_create(&def, &car.world) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    const sadmm_status status = drive(&car, &m);
    if (status != SADMM_OK) fprintf(stderr, "%s\n", sadmm_world_message(car.world));
    sadmm_world_destroy(car.world);
    if (status != SADMM_OK) return 1;
    /* 1 % of slip on the straight; 4 % in the curve, where wheels 20 cm wide scrub and the steering gives; bumps are 6
     * cm high, limits are at 12 cm */
    int wrong = expect("speed on the flat road, 5 m/s wanted", m.flat_speed, 4.95, 5.05);
    wrong += expect("springs travelled at most, m", m.travel, 0.02, 0.1201);
    wrong += expect("climbed, m", m.height, slope_length * sin(slope) - 0.05, slope_length * sin(slope) + 0.05);
    wrong += expect("turn rate, 0.5 rad/s wanted", m.turn_rate, 0.48, 0.52);
    return wrong > 0;
}
