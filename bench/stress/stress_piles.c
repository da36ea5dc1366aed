/* Structures of many bodies that must stand, and bodies that start inside of others. */
#include <stdlib.h>
#include <string.h>

#include "stress.h"

/* ---- initial overlaps ------------------------------------------------------------------------------------------- */

/* A cube of 0.1 m that starts sunk by a share of its height into the ground, into a cube beside it, or into one that it
 * stands on: it is moved out, slower from step to step, and never rises above where it belongs. */
enum { IN_GROUND, IN_CUBE_ABOVE, WELDED };
static const char *const sunk[] = {"in the ground", "in a cube below", "two welded ones"};

static void overlaps(struct stress *s)
{
    const double edge = 0.1, depth = s->value * edge, seconds = stress_seconds(s, 2, 20);
    struct stress_body box = {.shape = SADMM_SHAPE_BOX,
                              .size = {edge / 2, edge / 2, edge / 2},
                              .mass = 1,
                              .friction = 0.5,
                              .position = {0, 0, edge / 2 - depth}};
    double rest = edge / 2;
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.5, 0);
    if (s->variant == IN_CUBE_ABOVE) {
        box.position[2] = edge / 2;
        stress_add(s, &box);
        rest += edge;
        box.position[2] = rest - depth;
    }
    const sadmm_body_id cube = stress_add(s, &box);
    if (s->variant == WELDED) {
        sadmm_joint_def weld = sadmm_joint_def_default();
        weld.body_a = cube;
        box.position[0] = edge;
        weld.body_b = stress_add(s, &box);
        stress_join(s, &weld, edge / 2, 0, box.position[2], NULL);
    }
    while (s->time < seconds && stress_step(s)) {
        const sadmm_body_state state = stress_state(s, cube);
        const double speed = s->def.settings.correction_speed;
        stress_check(s, "speed, m/s", stress_norm(state.linear_velocity), speed * (1 + 1e-6));
        /* with joints the velocity stays (docs/guide/limits.md) */
        stress_check(s, "rise over rest, m", state.position[2] - rest,
                     1e-4 + (s->variant == WELDED ? speed * speed / (2 * STRESS_G) : 0));
    }
    stress_check(s, "sunk at the end, m", rest - stress_state(s, cube).position[2], 1e-3);
}

/* ---- card house ------------------------------------------------------------------------------------------------- */

static const double card[3] = {0.0005, 0.03, 0.05}; /* half extents, m: leaning, x is thin */

static void add_card(struct stress *s, double x, double z, double angle)
{
    struct stress_body body = {.shape = SADMM_SHAPE_BOX,
                               .size = {card[0], card[1], card[2]},
                               .mass = 0.002,
                               .position = {x, 0, z},
                               .friction = 0.6};
    stress_turn(1, angle, body.orientation);
    stress_add(s, &body);
}

/* Cards of 1 mm: pairs that lean on each other by an edge, lying ones over neighbouring pairs. A lying card is turned,
 * so that its short side spans and carries the feet above it right over the heads below. */
static void build_house(struct stress *s, int levels)
{
    const double base = 0.0288, play = 5e-5, length = 2 * card[2], thick = 2 * card[0], pitch = 2 * card[1] + 2.5e-4,
                 sine = base / length, cosine = sqrt(1 - sine * sine), head = play + length * cosine + thick * sine,
                 height = head + play + thick;
    for (int level = 0; level < levels; ++level)
        for (int i = 0; i < levels - level; ++i) {
            const double x = pitch * (i - 0.5 * (levels - level - 1)), z = level * height,
                         side = 0.5 * play + base - 0.5 * length * sine + 0.5 * thick * cosine;
            for (int k = -1; k <= 1; k += 2)
                add_card(s, x + k * side, z + play + 0.5 * length * cosine + 0.5 * thick * sine, -k * asin(sine));
            if (i + 1 == levels - level) continue;
            struct stress_body lying = {.shape = SADMM_SHAPE_BOX,
                                        .size = {card[1], card[2], card[0]},
                                        .mass = 0.002,
                                        .position = {x + 0.5 * pitch, 0, z + head + play + 0.5 * thick},
                                        .friction = 0.6};
            stress_add(s, &lying);
        }
}

/* Where all bodies are; NULL when out of memory. */
static double (*positions(struct stress *s, int32_t *count))[3]
{
    *count = stress_ok(s) ? sadmm_world_body_count(s->world) : 0;
    double(*at)[3] = calloc((size_t)*count + 1, sizeof *at);
    if (!at) stress_fail(s, "out of memory");
    for (int32_t i = 0; i < *count && at; ++i) {
        sadmm_body_id id;
        if (sadmm_world_body_at(s->world, i, &id) != SADMM_OK) continue;
        memcpy(at[i], stress_state(s, id).position, sizeof *at);
    }
    return at;
}

/* Steps for so long; no body may be further from its start at the end, or deeper in another one, than that. */
static void stand_for(struct stress *s, double seconds, double way, double overlap)
{
    int32_t count;
    double(*start)[3] = positions(s, &count), worst = 0;
    while (s->time < seconds && stress_step(s)) {}
    double(*end)[3] = positions(s, &count);
    for (int32_t i = 0; i < count && start && end; ++i) worst = fmax(worst, stress_distance(start[i], end[i]));
    stress_check(s, "way, m", worst, way);
    stress_check(s, "overlap, m", s->overlap, overlap);
    free(start);
    free(end);
}

/* Each level has three layers of joints, whose play of 0.05 mm closes; a card that leans by 17 degrees comes down by 1
 * / sin of that as much as its ends give way. A card that slips or a house that folds moves by centimetres. */
static void card_house(struct stress *s)
{
    const int levels = (int)s->value;
    s->def.contact_margin = 0.3; /* both edges of a card's end, 0.29 mm apart in height, are contacts */
    s->def.settings.dt = 0.001;
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.6, 0);
    build_house(s, levels);
    stand_for(s, stress_seconds(s, 0.2, 2), levels * 3 * (5e-5 + s->def.settings.slop) / 0.288, 1e-4);
}

/* ---- pyramid ---------------------------------------------------------------------------------------------------- */

static void pyramid(struct stress *s)
{
    const int rows = (int)s->value;
    const double edge = 0.1, slop = s->def.settings.slop;
    s->def.settings.dt = 1.0 / 60;
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.5, 0);
    for (int row = 0; row < rows; ++row)
        for (int k = 0; k < rows - row; ++k) {
            const struct stress_body box = {
                .shape = SADMM_SHAPE_BOX,
                .size = {edge / 2, edge / 2, edge / 2},
                .mass = 1,
                .friction = 0.5,
                .position = {1.05 * edge * (k - 0.5 * (rows - row - 1)), 0, edge * (row + 0.5)}};
            stress_add(s, &box);
        }
    stand_for(s, stress_seconds(s, 0.5, 5), (rows + 1) * slop, 2 * slop);
}

static const struct stress_case cases[] = {
    {.name = "overlaps",
     .about = "a cube starts inside of something: it comes out and does not hop",
     .parameter = "share of its height",
     .values = {0.01, 0.1, 0.3, 0.49},
     .value_count = 4,
     .quick = 0x6,
     .variants = sunk,
     .variant_count = 3,
     .run = overlaps},
    {.name = "card_house",
     .about = "a house of cards stands by friction",
     .parameter = "levels",
     .values = {3, 10, 20},
     .value_count = 3,
     .quick = 0x1,
     .run = card_house},
    {.name = "pyramid",
     .about = "a flat pyramid of cubes stands, each within the slop of every row",
     .parameter = "rows",
     .values = {10, 30, 100},
     .value_count = 3,
     .quick = 0x1,
     .run = pyramid},
};
const struct stress_group stress_piles = {cases, sizeof cases / sizeof *cases};
