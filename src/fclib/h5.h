/* Small arrays in HDF5 files, read with distrust and without noise. */
#ifndef SADMM_FCLIB_H5_H
#define SADMM_FCLIB_H5_H

#include <hdf5.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/error.h"

/* Between begin and end this thread holds the module's lock and HDF5 prints nothing. */
struct sadmm_h5_session {
    H5E_auto2_t print;
    void *print_data;
};
sadmm_status sadmm_h5_begin(struct sadmm_h5_session *session, struct sadmm_error *error);
void sadmm_h5_end(const struct sadmm_h5_session *session);

enum sadmm_h5_mode { SADMM_H5_READ, SADMM_H5_EDIT, SADMM_H5_CREATE };

/* CREATE writes over what is there. Errors: IO. */
sadmm_status sadmm_h5_open(const char *path, enum sadmm_h5_mode mode, hid_t *file, struct sadmm_error *error);
/* Errors: IO when what was written could not be flushed. */
sadmm_status sadmm_h5_close(hid_t file, struct sadmm_error *error);

/* Is there an object of that absolute name in the file itself? */
bool sadmm_h5_exists(hid_t file, const char *name);

/* Read a dataset whole. `count` in: the number of elements it must have, or -1 for any; out: the number read.
 * *data is for sadmm_free; NULL after an error. Doubles must be finite. Errors: IO, OUT_OF_MEMORY. */
sadmm_status sadmm_h5_read_double(hid_t file, const char *name, int64_t *count, double **data,
                                  struct sadmm_error *error);
sadmm_status sadmm_h5_read_int(hid_t file, const char *name, int64_t *count, int32_t **data, struct sadmm_error *error);
/* One integer in [lo, hi]. */
sadmm_status sadmm_h5_read_value(hid_t file, const char *name, int32_t lo, int32_t hi, int32_t *value,
                                 struct sadmm_error *error);

/* Write into a new dataset; the parents are made. Errors: IO. */
sadmm_status sadmm_h5_write_double(hid_t file, const char *name, size_t count, const double *data,
                                   struct sadmm_error *error);
sadmm_status sadmm_h5_write_int(hid_t file, const char *name, size_t count, const int32_t *data,
                                struct sadmm_error *error);
sadmm_status sadmm_h5_write_string(hid_t file, const char *name, const char *text, struct sadmm_error *error);
/* Remove an object if it is there. Errors: IO. */
sadmm_status sadmm_h5_remove(hid_t file, const char *name, struct sadmm_error *error);

#endif
