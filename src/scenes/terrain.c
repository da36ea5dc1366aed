/* Bodies on a heightfield: N stones, boxes, balls and capsules fall onto hills, tumble down and come to rest in the
 * valleys. Nothing may fall through the ground, or leave it: four walls stand around it.
 *
 * The hills are smooth noise in five octaves (gradient noise of a grid, made of hashes: arithmetic alone, so that they
 * are the same on every machine). Cells of the ground are 0.1 m x 0.08 m, and bodies 0.1 to 0.36 m wide: small ones lie
 * within a cell or two, under large ones are thirty triangles. The area grows with N. */
#include <math.h>

#include "core/base/memory.h"
#include "family.h"
#include "forms.h"
#include "noise.h"
#include "solid.h"
#include "subadmm/mass.h"

enum { WALLS = 4, FIRST = 1 + WALLS, STONES = 4, KINDS = 8, OCTAVES = 5 }; /* bodies: ground, walls, the others */

static const double cell[2] = {0.1, 0.08};            /* m, of the ground */
static const double spacing = 0.4, least = 0.05;      /* m: of the bodies before they fall, whose radii are at most
                                                         0.18; the smallest extent of a stone */
static const double around = 0.2, wall = 0.1;         /* m: beside the outermost bodies; half a wall's thickness */
static const double high = 1.2;                       /* m: no ground is farther from 0 */
static const double density = 2000, friction = 0.6;
static const double deepest = 1e-3;                   /* m: what is farther under the ground is through it */
static const double still = 0.02;                     /* m/s: at rest has no more energy than this gives it */

/* ---- ground ------------------------------------------------------------------------------------------------------ */

/* A slope in [-1, 1) of the noise at a corner of its grid. */
static double gradient(int octave, long column, long row, int axis)
{
    return sadmm_noise(((long)octave << 48) + ((column + (1L << 22)) << 24) + row + (1L << 22), (uint64_t)axis);
}

/* Gradient noise with a grid of 1 (Perlin 2002): slopes at the corners, joined by a polynomial that is smooth twice. */
static double smooth_noise(int octave, double x, double y)
{
    const long column = (long)floor(x), row = (long)floor(y);
    double weight[2][2], sum = 0;
    for (int k = 0; k < 2; ++k) {
        const double t = k ? y - (double)row : x - (double)column;
        weight[k][1] = t * t * t * (t * (6 * t - 15) + 10);
        weight[k][0] = 1 - weight[k][1];
    }
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            const double slope = gradient(octave, column + i, row + j, 0) * (x - (double)(column + i)) +
                                 gradient(octave, column + i, row + j, 1) * (y - (double)(row + j));
            sum += weight[0][i] * weight[1][j] * slope;
        }
    return sum;
}

/* m. */
static double hills(double x, double y)
{
    static const double wave[OCTAVES] = {3.1, 1.7, 0.83, 0.41, 0.23};     /* m: grids of the octaves */
    static const double height[OCTAVES] = {1.2, 0.5, 0.16, 0.05, 0.02}; /* m */
    double z = 0;
    for (int k = 0; k < OCTAVES; ++k) z += height[k] * smooth_noise(k, x / wave[k], y / wave[k]);
    return fmax(-high, fmin(high, z));
}

/* Bodies along one side: they fall in two layers, or nearly. */
static long side_of(long n)
{
    return (long)fmax(2, ceil(sqrt((double)n / 2)));
}

static double half_width(long n)
{
    return 0.5 * spacing * (double)side_of(n) + around;
}

/* Of the ground along x (0) and y (1): it reaches to the middle of the walls. */
static long cells_of(long n, int axis)
{
    return 2 * (long)ceil((half_width(n) + wall) / cell[axis]);
}

/* The height at a vertex of the grid. */
static double grid_height(long n, long column, long row)
{
    return hills(((double)column - 0.5 * (double)cells_of(n, 0)) * cell[0],
                 ((double)row - 0.5 * (double)cells_of(n, 1)) * cell[1]);
}

/* The ground's triangle under (x, y): how far a point is above its plane; its normal. */
static double above_ground(long n, vec3 p, vec3 *normal)
{
    const double u = p.x / cell[0] + 0.5 * (double)cells_of(n, 0), v = p.y / cell[1] + 0.5 * (double)cells_of(n, 1);
    const long column = (long)floor(u), row = (long)floor(v);
    const double a = u - (double)column, b = v - (double)row;
    const double low = grid_height(n, column, row), top = grid_height(n, column + 1, row + 1);
    const double corner = b > a ? grid_height(n, column, row + 1) : grid_height(n, column + 1, row);
    const double along = b > a ? top - corner : corner - low, across = b > a ? corner - low : top - corner;
    const vec3 up = v3(-along / cell[0], -across / cell[1], 1);
    *normal = v3_scale(up, 1 / v3_norm(up));
    return (p.z - (low + a * along + b * across)) * normal->z;
}

static sadmm_status place_ground(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const long columns = cells_of(scene->n, 0) + 1, rows = cells_of(scene->n, 1) + 1;
    sadmm_heightfield_def def = sadmm_heightfield_def_default();
    double *heights = (double *)sadmm_alloc((size_t)(columns * rows), sizeof *heights);
    if (!heights) return sadmm_fail_memory(error, "the ground");
    for (long k = 0; k < columns * rows; ++k) heights[k] = grid_height(scene->n, k % columns, k / columns);
    def.heights = heights;
    def.columns = (int32_t)columns;
    def.rows = (int32_t)rows;
    def.spacing[0] = cell[0], def.spacing[1] = cell[1];
    sadmm_mesh *ground;
    sadmm_status status = sadmm_scene_heights(&def, &ground, error);
    sadmm_free(heights);
    if (status != SADMM_OK) return status;
    const sadmm_shape_def shape = sadmm_mesh_shape(ground, friction);
    status = sadmm_place_solids(world, sadmm_frame_world(), &shape, 1, 0, "ground", NULL, error);
    sadmm_mesh_destroy(ground);
    return status;
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

/* Walls, from below the lowest ground to above the highest body. */
static double wall_height(long n)
{
    return high + spacing * ((double)((n + side_of(n) * side_of(n) - 1) / (side_of(n) * side_of(n))) + 1);
}

static sadmm_status place_wall(sadmm_world *world, long n, int number, struct sadmm_error *error)
{
    sadmm_shape_def shape = sadmm_shape_def_default();
    const int axis = number / 2;
    double at[3] = {0, 0, 0.5 * (wall_height(n) - high)};
    at[axis] = (number % 2 ? 1 : -1) * (half_width(n) + wall);
    shape.type = SADMM_SHAPE_BOX;
    shape.friction = friction;
    shape.size[axis] = wall;
    shape.size[1 - axis] = half_width(n) + 2 * wall;
    shape.size[2] = 0.5 * (wall_height(n) + high);
    return sadmm_place_solids(world, sadmm_frame_moved(sadmm_frame_world(), at[0], at[1], at[2]), &shape, 1, 0, "wall",
                              NULL, error);
}

/* Over the hills, in layers. */
static struct sadmm_frame body_at(long n, long i)
{
    const long side = side_of(n), column = i % side, row = i / side % side, layer = i / (side * side);
    const double middle = 0.5 * (double)(side - 1);
    struct sadmm_frame at = sadmm_frame_moved(sadmm_frame_world(), spacing * ((double)column - middle),
                                              spacing * ((double)row - middle), high + spacing * ((double)layer + 0.5));
    q_store(sadmm_noise_orientation(i), at.orientation);
    return at;
}

/* The ball of 32 corners, pressed into an ellipsoid of this radius: affine, so that all 32 remain corners. */
static sadmm_status make_stone(int kind, sadmm_hull **hull, struct sadmm_error *error)
{
    static const double size[STONES][3] = {
        {0.06, 0.055, 0.05}, {0.08, 0.06, 0.05}, {0.11, 0.1, 0.07}, {0.18, 0.14, 0.11},
    };
    double points[SADMM_FORM_MOST][3];
    const int count = sadmm_form_points(SADMM_FORM_BALL, points);
    for (int v = 0; v < count; ++v)
        for (int k = 0; k < 3; ++k) points[v][k] *= size[kind][k];
    return sadmm_scene_hull(points[0], count, hull, error);
}

/* Of eight bodies five are stones, one is a box, one a ball, one a capsule. */
static sadmm_shape_def shape_of(long i, sadmm_hull *const stones[STONES])
{
    static const int stone_of[KINDS] = {0, 1, 2, 3, 1}; /* few large ones */
    const int kind = (int)(i % KINDS);
    const double size = least * (1.5 + 0.5 * sadmm_noise(i, 1000));
    sadmm_shape_def shape = sadmm_shape_def_default();
    if (kind < 5) return sadmm_hull_shape(stones[stone_of[kind]], friction);
    shape.friction = friction;
    switch (kind) {
    case 5:
        shape.type = SADMM_SHAPE_BOX;
        shape.size[0] = size, shape.size[1] = 0.8 * size, shape.size[2] = 0.6 * size;
        break;
    case 6:
        shape.type = SADMM_SHAPE_SPHERE;
        shape.size[0] = size;
        break;
    default:
        shape.type = SADMM_SHAPE_CAPSULE;
        shape.size[0] = 0.7 * size, shape.size[1] = 0.6 * size;
    }
    return shape;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    sadmm_hull *stones[STONES] = {NULL};
    sadmm_status status = place_ground(scene, world, error);
    for (int k = 0; k < WALLS && status == SADMM_OK; ++k) status = place_wall(world, scene->n, k, error);
    for (int k = 0; k < STONES && status == SADMM_OK; ++k) status = make_stone(k, &stones[k], error);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        const sadmm_shape_def shape = shape_of(i, stones);
        status = sadmm_place_solids(world, body_at(scene->n, i), &shape, 1, density, NULL, NULL, error);
    }
    for (int k = 0; k < STONES; ++k) sadmm_hull_destroy(stones[k]);
    return status;
}

/* ---- success ----------------------------------------------------------------------------------------------------- */

/* The k-th of the points of a shape that its corners are, in its frame, or the middles of their balls; false: there are
 * no more. */
static bool corner_of(const sadmm_shape_def *shape, int k, vec3 *x, double *ball)
{
    const double *size = shape->size;
    *ball = 0;
    switch (shape->type) {
    case SADMM_SHAPE_HULL:
        if (k >= sadmm_hull_vertex_count(shape->hull)) return false;
        *x = v3_load(sadmm_hull_vertices(shape->hull) + 3 * k);
        return true;
    case SADMM_SHAPE_BOX:
        *x = v3(k & 1 ? size[0] : -size[0], k & 2 ? size[1] : -size[1], k & 4 ? size[2] : -size[2]);
        return k < 8;
    default:
        *ball = size[0];
        *x = v3(0, 0, shape->type == SADMM_SHAPE_CAPSULE ? (k ? size[1] : -size[1]) : 0);
        return k < (shape->type == SADMM_SHAPE_CAPSULE ? 2 : 1);
    }
}

struct found {
    double below, outside;        /* m, how far the lowest corner of any is under the ground; bodies beyond a wall */
    double moving, speed;         /* bodies; m/s, the fastest */
};

/* Unlike fmax: once NaN, always NaN. */
static double larger(double a, double b)
{
    return a > b || isnan(a) ? a : b;
}

static void inspect_body(long n, const sadmm_shape_def *shape, const sadmm_body_def *body, struct found *found)
{
    const quat turn = q_load(body->orientation);
    const mat3 R = q_matrix(q_normalize(q_mul(turn, q_load(shape->orientation))));
    const vec3 from = v3_add(v3_load(body->position), m3_mul(q_matrix(turn), v3_load(shape->position)));
    const vec3 v = v3_load(body->linear_velocity), w = m3_tmul(q_matrix(turn), v3_load(body->angular_velocity));
    const double half = half_width(n);
    double ball;
    vec3 x, normal;
    found->moving += !(body->mass * v3_norm2(v) + body->inertia[0] * w.x * w.x + body->inertia[1] * w.y * w.y +
                           body->inertia[2] * w.z * w.z <= body->mass * still * still);
    found->speed = larger(found->speed, v3_norm(v));
    if (!(fabs(body->position[0]) < half && fabs(body->position[1]) < half)) {
        found->outside += 1;
        return;
    }
    for (int k = 0; corner_of(shape, k, &x, &ball); ++k) {
        vec3 p = v3_add(from, m3_mul(R, x));
        double above = above_ground(n, p, &normal);
        /* of a ball the point towards the triangle under its middle, wherever that is */
        if (ball > 0) above = above_ground(n, v3_madd(p, -ball, normal), &normal);
        found->below = larger(found->below, -above);
    }
}

static sadmm_status inspect(const struct sadmm_scene *scene, sadmm_world *world, struct found *found,
                            struct sadmm_error *error)
{
    *found = (struct found){0};
    for (int32_t i = 0; i < scene->n; ++i) {
        sadmm_shape_id id;
        sadmm_shape_def shape;
        sadmm_body_id of;
        sadmm_body_def body;
        sadmm_status status = sadmm_world_shape_at(world, FIRST + i, &id);
        if (status == SADMM_OK) status = sadmm_world_shape_def(world, id, &shape, &of);
        if (status == SADMM_OK) status = sadmm_world_body_def(world, of, &body);
        if (status != SADMM_OK) return sadmm_scene_world_error(world, status, error);
        inspect_body(scene->n, &shape, &body, found);
    }
    return SADMM_OK;
}

/* Settled: one body may still move, or of many one in ten. A ball that has stopped on a ridge leaves it when it likes;
 * what trembles does so everywhere. Memory: the deepest overlap of the run so far, m. */
static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const double t = (double)step * scene->def.settings.dt;
    struct sadmm_scene_task *stay = &result->tasks[0], *settle = &result->tasks[1];
    sadmm_step_report report;
    struct found found = {0};
    result->task_count = 2;
    if (stay->finished) return SADMM_OK;
    sadmm_status status = sadmm_scene_world_error(world, sadmm_world_report(world, &report), error);
    const bool finished = t >= scene->info->duration - 1e-9;
    if (status == SADMM_OK && finished) status = inspect(scene, world, &found, error);
    if (status != SADMM_OK) return status;
    result->memory[0] = larger(result->memory[0], report.penetration_max);
    stay->name = "stay";
    stay->figure_count = 3;
    stay->figures[0] = (struct sadmm_scene_figure){"below", "m", found.below};
    stay->figures[1] = (struct sadmm_scene_figure){"outside", "", found.outside};
    stay->figures[2] = (struct sadmm_scene_figure){"overlap", "m", result->memory[0]};
    settle->name = "settle";
    settle->figure_count = 2;
    settle->figures[0] = (struct sadmm_scene_figure){"moving", "", found.moving};
    settle->figures[1] = (struct sadmm_scene_figure){"speed", "m/s", found.speed};
    stay->finished = settle->finished = finished;
    stay->passed = finished && found.below < deepest && found.outside == 0 && result->memory[0] < 0.5 * least;
    settle->passed = finished && found.moving <= fmax(1, 0.1 * (double)scene->n);
    return SADMM_OK;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_terrain = {
    .info = {
        .name = "terrain",
        .arguments = "[:N]",
        .description = "N stones, boxes, balls and capsules tumbling down hills, a heightfield (N in [1, 100000], "
                       "default 500)",
        .duration = 8,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 40},
        .substeps = 2,
        .chaotic = true,
    },
    .n_default = 500, .n_min = 1, .n_max = 100000,
    .configure = configure,
    .fill = fill,
    .observe = observe,
};
