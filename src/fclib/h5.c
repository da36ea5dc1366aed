#include "h5.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <string.h>
#include <sys/stat.h>

#include "core/base/memory.h"

/* libhdf5 is usually built without thread safety, and its error printing is a setting of the whole process. */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

sadmm_status sadmm_h5_begin(struct sadmm_h5_session *session, struct sadmm_error *error)
{
    pthread_mutex_lock(&lock);
    /* Every file is closed here. libhdf5's own clean-up at exit can loop, and print, over what a damaged file left. */
    H5dont_atexit();
    if (H5open() >= 0 && H5Eget_auto2(H5E_DEFAULT, &session->print, &session->print_data) >= 0 &&
        H5Eset_auto2(H5E_DEFAULT, NULL, NULL) >= 0)
        return SADMM_OK;
    pthread_mutex_unlock(&lock);
    return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE, "libhdf5 could not be started");
}

void sadmm_h5_end(const struct sadmm_h5_session *session)
{
    H5Eclear2(H5E_DEFAULT);
    H5Eset_auto2(H5E_DEFAULT, session->print, session->print_data);
    pthread_mutex_unlock(&lock);
}

/* ---- errors ------------------------------------------------------------------------------------------------------ */

static herr_t keep_first(unsigned depth, const H5E_error2_t *e, void *data)
{
    const char **text = data;
    if (depth == 0) *text = e->desc;
    return 0;
}

/* Fail with what HDF5 says was the innermost reason. Before any other call of HDF5: those forget it. */
static sadmm_status fail_h5(struct sadmm_error *error, const char *name, const char *what)
{
    static const char system_says[] = "error message = '"; /* among the time, the file's name and more */
    const char *reason = NULL;
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_first, &reason);
    const char *system = reason ? strstr(reason, system_says) : NULL;
    if (system) reason = system + strlen(system_says);
    sadmm_fail(error, SADMM_ERROR_IO, "%.140s: %s (%.*s)", name, what, system ? (int)strcspn(reason, "'") : 100,
               reason ? reason : "no reason given by HDF5");
    H5Eclear2(H5E_DEFAULT);
    return SADMM_ERROR_IO;
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

sadmm_status sadmm_h5_open(const char *path, enum sadmm_h5_mode mode, hid_t *file, struct sadmm_error *error)
{
    struct stat info;
    /* HDF5 would wait for the other end of a pipe. */
    if (mode != SADMM_H5_CREATE && stat(path, &info) != 0)
        return sadmm_fail(error, SADMM_ERROR_IO, "%s", strerror(errno));
    if (mode != SADMM_H5_CREATE && !S_ISREG(info.st_mode)) return sadmm_fail(error, SADMM_ERROR_IO, "is not a file");
    hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    if (access < 0) return fail_h5(error, "file", "no file access list");
    /* Closing the file closes what an error path left open in it. */
    H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
#if H5_VERSION_GE(1, 10, 7) && !(H5_VERS_MAJOR == 1 && H5_VERS_MINOR == 12 && H5_VERS_RELEASE == 0)
    H5Pset_file_locking(access, true, true); /* file systems without locks are fine */
#endif
    if (mode == SADMM_H5_CREATE) *file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, access);
    else *file = H5Fopen(path, mode == SADMM_H5_EDIT ? H5F_ACC_RDWR : H5F_ACC_RDONLY, access);
    sadmm_status status = SADMM_OK;
    if (*file < 0)
        status = fail_h5(error, "file", mode == SADMM_H5_CREATE ? "cannot create the file" : "cannot open as HDF5");
    H5Pclose(access);
    return status;
}

sadmm_status sadmm_h5_close(hid_t file, struct sadmm_error *error)
{
    sadmm_status status = SADMM_OK;
    if (H5Fflush(file, H5F_SCOPE_LOCAL) < 0) status = fail_h5(error, "file", "could not be written completely");
    if (H5Fclose(file) < 0 && status == SADMM_OK) status = fail_h5(error, "file", "could not be written completely");
    return status;
}

/* ---- names: a link that leaves the file is refused --------------------------------------------------------------- */

static herr_t refuse_external(const char *parent_file, const char *parent_group, const char *child_file,
                              const char *child_object, unsigned *flags, hid_t access, void *data)
{
    (void)parent_file, (void)parent_group, (void)child_file, (void)child_object, (void)flags, (void)access, (void)data;
    return -1;
}

static hid_t access_list(hid_t class)
{
    hid_t list = H5Pcreate(class);
    if (list >= 0 && H5Pset_elink_cb(list, refuse_external, NULL) < 0) {
        H5Pclose(list);
        list = -1;
    }
    return list;
}

bool sadmm_h5_exists(hid_t file, const char *name)
{
    char part[128];
    size_t length = strlen(name);
    bool found = length > 0 && length < sizeof part && name[0] == '/';
    hid_t access = access_list(H5P_LINK_ACCESS);
    if (access < 0) return false;
    for (size_t at = 1; found && at <= length; ++at) {
        if (name[at] != '/' && name[at] != 0) continue;
        memcpy(part, name, at);
        part[at] = 0;
        found = H5Lexists(file, part, access) > 0 && H5Oexists_by_name(file, part, access) > 0;
    }
    H5Pclose(access);
    H5Eclear2(H5E_DEFAULT);
    return found;
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* Deflate cannot shrink data by more than 1032 times; a header that promises more lies about the data's size. No
 * machine has numbers of more bytes. */
enum { MOST_COMPRESSION = 1100, MOST_BYTES = 16, MOST_DIMENSIONS = 32 };

/* The elements of a chunk: HDF5 unpacks whole ones, also where the dataset is smaller. 0: not in chunks. */
static hsize_t chunk_elements(hid_t list, H5D_layout_t layout)
{
    hsize_t size[MOST_DIMENSIONS], count = 1;
    int rank = layout == H5D_CHUNKED ? H5Pget_chunk(list, MOST_DIMENSIONS, size) : 0;
    for (int k = 0; k < rank; ++k) count *= size[k]; /* below 2^32, which HDF5 checks */
    return rank > 0 ? count : 0;
}

/* The elements of a dataset if it is one we read: plain numbers, stored in this file, written. -1 with a message. */
static int64_t check_dataset(hid_t file, hid_t dataset, H5T_class_t class, const char *name, int64_t expected,
                             struct sadmm_error *error)
{
    hid_t type = H5Dget_type(dataset), space = H5Dget_space(dataset), list = H5Dget_create_plist(dataset);
    hsize_t file_size = 0, stored = H5Dget_storage_size(dataset);
    hssize_t count = space >= 0 ? H5Sget_simple_extent_npoints(space) : -1;
    H5D_layout_t layout = list >= 0 ? H5Pget_layout(list) : H5D_LAYOUT_ERROR;
    size_t size = type >= 0 ? H5Tget_size(type) : 0;
    int external = list >= 0 ? H5Pget_external_count(list) : -1;
    hsize_t unpacked = list >= 0 ? chunk_elements(list, layout) : 0;
    H5T_class_t found = type >= 0 ? H5Tget_class(type) : H5T_NO_CLASS;
    H5Fget_filesize(file, &file_size);
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    if (list >= 0) H5Pclose(list);
    if (count > 0 && (hsize_t)count > unpacked) unpacked = (hsize_t)count;

    if (count < 0 || size == 0 || layout == H5D_LAYOUT_ERROR || external < 0) {
        fail_h5(error, name, "unreadable header");
    } else if (found != class) {
        sadmm_fail(error, SADMM_ERROR_IO, "%s: must hold %s", name,
                   class == H5T_FLOAT ? "floating point numbers" : "integers");
    } else if (size > MOST_BYTES) {
        sadmm_fail(error, SADMM_ERROR_IO, "%s: numbers of %zu bytes: must be of %d at most", name, size, MOST_BYTES);
    } else if (external > 0 || layout == H5D_VIRTUAL) {
        sadmm_fail(error, SADMM_ERROR_IO, "%s: its data is in another file, which is not read", name);
    } else if (expected >= 0 && count != expected) {
        sadmm_fail(error, SADMM_ERROR_IO, "%s: holds %lld values, %lld expected", name, (long long)count,
                   (long long)expected);
    } else if (stored > file_size || (stored == 0 && count > 0) ||
               (count > 0 && unpacked / MOST_COMPRESSION > stored / size + 1)) {
        sadmm_fail(error, SADMM_ERROR_IO, "%s: announces %llu values, but only %llu bytes of data are in the file",
                   name, (unsigned long long)unpacked, (unsigned long long)stored);
    } else {
        return (int64_t)count;
    }
    return -1;
}

/* `size` bytes an element in memory. */
static sadmm_status read_array(hid_t file, const char *name, H5T_class_t class, hid_t memory_type, size_t size,
                               int64_t *count, void **data, struct sadmm_error *error)
{
    *data = NULL;
    hid_t access = access_list(H5P_DATASET_ACCESS);
    hid_t dataset = access >= 0 ? H5Dopen2(file, name, access) : -1;
    sadmm_status status = dataset >= 0 ? SADMM_ERROR_IO : fail_h5(error, name, "cannot open as a dataset");
    if (access >= 0) H5Pclose(access);
    if (dataset < 0)
        return sadmm_h5_exists(file, name) ? status : sadmm_fail(error, SADMM_ERROR_IO, "%s: missing", name);

    int64_t found = check_dataset(file, dataset, class, name, *count, error);
    if (found >= 0) {
        *data = sadmm_alloc((size_t)found, size);
        if (!*data) status = sadmm_fail_memory(error, name);
        else if (found > 0 && H5Dread(dataset, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, *data) < 0)
            status = fail_h5(error, name, "cannot be read");
        else status = SADMM_OK;
    }
    H5Dclose(dataset);
    if (status != SADMM_OK) {
        sadmm_free(*data);
        *data = NULL;
    } else {
        *count = found;
    }
    return status;
}

sadmm_status sadmm_h5_read_double(hid_t file, const char *name, int64_t *count, double **data,
                                  struct sadmm_error *error)
{
    void *block = NULL;
    *data = NULL;
    sadmm_status status = read_array(file, name, H5T_FLOAT, H5T_NATIVE_DOUBLE, sizeof(double), count, &block, error);
    if (status != SADMM_OK) return status;
    double *values = block;
    for (int64_t i = 0; i < *count; ++i)
        if (!isfinite(values[i])) {
            status = sadmm_fail(error, SADMM_ERROR_IO, "%s: value %lld is %g: must be finite", name, (long long)i,
                                values[i]);
            sadmm_free(block);
            return status;
        }
    *data = values;
    return SADMM_OK;
}

sadmm_status sadmm_h5_read_int(hid_t file, const char *name, int64_t *count, int32_t **data, struct sadmm_error *error)
{
    void *block = NULL;
    /* HDF5 clamps wider integers that do not fit; a clamped index is out of every range checked later. */
    sadmm_status status = read_array(file, name, H5T_INTEGER, H5T_NATIVE_INT32, sizeof(int32_t), count, &block, error);
    *data = block;
    return status;
}

sadmm_status sadmm_h5_read_value(hid_t file, const char *name, int32_t lo, int32_t hi, int32_t *value,
                                 struct sadmm_error *error)
{
    int64_t one = 1;
    int32_t *data;
    sadmm_status status = sadmm_h5_read_int(file, name, &one, &data, error);
    if (status != SADMM_OK) return status;
    *value = *data;
    sadmm_free(data);
    if (*value >= lo && *value <= hi) return SADMM_OK;
    return sadmm_fail(error, SADMM_ERROR_IO, "%s = %d: must be in [%d, %d]", name, *value, lo, hi);
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static sadmm_status write_dataset(hid_t file, const char *name, hid_t file_type, hid_t memory_type, hid_t space,
                                  const void *data, struct sadmm_error *error)
{
    hid_t links = H5Pcreate(H5P_LINK_CREATE), storage = H5Pcreate(H5P_DATASET_CREATE), dataset = -1;
    /* without times: the same problem is the same file */
    if (space >= 0 && links >= 0 && storage >= 0 && H5Pset_create_intermediate_group(links, 1) >= 0 &&
        H5Pset_obj_track_times(storage, false) >= 0)
        dataset = H5Dcreate2(file, name, file_type, space, links, storage, H5P_DEFAULT);
    sadmm_status status = SADMM_OK;
    if (dataset < 0 || (data && H5Dwrite(dataset, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0))
        status = fail_h5(error, name, "cannot be written");
    if (dataset >= 0 && H5Dclose(dataset) < 0 && status == SADMM_OK) status = fail_h5(error, name, "cannot be written");
    if (storage >= 0) H5Pclose(storage);
    if (links >= 0) H5Pclose(links);
    if (space >= 0) H5Sclose(space);
    return status;
}

sadmm_status sadmm_h5_write_double(hid_t file, const char *name, size_t count, const double *data,
                                   struct sadmm_error *error)
{
    hsize_t size = count;
    return write_dataset(file, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, H5Screate_simple(1, &size, NULL),
                         count ? data : NULL, error);
}

sadmm_status sadmm_h5_write_int(hid_t file, const char *name, size_t count, const int32_t *data,
                                struct sadmm_error *error)
{
    hsize_t size = count;
    return write_dataset(file, name, H5T_STD_I32LE, H5T_NATIVE_INT32, H5Screate_simple(1, &size, NULL),
                         count ? data : NULL, error);
}

sadmm_status sadmm_h5_write_string(hid_t file, const char *name, const char *text, struct sadmm_error *error)
{
    hid_t type = H5Tcopy(H5T_C_S1);
    if (type < 0 || H5Tset_size(type, strlen(text) + 1) < 0) {
        if (type >= 0) H5Tclose(type);
        return fail_h5(error, name, "no string type");
    }
    sadmm_status status = write_dataset(file, name, type, type, H5Screate(H5S_SCALAR), text, error);
    H5Tclose(type);
    return status;
}

sadmm_status sadmm_h5_remove(hid_t file, const char *name, struct sadmm_error *error)
{
    if (!sadmm_h5_exists(file, name)) return SADMM_OK;
    return H5Ldelete(file, name, H5P_DEFAULT) >= 0 ? SADMM_OK : fail_h5(error, name, "cannot be replaced");
}
