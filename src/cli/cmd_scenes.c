/* subadmm scenes: the list, or one whole scene as JSON so that another program can rebuild it. */

#include "cli.h"
#include "core/base/memory.h"
#include "scenes/scenes.h"
#include "subadmm/coupling.h"
#include "subadmm/gear.h"
#include "subadmm/joint.h"

enum { OPTION_JSON };

static const struct cli_option options[] = {
    [OPTION_JSON] = {"json", "[FILE|-]", "write JSON to FILE, or to standard output (-, the default)"},
};

static int set_option(void *target, size_t index, const char *value)
{
    (void)index;
    return cli_read_output("--json", value, target) ? CLI_DONE : CLI_USAGE;
}

/* A step, by method. */
static json_t *iterations_json(const struct sadmm_scene_info *info)
{
    json_t *o = json_object();
    for (int m = 0; m < SADMM_METHOD_COUNT; ++m)
        json_object_set_new(o, cli_method_name((sadmm_method)m), json_integer(info->iterations[m]));
    return o;
}

static json_t *substeps_json(const struct sadmm_scene_info *info)
{
    const int fast = info->substeps > 0 ? info->substeps : 1;
    return json_pack("{si, si}", cli_method_name(SADMM_METHOD_PAPER), 1, cli_method_name(SADMM_METHOD_FAST), fast);
}

/* ---- the list ---------------------------------------------------------------------------------------------------- */

static json_t *list_json(void)
{
    json_t *array = json_array();
    for (size_t k = 0; k < sadmm_scene_count(); ++k) {
        const struct sadmm_scene_info *info = sadmm_scene_at(k);
        json_t *o = json_object();
        json_object_set_new(o, "name", json_string(info->name));
        json_object_set_new(o, "arguments", json_string(info->arguments));
        json_object_set_new(o, "description", json_string(info->description));
        json_object_set_new(o, "duration", cli_json_real(info->duration));
        json_object_set_new(o, "iterations", iterations_json(info));
        json_object_set_new(o, "substeps", substeps_json(info));
        json_array_append_new(array, o);
    }
    return array;
}

static void list_text(void)
{
    for (size_t k = 0; k < sadmm_scene_count(); ++k) {
        const struct sadmm_scene_info *info = sadmm_scene_at(k);
        int width = printf("%s%s", info->name, info->arguments);
        printf("%*s%6.3g s   %s\n", width < 24 ? 24 - width : 1, "", info->duration, info->description);
    }
}

/* ---- one scene --------------------------------------------------------------------------------------------------- */

static const char *const shape_names[SADMM_SHAPE_TYPE_COUNT] = {
    [SADMM_SHAPE_PLANE] = "plane",
    [SADMM_SHAPE_SPHERE] = "sphere",
    [SADMM_SHAPE_CAPSULE] = "capsule",
    [SADMM_SHAPE_BOX] = "box",
    [SADMM_SHAPE_HULL] = "hull",
    [SADMM_SHAPE_MESH] = "mesh",
    [SADMM_SHAPE_CYLINDER] = "cylinder",
    [SADMM_SHAPE_CONE] = "cone",
    [SADMM_SHAPE_ELLIPSOID] = "ellipsoid",
};
static const size_t shape_sizes[SADMM_SHAPE_TYPE_COUNT] = {
    [SADMM_SHAPE_PLANE] = 0, [SADMM_SHAPE_SPHERE] = 1, [SADMM_SHAPE_CAPSULE] = 2, [SADMM_SHAPE_BOX] = 3,
    [SADMM_SHAPE_HULL] = 0, [SADMM_SHAPE_MESH] = 0, [SADMM_SHAPE_CYLINDER] = 2, [SADMM_SHAPE_CONE] = 2,
    [SADMM_SHAPE_ELLIPSOID] = 3,
};

/* The hulls of a scene's shapes, each once. */
struct hulls {
    json_t *vertices; /* of each: the points */
    const sadmm_hull **list;
    size_t count, capacity;
};

static json_t *vertices_json(const sadmm_hull *hull)
{
    json_t *array = json_array();
    for (int32_t v = 0; v < sadmm_hull_vertex_count(hull); ++v)
        json_array_append_new(array, cli_json_reals(sadmm_hull_vertices(hull) + 3 * v, 3));
    return array;
}

/* The number of a hull in the list, or -1: out of memory. */
static json_int_t hull_index(struct hulls *hulls, const sadmm_hull *hull)
{
    for (size_t k = hulls->count; k-- > 0;) /* the next shape mostly has the hull of the last one */
        if (hulls->list[k] == hull) return (json_int_t)k;
    if (!sadmm_grow(&hulls->list, &hulls->capacity, hulls->count, hulls->count + 1, sizeof *hulls->list)) return -1;
    hulls->list[hulls->count] = hull;
    json_array_append_new(hulls->vertices, vertices_json(hull));
    return (json_int_t)hulls->count++;
}

/* The meshes of a scene's shapes, each once. */
struct meshes {
    json_t *array;
    const sadmm_mesh **list;
    size_t count, capacity;
};

/* Heights row by row. */
static json_t *heights_json(const sadmm_mesh *mesh, int32_t columns, int32_t rows, const double spacing[2])
{
    json_t *o = json_object(), *heights = json_array();
    for (int32_t row = 0; row < rows; ++row) {
        json_t *line = json_array();
        for (int32_t column = 0; column < columns; ++column) {
            double x[3] = {0};
            sadmm_mesh_vertex_at(mesh, (int64_t)row * columns + column, x);
            json_array_append_new(line, cli_json_real(x[2]));
        }
        json_array_append_new(heights, line);
    }
    json_object_set_new(o, "heights", heights);
    json_object_set_new(o, "spacing", cli_json_reals(spacing, 2));
    return o;
}

/* In the order of the definition. NULL: out of memory. */
static json_t *triangles_json(const sadmm_mesh *mesh)
{
    const int64_t count = sadmm_mesh_triangle_count(mesh), all = count + sadmm_mesh_left_out(mesh);
    int64_t *at = (int64_t *)sadmm_alloc((size_t)all, sizeof *at); /* by number: 1 + the triangle, 0: left out */
    json_t *o = json_object(), *vertices = json_array(), *triangles = json_array();
    int32_t corner[3], number = 0;
    for (int64_t t = 0; at && t < count; ++t)
        if (sadmm_mesh_triangle_at(mesh, t, corner, &number) == SADMM_OK) at[number] = 1 + t;
    for (int64_t v = 0; v < sadmm_mesh_vertex_count(mesh); ++v) {
        double x[3] = {0};
        sadmm_mesh_vertex_at(mesh, v, x);
        json_array_append_new(vertices, cli_json_reals(x, 3));
    }
    for (int64_t k = 0; at && k < all; ++k)
        if (at[k] && sadmm_mesh_triangle_at(mesh, at[k] - 1, corner, &number) == SADMM_OK)
            json_array_append_new(triangles, json_pack("[iii]", corner[0], corner[1], corner[2]));
    json_object_set_new(o, "vertices", vertices);
    json_object_set_new(o, "triangles", triangles);
    if (!at) json_decref(o);
    sadmm_free(at);
    return at ? o : NULL;
}

static json_t *mesh_json(const sadmm_mesh *mesh)
{
    int32_t columns = 0, rows = 0;
    double spacing[2];
    sadmm_mesh_grid(mesh, &columns, &rows, spacing);
    return columns > 0 ? heights_json(mesh, columns, rows, spacing) : triangles_json(mesh);
}

/* The number of a mesh in the list, or -1: out of memory. */
static json_int_t mesh_index(struct meshes *meshes, const sadmm_mesh *mesh)
{
    for (size_t k = meshes->count; k-- > 0;)
        if (meshes->list[k] == mesh) return (json_int_t)k;
    const size_t needed = meshes->count + 1;
    if (!sadmm_grow(&meshes->list, &meshes->capacity, meshes->count, needed, sizeof *meshes->list)) return -1;
    json_t *told = mesh_json(mesh);
    if (!told) return -1;
    meshes->list[meshes->count] = mesh;
    json_array_append_new(meshes->array, told);
    return (json_int_t)meshes->count++;
}

static json_t *shape_json(const sadmm_shape_def *shape)
{
    json_t *o = json_object();
    json_object_set_new(o, "type", json_string(shape_names[shape->type]));
    json_object_set_new(o, "size", cli_json_reals(shape->size, shape_sizes[shape->type]));
    json_object_set_new(o, "position", cli_json_reals(shape->position, 3));
    json_object_set_new(o, "orientation", cli_json_reals(shape->orientation, 4));
    json_object_set_new(o, "friction", cli_json_real(shape->friction));
    json_object_set_new(o, "restitution", cli_json_real(shape->restitution));
    json_object_set_new(o, "category", json_integer(shape->category));
    json_object_set_new(o, "mask", json_integer(shape->mask));
    return o;
}

static json_t *body_json(int32_t index, const sadmm_body_def *body)
{
    bool dynamic = body->type == SADMM_BODY_DYNAMIC;
    json_t *o = json_object();
    json_object_set_new(o, "index", json_integer(index));
    json_object_set_new(o, "name", json_string(body->name ? body->name : ""));
    json_object_set_new(o, "type", json_string(dynamic                                ? "dynamic"
                                                 : body->type == SADMM_BODY_STATIC ? "static"
                                                                                   : "kinematic"));
    json_object_set_new(o, "mass", dynamic ? cli_json_real(body->mass) : json_null());
    json_object_set_new(o, "inertia", dynamic ? cli_json_reals(body->inertia, 3) : json_null());
    json_object_set_new(o, "position", cli_json_reals(body->position, 3));
    json_object_set_new(o, "orientation", cli_json_reals(body->orientation, 4));
    json_object_set_new(o, "linear_velocity", cli_json_reals(body->linear_velocity, 3));
    json_object_set_new(o, "angular_velocity", cli_json_reals(body->angular_velocity, 3));
    json_object_set_new(o, "environment", json_integer(body->environment));
    json_object_set_new(o, "shapes", json_array());
    return o;
}

static sadmm_status add_bodies(sadmm_world *world, json_t *bodies)
{
    for (int32_t k = 0; k < sadmm_world_body_count(world); ++k) {
        sadmm_body_id id;
        sadmm_body_def def;
        sadmm_status status = sadmm_world_body_at(world, k, &id);
        if (status == SADMM_OK) status = sadmm_world_body_def(world, id, &def);
        if (status != SADMM_OK) return status;
        json_array_append_new(bodies, body_json(k, &def));
    }
    return SADMM_OK;
}

/* The entry of a body in the array: bodies are listed in order of their slots. */
static json_t *find_body(sadmm_world *world, json_t *bodies, sadmm_body_id wanted)
{
    int32_t lo = 0, hi = sadmm_world_body_count(world) - 1;
    while (lo <= hi) {
        int32_t middle = lo + (hi - lo) / 2;
        sadmm_body_id id;
        if (sadmm_world_body_at(world, middle, &id) != SADMM_OK) return NULL;
        if (id.slot == wanted.slot) return json_array_get(bodies, (size_t)middle);
        if (id.slot < wanted.slot) lo = middle + 1;
        else hi = middle - 1;
    }
    return NULL;
}

/* What a shape refers to. */
static sadmm_status add_form(const sadmm_shape_def *def, json_t *shape, struct hulls *hulls, struct meshes *meshes)
{
    if (def->hull) {
        const json_int_t index = hull_index(hulls, def->hull);
        if (index < 0) return sadmm_fail_memory(NULL, "the list of hulls");
        json_object_set_new(shape, "hull", json_integer(index));
        json_object_set_new(shape, "rounding", cli_json_real(sadmm_hull_rounding(def->hull)));
    }
    if (def->mesh) {
        const json_int_t index = mesh_index(meshes, def->mesh);
        if (index < 0) return sadmm_fail_memory(NULL, "the list of meshes");
        json_object_set_new(shape, "mesh", json_integer(index));
    }
    return SADMM_OK;
}

static sadmm_status add_shapes(sadmm_world *world, json_t *bodies, struct hulls *hulls, struct meshes *meshes)
{
    for (int32_t k = 0; k < sadmm_world_shape_count(world); ++k) {
        sadmm_shape_id id;
        sadmm_shape_def def;
        sadmm_body_id body;
        sadmm_status status = sadmm_world_shape_at(world, k, &id);
        if (status == SADMM_OK) status = sadmm_world_shape_def(world, id, &def, &body);
        if (status != SADMM_OK) return status;
        json_t *shape = shape_json(&def);
        json_array_append_new(json_object_get(find_body(world, bodies, body), "shapes"), shape);
        status = add_form(&def, shape, hulls, meshes);
        if (status != SADMM_OK) return status;
    }
    return SADMM_OK;
}

static const char *const joint_kinds[SADMM_JOINT_KIND_COUNT] = {
    [SADMM_JOINT_FIXED] = "fixed",         [SADMM_JOINT_REVOLUTE] = "revolute",   [SADMM_JOINT_PRISMATIC] = "prismatic",
    [SADMM_JOINT_CYLINDRICAL] = "cylindrical", [SADMM_JOINT_SPHERICAL] = "spherical",
    [SADMM_JOINT_UNIVERSAL] = "universal", [SADMM_JOINT_PLANAR] = "planar",       [SADMM_JOINT_CARTESIAN] = "cartesian",
    [SADMM_JOINT_CUSTOM] = "custom",       [SADMM_JOINT_DISTANCE] = "distance",   [SADMM_JOINT_SPRING] = "spring",
    [SADMM_JOINT_LINK] = "link",
};
static const char *const drives[SADMM_DRIVE_COUNT] = {"off", "speed", "position"};

/* What is infinite is null. */
static json_t *coordinate_json(const sadmm_joint_coordinate *c)
{
    json_t *o = json_object();
    json_object_set_new(o, "limits", c->limited ? cli_json_reals(&c->lower, 2) : json_null());
    json_object_set_new(o, "drive", json_string(drives[c->drive]));
    json_object_set_new(o, "target_position", cli_json_real(c->target_position));
    json_object_set_new(o, "target_speed", cli_json_real(c->target_speed));
    json_object_set_new(o, "drive_stiffness", cli_json_real(c->drive_stiffness));
    json_object_set_new(o, "drive_damping", cli_json_real(c->drive_damping));
    json_object_set_new(o, "drive_force", cli_json_real(c->drive_force));
    json_object_set_new(o, "friction", cli_json_real(c->friction));
    json_object_set_new(o, "spring_stiffness", cli_json_real(c->spring_stiffness));
    json_object_set_new(o, "spring_damping", cli_json_real(c->spring_damping));
    json_object_set_new(o, "spring_rest", cli_json_real(c->spring_rest));
    json_object_set_new(o, "armature", cli_json_real(c->armature));
    return o;
}

/* The index of a joint's body in the array, null: the static world. */
static json_t *body_index(sadmm_world *world, json_t *bodies, sadmm_body_id id)
{
    json_t *body = id.slot ? find_body(world, bodies, id) : NULL;
    return body ? json_incref(json_object_get(body, "index")) : json_null();
}

/* Positions and loads; null where there is none. */
static json_t *table_json(sadmm_world *world, sadmm_joint_id id, int32_t index)
{
    double positions[SADMM_MOST_SPRING_POINTS], forces[SADMM_MOST_SPRING_POINTS];
    int32_t count = 0;
    if (sadmm_world_joint_spring_table(world, id, index, positions, forces, &count) != SADMM_OK || !count)
        return json_null();
    json_t *o = json_object();
    json_object_set_new(o, "positions", cli_json_reals(positions, (size_t)count));
    json_object_set_new(o, "forces", cli_json_reals(forces, (size_t)count));
    return o;
}

static json_t *joint_json(sadmm_world *world, json_t *bodies, sadmm_joint_id id, const sadmm_joint_def *joint)
{
    json_t *o = json_object(), *coordinates = json_array();
    json_object_set_new(o, "kind", json_string(joint_kinds[joint->kind]));
    json_object_set_new(o, "locks", json_integer(joint->locks));
    json_object_set_new(o, "body_a", body_index(world, bodies, joint->body_a));
    json_object_set_new(o, "body_b", body_index(world, bodies, joint->body_b));
    json_object_set_new(o, "position_a", cli_json_reals(joint->position_a, 3));
    json_object_set_new(o, "orientation_a", cli_json_reals(joint->orientation_a, 4));
    json_object_set_new(o, "position_b", cli_json_reals(joint->position_b, 3));
    json_object_set_new(o, "orientation_b", cli_json_reals(joint->orientation_b, 4));
    json_object_set_new(o, "length", cli_json_real(joint->length));
    json_object_set_new(o, "collide", json_boolean(joint->collide));
    json_object_set_new(o, "enabled", json_boolean(joint->enabled));
    json_object_set_new(o, "break_force", cli_json_real(joint->break_force));
    json_object_set_new(o, "break_torque", cli_json_real(joint->break_torque));
    for (int k = 0; k < 6; ++k) {
        json_t *coordinate = coordinate_json(&joint->coordinates[k]);
        json_object_set_new(coordinate, "spring_table", table_json(world, id, k));
        json_array_append_new(coordinates, coordinate);
    }
    json_object_set_new(o, "coordinates", coordinates);
    return o;
}

static sadmm_status add_joints(sadmm_world *world, json_t *bodies, json_t *joints)
{
    for (int32_t k = 0; k < sadmm_world_joint_count(world); ++k) {
        sadmm_joint_id id;
        sadmm_joint_def def;
        sadmm_status status = sadmm_world_joint_at(world, k, &id);
        if (status == SADMM_OK) status = sadmm_world_joint_def(world, id, &def);
        if (status != SADMM_OK) return status;
        json_array_append_new(joints, joint_json(world, bodies, id, &def));
    }
    return SADMM_OK;
}

static json_t *coupling_json(sadmm_world *world, json_t *bodies, const sadmm_coupling_def *coupling)
{
    json_t *o = json_object();
    json_object_set_new(o, "body", body_index(world, bodies, coupling->body));
    json_object_set_new(o, "position", cli_json_reals(coupling->position, 3));
    json_object_set_new(o, "orientation", cli_json_reals(coupling->orientation, 4));
    json_object_set_new(o, "target_position", cli_json_reals(coupling->target_position, 3));
    json_object_set_new(o, "target_orientation", cli_json_reals(coupling->target_orientation, 4));
    json_object_set_new(o, "target_velocity", cli_json_reals(coupling->target_velocity, 6));
    json_object_set_new(o, "linear_stiffness", cli_json_real(coupling->linear_stiffness));
    json_object_set_new(o, "linear_damping", cli_json_real(coupling->linear_damping));
    json_object_set_new(o, "angular_stiffness", cli_json_real(coupling->angular_stiffness));
    json_object_set_new(o, "angular_damping", cli_json_real(coupling->angular_damping));
    json_object_set_new(o, "max_force", cli_json_real(coupling->max_force));
    json_object_set_new(o, "max_torque", cli_json_real(coupling->max_torque));
    json_object_set_new(o, "enabled", json_boolean(coupling->enabled));
    return o;
}

static sadmm_status add_couplings(sadmm_world *world, json_t *bodies, json_t *couplings)
{
    for (int32_t k = 0; k < sadmm_world_coupling_count(world); ++k) {
        sadmm_coupling_id id;
        sadmm_coupling_def def;
        sadmm_status status = sadmm_world_coupling_at(world, k, &id);
        if (status == SADMM_OK) status = sadmm_world_coupling_def(world, id, &def);
        if (status != SADMM_OK) return status;
        json_array_append_new(couplings, coupling_json(world, bodies, &def));
    }
    return SADMM_OK;
}

/* The index of a joint in the array: joints are listed in order of their slots. */
static int32_t joint_index(sadmm_world *world, sadmm_joint_id wanted)
{
    for (int32_t k = 0; k < sadmm_world_joint_count(world); ++k) {
        sadmm_joint_id id;
        if (sadmm_world_joint_at(world, k, &id) == SADMM_OK && id.slot == wanted.slot) return k;
    }
    return -1;
}

static sadmm_status add_gears(sadmm_world *world, json_t *gears)
{
    for (int32_t k = 0; k < sadmm_world_gear_count(world); ++k) {
        sadmm_gear_id id;
        sadmm_gear_def def;
        sadmm_status status = sadmm_world_gear_at(world, k, &id);
        if (status == SADMM_OK) status = sadmm_world_gear_def(world, id, &def);
        if (status != SADMM_OK) return status;
        json_t *o = json_object();
        json_object_set_new(o, "joint_1", json_integer(joint_index(world, def.joint_1)));
        json_object_set_new(o, "coordinate_1", json_integer(def.coordinate_1));
        json_object_set_new(o, "joint_2", json_integer(joint_index(world, def.joint_2)));
        json_object_set_new(o, "coordinate_2", json_integer(def.coordinate_2));
        json_object_set_new(o, "ratio", cli_json_real(def.ratio));
        json_object_set_new(o, "offset", cli_json_real(def.offset));
        json_object_set_new(o, "enabled", json_boolean(def.enabled));
        json_array_append_new(gears, o);
    }
    return SADMM_OK;
}

/* What is on bodies and between them. */
struct parts {
    json_t *bodies, *joints, *couplings, *gears;
    struct hulls hulls;
    struct meshes meshes;
};

static sadmm_status add_parts(sadmm_world *world, struct parts *parts)
{
    sadmm_status status = add_bodies(world, parts->bodies);
    if (status == SADMM_OK) status = add_shapes(world, parts->bodies, &parts->hulls, &parts->meshes);
    if (status == SADMM_OK) status = add_joints(world, parts->bodies, parts->joints);
    if (status == SADMM_OK) status = add_couplings(world, parts->bodies, parts->couplings);
    return status == SADMM_OK ? add_gears(world, parts->gears) : status;
}

static json_t *scene_json(const char *spec, const struct sadmm_scene *scene, const struct parts *parts)
{
    static const char *const units =
        "SI; world frame; quaternions w x y z, body to world; inertia: principal moments in "
        "the body's frame; box: half extents; capsule: radius, half length along z; plane: "
        "half-space z <= 0 of its frame; hull: around the vertices of an entry of hulls, in its frame, and what is within "
        "rounding of that; mesh: an entry of meshes, in its frame: triangles of vertices, counter-clockwise seen from "
        "outside, or heights over a grid of the x-y plane with its middle at the origin, rows along x one after the "
        "other along y, every cell two triangles parted by the diagonal from its lowest x and y to its highest; "
        "cylinder, cone: radius, half height along z, a cone's apex at +z; ellipsoid: semi-axes";
    json_t *o = json_object();
    json_object_set_new(o, "scene", json_string(spec));
    json_object_set_new(o, "name", json_string(scene->info->name));
    json_object_set_new(o, "n", *scene->info->arguments ? json_integer(scene->n) : json_null());
    json_object_set_new(o, "m", scene->m > 0 ? json_integer(scene->m) : json_null());
    json_object_set_new(o, "description", json_string(scene->info->description));
    json_object_set_new(o, "units", json_string(units));
    json_object_set_new(o, "duration", cli_json_real(scene->duration));
    json_object_set_new(o, "iterations", iterations_json(scene->info));
    json_object_set_new(o, "substeps", substeps_json(scene->info));
    json_object_set_new(o, "contact_margin", cli_json_real(scene->def.contact_margin));
    json_object_set_new(o, "friction_of_a_pair", json_string("geometric mean"));
    json_object_set_new(o, "settings", cli_json_settings(&scene->def.settings));
    json_object_set_new(o, "bodies", parts->bodies);
    json_object_set_new(o, "hulls", parts->hulls.vertices);
    json_object_set_new(o, "meshes", parts->meshes.array);
    json_object_set_new(o, "joints", parts->joints);
    json_object_set_new(o, "couplings", parts->couplings);
    json_object_set_new(o, "gears", parts->gears);
    cli_json_add_build(o);
    return o;
}

static int show_scene(const char *spec, struct output *json)
{
    struct sadmm_scene scene;
    struct sadmm_error error = {0};
    sadmm_world *world = NULL;
    if (sadmm_scene_open(spec, &scene, &error) != SADMM_OK) return cli_error(CLI_USAGE, "%s", error.message);
    if (sadmm_scene_build(&scene, &world, &error) != SADMM_OK) return cli_error(CLI_FAILED, "%s", error.message);
    if (!json) {
        printf("%s%s: %s\n%d bodies, %d shapes, %g s, dt = %g s", scene.info->name, scene.info->arguments,
               scene.info->description, sadmm_world_body_count(world), sadmm_world_shape_count(world), scene.duration,
               scene.def.settings.dt);
        if (scene.def.settings.substeps > 1) printf(" in %d sub-steps", scene.def.settings.substeps);
        printf(", %d iterations (paper: %d; --json for all of it)\n", scene.def.settings.iterations,
               scene.info->iterations[SADMM_METHOD_PAPER]);
        sadmm_world_destroy(world);
        return CLI_DONE;
    }
    struct parts parts = {json_array(), json_array(), json_array(), json_array(), {.vertices = json_array()},
                          {.array = json_array()}};
    int code;
    if (add_parts(world, &parts) == SADMM_OK) {
        code = cli_write_json(scene_json(spec, &scene, &parts), json);
    } else {
        json_decref(parts.bodies);
        json_decref(parts.joints);
        json_decref(parts.couplings);
        json_decref(parts.gears);
        json_decref(parts.hulls.vertices);
        json_decref(parts.meshes.array);
        code = cli_error(CLI_FAILED, "%s", sadmm_last_message());
    }
    sadmm_free(parts.hulls.list);
    sadmm_free(parts.meshes.list);
    sadmm_world_destroy(world);
    return code;
}

static int run(int argc, char **argv)
{
    const char *name = NULL, *operands[1];
    struct output *json;
    int code = cli_parse(&cli_scenes, argc, argv, set_option, &name, operands);
    if (code >= 0) return code;
    if ((code = cli_open_json(name, &json)) != CLI_DONE) return code;
    if (operands[0]) return show_scene(operands[0], json);
    if (json) return cli_write_json(list_json(), json);
    list_text();
    return CLI_DONE;
}

const struct cli_command cli_scenes = {
    .name = "scenes",
    .operands = "[SCENE]",
    .summary = "list the scenes, or describe one",
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .operands_max = 1,
    .run = run,
};
