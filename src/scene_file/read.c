/* Opening a scene file: its text, and the head of it. */
#include <errno.h>
#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "file.h"
#include "format.h"

static const double longest = 1e9; /* s */
enum { MOST_ITERATIONS = 1000000, PAPER_ITERATIONS = 100 };

/* ---- text -------------------------------------------------------------------------------------------------------- */

struct text {
    char *bytes;
    size_t length;
};

/* Up to its end, whatever the file is: a pipe has no size. */
static sadmm_status read_stream(FILE *stream, const char *path, struct text *text, struct sadmm_error *error)
{
    static const size_t most = (size_t)4 << 30, piece = 1 << 16;
    errno = 0;
    while (!feof(stream)) {
        if (text->length >= most)
            return sadmm_fail(error, SADMM_ERROR_LIMIT, "%.200s: a scene file may have 4 GiB, this one has more", path);
        if (!SADMM_GROW(text->bytes, text->length, text->length + piece))
            return sadmm_fail_memory(error, "a scene file");
        text->length += fread(text->bytes + text->length, 1, SADMM_ROOM(text->bytes) - text->length, stream);
        if (ferror(stream))
            return sadmm_fail(error, SADMM_ERROR_IO, "%.200s: could not be read: %s", path, strerror(errno));
    }
    return SADMM_OK;
}

sadmm_status sadmm_scene_file_open(const char *path, struct sadmm_scene_file **out, struct sadmm_error *error)
{
    struct text text = {0};
    *out = NULL;
    FILE *stream = fopen(path, "rb");
    if (!stream) return sadmm_fail(error, SADMM_ERROR_IO, "%.200s: could not be opened: %s", path, strerror(errno));
    sadmm_status status = read_stream(stream, path, &text, error);
    fclose(stream);
    if (status == SADMM_OK) status = sadmm_scene_file_parse(text.bytes, text.length, path, out, error);
    sadmm_free(text.bytes);
    return status;
}

/* ---- the head ---------------------------------------------------------------------------------------------------- */

static sadmm_status check_format(const struct sadmm_reader *r, const json_t *root)
{
    const json_t *format = json_object_get(root, "format"), *version = json_object_get(root, "format_version");
    int64_t number;
    if (!format || !version)
        return sadmm_refuse(r, format ? "format_version" : "format",
                            "is missing: a scene file has \"format\": \"%s\" "
                            "and \"format_version\": %d",
                            SADMM_SCENE_FORMAT, SADMM_SCENE_FORMAT_VERSION);
    if (!json_is_string(format) || strcmp(json_string_value(format), SADMM_SCENE_FORMAT) != 0)
        return sadmm_refuse_value(r, "format", "\"" SADMM_SCENE_FORMAT "\"", format);
    return sadmm_read_whole(r, "format_version", version, SADMM_SCENE_FORMAT_VERSION, SADMM_SCENE_FORMAT_VERSION,
                            &number);
}

/* A whole number or null, of "name:N:M". */
static sadmm_status read_size(const struct sadmm_reader *r, const json_t *root, const char *member, long *size)
{
    const json_t *value = json_object_get(root, member);
    int64_t number;
    *size = -1;
    if (!value || json_is_null(value)) return SADMM_OK;
    TRY(sadmm_read_whole(r, member, value, 0, 1e9, &number));
    *size = (long)number;
    return SADMM_OK;
}

/* What is only said: read for its type. */
static sadmm_status check_words(const struct sadmm_reader *r, const json_t *root)
{
    static const char *const words[] = {"$schema", "units", "version", "commit", "compiler"};
    const char *said;
    for (size_t k = 0; k < sizeof words / sizeof *words; ++k) TRY(sadmm_read_string(r, root, words[k], &said));
    TRY(sadmm_read_string(r, root, "friction_of_a_pair", &said));
    if (said && strcmp(said, SADMM_SCENE_PAIR_FRICTION) != 0)
        return sadmm_refuse_value(r, "friction_of_a_pair", "\"" SADMM_SCENE_PAIR_FRICTION "\"",
                                  json_object_get(root, "friction_of_a_pair"));
    return SADMM_OK;
}

/* What goes by method, into `numbers`. Settings that say a number say it of their method; others have that method's. */
static sadmm_status read_by_method(struct sadmm_reader *r, const json_t *root, const char *member, int most,
                                   sadmm_method own, int *setting, int numbers[SADMM_METHOD_COUNT])
{
    const json_t *object = json_object_get(root, member);
    if (object) {
        const size_t before = sadmm_enter(r, "%s", member);
        TRY(sadmm_read_fields(r, object, &sadmm_method_fields, numbers));
        for (int m = 0; m < SADMM_METHOD_COUNT; ++m)
            if (numbers[m] < 1 || numbers[m] > most)
                return sadmm_refuse(r, sadmm_method_names[m], "must be in [1, %d], is %d", most, numbers[m]);
        sadmm_leave(r, before);
    }
    if (json_object_get(json_object_get(root, "settings"), member)) numbers[own] = *setting;
    else *setting = numbers[own];
    return SADMM_OK;
}

static sadmm_status read_settings(struct sadmm_reader *r, struct sadmm_scene_file *file)
{
    const json_t *object = json_object_get(file->root, "settings");
    sadmm_settings *s = &file->def.settings;
    struct sadmm_scene_about *about = &file->about;
    if (object) {
        const size_t before = sadmm_enter(r, "settings");
        TRY(sadmm_read_fields(r, object, &sadmm_settings_fields, s));
        sadmm_leave(r, before);
    }
    for (int m = 0; m < SADMM_METHOD_COUNT; ++m) {
        about->iterations[m] = m == SADMM_METHOD_PAPER ? PAPER_ITERATIONS : sadmm_settings_default().iterations;
        about->substeps[m] = 1;
    }
    TRY(read_by_method(r, file->root, "iterations", MOST_ITERATIONS, s->method, &s->iterations, about->iterations));
    return read_by_method(r, file->root, "substeps", SADMM_MOST_SUBSTEPS, s->method, &s->substeps, about->substeps);
}

/* The library checks ranges: an empty world takes the definition. */
static sadmm_status check_def(const struct sadmm_reader *r, const sadmm_world_def *def)
{
    sadmm_world *world = NULL;
    const sadmm_status status = sadmm_world_create(def, &world);
    sadmm_world_destroy(world);
    if (status == SADMM_OK) return status;
    char message[SADMM_MESSAGE_SIZE]; /* the buffer that sadmm_last_message shows is written anew */
    snprintf(message, sizeof message, "%s", sadmm_last_message());
    return sadmm_refuse_as(r, status, ": ", message);
}

static sadmm_status read_head(struct sadmm_reader *r, struct sadmm_scene_file *file)
{
    struct sadmm_scene_about *about = &file->about;
    const json_t *root = file->root, *duration = json_object_get(root, "duration");
    file->def = sadmm_world_def_default();
    about->duration = 1;
    if (json_is_object(root)) TRY(check_format(r, root)); /* before its members: what has them may be something else */
    TRY(sadmm_read_fields(r, root, &sadmm_file_fields, &file->def));
    TRY(check_words(r, root));
    TRY(sadmm_read_string(r, root, "scene", &about->spec));
    TRY(sadmm_read_string(r, root, "name", &about->name));
    TRY(sadmm_read_string(r, root, "description", &about->description));
    if (!about->spec) about->spec = file->name;
    if (!about->name) about->name = "";
    if (!about->description) about->description = "";
    TRY(read_size(r, root, "n", &about->n));
    TRY(read_size(r, root, "m", &about->m));
    if (duration) TRY(sadmm_read_real(r, "duration", duration, &about->duration));
    if (!(about->duration >= 0 && about->duration <= longest))
        return sadmm_refuse(r, "duration", "must be in [0, %g] s, is %g", longest, about->duration);
    TRY(read_settings(r, file));
    return check_def(r, &file->def);
}

static char *copy_of(const char *text)
{
    const size_t length = strlen(text);
    char *copy = (char *)sadmm_alloc(length + 1, 1);
    if (copy) memcpy(copy, text, length);
    return copy;
}

sadmm_status sadmm_scene_file_parse(const char *text, size_t length, const char *name, struct sadmm_scene_file **out,
                                    struct sadmm_error *error)
{
    *out = NULL;
    struct sadmm_scene_file *file = (struct sadmm_scene_file *)sadmm_alloc(1, sizeof *file);
    if (!file || !(file->name = copy_of(name ? name : ""))) {
        sadmm_free(file);
        return sadmm_fail_memory(error, "a scene file");
    }
    struct sadmm_reader reader = {.name = file->name, .error = error};
    sadmm_status status = sadmm_parse_json(&reader, text ? text : "", length, &file->root);
    if (status == SADMM_OK) status = read_head(&reader, file);
    if (status == SADMM_OK) *out = file;
    else sadmm_scene_file_close(file);
    return status;
}

void sadmm_scene_file_close(struct sadmm_scene_file *file)
{
    if (!file) return;
    json_decref(file->root);
    sadmm_free(file->name);
    sadmm_free(file);
}

const struct sadmm_scene_about *sadmm_scene_file_about(const struct sadmm_scene_file *file) { return &file->about; }
sadmm_world_def sadmm_scene_file_def(const struct sadmm_scene_file *file) { return file->def; }
