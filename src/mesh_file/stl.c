#include "stl.h"

#include <string.h>

#include "text.h"

static uint32_t little(const unsigned char at[4])
{
    return (uint32_t)at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}

/* The number of triangles that a header says. */
static size_t stl_count(const unsigned char header[STL_HEADER]) { return little(header + STL_HEADER - 4); }

bool sadmm_mesh_file_is_binary_stl(const struct mesh_source *source)
{
    return source->size >= STL_HEADER && (source->size - STL_HEADER) % STL_TRIANGLE == 0 &&
           (source->size - STL_HEADER) / STL_TRIANGLE == stl_count(source->bytes);
}

static sadmm_status add_corner(struct mesh_parts *parts, size_t line, const double x[3])
{
    TRY(sadmm_mesh_file_add_vertex(parts, line, x));
    return sadmm_mesh_file_add_corner(parts, line, (int64_t)parts->vertex_count - 1, parts->vertex_count, 0);
}

static sadmm_status read_binary(struct mesh_parts *parts)
{
    const size_t count = stl_count(parts->source->bytes);
    const unsigned char *at = parts->source->bytes + STL_HEADER;
    parts->info.binary = true;
    for (size_t triangle = 0; triangle < count; ++triangle, at += STL_TRIANGLE) {
        for (int corner = 0; corner < 3; ++corner) {
            double x[3];
            for (int k = 0; k < 3; ++k) {
                const uint32_t bits = little(at + 12 * (corner + 1) + 4 * k); /* behind the normal */
                float value;
                memcpy(&value, &bits, sizeof value);
                x[k] = (double)value;
            }
            TRY(add_corner(parts, 0, x));
        }
        TRY(sadmm_mesh_file_end_face(parts, true));
    }
    return SADMM_OK;
}

/* ---- text -------------------------------------------------------------------------------------------------------- */

static sadmm_status fail_text(const struct mesh_parts *parts, const struct text *text, const char *wanted)
{
    return sadmm_mesh_file_fail(parts, text->line, SADMM_ERROR_INVALID_ARGUMENT, "no text STL: must be \"%s\"%s",
                                wanted, text->at == text->end ? ", and the file ends" : "");
}

/* The next line begins with these words. */
static sadmm_status expect(const struct mesh_parts *parts, struct text *text, const char *first, const char *second)
{
    struct word word;
    if (!sadmm_text_next_line(text) || !sadmm_text_word(text, &word) || !sadmm_word_is_any_case(word, first))
        return fail_text(parts, text, first);
    if (second && (!sadmm_text_word(text, &word) || !sadmm_word_is_any_case(word, second)))
        return fail_text(parts, text, second);
    return SADMM_OK;
}

static sadmm_status expect_end(const struct mesh_parts *parts, struct text *text)
{
    struct word word;
    char quote[QUOTE_SIZE];
    if (!sadmm_text_word(text, &word)) return SADMM_OK;
    return sadmm_mesh_file_fail(parts, text->line, SADMM_ERROR_INVALID_ARGUMENT, "\"%s\": must be the end of the line",
                                sadmm_word_quote(word, quote));
}

static sadmm_status read_vertex(struct mesh_parts *parts, struct text *text)
{
    double x[3];
    struct word word;
    char quote[QUOTE_SIZE];
    TRY(expect(parts, text, "vertex", NULL));
    for (int k = 0; k < 3; ++k) {
        const bool there = sadmm_text_word(text, &word);
        if (!there || !sadmm_word_number(word, &x[k]))
            return sadmm_mesh_file_fail(parts, text->line, SADMM_ERROR_INVALID_ARGUMENT,
                                        "%c = \"%s\": must be a finite number", 'x' + k,
                                        there ? sadmm_word_quote(word, quote) : "");
    }
    TRY(expect_end(parts, text));
    return add_corner(parts, text->line, x);
}

/* The line that says "facet normal" has been reached, its first word read. */
static sadmm_status read_facet(struct mesh_parts *parts, struct text *text)
{
    struct word word;
    if (!sadmm_text_word(text, &word) || !sadmm_word_is_any_case(word, "normal"))
        return fail_text(parts, text, "normal");
    TRY(expect(parts, text, "outer", "loop"));
    TRY(expect_end(parts, text));
    for (int corner = 0; corner < 3; ++corner) TRY(read_vertex(parts, text));
    TRY(expect(parts, text, "endloop", NULL));
    TRY(expect_end(parts, text));
    TRY(expect(parts, text, "endfacet", NULL));
    TRY(expect_end(parts, text));
    return sadmm_mesh_file_end_face(parts, true);
}

/* To the end of a solid whose first line has been read. */
static sadmm_status read_solid(struct mesh_parts *parts, struct text *text)
{
    struct word word;
    while (sadmm_text_next_line(text) && sadmm_text_word(text, &word)) {
        if (sadmm_word_is_any_case(word, "endsolid")) return SADMM_OK;
        if (!sadmm_word_is_any_case(word, "facet")) break;
        TRY(read_facet(parts, text));
    }
    return fail_text(parts, text, "facet normal\" or \"endsolid");
}

static sadmm_status read_text(struct mesh_parts *parts)
{
    struct text text = sadmm_text(parts->source->bytes, parts->source->size);
    struct word word;
    while (sadmm_text_next_line(&text) && sadmm_text_word(&text, &word)) {
        if (!sadmm_word_is_any_case(word, "solid")) return fail_text(parts, &text, "solid");
        TRY(read_solid(parts, &text));
    }
    return SADMM_OK;
}

sadmm_status sadmm_mesh_file_read_stl(struct mesh_parts *parts)
{
    const struct mesh_source *source = parts->source;
    struct text text = sadmm_text(source->bytes, source->size);
    struct word word;
    if (sadmm_mesh_file_is_binary_stl(source)) return read_binary(parts);
    if (sadmm_text_next_line(&text) && sadmm_text_word(&text, &word) && sadmm_word_is_any_case(word, "solid"))
        return read_text(parts);
    if (source->size < STL_HEADER)
        return sadmm_mesh_file_fail(parts, 0, SADMM_ERROR_INVALID_ARGUMENT,
                                    "no STL: does not begin with \"solid\", and has %zu bytes, binary files %d or more",
                                    source->size, STL_HEADER);
    const size_t count = stl_count(source->bytes);
    return sadmm_mesh_file_fail(
        parts, 0, SADMM_ERROR_INVALID_ARGUMENT,
        "no STL: does not begin with \"solid\", and a binary file of %zu triangles (bytes 80 to "
        "83) has %llu bytes, this one %zu",
        count, (unsigned long long)count * STL_TRIANGLE + STL_HEADER, source->size);
}
