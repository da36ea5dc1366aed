/* Text files, whole. */
#ifndef TESTS_TEXT_FILE_H
#define TESTS_TEXT_FILE_H

#include <check.h>
#include <stdio.h>
#include <stdlib.h>

/* To be freed; NULL: there is no such file. */
static inline char *read_text_if_there(const char *path)
{
    FILE *file = fopen(path, "r");
    if (!file) return NULL;
    size_t size = 0, capacity = 1 << 16;
    char *text = malloc(capacity);
    for (size_t got; text && (got = fread(text + size, 1, capacity - 1 - size, file)) > 0;) {
        size += got;
        if (capacity - 1 - size == 0) text = realloc(text, capacity *= 2);
    }
    fclose(file);
    ck_assert_msg(text != NULL, "%s: no memory", path);
    text[size] = 0;
    return text;
}

#endif
