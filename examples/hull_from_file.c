/* A mesh file becomes a body: the convex hull of its vertices falls on the ground and comes to rest.
 * usage: hull_from_file FILE [METRES_A_UNIT] */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <subadmm/subadmm.h>

/* The convex hull of a file's vertices. scale: m a unit of the file */
static sadmm_status hull_of_file(const char *path, double scale, sadmm_hull **hull)
{
    sadmm_mesh_file_def def = sadmm_mesh_file_def_default();
    sadmm_mesh_file *file;
    def.path = path;
    def.scale = scale;
    sadmm_status status = sadmm_mesh_file_read(&def, &file);
    if (status != SADMM_OK) return status;

    sadmm_hull_def points = sadmm_hull_def_default();
    points.points = sadmm_mesh_file_vertices(file);
    points.point_count = (size_t)sadmm_mesh_file_vertex_count(file);
    status = sadmm_hull_create(&points, hull);
    sadmm_mesh_file_destroy(file); /* the hull has what it needs */
    return status;
}

/* A body of it. `position` is where the file's origin comes to, its axes along the world's. */
static sadmm_status add_hull(sadmm_world *world, const sadmm_hull *hull, const double position[3], sadmm_body_id *body)
{
    sadmm_body_def def = sadmm_body_def_default();
    sadmm_shape_def shape = sadmm_shape_def_default();
    const double orientation[4] = {1, 0, 0, 0};
    sadmm_mass mass;
    sadmm_status status = sadmm_hull_mass(hull, 1000, &mass); /* kg/m^3 */
    if (status != SADMM_OK) return status;

    def.mass = mass.mass;
    memcpy(def.inertia, mass.inertia, sizeof def.inertia);
    memcpy(def.position, position, sizeof def.position);
    memcpy(def.orientation, orientation, sizeof def.orientation);
    shape.type = SADMM_SHAPE_HULL;
    shape.hull = hull;
    /* A body's frame is at its centre of mass, along its principal axes. */
    status = sadmm_mass_pose_of_body(&mass, def.position, def.orientation);
    if (status == SADMM_OK) status = sadmm_mass_pose_in_body(&mass, shape.position, shape.orientation);
    if (status == SADMM_OK) status = sadmm_world_add_body(world, &def, body);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, *body, &shape, NULL);
    return status;
}

int main(int argc, char **argv)
{
    sadmm_world_def world_def = sadmm_world_def_default();
    sadmm_world *world = NULL;
    sadmm_hull *hull = NULL;
    if (argc < 2) {
        fprintf(stderr, "usage: hull_from_file FILE [METRES_A_UNIT]\n");
        return 2;
    }
    sadmm_status status = hull_of_file(argv[1], argc > 2 ? strtod(argv[2], NULL) : 1, &hull);
    if (status == SADMM_OK) status = sadmm_world_create(&world_def, &world);

    sadmm_body_def ground_def = sadmm_body_def_default();
    sadmm_shape_def plane = sadmm_shape_def_default();
    sadmm_body_id ground, body;
    sadmm_body_state state;
    ground_def.type = SADMM_BODY_STATIC;
    plane.type = SADMM_SHAPE_PLANE;
    if (status == SADMM_OK) status = sadmm_world_add_body(world, &ground_def, &ground);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, ground, &plane, NULL);
    if (status == SADMM_OK) status = add_hull(world, hull, (const double[]){0, 0, 1}, &body);
    sadmm_hull_destroy(hull); /* the world keeps it */
    for (int step = 0; status == SADMM_OK && step < 400; ++step) status = sadmm_world_step(world);
    if (status == SADMM_OK) status = sadmm_world_body_state(world, body, &state);
    if (status == SADMM_OK) printf("centre at rest %.6f m above the ground\n", state.position[2]);
    else fprintf(stderr, "%s\n", sadmm_last_message());
    sadmm_world_destroy(world);
    if (status == SADMM_ERROR_UNAVAILABLE) return 77; /* a library without hulls: a test is skipped */
    return status == SADMM_OK ? 0 : 1;
}
