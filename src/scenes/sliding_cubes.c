/* Sliding cubes (Table I, Fig. 7): rafts of cubes accelerating down a slope.
 *
 * A bottom layer of cubes stands on the slope in a grid with gaps; the cubes of the layers above lie in the interstices
 * of the layer below, each on four cubes. A bottom cube makes 4 contacts with the slope and an upper one 4 with each of
 * the four below, so N cubes with a share u in the upper layers make (4 + 12 u) N contacts. Table I's contacts grow
 * faster than its bodies; u(N) = 0.07 + 0.16 ln(N / 100) reproduces them within 2.5 % from N = 100 to 2000.
 *
 * The slope is steeper than its friction angle and cubes grip one another better than the slope, so that a raft slides
 * as a whole and no contact is lost on the way. The grid is turned against the downhill direction: friction that is
 * not isotropic would bend the path.
 *
 * Doors beside the raft, which meet nothing, show what bodies with joints cost a scene that has few of them.
 */
#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "family.h"
#include "place.h"
#include "subadmm/joint.h"

static const double half = 0.05;       /* m */
static const double pitch = 0.11;      /* m: gaps of 10 mm, five times the speculative margin */
static const double slope = 0.4;       /* tan of the angle */
static const double cube_friction = 0.5;
static const double slope_friction = 0.3; /* of the pair cube and slope */
static const double turn = 0.5235987755982988; /* 30 degrees */

/* Above 2000 cubes u stays where Table I ends (10.6 contacts a body): larger scenes compare with its last row. */
static long upper_count(long n)
{
    double share = 0.07 + 0.16 * log((double)n / 100.0);
    double limit = 0.07 + 0.16 * log(20.0);
    return lround(fmax(0.0, fmin(share, limit)) * (double)n);
}

/* One layer: cubes (row, column) present in row-major order until the layer is full or the scene has no more. */
struct layer {
    long rows, columns;
    unsigned char *present;
};

static bool supported(const struct layer *below, long row, long column)
{
    const unsigned char *p = below->present + row * below->columns + column;
    return p[0] && p[1] && p[below->columns] && p[below->columns + 1];
}

/* Place cubes of layer `level` (0: on the slope) while *left > 0, counting it down. */
static sadmm_status fill_layer(sadmm_world *world, struct sadmm_frame base, const struct layer *below,
                               struct layer *layer, long level, long *left, struct sadmm_error *error)
{
    const struct sadmm_piece cube = { .half_extents = { half, half, half }, .mass = 1.0, .friction = cube_friction };

    memset(layer->present, 0, (size_t)(layer->rows * layer->columns));
    for (long row = 0; row < layer->rows; ++row) {
        for (long column = 0; column < layer->columns && *left > 0; ++column) {
            if (level > 0 && !supported(below, row, column)) continue;
            double x = pitch * ((double)column - 0.5 * (double)(layer->columns - 1));
            double y = pitch * ((double)row - 0.5 * (double)(layer->rows - 1));
            double z = half * (double)(2 * level + 1);
            sadmm_status status = sadmm_place_box(world, sadmm_frame_moved(base, x, y, z), &cube, NULL, error);
            if (status != SADMM_OK) return status;
            layer->present[row * layer->columns + column] = 1;
            --*left;
        }
    }
    return SADMM_OK;
}

/* Leaves of 20 kg, 1 x 2 m, uphill of the raft, that swing about axes normal to the slope. */
static sadmm_status add_doors(sadmm_world *world, struct sadmm_frame base, long count, struct sadmm_error *error)
{
    static const struct sadmm_piece leaf = {.half_extents = {0.02, 0.5, 1}, .mass = 20, .friction = cube_friction};
    sadmm_status status = SADMM_OK;
    for (long k = 0; k < count && status == SADMM_OK; ++k) {
        const struct sadmm_frame hinge = sadmm_frame_moved(base, -2 - 2 * (double)(k / 10), 2 * (double)(k % 10), 1.1),
                                 middle = sadmm_frame_moved(hinge, 0, 0.5, 0);
        sadmm_joint_def def = sadmm_joint_def_default();
        def.kind = SADMM_JOINT_REVOLUTE;
        def.body_a = (sadmm_body_id){0, 0}; /* the static world */
        status = sadmm_place_box(world, middle, &leaf, &def.body_b, error);
        if (status != SADMM_OK) return status;
        status = sadmm_world_place_joint(world, &def, hinge.origin, hinge.orientation);
        if (status == SADMM_OK) status = sadmm_world_add_joint(world, &def, NULL);
        status = sadmm_scene_world_error(world, status, error);
    }
    return status;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    struct sadmm_frame base = sadmm_frame_turned(sadmm_frame_world(), 1, atan(slope));
    long upper = upper_count(scene->n), bottom = scene->n - upper;
    long columns = (long)ceil(sqrt((double)bottom)), rows = (bottom + columns - 1) / columns;
    struct layer layers[2] = { { 0 } }; /* the one being filled and the one below */
    sadmm_status status;

    layers[0].present = sadmm_alloc((size_t)(rows * columns), 1);
    layers[1].present = sadmm_alloc((size_t)(rows * columns), 1);
    status = layers[0].present && layers[1].present ? SADMM_OK : sadmm_fail_memory(error, "the layers of the scene");
    if (status == SADMM_OK)
        status = sadmm_place_plane(world, base, slope_friction * slope_friction / cube_friction, error);
    if (status == SADMM_OK)
        status = add_doors(world, sadmm_frame_moved(base, -pitch * (double)columns, 0, 0), scene->m, error);
    base = sadmm_frame_turned(base, 2, turn);
    for (long level = 0; status == SADMM_OK && (level == 0 || upper > 0) && level < rows; ++level) {
        struct layer *layer = &layers[level % 2];
        layer->rows = rows - level;
        layer->columns = columns - level;
        status = fill_layer(world, base, &layers[(level + 1) % 2], layer, level, level == 0 ? &bottom : &upper, error);
    }
    sadmm_free(layers[0].present);
    sadmm_free(layers[1].present);
    return status;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_sliding_cubes = {
    .info = {
        .name = "sliding_cubes",
        .arguments = "[:N[:doors]]",
        .description = "N cubes of 1 kg in a layered raft that slides down a slope (N in [1, 1000000], default 2000); "
                       "doors beside it (in [0, 1000], default 0)",
        .duration = 5.0,
        .iterations = {[SADMM_METHOD_PAPER] = 120, [SADMM_METHOD_FAST] = 20},
    },
    .n_default = 2000, .n_min = 1, .n_max = 1000000, .m_max = 1000,
    .configure = configure,
    .fill = fill,
};
