/* Rays through a world. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "query_scene.h"
#include "subadmm/query.h"
#include "world/state/ids.h"

static const double ORIGIN_LIMIT = 1e9;

/* Rays for which another thread is worth its while; and how many a thread takes at a time. */
enum { RAYS_PER_THREAD = 512, RAYS_AT_A_TIME = 64 };

static bool is_ray(const sadmm_ray *ray)
{
    const double *x = ray->origin, *d = ray->direction;
    return fabs(x[0]) <= ORIGIN_LIMIT && fabs(x[1]) <= ORIGIN_LIMIT && fabs(x[2]) <= ORIGIN_LIMIT && isfinite(d[0]) &&
           isfinite(d[1]) && isfinite(d[2]) && (d[0] != 0 || d[1] != 0 || d[2] != 0) && ray->length >= 0;
}

sadmm_status sadmm_query_check_direction(const char *name, const double d[3], struct sadmm_error *error)
{
    TRY(sadmm_check_vector(name, d, 3, HUGE_VAL, error));
    if (d[0] != 0 || d[1] != 0 || d[2] != 0) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%s = (0, 0, 0): must not be 0", name);
}

/* What is wrong with one that is none. `name`: "ray->" or "rays[17].". */
static sadmm_status check_ray(const sadmm_ray *ray, const char *name, struct sadmm_error *error)
{
    if (is_ray(ray)) return SADMM_OK;
    char field[48];
    snprintf(field, sizeof field, "%sorigin", name);
    TRY(sadmm_check_vector(field, ray->origin, 3, ORIGIN_LIMIT, error));
    snprintf(field, sizeof field, "%sdirection", name);
    TRY(sadmm_query_check_direction(field, ray->direction, error));
    return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "%slength = %g: must be >= 0 m", name, ray->length);
}

void sadmm_query_make_unit(const double d[3], double unit[3])
{
    double scaled[3] = {d[0], d[1], d[2]}, length2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (!(length2 > 1e-200 && length2 < 1e200)) { /* by a power of two, which changes no digit */
        int power;
        frexp(fmax(fabs(d[0]), fmax(fabs(d[1]), fabs(d[2]))), &power);
        for (int k = 0; k < 3; ++k) scaled[k] = ldexp(d[k], -power);
        length2 = scaled[0] * scaled[0] + scaled[1] * scaled[1] + scaled[2] * scaled[2];
    }
    const double length = sqrt(length2);
    for (int k = 0; k < 3; ++k) unit[k] = scaled[k] / length;
}

static struct sadmm_ray_line line_of(const sadmm_ray *ray, const sadmm_query_filter *filter)
{
    struct sadmm_ray_line line = {
        .length = ray->length, .from_inside = filter->from_inside, .from_behind = filter->from_behind};
    memcpy(line.origin, ray->origin, sizeof line.origin);
    sadmm_query_make_unit(ray->direction, line.direction);
    return line;
}

static void give_hit(const sadmm_world *world, const struct sadmm_ray_line *line, const struct sadmm_query_hit *found,
                     sadmm_ray_hit *hit)
{
    const struct sadmm_ray_find *find = &found->find;
    memset(hit, 0, sizeof *hit);
    hit->shape = sadmm_world_shape_id(world, found->slot);
    hit->body = sadmm_world_body_id(world, (size_t)found->body);
    hit->distance = find->distance;
    for (int k = 0; k < 3; ++k) {
        hit->point[k] = line->origin[k] + find->distance * line->direction[k];
        hit->normal[k] = find->normal[k];
    }
    hit->triangle = sadmm_world_source_triangle(world, found->slot, find->triangle);
    hit->inside = find->inside;
}

static void cast_first(const sadmm_world *world, const sadmm_ray *ray, const sadmm_query_filter *given,
                       const struct sadmm_shape_filter *filter, sadmm_ray_hit *hit)
{
    const struct sadmm_ray_line line = line_of(ray, given);
    struct sadmm_query_hit found;
    if (sadmm_query_tree_cast(&world->query.tree, &line, filter, true, 1, &found) > 0) {
        give_hit(world, &line, &found, hit);
    } else {
        memset(hit, 0, sizeof *hit);
        hit->triangle = -1;
    }
}

sadmm_status sadmm_world_cast_ray(sadmm_world *world, const sadmm_ray *ray, const sadmm_query_filter *filter,
                                  sadmm_ray_hit *hit)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_shape_filter taken;
    sadmm_query_filter given;
    TRY(sadmm_check_given(ray, "ray", error));
    TRY(sadmm_check_given(hit, "hit", error));
    TRY(check_ray(ray, "ray->", error));
    TRY(sadmm_world_take_filter(world, filter, &taken, &given));
    TRY(sadmm_world_place_shapes(world));
    cast_first(world, ray, &given, &taken, hit);
    return SADMM_OK;
}

sadmm_status sadmm_world_cast_ray_all(sadmm_world *world, const sadmm_ray *ray, const sadmm_query_filter *filter,
                                      int32_t capacity, sadmm_ray_hit *hits, int32_t *count)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_shape_filter taken;
    sadmm_query_filter given;
    TRY(sadmm_check_given(ray, "ray", error));
    TRY(sadmm_check_given(count, "count", error));
    if (capacity < 0) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "capacity = %d: must be >= 0", capacity);
    if (capacity > 0) TRY(sadmm_check_given(hits, "hits", error));
    TRY(check_ray(ray, "ray->", error));
    TRY(sadmm_world_take_filter(world, filter, &taken, &given));
    TRY(sadmm_world_place_shapes(world));
    const int32_t room = capacity < world->shape_ids.count ? capacity : world->shape_ids.count;
    if (!SADMM_GROW(world->query.hits, 0, (size_t)room)) return sadmm_fail_memory(error, "a query");
    const struct sadmm_ray_line line = line_of(ray, &given);
    *count = sadmm_query_tree_cast(&world->query.tree, &line, &taken, false, room, world->query.hits);
    for (int32_t i = 0; i < *count && i < room; ++i) give_hit(world, &line, &world->query.hits[i], &hits[i]);
    return SADMM_OK;
}

struct casting {
    const sadmm_world *world;
    const sadmm_ray *rays;
    int32_t count;
    const sadmm_query_filter *given;
    const struct sadmm_shape_filter *filter;
    sadmm_ray_hit *hits;
};

/* Every thread takes groups of rays, as many as every other one, from all over the list: neighbours in it may have as
 * much to do. */
static void cast_share(void *argument, int thread, int threads)
{
    const struct casting *c = (const struct casting *)argument;
    for (int64_t group = thread; group * RAYS_AT_A_TIME < c->count; group += threads) {
        const int64_t begin = group * RAYS_AT_A_TIME,
                      end = begin + RAYS_AT_A_TIME < c->count ? begin + RAYS_AT_A_TIME : c->count;
        for (int64_t i = begin; i < end; ++i) cast_first(c->world, &c->rays[i], c->given, c->filter, &c->hits[i]);
    }
}

sadmm_status sadmm_world_cast_rays(sadmm_world *world, int32_t count, const sadmm_ray *rays,
                                   const sadmm_query_filter *filter, sadmm_ray_hit *hits)
{
    TRY(sadmm_check_given(world, "world", NULL));
    struct sadmm_error *error = &world->error;
    struct sadmm_shape_filter taken;
    sadmm_query_filter given;
    if (count < 0) return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "count = %d: must be >= 0", count);
    if (count > 0) {
        TRY(sadmm_check_given(rays, "rays", error));
        TRY(sadmm_check_given(hits, "hits", error));
    }
    for (int32_t i = 0; i < count; ++i) {
        char name[24];
        if (is_ray(&rays[i])) continue;
        snprintf(name, sizeof name, "rays[%d].", i);
        return check_ray(&rays[i], name, error);
    }
    TRY(sadmm_world_take_filter(world, filter, &taken, &given));
    TRY(sadmm_world_place_shapes(world));
    struct casting casting = {world, rays, count, &given, &taken, hits};
    const int threads =
        sadmm_team_threads(&world->team, world->def.settings.threads, (size_t)count / RAYS_PER_THREAD + 1);
    sadmm_parallel(&world->team, threads, cast_share, &casting);
    return SADMM_OK;
}
