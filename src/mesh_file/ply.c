#include "ply.h"

#include <string.h>

#include "core/base/memory.h"
#include "ply_header.h"

struct row {
    const struct ply_element *element;
    size_t number;
};

static const char *const kind_names[PLY_KINDS] = {"vertex", "face", "edge", "of another name"};

static sadmm_status refuse(const struct ply *p, struct row row, const char *what, struct word word)
{
    char quote[QUOTE_SIZE];
    const bool binary = p->encoding != PLY_TEXT;
    return sadmm_mesh_file_fail(p->parts, binary ? 0 : p->text.line, SADMM_ERROR_INVALID_ARGUMENT,
                                "row %zu of %zu of element %s: %s%s%s", row.number + 1, row.element->count,
                                kind_names[row.element->kind], what, word.length > 0 ? ": " : "",
                                sadmm_word_quote(word, quote));
}

static const struct word no_word = {"", 0};

static double value_of(enum ply_type type, uint64_t bits)
{
    const uint32_t low = (uint32_t)bits;
    float single;
    double value;
    switch (type) {
    case PLY_INT8: return (int8_t)bits;
    case PLY_INT16: return (int16_t)bits;
    case PLY_INT32: return (int32_t)bits;
    case PLY_FLOAT: memcpy(&single, &low, sizeof single); return (double)single;
    case PLY_DOUBLE: memcpy(&value, &bits, sizeof value); return value;
    default: return (double)bits;
    }
}

static sadmm_status read_binary_value(struct ply *p, struct row row, enum ply_type type, double *value)
{
    static const size_t sizes[PLY_TYPES] = {1, 1, 2, 2, 4, 4, 4, 8};
    const size_t size = sizes[type];
    uint64_t bits = 0;
    if ((size_t)(p->text.end - p->text.at) < size) return refuse(p, row, "the file ends there", no_word);
    for (size_t k = 0; k < size; ++k) {
        const size_t place = p->encoding == PLY_BIG ? size - 1 - k : k;
        bits |= (uint64_t)(unsigned char)p->text.at[k] << 8 * place;
    }
    p->text.at += size;
    *value = value_of(type, bits);
    return SADMM_OK;
}

static sadmm_status read_text_value(struct ply *p, struct row row, enum ply_type type, bool used, double *value)
{
    static const int64_t low[] = {INT8_MIN, 0, INT16_MIN, 0, INT32_MIN, 0};
    static const int64_t high[] = {INT8_MAX, UINT8_MAX, INT16_MAX, UINT16_MAX, INT32_MAX, UINT32_MAX};
    struct word word;
    int64_t integer;
    if (!sadmm_text_word(&p->text, &word)) return refuse(p, row, "has too few values", no_word);
    *value = 0;
    if (!used) return SADMM_OK;
    if (!ply_is_integer(type)) {
        if (!sadmm_word_number(word, value)) return refuse(p, row, "must be a finite number", word);
        return SADMM_OK;
    }
    if (!sadmm_word_integer(word, &integer) || integer < low[type] || integer > high[type])
        return refuse(p, row, "must be an integer of its type", word);
    *value = (double)integer;
    return SADMM_OK;
}

/* used: it matters what it is. */
static sadmm_status read_value(struct ply *p, struct row row, enum ply_type type, bool used, double *value)
{
    return p->encoding == PLY_TEXT ? read_text_value(p, row, type, used, value)
                                   : read_binary_value(p, row, type, value);
}

static sadmm_status read_property(struct ply *p, struct row row, const struct ply_property *property, double x[3])
{
    const size_t line = p->encoding == PLY_TEXT ? p->text.line : 0;
    double count = 1, value;
    if (property->list) TRY(read_value(p, row, property->count_type, true, &count));
    if (count < 0) return refuse(p, row, "the length of a list is negative", no_word);
    for (double k = 0; k < count; ++k) {
        TRY(read_value(p, row, property->type, property->role != PLY_NO_ROLE, &value));
        if (property->role == PLY_CORNERS)
            TRY(sadmm_mesh_file_add_corner(p->parts, line, (int64_t)value, p->vertex_count, 0));
        else if (property->role != PLY_NO_ROLE) x[property->role] = value;
    }
    return SADMM_OK;
}

static sadmm_status read_row(struct ply *p, struct row row)
{
    const struct ply_element *const element = row.element;
    double x[3] = {0};
    struct word word;
    if (p->encoding == PLY_TEXT && !sadmm_text_next_line(&p->text))
        return refuse(p, row, "the file ends before it", no_word);
    for (size_t k = 0; k < element->properties; ++k) TRY(read_property(p, row, &p->properties[element->first + k], x));
    if (p->encoding == PLY_TEXT && sadmm_text_word(&p->text, &word)) return refuse(p, row, "has too many values", word);
    switch (element->kind) {
    case PLY_VERTEX: return sadmm_mesh_file_add_vertex(p->parts, p->encoding == PLY_TEXT ? p->text.line : 0, x);
    case PLY_FACE: return sadmm_mesh_file_end_face(p->parts, true);
    case PLY_EDGE: ++p->parts->info.lines; return SADMM_OK;
    default: ++p->parts->info.others; return SADMM_OK;
    }
}

static sadmm_status read_rows(struct ply *p)
{
    for (size_t e = 0; e < p->element_count; ++e) {
        const struct ply_element *const element = &p->elements[e];
        /* Rows of nothing take no bytes, however many there are. */
        for (size_t row = 0; element->properties > 0 && row < element->count; ++row)
            TRY(read_row(p, (struct row){element, row}));
    }
    if (p->encoding == PLY_TEXT && sadmm_text_next_line(&p->text))
        return sadmm_mesh_file_fail(p->parts, p->text.line, SADMM_ERROR_INVALID_ARGUMENT,
                                    "there are more lines than the header says");
    if (p->encoding != PLY_TEXT && p->text.at < p->text.end)
        return sadmm_mesh_file_fail(p->parts, 0, SADMM_ERROR_INVALID_ARGUMENT,
                                    "there are %zu more bytes than the header says",
                                    (size_t)(p->text.end - p->text.at));
    return SADMM_OK;
}

sadmm_status sadmm_mesh_file_read_ply(struct mesh_parts *parts)
{
    struct ply p = {.parts = parts, .text = sadmm_text(parts->source->bytes, parts->source->size)};
    sadmm_status status = sadmm_mesh_file_read_ply_header(&p);
    if (status == SADMM_OK) status = read_rows(&p);
    sadmm_free(p.elements);
    sadmm_free(p.properties);
    return status;
}
