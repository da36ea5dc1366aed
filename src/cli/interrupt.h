/* Being asked to end: SIGINT (Ctrl-C) and SIGTERM.
 *
 * A run that checks `interrupted` ends in order at the first of them, with what it has, and exits with 128 plus the
 * signal's number (130, 143). A second one ends it at once, as the first does where nobody checks, and as SIGHUP and
 * SIGPIPE do; also then no half-written file is left behind (output.h).
 */
#ifndef SADMM_CLI_INTERRUPT_H
#define SADMM_CLI_INTERRUPT_H

/* At the start of main. A signal that is ignored stays so. */
void interrupts_begin(void);

/* From now on the program checks `interrupted`. */
void interrupts_expect(void);

/* The signal that asked, or 0. */
int interrupted(void);

/* The exit status of a run that would end with `code`. */
int interrupted_status(int code);

#endif
