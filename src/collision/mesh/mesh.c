/* Meshes: checks of what callers give, vertices joined, the block put together. */
#include "mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "mesh_edges.h"
#include "mesh_tree.h"
#include "mesh_triangle.h"

enum { MOST_VERTICES = 1 << 26, MOST_TRIANGLES = 1 << 26, MOST_HEIGHTS = 1 << 26 };

static const double largest = 1e6, thinnest = 1e-9; /* m; of the longest edge */
/* Sine of the angle between two triangles below which they lie in one plane: vertices given in single precision bend
 * flat ground by about so much. */
static const double flattest = 1e-5;

static const sadmm_mesh_def default_triangles = {0};
static const sadmm_heightfield_def default_heights = {0};
static const struct sadmm_growing growing_triangles = SADMM_GROWING(sadmm_mesh_def, &default_triangles, triangle_count),
                                  growing_heights = SADMM_GROWING(sadmm_heightfield_def, &default_heights, spacing);

void sadmm_mesh_def_init(sadmm_mesh_def *def, size_t size) { sadmm_growing_init(&growing_triangles, def, size, 0); }
void sadmm_heightfield_def_init(sadmm_heightfield_def *def, size_t size)
{
    sadmm_growing_init(&growing_heights, def, size, 0);
}

/* ---- uses -------------------------------------------------------------------------------------------------------- */

void sadmm_mesh_retain(const sadmm_mesh *mesh)
{
    if (mesh) atomic_fetch_add_explicit(&((sadmm_mesh *)mesh)->uses, 1, memory_order_relaxed);
}

static void free_mesh(sadmm_mesh *mesh)
{
    if (!mesh) return;
    sadmm_free(mesh->block);
    sadmm_free(mesh->source);
    sadmm_free(mesh->given);
    sadmm_free(mesh);
}

void sadmm_mesh_release(const sadmm_mesh *mesh)
{
    sadmm_mesh *own = (sadmm_mesh *)mesh; /* const to everybody but its last user */
    if (own && atomic_fetch_sub_explicit(&own->uses, 1, memory_order_acq_rel) == 1) free_mesh(own);
}

void sadmm_mesh_destroy(sadmm_mesh *mesh) { sadmm_mesh_release(mesh); }

/* Keep `count` numbers, `per` a vertex, as they were given if one of them would not come back from the block's, which
 * are from `middle`. False: out of memory. */
static bool keep_given(sadmm_mesh *mesh, const double *given, const double *inside, size_t count, size_t per,
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

/* ---- marks ------------------------------------------------------------------------------------------------------- */

/* Does the vertex lie in the triangle's plane, seen from its corner k? */
static bool is_in_plane(const struct mesh *m, const struct mesh_triangle *t, int k, int32_t vertex)
{
    const vec3 d = v3_sub(v3_sub(mesh_vertex(m, vertex), t->origin), mesh_corner(t, k));
    return fabs(v3_dot(t->normal, d)) <= flattest * v3_norm(d);
}

/* Is everything around corner k in the triangle's plane? What lies at the end of the surface is not all around:
 * at_end, by vertex. */
static bool is_flat_corner(const struct mesh *m, const struct mesh_triangle *t, int k, const bool *at_end)
{
    if (at_end[t->corner[k]]) return false;
    for (int i = 0;; ++i) {
        const int32_t next = mesh_neighbour(m, t->corner[k], i);
        if (next == -1) return true;
        if (next >= 0 && !is_in_plane(m, t, k, next)) return false;
    }
}

/* The triangle beyond an edge of a heightfield, -1. */
static int32_t beside_height(const struct mesh *m, int32_t triangle, int k)
{
    const int32_t cells = m->columns - 1, cell = triangle / 2, row = cell / cells, column = cell % cells;
    if (triangle % 2) {
        if (k == 0) return triangle - 1;
        if (k == 1) return row + 2 < m->rows ? triangle - 1 + 2 * cells : -1;
        return column > 0 ? triangle - 3 : -1;
    }
    if (k == 2) return triangle + 1;
    if (k == 0) return row > 0 ? triangle + 1 - 2 * cells : -1;
    return column + 1 < cells ? triangle + 3 : -1;
}

/* The triangle beyond edge k, if it lies in the plane of `triangle`, else -1. */
static int32_t beside_in_plane(const struct mesh *m, const int32_t *beside, int32_t triangle, int k)
{
    struct mesh_triangle t;
    const int32_t other = beside ? beside[3 * triangle + k] : beside_height(m, triangle, k);
    if (other < 0) return -1;
    mesh_triangle_of(m, triangle, &t);
    return is_in_plane(m, &t, k, t.opposite[k]) ? other : -1;
}

/* From triangle to triangle around a vertex, in one plane, beginning across edge k: is one of them before `first`? */
static bool is_one_before(const struct mesh *m, const int32_t *beside, int32_t first, int k, int32_t vertex)
{
    int32_t from = first, at = beside_in_plane(m, beside, first, k);
    while (at > first) {
        int32_t corner[3], opposite[3], next = -1;
        mesh_corners(m, at, corner, opposite);
        for (int i = 0; i < 3; ++i) {
            const int32_t other = beside ? beside[3 * at + i] : beside_height(m, at, i);
            if ((corner[i] == vertex || corner[mesh_next_corner(i)] == vertex) && other != from)
                next = beside_in_plane(m, beside, at, i);
        }
        from = at;
        at = next;
    }
    return at >= 0 && at < first;
}

/* The marks of every triangle of a block that has all else. beside: 3 a triangle; NULL: a heightfield. False: out of
 * memory. */
static bool mark_triangles(const struct mesh *m, const int32_t *beside, uint16_t *marks)
{
    const size_t vertices = m->kind == MESH_HEIGHTS ? (size_t)m->columns * (size_t)m->rows : (size_t)m->vertices;
    bool *at_end = (bool *)sadmm_alloc(vertices, sizeof *at_end), *owned = (bool *)sadmm_alloc(vertices, sizeof *owned);
    struct mesh_triangle t;
    if (at_end && owned) {
        for (int32_t triangle = 0; triangle < m->triangles; ++triangle) {
            int32_t corner[3], opposite[3];
            mesh_corners(m, triangle, corner, opposite);
            for (int k = 0; k < 3; ++k)
                if (opposite[k] < 0) at_end[corner[k]] = at_end[corner[mesh_next_corner(k)]] = true;
        }
        for (int32_t triangle = 0; triangle < m->triangles; ++triangle) {
            unsigned all = 0;
            mesh_triangle_of(m, triangle, &t);
            for (int k = 0; k < 3; ++k) {
                const int32_t other = beside ? beside[3 * triangle + k] : beside_height(m, triangle, k);
                if (other >= 0 && is_in_plane(m, &t, k, t.opposite[k])) all |= 1u << (MESH_EDGE_FLAT + k);
                if (other < 0 || other > triangle) all |= 1u << (MESH_EDGE_OWN + k);
                if (is_flat_corner(m, &t, k, at_end)) all |= 1u << (MESH_CORNER_FLAT + k);
                if (!owned[t.corner[k]]) all |= 1u << (MESH_CORNER_OWN + k);
                if (is_one_before(m, beside, triangle, k, t.corner[k]) ||
                    is_one_before(m, beside, triangle, k > 0 ? k - 1 : 2, t.corner[k]))
                    all |= 1u << (MESH_CORNER_LATER + k);
                owned[t.corner[k]] = true;
            }
            marks[triangle] = (uint16_t)all;
        }
    }
    const bool made = at_end && owned;
    sadmm_free(at_end);
    sadmm_free(owned);
    return made;
}

/* ---- triangles --------------------------------------------------------------------------------------------------- */

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
        if (!(fabs(def->vertices[i]) <= largest))
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
    const bool kept = keep_given(mesh, corners, m->vertices, count, 3, mesh->middle);
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
    return mark_triangles(&view, m->edges.beside, (uint16_t *)view.marks);
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

/* ---- heights ----------------------------------------------------------------------------------------------------- */

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
        if (!(fabs(def->heights[i]) <= largest))
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
    if (!mark_triangles(&view, NULL, (uint16_t *)view.marks) ||
        !keep_given(mesh, def->heights, view.x, count, 1, mesh->middle + 2))
        return sadmm_fail_memory(error, "a heightfield");
    return SADMM_OK;
}

/* ---- what callers see -------------------------------------------------------------------------------------------- */

sadmm_status sadmm_mesh_create(const sadmm_mesh_def *given, sadmm_mesh **out)
{
    sadmm_mesh_def taken;
    const sadmm_mesh_def *const def = &taken;
    struct making making = {0};
    TRY(sadmm_check_given(out, "out", NULL));
    *out = NULL;
    TRY(sadmm_growing_take(&growing_triangles, &taken, given, "def", NULL));
    TRY(check_triangles(def, NULL));
    sadmm_mesh *mesh = (sadmm_mesh *)sadmm_alloc(1, sizeof *mesh);
    if (!mesh) return sadmm_fail_memory(NULL, "a mesh");
    sadmm_status status = make_triangles(def, &making, mesh, NULL);
    free_making(&making);
    if (status != SADMM_OK) {
        free_mesh(mesh);
        return status;
    }
    atomic_init(&mesh->uses, 1);
    *out = mesh;
    return SADMM_OK;
}

sadmm_status sadmm_heightfield_create(const sadmm_heightfield_def *given, sadmm_mesh **out)
{
    sadmm_heightfield_def taken;
    const sadmm_heightfield_def *const def = &taken;
    TRY(sadmm_check_given(out, "out", NULL));
    *out = NULL;
    TRY(sadmm_growing_take(&growing_heights, &taken, given, "def", NULL));
    TRY(check_heights(def, NULL));
    sadmm_mesh *mesh = (sadmm_mesh *)sadmm_alloc(1, sizeof *mesh);
    if (!mesh) return sadmm_fail_memory(NULL, "a heightfield");
    sadmm_status status = make_heights(def, mesh, NULL);
    if (status != SADMM_OK) {
        free_mesh(mesh);
        return status;
    }
    atomic_init(&mesh->uses, 1);
    *out = mesh;
    return SADMM_OK;
}

static const struct sadmm_mesh_header *header_of(const sadmm_mesh *mesh)
{
    return (const struct sadmm_mesh_header *)mesh->block;
}

int64_t sadmm_mesh_triangle_count(const sadmm_mesh *mesh) { return mesh ? header_of(mesh)->triangles : 0; }
int64_t sadmm_mesh_left_out(const sadmm_mesh *mesh) { return mesh ? mesh->left_out : 0; }
int64_t sadmm_mesh_open_edges(const sadmm_mesh *mesh) { return mesh ? header_of(mesh)->open_edges : 0; }
size_t sadmm_mesh_bytes(const sadmm_mesh *mesh) { return mesh ? mesh->doubles * sizeof *mesh->block : 0; }

sadmm_status sadmm_mesh_bounds(const sadmm_mesh *mesh, double lowest[3], double highest[3])
{
    TRY(sadmm_check_given(mesh, "mesh", NULL));
    TRY(sadmm_check_given(lowest, "lowest", NULL));
    TRY(sadmm_check_given(highest, "highest", NULL));
    for (int k = 0; k < 3; ++k) {
        lowest[k] = mesh->middle[k] - mesh->half[k];
        highest[k] = mesh->middle[k] + mesh->half[k];
    }
    return SADMM_OK;
}

int64_t sadmm_mesh_vertex_count(const sadmm_mesh *mesh)
{
    if (!mesh) return 0;
    const struct sadmm_mesh_header *header = header_of(mesh);
    return header->kind == MESH_HEIGHTS ? (int64_t)header->columns * header->rows : header->vertices;
}

static sadmm_status check_index(int64_t index, int64_t count, const char *name)
{
    if (index >= 0 && index < count) return SADMM_OK;
    return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "%s = %lld: must be in [0, %lld)", name, (long long)index,
                      (long long)count);
}

sadmm_status sadmm_mesh_vertex_at(const sadmm_mesh *mesh, int64_t vertex, double position[3])
{
    struct mesh view;
    TRY(sadmm_check_given(mesh, "mesh", NULL));
    TRY(sadmm_check_given(position, "position", NULL));
    TRY(check_index(vertex, sadmm_mesh_vertex_count(mesh), "vertex"));
    mesh_at(mesh->block, 0, &view);
    v3_store(v3_add(mesh_vertex(&view, (int32_t)vertex), v3_load(mesh->middle)), position);
    if (mesh->given && view.kind == MESH_HEIGHTS) position[2] = mesh->given[vertex];
    else if (mesh->given) memcpy(position, mesh->given + 3 * vertex, 3 * sizeof *position);
    return SADMM_OK;
}

sadmm_status sadmm_mesh_triangle_at(const sadmm_mesh *mesh, int64_t triangle, int32_t vertices[3], int32_t *number)
{
    struct mesh view;
    int32_t opposite[3];
    TRY(sadmm_check_given(mesh, "mesh", NULL));
    TRY(sadmm_check_given(vertices, "vertices", NULL));
    TRY(sadmm_check_given(number, "number", NULL));
    TRY(check_index(triangle, sadmm_mesh_triangle_count(mesh), "triangle"));
    mesh_at(mesh->block, 0, &view);
    mesh_corners(&view, (int32_t)triangle, vertices, opposite);
    *number = mesh->source ? mesh->source[triangle] : (int32_t)triangle;
    return SADMM_OK;
}

sadmm_status sadmm_mesh_grid(const sadmm_mesh *mesh, int32_t *columns, int32_t *rows, double spacing[2])
{
    TRY(sadmm_check_given(mesh, "mesh", NULL));
    TRY(sadmm_check_given(columns, "columns", NULL));
    TRY(sadmm_check_given(rows, "rows", NULL));
    TRY(sadmm_check_given(spacing, "spacing", NULL));
    const struct sadmm_mesh_header *header = header_of(mesh);
    *columns = header->columns;
    *rows = header->rows;
    memcpy(spacing, header->spacing, sizeof header->spacing);
    return SADMM_OK;
}
