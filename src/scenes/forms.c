#include "forms.h"

#include <math.h>

#include "noise.h"

static const double pi = 3.14159265358979323846;

static int add(double points[][3], int count, double x, double y, double z)
{
    v3_store(v3(x, y, z), points[count]);
    return count + 1;
}

static int add_ring(double points[][3], int count, int corners, double radius, double z)
{
    for (int k = 0; k < corners; ++k) {
        const double angle = 2 * pi * k / corners;
        count = add(points, count, radius * cos(angle), radius * sin(angle), z);
    }
    return count;
}

/* (0, +-a, +-b) and its cyclic turns. */
static int add_rectangles(double points[][3], int count, double a, double b)
{
    for (int s = 0; s < 4; ++s) {
        const double p = s & 1 ? a : -a, q = s & 2 ? b : -b;
        count = add(points, count, 0, p, q);
        count = add(points, count, q, 0, p);
        count = add(points, count, p, q, 0);
    }
    return count;
}

static int add_icosahedron(double points[][3], int count)
{
    const double golden = 0.5 * (1 + sqrt(5)), scale = 1 / sqrt(1 + golden * golden);
    return add_rectangles(points, count, scale, scale * golden);
}

static int add_dodecahedron(double points[][3], int count)
{
    const double golden = 0.5 * (1 + sqrt(5)), scale = 1 / sqrt(3);
    count = add_rectangles(points, count, scale * golden, scale / golden);
    for (int v = 0; v < 8; ++v)
        count = add(points, count, v & 1 ? scale : -scale, v & 2 ? scale : -scale, v & 4 ? scale : -scale);
    return count;
}

/* Rim at z = 0, a ring half way to either pole and the poles, on spheres through all of them. */
static int add_lens(double points[][3], int count)
{
    const double high = 5.0 / 12, sphere = (1 + high * high) / (2 * high);
    const double half_way = 0.5 * asin(1 / sphere);
    count = add_ring(points, count, 16, 1, 0);
    for (int side = -1; side <= 1; side += 2) {
        count = add_ring(points, count, 8, sphere * sin(half_way), side * (sphere * cos(half_way) - sphere + high));
        count = add(points, count, 0, 0, side * high);
    }
    return count;
}

/* Directions of a spiral that covers the sphere evenly, a little off, at 0.7 to 1. */
static int add_rock(double points[][3], int count)
{
    enum { CORNERS = 32 };
    for (int k = 0; k < CORNERS; ++k) {
        const double z = 1 - (2 * k + 1.0) / CORNERS, angle = pi * (3 - sqrt(5)) * k + 0.2 * sadmm_noise(k, 0);
        const double r = 0.85 + 0.15 * sadmm_noise(k, 1), across = r * sqrt(1 - z * z);
        count = add(points, count, across * cos(angle), across * sin(angle), r * z);
    }
    return count;
}

int sadmm_form_points(enum sadmm_form form, double points[SADMM_FORM_MOST][3])
{
    switch (form) {
    case SADMM_FORM_ICOSAHEDRON: return add_icosahedron(points, 0);
    case SADMM_FORM_DODECAHEDRON: return add_dodecahedron(points, 0);
    case SADMM_FORM_BALL: return add_dodecahedron(points, add_icosahedron(points, 0));
    case SADMM_FORM_CONE: return add(points, add_ring(points, 0, 16, 0.8, -0.6), 0, 0, 1);
    case SADMM_FORM_LENS: return add_lens(points, 0);
    default: return add_rock(points, 0);
    }
}
