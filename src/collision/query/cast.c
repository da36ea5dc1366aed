#include "cast.h"

#include "cast_steps.h"
#include "closest.h"

struct moving_pair {
    struct sadmm_placed moving;
    const struct sadmm_placed *other;
    const double *from, *direction;
};

static bool apart_after(const void *pair, double way, struct sadmm_separation *separation)
{
    struct moving_pair p = *(const struct moving_pair *)pair;
    for (int k = 0; k < 3; ++k) p.moving.x[k] = p.from[k] + way * p.direction[k];
    return sadmm_closest(&p.moving, p.other, HUGE_VAL, separation);
}

static bool overlaps(const struct sadmm_cast *cast, const struct sadmm_placed *other, double size,
                     struct sadmm_cast_find *find)
{
    struct sadmm_separation separation;
    if (!sadmm_closest(cast->shape, other, 0, &separation) || !(separation.distance < -SADMM_CAST_TOUCH * size))
        return false;
    *find = (struct sadmm_cast_find){0, separation.normal, separation.b, separation.triangle, true};
    return true;
}

bool sadmm_cast_shape(const struct sadmm_cast *cast, const struct sadmm_placed *other, double limit,
                      struct sadmm_cast_find *find)
{
    const vec3 between = v3_sub(v3_load(cast->shape->x), v3_load(other->x));
    const double size = geometry_radius(&cast->shape->geometry) + geometry_radius(&other->geometry) + v3_norm(between);
    const bool plane = other->geometry.type == SADMM_SHAPE_PLANE;
    struct sadmm_box3 box;
    double enter = 0;
    if (!plane) {
        placed_box(other, &box);
        if (!sadmm_cast_meets(&cast->box, cast->direction, &box, limit, &enter)) return false;
    }
    if (enter <= SADMM_CAST_TOUCH * size && overlaps(cast, other, size, find)) return cast->from_inside;
    if (other->geometry.type == SADMM_SHAPE_MESH) return sadmm_cast_on_mesh(cast, other, limit, find);
    const struct moving_pair pair = {*cast->shape, other, cast->shape->x, cast->direction};
    struct sadmm_separation separation;
    find->inside = false;
    if (!sadmm_cast_go(apart_after, &pair, v3_load(cast->direction), size, enter, limit, &find->distance, &separation))
        return false;
    find->normal = separation.normal;
    find->point = separation.b;
    find->triangle = -1;
    return true;
}
