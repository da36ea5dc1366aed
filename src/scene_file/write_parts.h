/* Joints, couplings, gears, and what was set for pairs, into a scene file. */
#ifndef SADMM_SCENE_FILE_WRITE_PARTS_H
#define SADMM_SCENE_FILE_WRITE_PARTS_H

#include "writer.h"

sadmm_status sadmm_write_parts(struct sadmm_writer *w);

#endif
