/* A footbridge of 20 planks on hinges, its ends on the banks, hangs a little and carries six crates that drop onto it.
 * Dampers in the hinges end its swinging. It stands if no hinge comes apart, and no crate falls off. */
#include <math.h>
#include <string.h>

#include "core/math/quat.h"
#include "family.h"
#include "place.h"
#include "subadmm/joint.h"

enum { PLANKS = 20, CRATES = 6, FIRST_CRATE = PLANKS }; /* bodies: planks, crates; joints: PLANKS + 1 hinges */

static const double half[3] = {0.15, 0.5, 0.02}; /* m, of a plank; x along the bridge */
static const double slope = 0.03;                /* rad, from one plank to the next */
static const double crate = 0.15;                /* m, half a crate */

/* The joint at the beginning of plank i; that of PLANKS is on the far bank. The first one is at the origin. */
static struct sadmm_frame hinge_at(int i)
{
    struct sadmm_frame at = sadmm_frame_turned(sadmm_frame_world(), 1, slope * (PLANKS - 1) / 2);
    for (int k = 0; k < i; ++k) at = sadmm_frame_turned(sadmm_frame_moved(at, 2 * half[0], 0, 0), 1, -slope);
    return at;
}

static sadmm_status hinge(sadmm_world *world, sadmm_body_id a, sadmm_body_id b, int i, struct sadmm_error *error)
{
    static const double s = 0.70710678118654752440, along_y[4] = {s, -s, 0, 0};
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = SADMM_JOINT_REVOLUTE;
    def.body_a = a;
    def.body_b = b;
    def.coordinates[5].spring_damping = 30;
    sadmm_status status = sadmm_world_place_joint(world, &def, hinge_at(i).origin, along_y);
    if (status == SADMM_OK) status = sadmm_world_add_joint(world, &def, NULL);
    return sadmm_scene_world_error(world, status, error);
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    struct sadmm_piece plank = {.mass = 10, .friction = 0.6};
    const struct sadmm_piece load = {.half_extents = {crate, crate, crate}, .mass = 40, .friction = 0.6};
    sadmm_body_id ids[PLANKS];
    sadmm_status status = SADMM_OK;
    (void)scene;
    memcpy(plank.half_extents, half, sizeof half);
    plank.half_extents[0] -= 0.005; /* neighbours do not meet, but the eye wants gaps */
    for (int i = 0; i < PLANKS && status == SADMM_OK; ++i)
        status = sadmm_place_box(world, sadmm_frame_moved(hinge_at(i), half[0], 0, 0), &plank, &ids[i], error);
    for (int k = 0; k < CRATES && status == SADMM_OK; ++k) {
        struct sadmm_frame at = sadmm_frame_world();
        memcpy(at.origin, hinge_at(5 + 2 * k).origin, sizeof at.origin);
        at = sadmm_frame_moved(at, 0, k % 2 ? 0.15 : -0.15, 0.1 + crate);
        status = sadmm_place_box(world, at, &load, NULL, error);
    }
    static const sadmm_body_id bank = {0, 0};
    for (int i = 0; i <= PLANKS && status == SADMM_OK; ++i)
        status = hinge(world, i > 0 ? ids[i - 1] : bank, i < PLANKS ? ids[i] : bank, i, error);
    return status;
}

/* Memory: how far a hinge has come apart at most, m. */
static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const double t = (double)step * scene->def.settings.dt, tolerance = 5e-3;
    struct sadmm_scene_task *task = &result->tasks[0];
    double speed = 0;
    long carried = 0;
    for (int32_t i = 0; i <= PLANKS && step > 0; ++i) {
        sadmm_joint_id id;
        sadmm_joint_state joint;
        sadmm_status status = sadmm_world_joint_at(world, i, &id);
        if (status == SADMM_OK) status = sadmm_world_joint_state(world, id, &joint);
        if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
        result->memory[0] = fmax(result->memory[0], v3_norm(v3_load(joint.position)));
    }
    for (int32_t k = 0; k < CRATES; ++k) {
        sadmm_body_id id;
        sadmm_body_state state;
        sadmm_status status = sadmm_world_body_at(world, FIRST_CRATE + k, &id);
        if (status == SADMM_OK) status = sadmm_world_body_state(world, id, &state);
        if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
        const double length = hinge_at(PLANKS).origin[0], *p = state.position;
        carried += p[0] > 0 && p[0] < length && fabs(p[1]) < half[1] && p[2] > -2;
        speed = fmax(speed, v3_norm(v3_load(state.linear_velocity)));
    }
    result->task_count = 1;
    task->name = "carry";
    task->figure_count = 3;
    task->figures[0] = (struct sadmm_scene_figure){"crates", "", (double)carried};
    task->figures[1] = (struct sadmm_scene_figure){"apart", "m", result->memory[0]};
    task->figures[2] = (struct sadmm_scene_figure){"speed", "m/s", speed};
    task->finished = t >= scene->info->duration - 1e-9;
    task->passed = task->finished && carried == CRATES && result->memory[0] < tolerance && speed < 0.05;
    return SADMM_OK;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_bridge = {
    .info = {
        .name = "bridge",
        .arguments = "",
        .description = "a bridge of 20 planks on hinges carries six crates that drop onto it",
        .duration = 10,
        .iterations = {[SADMM_METHOD_PAPER] = 1000, [SADMM_METHOD_FAST] = 100},
    },
    .configure = configure,
    .fill = fill,
    .observe = observe,
};
