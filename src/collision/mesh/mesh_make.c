/* Meshes of triangles: checks of what callers give, vertices joined, the block put together. */
#include "mesh_make.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "mesh_edges.h"
#include "mesh_marks.h"
#include "mesh_tree.h"
#include "mesh_triangle.h"

enum { MOST_VERTICES = 1 << 26, MOST_TRIANGLES = 1 << 26 };

static const double thinnest = 1e-9; /* of the longest edge */

static const sadmm_mesh_def defaults = {0};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_mesh_def, &defaults, triangle_count);

void sadmm_mesh_def_init(sadmm_mesh_def *def, size_t size) { sadmm_growing_init(&growing, def, size, 0); }

bool sadmm_mesh_keep_given(sadmm_mesh *mesh, const double *given, const double *inside, size_t count, size_t per,
                           const double *middle)
{
    bool exact = true;
    for (size_t i = 0; i < count && exact; ++i) {
        const double back = inside[i] + middle[i % per];
        exact = memcmp(&back, &given[i], sizeof back) == 0;
    }
    if (exact) return true;
    mesh->given = (double *)sadmm_alloc(count, sizeof *given);
    if (mesh->given) memcpy(mesh->given, given, count * sizeof *given);
    return mesh->given != NULL;
}

/* A mesh on its way from the definition to the block. */
struct making {
    int32_t *same;    /* by vertex of the definition: the first one in its place, then its number in the block */
    double *vertices; /* from the middle of the box */
    int32_t *corners, *source, *ordered, *beside;
    int32_t vertex_count, triangle_count;
    struct box_tree tree;
    struct mesh_edges edges;
};

static void free_making(struct making *m)
{
    sadmm_free(m->same);
    sadmm_free(m->vertices);
    sadmm_free(m->corners);
    sadmm_free(m->source);
    sadmm_free(m->ordered);
    sadmm_free(m->beside);
    sadmm_box_tree_free(&m->tree);
    sadmm_mesh_edges_free(&m->edges);
}

static sadmm_status check_triangles(const sadmm_mesh_def *def, struct sadmm_error *error)
{
    TRY(sadmm_check_given(def->vertices, "def->vertices", error));
    TRY(sadmm_check_given(def->triangles, "def->triangles", error));
    if (def->vertex_count < 3 || def->vertex_count > MOST_VERTICES)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->vertex_count = %zu: must be in [3, %d]",
                          def->vertex_count, MOST_VERTICES);
    if (def->triangle_count < 1 || def->triangle_count > MOST_TRIANGLES)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->triangle_count = %zu: must be in [1, %d]",
                          def->triangle_count, MOST_TRIANGLES);
    for (size_t i = 0; i < 3 * def->vertex_count; ++i)
        if (!(fabs(def->vertices[i]) <= MESH_LARGEST))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->vertices[%zu] = %g: must be in [-1e6, 1e6] m",
                              i, def->vertices[i]);
    for (size_t i = 0; i < 3 * def->triangle_count; ++i)
        if (def->triangles[i] < 0 || (size_t)def->triangles[i] >= def->vertex_count)
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->triangles[%zu] = %d: must be in [0, %zu)", i,
                              def->triangles[i], def->vertex_count);
    return SADMM_OK;
}

struct place {
    double x[3];
    int32_t vertex;
};

static int compare_places(const void *left, const void *right)
{
    const struct place *a = (const struct place *)left, *b = (const struct place *)right;
    for (int k = 0; k < 3; ++k)
        if (a->x[k] != b->x[k]) return a->x[k] < b->x[k] ? -1 : 1;
    return (a->vertex > b->vertex) - (a->vertex < b->vertex);
}

/* same[v]: the first vertex that is where v is. False: out of memory. */
static bool join_vertices(const sadmm_mesh_def *def, int32_t *same)
{
    struct place *places = (struct place *)sadmm_alloc(def->vertex_count, sizeof *places);
    if (!places) return false;
    for (size_t v = 0; v < def->vertex_count; ++v) {
        memcpy(places[v].x, def->vertices + 3 * v, sizeof places[v].x);
        places[v].vertex = (int32_t)v;
    }
    qsort(places, def->vertex_count, sizeof *places, compare_places);
    for (size_t i = 0, first = 0; i < def->vertex_count; ++i) {
        for (int k = 0; k < 3; ++k)
            if (places[i].x[k] != places[first].x[k]) first = i;
        same[places[i].vertex] = places[first].vertex;
    }
    sadmm_free(places);
    return true;
}

static bool is_thin(const double *vertices, const int32_t corner[3])
{
    vec3 d[3], n;
    double longest2 = 0;
    for (int k = 0; k < 3; ++k) {
        d[k] = v3_sub(v3_load(vertices + 3 * (size_t)corner[mesh_next_corner(k)]),
                      v3_load(vertices + 3 * (size_t)corner[k]));
        longest2 = fmax(longest2, v3_norm2(d[k]));
    }
    n = v3_cross(d[0], d[1]);
    return !(v3_norm2(n) > thinnest * thinnest * longest2 * longest2);
}

/* The triangles that are some, by the first vertices in their places. */
static void keep_triangles(const sadmm_mesh_def *def, struct making *m)
{
    for (size_t t = 0; t < def->triangle_count; ++t) {
        int32_t *corner = m->corners + 3 * (size_t)m->triangle_count;
        for (int k = 0; k < 3; ++k) corner[k] = m->same[def->triangles[3 * t + (size_t)k]];
        if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0] ||
            is_thin(def->vertices, corner))
            continue;
        m->source[m->triangle_count++] = (int32_t)t;
    }
}

/* m->same: the number of every vertex, -1: it is no corner. False: out of memory. */
static bool keep_vertices(const sadmm_mesh_def *def, const struct making *m, sadmm_mesh *mesh)
{
    const size_t count = 3 * (size_t)m->vertex_count;
    double *corners = (double *)sadmm_alloc(count, sizeof *corners);
    if (!corners) return false;
    for (size_t v = 0; v < def->vertex_count; ++v)
        if (m->same[v] >= 0)
            memcpy(corners + 3 * (size_t)m->same[v], def->vertices + 3 * v, 3 * sizeof *corners);
    const bool kept = sadmm_mesh_keep_given(mesh, corners, m->vertices, count, 3, mesh->middle);
    sadmm_free(corners);
    return kept;
}

/* Vertices that are corners get numbers in order; the box around them. False: out of memory. */
static bool number_vertices(const sadmm_mesh_def *def, struct making *m, sadmm_mesh *mesh)
{
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (size_t v = 0; v < def->vertex_count; ++v) m->same[v] = -1;
    for (int32_t c = 0; c < 3 * m->triangle_count; ++c) m->same[m->corners[c]] = 0;
    for (size_t v = 0; v < def->vertex_count; ++v) {
        if (m->same[v] < 0) continue;
        const double *x = def->vertices + 3 * v;
        m->same[v] = m->vertex_count;
        memcpy(m->vertices + 3 * (size_t)m->vertex_count++, x, 3 * sizeof *x);
        for (int k = 0; k < 3; ++k) {
            lo[k] = fmin(lo[k], x[k]);
            hi[k] = fmax(hi[k], x[k]);
        }
    }
    for (int32_t c = 0; c < 3 * m->triangle_count; ++c) m->corners[c] = m->same[m->corners[c]];
    for (int k = 0; k < 3; ++k) {
        mesh->middle[k] = 0.5 * (lo[k] + hi[k]);
        mesh->half[k] = 0;
    }
    for (size_t i = 0; i < 3 * (size_t)m->vertex_count; ++i) {
        m->vertices[i] -= mesh->middle[i % 3];
        mesh->half[i % 3] = fmax(mesh->half[i % 3], fabs(m->vertices[i]));
    }
    return keep_vertices(def, m, mesh);
}

/* Corners as the tree has its triangles; what they were. */
static void order_triangles(struct making *m, sadmm_mesh *mesh)
{
    for (int32_t t = 0; t < m->triangle_count; ++t) {
        const int32_t from = m->tree.order[t];
        memcpy(m->ordered + 3 * (size_t)t, m->corners + 3 * (size_t)from, 3 * sizeof *m->ordered);
        mesh->source[t] = m->source[from];
    }
}

static bool write_triangles(const struct making *m, sadmm_mesh *mesh)
{
    struct mesh view;
    const size_t triangles = (size_t)m->triangle_count, vertices = (size_t)m->vertex_count;
    mesh->doubles = mesh_triangle_doubles(triangles, vertices, (size_t)m->tree.count, (size_t)m->edges.ring_count);
    mesh->block = (double *)sadmm_alloc(mesh->doubles, sizeof *mesh->block);
    if (!mesh->block) return false;
    const struct sadmm_mesh_header header = {
        .kind = MESH_TRIANGLES,
        .triangles = m->triangle_count,
        .vertices = m->vertex_count,
        .nodes = m->tree.count,
        .ring = m->edges.ring_count,
        .open_edges = m->edges.open,
        .doubles = (int32_t)mesh->doubles,
    };
    memcpy(mesh->block, &header, sizeof header);
    mesh_at(mesh->block, 0, &view);
    memcpy((double *)view.x, m->vertices, 3 * vertices * sizeof *view.x);
    memcpy((struct mesh_node *)view.node, m->tree.nodes, (size_t)m->tree.count * sizeof *view.node);
    memcpy((int32_t *)view.corner, m->ordered, 3 * triangles * sizeof *view.corner);
    memcpy((int32_t *)view.opposite, m->edges.opposite, 3 * triangles * sizeof *view.opposite);
    memcpy((int32_t *)view.ring_first, m->edges.ring_first, (vertices + 1) * sizeof *view.ring_first);
    memcpy((int32_t *)view.ring, m->edges.ring, (size_t)m->edges.ring_count * sizeof *view.ring);
    return sadmm_mesh_mark_triangles(&view, m->edges.beside, (uint16_t *)view.marks);
}

static sadmm_status make_triangles(const sadmm_mesh_def *def, struct making *m, sadmm_mesh *mesh,
                                   struct sadmm_error *error)
{
    const size_t corners = 3 * def->triangle_count;
    m->same = (int32_t *)sadmm_alloc(def->vertex_count, sizeof *m->same);
    m->vertices = (double *)sadmm_alloc(3 * def->vertex_count, sizeof *m->vertices);
    m->corners = (int32_t *)sadmm_alloc(corners, sizeof *m->corners);
    m->ordered = (int32_t *)sadmm_alloc(corners, sizeof *m->ordered);
    m->source = (int32_t *)sadmm_alloc(def->triangle_count, sizeof *m->source);
    mesh->source = (int32_t *)sadmm_alloc(def->triangle_count, sizeof *mesh->source);
    if (!m->same || !m->vertices || !m->corners || !m->ordered || !m->source || !mesh->source ||
        !join_vertices(def, m->same))
        return sadmm_fail_memory(error, "a mesh");
    keep_triangles(def, m);
    if (m->triangle_count == 0)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "def->triangles: none of %zu has three corners that are not in one line",
                          def->triangle_count);
    mesh->left_out = (int64_t)def->triangle_count - m->triangle_count;
    if (!number_vertices(def, m, mesh)) return sadmm_fail_memory(error, "a mesh");
    if (!sadmm_mesh_tree_make(m->vertices, m->corners, m->triangle_count, &m->tree))
        return sadmm_fail_memory(error, "a mesh");
    order_triangles(m, mesh);
    if (!sadmm_mesh_edges_find(m->ordered, m->triangle_count, m->vertex_count, &m->edges) || !write_triangles(m, mesh))
        return sadmm_fail_memory(error, "a mesh");
    return SADMM_OK;
}

sadmm_status sadmm_mesh_create(const sadmm_mesh_def *given, sadmm_mesh **out)
{
    sadmm_mesh_def taken;
    const sadmm_mesh_def *const def = &taken;
    struct making making = {0};
    TRY(sadmm_check_given(out, "out", NULL));
    *out = NULL;
    TRY(sadmm_growing_take(&growing, &taken, given, "def", NULL));
    TRY(check_triangles(def, NULL));
    sadmm_mesh *mesh = (sadmm_mesh *)sadmm_alloc(1, sizeof *mesh);
    if (!mesh) return sadmm_fail_memory(NULL, "a mesh");
    atomic_init(&mesh->uses, 1);
    sadmm_status status = make_triangles(def, &making, mesh, NULL);
    free_making(&making);
    if (status != SADMM_OK) {
        sadmm_mesh_release(mesh);
        return status;
    }
    *out = mesh;
    return SADMM_OK;
}
