/* Vertical stacks (Table I, Sec. IV-B.2): a 10 g box on the ground, a 1 kg box on it, and a 100 kg box that is dropped
 * on top, pitched a little. Mass ratios of 1:100 with the light bodies below are where solvers fail.
 *
 * Three equal cubes make 4 + 4 + 4 contacts a stack: 1440 for 120 stacks, less the few steps before the heavy box lies
 * flat (Table I: 1438 on average). Stacks stand far enough apart to be islands of their own.
 */
#include "family.h"
#include "place.h"

static const double half = 0.15;     /* m */
static const double spacing = 1.0;   /* m */
static const double friction = 0.8;
static const double pitch = 0.025;   /* rad */
static const double drop = 0.005;    /* m, from the lowest edge of the heavy box */

static sadmm_status fill_stack(sadmm_world *world, struct sadmm_frame foot, struct sadmm_error *error)
{
    static const double masses[] = { 0.01, 1.0, 100.0 };
    sadmm_status status = SADMM_OK;

    for (int i = 0; i < 3 && status == SADMM_OK; ++i) {
        const struct sadmm_piece box = {
            .half_extents = { half, half, half }, .mass = masses[i], .friction = friction
        };
        struct sadmm_frame place = sadmm_frame_moved(foot, 0, 0, half * (2 * i + 1));
        if (i == 2) {
            /* The lowest edge of a cube pitched by a small angle is half (cos + sin) - half below its flat height. */
            place = sadmm_frame_moved(place, 0, 0, drop + half * pitch);
            place = sadmm_frame_turned(place, 1, pitch);
        }
        status = sadmm_place_box(world, place, &box, NULL, error);
    }
    return status;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    struct sadmm_frame origin = sadmm_frame_world();
    sadmm_status status = sadmm_place_plane(world, origin, friction, error);
    const long columns = 12; /* Fig. 7 shows a block of stacks */

    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        double x = spacing * (double)(i % columns), y = spacing * (double)(i / columns);
        status = fill_stack(world, sadmm_frame_moved(origin, x, y, 0), error);
    }
    return status;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 50;
}

const struct sadmm_scene_family sadmm_family_vertical_stacks = {
    .info = {
        .name = "vertical_stacks",
        .arguments = "[:N]",
        .description = "N stacks of 10 g, 1 kg and 100 kg, the heavy box dropped on top "
                       "(N in [1, 100000], default 120)",
        .duration = 5.0,
        .iterations = {[SADMM_METHOD_PAPER] = 200, [SADMM_METHOD_FAST] = 40},
    },
    .n_default = 120, .n_min = 1, .n_max = 100000,
    .configure = configure,
    .fill = fill,
};
