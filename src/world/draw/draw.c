/* A world as lines, triangles, points and texts. */
#include "subadmm/draw.h"

#include <math.h>
#include <string.h>

#include "collision/shapes/placed.h"
#include "core/base/check.h"
#include "core/base/growing.h"
#include "draw_marks.h"
#include "draw_shapes.h"
#include "world/query/query_scene.h"
#include "world/resident/resident.h"
#include "world/state/ids.h"

static const sadmm_draw defaults = {.flags = SADMM_DRAW_SHAPES,
                                    .segments = 24,
                                    .force_scale = 0.01,
                                    .axis_length = 0.1,
                                    .plane_size = 10,
                                    .lowest = {-INFINITY, -INFINITY, -INFINITY},
                                    .highest = {INFINITY, INFINITY, INFINITY},
                                    .environment = -1};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_draw, &defaults, environment);

void sadmm_draw_init(sadmm_draw *draw, size_t size) { sadmm_growing_init(&growing, draw, size, 0); }

static sadmm_status check(const sadmm_draw *draw)
{
    if (draw->flags > SADMM_DRAW_ALL)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "draw->flags = %u: must be in [0, %d]", draw->flags,
                          SADMM_DRAW_ALL);
    if (draw->segments < 4 || draw->segments > 1024 || draw->segments % 4 != 0)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT,
                          "draw->segments = %d: must be a multiple of 4 in [4, 1024]", draw->segments);
    TRY(sadmm_check_range("draw->force_scale", draw->force_scale, 0, 1e9, NULL));
    TRY(sadmm_check_range("draw->axis_length", draw->axis_length, 0, 1e9, NULL));
    TRY(sadmm_check_range("draw->plane_size", draw->plane_size, 1e-6, 1e9, NULL));
    for (int k = 0; k < 3; ++k)
        if (!(draw->lowest[k] <= draw->highest[k]))
            return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT,
                              "draw->lowest[%d] = %g, draw->highest[%d] = %g: must be numbers, lowest <= highest", k,
                              draw->lowest[k], k, draw->highest[k]);
    if (draw->environment < -1)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "draw->environment = %d: must be >= -1",
                          draw->environment);
    return SADMM_OK;
}

/* ---- shapes ------------------------------------------------------------------------------------------------------ */

static bool sees_box(const sadmm_draw *draw, const struct sadmm_box3 *box)
{
    for (int k = 0; k < 3; ++k)
        if (!(box->hi[k] >= draw->lowest[k] && box->lo[k] <= draw->highest[k])) return false;
    return true;
}

static uint32_t colour_of(const sadmm_world *world, const sadmm_draw *draw, size_t slot)
{
    static const uint32_t by_type[] = {[SADMM_BODY_DYNAMIC] = 0xD9A441,
                                       [SADMM_BODY_STATIC] = 0x8C8C8C,
                                       [SADMM_BODY_KINEMATIC] = 0x4FA3D1};
    const struct sadmm_shape *shape = &world->shapes[slot];
    const uint32_t usual = shape->sensor ? 0x9ACD32 : by_type[world->bodies[shape->body].type];
    return draw->shape_colour ? draw->shape_colour(draw->user, sadmm_world_shape_id(world, slot), usual) : usual;
}

/* In the frame that its size, its block or its vertices are in. */
static struct sadmm_pen pen_of(const sadmm_world *world, const sadmm_draw *draw, size_t slot,
                               const struct sadmm_placed *placed)
{
    struct sadmm_pen pen = {.draw = draw, .colour = colour_of(world, draw, slot)};
    struct sadmm_placed frame = *placed;
    if (placed->geometry.type == SADMM_SHAPE_MESH) {
        const struct sadmm_world_block_shape *kept = &world->block_shapes[slot];
        const struct sadmm_rigid *rigid = &world->bodies[placed->body].rigid;
        placed_pose(kept->position, kept->orientation, rigid->position, rigid->orientation, &frame);
    }
    for (int k = 0; k < 3; ++k) pen.R.r[k] = v3_load(frame.R + 3 * k);
    pen.x = v3_load(frame.x);
    return pen;
}

static void draw_faces(const sadmm_world *world, const struct sadmm_pen *pen, const struct sadmm_placed *placed)
{
    const struct sadmm_geometry *geometry = &placed->geometry;
    switch ((sadmm_shape_type)geometry->type) {
    case SADMM_SHAPE_SPHERE:
    case SADMM_SHAPE_CAPSULE:
    case SADMM_SHAPE_CYLINDER:
    case SADMM_SHAPE_CONE:
    case SADMM_SHAPE_ELLIPSOID: sadmm_draw_round_faces(pen, geometry); break;
    case SADMM_SHAPE_BOX: sadmm_draw_box_faces(pen, geometry->size); break;
    case SADMM_SHAPE_PLANE: sadmm_draw_plane_faces(pen); break;
    case SADMM_SHAPE_HULL: sadmm_draw_hull_faces(pen, placed->blocks + geometry->hull); break;
    case SADMM_SHAPE_MESH: sadmm_draw_mesh_faces(pen, world->block_shapes[placed->slot].mesh); break;
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
}

static void draw_edges(const sadmm_world *world, const struct sadmm_pen *pen, const struct sadmm_placed *placed)
{
    const struct sadmm_geometry *geometry = &placed->geometry;
    switch ((sadmm_shape_type)geometry->type) {
    case SADMM_SHAPE_SPHERE:
    case SADMM_SHAPE_CAPSULE:
    case SADMM_SHAPE_CYLINDER:
    case SADMM_SHAPE_CONE:
    case SADMM_SHAPE_ELLIPSOID: sadmm_draw_round_edges(pen, geometry); break;
    case SADMM_SHAPE_BOX: sadmm_draw_box_edges(pen, geometry->size); break;
    case SADMM_SHAPE_PLANE: sadmm_draw_plane_edges(pen); break;
    case SADMM_SHAPE_HULL: sadmm_draw_hull_edges(pen, placed->blocks + geometry->hull); break;
    case SADMM_SHAPE_MESH: sadmm_draw_mesh_edges(pen, world->block_shapes[placed->slot].mesh); break;
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
}

static void draw_bounds(const sadmm_draw *draw, const struct sadmm_box3 *box, uint32_t colour)
{
    struct sadmm_pen pen = {.draw = draw, .colour = colour};
    double half[3];
    for (int k = 0; k < 3; ++k) {
        pen.R.r[k] = v3_axis(k, 1);
        half[k] = (box->hi[k] - box->lo[k]) / 2;
    }
    pen.x = v3((box->hi[0] + box->lo[0]) / 2, (box->hi[1] + box->lo[1]) / 2, (box->hi[2] + box->lo[2]) / 2);
    sadmm_draw_box_edges(&pen, half);
}

static void draw_shape(const sadmm_world *world, const sadmm_draw *draw, size_t slot)
{
    struct sadmm_placed placed;
    struct sadmm_box3 box = {{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, {HUGE_VAL, HUGE_VAL, HUGE_VAL}}; /* of a plane */
    sadmm_world_place_shape(world, (uint32_t)slot, &placed);
    const bool plane = placed.geometry.type == SADMM_SHAPE_PLANE;
    if (!plane) placed_box(&placed, &box);
    if (!sees_box(draw, &box)) return;
    const struct sadmm_pen pen = pen_of(world, draw, slot, &placed);
    if (draw->flags & SADMM_DRAW_SHAPES) draw_faces(world, &pen, &placed);
    if (draw->flags & SADMM_DRAW_EDGES) draw_edges(world, &pen, &placed);
    if (draw->flags & SADMM_DRAW_BOUNDS && !plane) draw_bounds(draw, &box, pen.colour);
    const char *name = sadmm_tags_name(&world->shape_ids.tags, slot);
    if (draw->flags & SADMM_DRAW_NAMES && draw->text && *name) draw->text(draw->user, placed.x, name, pen.colour);
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_world_prepare_draw(sadmm_world *world)
{
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_world_download_bodies(world));
    TRY(sadmm_world_download_contacts(world));
    return sadmm_world_download_joints(world);
}

sadmm_status sadmm_world_debug_draw(const sadmm_world *world, const sadmm_draw *given)
{
    enum {
        OF_SHAPES = SADMM_DRAW_SHAPES | SADMM_DRAW_EDGES | SADMM_DRAW_BOUNDS | SADMM_DRAW_NAMES,
        OF_JOINTS = SADMM_DRAW_JOINTS | SADMM_DRAW_NAMES,
        OF_CONTACTS = SADMM_DRAW_CONTACTS | SADMM_DRAW_FORCES,
        OF_BODIES = SADMM_DRAW_CENTRES | SADMM_DRAW_NAMES
    };
    sadmm_draw draw;
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_growing_take(&growing, &draw, given, "draw", NULL));
    TRY(check(&draw));
    if (world->resident.running || world->resident.bodies_behind || world->resident.contacts_behind ||
        world->resident.joints_behind)
        return sadmm_fail(NULL, SADMM_ERROR_UNAVAILABLE,
                          "the device has steps that were not read back: call sadmm_world_prepare_draw first");
    for (SADMM_OBJECTS(slot, &world->shape_ids))
        if (draw.flags & OF_SHAPES && sadmm_draw_sees_body(world, &draw, world->shapes[slot].body))
            draw_shape(world, &draw, slot);
    if (draw.flags & OF_BODIES) sadmm_draw_bodies(world, &draw);
    if (draw.flags & OF_JOINTS) sadmm_draw_joints(world, &draw);
    if (draw.flags & SADMM_DRAW_COUPLINGS) sadmm_draw_couplings(world, &draw);
    if (draw.flags & OF_CONTACTS) sadmm_draw_contacts(world, &draw);
    if (draw.flags & SADMM_DRAW_ISLANDS) sadmm_draw_islands(world, &draw);
    return SADMM_OK;
}
