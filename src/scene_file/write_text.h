/* JSON as text. */
#ifndef SADMM_SCENE_FILE_WRITE_TEXT_H
#define SADMM_SCENE_FILE_WRITE_TEXT_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/* Write it so that what belongs together is on one line. False: an error of the stream, or no memory. */
bool sadmm_write_text(const json_t *root, FILE *stream);

#endif
