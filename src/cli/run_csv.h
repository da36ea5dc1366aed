/* What a run writes step by step as CSV: one file each of states, contacts and errors. A header line, then rows; states
 * and contacts in digits that bring the same bits back. */
#ifndef SADMM_CLI_RUN_CSV_H
#define SADMM_CLI_RUN_CSV_H

#include "run_record.h"

enum run_csv_kind {
    RUN_CSV_TRACE,    /* every dynamic body's state before the first step and after every step */
    RUN_CSV_CONTACTS, /* every contact of every step */
    RUN_CSV_ERROR,    /* a row a step: errors, iterations, time */
    RUN_CSV_KINDS
};

struct run_csv;

/* Open the files that have a name (NULL: not asked for). Returns an exit code, after a message; what is open then is
 * dropped at the end of the program. *csv: the caller's until run_csv_free, also after an error. */
int run_csv_open(const char *const names[RUN_CSV_KINDS], struct run_csv **csv);

/* The header lines, and what there is before the first step. Returns an exit code; a failure is told in
 * record->failure, or on stderr where the world has no such state. */
int run_csv_begin(struct run_csv *csv, struct run_record *record, sadmm_world *world);
/* After a step, which `record` knows. Likewise. */
int run_csv_step(struct run_csv *csv, struct run_record *record, sadmm_world *world);

/* Complete: put all in their places. Returns an exit code. */
int run_csv_close(struct run_csv *csv);
void run_csv_free(struct run_csv *csv); /* NULL is fine */

#endif
