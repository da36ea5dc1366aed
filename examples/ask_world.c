/* Queries: what a ray hits, what overlaps a ball, how far two shapes are apart. */
#include <math.h>
#include <stdio.h>

#include <subadmm/subadmm.h>

enum { MOST = 16 };

static sadmm_status add_ball(sadmm_world *world, double x, double radius, sadmm_shape_id *shape_id)
{
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_shape_def ball = sadmm_shape_def_default();
    sadmm_body_id id;
    body.mass = 1;
    body.position[0] = x;
    ball.type = SADMM_SHAPE_SPHERE;
    ball.size[0] = radius;
    sadmm_sphere_inertia(body.mass, radius, body.inertia);
    sadmm_status status = sadmm_world_add_body(world, &body, &id);
    if (status == SADMM_OK) status = sadmm_world_add_shape(world, id, &ball, shape_id);
    return status;
}

static sadmm_status ask(sadmm_world *world, sadmm_shape_id left, sadmm_shape_id right)
{
    sadmm_ray ray = {{-5, 0, 0}, {1, 0, 0}, INFINITY}; /* origin, direction, how far to search */
    sadmm_ray_hit hit;
    sadmm_status status = sadmm_world_cast_ray(world, &ray, NULL, &hit);
    if (status != SADMM_OK) return status;
    if (hit.shape.slot != 0) printf("the ray hits after %g m\n", hit.distance);

    sadmm_shape_def ball = sadmm_shape_def_default();
    const double at[3] = {0, 0, 0}, turn[4] = {1, 0, 0, 0};
    sadmm_shape_id found[MOST];
    int32_t count; /* of all that overlap: may be more than there is room for */
    ball.type = SADMM_SHAPE_SPHERE;
    ball.size[0] = 0.6;
    status = sadmm_world_overlap_shape(world, &ball, at, turn, NULL, MOST, found, &count);
    if (status != SADMM_OK) return status;
    printf("%d shapes overlap a ball of 0.6 m\n", (int)count);

    sadmm_closest_points closest;
    status = sadmm_world_closest_points(world, left, right, &closest);
    if (status == SADMM_OK) printf("the two are %g m apart\n", closest.distance);
    return status;
}

int main(void)
{
    sadmm_world_def world_def = sadmm_world_def_default();
    sadmm_world *world;
    sadmm_shape_id left, right;
    if (sadmm_world_create(&world_def, &world) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    sadmm_status status = add_ball(world, -1, 0.5, &left);
    if (status == SADMM_OK) status = add_ball(world, 1, 0.25, &right);
    if (status == SADMM_OK) status = ask(world, left, right);
    if (status != SADMM_OK) fprintf(stderr, "%s\n", sadmm_world_message(world));
    sadmm_world_destroy(world);
    return status == SADMM_OK ? 0 : 1;
}
