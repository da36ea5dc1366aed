/* Mass of solids and of bodies made of them (subadmm/mass.h). */
#include "subadmm/mass.h"

#include <stdio.h>
#include <string.h>

#include "collision/hull/hull.h"
#include "core/base/check.h"
#include "core/math/principal.h"
#include "world/state/shape_form.h"

static const double pi = 3.14159265358979323846;

sadmm_status sadmm_hull_mass(const sadmm_hull *hull, double density, sadmm_mass *mass)
{
    TRY(sadmm_check_given(hull, "hull", NULL));
    TRY(sadmm_check_range("density", density, 1e-30, 1e30, NULL));
    TRY(sadmm_check_given(mass, "mass", NULL));
    mass->mass = density * hull->volume;
    memcpy(mass->centre, hull->centre, sizeof mass->centre);
    memcpy(mass->orientation, hull->axes, sizeof mass->orientation);
    for (int k = 0; k < 3; ++k) mass->inertia[k] = density * (hull->moments[(k + 1) % 3] + hull->moments[(k + 2) % 3]);
    return SADMM_OK;
}

/* In the shape's own frame. */
static sadmm_status own_mass(const sadmm_shape_def *def, double density, sadmm_mass *mass)
{
    const double *s = def->size;
    memset(mass, 0, sizeof *mass);
    mass->orientation[0] = 1;
    switch (def->type) {
    case SADMM_SHAPE_SPHERE:
        mass->mass = density * 4 / 3 * pi * s[0] * s[0] * s[0];
        sadmm_sphere_inertia(mass->mass, s[0], mass->inertia);
        return SADMM_OK;
    case SADMM_SHAPE_CAPSULE:
        mass->mass = density * pi * s[0] * s[0] * (4.0 / 3 * s[0] + 2 * s[1]);
        sadmm_capsule_inertia(mass->mass, s[0], s[1], mass->inertia);
        return SADMM_OK;
    case SADMM_SHAPE_BOX:
        mass->mass = density * 8 * s[0] * s[1] * s[2];
        sadmm_box_inertia(mass->mass, s, mass->inertia);
        return SADMM_OK;
    case SADMM_SHAPE_HULL: return sadmm_hull_mass(def->hull, density, mass);
    /* Any table of moments of inertia; a cone's centre is a quarter of its height above the base. */
    case SADMM_SHAPE_CYLINDER:
        mass->mass = density * pi * s[0] * s[0] * 2 * s[1];
        mass->inertia[0] = mass->inertia[1] = mass->mass * (s[0] * s[0] / 4 + s[1] * s[1] / 3);
        mass->inertia[2] = mass->mass * s[0] * s[0] / 2;
        return SADMM_OK;
    case SADMM_SHAPE_CONE:
        mass->mass = density * pi / 3 * s[0] * s[0] * 2 * s[1];
        mass->centre[2] = -s[1] / 2;
        mass->inertia[0] = mass->inertia[1] = 3.0 / 20 * mass->mass * (s[0] * s[0] + s[1] * s[1]);
        mass->inertia[2] = 3.0 / 10 * mass->mass * s[0] * s[0];
        return SADMM_OK;
    case SADMM_SHAPE_ELLIPSOID:
        mass->mass = density * 4 / 3 * pi * s[0] * s[1] * s[2];
        for (int k = 0; k < 3; ++k) {
            const double a = s[(k + 1) % 3], b = s[(k + 2) % 3];
            mass->inertia[k] = mass->mass / 5 * (a * a + b * b);
        }
        return SADMM_OK;
    case SADMM_SHAPE_PLANE:
    case SADMM_SHAPE_MESH:
    case SADMM_SHAPE_TYPE_COUNT: break;
    }
    return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "def->type = %d: a plane or a mesh has no mass",
                      (int)def->type);
}

sadmm_status sadmm_shape_mass(const sadmm_shape_def *given, double density, sadmm_mass *mass)
{
    double orientation[4];
    sadmm_shape_def taken;
    const sadmm_shape_def *const def = &taken;
    sadmm_mass own;
    TRY(sadmm_growing_take(&sadmm_growing_shape, &taken, given, "def", NULL));
    TRY(sadmm_check_range("density", density, 1e-30, 1e30, NULL));
    TRY(sadmm_check_given(mass, "mass", NULL));
    TRY(sadmm_shape_form_check(def, orientation, NULL));
    TRY(own_mass(def, density, &own));
    const quat turn = q_load(orientation);
    v3_store(v3_add(v3_load(def->position), m3_mul(q_matrix(turn), v3_load(own.centre))), own.centre);
    q_store(q_normalize(q_mul(turn, q_load(own.orientation))), own.orientation);
    *mass = own;
    return SADMM_OK;
}

/* ---- sums ---- */

static sadmm_status check_part(const sadmm_mass *part, size_t k, double orientation[4])
{
    char name[48];
    snprintf(name, sizeof name, "parts[%zu].mass", k);
    TRY(sadmm_check_range(name, part->mass, 1e-100, 1e100, NULL));
    snprintf(name, sizeof name, "parts[%zu].centre", k);
    TRY(sadmm_check_vector(name, part->centre, 3, 1e9, NULL));
    for (int i = 0; i < 3; ++i) {
        snprintf(name, sizeof name, "parts[%zu].inertia[%d]", k, i);
        TRY(sadmm_check_range(name, part->inertia[i], 0, 1e100, NULL));
    }
    snprintf(name, sizeof name, "parts[%zu].orientation", k);
    return sadmm_check_orientation(name, part->orientation, orientation, NULL);
}

sadmm_status sadmm_mass_sum(const sadmm_mass *parts, size_t count, sadmm_mass *sum)
{
    double orientation[4], total[3][3] = {{0}};
    sadmm_mass whole = {.mass = 0};
    vec3 centre = v3(0, 0, 0);
    TRY(sadmm_check_given(parts, "parts", NULL));
    TRY(sadmm_check_given(sum, "sum", NULL));
    if (count < 1) return sadmm_fail(NULL, SADMM_ERROR_INVALID_ARGUMENT, "count = 0: must be 1 or more");
    for (size_t k = 0; k < count; ++k) {
        TRY(check_part(&parts[k], k, orientation));
        whole.mass += parts[k].mass;
        centre = v3_add(centre, v3_scale(v3_load(parts[k].centre), parts[k].mass));
    }
    centre = v3_scale(centre, 1 / whole.mass);
    for (size_t k = 0; k < count; ++k) {
        TRY(check_part(&parts[k], k, orientation));
        principal_add(total, parts[k].inertia, orientation, parts[k].mass, v3_sub(v3_load(parts[k].centre), centre));
    }
    v3_store(centre, whole.centre);
    principal_axes(total, whole.orientation);
    for (int k = 0; k < 3; ++k) whole.inertia[k] = total[k][k];
    *sum = whole;
    return SADMM_OK;
}

/* ---- poses ---- */

/* What both functions are given; `turn`: orientation, normalised. */
static sadmm_status check_pose(const sadmm_mass *mass, const double *position, const double *orientation,
                               double turn[4])
{
    TRY(sadmm_check_given(mass, "mass", NULL));
    TRY(sadmm_check_given(position, "position", NULL));
    TRY(sadmm_check_given(orientation, "orientation", NULL));
    TRY(sadmm_check_vector("mass->centre", mass->centre, 3, 1e9, NULL));
    TRY(sadmm_check_orientation("mass->orientation", mass->orientation, turn, NULL));
    TRY(sadmm_check_vector("position", position, 3, 1e9, NULL));
    return sadmm_check_orientation("orientation", orientation, turn, NULL);
}

sadmm_status sadmm_mass_pose_in_body(const sadmm_mass *mass, double position[3], double orientation[4])
{
    double turn[4];
    TRY(check_pose(mass, position, orientation, turn));
    const quat axes = q_normalize(q_load(mass->orientation));
    const quat back = {axes.w, -axes.x, -axes.y, -axes.z};
    v3_store(m3_tmul(q_matrix(axes), v3_sub(v3_load(position), v3_load(mass->centre))), position);
    q_store(q_normalize(q_mul(back, q_load(turn))), orientation);
    return SADMM_OK;
}

sadmm_status sadmm_mass_pose_of_body(const sadmm_mass *mass, double position[3], double orientation[4])
{
    double turn[4];
    TRY(check_pose(mass, position, orientation, turn));
    const quat axes = q_normalize(q_load(mass->orientation)), frame = q_load(turn);
    v3_store(v3_add(v3_load(position), m3_mul(q_matrix(frame), v3_load(mass->centre))), position);
    q_store(q_normalize(q_mul(frame, axes)), orientation);
    return SADMM_OK;
}

/* ---- inertia of solids ------------------------------------------------------------------------------------------- */

void sadmm_box_inertia(double mass, const double h[3], double inertia[3])
{
    if (!h || !inertia) return;
    inertia[0] = mass / 3 * (h[1] * h[1] + h[2] * h[2]);
    inertia[1] = mass / 3 * (h[0] * h[0] + h[2] * h[2]);
    inertia[2] = mass / 3 * (h[0] * h[0] + h[1] * h[1]);
}

void sadmm_sphere_inertia(double mass, double radius, double inertia[3])
{
    if (!inertia) return;
    inertia[0] = inertia[1] = inertia[2] = 0.4 * mass * radius * radius;
}

/* A cylinder of length 2 h and two half balls, by their shares of the volume. */
void sadmm_capsule_inertia(double mass, double r, double h, double inertia[3])
{
    if (!inertia) return;
    double cylinder = 2 * h, balls = 4.0 / 3.0 * r;
    double mc = mass * cylinder / (cylinder + balls), mb = mass - mc;
    double ball_axis = 0.4 * mb * r * r;
    double ball_side = ball_axis + mb * (h * h + 0.75 * h * r);
    inertia[2] = 0.5 * mc * r * r + ball_axis;
    inertia[0] = inertia[1] = mc * (3 * r * r + cylinder * cylinder) / 12 + ball_side;
}
