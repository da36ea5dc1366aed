#include "obj.h"

#include <string.h>

#include "text.h"

struct obj {
    struct mesh_parts *parts;
    struct text text;
    bool wanted; /* faces belong to the object asked for */
    bool in_object, in_group;
};

#define FAIL(o, status, ...) sadmm_mesh_file_fail((o)->parts, (o)->text.line, status, __VA_ARGS__)

/* v x y z [w] [r g b] */
static sadmm_status read_vertex(struct obj *o)
{
    double x[7];
    struct word word;
    char quote[QUOTE_SIZE];
    int count = 0;
    while (sadmm_text_word(&o->text, &word)) {
        if (count == 7) return FAIL(o, SADMM_ERROR_INVALID_ARGUMENT, "v has more than 7 numbers");
        if (!sadmm_word_number(word, &x[count]))
            return FAIL(o, SADMM_ERROR_INVALID_ARGUMENT, "v: \"%s\": must be a finite number",
                        sadmm_word_quote(word, quote));
        ++count;
    }
    if (count != 3 && count != 4 && count != 6 && count != 7)
        return FAIL(o, SADMM_ERROR_INVALID_ARGUMENT,
                    "v has %d numbers: must be 3, with a weight 4, with a colour 6, with both 7", count);
    return sadmm_mesh_file_add_vertex(o->parts, o->text.line, x);
}

/* VERTEX[/[TEXTURE][/[NORMAL]]]: false if it is not. Textures and normals are integers, whichever. */
static bool read_reference(struct word word, int64_t *vertex)
{
    int64_t passed_over;
    for (int part = 0; part < 3; ++part) {
        const char *const slash = (const char *)memchr(word.at, '/', word.length);
        const struct word number = {word.at, slash ? (size_t)(slash - word.at) : word.length};
        if (part == 0 || number.length > 0)
            if (!sadmm_word_integer(number, part == 0 ? vertex : &passed_over)) return false;
        if (!slash) return true;
        word = (struct word){slash + 1, word.length - number.length - 1};
    }
    return false;
}

static sadmm_status read_face(struct obj *o)
{
    struct word word;
    char quote[QUOTE_SIZE];
    const size_t count = o->parts->vertex_count;
    while (sadmm_text_word(&o->text, &word)) {
        int64_t vertex;
        if (!read_reference(word, &vertex))
            return FAIL(o, SADMM_ERROR_INVALID_ARGUMENT,
                        "f: \"%s\": must be a vertex, vertex/texture/normal or the like",
                        sadmm_word_quote(word, quote));
        if (vertex == 0)
            return FAIL(o, SADMM_ERROR_INVALID_ARGUMENT, "f: vertex 0: they are counted from 1, or from -1 back");
        if (vertex < 0 && (uint64_t) - (vertex + 1) >= count)
            return FAIL(o, SADMM_ERROR_INVALID_ARGUMENT, "f: vertex %lld: there are %zu vertices before it",
                        (long long)vertex, count);
        TRY(sadmm_mesh_file_add_corner(o->parts, o->text.line, vertex > 0 ? vertex - 1 : vertex + (int64_t)count, count,
                                       1));
    }
    return sadmm_mesh_file_end_face(o->parts, o->wanted);
}

static bool names_object(struct obj *o)
{
    struct word word;
    while (sadmm_text_word(&o->text, &word))
        if (o->parts->object && sadmm_word_is(word, o->parts->object)) return true;
    return false;
}

static bool is_one_of(struct word word, const char *const *names, size_t count)
{
    for (size_t k = 0; k < count; ++k)
        if (sadmm_word_is(word, names[k])) return true;
    return false;
}

static sadmm_status read_line(struct obj *o)
{
    /* No geometry, and nothing that faces depend on. */
    static const char *const passed_over[] = {
        "vn",       "vt",       "vp",   "s",          "mg",        "usemtl", "mtllib", "usemap", "maplib", "bevel",
        "c_interp", "d_interp", "lod",  "shadow_obj", "trace_obj", "ctech",  "stech",  "cstype", "deg",    "bmat",
        "step",     "parm",     "trim", "hole",       "scrv",      "sp",     "end",    "con",
    };
    static const char *const curved[] = {"curv", "curv2", "surf"};
    struct word word;
    char quote[QUOTE_SIZE];
    if (!sadmm_text_word(&o->text, &word)) return SADMM_OK;
    if (sadmm_word_is(word, "v")) return read_vertex(o);
    if (sadmm_word_is(word, "f") || sadmm_word_is(word, "fo")) return read_face(o);
    if (sadmm_word_is(word, "o") || sadmm_word_is(word, "g")) {
        const bool object = sadmm_word_is(word, "o"), named = names_object(o);
        o->in_group = !object && named;
        if (object) o->in_object = named;
        o->wanted = !o->parts->object || o->in_object || o->in_group;
    } else if (sadmm_word_is(word, "p")) {
        ++o->parts->info.points;
    } else if (sadmm_word_is(word, "l")) {
        ++o->parts->info.lines;
    } else if (is_one_of(word, curved, sizeof curved / sizeof *curved)) {
        ++o->parts->info.others;
    } else if (sadmm_word_is(word, "call") || sadmm_word_is(word, "csh")) {
        return FAIL(o, SADMM_ERROR_UNSUPPORTED, "%s: other files and commands are not called",
                    sadmm_word_quote(word, quote));
    } else if (!is_one_of(word, passed_over, sizeof passed_over / sizeof *passed_over)) {
        return FAIL(o, SADMM_ERROR_INVALID_ARGUMENT, "no OBJ: lines do not begin with \"%s\"",
                    sadmm_word_quote(word, quote));
    }
    return SADMM_OK;
}

sadmm_status sadmm_mesh_file_read_obj(struct mesh_parts *parts)
{
    struct obj o = {.parts = parts, .text = sadmm_text(parts->source->bytes, parts->source->size)};
    o.text.comments = o.text.continues = true;
    o.wanted = !parts->object;
    while (sadmm_text_next_line(&o.text)) TRY(read_line(&o));
    return SADMM_OK;
}
