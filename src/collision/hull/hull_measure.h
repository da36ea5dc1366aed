/* Planes of a polyhedron, the solid inside it, and the box around it. Vertices are 3 numbers each. */
#ifndef SADMM_COLLISION_HULL_HULL_MEASURE_H
#define SADMM_COLLISION_HULL_HULL_MEASURE_H

#include "hull_mesh.h"
#include "hull_points.h"

/* Four numbers a face: the unit normal of its corners by Newell's sums, outward, and the largest normal . corner.
 * False: a face has no area. */
bool sadmm_hull_planes(const struct hull_mesh *mesh, const double *vertices, double *planes);

/* The planes in a frame that is turned by `orientation`, where the vertices are `inside`. Normals are turned, not made
 * again: those of faces that are hardly wider than their corners are rounded by would come out as any. */
void sadmm_hull_turn_planes(const struct hull_mesh *mesh, const double *inside, const double orientation[4],
                            double *planes);

/* How far the polyhedron is from being the convex hull of the points, in their unit: the most that a point is outside
 * of a plane, or that a corner is below its own. */
double sadmm_hull_bulge(const struct hull_mesh *mesh, const double *vertices, const double *planes,
                        const struct hull_points *points);

struct hull_solid {
    double volume;
    double centre[3];  /* of mass */
    double moments[3]; /* integrals of x^2, y^2, z^2 along the principal axes, from the centre */
    double axes[4];    /* principal axes to the frame of the vertices; unit quaternion */
};

/* Of the polyhedron with a convex radius, m. False: the polyhedron has no volume. */
bool sadmm_hull_solid(const struct hull_mesh *mesh, const double *vertices, const double *planes, double convex_radius,
                      struct hull_solid *solid);

/* Axes of a box that lies on the largest face, along its longest edge; unit quaternion. */
void sadmm_hull_face_axes(const struct hull_mesh *mesh, const double *vertices, double orientation[4]);

/* The box around vertices whose axes are turned by `orientation` (NULL: not at all): its centre in the vertices'
 * frame, and half extents, which no vertex is outside of. `inside`: the vertices in the box's frame. */
struct hull_box {
    double position[3], half[3];
};
struct hull_box sadmm_hull_box(const double *vertices, int32_t count, const double orientation[4], double *inside);

#endif
