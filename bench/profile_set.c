#include "profile_set.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *name; /* of the problem set, or a scene's */
    int steps;        /* -1: of the problem set */
    bool quick;
} set[] = {
    {"stack 10g 1kg 100kg", -1, true}, /* masses 1 : 10,000 on top of each other */
    {"stack 100kg 1kg 10g", -1, false},
    {"stack of 20", -1, true},
    {"plates on cubes, tilted", -1, false}, /* 1 : 200, friction 3 */
    {"bar", -1, true},                      /* statically indeterminate, slides */
    {"random pile 60", -1, false},          /* 1 : 1000, in no order */
    {"random pile 100", -1, false},
    {"random pile 200", -1, false},
    {"vertical_stacks:2", 100, true},
    {"vertical_stacks:12", 20, false}, /* boxes of 100 kg land on ones of 1 kg and 10 g */
    {"vertical_stacks:60", 100, false},
    {"oblique_stacks:1", 100, false},
    {"oblique_stacks:7", 100, false},
    {"card_houses:1", 5, false},
    {"card_houses:1", 300, false},
    {"card_houses:3", 300, false},
    {"pyramid:10", 50, false},
    {"pyramid:25", 100, false},
    {"sliding_cubes:50", 40, false},
    {"sliding_cubes:200", 100, false},
    {"pile:20", 200, true},
    {"pile:50", 200, false},
    {"pile:100", 300, false},
    {"pile:200", 300, false},
    {"pile:400", 400, false},
    {"pile:600", 400, false},
    {"mixed_pile:20", 200, true}, /* 1 : 1000 */
    {"mixed_pile:50", 300, false},
    {"mixed_pile:100", 300, false},
    {"mixed_pile:200", 400, false},
    {"mixed_pile:400", 400, false},
    {"sliding_pile:100", 300, false},
    {"sliding_pile:200", 400, false},
    {"settled_pile:100", 40, false},
    {"settled_pile:200", 40, false},
    {"settled_pile:350", 40, false},
    {"burst:3", 60, false},
    {"burst:5", 60, false},
    {"kicked_cubes:20", 101, false}, /* 1 : 1000 */
    {"dominoes:30", 150, false},
    {"arch:15", 100, false},
    {"arch:31", 200, false},
    {"dry_stone:4", 100, false},
    {"dry_stone:8", 100, false},
    {"kapla_tower", 100, false},
    {"mesh_pile:40", 300, false},
    {"mesh_pile:100", 400, false},
    {"terrain:100", 500, false},
    {"nuts_and_bolts:1", 100, false}, /* one body on 162 points of a thread */
    {"falling_chain", 50, false},
};

size_t profile_set_count(void) { return sizeof set / sizeof *set; }
const char *profile_set_name(size_t index) { return set[index].name; }
bool profile_set_quick(size_t index) { return set[index].quick; }

static void name_file(size_t index, char file[64])
{
    if (set[index].steps < 0) snprintf(file, 64, "%s", set[index].name);
    else snprintf(file, 64, "%s_%d", set[index].name, set[index].steps);
    for (char *c = file; *c; ++c)
        if (!isalnum((unsigned char)*c)) *c = '_';
}

sadmm_status profile_set_make(size_t index, struct set_problem *out, char file[64], struct sadmm_error *error)
{
    name_file(index, file);
    if (set[index].steps >= 0) return problem_set_freeze(set[index].name, set[index].steps, out, error);
    for (size_t k = 0; k < problem_set_count(); ++k)
        if (!strcmp(problem_set_name(k), set[index].name)) return problem_set_make(k, out, error);
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s: no such problem", set[index].name);
}
