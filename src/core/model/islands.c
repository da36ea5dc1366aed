#include "islands.h"

#include <string.h>

/* Paths are halved on the way; roots are the smallest body of their tree, since the larger root goes under the
 * smaller. */
static int32_t root_of(int32_t *parent, int32_t i)
{
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

static void join(int32_t *parent, int32_t a, int32_t b)
{
    if (a < 0 || b < 0) return;
    a = root_of(parent, a);
    b = root_of(parent, b);
    if (a < b) parent[b] = a;
    else parent[a] = b;
}

void sadmm_islands(const struct sadmm_system *system, int32_t *label)
{
    if (system->islands) {
        memcpy(label, system->islands, (size_t)system->body_count * sizeof *label);
        return;
    }
    for (int32_t i = 0; i < system->body_count; ++i) label[i] = i;
    for (size_t p = 0; p < system->contacts->pair_count; ++p)
        join(label, system->contacts->pairs[p].body_a, system->contacts->pairs[p].body_b);
    for (size_t k = 0; k < sadmm_row_constraint_count(system); ++k)
        join(label, system->rows->constraints[k].body_a, system->rows->constraints[k].body_b);
    for (int32_t i = 0; i < system->body_count; ++i) label[i] = label[label[i]]; /* parents are smaller: done already */
}
