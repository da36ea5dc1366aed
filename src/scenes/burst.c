/* Contacts that grow more than tenfold from one step to the next: what makes buffers, partitions and islands change
 * all at once.
 *
 * A floor of N x N large cubes stands on the ground, 4 contacts each, no two touching. Above it one layer of
 * (4 N - 1) x (4 N - 1) small cubes falls, all at the same height and speed, not yet within reach of a contact. In the
 * second step all of them are: each makes 4 contacts with every large cube below it, one in the middle, two across a
 * gap, four across a crossing. Along an axis 4 N - 1 small cubes lie over 5 N - 2 large ones, so
 *
 *     step 1:  4 N^2
 *     step 2:  4 N^2 + 4 (5 N - 2)^2,  10 times as many for N = 1, 24 times for N = 10, 26 at most
 *
 * and the N x N islands of one cube become one of all.
 */
#include <math.h>

#include "family.h"
#include "place.h"

static const double half = 0.05;       /* m, small cubes */
static const double pitch = 0.11;      /* m, small cubes: gaps of 10 mm */
static const double floor_half = 0.21; /* m, large cubes: one every four small ones, gaps of 20 mm */
static const double speed = 0.5;       /* m/s, of the small cubes */
static const double small_mass = 0.1, floor_mass = 7.5; /* kg, of about the same density */

/* Between the layers at the start, m. A pair makes contacts within the margin and what closes in a step, speed x dt;
 * falling adds one or two g dt^2 to that (whether it is counted or not). The middle between no contact in the first
 * step and one in the second is half a step's way from both. */
static double start_gap(const sadmm_world_def *def)
{
    const double *g = def->settings.gravity;
    double dt = def->settings.dt, fall = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) * dt * dt;
    return def->contact_margin * 2 * half + 1.5 * speed * dt + 2 * fall;
}

/* x or y of the i-th of `count` cubes in a row, m. */
static double along(long i, long count, double apart)
{
    return apart * ((double)i - 0.5 * (double)(count - 1));
}

static sadmm_status place_floor(sadmm_world *world, long n, struct sadmm_error *error)
{
    const struct sadmm_piece cube = {
        .half_extents = {floor_half, floor_half, floor_half}, .mass = floor_mass, .friction = 0.5,
    };
    sadmm_status status = SADMM_OK;
    for (long i = 0; i < n * n && status == SADMM_OK; ++i) {
        struct sadmm_frame place = sadmm_frame_world();
        place = sadmm_frame_moved(place, along(i % n, n, 4 * pitch), along(i / n, n, 4 * pitch), floor_half);
        status = sadmm_place_box(world, place, &cube, NULL, error);
    }
    return status;
}

static sadmm_status place_layer(sadmm_world *world, long n, double bottom, struct sadmm_error *error)
{
    const struct sadmm_piece cube = {.half_extents = {half, half, half}, .mass = small_mass, .friction = 0.5};
    sadmm_status status = SADMM_OK;
    for (long i = 0; i < n * n && status == SADMM_OK; ++i) {
        struct sadmm_frame place = sadmm_frame_world();
        sadmm_body_id id;
        sadmm_body_state state;
        place = sadmm_frame_moved(place, along(i % n, n, pitch), along(i / n, n, pitch), bottom + half);
        status = sadmm_place_box(world, place, &cube, &id, error);
        if (status != SADMM_OK) break;
        status = sadmm_world_body_state(world, id, &state);
        state.linear_velocity[2] = -speed;
        if (status == SADMM_OK) status = sadmm_world_set_body_state(world, id, &state);
        status = sadmm_scene_world_error(world, status, error);
    }
    return status;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.5, error);
    if (status == SADMM_OK) status = place_floor(world, scene->n, error);
    if (status == SADMM_OK)
        status = place_layer(world, 4 * scene->n - 1, 2 * floor_half + start_gap(&scene->def), error);
    return status;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_burst = {
    .info = {
        .name = "burst",
        .arguments = "[:N]",
        .description = "a layer of cubes lands on N x N larger ones, all contacts in the same step "
                       "(N in [1, 250], default 10)",
        .duration = 1.0,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 30},
    },
    .n_default = 10, .n_min = 1, .n_max = 250,
    .configure = configure,
    .fill = fill,
};
