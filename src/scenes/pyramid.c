/* A flat pyramid of cubes, the usual yardstick of contact solvers: N rows, each cube on two of the row below. N rows
 * are N (N + 1) / 2 cubes with 4 N + 4 N (N - 1) contacts (30 rows: 465 and 3600).
 */
#include "family.h"
#include "place.h"

static const double half = 0.1;  /* m */
static const double pitch = 0.22; /* m: gaps of 20 mm, so that cubes of a row do not touch */

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece cube = { .half_extents = { half, half, half }, .mass = 1.0, .friction = 0.5 };
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.5, error);

    for (long row = 0; row < scene->n; ++row) {
        for (long i = 0; i < scene->n - row && status == SADMM_OK; ++i) {
            double x = pitch * ((double)i - 0.5 * (double)(scene->n - 1 - row)), z = half * (double)(2 * row + 1);
            status = sadmm_place_box(world, sadmm_frame_moved(sadmm_frame_world(), x, 0, z), &cube, NULL, error);
        }
    }
    return status;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_pyramid = {
    .info = {
        .name = "pyramid",
        .arguments = "[:rows]",
        .description = "a flat pyramid of 1 kg cubes (rows in [1, 300], default 30)",
        .duration = 5.0,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 20},
    },
    .n_default = 30, .n_min = 1, .n_max = 300,
    .configure = configure,
    .fill = fill,
};
