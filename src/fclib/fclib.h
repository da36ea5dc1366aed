/* Contact problems in FCLIB's files (HDF5), global problems only:
 *
 *   /fclib_global/spacedim           3
 *   /fclib_global/{M,H,G}/{m,n,nz,nzmax,p,i,x}   sparse; nz >= 0: triplets, i row and p column; -1: compressed
 *                                    columns; -2: compressed rows. G only where there are bilateral constraints
 *   /fclib_global/vectors/{f,w,mu,b} b only with G
 *   /solution/{v,u,r,l}              l only with G
 *
 * What the letters mean: global_problem.h. Files are untrusted: a malformed, truncated or hostile one gives a status
 * and a message, nothing outside it is read (no external links or storage), and memory is taken only for data that the
 * file really holds. libhdf5 itself parses the container; its automatic error printing is off during these calls.
 *
 * Calls are serialised by a lock of this module; a program that uses HDF5 itself on another thread needs a
 * thread-safe libhdf5.
 */
#ifndef SADMM_FCLIB_H
#define SADMM_FCLIB_H

#include <stdbool.h>

#include "core/base/error.h"
#include "subadmm/problem.h"

#ifdef __cplusplus
extern "C" {
#endif

/* False when the library was built without HDF5; every call below then returns UNAVAILABLE. */
bool sadmm_fclib_available(void);

/* Read a problem; the caller destroys it. *out is NULL after an error.
 * Errors: IO (cannot be read, malformed), UNSUPPORTED (a valid file this library has no solver for: 2D, a local
 * problem, bodies that are not rigid, contacts of three bodies), INVALID_ARGUMENT (values out of the problem's
 * ranges), OUT_OF_MEMORY, UNAVAILABLE. */
sadmm_status sadmm_fclib_load(const char *path, sadmm_problem **out, struct sadmm_error *error);

/* Write a problem (not its current solution), with a title, over what is at `path`; a file that could not be written
 * is removed. Errors: IO, UNSUPPORTED (soft rows, rows with bounds), OUT_OF_MEMORY, UNAVAILABLE. */
sadmm_status sadmm_fclib_save(sadmm_problem *problem, const char *path, const char *title,
                              struct sadmm_error *error);

/* Write the problem's current (v, u, r, l) as /solution into `path`: a copy of `source` (the file the problem was
 * loaded from; all else in it is kept), or, when source is NULL, a new file with the problem itself. Errors: those of
 * load and save; INVALID_ARGUMENT when both are one file; IO when the sizes in `source` are not the problem's. */
sadmm_status sadmm_fclib_save_solution(sadmm_problem *problem, const char *source, const char *path,
                                       struct sadmm_error *error);

#ifdef __cplusplus
}
#endif

#endif
