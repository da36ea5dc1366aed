/* A tower of 102 planks, as in the tower test of SimBenchmark (github.com/leggedrobotics/SimBenchmark): six floors of
 * eight planks across and nine along them, which lie on the ones below by 25 mm at each end. All have 10 kg. The test
 * asks how many steps of 10 ms it stands, of 60,000: solvers that leave errors let it creep apart. It gives no
 * friction; here mu = 0.8. */
#include "built.h"
#include "family.h"

enum { FLOORS = 6, ACROSS = 8, RIGHT = 4, LEFT = 5, FLOOR = ACROSS + RIGHT + LEFT, PLANKS = FLOORS * FLOOR };

static const double across[3] = {0.025, 0.125, 0.05}, along[3] = {0.1, 0.025, 0.05}; /* half extents, m */
static const double pitch = 0.2; /* m, of planks across */

static bool lies_across(int32_t i)
{
    return i % FLOOR < ACROSS;
}

/* On a floor: those across, then those along on the right, then on the left. */
static struct sadmm_frame plank_at(const struct sadmm_scene *scene, int32_t i)
{
    (void)scene;
    const int32_t k = i % FLOOR;
    const double bottom = 4 * across[2] * (double)(i / FLOOR);
    double x = pitch * k, y = 0;
    if (k >= ACROSS + RIGHT) {
        const double left[LEFT] = {0, 1, 3, 5, 6}; /* bridges between planks across */
        x = pitch * (left[k - ACROSS - RIGHT] + 0.5);
        y = 0.1;
    } else if (k >= ACROSS) {
        x = pitch * (2 * (k - ACROSS) + 0.5);
        y = -0.1;
    }
    return sadmm_frame_moved(sadmm_frame_world(), x, y, bottom + (lies_across(i) ? 1 : 3) * across[2]);
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece pieces[] = {
        {.half_extents = {along[0], along[1], along[2]}, .mass = 10, .friction = 0.8},
        {.half_extents = {across[0], across[1], across[2]}, .mass = 10, .friction = 0.8},
    };
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.8, error);
    for (int32_t i = 0; i < PLANKS && status == SADMM_OK; ++i)
        status = sadmm_place_box(world, plank_at(scene, i), &pieces[lies_across(i)], NULL, error);
    return status;
}

static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const struct sadmm_built tower = {1, PLANKS, -1, plank_at, .end = scene->info->duration, .most = 1e-3};
    result->task_count = 1;
    return sadmm_observe_built(scene, world, step, &tower, &result->tasks[0], error);
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.01;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_kapla_tower = {
    .info = {
        .name = "kapla_tower",
        .arguments = "",
        .description = "102 planks in six floors, SimBenchmark's tower test: stands for 60,000 steps",
        .duration = 600,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 20},
    },
    .configure = configure,
    .fill = fill,
    .observe = observe,
};
