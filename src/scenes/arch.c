/* A semicircular arch of N equal wedges on two blocks, laid so that their faces touch, without mortar or a support.
 *
 * Whether it stands is known. With enough friction it falls by turning about the edges of its joints, and it does not
 * where a line of thrust fits into the ring: from a thickness of 0.1075 radii on, the radius taken to the middle of the
 * ring (Milankovitch 1907; Heyman 1969: 0.106). That is for joints everywhere. Where the line has to pass through 15
 * joints only, of wedges with flat backs, 0.1061 will do, and 0.1016 with 9. The default is 0.2. Friction: the thrust
 * leans most at the blocks, by 0.40 of the weight at the least thickness; there is 0.7. */
#include <math.h>

#include "built.h"
#include "family.h"
#include "solid.h"

enum { BLOCKS = 2, FIRST = 1 + BLOCKS }; /* shapes: ground, blocks, stones */

static const double radius = 1, width = 0.4;          /* m, of the middle of the ring; along the vault */
static const double block_height = 0.3, beside = 0.1; /* m; beside: of the blocks, around the arch */
static const double density = 2400, friction = 0.7;   /* kg/m^3 */
static const double pi = 3.14159265358979323846;

static double thickness(const struct sadmm_scene *scene)
{
    return 1e-3 * (double)scene->m;
}

/* The middle of stone i's back and belly, z outward; stone 0 stands on the block at -x. */
static struct sadmm_frame stone_at(const struct sadmm_scene *scene, int32_t i)
{
    const double angle = pi * ((i + 0.5) / (double)scene->n - 0.5);
    const struct sadmm_frame middle = sadmm_frame_moved(sadmm_frame_world(), 0, 0, block_height);
    return sadmm_frame_moved(sadmm_frame_turned(middle, 1, angle), 0, 0, radius);
}

static sadmm_status make_stone(const struct sadmm_scene *scene, sadmm_hull **hull, struct sadmm_error *error)
{
    const double half = 0.5 * pi / (double)scene->n;
    double points[8][3];
    for (int v = 0; v < 8; ++v) {
        const double r = radius + (v & 1 ? 0.5 : -0.5) * thickness(scene);
        points[v][0] = (v & 2 ? 1 : -1) * r * sin(half);
        points[v][1] = (v & 4 ? 0.5 : -0.5) * width;
        points[v][2] = r * cos(half) - radius;
    }
    return sadmm_scene_hull(points[0], 8, hull, error);
}

static sadmm_status place_block(const struct sadmm_scene *scene, sadmm_world *world, double x,
                                struct sadmm_error *error)
{
    sadmm_shape_def block = sadmm_shape_def_default();
    block.type = SADMM_SHAPE_BOX;
    block.size[0] = 0.5 * thickness(scene) + beside;
    block.size[1] = 0.5 * width + beside;
    block.size[2] = 0.5 * block_height;
    block.friction = friction;
    const struct sadmm_frame at = sadmm_frame_moved(sadmm_frame_world(), x, 0, 0.5 * block_height);
    return sadmm_place_solids(world, at, &block, 1, 0, "block", NULL, error);
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    sadmm_hull *stone;
    sadmm_status status = make_stone(scene, &stone, error);
    if (status != SADMM_OK) return status;
    const sadmm_shape_def shape = sadmm_hull_shape(stone, friction);
    status = sadmm_place_plane(world, sadmm_frame_world(), friction, error);
    for (int side = -1; side <= 1 && status == SADMM_OK; side += 2)
        status = place_block(scene, world, side * radius, error);
    for (int32_t i = 0; i < scene->n && status == SADMM_OK; ++i)
        status = sadmm_place_solids(world, stone_at(scene, i), &shape, 1, density, "stone", NULL, error);
    sadmm_hull_destroy(stone);
    return status;
}

static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const struct sadmm_built arch = {
        FIRST, (int32_t)scene->n, -1, stone_at, .end = scene->info->duration, .most = 1e-3};
    result->task_count = 1;
    return sadmm_observe_built(scene, world, step, &arch, &result->tasks[0], error);
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_arch = {
    .info = {
        .name = "arch",
        .arguments = "[:N[:mm]]",
        .description = "a semicircular arch of N wedges (N in [3, 200], default 15), radius 1 m, M mm thick (M in [20, "
                       "500], default 200)",
        .duration = 10,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 40},
    },
    .n_default = 15, .n_min = 3, .n_max = 200,
    .m_default = 200, .m_min = 20, .m_max = 500,
    .configure = configure,
    .fill = fill,
    .observe = observe,
};
