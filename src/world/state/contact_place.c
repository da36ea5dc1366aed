#include "contact_place.h"

#include "collision/mesh/mesh.h"
#include "core/model/system_math.h"

int32_t sadmm_world_contact_triangle(const sadmm_world *world, int32_t shape, uint32_t subshape)
{
    if (world->geometries[world->shapes[shape].geometry].type != SADMM_SHAPE_MESH) return -1;
    const int32_t *source = world->block_shapes[shape].mesh->source;
    return source ? source[subshape] : (int32_t)subshape;
}

void sadmm_world_contact_position(const sadmm_world *world, const struct sadmm_contact_pair *pair,
                                  const struct sadmm_contact_point *point, double position[3])
{
    const int32_t body = pair->body_b >= 0 ? pair->body_b : pair->body_a;
    const double *arm = pair->body_b >= 0 ? point->arm_b : point->arm_a;
    for (int k = 0; k < 3; ++k) position[k] = world->start.rigid[body].position[k] + arm[k];
}

double sadmm_world_contact_speed(const sadmm_world *world, const struct sadmm_contact_pair *pair,
                                 const struct sadmm_contact_point *point)
{
    const struct sadmm_system system = {.kinematic = world->start.kinematic,
                                        .kinematic_count = world->start.kinematic_count};
    vec3 x = sadmm_kinematic_part(&system, pair, point);
    if (pair->body_b >= 0) x = v3_add(x, sadmm_velocity_at(world->start.rigid[pair->body_b].velocity, point->arm_b));
    if (pair->body_a >= 0) x = v3_sub(x, sadmm_velocity_at(world->start.rigid[pair->body_a].velocity, point->arm_a));
    return -v3_dot(x, v3_load(pair->normal));
}
