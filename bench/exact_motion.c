#include "exact_motion.h"

#include <math.h>
#include <string.h>

#include "core/math/quat.h"

enum { BODY_NUMBERS = 13, MOST_ROWS = 12 };

/* ---- geometry -------------------------------------------------------------------------------------------------- */

struct moving {
    mat3 turn;
    vec3 x, v, w;
};

/* body -1: the world */
static struct moving moving_of(const double state[][BODY_NUMBERS], int body)
{
    static const double still[BODY_NUMBERS] = {[3] = 1};
    const double *at = body >= 0 ? state[body] : still;
    return (struct moving){q_matrix(q_load(at + 3)), v3_load(at), v3_load(at + 7), v3_load(at + 10)};
}

struct support {
    vec3 point, rate; /* what lies farthest along d, in the body's frame, and its rate of change where d has this one */
};

static struct support support_of(const struct exact_surface *s, vec3 d, vec3 by)
{
    const vec3 centre = v3_load(s->centre);
    if (s->kind == EXACT_RIM) {
        const vec3 axis = v3_load(s->axis), out = v3_madd(d, -v3_dot(d, axis), axis),
                   out_rate = v3_madd(by, -v3_dot(by, axis), axis);
        const double size = v3_norm(out);
        const vec3 unit = v3_scale(out, 1 / size), turn = v3_madd(out_rate, -v3_dot(unit, out_rate), unit);
        return (struct support){v3_madd(centre, s->size[0], unit), v3_scale(turn, s->size[0] / size)};
    }
    const double *a = s->size;
    const double square[3] = {a[0] * a[0], s->kind == EXACT_BALL ? a[0] * a[0] : a[1] * a[1],
                              s->kind == EXACT_BALL ? a[0] * a[0] : a[2] * a[2]};
    const vec3 far = v3(square[0] * d.x, square[1] * d.y, square[2] * d.z),
               far_rate = v3(square[0] * by.x, square[1] * by.y, square[2] * by.z);
    const double h = sqrt(v3_dot(far, d)), h_rate = v3_dot(far, by) / h;
    return (struct support){v3_madd(centre, 1 / h, far), v3_madd(v3_scale(far_rate, 1 / h), -h_rate / (h * h), far)};
}

/* The same in the world, from the body's centre of mass: d is fixed there. */
static struct support lowest_of(const struct exact_surface *s, const struct moving *m)
{
    const vec3 down = m3_tmul(m->turn, v3(0, 0, -1)), spin = m3_tmul(m->turn, m->w);
    const struct support own = support_of(s, down, v3_neg(v3_cross(spin, down)));
    const vec3 arm = m3_mul(m->turn, own.point);
    return (struct support){arm, v3_add(v3_cross(m->w, arm), m3_mul(m->turn, own.rate))};
}

void exact_lowest(const struct exact_surface *surface, const sadmm_body_state *state, double arm[3])
{
    double numbers[1][BODY_NUMBERS];
    memcpy(numbers[0], state, sizeof numbers[0]);
    const struct moving m = moving_of((const double(*)[BODY_NUMBERS])numbers, 0);
    v3_store(lowest_of(surface, &m).point, arm);
}

/* ---- constraints ----------------------------------------------------------------------------------------------- */

/* along . (relative acceleration) = rate, by a force along `force`; body numbers as in the link. */
struct row {
    int a, b;
    vec3 along[2][2], force[2][2]; /* of a, of b: linear, angular */
    double rate;
    bool presses;
};

struct place {
    vec3 arm[2], rate[2]; /* of a, of b, and their changes */
    vec3 normal, normal_rate, slip;
};

static void add_row(struct row *rows, int *count, const struct exact_link *link, const struct moving m[2],
                    const struct place *at, vec3 along, vec3 along_rate, vec3 force)
{
    struct row *row = &rows[(*count)++];
    const vec3 bend = v3_sub(v3_cross(m[1].w, at->rate[1]), v3_cross(m[0].w, at->rate[0]));
    *row = (struct row){.a = link->a, .b = link->b, .rate = -v3_dot(along, bend) - v3_dot(along_rate, at->slip)};
    for (int s = 0; s < 2; ++s) {
        const double sign = s ? 1 : -1;
        row->along[s][0] = v3_scale(along, sign);
        row->along[s][1] = v3_scale(v3_cross(at->arm[s], along), sign);
        row->force[s][0] = v3_scale(force, sign);
        row->force[s][1] = v3_scale(v3_cross(at->arm[s], force), sign);
    }
}

static void add_contact(struct row *rows, int *count, const struct exact_link *link, const struct moving m[2],
                        const struct place *at)
{
    const vec3 none = v3(0, 0, 0);
    vec3 u, w;
    v3_tangents(at->normal, &u, &w);
    if (link->hold == EXACT_SLIDES) {
        const vec3 force = v3_madd(at->normal, -link->friction, v3_load(link->way));
        add_row(rows, count, link, m, at, at->normal, at->normal_rate, force);
    } else {
        add_row(rows, count, link, m, at, at->normal, none, at->normal);
        if (link->hold == EXACT_GRIPS_ACROSS) {
            const vec3 way = v3_add(m[1].x, at->arm[1]);
            w = v3_cross(at->normal, v3_scale(way, 1 / v3_norm(way)));
        } else add_row(rows, count, link, m, at, u, none, u);
        add_row(rows, count, link, m, at, w, none, w);
    }
    rows[*count - (link->hold == EXACT_SLIDES ? 1 : link->hold == EXACT_GRIPS ? 3 : 2)].presses = true;
}

static void add_point(struct row *rows, int *count, const struct exact_link *link, const struct moving m[2])
{
    struct place at = {.slip = {0, 0, 0}};
    for (int s = 0; s < 2; ++s) {
        at.arm[s] = m3_mul(m[s].turn, v3_load(link->point[s]));
        at.rate[s] = v3_cross(m[s].w, at.arm[s]);
    }
    for (int k = 0; k < 3; ++k) add_row(rows, count, link, m, &at, v3_axis(k, 1), v3(0, 0, 0), v3_axis(k, 1));
}

static void add_axis(struct row *rows, int *count, const struct exact_link *link, const struct moving m[2])
{
    const vec3 none = v3(0, 0, 0);
    vec3 across[2];
    v3_tangents(v3_load(link->axis), &across[0], &across[1]);
    for (int k = 0; k < 2; ++k) {
        const vec3 e = m3_mul(m[0].turn, across[k]);
        struct row *row = &rows[(*count)++];
        *row = (struct row){.a = link->a, .b = link->b, .along = {{none, v3_neg(e)}, {none, e}},
                            .force = {{none, v3_neg(e)}, {none, e}},
                            .rate = -v3_dot(v3_cross(m[0].w, e), v3_sub(m[1].w, m[0].w))};
    }
}

static void add_link(struct row *rows, int *count, const struct exact_link *link, const double state[][BODY_NUMBERS])
{
    const struct moving m[2] = {moving_of(state, link->a), moving_of(state, link->b)};
    struct place at = {.normal = v3(0, 0, 1), .normal_rate = v3(0, 0, 0)};
    switch (link->kind) {
    case EXACT_POINT: add_point(rows, count, link, m); return;
    case EXACT_AXIS: add_axis(rows, count, link, m); return;
    case EXACT_ON_GROUND: {
        const struct support low = lowest_of(&link->surface[1], &m[1]);
        at.arm[0] = at.rate[0] = v3(0, 0, 0);
        at.arm[1] = low.point, at.rate[1] = low.rate;
        break;
    }
    case EXACT_ON_BALL: {
        vec3 centre[2], speed[2];
        for (int s = 0; s < 2; ++s) {
            centre[s] = m3_mul(m[s].turn, v3_load(link->surface[s].centre));
            speed[s] = v3_cross(m[s].w, centre[s]);
        }
        const vec3 way = v3_sub(v3_add(m[1].x, centre[1]), v3_add(m[0].x, centre[0])),
                   change = v3_sub(v3_add(m[1].v, speed[1]), v3_add(m[0].v, speed[0]));
        const double length = v3_norm(way);
        at.normal = v3_scale(way, 1 / length);
        at.normal_rate = v3_scale(v3_madd(change, -v3_dot(change, at.normal), at.normal), 1 / length);
        for (int s = 0; s < 2; ++s) {
            const double reach = s ? -link->surface[s].size[0] : link->surface[s].size[0];
            at.arm[s] = v3_madd(centre[s], reach, at.normal);
            at.rate[s] = v3_madd(speed[s], reach, at.normal_rate);
        }
    }
    }
    at.slip = v3_sub(v3_add(m[1].v, v3_cross(m[1].w, at.arm[1])), v3_add(m[0].v, v3_cross(m[0].w, at.arm[0])));
    at.slip = v3_madd(at.slip, -v3_dot(at.slip, at.normal), at.normal);
    add_contact(rows, count, link, m, &at);
}

/* ---- accelerations --------------------------------------------------------------------------------------------- */

/* Gauss' elimination, the largest pivot of each column. */
static void solve_linear(double m[MOST_ROWS][MOST_ROWS + 1], int n, double *x)
{
    for (int k = 0; k < n; ++k) {
        int best = k;
        for (int i = k + 1; i < n; ++i)
            if (fabs(m[i][k]) > fabs(m[best][k])) best = i;
        for (int j = 0; j <= n; ++j) {
            const double keep = m[k][j];
            m[k][j] = m[best][j], m[best][j] = keep;
        }
        for (int i = k + 1; i < n; ++i) {
            const double share = m[i][k] / m[k][k];
            for (int j = k; j <= n; ++j) m[i][j] -= share * m[k][j];
        }
    }
    for (int k = n - 1; k >= 0; --k) {
        x[k] = m[k][n];
        for (int j = k + 1; j < n; ++j) x[k] -= m[k][j] * x[j];
        x[k] /= m[k][k];
    }
}

static vec3 by_inertia(const struct exact_body *body, const struct moving *m, vec3 x, bool inverse)
{
    vec3 own = m3_tmul(m->turn, x);
    const double *i = body->inertia;
    own = inverse ? v3(own.x / i[0], own.y / i[1], own.z / i[2]) : v3(own.x * i[0], own.y * i[1], own.z * i[2]);
    return m3_mul(m->turn, own);
}

static void rates_of(struct exact_system *s, const double state[][BODY_NUMBERS], double out[][BODY_NUMBERS])
{
    struct row rows[MOST_ROWS];
    struct moving m[EXACT_BODIES];
    vec3 free[EXACT_BODIES][2];
    double matrix[MOST_ROWS][MOST_ROWS + 1] = {{0}}, load[MOST_ROWS];
    int count = 0;
    for (int i = 0; i < s->link_count; ++i) add_link(rows, &count, &s->links[i], state);
    for (int i = 0; i < s->body_count; ++i) {
        m[i] = moving_of(state, i);
        free[i][0] = v3_load(s->gravity);
        free[i][1] = by_inertia(&s->bodies[i], &m[i],
                                v3_neg(v3_cross(m[i].w, by_inertia(&s->bodies[i], &m[i], m[i].w, false))), true);
    }
    for (int r = 0; r < count; ++r) {
        matrix[r][count] = rows[r].rate;
        for (int side = 0; side < 2; ++side) {
            const int body = side ? rows[r].b : rows[r].a;
            if (body < 0) continue;
            const struct exact_body *own = &s->bodies[body];
            matrix[r][count] -= v3_dot(rows[r].along[side][0], free[body][0]) +
                                v3_dot(rows[r].along[side][1], free[body][1]);
            for (int c = 0; c < count; ++c)
                for (int other = 0; other < 2; ++other)
                    if ((other ? rows[c].b : rows[c].a) == body)
                        matrix[r][c] += v3_dot(rows[r].along[side][0], rows[c].force[other][0]) / own->mass +
                                        v3_dot(rows[r].along[side][1],
                                               by_inertia(own, &m[body], rows[c].force[other][1], true));
        }
    }
    solve_linear(matrix, count, load);
    for (int r = 0; r < count; ++r) {
        if (rows[r].presses) s->least_load = fmin(s->least_load, load[r]);
        for (int side = 0; side < 2; ++side) {
            const int body = side ? rows[r].b : rows[r].a;
            if (body < 0) continue;
            free[body][0] = v3_madd(free[body][0], load[r] / s->bodies[body].mass, rows[r].force[side][0]);
            free[body][1] = v3_madd(free[body][1], load[r],
                                    by_inertia(&s->bodies[body], &m[body], rows[r].force[side][1], true));
        }
    }
    for (int i = 0; i < s->body_count; ++i) {
        const quat spin = {0, m[i].w.x / 2, m[i].w.y / 2, m[i].w.z / 2};
        v3_store(m[i].v, out[i]);
        q_store(q_mul(spin, q_load(state[i] + 3)), out[i] + 3);
        v3_store(free[i][0], out[i] + 7);
        v3_store(free[i][1], out[i] + 10);
    }
}

void exact_step(struct exact_system *s, double h)
{
    static const double share[4] = {0, 0.5, 0.5, 1}, weight[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    double start[EXACT_BODIES][BODY_NUMBERS], at[EXACT_BODIES][BODY_NUMBERS], end[EXACT_BODIES][BODY_NUMBERS],
        rate[EXACT_BODIES][BODY_NUMBERS] = {{0}};
    for (int i = 0; i < s->body_count; ++i) memcpy(start[i], &s->bodies[i].state, sizeof start[i]);
    memcpy(end, start, sizeof end);
    for (int k = 0; k < 4; ++k) {
        for (int i = 0; i < s->body_count; ++i)
            for (int j = 0; j < BODY_NUMBERS; ++j) at[i][j] = start[i][j] + h * share[k] * rate[i][j];
        rates_of(s, (const double(*)[BODY_NUMBERS])at, rate);
        for (int i = 0; i < s->body_count; ++i)
            for (int j = 0; j < BODY_NUMBERS; ++j) end[i][j] += h * weight[k] * rate[i][j];
    }
    for (int i = 0; i < s->body_count; ++i) {
        q_store(q_normalize(q_load(end[i] + 3)), end[i] + 3);
        memcpy(&s->bodies[i].state, end[i], sizeof end[i]);
    }
}

double exact_energy(const struct exact_system *s, double *kinetic)
{
    double moving = 0, high = 0;
    for (int i = 0; i < s->body_count; ++i) {
        const struct exact_body *body = &s->bodies[i];
        const vec3 v = v3_load(body->state.linear_velocity),
                   spin = m3_tmul(q_matrix(q_load(body->state.orientation)), v3_load(body->state.angular_velocity));
        moving += 0.5 * (body->mass * v3_norm2(v) + body->inertia[0] * spin.x * spin.x +
                         body->inertia[1] * spin.y * spin.y + body->inertia[2] * spin.z * spin.z);
        high -= body->mass * v3_dot(v3_load(s->gravity), v3_load(body->state.position));
    }
    if (kinetic) *kinetic = moving;
    return moving + high;
}
