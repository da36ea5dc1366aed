/* Heaps of convex meshes: N bodies of six forms (forms.h), in all orientations, fall from a loose grid into a walled
 * yard. Six hulls are shared by all of them. Nothing may leave the yard, or come to lie below its ground. */
#include <math.h>

#include "family.h"
#include "forms.h"
#include "noise.h"
#include "solid.h"

enum { WALLS = 4, FIRST = 1 + WALLS }; /* bodies: ground, walls, heap */

static const double radius = 0.06, spacing = 0.13; /* m; no two of the grid touch, however turned */
static const double around = 0.01, wall = 0.05;    /* m: from the grid to a wall; half a wall's thickness */
static const double density = 2000, friction = 0.5;

/* Columns along one side: about twice as many layers as that. */
static long side_of(long n)
{
    return (long)fmax(1, round(cbrt((double)n / 2)));
}

static double half_width(long n)
{
    return 0.5 * spacing * (double)side_of(n) + around;
}

/* Of the grid, and of the walls, m. */
static double height_of(long n)
{
    const long layer = side_of(n) * side_of(n);
    return spacing * ((double)((n + layer - 1) / layer) + 0.5);
}

static struct sadmm_frame body_at(long n, long i)
{
    const long side = side_of(n), column = i % side, row = i / side % side, layer = i / (side * side);
    const double middle = 0.5 * (double)(side - 1);
    struct sadmm_frame at = sadmm_frame_moved(sadmm_frame_world(), spacing * ((double)column - middle),
                                              spacing * ((double)row - middle), spacing * ((double)layer + 0.5));
    q_store(sadmm_noise_orientation(i), at.orientation);
    return at;
}

static sadmm_status place_wall(sadmm_world *world, long n, int number, struct sadmm_error *error)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    const int axis = number / 2;
    double at[3] = {0, 0, 0.5 * height_of(n)};
    at[axis] = (number % 2 ? 1 : -1) * (half_width(n) + wall);
    shape.type = SADMM_SHAPE_BOX;
    shape.friction = friction;
    shape.size[axis] = wall;
    shape.size[1 - axis] = half_width(n) + 2 * wall;
    shape.size[2] = 0.5 * height_of(n);
    return sadmm_place_solids(world, sadmm_frame_moved(sadmm_frame_world(), at[0], at[1], at[2]), &shape, 1, 0, "wall",
                              NULL, error);
}

static sadmm_status make_form(int form, sadmm_hull **hull, struct sadmm_error *error)
{
    double points[SADMM_FORM_MOST][3];
    const int count = sadmm_form_points((enum sadmm_form)form, points);
    for (int k = 0; k < count; ++k) v3_store(v3_scale(v3_load(points[k]), radius), points[k]);
    return sadmm_scene_hull(points[0], count, hull, error);
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    sadmm_hull *forms[SADMM_FORM_COUNT] = {NULL};
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), friction, error);
    for (int k = 0; k < WALLS && status == SADMM_OK; ++k) status = place_wall(world, scene->n, k, error);
    for (int k = 0; k < SADMM_FORM_COUNT && status == SADMM_OK; ++k) status = make_form(k, &forms[k], error);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        const sadmm_shape_def shape = sadmm_hull_shape(forms[i % SADMM_FORM_COUNT], friction);
        status = sadmm_place_solids(world, body_at(scene->n, i), &shape, 1, density, NULL, NULL, error);
    }
    for (int k = 0; k < SADMM_FORM_COUNT; ++k) sadmm_hull_destroy(forms[k]);
    return status;
}

/* Those that are not in the yard, and the fastest of all. */
static sadmm_status inspect(const struct sadmm_scene *scene, sadmm_world *world, double *outside, double *speed,
                            struct sadmm_error *error)
{
    const double half = half_width(scene->n);
    *outside = *speed = 0;
    for (int32_t i = 0; i < scene->n; ++i) {
        sadmm_body_id id;
        sadmm_body_state state;
        sadmm_status status = sadmm_world_body_at(world, FIRST + i, &id);
        if (status == SADMM_OK) status = sadmm_world_body_state(world, id, &state);
        if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
        const double *p = state.position;
        *outside += !(fabs(p[0]) < half && fabs(p[1]) < half && p[2] > 0 && p[2] < height_of(scene->n));
        *speed = fmax(*speed, v3_norm(v3_load(state.linear_velocity)));
    }
    return SADMM_OK;
}

/* Memory: the deepest overlap of the run so far, m. */
static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const double t = (double)step * scene->def.settings.dt;
    struct sadmm_scene_task *task = &result->tasks[0];
    sadmm_step_report report;
    double outside = 0, speed = 0;
    result->task_count = 1;
    if (task->finished) return SADMM_OK;
    sadmm_status status = sadmm_scene_world_error(world, sadmm_world_report(world, &report), error);
    const bool finished = t >= scene->info->duration - 1e-9;
    if (status == SADMM_OK && finished) status = inspect(scene, world, &outside, &speed, error);
    if (status != SADMM_OK) return status;
    result->memory[0] = fmax(result->memory[0], report.penetration_max);
    task->name = "settle";
    task->figure_count = 3;
    task->figures[0] = (struct sadmm_scene_figure){"outside", "", outside};
    task->figures[1] = (struct sadmm_scene_figure){"speed", "m/s", speed};
    task->figures[2] = (struct sadmm_scene_figure){"overlap", "m", result->memory[0]};
    task->finished = finished;
    task->passed = finished && outside == 0 && result->memory[0] < 0.1 * radius;
    return SADMM_OK;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_mesh_pile = {
    .info = {
        .name = "mesh_pile",
        .arguments = "[:N]",
        .description = "N convex meshes of six forms falling into a walled yard (N in [1, 100000], default 200)",
        .duration = 4,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 40},
        .substeps = 2,
        .chaotic = true,
    },
    .n_default = 200, .n_min = 1, .n_max = 100000,
    .configure = configure,
    .fill = fill,
    .observe = observe,
};
