/* Heaps: N boxes in all orientations fall from a loose grid. Contacts come and go, islands merge, no two contacts are
 * alike. Orientations, sizes and offsets come from an integer hash of the index, the same on every machine.
 *
 * pile: boxes of 1 kg on a level ground. mixed_pile: masses from 30 g to 30 kg, uniform in the logarithm, so that light
 * bodies carry heavy ones somewhere. sliding_pile: on a slope steeper than the friction angle, so that the heap slides
 * for good and its contacts change all the time.
 */
#include <math.h>

#include "family.h"
#include "noise.h"
#include "place.h"

static const double spacing = 0.2; /* m: more than the diagonal of either box */

static const double slope = 0.4, slope_friction = 0.3; /* tan and mu: g (sin - mu cos) = 0.91 m/s^2 downhill */

enum kind { PLAIN, MIXED, SLIDING };

static sadmm_status fill_kind(const struct sadmm_scene *scene, sadmm_world *world, enum kind kind,
                              struct sadmm_error *error)
{
    static const struct sadmm_piece pieces[2] = {
        { .half_extents = { 0.05, 0.05, 0.05 }, .mass = 1.0, .friction = 0.5 },
        { .half_extents = { 0.08, 0.04, 0.04 }, .mass = 1.0, .friction = 0.5 },
    };
    struct sadmm_frame ground = sadmm_frame_world();
    if (kind == SLIDING) ground = sadmm_frame_turned(ground, 1, atan(slope)); /* about y: x goes downhill */
    /* A pair takes the geometric mean of its two: what makes mu = slope_friction with boxes of 0.5. */
    double ground_friction = kind == SLIDING ? slope_friction * slope_friction / 0.5 : 0.5;
    sadmm_status status = sadmm_place_plane(world, ground, ground_friction, error);
    /* A column about twice as high as wide: it spreads into a heap. */
    long side = (long)fmax(1.0, round(cbrt((double)scene->n / 2.0)));

    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        long column = i % side, row = i / side % side, layer = i / (side * side);
        double x = spacing * ((double)column - 0.5 * (double)(side - 1));
        double y = spacing * ((double)row - 0.5 * (double)(side - 1));
        struct sadmm_frame place = sadmm_frame_moved(ground, x, y, spacing * ((double)layer + 0.6));
        struct sadmm_piece piece = pieces[i % 2];
        q_store(sadmm_noise_orientation(i), place.orientation);
        if (kind == MIXED) piece.mass = pow(10, 1.5 * sadmm_noise(i, 4095));
        status = sadmm_place_box(world, place, &piece, NULL, error);
    }
    return status;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    return fill_kind(scene, world, PLAIN, error);
}

static sadmm_status fill_mixed(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    return fill_kind(scene, world, MIXED, error);
}

static sadmm_status fill_sliding(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    return fill_kind(scene, world, SLIDING, error);
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_pile = {
    .info = {
        .name = "pile",
        .arguments = "[:N]",
        .description = "N boxes falling into a heap (N in [1, 1000000], default 1000)",
        .duration = 3.0,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 40},
        .substeps = 2,
        .chaotic = true,
    },
    .n_default = 1000, .n_min = 1, .n_max = 1000000,
    .configure = configure,
    .fill = fill,
};

const struct sadmm_scene_family sadmm_family_mixed_pile = {
    .info = {
        .name = "mixed_pile",
        .arguments = "[:N]",
        .description = "N boxes of 30 g to 30 kg falling into a heap (N in [1, 1000000], default 300)",
        .duration = 3.0,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 51},
        .substeps = 3,
        .chaotic = true,
    },
    .n_default = 300, .n_min = 1, .n_max = 1000000,
    .configure = configure,
    .fill = fill_mixed,
};

const struct sadmm_scene_family sadmm_family_sliding_pile = {
    .info = {
        .name = "sliding_pile",
        .arguments = "[:N]",
        .description = "N boxes falling onto a slope that their heap slides down (N in [1, 1000000], default 300)",
        .duration = 3.0,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 40},
        .substeps = 2,
        .chaotic = true,
    },
    .n_default = 300, .n_min = 1, .n_max = 1000000,
    .configure = configure,
    .fill = fill_sliding,
};
