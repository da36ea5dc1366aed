/* Faces into triangles.
 *
 * A face of more than three corners is seen along the axis that its area vector is longest on: two of the three
 * coordinates, exactly. If it is convex there it becomes a fan. If not, ears are cut off: a corner that turns left,
 * with no other corner in the triangle of it and its neighbours. The first ear behind the last one that was cut is
 * taken, so that a convex face would give its fan, too. A corner that is no ear does not become one before a neighbour
 * is cut (one of those in its triangle turns right or straight, and such a corner stays until a neighbour of its own is
 * cut), so it is not asked again: n corners cost n^2 at most. With an outline that crosses itself there may be no ear;
 * then any corner is cut.
 */
#include "triangulate.h"

#include <math.h>

#include "core/base/memory.h"

enum { MOST_CORNERS = 1024 }; /* of a face that is not convex */

struct point {
    double u, v;
};

struct outline {
    struct point *points;
    int32_t *next, *previous;
    bool *no_ear;
};

/* Twice the area of a b c; > 0: they turn left. */
static double turn(struct point a, struct point b, struct point c)
{
    return (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
}

static bool same(struct point a, struct point b) { return a.u == b.u && a.v == b.v; }

static bool grow(struct outline *o, size_t size)
{
    return SADMM_GROW(o->points, 0, size) && SADMM_GROW(o->next, 0, size) && SADMM_GROW(o->previous, 0, size) &&
           SADMM_GROW(o->no_ear, 0, size);
}

/* Into the plane, so that the area is positive. False: it is zero. */
static bool project(struct outline *o, const double *vertices, const int32_t *corners, int32_t size)
{
    const double *const origin = vertices + 3 * (size_t)corners[0];
    double area[3] = {0};
    int axis = 0;
    for (int32_t i = 1; i + 1 < size; ++i) {
        const double *const p = vertices + 3 * (size_t)corners[i], *const q = vertices + 3 * (size_t)corners[i + 1];
        for (int k = 0; k < 3; ++k) {
            const int l = (k + 1) % 3, m = (k + 2) % 3;
            area[k] += (p[l] - origin[l]) * (q[m] - origin[m]) - (p[m] - origin[m]) * (q[l] - origin[l]);
        }
    }
    for (int k = 1; k < 3; ++k)
        if (fabs(area[k]) > fabs(area[axis])) axis = k;
    const int first = (axis + (area[axis] > 0 ? 1 : 2)) % 3, second = 3 - axis - first;
    for (int32_t i = 0; i < size; ++i) {
        const double *const p = vertices + 3 * (size_t)corners[i];
        o->points[i] = (struct point){p[first], p[second]};
    }
    return area[axis] != 0;
}

/* Every corner turns left, and together they turn once: the edges go to the right and to the left once each. */
static bool is_convex(const struct point *p, int32_t size)
{
    int changes = 0;
    double last = 0, first = 0;
    for (int32_t i = 0; i < size; ++i) {
        const int32_t j = i + 1 < size ? i + 1 : 0, k = j + 1 < size ? j + 1 : 0;
        const double step = p[j].u - p[i].u;
        if (!(turn(p[i], p[j], p[k]) > 0)) return false;
        if (step == 0) continue;
        changes += last != 0 && (step > 0) != (last > 0);
        if (first == 0) first = step;
        last = step;
    }
    changes += (first > 0) != (last > 0);
    return changes == 2;
}

static bool on_both_sides(struct point a, struct point b, struct point p, struct point q)
{
    const double s = turn(a, b, p), t = turn(a, b, q);
    return (s > 0 && t < 0) || (s < 0 && t > 0);
}

/* Two edges cross. Those that touch do not count: an outline may go along one line in both directions, around a hole.
 */
static bool crosses_itself(const struct point *p, int32_t size)
{
    for (int32_t i = 0; i + 2 < size; ++i)
        for (int32_t j = i + 2; j < size; ++j) {
            const struct point a = p[i], b = p[i + 1], c = p[j], d = p[j + 1 < size ? j + 1 : 0];
            if (on_both_sides(a, b, c, d) && on_both_sides(c, d, a, b)) return true;
        }
    return false;
}

static bool is_ear(const struct outline *o, int32_t corner)
{
    const struct point *const p = o->points;
    const struct point a = p[o->previous[corner]], b = p[corner], c = p[o->next[corner]];
    if (!(turn(a, b, c) > 0)) return false;
    for (int32_t i = o->next[o->next[corner]]; i != o->previous[corner]; i = o->next[i])
        if (turn(a, b, p[i]) >= 0 && turn(b, c, p[i]) >= 0 && turn(c, a, p[i]) >= 0 && !same(p[i], a) &&
            !same(p[i], b) && !same(p[i], c))
            return false;
    return true;
}

static void write_triangle(const int32_t *corners, int32_t a, int32_t b, int32_t c, int32_t **out)
{
    *(*out)++ = corners[a];
    *(*out)++ = corners[b];
    *(*out)++ = corners[c];
}

static void fan(const int32_t *corners, int32_t size, int32_t **out)
{
    for (int32_t i = 1; i + 1 < size; ++i) write_triangle(corners, 0, i, i + 1, out);
}

/* True: an ear was found whenever one was searched for, and what is left of them does not lie the wrong way around. */
static bool cut_ears(struct outline *o, const int32_t *corners, int32_t size, int32_t **out)
{
    bool found = true;
    int32_t at = 1;
    for (int32_t i = 0; i < size; ++i) {
        o->next[i] = i + 1 < size ? i + 1 : 0;
        o->previous[i] = i > 0 ? i - 1 : size - 1;
        o->no_ear[i] = false;
    }
    for (int32_t left = size; left > 3; --left) {
        int32_t passed = 0;
        for (; passed < left && (o->no_ear[at] || !is_ear(o, at)); ++passed) {
            o->no_ear[at] = true;
            at = o->next[at];
        }
        found = found && passed < left;
        const int32_t before = o->previous[at], behind = o->next[at];
        write_triangle(corners, before, at, behind, out);
        o->next[before] = behind;
        o->previous[behind] = before;
        o->no_ear[before] = o->no_ear[behind] = false;
        at = behind;
    }
    write_triangle(corners, o->previous[at], at, o->next[at], out);
    return found && turn(o->points[o->previous[at]], o->points[at], o->points[o->next[at]]) >= 0;
}

static sadmm_status split(struct mesh_parts *parts, size_t face, const int32_t *corners, struct outline *o,
                          int32_t **out)
{
    const int32_t size = parts->face_size[face];
    if (size == 3) {
        fan(corners, size, out);
        return SADMM_OK;
    }
    if (!grow(o, (size_t)size)) return sadmm_fail_memory(NULL, "a face of a mesh file");
    const bool flat = !project(o, parts->vertices, corners, size);
    if (flat || is_convex(o->points, size)) {
        parts->info.crossing_faces += flat;
        fan(corners, size, out);
        return SADMM_OK;
    }
    if (size > MOST_CORNERS)
        return sadmm_mesh_file_fail(parts, 0, SADMM_ERROR_LIMIT,
                                    "face %zu is not convex and has %d corners: at most %d", face + 1, (int)size,
                                    MOST_CORNERS);
    const bool found = cut_ears(o, corners, size, out);
    parts->info.crossing_faces += !found || crosses_itself(o->points, size);
    return SADMM_OK;
}

sadmm_status sadmm_mesh_file_triangulate(struct mesh_parts *parts, int32_t **triangles)
{
    struct outline outline = {.points = NULL};
    sadmm_status status = SADMM_OK;
    const int32_t *corners = parts->corners;
    *triangles = (int32_t *)sadmm_alloc(parts->corner_count - 2 * parts->face_count, 3 * sizeof **triangles);
    if (!*triangles) return sadmm_fail_memory(NULL, "the triangles of a mesh file");
    int32_t *out = *triangles;
    for (size_t face = 0; face < parts->face_count && status == SADMM_OK; corners += parts->face_size[face++])
        status = split(parts, face, corners, &outline, &out);
    sadmm_free(outline.points);
    sadmm_free(outline.next);
    sadmm_free(outline.previous);
    sadmm_free(outline.no_ear);
    return status;
}
