#include "hull_measure.h"

#include <string.h>

#include "core/math/principal.h"
#include "hull_round.h"

static vec3 corner_at(const struct hull_mesh *mesh, const double *vertices, int32_t corner)
{
    return v3_load(vertices + 3 * mesh->corner[corner]);
}

/* ---- planes ---- */

/* Twice the area along the normal: triangles from the first corner, so that a hull far out is as exact as one near. */
static vec3 newell(const struct hull_mesh *mesh, const double *vertices, int32_t face)
{
    const int32_t first = mesh->face_first[face], end = mesh->face_first[face + 1];
    const vec3 from = corner_at(mesh, vertices, first);
    vec3 sum = v3(0, 0, 0), last = v3_sub(corner_at(mesh, vertices, first + 1), from);
    for (int32_t c = first + 2; c < end; ++c) {
        const vec3 next = v3_sub(corner_at(mesh, vertices, c), from);
        sum = v3_add(sum, v3_cross(last, next));
        last = next;
    }
    return sum;
}

static double offset_of(const struct hull_mesh *mesh, const double *vertices, int32_t face, vec3 normal)
{
    double offset = -INFINITY;
    for (int32_t c = mesh->face_first[face]; c < mesh->face_first[face + 1]; ++c)
        offset = fmax(offset, v3_dot(normal, corner_at(mesh, vertices, c)));
    return offset;
}

bool sadmm_hull_planes(const struct hull_mesh *mesh, const double *vertices, double *planes)
{
    for (int32_t f = 0; f < mesh->face_count; ++f) {
        const vec3 sum = newell(mesh, vertices, f);
        const double largest = v3_max_abs(sum); /* its square may be no number, or none but 0 */
        if (!(largest > 0)) return false;
        const vec3 along = v3_scale(sum, 1 / largest), normal = v3_scale(along, 1 / v3_norm(along));
        v3_store(normal, planes + 4 * f);
        planes[4 * f + 3] = offset_of(mesh, vertices, f, normal);
    }
    return true;
}

void sadmm_hull_turn_planes(const struct hull_mesh *mesh, const double *inside, const double orientation[4],
                            double *planes)
{
    const mat3 turn = q_matrix(q_load(orientation));
    for (int32_t f = 0; f < mesh->face_count; ++f) {
        const vec3 normal = m3_tmul(turn, v3_load(planes + 4 * f));
        v3_store(normal, planes + 4 * f);
        planes[4 * f + 3] = offset_of(mesh, inside, f, normal);
    }
}

double sadmm_hull_bulge(const struct hull_mesh *mesh, const double *vertices, const double *planes,
                        const struct hull_points *points)
{
    double bulge = 0;
    for (int32_t f = 0; f < mesh->face_count; ++f) {
        const vec3 normal = v3_load(planes + 4 * f);
        const double offset = planes[4 * f + 3];
        double most = 0;
        for (int32_t i = 0; i < points->count; ++i) {
            const double outside = v3_dot(normal, v3_load(points->at[i].x)) - offset;
            most = outside > most ? outside : most;
        }
        for (int32_t c = mesh->face_first[f]; c < mesh->face_first[f + 1]; ++c)
            most = fmax(most, offset - v3_dot(normal, corner_at(mesh, vertices, c)));
        bulge = fmax(bulge, most);
    }
    return bulge;
}

/* ---- the solid ---- */

/* Sums over the tetrahedra between `origin` and the triangles of the faces, along axes turned by `axes` (its columns);
 * exact but for rounding, and without cancellation where `origin` is inside. */
static struct hull_integrals integrate(const struct hull_mesh *mesh, const double *vertices, const double *planes,
                                       double convex_radius, vec3 origin, mat3 axes)
{
    struct hull_integrals sum = {0};
    for (int32_t f = 0; f < mesh->face_count; ++f) {
        const int32_t first = mesh->face_first[f], end = mesh->face_first[f + 1];
        vec3 p[4]; /* the corners of a triangle and their sum */
        p[0] = m3_tmul(axes, v3_sub(corner_at(mesh, vertices, first), origin));
        p[2] = m3_tmul(axes, v3_sub(corner_at(mesh, vertices, first + 1), origin));
        for (int32_t c = first + 2; c < end; ++c) {
            p[1] = p[2];
            p[2] = m3_tmul(axes, v3_sub(corner_at(mesh, vertices, c), origin));
            p[3] = v3_add(v3_add(p[0], p[1]), p[2]);
            const double six = v3_dot(p[0], v3_cross(p[1], p[2])); /* volumes */
            double x[4][3];
            for (int k = 0; k < 4; ++k) v3_store(p[k], x[k]);
            sum.volume += six / 6;
            for (int i = 0; i < 3; ++i) {
                sum.first[i] += six / 24 * x[3][i];
                for (int j = 0; j <= i; ++j)
                    sum.second[i][j] += six / 120 * (x[0][i] * x[0][j] + x[1][i] * x[1][j] + x[2][i] * x[2][j] +
                                                     x[3][i] * x[3][j]);
            }
        }
    }
    if (convex_radius > 0) sadmm_hull_add_round(mesh, vertices, planes, convex_radius, origin, axes, &sum);
    for (int i = 0; i < 3; ++i)
        for (int j = i + 1; j < 3; ++j) sum.second[i][j] = sum.second[j][i];
    return sum;
}

static vec3 mean(const double *vertices, int32_t count)
{
    vec3 sum = v3(0, 0, 0);
    for (int32_t v = 0; v < count; ++v) sum = v3_add(sum, v3_load(vertices + 3 * v));
    return v3_scale(sum, 1.0 / count);
}

bool sadmm_hull_solid(const struct hull_mesh *mesh, const double *vertices, const double *planes, double convex_radius,
                      struct hull_solid *solid)
{
    static const double none[4] = {1, 0, 0, 0};
    const mat3 given = q_matrix(q_load(none));
    vec3 centre = mean(vertices, mesh->vertex_count);
    struct hull_integrals sum = integrate(mesh, vertices, planes, 0, centre, given);
    solid->volume = sum.volume;
    if (!(sum.volume > 0)) return false;
    if (convex_radius > 0) sum = integrate(mesh, vertices, planes, convex_radius, centre, given);
    centre = v3_madd(centre, 1 / sum.volume, v3_load(sum.first));
    sum = integrate(mesh, vertices, planes, convex_radius, centre, given);
    principal_axes(sum.second, solid->axes);
    /* Again along these axes: across a thin hull they are known to its thickness then, not to its length alone. */
    double rest[4];
    sum = integrate(mesh, vertices, planes, convex_radius, centre, q_matrix(q_load(solid->axes)));
    principal_axes(sum.second, rest);
    q_store(q_normalize(q_mul(q_load(solid->axes), q_load(rest))), solid->axes);
    solid->volume = sum.volume;
    v3_store(centre, solid->centre);
    for (int k = 0; k < 3; ++k) solid->moments[k] = sum.second[k][k];
    return sum.volume > 0 && sum.second[0][0] > 0 && sum.second[1][1] > 0 && sum.second[2][2] > 0;
}

/* ---- the box ---- */

/* The turn that takes x, y, z to three axes, right-handed: from the largest of its four numbers on, squared. */
static quat turn_to(vec3 x, vec3 y, vec3 z)
{
    const double four[4] = {1 + x.x + y.y + z.z, 1 + x.x - y.y - z.z, 1 - x.x + y.y - z.z, 1 - x.x - y.y + z.z};
    double q[4][4]; /* a row: 4 q_i (w, x, y, z) */
    int i = 0;
    for (int k = 1; k < 4; ++k)
        if (four[k] > four[i]) i = k;
    for (int k = 0; k < 4; ++k) q[k][k] = four[k];
    q[0][1] = q[1][0] = y.z - z.y;
    q[0][2] = q[2][0] = z.x - x.z;
    q[0][3] = q[3][0] = x.y - y.x;
    q[1][2] = q[2][1] = x.y + y.x;
    q[1][3] = q[3][1] = x.z + z.x;
    q[2][3] = q[3][2] = y.z + z.y;
    return q_normalize(q_load(q[i]));
}

void sadmm_hull_face_axes(const struct hull_mesh *mesh, const double *vertices, double orientation[4])
{
    int32_t face = 0;
    double largest = 0, longest = 0;
    vec3 normal = v3(0, 0, 1), along = v3(1, 0, 0);
    for (int32_t f = 0; f < mesh->face_count; ++f) {
        const vec3 sum = newell(mesh, vertices, f);
        const double area = v3_norm(sum);
        if (!(area > largest)) continue;
        largest = area;
        face = f;
        normal = v3_scale(sum, 1 / area);
    }
    for (int32_t c = mesh->face_first[face], end = mesh->face_first[face + 1]; c < end; ++c) {
        const vec3 edge = v3_sub(corner_at(mesh, vertices, c + 1 < end ? c + 1 : mesh->face_first[face]),
                                 corner_at(mesh, vertices, c));
        const double length = v3_norm(edge);
        if (!(length > longest)) continue;
        longest = length;
        along = v3_scale(edge, 1 / length);
    }
    const vec3 across = v3_cross(normal, along), side = v3_scale(across, 1 / v3_norm(across));
    q_store(turn_to(v3_cross(side, normal), side, normal), orientation);
}

struct hull_box sadmm_hull_box(const double *vertices, int32_t count, const double orientation[4], double *inside)
{
    static const double none[4] = {1, 0, 0, 0};
    const mat3 axes = q_matrix(q_load(orientation ? orientation : none));
    struct hull_box box = {.half = {0}};
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, middle[3];
    for (int32_t v = 0; v < count; ++v) {
        double *x = inside + 3 * v;
        if (orientation) v3_store(m3_tmul(axes, v3_load(vertices + 3 * v)), x);
        else memcpy(x, vertices + 3 * v, 3 * sizeof *x);
        for (int k = 0; k < 3; ++k) {
            low[k] = fmin(low[k], x[k]);
            high[k] = fmax(high[k], x[k]);
        }
    }
    for (int k = 0; k < 3; ++k) middle[k] = low[k] + (high[k] - low[k]) / 2;
    for (int32_t v = 0; v < count; ++v)
        for (int k = 0; k < 3; ++k) {
            inside[3 * v + k] -= middle[k];
            box.half[k] = fmax(box.half[k], fabs(inside[3 * v + k]));
        }
    if (orientation) v3_store(m3_mul(axes, v3_load(middle)), box.position);
    else memcpy(box.position, middle, sizeof middle);
    return box;
}
