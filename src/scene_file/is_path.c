#include <string.h>

#include "scene_file.h"

bool sadmm_scene_file_is_path(const char *text)
{
    static const char end[] = ".json";
    const size_t length = strlen(text), enough = sizeof end - 1;
    return strchr(text, '/') || (length >= enough && strcmp(text + length - enough, end) == 0);
}
