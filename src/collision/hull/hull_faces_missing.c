/* In libraries built without qhull. */
#include "hull_faces.h"

enum hull_faces_are sadmm_hull_faces_find(const double *points, int32_t count, double flat, int32_t most,
                                          struct hull_mesh *mesh)
{
    (void)points, (void)count, (void)flat, (void)most, (void)mesh;
    return HULL_FACES_UNAVAILABLE;
}
