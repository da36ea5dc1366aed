/* Scene files: an input that begins with { is the text itself. Others damage a good file, the export of a small scene
 * of the library or one that has everything: its values are replaced, moved, doubled and taken away, its members called
 * something else, and then some of its bytes. Whatever it is:
 *
 *   - it is refused, on opening or on building, with a reason and nothing in hand, or
 *   - what is written of its world (of one in eight that were damaged) is read again, to the same states and the same
 *     text, and what is read makes a step or says why not
 *   - a file that was not damaged is not refused
 */
#include <jansson.h>
#include <string.h>

#include "bytes.h"
#include "core/base/memory.h"
#include "scenes/scenes.h"

/* ---- good files -------------------------------------------------------------------------------------------------- */

/* With ' for ". */
static const char everything[] =
    "{'format': 'subadmm scene', 'format_version': 1, 'scene': 's', 'name': 'n', 'description': 'd',"
    "'n': 3, 'm': null, 'duration': 2, 'iterations': {'paper': 30, 'fast': 10}, 'substeps': {'fast': 2},"
    "'precision': 'f32', 'contact_margin': 0.1, 'friction_of_a_pair': 'geometric mean',"
    "'settings': {'dt': 0.01, 'method': 'paper', 'gravity': [0, 1, -9], 'warm_start': false, 'slop': 0},"
    "'bodies': [{'index': 0, 'name': 'ground', 'type': 'static', 'environment': -1, 'shapes': ["
    "{'type': 'plane', 'size': [], 'index': 1}, {'type': 'mesh', 'mesh': 0, 'index': 0},"
    "{'type': 'mesh', 'mesh': 1, 'index': 2}]},"
    "{'name': 'a', 'mass': 1, 'inertia': [1, 1, 1], 'position': [0, 0, 3], 'orientation': [0.6, 0, 0.8, 0],"
    "'force': [1, 2, 3], 'torque': [0, 0, 1], 'gravity_scale': 0.5, 'linear_damping': 1, 'angular_damping': 2,"
    "'linear_velocity': [1, 0, 0], 'shapes': [{'type': 'box', 'size': [1, 1, 1], 'index': 4, 'category': 3},"
    "{'type': 'cone', 'size': [0.5, 1], 'orientation': [0, 0.6, 0, 0.8], 'index': 3, 'mask': 7}]},"
    "{'name': 'b', 'mass': 2, 'inertia': [1, 2, 3], 'position': [5, 0, 3], 'shapes': ["
    "{'type': 'capsule', 'size': [1, 2], 'index': 5, 'friction': 0.1, 'restitution': 1}]},"
    "{'name': 'belt', 'type': 'kinematic', 'position': [0, 9, 3], 'move': {'position': [0, 9, 4],"
    "'orientation': [1, 0, 0, 0]}, 'angular_velocity': [0, 0, 1], 'shapes': []},"
    "{'name': 'c', 'density': 1000, 'position': [9, 0, 3], 'orientation': [0.6, 0, 0.8, 0], 'shapes': ["
    "{'type': 'box', 'size': [1, 2, 1], 'index': 6}, {'type': 'cylinder', 'size': [0.5, 1], 'index': 7,"
    "'position': [1, 0, 0.2]}, {'type': 'sphere', 'size': [1], 'sensor': true, 'index': 8}]}],"
    "'meshes': [{'vertices': [[0, 0, 0], [1, 0, 0.1], [0, 1, 0], [1, 1, 0]], 'triangles': [[0, 1, 2], [2, 1, 3]]},"
    "{'heights': [[0, 0, 0.3], [0, 1, 0]], 'spacing': [1, 2]}],"
    "'joints': [{'kind': 'revolute', 'body_b': 'a', 'position_a': [0, 0, 3], 'orientation_b': [0.6, 0, 0.8, 0],"
    "'coordinates': [null, null, null, null, null, {'limits': [-1, null], 'drive': 'speed', 'target_speed': 1,"
    "'drive_force': 3, 'friction': 0.1, 'armature': 0.1}], 'break_torque': 100},"
    "{'kind': 'prismatic', 'body_a': 3, 'body_b': 2, 'coordinates': [null, null, {'drive': 'position',"
    "'drive_stiffness': 1, 'drive_damping': 1, 'spring_stiffness': 1, 'spring_damping': 1, 'spring_rest': 0.1,"
    "'target_position': 0.2, 'spring_table': {'positions': [0, 1, 2], 'forces': [0, 2, 1]}}, null, null, null]},"
    "{'kind': 'custom', 'locks': 7, 'body_a': 1, 'body_b': 2, 'collide': true, 'enabled': false},"
    "{'kind': 'distance', 'length': 5, 'body_a': 1, 'body_b': 2, 'break_force': 1000},"
    "{'kind': 'spherical', 'body_b': 'c', 'position_b': [1, 0, 0]}],"
    "'couplings': [{'body': 1, 'target_position': [0, 0, 4], 'target_velocity': [0, 0, 1, 0, 0, 0],"
    "'linear_stiffness': 100, 'linear_damping': 10, 'angular_stiffness': 1, 'angular_damping': 1,"
    "'max_force': 10, 'max_torque': null, 'enabled': true}, {'body': 'c', 'position': [0, 1, 0]}],"
    "'gears': [{'joint_1': 0, 'coordinate_1': 5, 'joint_2': 1, 'coordinate_2': 2, 'ratio': -2,"
    "'offset': null}],"
    "'pair_friction': [{'body_a': 1, 'shape_a': 1, 'body_b': 2, 'friction': 0.2}],"
    "'contact_off': [{'body_a': 1, 'body_b': 'belt'}]}";

static const char hulls[] =
    "{'format': 'subadmm scene', 'format_version': 1, 'bodies': [{'mass': 1, 'inertia': [1, 1, 1], 'shapes': ["
    "{'type': 'hull', 'hull': 0}, {'type': 'hull', 'hull': 1, 'position': [1, 0, 0]}]}],"
    "'hulls': [{'points': [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], 'convex_radius': 0.1},"
    "{'points': [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [0.5, 0.5, 1.001]], 'merge': 0.01}]}";

/* Small exports. */
static const char *const exported[] = {"incline", "two_balls", "chain:1"};
enum { EXPORTS = sizeof exported / sizeof *exported, GOOD = EXPORTS + 2 };

static bool have_hulls(void)
{
    static const double corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    sadmm_hull_def def = sadmm_hull_def_default();
    sadmm_hull *hull = NULL;
    def.points = corners;
    def.point_count = 4;
    const bool have = sadmm_hull_create(&def, &hull) == SADMM_OK;
    sadmm_hull_destroy(hull);
    return have;
}

static char *text_of(const struct sadmm_scene *scene, sadmm_world *world, size_t *length)
{
    char *text = NULL;
    struct sadmm_error error = {0};
    FILE *stream = open_memstream(&text, length);
    MUST(stream && sadmm_scene_write(scene, "spec", world, stream, &error) == SADMM_OK, "%s", error.message);
    fclose(stream);
    return text;
}

/* The k-th good file, parsed once. */
static const json_t *good_file(int k)
{
    static json_t *files[GOOD];
    if (files[k]) return files[k];
    if (k < EXPORTS) {
        struct sadmm_scene scene;
        struct sadmm_error error = {0};
        sadmm_world *world;
        size_t length;
        MUST(sadmm_scene_open(exported[k], &scene, &error) == SADMM_OK, "%s", error.message);
        MUST(sadmm_scene_build(&scene, &world, &error) == SADMM_OK, "%s", error.message);
        char *text = text_of(&scene, world, &length);
        files[k] = json_loadb(text, length, 0, NULL);
        free(text);
        sadmm_world_destroy(world);
    } else {
        char text[8192];
        snprintf(text, sizeof text, "%s", k == EXPORTS || !have_hulls() ? everything : hulls);
        for (char *at = text; (at = strchr(at, '\'')) != NULL;) *at = '"';
        files[k] = json_loads(text, 0, NULL);
    }
    MUST(files[k], "a good file is no JSON");
    return files[k];
}

/* ---- damage to values -------------------------------------------------------------------------------------------- */

/* A value's place: the object or array that it is in, and where. */
struct place {
    json_t *parent;
    const char *name; /* in an object */
    size_t index;     /* in an array */
};

/* Somewhere below `root`, which has something in it. */
static struct place take_place(struct bytes *in, json_t *root)
{
    struct place place = {0};
    for (json_t *at = root; at;) {
        const size_t count = json_is_object(at) ? json_object_size(at) : json_array_size(at);
        if (count == 0 || (place.parent && take_choice(in, 8) == 0)) break;
        const size_t nth = ((size_t)take_byte(in) << 8 | take_byte(in)) % count;
        place = (struct place){.parent = at, .index = nth};
        if (json_is_array(at)) {
            at = json_array_get(at, nth);
            continue;
        }
        void *each = json_object_iter(at);
        for (size_t k = 0; k < nth; ++k) each = json_object_iter_next(at, each);
        place.name = json_object_iter_key(each);
        at = json_object_iter_value(each);
    }
    return place;
}

static json_t *value_at(const struct place *place)
{
    return place->name ? json_object_get(place->parent, place->name) : json_array_get(place->parent, place->index);
}

static void put(const struct place *place, json_t *value)
{
    if (place->name) json_object_set_new(place->parent, place->name, value);
    else json_array_set_new(place->parent, place->index, value);
}

static const char *take_word(struct bytes *in)
{
    static const char *const words[] = {
        "",
        "a",
        "b",
        "ground",
        "belt",
        "index",
        "type",
        "size",
        "mass",
        "hull",
        "mesh",
        "shapes",
        "bodies",
        "points",
        "heights",
        "dynamic",
        "static",
        "kinematic",
        "plane",
        "sphere",
        "capsule",
        "box",
        "cylinder",
        "cone",
        "ellipsoid",
        "fixed",
        "revolute",
        "prismatic",
        "cylindrical",
        "spherical",
        "universal",
        "planar",
        "cartesian",
        "custom",
        "distance",
        "spring",
        "link",
        "speed",
        "position",
        "off",
        "f32",
        "f64",
        "paper",
        "fast",
        "vertices",
        "triangles",
        "limits",
        "coordinates",
        "spring_table",
        "move",
        "joints",
        "gears",
        "couplings",
        "pair_friction",
        "contact_off",
        "locks",
        "a name of more than sixty-three bytes, which is one too many for it",
        "\xc3\xa9\x1b[2J",
    };
    return words[take_choice(in, (int)(sizeof words / sizeof *words))];
}

static json_t *take_value(struct bytes *in, json_t *root)
{
    const double x = take_extreme(in);
    struct place other;
    json_t *value;
    switch (take_choice(in, 12)) {
    case 0: return json_null();
    case 1: return json_boolean(take_choice(in, 2));
    case 2: return json_string(take_word(in));
    case 3: return json_array();
    case 4: return json_object();
    case 5: return json_integer(take_choice(in, 8) - 2);
    case 6: return isfinite(x) ? json_real(x) : json_null();
    case 7: return json_real(take_scale(in, 1e-10, 1e10));
    case 8: return json_pack("[fff]", take_in(in, -2, 2), take_in(in, -2, 2), take_in(in, -2, 2));
    case 9: {
        double q[4];
        take_orientation(in, q);
        for (int k = 0; k < 4; ++k) q[k] = isfinite(q[k]) ? q[k] : 0;
        return json_pack("[ffff]", q[0], q[1], q[2], q[3]);
    }
    default: /* one from elsewhere */
        other = take_place(in, root);
        value = other.parent ? json_deep_copy(value_at(&other)) : NULL;
        return value ? value : json_null();
    }
}

static void damage_value(struct bytes *in, json_t *root)
{
    const struct place place = take_place(in, root);
    json_t *value;
    if (!place.parent) return;
    switch (take_choice(in, 8)) {
    case 0: /* away */
        if (place.name) json_object_del(place.parent, place.name);
        else json_array_remove(place.parent, place.index);
        return;
    case 1: /* once more, or under another name */
        value = json_deep_copy(value_at(&place));
        if (place.name) json_object_set_new(place.parent, take_word(in), value);
        else json_array_insert_new(place.parent, (size_t)take_byte(in) % (json_array_size(place.parent) + 1), value);
        return;
    case 2: /* a new member or element */
        value = take_value(in, root);
        if (place.name) json_object_set_new(place.parent, take_word(in), value);
        else json_array_append_new(place.parent, value);
        return;
    case 3: /* a number near the one that is there */
        value = value_at(&place);
        if (json_is_number(value)) {
            static const double factors[] = {-1, 0, 0.5, 2, 10, 1e3, 1e-3, 1e9, 1.0000000000000002, 1.0000005};
            const double x = json_number_value(value) * factors[take_choice(in, 10)];
            put(&place, isfinite(x) ? json_real(x) : json_null());
            return;
        }
        /* fallthrough */
    default: put(&place, take_value(in, root));
    }
}

/* ---- what must hold ---------------------------------------------------------------------------------------------- */

static void check_refusal(sadmm_status status, const struct sadmm_error *error, bool no_memory)
{
    MUST(status == SADMM_ERROR_INVALID_ARGUMENT || status == SADMM_ERROR_LIMIT ||
             (status == SADMM_ERROR_UNAVAILABLE && strstr(error->message, "qhull")) ||
             (status == SADMM_ERROR_OUT_OF_MEMORY && no_memory),
         "%s: %s", sadmm_status_name(status), error->message);
    MUST(error->message[0], "%s without a message", sadmm_status_name(status));
}

/* Open and build; NULL: refused. */
static sadmm_world *world_of(const char *text, size_t length, struct sadmm_scene *scene, long allocations,
                             struct sadmm_error *error)
{
    sadmm_world *world = NULL;
    memset(error, 0, sizeof *error);
    sadmm_test_fail_allocations_after(allocations);
    sadmm_status status = sadmm_scene_open_text(text, length, "file", scene, error);
    const bool opened = status == SADMM_OK;
    if (opened) status = sadmm_scene_build(scene, &world, error);
    sadmm_test_fail_allocations_after(-1);
    if (status == SADMM_OK) return world;
    check_refusal(status, error, allocations >= 0);
    MUST(!world, "a world after %s", error->message);
    if (opened) sadmm_scene_close(scene);
    return NULL;
}

static uint64_t hash_of(sadmm_world *world)
{
    uint64_t hash;
    MUST(sadmm_world_state_hash(world, &hash) == SADMM_OK, "%s", sadmm_world_message(world));
    return hash;
}

/* Few iterations, so that no input takes long. */
static void step(sadmm_world *world)
{
    sadmm_settings s = sadmm_world_settings(world);
    s.iterations = s.iterations < 20 ? s.iterations : 20;
    s.substeps = 1;
    s.threads = 1;
    MUST(sadmm_world_set_settings(world, &s) == SADMM_OK, "%s", sadmm_world_message(world));
    const sadmm_status status = sadmm_world_step(world);
    MUST(status == SADMM_OK || status == SADMM_ERROR_NON_FINITE || status == SADMM_ERROR_LIMIT, "%s: %s",
         sadmm_status_name(status), sadmm_world_message(world));
}

static void check_comes_back(const struct sadmm_scene *scene, sadmm_world *world, bool steps)
{
    struct sadmm_scene file;
    struct sadmm_error error;
    size_t length, again_length;
    char *text = text_of(scene, world, &length);
    sadmm_world *copy = world_of(text, length, &file, -1, &error);
    MUST(copy, "what was written is refused: %s\n%s", error.message, text);
    char *again = text_of(&file, copy, &again_length);
    MUST(length == again_length && memcmp(text, again, length) == 0, "another text:\n%s\n%s", text, again);
    MUST(hash_of(world) == hash_of(copy), "other states:\n%s", text);
    if (steps) {
        step(world);
        step(copy);
        MUST(hash_of(world) == hash_of(copy), "other states after a step:\n%s", text);
    }
    sadmm_world_destroy(copy);
    sadmm_scene_close(&file);
    free(text);
    free(again);
}

/* The text of an input; *whole: nothing was done to it. */
static char *make_text(struct bytes *in, size_t *length, bool *whole)
{
    const size_t size = (size_t)(in->end - in->at);
    if (size > 0 && *in->at == '{') {
        char *text = malloc(size);
        MUST(text, "memory");
        memcpy(text, in->at, size);
        in->at = in->end;
        *length = size;
        return text;
    }
    json_t *root = json_deep_copy(good_file(take_choice(in, GOOD)));
    const int values = take_choice(in, take_rarely(in, 8) ? 24 : 4),
              bytes = take_rarely(in, 8) ? take_choice(in, 4) : 0;
    for (int k = 0; k < values; ++k) damage_value(in, root);
    char *text = json_dumps(root, JSON_COMPACT | JSON_REAL_PRECISION(17));
    MUST(text, "memory");
    json_decref(root);
    *length = strlen(text);
    for (int k = 0; k<bytes && * length> 0; ++k)
        text[((size_t)take_byte(in) << 8 | take_byte(in)) % *length] = (char)take_byte(in);
    *whole = values == 0 && bytes == 0;
    char *exact = malloc(*length); /* so that the address sanitizer sees a read past the end */
    MUST(exact, "memory");
    memcpy(exact, text, *length);
    free(text);
    return exact;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct bytes in = bytes_of(data, size);
    struct sadmm_scene scene;
    struct sadmm_error error;
    size_t length;
    bool whole = false;
    char *text = make_text(&in, &length, &whole);
    const long allocations = take_rarely(&in, 16) ? take_choice(&in, 128) : -1;
    sadmm_world *world = world_of(text, length, &scene, allocations, &error);
    MUST(world || !whole || allocations >= 0, "a good file is refused: %s", error.message);
    if (world) {
        if (whole || one_input_in(data, size, 8)) check_comes_back(&scene, world, one_input_in(data, size, 16));
        sadmm_world_destroy(world);
        sadmm_scene_close(&scene);
    }
    free(text);
    return 0;
}
