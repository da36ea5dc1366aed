/* A round peg (a prism of 32 sides, 40 mm wide and 80 mm long) falls into a round hole with 0.1 mm play, and has to
 * come to its bottom. It begins 5 mm above, 1 mm off the axis and leaning by 0.01 rad, so that it meets the lead-in
 * first, a cone of 2 mm.
 *
 * The block is one static body of 32 wedges round the hole, their inner faces flat: a hole of 32 sides whose inscribed
 * circle is wider by the play than the peg's circumscribed one. So the peg fits however it is turned. It falls at up to
 * 1.1 m/s, eleven times its play a step of 1 ms.
 *
 * It comes down by itself: leaning by 0.01 rad it touches both sides from a depth of 10 mm on, a quarter of its width,
 * which is more than friction of 0.15 could wedge, and its weight's arm about the axis, 0.4 mm, is far less than the
 * radius, where it would jam. */
#include <math.h>

#include "core/math/quat.h"
#include "family.h"
#include "solid.h"

enum { SIDES = 32, PEG = 1 + SIDES + 1 }; /* shapes: ground, wedges, bottom, peg */

static const double radius = 0.02, half_length = 0.04; /* m, of the peg: of its edges */
static const double depth = 0.06, lead_in = 0.002, outer = 0.045, bottom = 0.01; /* m; half the bottom's thickness */
static const double above = 0.005, off = 0.001, leaning = 0.01; /* m, m, rad */
static const double density = 7800, friction = 0.15;
static const double pi = 3.14159265358979323846;

static double play(const struct sadmm_scene *scene)
{
    return 1e-6 * (double)scene->n;
}

/* Corners of side k: 2 points at radius r of a ring's inscribed circle. */
static void add_corners(double *points, double r, double z)
{
    for (int k = 0; k < 2; ++k) {
        const double angle = (k ? 1 : -1) * pi / SIDES;
        v3_store(v3(r, r * tan(angle), z), points + 3 * k);
    }
}

/* The wedge at +x; z = 0 is the hole's bottom. */
static sadmm_status make_wedge(const struct sadmm_scene *scene, sadmm_hull **hull, struct sadmm_error *error)
{
    const double r = radius + 0.5 * play(scene);
    double points[10][3];
    add_corners(points[0], r, 0);
    add_corners(points[2], r, depth - lead_in);
    add_corners(points[4], r + lead_in, depth);
    add_corners(points[6], outer, 0);
    add_corners(points[8], outer, depth);
    return sadmm_scene_hull(points[0], 10, hull, error);
}

static sadmm_status make_peg(sadmm_hull **hull, struct sadmm_error *error)
{
    double points[2 * SIDES][3];
    for (int k = 0; k < 2 * SIDES; ++k) {
        const double angle = 2 * pi * (k / 2) / SIDES;
        v3_store(v3(radius * cos(angle), radius * sin(angle), (k % 2 ? 1 : -1) * half_length), points[k]);
    }
    return sadmm_scene_hull(points[0], 2 * SIDES, hull, error);
}

/* Its bottom stands on the ground. */
static sadmm_status place_block(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    sadmm_shape_def parts[SIDES + 1];
    sadmm_hull *wedge;
    sadmm_status status = make_wedge(scene, &wedge, error);
    if (status != SADMM_OK) return status;
    for (int k = 0; k < SIDES; ++k) {
        const double half = pi * k / SIDES;
        parts[k] = sadmm_hull_shape(wedge, friction);
        parts[k].orientation[0] = cos(half);
        parts[k].orientation[3] = sin(half);
    }
    parts[SIDES] = sadmm_shape_def_default();
    parts[SIDES].type = SADMM_SHAPE_BOX;
    parts[SIDES].size[0] = parts[SIDES].size[1] = outer;
    parts[SIDES].size[2] = bottom;
    parts[SIDES].position[2] = -bottom;
    parts[SIDES].friction = friction;
    const struct sadmm_frame at = sadmm_frame_moved(sadmm_frame_world(), 0, 0, 2 * bottom);
    status = sadmm_place_solids(world, at, parts, SIDES + 1, 0, "block", NULL, error);
    sadmm_hull_destroy(wedge);
    return status;
}

static sadmm_status place_peg(sadmm_world *world, struct sadmm_error *error)
{
    sadmm_hull *peg;
    sadmm_status status = make_peg(&peg, error);
    if (status != SADMM_OK) return status;
    const sadmm_shape_def shape = sadmm_hull_shape(peg, friction);
    struct sadmm_frame at = sadmm_frame_moved(sadmm_frame_world(), off, 0, 2 * bottom + depth + above + half_length);
    at = sadmm_frame_turned(sadmm_frame_turned(at, 2, 0.3), 1, leaning);
    status = sadmm_place_solids(world, at, &shape, 1, density, "peg", NULL, error);
    sadmm_hull_destroy(peg);
    return status;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), friction, error);
    if (status == SADMM_OK) status = place_block(scene, world, error);
    return status == SADMM_OK ? place_peg(world, error) : status;
}

/* The peg's axis in the world, and the middle of its lower end: its shape says where they are in the body. */
static sadmm_status inspect(sadmm_world *world, vec3 *axis, vec3 *end, struct sadmm_error *error)
{
    sadmm_shape_id id;
    sadmm_shape_def shape;
    sadmm_body_id body;
    sadmm_body_state state;
    sadmm_status status = sadmm_world_shape_at(world, PEG, &id);
    if (status == SADMM_OK) status = sadmm_world_shape_def(world, id, &shape, &body);
    if (status == SADMM_OK) status = sadmm_world_body_state(world, body, &state);
    if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
    const quat turn = q_load(state.orientation);
    const vec3 middle = v3_add(v3_load(state.position), m3_mul(q_matrix(turn), v3_load(shape.position)));
    *axis = m3_mul(q_matrix(q_mul(turn, q_load(shape.orientation))), v3(0, 0, 1));
    *end = v3_madd(middle, -half_length, *axis);
    return SADMM_OK;
}

/* How far the peg's lower end can be off the axis: sides against sides, towards a corner of the hole. */
static double farthest_off(const struct sadmm_scene *scene)
{
    const double half_side = cos(pi / SIDES);
    return (radius + 0.5 * play(scene) - radius * half_side) / half_side;
}

/* It is in the hole if it is as deep as that, leans and is off by no more than the play lets it, and went into nothing
 * by half the play on its way. Memory: the deepest overlap so far, m. */
static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const double t = (double)step * scene->def.settings.dt;
    struct sadmm_scene_task *task = &result->tasks[0];
    sadmm_step_report report;
    vec3 axis = v3(0, 0, 0), end = axis;
    result->task_count = 1;
    if (task->finished) return SADMM_OK;
    sadmm_status status = sadmm_scene_world_error(world, sadmm_world_report(world, &report), error);
    if (status == SADMM_OK) status = inspect(world, &axis, &end, error);
    if (status != SADMM_OK) return status;
    const double down = 2 * bottom + depth - end.z, tilt = atan2(hypot(axis.x, axis.y), axis.z);
    result->memory[0] = fmax(result->memory[0], report.penetration_max);
    task->name = "insert";
    task->figure_count = 4;
    task->figures[0] = (struct sadmm_scene_figure){"depth", "m", down};
    task->figures[1] = (struct sadmm_scene_figure){"tilt", "rad", tilt};
    task->figures[2] = (struct sadmm_scene_figure){"off", "m", hypot(end.x, end.y)};
    task->figures[3] = (struct sadmm_scene_figure){"overlap", "m", result->memory[0]};
    task->finished = t >= scene->info->duration - 1e-9;
    const double most = 0.5 * play(scene), aside = hypot(end.x, end.y);
    task->passed = task->finished && fabs(down - depth) < most && tilt < play(scene) / depth &&
                   aside < farthest_off(scene) + most && result->memory[0] < most;
    return SADMM_OK;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.001;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_peg_in_hole = {
    .info = {
        .name = "peg_in_hole",
        .arguments = "[:um]",
        .description = "a round peg falls into a hole with N um of play (N in [10, 1000], default 100)",
        .duration = 1,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 40},
    },
    .n_default = 100, .n_min = 10, .n_max = 1000,
    .configure = configure,
    .fill = fill,
    .observe = observe,
};
