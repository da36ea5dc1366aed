/* A dry-stone wall of N courses: stones with flat beds and nothing else that is regular, without mortar, in running
 * bond, both faces of the wall inclined by 1 in 12.
 *
 * Two stones meet at a joint plane of its own place and tilt, in plan and in elevation, and keep a gap of 6 mm there:
 * they carry nothing across. About half of a stone's eight corners are knocked off, each by a plane of its own, so that
 * beds rest on polygons of 4 to 8 corners. Every stone has a hull of its own. */
#include <math.h>

#include "built.h"
#include "family.h"
#include "noise.h"
#include "solid.h"

enum { LENGTHS = 8, PAIR = 2 * LENGTHS + 1 }; /* stones of an even course; of two courses: every other has one more */

static const double length = 0.3, height = 0.15, top = 0.3, gap = 0.006; /* m; top: the wall's thickness up there */
static const double batter = 1.0 / 12;
/* Of a joint, at most: m from its regular place, m more at the faces, and its tilt in elevation. The shortest edge that
 * they leave, of a half stone, is longer than two cuts. */
static const double shift = 0.03, skew = 0.03, tilt = 0.15;
static const double least_cut = 0.01, most_cut = 0.035; /* m, along an edge */
static const double density = 2500, friction = 0.7;     /* kg/m^3 */

struct place {
    long course, stone; /* from 0 */
    double from, to;    /* m, the middle of its joints */
};

static long stones_of(long courses)
{
    return PAIR * (courses / 2) + (courses % 2 ? LENGTHS : 0);
}

/* Joint k of a course, k = 0 being the wall's end: where it would be in a wall of bricks. */
static double regular_joint(long course, long k)
{
    if (course % 2 == 0 || k == 0) return length * (double)k;
    return k > LENGTHS ? length * LENGTHS : length * ((double)k - 0.5);
}

static struct place place_of(int32_t i)
{
    struct place p = {.course = 2 * (i / PAIR), .stone = i % PAIR};
    if (p.stone >= LENGTHS) ++p.course, p.stone -= LENGTHS;
    p.from = regular_joint(p.course, p.stone);
    p.to = regular_joint(p.course, p.stone + 1);
    return p;
}

/* How far joint k of a course is from its regular place at z (m) above the course's middle and a share y of the way to
 * the foot of a face, m: a plane. */
static double joint_off(long course, long k, double y, double z)
{
    const long last = course % 2 ? LENGTHS + 1 : LENGTHS, id = course * 64 + k;
    if (k == 0 || k == last) return 0;
    return shift * sadmm_noise(id, 0) + skew * sadmm_noise(id, 1) * y + tilt * sadmm_noise(id, 2) * z;
}

/* Half of the wall's thickness, this far below its top. */
static double half_thickness(double below)
{
    return 0.5 * top + batter * below;
}

/* Between its regular joints, half way up, in the middle of the wall. */
static struct sadmm_frame stone_at(const struct sadmm_scene *scene, int32_t i)
{
    const struct place p = place_of(i);
    (void)scene;
    return sadmm_frame_moved(sadmm_frame_world(), 0.5 * (p.from + p.to), 0, height * ((double)p.course + 0.5));
}

/* The stone before its corners are cut: corner bits are the far end, the far face and the upper bed. */
static void whole_stone(const struct place *p, long courses, double corners[8][3])
{
    const double middle = 0.5 * (p->from + p->to), foot = height * (double)(courses - p->course);
    for (int v = 0; v < 8; ++v) {
        const double z = (v & 4 ? 0.5 : -0.5) * height;
        const double y = (v & 2 ? 1 : -1) * half_thickness(foot - (v & 4 ? height : 0));
        const double off = joint_off(p->course, p->stone + (v & 1), y / half_thickness(foot), z);
        corners[v][0] = (v & 1 ? p->to : p->from) + off - middle + (v & 1 ? -0.5 : 0.5) * gap;
        corners[v][1] = y;
        corners[v][2] = z;
    }
}

/* Points on the three edges of corner v, instead of it. */
static int cut_corner(long i, int v, const double corners[8][3], double points[3][3])
{
    for (int edge = 0; edge < 3; ++edge) {
        const vec3 from = v3_load(corners[v]), way = v3_sub(v3_load(corners[v ^ 1 << edge]), from);
        const double share = 0.5 + 0.5 * sadmm_noise(i, 64 + 4 * (uint64_t)v + (uint64_t)edge);
        const double cut = least_cut + (most_cut - least_cut) * share;
        v3_store(v3_madd(from, cut / v3_norm(way), way), points[edge]);
        points[edge][2] = edge == 2 ? points[edge][2] : corners[v][2]; /* the beds are flat to the last bit */
    }
    return 3;
}

static sadmm_status make_stone(int32_t i, long courses, sadmm_hull **hull, struct sadmm_error *error)
{
    const struct place p = place_of(i);
    const long id = (1L << 20) + i;
    double corners[8][3], points[24][3];
    int count = 0;
    whole_stone(&p, courses, corners);
    for (int v = 0; v < 8; ++v) {
        if (sadmm_noise(id, (uint64_t)v) < 0) {
            count += cut_corner(id, v, corners, &points[count]);
        } else {
            v3_store(v3_load(corners[v]), points[count++]);
        }
    }
    return sadmm_scene_hull(points[0], count, hull, error);
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    sadmm_status status = sadmm_place_plane(world, sadmm_frame_world(), friction, error);
    for (int32_t i = 0; i < stones_of(scene->n) && status == SADMM_OK; ++i) {
        sadmm_hull *stone;
        status = make_stone(i, scene->n, &stone, error);
        if (status != SADMM_OK) return status;
        const sadmm_shape_def shape = sadmm_hull_shape(stone, friction);
        status = sadmm_place_solids(world, stone_at(scene, i), &shape, 1, density, "stone", NULL, error);
        sadmm_hull_destroy(stone);
    }
    return status;
}

static sadmm_status observe(const struct sadmm_scene *scene, sadmm_world *world, int64_t step,
                            struct sadmm_scene_result *result, struct sadmm_error *error)
{
    const struct sadmm_built wall = {
        1, (int32_t)stones_of(scene->n), -1, stone_at, .end = scene->info->duration, .most = 1e-3,
    };
    result->task_count = 1;
    return sadmm_observe_built(scene, world, step, &wall, &result->tasks[0], error);
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->settings.dt = 0.005;
    def->settings.penalty_period = 30;
}

const struct sadmm_scene_family sadmm_family_dry_stone = {
    .info = {
        .name = "dry_stone",
        .arguments = "[:N]",
        .description = "a dry-stone wall of N courses of irregular stones (N in [1, 40], default 8)",
        .duration = 10,
        .iterations = {[SADMM_METHOD_PAPER] = 100, [SADMM_METHOD_FAST] = 20},
    },
    .n_default = 8, .n_min = 1, .n_max = 40,
    .configure = configure,
    .fill = fill,
    .observe = observe,
};
