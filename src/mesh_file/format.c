#include "format.h"

#include <string.h>

#include "stl.h"
#include "text.h"

static bool ends_with(const char *path, const char *ending)
{
    const size_t length = strlen(path), wanted = strlen(ending);
    return length > wanted && sadmm_word_is_any_case((struct word){path + length - wanted, wanted}, ending);
}

sadmm_mesh_file_format sadmm_mesh_file_format_of(const sadmm_mesh_file_def *def, const struct mesh_source *source)
{
    static const struct {
        const char *ending;
        sadmm_mesh_file_format format;
    } formats[] = {{".obj", SADMM_MESH_FILE_OBJ}, {".stl", SADMM_MESH_FILE_STL}, {".ply", SADMM_MESH_FILE_PLY}};
    struct text text = sadmm_text(source->bytes, source->size);
    struct word word;
    if (def->format != SADMM_MESH_FILE_ANY) return def->format;
    for (size_t k = 0; def->path && k < sizeof formats / sizeof *formats; ++k)
        if (ends_with(def->path, formats[k].ending)) return formats[k].format;
    if (sadmm_mesh_file_is_binary_stl(source)) return SADMM_MESH_FILE_STL;
    if (sadmm_text_next_line(&text) && sadmm_text_word(&text, &word)) {
        if (sadmm_word_is(word, "ply")) return SADMM_MESH_FILE_PLY;
        if (sadmm_word_is_any_case(word, "solid")) return SADMM_MESH_FILE_STL;
    }
    return SADMM_MESH_FILE_OBJ;
}
