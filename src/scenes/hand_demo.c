/* The paper's hand demo: 281 bodies, of which 34 are a hand (hand.h) that follows a recorded motion (hand_motion.c) and
 * does at a table what a hand does: it lifts a golden cube of 1 kg and a body of 1.5 kg with fingertips of 10 g and
 * holds each for 5 s, picks a thin spoon from the table, puts a cube on another one and lets go, and pushes a toy car.
 * Beside it walls of small cubes stand, most of the scene's contacts.
 *
 * The paper gives the number of bodies, joints and contacts, masses and what there is to do, but no sizes: those are
 * ours. Nothing but friction holds what is lifted. */
#include <math.h>
#include <string.h>

#include "compound.h"
#include "core/math/quat.h"
#include "family.h"
#include "hand_motion.h"
#include "subadmm/coupling.h"
#include "subadmm/joint.h"

/* Bodies in order of creation. */
enum {
    FLOOR, TABLE, HAND, GOLDEN = HAND + SADMM_HAND_LINKS, HEAVY, SPOON, UPPER, LOWER, CAR, WHEELS, APPLE = WHEELS + 4,
    LOOSE, WALLS
};

static const double golden_half = 0.0325, cube_half = 0.02, brick_half = 0.015; /* m */
static const double wheel_radius = 0.018;
static const double table_height = 0.7; /* m, above the floor */

/* ---- what lies on the table -------------------------------------------------------------------------------------- */

static struct sadmm_part part(sadmm_shape_type type, double x, double y, double z, double a, double b, double c,
                              double mass)
{
    struct sadmm_part p = sadmm_part_at(type, x, y, z, a, b, c, mass);
    p.shape.friction = 0.9;
    return p;
}

/* Turned from z to `axis`, x or y. */
static struct sadmm_part lying(struct sadmm_part p, int axis)
{
    const double s = sqrt(0.5), turns[2][4] = {{s, 0, s, 0}, {s, -s, 0, 0}};
    memcpy(p.shape.orientation, turns[axis], sizeof p.shape.orientation);
    return p;
}

static struct sadmm_frame on_table(const double at[2], double height)
{
    return sadmm_frame_moved(sadmm_frame_world(), at[0], at[1], height);
}

/* 1.5 kg, concave: a torso with haunches, a head, two ears and a tail. */
static sadmm_status place_heavy(sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_part parts[] = {
        part(SADMM_SHAPE_BOX, 0, 0, 0.025, 0.03, 0.03, 0.025, 0.98),
        lying(part(SADMM_SHAPE_CAPSULE, 0, 0.034, 0.012, 0.012, 0.014, 0, 0.1), 0),
        lying(part(SADMM_SHAPE_CAPSULE, 0, -0.034, 0.012, 0.012, 0.014, 0, 0.1), 0),
        part(SADMM_SHAPE_SPHERE, 0, 0.014, 0.06, 0.018, 0, 0, 0.2),
        part(SADMM_SHAPE_CAPSULE, 0.008, 0.014, 0.078, 0.005, 0.006, 0, 0.05),
        part(SADMM_SHAPE_CAPSULE, -0.008, 0.014, 0.078, 0.005, 0.006, 0, 0.05),
        part(SADMM_SHAPE_SPHERE, 0, -0.036, 0.034, 0.008, 0, 0, 0.02),
    };
    return sadmm_place_compound(world, on_table(sadmm_heavy_task.at, 0), parts, sizeof parts / sizeof *parts, "heavy",
                                NULL, error);
}

/* 30 g; the handle, 2.5 mm thick, is 11 mm above the table: it stands on the bowl and on its bent end. */
static sadmm_status place_spoon(sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_part parts[] = {
        part(SADMM_SHAPE_BOX, 0, 0.01, 0.0125, 0.005, 0.045, 0.00125, 0.012),
        part(SADMM_SHAPE_BOX, 0, -0.055, 0.0015, 0.014, 0.02, 0.0015, 0.014),
        part(SADMM_SHAPE_BOX, 0, -0.0355, 0.007, 0.004, 0.0015, 0.0055, 0.002),
        part(SADMM_SHAPE_BOX, 0, 0.0535, 0.007, 0.004, 0.0015, 0.007, 0.002),
    };
    return sadmm_place_compound(world, on_table(sadmm_spoon_task.at, 0), parts, sizeof parts / sizeof *parts, "spoon",
                                NULL, error);
}

static sadmm_status place_cube(sadmm_world *world, double x, double y, double z, double half, double mass,
                               struct sadmm_error *error)
{
    const struct sadmm_piece cube = {.half_extents = {half, half, half}, .mass = mass, .friction = 0.9};
    return sadmm_place_box(world, sadmm_frame_moved(sadmm_frame_world(), x, y, z), &cube, NULL, error);
}

static sadmm_status place_golden(sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece cube = {
        .half_extents = {golden_half, golden_half, golden_half}, .mass = 1, .friction = 0.9, .name = "golden cube"};
    return sadmm_place_box(world, on_table(sadmm_golden_task.at, golden_half), &cube, NULL, error);
}

/* 0.2 kg on four wheels of 40 g, whose bearings have a friction of 1 mN m each. */
static sadmm_status place_car(sadmm_world *world, struct sadmm_error *error)
{
    static const double s = 0.70710678118654752440, along_y[4] = {s, -s, 0, 0};
    const struct sadmm_part chassis[] = {
        part(SADMM_SHAPE_BOX, 0, 0, 0.026, 0.055, 0.022, 0.008, 0.15),
        part(SADMM_SHAPE_BOX, -0.005, 0, 0.043, 0.025, 0.02, 0.009, 0.05),
    };
    const struct sadmm_part wheel = lying(part(SADMM_SHAPE_CAPSULE, 0, 0, 0, wheel_radius, 0.003, 0, 0.04), 1);
    sadmm_body_id car, wheels[4];
    sadmm_status status = sadmm_place_compound(world, on_table(sadmm_car_at, 0), chassis,
                                               sizeof chassis / sizeof *chassis, "car", &car, error);
    for (int k = 0; k < 4 && status == SADMM_OK; ++k) {
        const double x = k < 2 ? 0.034 : -0.034, y = k % 2 ? 0.045 : -0.045;
        const struct sadmm_frame at = sadmm_frame_moved(on_table(sadmm_car_at, wheel_radius), x, y, 0);
        status = sadmm_place_compound(world, at, &wheel, 1, "wheel", &wheels[k], error);
        if (status != SADMM_OK) break;
        sadmm_joint_def def = sadmm_joint_def_default();
        def.kind = SADMM_JOINT_REVOLUTE;
        def.body_a = car;
        def.body_b = wheels[k];
        def.coordinates[5].friction = 1e-3;
        status = sadmm_world_place_joint(world, &def, at.origin, along_y);
        if (status == SADMM_OK) status = sadmm_world_add_joint(world, &def, NULL);
        status = sadmm_scene_world_error(world, status, error);
    }
    return status;
}

enum { WALL_CUBES = 5 * 45 + 10 };

/* Walls of cubes, each on two of the row below: five of nine rows, one of four. Returns how many that are. */
static int wall_cubes(double centres[WALL_CUBES][3])
{
    static const struct { double x, y; int rows; } walls[] = {
        {0.42, 0.1, 9}, {0.49, 0.1, 9}, {0.56, 0.1, 9}, {0.63, 0.1, 9}, {0.70, 0.1, 9}, {0.42, -0.15, 4},
    };
    const double pitch = 2 * brick_half + 0.002;
    int count = 0;
    for (size_t w = 0; w < sizeof walls / sizeof *walls; ++w) {
        for (int row = 0; row < walls[w].rows; ++row) {
            const int cubes = walls[w].rows - row;
            for (int k = 0; k < cubes; ++k, ++count) {
                centres[count][0] = walls[w].x;
                centres[count][1] = walls[w].y + pitch * (k - 0.5 * (cubes - 1));
                centres[count][2] = brick_half * (2 * row + 1);
            }
        }
    }
    return count;
}

static sadmm_status place_table(sadmm_world *world, struct sadmm_error *error)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    const double half[3] = {0.65, 0.55, 0.025};
    sadmm_body_id id;
    body.type = SADMM_BODY_STATIC;
    body.environment = -1;
    body.name = "table";
    body.position[0] = 0.25, body.position[2] = -half[2];
    shape.type = SADMM_SHAPE_BOX;
    shape.friction = 0.8;
    memcpy(shape.size, half, sizeof half);
    sadmm_status status = sadmm_world_add_body(world, &body, &id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, id, &shape, NULL);
    return sadmm_scene_world_error(world, status, error);
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_grip grip = sadmm_hand_motion(0);
    const struct sadmm_piece apple = {.half_extents = {0.035}, .mass = 0.15, .friction = 0.9};
    const double apple_at[2] = {0.2, 0.45}, *stack = sadmm_stack_task.at;
    double centres[WALL_CUBES][3];
    (void)scene;
    const struct sadmm_frame ground = sadmm_frame_moved(sadmm_frame_world(), 0, 0, -table_height);
    sadmm_status status = sadmm_place_plane(world, ground, 0.8, error);
    if (status == SADMM_OK) status = place_table(world, error);
    if (status == SADMM_OK) status = sadmm_add_hand(world, &grip, error);
    if (status == SADMM_OK) status = place_golden(world, error);
    if (status == SADMM_OK) status = place_heavy(world, error);
    if (status == SADMM_OK) status = place_spoon(world, error);
    if (status == SADMM_OK) status = place_cube(world, stack[0], stack[1], cube_half, cube_half, 0.04, error);
    if (status == SADMM_OK)
        status = place_cube(world, sadmm_stack_on[0], sadmm_stack_on[1], cube_half, cube_half, 0.04, error);
    if (status == SADMM_OK) status = place_car(world, error);
    if (status == SADMM_OK) status = sadmm_place_sphere(world, on_table(apple_at, 0.035), &apple, NULL, error);
    if (status == SADMM_OK) status = place_cube(world, 0.3, 0.45, brick_half, brick_half, 0.02, error);
    for (int k = 0, count = wall_cubes(centres); k < count && status == SADMM_OK; ++k)
        status = place_cube(world, centres[k][0], centres[k][1], centres[k][2], brick_half, 0.02, error);
    return status;
}

static sadmm_status before_step(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                                struct sadmm_error *error)
{
    const double dt = scene->def.settings.dt, t = (double)step * dt;
    const struct sadmm_grip now = sadmm_hand_motion(t), next = sadmm_hand_motion(t + dt);
    return sadmm_move_hand(world, 0, 0, &now, &next, dt, error);
}

/* ---- success ----------------------------------------------------------------------------------------------------- */

static sadmm_status state_of(sadmm_world *world, int32_t index, sadmm_body_state *state, struct sadmm_error *error)
{
    sadmm_body_id id;
    sadmm_status status = sadmm_world_body_at(world, index, &id);
    if (status == SADMM_OK) status = sadmm_world_body_state(world, id, state);
    return sadmm_scene_world_error(world, status, error);
}

/* Where a body's centre is in the palm. */
static sadmm_status in_palm(sadmm_world *world, int32_t index, double at[3], double *height, struct sadmm_error *error)
{
    sadmm_body_state palm, body;
    sadmm_status status = state_of(world, HAND, &palm, error);
    if (status == SADMM_OK) status = state_of(world, index, &body, error);
    if (status != SADMM_OK) return status;
    v3_store(m3_tmul(q_matrix(q_load(palm.orientation)), v3_sub(v3_load(body.position), v3_load(palm.position))), at);
    *height = body.position[2];
    return SADMM_OK;
}

/* What the hand feels of its weight and of what it holds, N. */
static sadmm_status reaction_weight(sadmm_world *world, double *weight, struct sadmm_error *error)
{
    sadmm_coupling_id id;
    sadmm_coupling_state state;
    sadmm_status status = sadmm_world_coupling_at(world, 0, &id);
    if (status == SADMM_OK) status = sadmm_world_coupling_state(world, id, &state);
    *weight = -state.reaction_force[2];
    return sadmm_scene_world_error(world, status, error);
}

/* Something is lifted: by `rise` (m) it is off the table, where it stays in the palm. */
struct lifting {
    const struct sadmm_hand_task *when;
    int32_t body;
    double rise, mass; /* m, kg */
};

/* Memory: height at the start, place in the palm when it was lifted, the lowest height and the largest way from that
 * place since, its weight by the reaction while it was held. */
enum { START, PLACE, LOWEST = PLACE + 3, SLIP, WEIGHT, MEMORY };

static sadmm_status observe_lifting(sadmm_world *world, double t, double dt, const struct lifting *about,
                                    struct sadmm_scene_task *task, double memory[MEMORY], struct sadmm_error *error)
{
    double at[3], height, weight = 0;
    if (t > 0 && (t < about->when->lifted - 1e-9 || task->finished)) return SADMM_OK;
    if (t < about->when->held + 1e-9) {
        sadmm_status status = in_palm(world, about->body, at, &height, error);
        if (status == SADMM_OK && t > 0) status = reaction_weight(world, &memory[WEIGHT], error);
        if (status != SADMM_OK) return status;
        if (t == 0) {
            memory[START] = height;
            return SADMM_OK;
        }
        if (memory[LOWEST] == 0) { /* heights in the hand are never 0 */
            memcpy(memory + PLACE, at, sizeof at);
            memory[LOWEST] = height;
        }
        memory[LOWEST] = fmin(memory[LOWEST], height);
        memory[SLIP] = fmax(memory[SLIP], v3_norm(v3_sub(v3_load(at), v3_load(memory + PLACE))));
        task->figures[0].value = memory[LOWEST] - memory[START];
        task->figures[1].value = memory[SLIP];
        task->figures[2].value = t - about->when->lifted;
    }
    if (t + dt <= about->when->released + 1e-9) return SADMM_OK;
    /* The hand rests at both times: what it feels less is the weight. 0.1 N: a hundredth of what it weighs by
     * itself. */
    sadmm_status status = reaction_weight(world, &weight, error);
    task->figures[3].value = memory[WEIGHT] - weight;
    task->finished = true;
    task->passed = task->figures[0].value > 0.9 * about->rise && task->figures[1].value < 0.003 &&
                   fabs(task->figures[3].value - 9.81 * about->mass) < 0.1 + 0.05 * 9.81 * about->mass;
    return status;
}

/* The upper cube lies on the lower one, flat, and both rest. */
static sadmm_status observe_stack(sadmm_world *world, double t, struct sadmm_scene_task *task,
                                  struct sadmm_error *error)
{
    sadmm_body_state upper, lower;
    if (t < sadmm_motion_end - 1e-9) return SADMM_OK;
    sadmm_status status = state_of(world, UPPER, &upper, error);
    if (status == SADMM_OK) status = state_of(world, LOWER, &lower, error);
    if (status != SADMM_OK) return status;
    const double height = upper.position[2] - lower.position[2];
    const double off = hypot(upper.position[0] - lower.position[0], upper.position[1] - lower.position[1]);
    const double speed = fmax(v3_norm(v3_load(upper.linear_velocity)), v3_norm(v3_load(lower.linear_velocity)));
    task->figures[0].value = height;
    task->figures[1].value = off;
    task->figures[2].value = speed;
    task->finished = true;
    task->passed = fabs(height - 2 * cube_half) < 5e-4 && off < cube_half / 2 && speed < 1e-3;
    return SADMM_OK;
}

/* The car has been pushed, and its wheels have rolled: turned by as much as it went. */
static sadmm_status observe_car(sadmm_world *world, double t, struct sadmm_scene_task *task, double *start,
                                struct sadmm_error *error)
{
    sadmm_body_state car;
    double slid = 0;
    if (t > 0 && t < sadmm_motion_end - 1e-9) return SADMM_OK;
    sadmm_status status = state_of(world, CAR, &car, error);
    if (status != SADMM_OK || t == 0) {
        if (status == SADMM_OK) *start = car.position[0];
        return status;
    }
    const double way = car.position[0] - *start;
    for (int k = 0; k < 4 && status == SADMM_OK; ++k) {
        sadmm_joint_id id;
        sadmm_joint_state joint;
        status = sadmm_world_joint_at(world, SADMM_HAND_JOINTS + k, &id);
        if (status == SADMM_OK) status = sadmm_world_joint_state(world, id, &joint);
        if (status == SADMM_OK) slid = fmax(slid, fabs(way - wheel_radius * joint.position[5]));
    }
    task->figures[0].value = way;
    task->figures[1].value = slid;
    task->finished = true;
    task->passed = way > 0.15 && slid < 0.1 * way;
    return sadmm_scene_world_error(world, status, error);
}

/* The walls stand where they were built. */
static sadmm_status observe_walls(sadmm_world *world, double t, struct sadmm_scene_task *task,
                                  struct sadmm_error *error)
{
    double centres[WALL_CUBES][3], most = 0;
    if (t < sadmm_motion_end - 1e-9) return SADMM_OK;
    for (int k = 0, count = wall_cubes(centres); k < count; ++k) {
        sadmm_body_state cube;
        sadmm_status status = state_of(world, WALLS + k, &cube, error);
        if (status != SADMM_OK) return status;
        const double moved = v3_norm(v3_sub(v3_load(cube.position), v3_load(centres[k])));
        most = moved <= most ? most : moved; /* NaN stays */
    }
    task->figures[0].value = most;
    task->finished = true;
    task->passed = most < 1e-3;
    return SADMM_OK;
}

static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    static const struct sadmm_scene_task lifted = {
        .figures = {{"lifted", "m", 0}, {"slip", "m", 0}, {"held", "s", 0}, {"reaction", "N", 0}}, .figure_count = 4,
    };
    static const struct lifting golden = {&sadmm_golden_task, GOLDEN, 0.15, 1};
    static const struct lifting heavy = {&sadmm_heavy_task, HEAVY, 0.13, 1.5};
    static const struct lifting spoon = {&sadmm_spoon_task, SPOON, 0.1, 0.03};
    enum { GOLDEN_TASK, HEAVY_TASK, SPOON_TASK, STACK_TASK, CAR_TASK, WALLS_TASK, TASKS };
    const double dt = scene->def.settings.dt, t = (double)step * dt;
    struct sadmm_scene_task *tasks = result->tasks;
    double *memory = result->memory;
    if (step == 0) {
        result->task_count = TASKS;
        tasks[GOLDEN_TASK] = tasks[HEAVY_TASK] = tasks[SPOON_TASK] = lifted;
        tasks[GOLDEN_TASK].name = "golden cube";
        tasks[HEAVY_TASK].name = "1.5 kg body";
        tasks[SPOON_TASK].name = "thin spoon";
        tasks[STACK_TASK] = (struct sadmm_scene_task){
            .name = "cube on cube", .figures = {{"height", "m", 0}, {"off", "m", 0}, {"speed", "m/s", 0}},
            .figure_count = 3,
        };
        tasks[CAR_TASK] = (struct sadmm_scene_task){
            .name = "toy car", .figures = {{"pushed", "m", 0}, {"slid", "m", 0}}, .figure_count = 2,
        };
        tasks[WALLS_TASK] =
            (struct sadmm_scene_task){.name = "walls", .figures = {{"moved", "m", 0}}, .figure_count = 1};
    }
    sadmm_status status = observe_lifting(world, t, dt, &golden, &tasks[GOLDEN_TASK], memory, error);
    if (status == SADMM_OK)
        status = observe_lifting(world, t, dt, &heavy, &tasks[HEAVY_TASK], memory + MEMORY, error);
    if (status == SADMM_OK)
        status = observe_lifting(world, t, dt, &spoon, &tasks[SPOON_TASK], memory + 2 * MEMORY, error);
    if (status == SADMM_OK) status = observe_stack(world, t, &tasks[STACK_TASK], error);
    if (status == SADMM_OK) status = observe_car(world, t, &tasks[CAR_TASK], memory + 3 * MEMORY, error);
    if (status == SADMM_OK) status = observe_walls(world, t, &tasks[WALLS_TASK], error);
    return status;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.004;
    def->settings.penalty_period = 20;
    def->settings.penalty_mass_factor = 1; /* bodies of 10 to 30 g: the default weights are for heavier ones */
    def->settings.penalty_offset = 1e3;
}

const struct sadmm_scene_family sadmm_family_hand_demo = {
    .info = {
        .name = "hand_demo",
        .arguments = "",
        .description = "a hand of 34 links lifts, holds, stacks and pushes things by a recorded motion",
        .duration = 38.4,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 60},
    },
    .configure = configure,
    .fill = fill,
    .before_step = before_step,
    .observe = observe,
};
