/* What contact finding starts from: shapes, geometries, bodies, overrides, which shapes there are.
 *
 * What rarely changes is kept in pinned memory as it was last uploaded, and uploaded again only when it differs.
 */
#include <math.h>
#include <string.h>

#include <algorithm>

#include "collision/mesh/mesh_data.h"
#include "memory.h"

/* A mover of this many median radii is large. */
static const double LARGE = 8;

/* Bring one of the input buffers up to date. `changed`: no need to compare. */
static sadmm_status upload_input(struct sadmm_cuda_collision *c, int name, const void *data, size_t count, size_t size,
                                 bool changed, struct sadmm_error *error)
{
    const int staged = name + INPUTS;
    const size_t bytes = count * size;
    size_t *uploaded = &c->input_bytes[name - SHAPES];
    if (!changed && *uploaded == bytes && (bytes == 0 || memcmp(in<void>(c, staged), data, bytes) == 0))
        return SADMM_OK;
    *uploaded = SIZE_MAX;
    TRY(reserve(c, name, count, size, error));
    TRY(reserve(c, staged, count, size, error));
    if (bytes > 0) memcpy(in<void>(c, staged), data, bytes);
    TRY(copy(c, in<void>(c, name), in<void>(c, staged), bytes, true, error));
    *uploaded = bytes;
    return SADMM_OK;
}

/* A slot's revision changes with everything that matters, its geometry included; where a hull is in the shape data may
 * change without it. */
static bool shapes_changed(const struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input)
{
    const struct sadmm_shape *before = in<struct sadmm_shape>(c, PINNED_SHAPES);
    if (c->input_bytes[0] != input->shape_count * sizeof *before || c->hull_revision != input->hull_revision)
        return true;
    for (size_t slot = 0; slot < input->shape_count; ++slot) {
        const struct sadmm_shape *now = &input->shapes[slot], *old = &before[slot];
        if (now->alive != old->alive || now->revision != old->revision || now->body != old->body)
            return true;
    }
    return false;
}

static const struct sadmm_geometry &geometry_of(const struct sadmm_collision_input *input, size_t slot)
{
    return input->geometries[input->shapes[slot].geometry];
}

/* Of a mesh. */
static uint64_t triangles_of(const struct sadmm_collision_input *input, const struct sadmm_geometry &geometry)
{
    struct mesh mesh;
    mesh_at(input->hulls, geometry.hull, &mesh);
    return (uint64_t)mesh.triangles;
}

/* Bits of a candidate (candidate_of); and which kinds of shapes there are. */
static sadmm_status measure_candidates(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                                       struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    uint64_t most = 1, triangles = 0;
    v->mesh_count = 0;
    c->smooth = false;
    for (size_t slot = 0; slot < input->shape_count; ++slot) {
        if (!sadmm_shape_collides(&input->shapes[slot])) continue;
        TRY(sadmm_collision_check_shape(input, slot, error));
        const struct sadmm_geometry &geometry = geometry_of(input, slot);
        c->smooth |= geometry_is_smooth(&geometry) != 0;
        if (geometry.type == SADMM_SHAPE_MESH) {
            ++v->mesh_count;
            triangles = std::max(triangles, triangles_of(input, geometry));
        } else {
            most = std::max(most, (uint64_t)geometry.subshapes);
        }
    }
    v->slot_bits = std::max(bits_of(input->shape_count), 1);
    const uint64_t last = std::max(most * most, triangles) - 1;
    v->subshape_bits = v->mesh_count > 0 ? std::max(bits_of(last), 1) : bits_of(last);
    if (2 * v->slot_bits + v->subshape_bits > 64)
        return sadmm_fail(error, SADMM_ERROR_LIMIT,
                          "%zu shapes of up to %llu subshapes: their pairs take %d bits, at most 64 can be indexed",
                          input->shape_count, (unsigned long long)std::max(most, triangles),
                          2 * v->slot_bits + v->subshape_bits);
    return SADMM_OK;
}

/* The list of shapes: leaves, then planes; and from which radius a mover is large. */
static sadmm_status list_shapes(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                                struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    size_t leaves = 0, planes = 0;
    if (!SADMM_GROW(c->present, 0, input->shape_count) || !SADMM_GROW(c->radii, 0, input->shape_count))
        return sadmm_fail_memory(error, "collision's list of shapes");
    for (size_t slot = 0; slot < input->shape_count; ++slot) {
        if (!sadmm_shape_collides(&input->shapes[slot]) || geometry_of(input, slot).type == SADMM_SHAPE_PLANE) continue;
        c->radii[leaves] = geometry_radius(&geometry_of(input, slot));
        c->present[leaves++] = (uint32_t)slot;
    }
    for (size_t slot = 0; slot < input->shape_count; ++slot)
        if (sadmm_shape_collides(&input->shapes[slot]) && geometry_of(input, slot).type == SADMM_SHAPE_PLANE)
            c->present[leaves + planes++] = (uint32_t)slot;
    if (!SADMM_GROW(c->planes, 0, planes)) return sadmm_fail_memory(error, "collision's list of planes");
    v->leaf_count = (int32_t)leaves;
    v->plane_count = (int32_t)planes;
    v->large = HUGE_VAL;
    if (leaves > 0) {
        std::nth_element(c->radii, c->radii + leaves / 2, c->radii + leaves);
        v->large = LARGE * c->radii[leaves / 2];
    }
    return SADMM_OK;
}

/* Planes by group; bodies, and with them groups, may be others without any change of a shape. */
static sadmm_status list_planes(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                                struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const size_t count = (size_t)v->plane_count;
    v->shared_planes = 0;
    for (size_t i = 0; i < count; ++i) {
        const uint32_t slot = c->present[(size_t)v->leaf_count + i];
        const int32_t group = input->bodies[input->shapes[slot].body].environment;
        c->planes[i] = group < 0 ? slot : ordered_key((uint32_t)group + 1, slot);
        if (group < 0) ++v->shared_planes;
    }
    std::sort(c->planes, c->planes + count);
    return upload_input(c, PLANES, c->planes, count, sizeof *c->planes, false, error);
}

/* Leaves by group, those of every group last; where groups are so small that each leaf is tested against all others of
 * its own. */
static sadmm_status list_groups(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                                struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    const size_t count = (size_t)v->leaf_count;
    size_t most = 0, shared = 0;
    v->grouped = nullptr;
    if (v->group_bits == 0) return SADMM_OK;
    if (!SADMM_GROW(c->grouped, 0, count)) return sadmm_fail_memory(error, "collision's list of environments");
    for (size_t i = 0; i < count; ++i) {
        const int32_t group = input->bodies[input->shapes[c->present[i]].body].environment;
        c->grouped[i] = (uint64_t)(uint32_t)group << 32 | i;
        shared += group < 0;
    }
    std::sort(c->grouped, c->grouped + count);
    for (size_t i = 0, first = 0; i < count - shared; ++i) {
        if (c->grouped[i] >> 32 != c->grouped[first] >> 32) first = i;
        most = std::max(most, i - first + 1);
    }
    if ((int64_t)(most + shared) > c->group_leaves) return SADMM_OK;
    TRY(upload_input(c, GROUPED, c->grouped, count, sizeof *c->grouped, false, error));
    v->grouped = in<uint64_t>(c, GROUPED);
    v->shared_leaves = (int32_t)shared;
    return SADMM_OK;
}

static int32_t group_bits(const struct sadmm_collision_input *input)
{
    int32_t last = 0, bits = 0;
    for (size_t i = 0; i < input->body_count; ++i) last = std::max(last, input->bodies[i].environment);
    while (last >> bits) ++bits;
    return bits;
}

/* Which shapes do not move, and where they are. */
static uint64_t hash_of_stills(const struct sadmm_collision_input *input)
{
    uint64_t hash = 0;
    for (size_t slot = 0; slot < input->shape_count; ++slot) {
        const struct sadmm_shape &shape = input->shapes[slot];
        if (!sadmm_shape_collides(&shape) || input->bodies[shape.body].system_body != -1) continue;
        hash = (hash ^ slot) * UINT64_C(0x9E3779B97F4A7C15) + (hash >> 29);
        hash = (hash ^ input->bodies[shape.body].placed) * UINT64_C(0x9E3779B97F4A7C15) + (hash >> 29);
        hash = (hash ^ (uint32_t)input->bodies[shape.body].environment) * UINT64_C(0x9E3779B97F4A7C15) + (hash >> 29);
    }
    return hash;
}

static sadmm_status find_seams(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input, bool changed,
                               struct sadmm_error *error)
{
    const uint64_t stills = hash_of_stills(input);
    if (!sadmm_seams_find(&c->seams, input, changed || stills != c->stills)) {
        c->seams.slot_count = SIZE_MAX; /* of no input */
        return sadmm_fail_memory(error, "neighbours of shapes");
    }
    c->stills = stills;
    const size_t count = c->seams.neighbour_count;
    TRY(upload_input(c, SEAMS, c->seams.first, count > 0 ? input->shape_count + 1 : 0, sizeof *c->seams.first, false,
                     error));
    TRY(upload_input(c, SEAM_NEIGHBOURS, c->seams.neighbours, count, sizeof *c->seams.neighbours, false, error));
    c->view.seams.first = count > 0 ? in<uint32_t>(c, SEAMS) : nullptr;
    c->view.seams.neighbours = in<struct seam_neighbour>(c, SEAM_NEIGHBOURS);
    return SADMM_OK;
}

sadmm_status COLLISION(take_input)(struct sadmm_cuda_collision *c, const struct sadmm_collision_input *input,
                                   const struct sadmm_collision_body *bodies, struct sadmm_error *error)
{
    struct collision_view *v = &c->view;
    if (input->shape_count > (size_t)INT32_MAX / 2 || input->body_count > (size_t)INT32_MAX ||
        input->disabled_body_pair_count > (size_t)INT32_MAX || input->friction_pair_count > (size_t)INT32_MAX)
        return sadmm_fail(error, SADMM_ERROR_LIMIT, "%zu shapes, %zu bodies: at most %d and %d can be indexed",
                          input->shape_count, input->body_count, (int)(INT32_MAX / 2), (int)INT32_MAX);
    const bool changed = shapes_changed(c, input);
    if (changed) {
        c->input_bytes[0] = SIZE_MAX;
        TRY(measure_candidates(c, input, error));
        TRY(list_shapes(c, input, error));
        TRY(upload_input(c, PRESENT, c->present, (size_t)(v->leaf_count + v->plane_count), sizeof *c->present, true,
                         error));
        TRY(upload_input(c, GEOMETRIES, input->geometries, input->geometry_count, sizeof *input->geometries, true,
                         error));
        TRY(upload_input(c, HULLS, input->hulls, input->hull_doubles, sizeof *input->hulls, true, error));
        TRY(upload_input(c, SHAPES, input->shapes, input->shape_count, sizeof *input->shapes, true, error));
        c->hull_revision = input->hull_revision;
    }
    if (!bodies) TRY(upload_input(c, BODIES, input->bodies, input->body_count, sizeof *input->bodies, true, error));
    v->group_bits = group_bits(input);
    TRY(list_planes(c, input, error));
    TRY(list_groups(c, input, error));
    TRY(find_seams(c, input, changed, error));
    TRY(upload_input(c, DISABLED_PAIRS, input->disabled_body_pairs, input->disabled_body_pair_count,
                     sizeof *input->disabled_body_pairs, false, error));
    TRY(upload_input(c, FRICTION_PAIRS, input->friction_pairs, input->friction_pair_count,
                     sizeof *input->friction_pairs, false, error));
    TRY(upload_input(c, FRICTION_VALUES, input->friction_values, input->friction_pair_count,
                     sizeof *input->friction_values, false, error));

    v->shapes = in<struct sadmm_shape>(c, SHAPES);
    v->geometries = in<struct sadmm_geometry>(c, GEOMETRIES);
    v->hulls = input->hulls ? in<double>(c, HULLS) : nullptr;
    v->bodies = bodies ? bodies : in<struct sadmm_collision_body>(c, BODIES);
    v->body_count = (int32_t)input->body_count;
    v->abort_code = nullptr;
    v->dt = v->gravity = nullptr;
    v->gravities = {};
    v->present = in<uint32_t>(c, PRESENT);
    v->planes = in<uint64_t>(c, PLANES);
    v->disabled_pairs = in<uint64_t>(c, DISABLED_PAIRS);
    v->friction_pairs = in<uint64_t>(c, FRICTION_PAIRS);
    v->friction_values = in<double>(c, FRICTION_VALUES);
    v->disabled_count = (int32_t)input->disabled_body_pair_count;
    v->friction_count = (int32_t)input->friction_pair_count;
    v->step.dt = input->dt;
    v->step.margin = input->margin;
    v->step.gravity = input->gravity;
    v->substeps = 1;
    v->substep = 0;
    return SADMM_OK;
}
