/* What the commands write: the one way to a file, a pipe or standard output, for `subadmm` and `subadmm-bench`.
 *
 * A run opens all its outputs before it begins, so that what cannot be written is said before the work is done. A file
 * is written beside its target and takes its place when it is complete: the target is what it was, or whole. Symbolic
 * links are followed and stay; a file that is replaced keeps its mode. What is no file (a pipe, a device, /dev/stdout,
 * "-") is written directly. No output may be a file that the run reads, or another output of it, whatever names they
 * have. What a run does not close, because it failed or was ended by a signal, leaves nothing behind.
 *
 * Messages go to standard error. Codes are exit statuses: 0, 1 (cannot be written) and 2 (must not be). One thread.
 */
#ifndef SADMM_CLI_OUTPUT_H
#define SADMM_CLI_OUTPUT_H

#include <stdbool.h>
#include <stdio.h>

struct output;

enum output_kind {
    OUTPUT_STREAM, /* written through output_stream */
    OUTPUT_FILE,   /* written by a library that needs a file's path, output_path: no pipe, no "-" */
};

/* First of all in main: what messages begin with. */
void outputs_begin(const char *program);

/* A file that the run reads: no output opened after this may be it. */
void outputs_protect(const char *path);

/* `option` ("--json") and `name` are for messages too and must stay. *out is NULL after an error. */
int output_open(const char *option, const char *name, enum output_kind kind, struct output **out);

FILE *output_stream(const struct output *output);
const char *output_path(const struct output *output); /* an empty file, to be written over */

/* Complete: put it in its place. NULL is fine. The output must not be used any more, also after an error. */
int output_close(struct output *output);

/* Not to be completed: what was there before stays. */
void output_drop(struct output *output);

/* Does an open output go to standard output? Then tables do not. */
bool outputs_on_stdout(void);

/* Last of all in main: drop what is still open, and say so if standard output could not be written. Returns `code`,
 * or 1 where it was 0 and there was an error. */
int outputs_end(int code);

/* Remove what is not complete. For signal handlers. */
void outputs_abandon(void);

#endif
