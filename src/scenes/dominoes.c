/* N dominoes in a row. The first is pushed over the lower edge that it turns about: from then on one knocks over the
 * next, and the first ones come to lie while the last still stand.
 */
#include "family.h"
#include "place.h"

static const double half[3] = {0.01, 0.025, 0.05}; /* m */
static const double pitch = 0.05;                  /* m: gaps of 30 mm */
static const double push = 5;                      /* rad/s, of the first; 2.4 would tip it */

static sadmm_status push_over(sadmm_world *world, sadmm_body_id id, struct sadmm_error *error)
{
    sadmm_body_state state;
    sadmm_status status = sadmm_world_body_state(world, id, &state);
    /* About the edge at (half[0], -half[2]) from the centre. */
    state.angular_velocity[1] = push;
    state.linear_velocity[0] = push * half[2];
    state.linear_velocity[2] = push * half[0];
    if (status == SADMM_OK) status = sadmm_world_set_body_state(world, id, &state);
    return sadmm_scene_world_error(world, status, error);
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece domino = {
        .half_extents = {half[0], half[1], half[2]}, .mass = 0.05, .friction = 0.4,
    };
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.4, error);
    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        struct sadmm_frame place = sadmm_frame_moved(sadmm_frame_world(), pitch * (double)i, 0, half[2]);
        sadmm_body_id id;
        status = sadmm_place_box(world, place, &domino, &id, error);
        if (status == SADMM_OK && i == 0) status = push_over(world, id, error);
    }
    return status;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_dominoes = {
    .info = {
        .name = "dominoes",
        .arguments = "[:N]",
        .description = "N dominoes in a row, of which the first is pushed over (N in [1, 100000], default 50)",
        .duration = 3.0,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 40},
    },
    .n_default = 50, .n_min = 1, .n_max = 100000,
    .configure = configure,
    .fill = fill,
};
