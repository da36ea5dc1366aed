/* Orientations that become those of a file. */
#ifndef SADMM_SCENE_FILE_ORIENTATION_H
#define SADMM_SCENE_FILE_ORIENTATION_H

/* The library makes orientations unit, q / |q|, when it takes them; of one that it made before, rounding can make
 * another. Replaces q, of which it is known that some definition became it, by a quaternion that becomes q to the last
 * bit, so that what is read is what was written. Others stay as they are, to within rounding. */
void sadmm_before_unit(double q[4]);

#endif
