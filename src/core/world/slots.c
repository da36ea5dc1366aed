#include "slots.h"

size_t sadmm_slot_free(struct sadmm_slot_marks *marks, const sadmm_world *world,
                       bool (*alive)(const sadmm_world *world, size_t slot))
{
    while (alive(world, marks->free)) ++marks->free;
    return marks->free;
}

size_t sadmm_slot_at(struct sadmm_slot_marks *marks, int32_t index, const sadmm_world *world,
                     bool (*alive)(const sadmm_world *world, size_t slot))
{
    while (marks->below > index) marks->below -= alive(world, --marks->at);
    while (marks->below < index || !alive(world, marks->at)) marks->below += alive(world, marks->at++);
    return marks->at;
}

int32_t sadmm_slot_index(struct sadmm_slot_marks *marks, size_t slot, const sadmm_world *world,
                         bool (*alive)(const sadmm_world *world, size_t slot))
{
    while (marks->at > slot) marks->below -= alive(world, --marks->at);
    while (marks->at < slot) marks->below += alive(world, marks->at++);
    return marks->below;
}

void sadmm_slot_taken(struct sadmm_slot_marks *marks, size_t slot)
{
    if (slot < marks->at) ++marks->below;
}

void sadmm_slot_freed(struct sadmm_slot_marks *marks, size_t slot)
{
    if (slot < marks->at) --marks->below;
    if (slot < marks->free) marks->free = slot;
}
