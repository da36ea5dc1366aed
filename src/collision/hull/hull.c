/* Convex hulls: from points to the polyhedron, and what callers see of it.
 *
 * qhull's faces depend on the order of the points, and nothing says that faces which it has joined are those of a
 * polyhedron. So it gets the points in an order of their own, and what it returns is checked: closed, of the right
 * genus, convex to within what faces were joined by. What fails is made again with fewer faces joined. All numbers come
 * from the faces in an order that is the points' own as well; only then are vertices numbered as callers gave them.
 */
#include "hull.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/definition_fields.h"
#include "core/base/growing.h"
#include "core/base/memory.h"
#include "core/math/quat.h"
#include "hull_data.h"
#include "hull_faces.h"
#include "hull_measure.h"
#include "hull_mesh.h"
#include "hull_points.h"
#include "hull_write.h"

enum { LEAST_POINTS = 4, MOST_POINTS = 1000000 };
/* Of more points those inside are left out first, and hulls of more corners given up before they fill the memory. */
enum { MANY_POINTS = 1 << 15 };

static const double thinnest = 1e-6;    /* of the extent, and m */
static const double straightest = 1e-9; /* of the extent: no contact feels what bends less */

static const sadmm_hull_def defaults = {SADMM_HULL_FIELDS(SADMM_FIELD_DEFAULT, )};
static const struct sadmm_growing growing = SADMM_GROWING(sadmm_hull_def, &defaults, convex_radius);

void sadmm_hull_def_init(sadmm_hull_def *def, size_t size) { sadmm_growing_init(&growing, def, size, 0); }

/* ---- uses ---- */

void sadmm_hull_retain(const sadmm_hull *hull)
{
    if (hull) atomic_fetch_add_explicit(&((sadmm_hull *)hull)->uses, 1, memory_order_relaxed);
}

static void free_hull(sadmm_hull *hull)
{
    sadmm_free(hull->block);
    sadmm_free(hull->vertices);
    sadmm_free(hull->face_first);
    sadmm_free(hull->corners);
    sadmm_free(hull);
}

void sadmm_hull_release(const sadmm_hull *hull)
{
    sadmm_hull *own = (sadmm_hull *)hull; /* const to everybody but its last user */
    if (own && atomic_fetch_sub_explicit(&own->uses, 1, memory_order_acq_rel) == 1) free_hull(own);
}

void sadmm_hull_destroy(sadmm_hull *hull)
{
    sadmm_hull_release(hull);
}

/* ---- from points to faces ---- */

struct making {
    struct hull_points points;
    struct hull_mesh mesh;
    double *scaled;            /* the points as qhull gets them */
    double *vertices, *planes; /* of the mesh */
    int32_t *rank;
    double merge, convex_radius;
};

static void free_making(struct making *m)
{
    sadmm_hull_points_free(&m->points);
    sadmm_hull_mesh_free(&m->mesh);
    sadmm_free(m->scaled);
    sadmm_free(m->vertices);
    sadmm_free(m->planes);
    sadmm_free(m->rank);
}

/* By a power of two: the same polyhedron. */
static double scale_of(const struct hull_points *points)
{
    int exponent;
    frexp(points->extent, &exponent);
    return ldexp(1, -exponent);
}

static void scale_points(struct making *m)
{
    const double scale = scale_of(&m->points);
    for (int32_t i = 0; i < m->points.count; ++i)
        for (int k = 0; k < 3; ++k) m->scaled[3 * i + k] = scale * m->points.at[i].x[k];
}

/* Points that are corners before any face is joined; the others go. */
static sadmm_status leave_out_inner(struct making *m, struct sadmm_error *error)
{
    const enum hull_faces_are are = sadmm_hull_faces_find(m->scaled, m->points.count, 0, MANY_POINTS, &m->mesh);
    if (are == HULL_FACES_NO_MEMORY) return sadmm_fail_memory(error, "a hull");
    if (are == HULL_FACES_TOO_MANY)
        return sadmm_fail(error, SADMM_ERROR_LIMIT,
                          "def->points: more than %d of them are corners of their hull, which may have %d vertices",
                          MANY_POINTS, HULL_MOST_VERTICES);
    if (are == HULL_FACES_FOUND) {
        bool *corner = (bool *)sadmm_alloc((size_t)m->points.count, sizeof *corner);
        int32_t kept = 0;
        if (!corner) return sadmm_fail_memory(error, "a hull");
        for (int32_t c = 0; c < m->mesh.face_first[m->mesh.face_count]; ++c) corner[m->mesh.corner[c]] = true;
        for (int32_t i = 0; i < m->points.count; ++i)
            if (corner[i]) m->points.at[kept++] = m->points.at[i];
        sadmm_free(corner);
        m->points.count = kept;
        scale_points(m);
    }
    m->mesh.face_count = 0;
    return SADMM_OK;
}

/* Faces in the points' own order, vertices and planes of them about the middle of the points. False: out of memory. */
static bool place_vertices(struct making *m)
{
    const size_t vertices = (size_t)m->mesh.vertex_count, faces = (size_t)m->mesh.face_count;
    if (!SADMM_GROW(m->vertices, 0, 3 * vertices) || !SADMM_GROW(m->planes, 0, 4 * faces) ||
        !SADMM_GROW(m->rank, 0, vertices))
        return false;
    for (int32_t v = 0; v < m->mesh.vertex_count; ++v) {
        m->rank[v] = v;
        memcpy(m->vertices + 3 * v, m->points.at[m->mesh.point[v]].x, 3 * sizeof *m->vertices);
    }
    return sadmm_hull_mesh_order(&m->mesh, m->rank, NULL);
}

/* The mesh that qhull makes of the points; *found: it is their convex hull. flat: what faces are joined by, m. */
static sadmm_status attempt(struct making *m, double flat, bool *found, struct sadmm_error *error)
{
    *found = false;
    m->mesh.face_count = 0;
    const enum hull_faces_are are =
        sadmm_hull_faces_find(m->scaled, m->points.count, flat * scale_of(&m->points), 0, &m->mesh);
    if (are == HULL_FACES_NO_MEMORY) return sadmm_fail_memory(error, "a hull");
    if (are == HULL_FACES_UNAVAILABLE)
        return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE,
                          "hulls need qhull, which this library was built without (-Dqhull=enabled asks for it)");
    if (are != HULL_FACES_FOUND) return SADMM_OK;
    const enum hull_mesh_is is = sadmm_hull_mesh_close(&m->mesh, m->points.count);
    if (is == HULL_MESH_NO_MEMORY) return sadmm_fail_memory(error, "a hull");
    if (is != HULL_MESH_CLOSED) return SADMM_OK;
    if (m->mesh.vertex_count > HULL_MOST_VERTICES || m->mesh.edge_count > HULL_MOST_EDGES)
        return sadmm_fail(error, SADMM_ERROR_LIMIT,
                          "def->points: their hull has %d vertices and %d edges, may have %d and %d",
                          (int)m->mesh.vertex_count, (int)m->mesh.edge_count, HULL_MOST_VERTICES, HULL_MOST_EDGES);
    if (!place_vertices(m)) return sadmm_fail_memory(error, "a hull");
    /* Joined once and again, faces bend by a few times what two of them may. */
    *found = sadmm_hull_planes(&m->mesh, m->vertices, m->planes) &&
             sadmm_hull_bulge(&m->mesh, m->vertices, m->planes, &m->points) <=
                 4 * flat + straightest * m->points.extent;
    return SADMM_OK;
}

/* First as it was asked for, then with no more faces joined than have to be. Faces narrower than what their corners are
 * rounded by have any normal; then so many are joined that there are none of them. */
static sadmm_status find_polyhedron(struct making *m, double merge, struct sadmm_error *error)
{
    const double shares[] = {merge, 0, 1e-11, 1e-9, 1e-7, 1e-5};
    bool found = false;
    for (size_t k = merge > 0 ? 0 : 1; k < sizeof shares / sizeof *shares && !found; ++k)
        TRY(attempt(m, fmin(shares[k] * m->points.extent, m->points.thickness / 20), &found, error));
    if (!found)
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT,
                          "def->points: no convex polyhedron was found around them, %d distinct ones, %g m thick and "
                          "%g m long: they lie too close to one another, or too flat",
                          (int)m->points.count, m->points.thickness, m->points.extent);
    return SADMM_OK;
}

/* ---- from faces to the hull ---- */

struct numbered {
    int32_t number, vertex;
};

static int compare_numbers(const void *a, const void *b)
{
    const int32_t p = ((const struct numbered *)a)->number, q = ((const struct numbered *)b)->number;
    return (p > q) - (p < q);
}

/* Vertices in the order in which they were given; `inside` and planes go along. */
static bool order_as_given(struct making *m, double *inside)
{
    const size_t count = (size_t)m->mesh.vertex_count;
    struct numbered *list = (struct numbered *)sadmm_alloc(count, sizeof *list);
    if (!list) return false;
    for (size_t v = 0; v < count; ++v)
        list[v] = (struct numbered){m->points.at[m->mesh.point[v]].number, (int32_t)v};
    qsort(list, count, sizeof *list, compare_numbers);
    for (size_t k = 0; k < count; ++k) {
        m->rank[list[k].vertex] = (int32_t)k;
        memcpy(m->vertices + 3 * k, inside + 3 * list[k].vertex, 3 * sizeof *inside);
    }
    memcpy(inside, m->vertices, 3 * count * sizeof *inside);
    sadmm_free(list);
    return sadmm_hull_mesh_order(&m->mesh, m->rank, m->planes);
}

/* The smallest box along the axes of the points, the principal ones or those of the largest face, and the vertices in
 * its frame. A turn has to be worth it: without one they are the points' own numbers less the centre. */
static void choose_box(const struct making *m, const double principal[4], sadmm_hull *hull, double *inside)
{
    static const double unit[4] = {1, 0, 0, 0};
    const int32_t count = m->mesh.vertex_count;
    double face[4], least = 0;
    const double *const axes[3] = {NULL, principal, face}, *best = NULL;
    sadmm_hull_face_axes(&m->mesh, m->vertices, face);
    for (int k = 0; k < 3; ++k) {
        const struct hull_box box = sadmm_hull_box(m->vertices, count, axes[k], inside);
        const double volume = box.half[0] * box.half[1] * box.half[2];
        if (k > 0 && !(volume < 0.99 * least)) continue;
        least = volume;
        best = axes[k];
    }
    const struct hull_box box = sadmm_hull_box(m->vertices, count, best, inside);
    memcpy(hull->orientation, best ? best : unit, sizeof hull->orientation);
    for (int k = 0; k < 3; ++k) hull->half[k] = box.half[k] + m->convex_radius;
    for (int k = 0; k < 3; ++k) hull->position[k] = m->points.middle[k] + box.position[k];
}

static bool allocate(const struct hull_mesh *mesh, sadmm_hull *hull)
{
    const size_t vertices = (size_t)mesh->vertex_count, faces = (size_t)mesh->face_count;
    hull->doubles = sadmm_hull_data_doubles(mesh);
    hull->block = (double *)sadmm_alloc(hull->doubles, sizeof *hull->block);
    hull->vertices = (double *)sadmm_alloc(vertices, 3 * sizeof *hull->vertices);
    hull->face_first = (int32_t *)sadmm_alloc(faces + 1, sizeof *hull->face_first);
    hull->corners = (int32_t *)sadmm_alloc((size_t)mesh->face_first[faces], sizeof *hull->corners);
    hull->vertex_count = mesh->vertex_count;
    hull->edge_count = mesh->edge_count;
    hull->face_count = mesh->face_count;
    return hull->block && hull->vertices && hull->face_first && hull->corners;
}

/* False: out of memory. */
static bool fill(struct making *m, const double *given, const struct hull_solid *solid, double *inside,
                 sadmm_hull *hull)
{
    choose_box(m, solid->axes, hull, inside);
    sadmm_hull_turn_planes(&m->mesh, inside, hull->orientation, m->planes);
    if (!order_as_given(m, inside)) return false;
    sadmm_hull_data_write(&m->mesh, inside, m->planes, m->convex_radius, hull->block);
    for (int32_t v = 0; v < hull->vertex_count; ++v)
        memcpy(hull->vertices + 3 * v, given + 3 * m->points.at[m->mesh.point[v]].number, 3 * sizeof *given);
    memcpy(hull->face_first, m->mesh.face_first, ((size_t)hull->face_count + 1) * sizeof *hull->face_first);
    memcpy(hull->corners, m->mesh.corner, (size_t)m->mesh.face_first[hull->face_count] * sizeof *hull->corners);
    hull->merge = m->merge;
    hull->convex_radius = m->convex_radius;
    hull->volume = solid->volume;
    memcpy(hull->moments, solid->moments, sizeof hull->moments);
    memcpy(hull->axes, solid->axes, sizeof hull->axes);
    for (int k = 0; k < 3; ++k) hull->centre[k] = m->points.middle[k] + solid->centre[k];
    hull->uses = 1;
    return true;
}

static sadmm_status build(struct making *m, const double *given, sadmm_hull **out, struct sadmm_error *error)
{
    struct hull_solid solid;
    if (!sadmm_hull_solid(&m->mesh, m->vertices, m->planes, m->convex_radius, &solid))
        return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "def->points: their hull has a volume of %g m^3",
                          solid.volume);
    double *inside = (double *)sadmm_alloc((size_t)m->mesh.vertex_count, 3 * sizeof *inside);
    sadmm_hull *hull = (sadmm_hull *)sadmm_alloc(1, sizeof *hull);
    const bool filled = inside && hull && allocate(&m->mesh, hull) && fill(m, given, &solid, inside, hull);
    if (filled) *out = hull;
    else if (hull) free_hull(hull);
    sadmm_free(inside);
    return filled ? SADMM_OK : sadmm_fail_memory(error, "a hull");
}

static sadmm_status make_once(struct making *m, const sadmm_hull_def *def, sadmm_hull **out, struct sadmm_error *error)
{
    TRY(sadmm_hull_points_sort(&m->points, def->points, def->point_count, error));
    TRY(sadmm_hull_points_check(&m->points, thinnest, thinnest, error));
    m->scaled = (double *)sadmm_alloc((size_t)m->points.count, 3 * sizeof *m->scaled);
    if (!m->scaled) return sadmm_fail_memory(error, "the points of a hull");
    scale_points(m);
    if (m->points.count > MANY_POINTS) TRY(leave_out_inner(m, error));
    TRY(find_polyhedron(m, def->merge, error));
    return build(m, def->points, out, error);
}

/* A hull whose vertices make it again: what faces are joined by goes by where the points reach, so that the hull of the
 * vertices alone may be another one, of fewer. Where points were left out it is made of the others, until none is. */
static sadmm_status make(const sadmm_hull_def *def, sadmm_hull **out)
{
    sadmm_hull_def next = *def;
    sadmm_hull *last = NULL, *made = NULL;
    bool done = false;
    while (!done) {
        struct making m = {.merge = def->merge, .convex_radius = def->convex_radius};
        const sadmm_status status = make_once(&m, &next, &made, NULL);
        if (status == SADMM_OK) done = made->vertex_count == m.points.count;
        free_making(&m);
        sadmm_hull_release(last); /* whose vertices were the points */
        if (status != SADMM_OK) return status;
        last = made;
        next.points = last->vertices;
        next.point_count = (size_t)last->vertex_count;
    }
    *out = last;
    return SADMM_OK;
}

sadmm_status sadmm_hull_create(const sadmm_hull_def *given, sadmm_hull **out)
{
    sadmm_hull_def taken;
    const sadmm_hull_def *const def = &taken;
    TRY(sadmm_check_given(out, "out", NULL));
    *out = NULL;
    TRY(sadmm_growing_take(&growing, &taken, given, "def", NULL));
    TRY(sadmm_check_given(def->points, "def->points", NULL));
    if (def->point_count < LEAST_POINTS || def->point_count > MOST_POINTS)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "def->point_count = %zu: must be in [%d, %d]",
                          def->point_count, LEAST_POINTS, MOST_POINTS);
    TRY(sadmm_fields_check(sadmm_hull_table, SADMM_HULL_FIELDS_COUNT, def, "def->", NULL));
    TRY(sadmm_check_vector("def->points", def->points, 3 * (int)def->point_count, 1e6, NULL));
    return make(def, out);
}

/* ---- what callers see ---- */

int32_t sadmm_hull_vertex_count(const sadmm_hull *hull)
{
    return hull ? hull->vertex_count : 0;
}

int32_t sadmm_hull_edge_count(const sadmm_hull *hull)
{
    return hull ? hull->edge_count : 0;
}

int32_t sadmm_hull_face_count(const sadmm_hull *hull)
{
    return hull ? hull->face_count : 0;
}

const double *sadmm_hull_vertices(const sadmm_hull *hull)
{
    return hull ? hull->vertices : NULL;
}

double sadmm_hull_convex_radius(const sadmm_hull *hull)
{
    return hull ? hull->convex_radius : 0;
}

double sadmm_hull_merge(const sadmm_hull *hull)
{
    return hull ? hull->merge : 0;
}

sadmm_status sadmm_hull_face_at(const sadmm_hull *hull, int32_t face, sadmm_hull_face *out)
{
    TRY(sadmm_check_given(hull, "hull", NULL));
    TRY(sadmm_check_given(out, "out", NULL));
    if (face < 0 || face >= hull->face_count)
        return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "face = %d: must be in [0, %d)", (int)face,
                          (int)hull->face_count);
    const int32_t stride = hull_stride(hull->face_count);
    const double *row = hull->block + HULL_HEADER_DOUBLES + 3 * hull_stride(hull->vertex_count) + face;
    const vec3 normal = m3_mul(q_matrix(q_load(hull->orientation)), v3(row[0], row[stride], row[2 * stride]));
    out->corner_count = hull->face_first[face + 1] - hull->face_first[face];
    out->corners = hull->corners + hull->face_first[face];
    v3_store(normal, out->normal);
    out->offset = v3_dot(normal, v3_load(hull->vertices + 3 * out->corners[0]));
    for (int32_t c = 1; c < out->corner_count; ++c)
        out->offset = fmax(out->offset, v3_dot(normal, v3_load(hull->vertices + 3 * out->corners[c])));
    return SADMM_OK;
}
