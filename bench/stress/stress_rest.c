/* What rests must stay where it is: extreme masses, sizes and steps, many contacts more than needed. */
#include "stress.h"

enum { PILLAR = 16 };

/* Boxes, one on the other, on the ground. */
struct pillar {
    sadmm_body_id ids[PILLAR];
    double starts[PILLAR][3], top;
    int count;
};

static void pile_up(struct stress *s, struct pillar *p, double edge, double mass)
{
    const struct stress_body box = {.shape = SADMM_SHAPE_BOX,
                                    .size = {edge / 2, edge / 2, edge / 2},
                                    .mass = mass,
                                    .position = {0, 0, p->top + edge / 2},
                                    .friction = 0.5};
    for (int k = 0; k < 3; ++k) p->starts[p->count][k] = box.position[k];
    p->top += edge;
    p->ids[p->count++] = stress_add(s, &box);
}

/* Faces touch at the start, so a box may come down by the slop of each layer below it, and move by what errors of the
 * tolerance add up to. Bodies that are hardly larger than that may not by a share of their size: `play`, m. */
static void stand(struct stress *s, const struct pillar *p, double seconds, double play)
{
    const double slop = s->def.settings.slop, creep = s->def.settings.tolerance * seconds;
    const double speed = stress_by(s, 10, 100) * s->def.settings.tolerance;
    while (s->time < seconds && stress_step(s)) {
        for (int k = 0; k < p->count; ++k)
            stress_check(s, "way, m", stress_distance(stress_state(s, p->ids[k]).position, p->starts[k]),
                         (p->count + 1) * slop + creep + play);
        stress_check(s, "overlap, m", s->overlap, 2 * slop + play);
    }
    stress_check(s, "last speed, m/s", stress_sum(s).fastest, speed);
}

/* A cube of 1 kg carries one of so many. */
static void heavy_on_light(struct stress *s)
{
    struct pillar p = {.count = 0};
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.5, 0);
    pile_up(s, &p, 0.1, 1);
    pile_up(s, &p, 0.1, s->value);
    stand(s, &p, stress_seconds(s, 1, 10), 0);
}

/* Eight cubes, masses in a geometric row, the heaviest on top. */
static void tower(struct stress *s)
{
    struct pillar p = {.count = 0};
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.5, 0);
    for (int k = 0; k < 8; ++k) pile_up(s, &p, 0.1, pow(s->value, k / 7.0));
    stand(s, &p, stress_seconds(s, 1, 10), 0);
}

/* A cube of 1 m carries one of so many metres, of the same density: a small one, or one whose edges are far out. */
static void other_size(struct stress *s)
{
    struct pillar p = {.count = 0};
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.5, 0);
    pile_up(s, &p, 1, 100);
    pile_up(s, &p, s->value, 100 * pow(s->value, 3));
    stand(s, &p, stress_seconds(s, 1, 10), 0);
}

static void three_cubes(struct stress *s)
{
    struct pillar p = {.count = 0};
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.5, 0);
    for (int k = 0; k < 3; ++k) pile_up(s, &p, s->value, 1000 * pow(s->value, 3));
    stand(s, &p, stress_seconds(s, 1, 10), 0.01 * s->value);
}

static void any_step(struct stress *s)
{
    struct pillar p = {.count = 0};
    s->def.settings.dt = s->value;
    stress_open(s, STRESS_G);
    stress_add_plane(s, NULL, 0.5, 0);
    for (int k = 0; k < 3; ++k) pile_up(s, &p, 0.1, 1);
    stand(s, &p, fmax(20 * s->value, stress_seconds(s, 0.02, 1)), 0);
}

/* A plate of 1 kg on so many contacts, four on each of the blocks under it: forces are not unique, motion is. */
static void redundant(struct stress *s)
{
    const int side = (int)lround(sqrt(s->value / 4));
    const double pitch = 0.1, half = side * pitch / 2, seconds = stress_seconds(s, 0.1, 2);
    struct stress_body plate = {
        .shape = SADMM_SHAPE_BOX, .size = {half, half, 0.01}, .mass = 1, .position = {0, 0, 0.01}, .friction = 0.5};
    stress_open(s, STRESS_G);
    for (int k = 0; k < side * side; ++k) {
        const struct stress_body block = {
            .shape = SADMM_SHAPE_BOX,
            .size = {0.02, 0.02, 0.02},
            .friction = 0.5,
            .position = {pitch * (k % side + 0.5) - half, pitch * (k / side + 0.5) - half, -0.02}};
        stress_add(s, &block);
    }
    struct pillar p = {.ids = {stress_add(s, &plate)}, .starts = {{0, 0, 0.01}}, .count = 1};
    stand(s, &p, seconds, 0);
    double wrench[6] = {0};
    if (stress_ok(s)) {
        sadmm_world_body_contact_wrench(s->world, p.ids[0], wrench);
        stress_check(s, "missing contacts", fabs(sadmm_world_contact_count(s->world) - s->value), 0);
    }
    stress_check(s, "weight, share", fabs(wrench[2] / STRESS_G - 1), stress_by(s, 1e-3, 1e-2));
}

static const struct stress_case cases[] = {
    {.name = "heavy_on_light",
     .about = "a cube of 1 kg carries a heavier one: neither moves",
     .parameter = "mass ratio",
     .values = {1, 1e2, 1e4, 1e5, 1e6, 1e7, 1e8},
     .value_count = 7,
     .quick = 0x55,
     .run = heavy_on_light},
    {.name = "tower",
     .about = "eight cubes, heavier from one to the next: none moves",
     .parameter = "mass ratio of all",
     .values = {1, 1e2, 1e4, 1e6, 1e8},
     .value_count = 5,
     .quick = 0x15,
     .run = tower},
    {.name = "size_ratio",
     .about = "a cube of 1 m carries a smaller or larger one: neither moves",
     .parameter = "size ratio",
     .values = {1e-3, 1e-2, 0.1, 1, 10, 100, 1000},
     .value_count = 7,
     .quick = 0x49,
     .run = other_size},
    {.name = "size",
     .about = "three cubes on each other: none moves",
     .parameter = "edge, m",
     .values = {5e-4, 5e-3, 0.05, 0.5, 5, 50, 100},
     .value_count = 7,
     .quick = 0x49,
     .run = three_cubes},
    {.name = "step_at_rest",
     .about = "three cubes on each other, steps short and long: none moves",
     .parameter = "dt, s",
     .values = {1e-5, 1e-4, 1e-3, 5e-3, 1.0 / 60, 0.05, 0.1},
     .value_count = 7,
     .quick = 0x5a,
     .run = any_step},
    {.name = "redundant",
     .about = "a plate on many contacts more than needed: it stays, they carry its weight",
     .parameter = "contacts",
     .values = {16, 100, 400, 1024},
     .value_count = 4,
     .quick = 0x9,
     .run = redundant,
     .limits = {{.check = "way, m",
                 .from = 1024,
                 .to = 1024,
                 .precisions = STRESS_BOTH,
                 .bound = 1e-3,
                 .reason = "200 iterations leave the first steps unsolved; with 1,000 it does not move"}}},
};
const struct stress_group stress_rest = {cases, sizeof cases / sizeof *cases};
