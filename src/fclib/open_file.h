/* Problems in an HDF5 file that is open already, on a disk or in memory. */
#ifndef SADMM_FCLIB_OPEN_FILE_H
#define SADMM_FCLIB_OPEN_FILE_H

#include <hdf5.h>

#include "core/base/error.h"
#include "subadmm/problem.h"

/* As sadmm_fclib_load; the file stays open. */
sadmm_status sadmm_fclib_read(hid_t file, sadmm_problem **out, struct sadmm_error *error);

/* As sadmm_fclib_save, into a file without /fclib_global, which stays open; title: NULL for none. */
sadmm_status sadmm_fclib_write(sadmm_problem *problem, hid_t file, const char *title, struct sadmm_error *error);

#endif
