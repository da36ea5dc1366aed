/* A world as bytes and back (subadmm/save.h): lists of members for both directions (core/base/archive.h).
 *
 *   save.c           header, checksum, and what becomes of the world that is restored
 *   save_objects.c   settings, bodies, shapes with their hulls and meshes, joints, gears, couplings
 *   save_step.c      the last step: contacts, rows, report
 *
 * Reading goes into a world that is empty, and holds every index against what is there, so that no bytes lead
 * a step out of an array. Numbers are held to the ranges of the calls that set them, where a step cannot
 * leave these.
 */
#ifndef SADMM_WORLD_SAVE_SAVE_H
#define SADMM_WORLD_SAVE_SAVE_H

#include <stddef.h>

/* For tests of what is behind the checksum: make size and checksum of a buffer's header what they are. */
void sadmm_save_repair(void *buffer, size_t size);

#endif
