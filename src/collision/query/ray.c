#include "ray.h"

#include <string.h>

#include "ray_mesh.h"
#include "ray_solid.h"

static void enters_at(double distance, const double normal[3], struct sadmm_ray_find *find)
{
    find->distance = distance;
    memcpy(find->normal, normal, 3 * sizeof *normal);
    find->triangle = -1;
    find->inside = false;
}

static bool starts_inside(const struct sadmm_ray_line *ray, struct sadmm_ray_find *find)
{
    if (!ray->from_inside) return false;
    find->distance = 0;
    for (int k = 0; k < 3; ++k) find->normal[k] = -ray->direction[k];
    find->triangle = -1;
    find->inside = true;
    return true;
}

/* Its solid is z <= 0 of its frame. */
static bool cast_plane(const struct sadmm_ray_line *ray, const struct sadmm_placed *shape, double limit,
                       struct sadmm_ray_find *find)
{
    const double n[3] = {shape->R[2], shape->R[5], shape->R[8]};
    double height = 0, rate = 0;
    for (int k = 0; k < 3; ++k) {
        height += n[k] * (ray->origin[k] - shape->x[k]);
        rate += n[k] * ray->direction[k];
    }
    if (height < 0) return starts_inside(ray, find);
    if (!(rate < 0)) return false;
    const double distance = height / -rate;
    if (!(distance <= limit && distance < HUGE_VAL)) return false; /* so far away that there is no number for it */
    enters_at(distance, n, find);
    return true;
}

static bool cast_mesh(const struct sadmm_ray_line *ray, const struct sadmm_placed *shape, double limit,
                      struct sadmm_ray_find *find)
{
    const vec3 from = v3_sub(v3_load(ray->origin), v3_load(shape->x));
    const struct ray_line line = {placed_own(shape, from), placed_own(shape, v3_load(ray->direction))};
    vec3 normal;
    find->triangle =
        sadmm_ray_mesh(shape->blocks, shape->geometry.hull, &line, limit, ray->from_behind, &find->distance, &normal);
    find->inside = false;
    if (find->triangle < 0) return false;
    v3_store(placed_world(shape, normal), find->normal);
    return true;
}

bool sadmm_ray_cast(const struct sadmm_ray_line *ray, const struct sadmm_placed *shape, double limit,
                    struct sadmm_ray_find *find)
{
    if (shape->geometry.type == SADMM_SHAPE_PLANE) return cast_plane(ray, shape, limit, find);
    if (shape->geometry.type == SADMM_SHAPE_MESH) return cast_mesh(ray, shape, limit, find);
    /* In the shape's frame from where the ray is nearest to its origin: numbers are of the size of the shape there,
     * however far away the ray begins. Twice, as the first time leaves the rounding of the way there. */
    const vec3 d = v3_load(ray->direction);
    vec3 x = v3_sub(v3_load(ray->origin), v3_load(shape->x));
    double way = -v3_dot(x, d);
    x = v3_madd(x, way, d);
    const double more = -v3_dot(x, d);
    x = v3_madd(x, more, d);
    way += more;
    const double radius = geometry_radius(&shape->geometry);
    if (!(v3_norm2(x) <= radius * radius * (1 + 1e-9))) return false;
    const struct ray_line line = {placed_own(shape, x), placed_own(shape, d)};
    struct ray_span span;
    if (!sadmm_ray_span(&shape->geometry, shape->blocks, &line, &span)) return false;
    const double in = way + span.in, out = way + span.out;
    if (in < 0) return out > 0 && starts_inside(ray, find);
    if (!(in <= limit)) return false;
    double normal[3];
    v3_store(placed_world(shape, span.normal), normal);
    enters_at(in, normal, find);
    return true;
}
