/* A shape of a scene file: its definition, and the masses of bodies that have a density. */
#ifndef SADMM_SCENE_FILE_READ_SHAPE_H
#define SADMM_SCENE_FILE_READ_SHAPE_H

#include "filler.h"

/* The definition that a shape's object has, in the frame of the file. Hulls and meshes have been read. */
sadmm_status sadmm_read_shape_def(const struct sadmm_filler *f, const json_t *object, sadmm_shape_def *def);

/* Of a dynamic body with "density", in whose frame its shapes and joints may be anyhow: its mass and moments, and its
 * pose from that frame to the principal axes about the centre of mass, into `def`. f->masses[number] keeps how the two
 * lie. */
sadmm_status sadmm_read_density(struct sadmm_filler *f, const json_t *object, size_t number, sadmm_body_def *def);
/* A pose on body `number` (-1: the world) from the frame of the file to the body's. Of bodies without density they are
 * the same, and so are those out of range, which the world refuses by their names. */
void sadmm_pose_in_body(const struct sadmm_filler *f, int64_t number, double position[3], double orientation[4]);

#endif
