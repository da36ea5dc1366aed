/* Other cases once more, far from the origin: poses are in double, so the same must hold by the same bounds. */
#include <string.h>

#include "stress.h"

static const char *const names[] = {"heavy_on_light", "slope",     "headings",   "grip",      "chain_hangs",
                                    "two_balls",      "free_spin", "thin_plate", "thin_mesh", "rolling"};
static const struct {
    double value;
    int variant;
} at[] = {{100, 0}, {0.5, 1}, {0.5, 0}, {10, 0}, {5e4, 0}, {100, 0}, {1e3, 0}, {100, 2}, {100, 2}, {1, 0}};

static void far(struct stress *s)
{
    const double away = s->value;
    const int which = s->variant;
    const struct stress_case *other = NULL;
    for (size_t k = 0; (other = stress_case_at(k)) != NULL && strcmp(other->name, names[which]); ++k) {}
    if (!other) {
        stress_fail(s, "no case %s", names[which]);
        return;
    }
    s->origin[0] = away, s->origin[1] = -0.7 * away, s->origin[2] = 0.3 * away;
    s->value = at[which].value;
    s->variant = at[which].variant;
    other->run(s);
    s->value = away;
    s->variant = which;
}

static const struct stress_case cases[] = {
    {.name = "far",
     .about = "other cases, so far from the origin: their bounds hold",
     .parameter = "m",
     .values = {1e4, 1e6},
     .value_count = 2,
     .quick = 0x2,
     .variants = names,
     .variant_count = sizeof names / sizeof *names,
     .run = far},
};
const struct stress_group stress_far = {cases, sizeof cases / sizeof *cases};
