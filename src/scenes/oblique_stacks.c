/* Oblique stacks (Table I, Sec. IV-B.2): 10 kg plates on 50 g cubes on a slope of 30 degrees, with friction 3 for every
 * pair, so that nothing may slide and the light cubes carry the shear of the heavy plates.
 *
 * An island is two levels of nine cubes and a plate: 20 bodies, and 2 x 9 cubes with 4 contacts below and 4 above are
 * 144 contacts. Seven islands are Table I's 140 bodies and make 1008 contacts (Table I: 1087, 7 % more; the paper does
 * not say how its plates and cubes are arranged).
 */
#include <math.h>

#include "family.h"
#include "place.h"

static const double cube_half = 0.05;                       /* m */
static const double plate_half[3] = { 0.4, 0.4, 0.02 };     /* m */
static const double cube_spacing = 0.3;                     /* m, on a 3 x 3 grid */
static const double island_spacing = 1.5;                   /* m */
static const double friction = 3.0;
static const double slope = 0.5235987755982988;             /* 30 degrees */
enum { LEVELS = 2 };

static sadmm_status fill_level(sadmm_world *world, struct sadmm_frame base, struct sadmm_error *error)
{
    const struct sadmm_piece cube = {
        .half_extents = { cube_half, cube_half, cube_half }, .mass = 0.05, .friction = friction
    };
    const struct sadmm_piece plate = {
        .half_extents = { plate_half[0], plate_half[1], plate_half[2] }, .mass = 10.0, .friction = friction
    };
    sadmm_status status = SADMM_OK;

    for (int i = 0; i < 9 && status == SADMM_OK; ++i) {
        double x = cube_spacing * (i % 3 - 1), y = cube_spacing * (i / 3 - 1);
        status = sadmm_place_box(world, sadmm_frame_moved(base, x, y, cube_half), &cube, NULL, error);
    }
    if (status != SADMM_OK) return status;
    return sadmm_place_box(world, sadmm_frame_moved(base, 0, 0, 2 * cube_half + plate_half[2]), &plate, NULL, error);
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    struct sadmm_frame ground = sadmm_frame_turned(sadmm_frame_world(), 1, slope);
    sadmm_status status = sadmm_place_plane(world, ground, friction, error);
    const double level_height = 2 * (cube_half + plate_half[2]);

    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        struct sadmm_frame island = sadmm_frame_moved(ground, island_spacing * (double)(i / 4),
                                                      island_spacing * (double)(i % 4), 0);
        for (int level = 0; level < LEVELS && status == SADMM_OK; ++level)
            status = fill_level(world, sadmm_frame_moved(island, 0, 0, level * level_height), error);
    }
    return status;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_oblique_stacks = {
    .info = {
        .name = "oblique_stacks",
        .arguments = "[:N]",
        .description = "N stacks of 10 kg plates on 50 g cubes on a 30 degree slope, friction 3 "
                       "(N in [1, 10000], default 7)",
        .duration = 5.0,
        .iterations = {[SADMM_METHOD_PAPER] = 150, [SADMM_METHOD_FAST] = 20},
    },
    .n_default = 7, .n_min = 1, .n_max = 10000,
    .configure = configure,
    .fill = fill,
};
