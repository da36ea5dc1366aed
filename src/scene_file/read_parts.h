/* Joints, couplings, gears, and what is set for pairs. */
#ifndef SADMM_SCENE_FILE_READ_PARTS_H
#define SADMM_SCENE_FILE_READ_PARTS_H

#include "filler.h"

sadmm_status sadmm_read_parts(struct sadmm_filler *f);

#endif
