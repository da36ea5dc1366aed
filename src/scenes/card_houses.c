/* Card houses (Table I, Sec. IV-B.3): 396 cards in six houses of 66, standing by friction alone.
 *
 * A house has two wings, triangular houses of five levels (40 cards) and of four (26): a wing of n levels has
 * n (n + 1) leaning cards and n (n - 1) / 2 lying ones. The cards of a pair lean on each other by an edge; a lying card
 * spans two neighbouring apexes and carries the feet of the pair above right over them, so that every load goes down
 * along the cards. In the plane of a wing (x right, z up), one cell:
 *
 *            /\
 *       ____/  \____        foot of the next level, at `base` from the middle of the lying card
 *        /\      /\
 *       /  \    /  \
 *
 * The lying cards are turned by a right angle (their short side spans), which makes the cards lean by asin(0.288) = 17
 * degrees only; a leg then needs friction tan(17 deg) = 0.30, half of what there is. All joints start with small gaps
 * that close in the first steps.
 *
 * Contacts: with a margin of 0.3 card thicknesses both edges of a card's end (0.29 mm apart in height) count, so every
 * foot and every head under a lying card has 4 points, an apex 2, and two lying cards end to end 4:
 * 6 x (50 x 4 + 32 x 4 + 25 x 2 + 9 x 4) = 2484 (Table I: 2551). Houses are turned by different angles, so that
 * nothing rests on alignment with the world's axes.
 */
#include <math.h>

#include "family.h"
#include "place.h"

static const double length = 0.1, width = 0.06, thickness = 0.001; /* m */
static const double mass = 0.002;       /* kg */
static const double friction = 0.6;
static const double gap = 5e-5;         /* m, at every joint at the start */
static const double base = 0.0288;      /* m, from the foot of a leaning card to below its head */
static const double end_gap = 2.5e-4;    /* m, between neighbouring lying cards */
static const double house_spacing = 1.0;    /* m */
static const double quarter = 1.5707963267948966;

/* The two leaning cards of one pair, with the apex above the frame's origin and the ground at its height. */
static sadmm_status fill_pair(sadmm_world *world, struct sadmm_frame frame, struct sadmm_error *error)
{
    const struct sadmm_piece card = {
        .half_extents = { 0.5 * thickness, 0.5 * width, 0.5 * length }, .mass = mass, .friction = friction
    };
    const double angle = asin(base / length), s = base / length, c = cos(angle);
    sadmm_status status = SADMM_OK;

    for (int side = -1; side <= 1 && status == SADMM_OK; side += 2) {
        /* The inner bottom edge is the lowest; from it half a length up and half a thickness outwards is the centre. */
        double x = 0.5 * gap + base - 0.5 * length * s + 0.5 * thickness * c;
        double z = gap + 0.5 * length * c + 0.5 * thickness * s;
        struct sadmm_frame place = sadmm_frame_moved(frame, side * x, 0, z);
        status = sadmm_place_box(world, sadmm_frame_turned(place, 1, -side * angle), &card, NULL, error);
    }
    return status;
}

static sadmm_status fill_wing(sadmm_world *world, struct sadmm_frame frame, int levels, struct sadmm_error *error)
{
    const struct sadmm_piece lying = {
        .half_extents = { 0.5 * width, 0.5 * length, 0.5 * thickness }, .mass = mass, .friction = friction
    };
    const double s = base / length, c = sqrt(1 - s * s), pitch = width + end_gap;
    const double head = gap + length * c + thickness * s; /* of a pair, above its ground */
    const double level_height = head + gap + thickness;
    sadmm_status status = SADMM_OK;

    for (int level = 0; level < levels; ++level) {
        int pairs = levels - level;
        for (int i = 0; i < pairs && status == SADMM_OK; ++i) {
            double x = pitch * (i - 0.5 * (pairs - 1));
            struct sadmm_frame foot = sadmm_frame_moved(frame, x, 0, level * level_height);
            struct sadmm_frame roof = sadmm_frame_moved(foot, 0.5 * pitch, 0, head + gap + 0.5 * thickness);
            status = fill_pair(world, foot, error);
            if (status == SADMM_OK && i + 1 < pairs) status = sadmm_place_box(world, roof, &lying, NULL, error);
        }
    }
    return status;
}

static sadmm_status fill(const struct sadmm_scene *scene, sadmm_world *world, struct sadmm_error *error)
{
    struct sadmm_frame origin = sadmm_frame_world();
    sadmm_status status = sadmm_place_plane(world, origin, friction, error);

    for (long i = 0; i < scene->n && status == SADMM_OK; ++i) {
        double x = house_spacing * (double)(i % 3), y = house_spacing * (double)(i / 3);
        struct sadmm_frame house = sadmm_frame_moved(origin, x, y, 0);
        house = sadmm_frame_turned(house, 2, quarter / 6 * (double)(i % 6));
        status = fill_wing(world, house, 5, error);
        if (status == SADMM_OK) /* the second wing stands across, clear of the first */
            status = fill_wing(world, sadmm_frame_turned(sadmm_frame_moved(house, 0.3, 0, 0), 2, quarter), 4, error);
    }
    return status;
}

static void configure(long n, sadmm_world_def *def)
{
    (void)n;
    def->contact_margin = 0.3;
    def->settings.dt = 0.001;
    def->settings.penalty_period = 100;
}

const struct sadmm_scene_family sadmm_family_card_houses = {
    .info = {
        .name = "card_houses",
        .arguments = "[:N]",
        .description = "N card houses of 66 cards (N in [1, 10000], default 6)",
        .duration = 10.0,
        .iterations = {[SADMM_METHOD_PAPER] = 300, [SADMM_METHOD_FAST] = 20},
    },
    .n_default = 6, .n_min = 1, .n_max = 10000,
    .configure = configure,
    .fill = fill,
};
