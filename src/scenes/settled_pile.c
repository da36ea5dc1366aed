/* A large heap at rest: N cubes in staggered layers, up to ten of them, the layers below full.
 *
 * A cube of the lowest layer makes 4 contacts with the ground. Of the upper layers two in three are shifted by half a
 * pitch along one axis, so that their cubes lie on two each (8 contacts), and every third along both, on four (16).
 * Ten layers of the same size would make 10 contacts a cube; each is a row or a column smaller than the one below, and
 * from ten thousand cubes on there are 9 to 10. All of them are one island. Nothing leans: the heap stands by the
 * normal impulses alone, from the first step on.
 */
#include <math.h>

#include "family.h"
#include "place.h"

enum { MAX_LAYERS = 10 };
static const double half = 0.05;  /* m */
static const double pitch = 0.11; /* m: gaps of 10 mm, five times the speculative margin */

/* Along which axes is a layer shifted against the one below? */
static bool shifted_along_x(long layer) { return layer % 3 != 2; }
static bool shifted_along_y(long layer) { return layer % 3 != 1; }

struct layer {
    long columns, rows;
    double x, y, z; /* of the first cube, m */
};

static struct layer lowest(long columns, long rows)
{
    return (struct layer){
        columns, rows, -0.5 * pitch * (double)(columns - 1), -0.5 * pitch * (double)(rows - 1), half,
    };
}

static struct layer next_layer(struct layer below, long number)
{
    if (shifted_along_x(number)) --below.columns, below.x += 0.5 * pitch;
    if (shifted_along_y(number)) --below.rows, below.y += 0.5 * pitch;
    below.z += 2 * half;
    return below;
}

static long capacity(long columns, long rows, long layers)
{
    struct layer layer = lowest(columns, rows);
    long cubes = 0;
    for (long k = 0; k < layers && layer.columns > 0 && layer.rows > 0; layer = next_layer(layer, ++k))
        cubes += layer.columns * layer.rows;
    return cubes;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const struct sadmm_piece cube = {.half_extents = {half, half, half}, .mass = 1.0, .friction = 0.5};
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), 0.5, error);
    /* Small heaps are about half as high as wide. */
    long layers = (long)fmax(1, fmin(MAX_LAYERS, round(cbrt((double)scene->n / 4)))), columns = 1, rows = 1;
    while (capacity(columns, rows, layers) < scene->n) *(columns > rows ? &rows : &columns) += 1;

    struct layer layer = lowest(columns, rows);
    for (long left = scene->n, number = 0; left > 0 && status == SADMM_OK; layer = next_layer(layer, ++number)) {
        for (long i = 0; i < layer.columns * layer.rows && left > 0 && status == SADMM_OK; ++i, --left) {
            double x = layer.x + pitch * (double)(i % layer.columns), y = layer.y + pitch * (double)(i / layer.columns);
            status = sadmm_place_box(world, sadmm_frame_moved(sadmm_frame_world(), x, y, layer.z), &cube, NULL, error);
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

const struct sadmm_scene_family sadmm_family_settled_pile = {
    .info = {
        .name = "settled_pile",
        .arguments = "[:N]",
        .description = "N cubes of 1 kg at rest in up to ten staggered layers (N in [1, 1000000], default 10000)",
        .duration = 2.0,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 20},
    },
    .n_default = 10000, .n_min = 1, .n_max = 1000000,
    .configure = configure,
    .fill = fill,
};
