/* Heightfields: checks of what callers give, the block put together. */
#include <math.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "mesh_make.h"
#include "mesh_marks.h"
#include "mesh_triangle.h"

enum { MOST_HEIGHTS = 1 << 26 };

static const sadmm_heightfield_def defaults = {0};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_heightfield_def, &defaults, spacing);

void sadmm_heightfield_def_init(sadmm_heightfield_def *def, size_t size)
{
    sadmm_growing_init(&growing, def, size, 0);
}

static sadmm_status check_heights(const sadmm_heightfield_def *def, struct sadmm_error *error)
{
    TRY(sadmm_check_given(def->heights, "def->heights", error));
    if (def->columns < 2 || def->columns > MESH_MOST_COLUMNS)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->columns = %d: must be in [2, %d]", def->columns,
                          MESH_MOST_COLUMNS);
    if (def->rows < 2 || def->rows > MESH_MOST_COLUMNS)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->rows = %d: must be in [2, %d]", def->rows,
                          MESH_MOST_COLUMNS);
    if ((int64_t)def->columns * def->rows > MOST_HEIGHTS)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->columns x rows = %lld: must be at most %d",
                          (long long)def->columns * def->rows, MOST_HEIGHTS);
    for (int k = 0; k < 2; ++k)
        if (!(def->spacing[k] >= 1e-6 && def->spacing[k] <= 1e6))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->spacing[%d] = %g: must be in [1e-6, 1e6] m", k,
                              def->spacing[k]);
    for (size_t i = 0; i < (size_t)def->columns * (size_t)def->rows; ++i)
        if (!(fabs(def->heights[i]) <= MESH_LARGEST))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->heights[%zu] = %g: must be in [-1e6, 1e6] m",
                              i, def->heights[i]);
    return SADMM_OK;
}

static sadmm_status make_heights(const sadmm_heightfield_def *def, sadmm_mesh *mesh, struct sadmm_error *error)
{
    const size_t count = (size_t)def->columns * (size_t)def->rows;
    double lo = HUGE_VAL, hi = -HUGE_VAL;
    struct mesh view;
    mesh->doubles = mesh_height_doubles((size_t)def->columns, (size_t)def->rows);
    mesh->block = (double *)sadmm_alloc(mesh->doubles, sizeof *mesh->block);
    if (!mesh->block) return sadmm_fail_memory(error, "a heightfield");
    for (size_t i = 0; i < count; ++i) {
        lo = fmin(lo, def->heights[i]);
        hi = fmax(hi, def->heights[i]);
    }
    mesh->middle[2] = 0.5 * (lo + hi);
    mesh->half[0] = 0.5 * (def->columns - 1) * def->spacing[0];
    mesh->half[1] = 0.5 * (def->rows - 1) * def->spacing[1];
    mesh->half[2] = fmax(hi - mesh->middle[2], mesh->middle[2] - lo);
    const struct sadmm_mesh_header header = {
        .kind = MESH_HEIGHTS,
        .triangles = 2 * (def->columns - 1) * (def->rows - 1),
        .open_edges = 2 * (def->columns - 1) + 2 * (def->rows - 1),
        .doubles = (int32_t)mesh->doubles,
        .columns = def->columns,
        .rows = def->rows,
        .spacing = {def->spacing[0], def->spacing[1]},
        .half_height = mesh->half[2],
    };
    memcpy(mesh->block, &header, sizeof header);
    mesh_at(mesh->block, 0, &view);
    for (size_t i = 0; i < count; ++i) ((double *)view.x)[i] = def->heights[i] - mesh->middle[2];
    if (!sadmm_mesh_mark_triangles(&view, NULL, (uint16_t *)view.marks) ||
        !sadmm_mesh_keep_given(mesh, def->heights, view.x, count, 1, mesh->middle + 2))
        return sadmm_fail_memory(error, "a heightfield");
    return SADMM_OK;
}

sadmm_status sadmm_heightfield_create(const sadmm_heightfield_def *given, sadmm_mesh **out)
{
    sadmm_heightfield_def taken;
    const sadmm_heightfield_def *const def = &taken;
    TRY(sadmm_check_given(out, "out", NULL));
    *out = NULL;
    TRY(sadmm_growing_take(&growing, &taken, given, "def", NULL));
    TRY(check_heights(def, NULL));
    sadmm_mesh *mesh = (sadmm_mesh *)sadmm_alloc(1, sizeof *mesh);
    if (!mesh) return sadmm_fail_memory(NULL, "a heightfield");
    atomic_init(&mesh->uses, 1);
    sadmm_status status = make_heights(def, mesh, NULL);
    if (status != SADMM_OK) {
        sadmm_mesh_release(mesh);
        return status;
    }
    *out = mesh;
    return SADMM_OK;
}
