/* Mass, centre and principal axes of solids (mass.h) against closed forms, in any frame; bodies made of several. */
#include <check.h>

#include "fixed_work.h"
#include "hull_tools.h"
#include "run_suite.h"

static const double turned[4] = {0.36, -0.48, 0.64, 0.48}; /* unit */

#define EXPECT_OK(call) ck_assert_msg((call) == SADMM_OK, "%s: %s", #call, sadmm_last_message())

/* The inertia tensor in the frame that centre and orientation are in. */
static void tensor_of(const sadmm_mass *mass, double tensor[9])
{
    const mat3 r = q_matrix(q_load(mass->orientation));
    double rows[3][3];
    for (int i = 0; i < 3; ++i) v3_store(r.r[i], rows[i]);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            tensor[3 * i + j] = 0;
            for (int k = 0; k < 3; ++k) tensor[3 * i + j] += rows[i][k] * mass->inertia[k] * rows[j][k];
        }
}

/* Moments in whatever order they come: as the tensor. share: of the mass, of its distance, of the largest moment. */
static void expect_same(const sadmm_mass *got, const sadmm_mass *wanted, double share)
{
    double a[9], b[9], largest = 0, size = 0;
    tensor_of(got, a);
    tensor_of(wanted, b);
    for (int k = 0; k < 3; ++k) {
        largest = fmax(largest, wanted->inertia[k]);
        size = fmax(size, fabs(wanted->centre[k]));
    }
    size = fmax(size, sqrt(largest / wanted->mass));
    ck_assert_double_eq_tol(got->mass, wanted->mass, share * wanted->mass);
    for (int k = 0; k < 3; ++k) ck_assert_double_eq_tol(got->centre[k], wanted->centre[k], share * size);
    for (int k = 0; k < 9; ++k) ck_assert_double_eq_tol(a[k], b[k], share * largest);
    double norm = 0;
    for (int k = 0; k < 4; ++k) norm += got->orientation[k] * got->orientation[k];
    ck_assert_double_eq_tol(norm, 1, 1e-14);
}

/* A world takes it for a body. */
static void expect_accepted(const sadmm_mass *mass)
{
    sadmm_world_def def = fixed_world_def();
    sadmm_body_def body = sadmm_body_def_default();
    sadmm_world *world = NULL;
    sadmm_body_id id;
    def.backend = SADMM_BACKEND_CPU;
    EXPECT_OK(sadmm_world_create(&def, &world));
    body.mass = mass->mass;
    memcpy(body.inertia, mass->inertia, sizeof body.inertia);
    memcpy(body.orientation, mass->orientation, sizeof body.orientation);
    EXPECT_OK(sadmm_world_add_body(world, &body, &id));
    sadmm_world_destroy(world);
}

static sadmm_mass hull_mass(const struct cloud *c, double density)
{
    sadmm_hull *hull = NULL;
    sadmm_mass mass;
    EXPECT_OK(try_hull(c, 1e-6, &hull));
    EXPECT_OK(sadmm_hull_mass(hull, density, &mass));
    sadmm_hull_destroy(hull);
    return mass;
}

/* Both, where the cloud is and where it is turned and moved to. */
static void expect_of_cloud(struct cloud c, double density, sadmm_mass wanted, double share)
{
    sadmm_mass got = hull_mass(&c, density);
    expect_same(&got, &wanted, share);
    expect_accepted(&got);
    place_cloud(&c, turned, 3, -2, 1);
    got = hull_mass(&c, density);
    const quat turn = q_load(turned);
    const vec3 moved = v3_add(m3_mul(q_matrix(turn), v3_load(wanted.centre)), v3(3, -2, 1));
    v3_store(moved, wanted.centre);
    q_store(q_normalize(q_mul(turn, q_load(wanted.orientation))), wanted.orientation);
    expect_same(&got, &wanted, share);
    expect_accepted(&got);
}

START_TEST(boxes)
{
    static const double halves[][3] = {{1, 1, 1}, {0.1, 0.2, 0.3}, {1, 2, 1e-3}, {1e-3, 1e-3, 1}};
    for (size_t k = 0; k < sizeof halves / sizeof *halves; ++k) {
        const double *h = halves[k];
        sadmm_mass wanted = {.mass = 700 * 8 * h[0] * h[1] * h[2], .orientation = {1}};
        sadmm_box_inertia(wanted.mass, h, wanted.inertia);
        expect_of_cloud(box_cloud(h[0], h[1], h[2]), 700, wanted, 1e-12);
    }
}
END_TEST

/* Second moments about the centre: 1/160 on the diagonal and -1/480 beside it, 1/480 along (1, 1, 1), 1/120 across. */
START_TEST(a_tetrahedron)
{
    const struct cloud c = {.x = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, .count = 4};
    const double half_angle = acos(1 / sqrt(3)) / 2; /* takes z to (1, 1, 1) */
    sadmm_mass wanted = {.mass = 1 / 6.0, .centre = {0.25, 0.25, 0.25}, .inertia = {1 / 96.0, 1 / 96.0, 1 / 60.0}};
    wanted.orientation[0] = cos(half_angle);
    wanted.orientation[1] = -sin(half_angle) / sqrt(2);
    wanted.orientation[2] = sin(half_angle) / sqrt(2);
    expect_of_cloud(c, 1, wanted, 1e-12);
}
END_TEST

/* Area n/2 r^2 sin(2 pi/n), polar moment area r^2 (2 + cos(2 pi/n)) / 6. */
START_TEST(prisms)
{
    for (int n = 3; n <= 1000; n *= 7) {
        const double r = 0.5, h = 0.2, step = 2 * M_PI / n, area = 0.5 * n * r * r * sin(step);
        const double polar = area * r * r * (2 + cos(step)) / 6, mass = 2000 * area * 2 * h;
        const double side = mass * (polar / area / 2 + h * h / 3);
        const sadmm_mass wanted = {.mass = mass, .inertia = {side, side, mass * polar / area}, .orientation = {1}};
        expect_of_cloud(prism_cloud(n, r, h), 2000, wanted, 1e-12);
    }
}
END_TEST

/* Thin in any direction: moments across it to its own measure, so that they pass for a body's. */
START_TEST(needles_and_cards)
{
    static const double halves[][3] = {{1, 1e-5, 1e-5}, {1, 1e-5, 1e-3}, {1, 1, 1e-5}};
    for (size_t k = 0; k < sizeof halves / sizeof *halves; ++k) {
        const double *h = halves[k];
        struct cloud c = box_cloud(h[0], h[1], h[2]);
        double wanted[3], least = INFINITY, got = INFINITY;
        place_cloud(&c, turned, 0, 0, 0);
        const sadmm_mass mass = hull_mass(&c, 1000);
        sadmm_box_inertia(mass.mass, h, wanted);
        for (int i = 0; i < 3; ++i) {
            least = fmin(least, wanted[i]);
            got = fmin(got, mass.inertia[i]);
        }
        ck_assert_double_eq_tol(got, least, 1e-8 * least);
        expect_accepted(&mass);
    }
}
END_TEST

static sadmm_mass round_mass(const struct cloud *c, double convex_radius)
{
    sadmm_hull *hull = NULL;
    sadmm_mass mass;
    EXPECT_OK(try_round_hull(c, 1e-6, convex_radius, &hull));
    EXPECT_OK(sadmm_hull_mass(hull, 1, &mass));
    ck_assert_double_eq(sadmm_hull_convex_radius(hull), convex_radius);
    sadmm_hull_destroy(hull);
    expect_accepted(&mass);
    return mass;
}

/* Integrals of 1 and x^2 over a rounded box, from slices across x. Inside of |x| <= h they are rectangles b x c with
 * round corners, area(r) = 4 b c + 4 r (b + c) + pi r^2; beyond, at x = h + r s, the same with r sqrt(1 - s^2) for
 * r. */
static void slice_round_box(double h, double b, double c, double r, double *volume, double *second)
{
    /* integrals over s in [0, 1] of s^k sqrt(1 - s^2) and s^k (1 - s^2), k = 0, 1, 2 */
    const double root[3] = {M_PI / 4, 1.0 / 3, M_PI / 16}, disc[3] = {2.0 / 3, 1.0 / 4, 2.0 / 15};
    const double flat = 4 * b * c, line = 4 * r * (b + c), round = M_PI * r * r, area = flat + line + round;
    double end[3]; /* of s^k area(s) */
    for (int k = 0; k < 3; ++k) end[k] = flat / (k + 1) + line * root[k] + round * disc[k];
    *volume = 2 * h * area + 2 * r * end[0];
    *second = 2 * h * h * h / 3 * area + 2 * r * (h * h * end[0] + 2 * h * r * end[1] + r * r * end[2]);
}

/* By slices, which have nothing in common with the sums over faces, edges and vertices; turned and moved as well. */
START_TEST(rounded_boxes)
{
    static const double cases[][4] = {{1, 1, 1, 0.1}, {0.1, 0.2, 0.3, 0.5}, {1, 2, 1e-3, 0.05}, {1e-3, 1e-3, 1, 1e-3}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; ++k) {
        const double *h = cases[k], r = h[3];
        double volume, second[3];
        struct cloud c = box_cloud(h[0], h[1], h[2]);
        sadmm_mass wanted = {.orientation = {1}}, got = round_mass(&c, r);
        for (int i = 0; i < 3; ++i) slice_round_box(h[i], h[(i + 1) % 3], h[(i + 2) % 3], r, &volume, &second[i]);
        wanted.mass = volume;
        for (int i = 0; i < 3; ++i) wanted.inertia[i] = second[(i + 1) % 3] + second[(i + 2) % 3];
        expect_same(&got, &wanted, 1e-12);
        place_cloud(&c, turned, 3, -2, 1);
        got = round_mass(&c, r);
        memcpy(wanted.orientation, turned, sizeof turned);
        wanted.centre[0] = 3, wanted.centre[1] = -2, wanted.centre[2] = 1;
        expect_same(&got, &wanted, 1e-12);
    }
}
END_TEST

/* Without any symmetry: the volume is Steiner's polynomial, and all of it that of the hull of balls of many corners. */
START_TEST(a_rounded_tetrahedron)
{
    enum { BALL = 900 };
    static const double x[4][3] = {{0, 0, 0}, {1, 0.1, 0}, {0.2, 0.8, 0.1}, {0.3, 0.1, 0.6}};
    const double r = 0.3;
    struct cloud c = {.count = 0}, balls = {.count = 0};
    for (int v = 0; v < 4; ++v) {
        add_point(&c, x[v][0], x[v][1], x[v][2]);
        for (int k = 0; k < BALL; ++k) { /* a golden spiral */
            const double z = 1 - (2 * k + 1.0) / BALL, s = sqrt(1 - z * z), angle = k * 2.399963229728653;
            add_point(&balls, x[v][0] + r * s * cos(angle), x[v][1] + r * s * sin(angle), x[v][2] + r * z);
        }
    }
    const sadmm_mass core = round_mass(&c, 0), got = round_mass(&c, r), wanted = round_mass(&balls, 0);
    double area = 0, width = 0; /* of the faces; sum of the edges' length times the angle of their normals */
    for (int i = 0; i < 4; ++i) {
        vec3 n[4], centre = v3(0, 0, 0);
        for (int f = 0; f < 4; ++f) centre = v3_madd(centre, 0.25, v3_load(x[f]));
        for (int f = 0; f < 4; ++f) { /* face f is across vertex f */
            const vec3 p = v3_load(x[(f + 1) % 4]), q = v3_load(x[(f + 2) % 4]), s = v3_load(x[(f + 3) % 4]);
            n[f] = v3_cross(v3_sub(q, p), v3_sub(s, p));
            if (v3_dot(n[f], v3_sub(p, centre)) < 0) n[f] = v3_neg(n[f]);
        }
        area += v3_norm(n[i]) / 2;
        for (int j = i + 1; j < 4; ++j) { /* the edge of the other two vertices is between faces i and j */
            const int a = i == 0 ? (j == 1 ? 2 : 1) : 0, b = 6 - i - j - a;
            const double cosine = v3_dot(n[i], n[j]) / (v3_norm(n[i]) * v3_norm(n[j]));
            width += v3_norm(v3_sub(v3_load(x[a]), v3_load(x[b]))) * acos(cosine);
        }
    }
    ck_assert_double_eq_tol(got.mass, core.mass + area * r + width / 2 * r * r + 4 * M_PI / 3 * r * r * r, 1e-14);
    /* a ball of 900 corners lacks 0.8 % of its volume, and as much of each moment's part */
    expect_same(&got, &wanted, 1.2e-2);
    ck_assert_double_gt(got.mass, wanted.mass);
}
END_TEST

/* A needle with a round is a capsule, a speck a ball, but for the core's own width: to first order a share of 3 / 2 x
 * 3e-5 / 0.5 of the volume, and 5 / 3 of that of the moments. */
START_TEST(rounded_needles_and_specks)
{
    const struct cloud needle = box_cloud(1e-5, 1e-5, 2), speck = box_cloud(1e-5, 1e-5, 1e-5);
    sadmm_mass got = round_mass(&needle, 0.5), wanted = {.orientation = {1}};
    wanted.mass = M_PI * 0.25 * (4.0 / 3 * 0.5 + 4);
    sadmm_capsule_inertia(wanted.mass, 0.5, 2, wanted.inertia);
    expect_same(&got, &wanted, 2e-4);
    got = round_mass(&speck, 0.5);
    wanted.mass = 4 * M_PI / 3 * 0.125;
    sadmm_sphere_inertia(wanted.mass, 0.5, wanted.inertia);
    expect_same(&got, &wanted, 2e-4);
}
END_TEST

/* Shapes by their own formulas, in the frame that their pose is in. */
START_TEST(shapes)
{
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_mass got, wanted = {.centre = {1, 2, 3}};
    const double size[3] = {0.3, 0.2, 0.1};
    memcpy(def.size, size, sizeof size);
    memcpy(def.position, wanted.centre, sizeof def.position);
    memcpy(def.orientation, turned, sizeof turned);
    memcpy(wanted.orientation, turned, sizeof turned);
    def.type = SADMM_SHAPE_SPHERE;
    wanted.mass = 5 * 4 * M_PI / 3 * 0.027;
    sadmm_sphere_inertia(wanted.mass, 0.3, wanted.inertia);
    EXPECT_OK(sadmm_shape_mass(&def, 5, &got));
    expect_same(&got, &wanted, 1e-14);
    def.type = SADMM_SHAPE_CAPSULE;
    wanted.mass = 5 * (4 * M_PI / 3 * 0.027 + M_PI * 0.09 * 0.4);
    sadmm_capsule_inertia(wanted.mass, 0.3, 0.2, wanted.inertia);
    EXPECT_OK(sadmm_shape_mass(&def, 5, &got));
    expect_same(&got, &wanted, 1e-14);
    def.type = SADMM_SHAPE_BOX;
    wanted.mass = 5 * 8 * 0.006;
    sadmm_box_inertia(wanted.mass, size, wanted.inertia);
    EXPECT_OK(sadmm_shape_mass(&def, 5, &got));
    expect_same(&got, &wanted, 1e-14);
    def.type = SADMM_SHAPE_CYLINDER;
    wanted.mass = 5 * M_PI * 0.09 * 0.4;
    wanted.inertia[0] = wanted.inertia[1] = wanted.mass * (3 * 0.09 + 0.16) / 12;
    wanted.inertia[2] = wanted.mass * 0.09 / 2;
    EXPECT_OK(sadmm_shape_mass(&def, 5, &got));
    expect_same(&got, &wanted, 1e-14);
    def.type = SADMM_SHAPE_ELLIPSOID;
    wanted.mass = 5 * 4 * M_PI / 3 * 0.006;
    for (int k = 0; k < 3; ++k)
        wanted.inertia[k] = wanted.mass / 5 * (pow(size[(k + 1) % 3], 2) + pow(size[(k + 2) % 3], 2));
    EXPECT_OK(sadmm_shape_mass(&def, 5, &got));
    expect_same(&got, &wanted, 1e-14);
    /* A cone as what a cylinder's slices are: of radius 0.3 (0.2 - z) / 0.4 at z in [-0.2, 0.2]; the sums of 100,000
     * are good to 1e-10. Its centre is 0.1 below the middle. */
    const int slices = 100000;
    double volume = 0, first = 0, squares[2] = {0};
    for (int k = 0; k < slices; ++k) {
        const double dz = 0.4 / slices, z = -0.2 + (k + 0.5) * dz, r = 0.3 * (0.2 - z) / 0.4, disc = M_PI * r * r * dz;
        volume += disc;
        first += disc * z;
        squares[0] += disc * r * r / 4; /* of x, and of y */
        squares[1] += disc * z * z;
    }
    const double middle = first / volume;
    ck_assert_double_eq_tol(middle, -0.1, 1e-9);
    def.type = SADMM_SHAPE_CONE;
    wanted.mass = 5 * volume;
    wanted.inertia[0] = wanted.inertia[1] = 5 * (squares[0] + squares[1] - volume * middle * middle);
    wanted.inertia[2] = 5 * 2 * squares[0];
    v3_store(v3_add(v3(1, 2, 3), m3_mul(q_matrix(q_load(turned)), v3(0, 0, middle))), wanted.centre);
    EXPECT_OK(sadmm_shape_mass(&def, 5, &got));
    expect_same(&got, &wanted, 1e-8);
    memcpy(wanted.centre, def.position, sizeof wanted.centre);
    wanted.mass = 5 * 8 * 0.006;
    sadmm_box_inertia(wanted.mass, size, wanted.inertia);
    /* A hull of the box is the same thing, wherever its points are from. */
    struct cloud c = box_cloud(0.3, 0.2, 0.1);
    sadmm_hull *hull = NULL;
    EXPECT_OK(try_hull(&c, 1e-6, &hull));
    def.type = SADMM_SHAPE_HULL;
    def.hull = hull;
    EXPECT_OK(sadmm_shape_mass(&def, 5, &got));
    expect_same(&got, &wanted, 1e-12);
    sadmm_hull_destroy(hull);
}
END_TEST

/* A box cut into eight is the box, and a body laid out in parts falls back into its own frame. */
START_TEST(sums)
{
    const double half[3] = {0.3, 0.2, 0.1};
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_mass parts[8], sum, whole;
    def.type = SADMM_SHAPE_BOX;
    memcpy(def.orientation, turned, sizeof turned);
    memcpy(def.size, half, sizeof half);
    def.position[1] = 0.7;
    EXPECT_OK(sadmm_shape_mass(&def, 300, &whole));
    const mat3 turn = q_matrix(q_load(turned));
    for (int v = 0; v < 8; ++v) {
        const vec3 at = v3_scale(v3(v & 1 ? half[0] : -half[0], v & 2 ? half[1] : -half[1], v & 4 ? half[2] : -half[2]),
                                 0.5);
        for (int k = 0; k < 3; ++k) def.size[k] = half[k] / 2;
        v3_store(v3_add(v3(0, 0.7, 0), m3_mul(turn, at)), def.position);
        EXPECT_OK(sadmm_shape_mass(&def, 300, &parts[v]));
    }
    EXPECT_OK(sadmm_mass_sum(parts, 8, &sum));
    expect_same(&sum, &whole, 1e-13);
    expect_accepted(&sum);
    EXPECT_OK(sadmm_mass_sum(&sum, 1, &sum));
    expect_same(&sum, &whole, 1e-13);

    /* The body's frame in the layout's, taken into the body's: none. And what is laid out is where the layout is. */
    double position[3], orientation[4], body_at[3] = {4, 5, 6}, body_turn[4] = {0.48, 0.36, -0.48, 0.64};
    memcpy(position, sum.centre, sizeof position);
    memcpy(orientation, sum.orientation, sizeof orientation);
    EXPECT_OK(sadmm_mass_pose_in_body(&sum, position, orientation));
    for (int k = 0; k < 3; ++k) ck_assert_double_eq_tol(position[k], 0, 1e-15);
    ck_assert_double_eq_tol(fabs(orientation[0]), 1, 1e-15);
    const vec3 laid_out = v3(0.1, -0.2, 0.3);
    const vec3 in_world = v3_add(m3_mul(q_matrix(q_load(body_turn)), laid_out), v3(4, 5, 6));
    v3_store(laid_out, position);
    memcpy(orientation, turned, sizeof turned);
    EXPECT_OK(sadmm_mass_pose_in_body(&sum, position, orientation));
    EXPECT_OK(sadmm_mass_pose_of_body(&sum, body_at, body_turn));
    const vec3 there = v3_add(m3_mul(q_matrix(q_load(body_turn)), v3_load(position)), v3_load(body_at));
    ck_assert_double_le(v3_norm(v3_sub(there, in_world)), 1e-14);
}
END_TEST

static void expect_refused(sadmm_status status, const char *text)
{
    ck_assert_int_eq(status, SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_msg(strstr(sadmm_last_message(), text), "no \"%s\" in: %s", text, sadmm_last_message());
}

START_TEST(bad_arguments_are_refused)
{
    static const double densities[] = {NAN, INFINITY, 0, -1, 1e31};
    const struct cloud c = box_cloud(1, 1, 1);
    sadmm_shape_def def = sadmm_shape_def_default();
    sadmm_mass mass = {.mass = 7}, sum = {.mass = 7};
    sadmm_hull *hull = NULL;
    EXPECT_OK(try_hull(&c, 1e-6, &hull));
    def.size[0] = 1;
    for (size_t k = 0; k < sizeof densities / sizeof *densities; ++k) {
        expect_refused(sadmm_shape_mass(&def, densities[k], &mass), "density = ");
        expect_refused(sadmm_hull_mass(hull, densities[k], &mass), "density = ");
    }
    def.type = SADMM_SHAPE_PLANE;
    expect_refused(sadmm_shape_mass(&def, 1, &mass), "def->type = 0: a plane or a mesh has no mass");
    def.type = SADMM_SHAPE_TYPE_COUNT;
    expect_refused(sadmm_shape_mass(&def, 1, &mass), ": must be in [0, ");
    def.type = SADMM_SHAPE_HULL;
    expect_refused(sadmm_shape_mass(&def, 1, &mass), "def->hull = NULL");
    def.type = SADMM_SHAPE_BOX;
    expect_refused(sadmm_shape_mass(&def, 1, &mass), "def->size[1] = 0");
    ck_assert_double_eq(mass.mass, 7);

    sadmm_mass parts[2] = {{.mass = 1, .inertia = {1, 1, 1}, .orientation = {1}}};
    parts[1] = parts[0];
    expect_refused(sadmm_mass_sum(parts, 0, &sum), "count = 0: must be 1 or more");
    parts[1].mass = 0;
    expect_refused(sadmm_mass_sum(parts, 2, &sum), "parts[1].mass = 0");
    parts[1].mass = 1, parts[1].inertia[2] = -1;
    expect_refused(sadmm_mass_sum(parts, 2, &sum), "parts[1].inertia[2] = -1");
    parts[1].inertia[2] = 1, parts[1].centre[1] = NAN;
    expect_refused(sadmm_mass_sum(parts, 2, &sum), "parts[1].centre[1] = nan");
    parts[1].centre[1] = 0, parts[1].orientation[1] = 1;
    expect_refused(sadmm_mass_sum(parts, 2, &sum), "parts[1].orientation");
    ck_assert_double_eq(sum.mass, 7);

    double position[3] = {1, 2, 3}, orientation[4] = {2};
    expect_refused(sadmm_mass_pose_in_body(parts, position, orientation), "orientation = (2, 0, 0, 0)");
    expect_refused(sadmm_mass_pose_of_body(parts, position, orientation), "orientation = (2, 0, 0, 0)");
    orientation[0] = 1, position[1] = INFINITY;
    expect_refused(sadmm_mass_pose_in_body(parts, position, orientation), "position[1] = inf");
    ck_assert(position[0] == 1 && orientation[0] == 1);
    sadmm_hull_destroy(hull);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("mass");
    TCase *cases = tcase_create("mass");
    tcase_add_test(cases, boxes);
    tcase_add_test(cases, a_tetrahedron);
    tcase_add_test(cases, prisms);
    tcase_add_test(cases, needles_and_cards);
    tcase_add_test(cases, rounded_boxes);
    tcase_add_test(cases, a_rounded_tetrahedron);
    tcase_add_test(cases, rounded_needles_and_specks);
    tcase_add_test(cases, shapes);
    tcase_add_test(cases, sums);
    tcase_add_test(cases, bad_arguments_are_refused);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
