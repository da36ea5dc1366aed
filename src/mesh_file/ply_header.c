#include "ply_header.h"

#include "core/base/memory.h"

#define FAIL(p, status, ...) sadmm_mesh_file_fail((p)->parts, (p)->text.line, status, __VA_ARGS__)
#define REFUSE(p, ...)       FAIL(p, SADMM_ERROR_INVALID_ARGUMENT, __VA_ARGS__)

static bool read_type(struct word word, enum ply_type *type)
{
    static const char *const names[PLY_TYPES][2] = {
        {"char", "int8"}, {"uchar", "uint8"}, {"short", "int16"},   {"ushort", "uint16"},
        {"int", "int32"}, {"uint", "uint32"}, {"float", "float32"}, {"double", "float64"},
    };
    for (int k = 0; k < PLY_TYPES; ++k)
        if (sadmm_word_is(word, names[k][0]) || sadmm_word_is(word, names[k][1])) {
            *type = (enum ply_type)k;
            return true;
        }
    return false;
}

static sadmm_status read_format(struct ply *p)
{
    static const char *const encodings[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    struct word word;
    char quote[QUOTE_SIZE];
    bool known = false;
    if (!sadmm_text_next_line(&p->text) || !sadmm_text_word(&p->text, &word) || !sadmm_word_is(word, "format"))
        return REFUSE(p, "no PLY: must be \"format\"");
    if (!sadmm_text_word(&p->text, &word)) return REFUSE(p, "format: must have a name and a version");
    for (int k = 0; k < 3; ++k)
        if (sadmm_word_is(word, encodings[k])) {
            p->encoding = (enum ply_encoding)k;
            known = true;
        }
    if (!known)
        return REFUSE(p, "format \"%s\": must be ascii, binary_little_endian or binary_big_endian",
                      sadmm_word_quote(word, quote));
    p->parts->info.binary = p->encoding != PLY_TEXT;
    if (!sadmm_text_word(&p->text, &word)) return REFUSE(p, "format: must have a version");
    if (!sadmm_word_is(word, "1.0"))
        return FAIL(p, SADMM_ERROR_UNSUPPORTED, "PLY version \"%s\": must be 1.0", sadmm_word_quote(word, quote));
    return SADMM_OK;
}

/* The element that properties are of: the last one. */
static struct ply_element *last_element(const struct ply *p)
{
    return p->element_count > 0 ? &p->elements[p->element_count - 1] : NULL;
}

static bool has_role(const struct ply *p, const struct ply_element *element, enum ply_role role)
{
    for (size_t k = element->first; k < element->first + element->properties; ++k)
        if (p->properties[k].role == role) return true;
    return false;
}

static sadmm_status check_element(const struct ply *p, const struct ply_element *element)
{
    if (!element) return SADMM_OK;
    if (element->kind == PLY_VERTEX)
        for (int k = PLY_X; k <= PLY_Z; ++k)
            if (!has_role(p, element, (enum ply_role)k)) return REFUSE(p, "element vertex has no property %c", 'x' + k);
    if (element->kind == PLY_FACE && !has_role(p, element, PLY_CORNERS))
        return REFUSE(p, "element face has no list vertex_indices or vertex_index");
    return SADMM_OK;
}

static sadmm_status read_element(struct ply *p)
{
    static const char *const kinds[] = {"vertex", "face", "edge"};
    struct word word;
    char quote[QUOTE_SIZE];
    int64_t count = 0;
    struct ply_element element = {.kind = PLY_OTHER, .first = p->property_count};
    TRY(check_element(p, last_element(p)));
    if (!sadmm_text_word(&p->text, &word)) return REFUSE(p, "element: must have a name and a number");
    if (sadmm_word_is(word, "tristrips"))
        return FAIL(p, SADMM_ERROR_UNSUPPORTED, "element tristrips: triangle strips are not read");
    for (int k = 0; k < PLY_OTHER; ++k)
        if (sadmm_word_is(word, kinds[k])) element.kind = (enum ply_kind)k;
    for (size_t k = 0; k < p->element_count && element.kind != PLY_OTHER; ++k)
        if (p->elements[k].kind == element.kind)
            return REFUSE(p, "element %s: there is one already", sadmm_word_quote(word, quote));
    const bool there = sadmm_text_word(&p->text, &word);
    if (!there || !sadmm_word_integer(word, &count) || count < 0)
        return REFUSE(p, "element: number of rows \"%s\": must be an integer >= 0",
                      there ? sadmm_word_quote(word, quote) : "");
    element.count = (size_t)count;
    if (element.kind == PLY_VERTEX) {
        if (count > MESH_MOST_VERTICES)
            return FAIL(p, SADMM_ERROR_LIMIT, "%lld vertices: at most %d", (long long)count, MESH_MOST_VERTICES);
        p->vertex_count = element.count;
    }
    if (!SADMM_GROW(p->elements, p->element_count, p->element_count + 1))
        return sadmm_fail_memory(NULL, "the elements of a PLY file");
    p->elements[p->element_count++] = element;
    return SADMM_OK;
}

static enum ply_role role_of(const struct ply_element *element, struct word name)
{
    static const char *const coordinates[] = {"x", "y", "z"};
    if (element->kind == PLY_VERTEX)
        for (int k = PLY_X; k <= PLY_Z; ++k)
            if (sadmm_word_is(name, coordinates[k])) return (enum ply_role)k;
    if (element->kind == PLY_FACE && (sadmm_word_is(name, "vertex_indices") || sadmm_word_is(name, "vertex_index")))
        return PLY_CORNERS;
    return PLY_NO_ROLE;
}

/* property TYPE NAME, property list TYPE TYPE NAME */
static sadmm_status read_property(struct ply *p)
{
    struct ply_element *const element = last_element(p);
    struct ply_property property = {.list = false};
    struct word word = {"", 0}, name;
    char quote[QUOTE_SIZE];
    if (!element) return REFUSE(p, "property: must come below an element");
    bool good = sadmm_text_word(&p->text, &word);
    if (good && sadmm_word_is(word, "list")) {
        property.list = true;
        good = sadmm_text_word(&p->text, &word) && read_type(word, &property.count_type) &&
               ply_is_integer(property.count_type) && sadmm_text_word(&p->text, &word);
    }
    if (!good || !read_type(word, &property.type))
        return REFUSE(p,
                      "property \"%s\": must be a type (char, uchar, short, ushort, int, uint, float, double), or list "
                      "with a type of integers and a type",
                      sadmm_word_quote(word, quote));
    if (!sadmm_text_word(&p->text, &name)) return REFUSE(p, "property: must have a name");
    property.role = role_of(element, name);
    if (property.role != PLY_NO_ROLE) {
        const bool corners = property.role == PLY_CORNERS;
        if (property.list != corners || (corners && !ply_is_integer(property.type)))
            return REFUSE(p, "property %s: must be %s", sadmm_word_quote(name, quote),
                          corners ? "a list of integers" : "a number");
        if (has_role(p, element, property.role))
            return REFUSE(p, "property %s: there is one already", sadmm_word_quote(name, quote));
    }
    if (!SADMM_GROW(p->properties, p->property_count, p->property_count + 1))
        return sadmm_fail_memory(NULL, "the properties of a PLY file");
    p->properties[p->property_count++] = property;
    ++element->properties;
    return SADMM_OK;
}

sadmm_status sadmm_mesh_file_read_ply_header(struct ply *p)
{
    struct word word;
    char quote[QUOTE_SIZE];
    if (!sadmm_text_next_line(&p->text) || p->text.line != 1 || !sadmm_text_word(&p->text, &word) ||
        !sadmm_word_is(word, "ply"))
        return REFUSE(p, "no PLY: the first line must be \"ply\"");
    /* Which end of a line the header has: behind \r alone, a \n is the first byte of the rows. */
    const bool cr = p->text.end - p->text.at > 1 && p->text.at[0] == '\r' && p->text.at[1] != '\n';
    TRY(read_format(p));
    while (sadmm_text_next_line(&p->text) && sadmm_text_word(&p->text, &word)) {
        if (sadmm_word_is(word, "comment") || sadmm_word_is(word, "obj_info")) continue;
        if (sadmm_word_is(word, "element")) {
            TRY(read_element(p));
        } else if (sadmm_word_is(word, "property")) {
            TRY(read_property(p));
        } else if (sadmm_word_is(word, "end_header")) {
            TRY(check_element(p, last_element(p)));
            sadmm_text_end_line(&p->text, cr);
            return SADMM_OK;
        } else {
            return REFUSE(p, "no PLY: lines of the header do not begin with \"%s\"", sadmm_word_quote(word, quote));
        }
    }
    return REFUSE(p, "no PLY: the file ends before \"end_header\"");
}
