/* A chain of contacts that closes from below: N cubes one above the other, with a gap under each, fall together. Each
 * lands on the one below it, which has come to rest by then, so that cube k = 1, 2, ... falls k gaps freely,
 *
 *     z_k(t) = max(z_k(0) - g t^2 / 2, (2 k - 1) half)
 *
 * and every landing is passed on to the ground through all that lies below.
 */
#include "family.h"
#include "place.h"

static const double half = 0.05; /* m */
static const double gap = 0.02;  /* m */

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece cube = {.half_extents = {half, half, half}, .mass = 1, .friction = 0.5};
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.5, error);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        const double z = (2 * half + gap) * (double)i + gap + half;
        status = sadmm_place_box(world, sadmm_frame_moved(sadmm_frame_world(), 0, 0, z), &cube, NULL, error);
    }
    return status;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_falling_chain = {
    .info = {
        .name = "falling_chain",
        .arguments = "[:N]",
        .description = "N cubes one above the other land one after the other (N in [1, 1000], default 10)",
        .duration = 0.5,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 60},
    },
    .n_default = 10, .n_min = 1, .n_max = 1000,
    .configure = configure,
    .fill = fill,
};
