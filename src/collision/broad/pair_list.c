#include "broad_phase.h"

#include "collision/base/keys.h"
#include "core/base/memory.h"

bool sadmm_pair_list_add(struct sadmm_pair_list *list, uint32_t a, uint32_t b)
{
    if (!SADMM_GROW(list->keys, list->count, list->count + 1)) return false;
    list->keys[list->count++] = unordered_key(a, b);
    return true;
}
