/* Mechanisms of joints: a chain with a weight, and closed loops of rods: four-bar linkages in a row, a slider-crank,
 * Bricard's linkage. Rods have shapes to look at, which meet nothing.
 *
 * The row of four-bar linkages and Bricard's are problems of the IFToMM benchmarks of multibody dynamics. The former
 * has more locks than it needs, and passes positions where it might part into two motions; the latter moves by virtue
 * of its dimensions alone: counted, its locks allow no motion. */
#include <math.h>
#include <string.h>

#include "family.h"
#include "place.h"
#include "subadmm/joint.h"

static const double thin = 0.02; /* m, half the thickness of a rod */
static const sadmm_body_id static_world = {0, 0};

/* A box of 2 half[k] along the world's axes that meets nothing. */
static sadmm_status add_box(sadmm_world *world, const double at[3], const double half[3], double mass,
                            const double velocity[6], sadmm_body_id *id, struct sadmm_error *error)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    body.mass = mass;
    sadmm_box_inertia(mass, half, body.inertia);
    memcpy(body.position, at, sizeof body.position);
    memcpy(body.linear_velocity, velocity, sizeof body.linear_velocity);
    memcpy(body.angular_velocity, velocity + 3, sizeof body.angular_velocity);
    shape.type = SADMM_SHAPE_BOX;
    shape.mask = 0;
    memcpy(shape.size, half, sizeof shape.size);
    sadmm_status status = sadmm_world_add_body(world, &body, id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, *id, &shape, NULL);
    return sadmm_scene_world_error(world, status, error);
}

/* A rod between two points on a line along one of the world's axes. */
static sadmm_status add_rod(sadmm_world *world, const double from[3], const double to[3], const double velocity[6],
                            sadmm_body_id *id, struct sadmm_error *error)
{
    double at[3], half[3];
    for (int k = 0; k < 3; ++k) {
        at[k] = (from[k] + to[k]) / 2;
        half[k] = fmax(fabs(to[k] - from[k]) / 2, thin);
    }
    return add_box(world, at, half, 1, velocity, id, error);
}

/* `axis`: of the world, that the joint's z is along. */
static sadmm_status join(sadmm_world *world, sadmm_joint_kind kind, sadmm_body_id a, sadmm_body_id b,
                         const double place[3], int axis, const sadmm_joint_coordinate *law, struct sadmm_error *error)
{
    static const double s = 0.70710678118654752440;
    const double turns[3][4] = {{s, 0, s, 0}, {s, -s, 0, 0}, {1, 0, 0, 0}}; /* z to x, to y, to z */
    sadmm_joint_def def = sadmm_joint_def_default();
    def.kind = kind;
    def.body_a = a;
    def.body_b = b;
    if (law) def.coordinates[5] = *law;
    sadmm_status status = sadmm_world_place_joint(world, &def, place, turns[axis]);
    if (status == SADMM_OK) status = sadmm_world_add_joint(world, &def, NULL);
    return sadmm_scene_world_error(world, status, error);
}

static const double at_rest[6] = {0};

/* ---- chain ------------------------------------------------------------------------------------------------------- */

/* Links of 0.2 m and 1 kg from the origin along x, ball joints and universal ones in turn, a block of M kg at the end.
 * Under its weight T = 3 M g at most links of mass m and length l vibrate at some 2 (T / m l)^1/2: what a step of 5 ms
 * resolves up to M = 200. */
static sadmm_status fill_chain(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    const double length = 0.2, block[3] = {0.1, 0.1, 0.1};
    sadmm_body_id last = static_world, body;
    sadmm_status status = SADMM_OK;
    for (long i = 0; i <= scene->n && status == SADMM_OK; ++i) {
        const double from[3] = {length * (double)i, 0, 0}, to[3] = {length * (double)(i + 1), 0, 0};
        const double end[3] = {from[0] + block[0], 0, 0};
        status = i < scene->n ? add_rod(world, from, to, at_rest, &body, error)
                              : add_box(world, end, block, (double)scene->m, at_rest, &body, error);
        if (status != SADMM_OK) break;
        status = join(world, i % 2 ? SADMM_JOINT_UNIVERSAL : SADMM_JOINT_SPHERICAL, last, body, from, 2, NULL, error);
        last = body;
    }
    return status;
}

const struct sadmm_scene_family sadmm_family_chain = {
    .info = {
        .name = "chain",
        .arguments = "[:links[:kg]]",
        .description = "a chain of ball and universal joints swings down with a block at its end (links in [1, 1000], "
                       "default 10; kg of the block, links have 1, in [1, 50000], default 10)",
        .duration = 3,
        .iterations = {[SADMM_METHOD_PAPER] = 300, [SADMM_METHOD_FAST] = 60},
        .chaotic = true,
    },
    .n_default = 10, .n_min = 1, .n_max = 1000,
    .m_default = 10, .m_min = 1, .m_max = 50000,
    .fill = fill_chain,
};

/* ---- four-bar linkages ------------------------------------------------------------------------------------------- */

/* N windows of 1 m: N + 1 rods stand on the ground, N lie on them; all move to the right at 1 m/s above. */
static sadmm_status fill_four_bar(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    static const double turns[6] = {0.5, 0, 0, 0, 1, 0}, slides[6] = {1, 0, 0, 0, 0, 0};
    sadmm_body_id left = static_world, right, top;
    sadmm_status status = SADMM_OK;
    for (long i = 0; i <= scene->n && status == SADMM_OK; ++i) {
        const double foot[3] = {(double)i, 0, 0}, head[3] = {(double)i, 0, 1}, before[3] = {(double)i - 1, 0, 1};
        status = add_rod(world, foot, head, turns, &right, error);
        if (status == SADMM_OK)
            status = join(world, SADMM_JOINT_REVOLUTE, static_world, right, foot, 1, NULL, error);
        if (status == SADMM_OK && i > 0) {
            status = add_rod(world, before, head, slides, &top, error);
            if (status == SADMM_OK) status = join(world, SADMM_JOINT_REVOLUTE, left, top, before, 1, NULL, error);
            if (status == SADMM_OK) status = join(world, SADMM_JOINT_REVOLUTE, top, right, head, 1, NULL, error);
        }
        left = right;
    }
    return status;
}

const struct sadmm_scene_family sadmm_family_four_bar = {
    .info = {
        .name = "four_bar",
        .arguments = "[:N]",
        .description = "N four-bar linkages in a row go round (N in [1, 1000], default 1)",
        .duration = 10,
        .iterations = {[SADMM_METHOD_PAPER] = 300, [SADMM_METHOD_FAST] = 60},
        .chaotic = true,
    },
    .n_default = 1, .n_min = 1, .n_max = 1000,
    .fill = fill_four_bar,
};

/* ---- slider-crank ------------------------------------------------------------------------------------------------ */

/* A crank of 0.5 m, driven at 5 rad/s, a rod of 1.5 m, a block of 2 kg that slides along x. */
static sadmm_status fill_slider_crank(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    static const double shaft[3] = {0, 0, 0}, pin[3] = {0.5, 0, 0}, wrist[3] = {2, 0, 0}, half[3] = {0.1, 0.1, 0.1};
    const sadmm_joint_coordinate drive = {.drive = SADMM_DRIVE_SPEED, .target_speed = 5, .drive_force = 200};
    sadmm_body_id crank, rod, block;
    (void)scene;
    sadmm_status status = add_rod(world, shaft, pin, at_rest, &crank, error);
    if (status == SADMM_OK) status = add_rod(world, pin, wrist, at_rest, &rod, error);
    if (status == SADMM_OK) status = add_box(world, wrist, half, 2, at_rest, &block, error);
    if (status == SADMM_OK) status = join(world, SADMM_JOINT_REVOLUTE, static_world, crank, shaft, 1, &drive, error);
    if (status == SADMM_OK) status = join(world, SADMM_JOINT_REVOLUTE, crank, rod, pin, 1, NULL, error);
    if (status == SADMM_OK) status = join(world, SADMM_JOINT_REVOLUTE, rod, block, wrist, 1, NULL, error);
    if (status == SADMM_OK) status = join(world, SADMM_JOINT_PRISMATIC, static_world, block, wrist, 0, NULL, error);
    return status;
}

const struct sadmm_scene_family sadmm_family_slider_crank = {
    .info = {
        .name = "slider_crank",
        .arguments = "",
        .description = "a driven crank moves a block to and fro",
        .duration = 5,
        .iterations = {[SADMM_METHOD_PAPER] = 300, [SADMM_METHOD_FAST] = 60},
    },
    .fill = fill_slider_crank,
};

/* ---- Bricard's linkage ------------------------------------------------------------------------------------------- */

/* Five rods, and the ground for the sixth, along edges of a cube of 1 m; each hinge's axis is across its two rods. */
static sadmm_status fill_bricard(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    static const double corners[6][3] = {{0, 0, 0}, {1, 0, 0}, {1, 0, -1}, {1, -1, -1}, {0, -1, -1}, {0, -1, 0}};
    static const int axes[6] = {2, 1, 0, 2, 1, 0};
    sadmm_body_id last = static_world, rod;
    sadmm_status status = SADMM_OK;
    (void)scene;
    for (int i = 0; i < 6 && status == SADMM_OK; ++i) {
        rod = static_world;
        if (i < 5) status = add_rod(world, corners[i], corners[i + 1], at_rest, &rod, error);
        if (status == SADMM_OK)
            status = join(world, SADMM_JOINT_REVOLUTE, last, rod, corners[i], axes[i], NULL, error);
        last = rod;
    }
    return status;
}

const struct sadmm_scene_family sadmm_family_bricard = {
    .info = {
        .name = "bricard",
        .arguments = "",
        .description = "Bricard's linkage of five rods and six hinges swings to and fro",
        .duration = 10,
        .iterations = {[SADMM_METHOD_PAPER] = 300, [SADMM_METHOD_FAST] = 60},
    },
    .fill = fill_bricard,
};
