#include <math.h>
#include <string.h>

#include "core/math/solve_rounding.h"
#include "ncp_kernels.h"
#include "ncp_linear.h"

/* Steps from where the iterations are, which is what most problems need, and from an interior point. */
enum { STEPS_FROM_START = 20, STEPS_FROM_INTERIOR = 100, STEPS_IN_TURN = 50 };
/* What is added to the diagonal of a step's matrix, whose entries are shares of a law's own response: `share` of the
 * natural map, by the size of velocities, within bounds. It keeps impulses that do the same from running away; along
 * those a step finds rounding / `least`. In turn, since no one of them suits all: a rag doll at rest takes the first,
 * the many contacts of a bridge's plank the second. */
static const struct damping {
    double share, least, most;
} damping[] = {{100, 1e-8, 1e-5}, {1, 1e-10, 1e-3}};
enum { DAMPINGS = sizeof damping / sizeof *damping };
/* Laws that give: at first by this share, by so much less each time they are met, by so much more where they are not,
 * up to the most. With little they are near those that do not: their natural map halves each time, or nothing meets
 * them. Steps for one share, and in all. */
static const double GIVE_FIRST = 1e-2, GIVE_LESS = 0.1, GIVE_MORE = 3, GIVE_MOST = 10, GIVE_LITTLE = 1e-5;
enum { STEPS_GIVING = 25, STEPS_FROM_GIVING = 400 };
/* Impulses that run away to so many times the size of all take u with them: rounding of what they add to it and take
 * back again. */
static const double LOST = 1e6;
/* m/s: nearer than this the pieces are right, and a step without damping finds, of all impulses that solve, those that
 * the matrix has: the least, by its regularisation, whatever the start. */
static const double NEAR = 1e-10;
/* m/s: what is left below this is rounding, which an interior point does not take away. */
static const double NEARLY = 1e-11;

/* ---- a step ------------------------------------------------------------------------------------------------------ */

/* A law's projection, with its derivative. */
struct piece {
    double to[3], D[3][3];
};

struct newton {
    struct ncp_dense *d;
    double *M;              /* of the numbers that are solved for: count x count */
    double *step, *moved;   /* (size) of lambda; of u by the steps of numbers that their law fixes */
    double *right;          /* (count) right sides, then the steps */
    double *start_lambda, *start_u, *best_lambda, *best_u;
    double *centre, give;   /* (size); lambda's distance to it costs so much, a share of the responses (below) */
    int32_t *number, count; /* those that are solved for */
    int32_t *pivot;
    struct piece *piece;    /* (laws) where lambda and u are */
    double proximal;
};

/* The work, cut up: NCP_NEWTON_VECTORS behind the matrix. */
static struct newton newton_of(struct ncp_dense *d)
{
    const size_t n = (size_t)d->size;
    struct newton s = {.d = d};
    s.M = d->work;
    s.step = s.M + n * (n + 3);
    s.moved = s.step + n;
    s.right = s.moved + n;
    s.start_lambda = s.right + n;
    s.start_u = s.start_lambda + n;
    s.best_lambda = s.start_u + n;
    s.best_u = s.best_lambda + n;
    s.centre = s.best_u + n;
    s.number = (int32_t *)(s.centre + n);
    s.pivot = s.number + n;
    s.piece = (struct piece *)(s.centre + 2 * n);
    return s;
}

/* ncp_natural_map of what is solved, with the pieces. */
static double find_pieces(struct newton *s)
{
    const struct ncp_dense *d = s->d;
    double most = 0;
    for (int32_t i = 0; i < d->laws; ++i) {
        struct piece *piece = &s->piece[i];
        double y[3];
        ncp_arrive(d, &d->law[i], y);
        for (int32_t n = d->law[i].first, k = 0; s->give > 0 && k < d->law[i].count; ++k)
            y[k] -= s->give * (d->lambda[n + k] - s->centre[n + k]);
        ncp_project(&d->law[i], y, piece->to, piece->D);
        const double map = ncp_law_map(d, &d->law[i], piece->to);
        if (!(map <= most)) most = map;
    }
    return most;
}

/* Numbers that their law fixes go where it has them: an open contact's to 0. The others are listed, to be solved
 * for. */
static void sort_numbers(struct newton *s)
{
    const struct ncp_dense *d = s->d;
    s->count = 0;
    memset(s->moved, 0, (size_t)d->size * sizeof *s->moved);
    for (int32_t i = 0; i < d->laws; ++i) {
        const struct ncp_law *law = &d->law[i];
        const struct piece *piece = &s->piece[i];
        for (int32_t k = 0; k < law->count; ++k) {
            const int32_t n = law->first + k;
            const double *D = piece->D[k];
            s->step[n] = piece->to[k] - d->lambda[n];
            if (D[0] != 0 || D[1] != 0 || D[2] != 0) s->number[s->count++] = n;
            else if (s->step[n] != 0) ncp_respond(d, n, s->step[n], s->moved);
        }
    }
}

/* Four columns of a row of G: those of numbers `number`, of which there are so many left. */
static three columns_of(const double *row, const int32_t *number, int32_t left)
{
    if (left >= 4) return (three){row[number[0]], row[number[1]], row[number[2]], row[number[3]]};
    return (three){row[number[0]], left > 1 ? row[number[1]] : 0, left > 2 ? row[number[2]] : 0, 0};
}

/* Rows of a law: (1 - D) step + D G step / w = Pi - lambda. `row`: the next one. */
static void enter_law(struct newton *s, const struct ncp_law *law, const struct piece *piece, int32_t *row)
{
    const struct ncp_dense *d = s->d;
    const size_t stride = ncp_stride(s->count);
    const int32_t begin = *row, size = law->count;
    const double *G = d->G + (size_t)law->first * (size_t)d->size, softness = 1 / law->response;
    int32_t end = begin;
    while (end < s->count && s->number[end] < law->first + size) ++end;
    if (end == begin) return;
    for (int32_t c = 0; c < s->count; c += 4) {
        three own[3] = {{0}, {0}, {0}};
        for (int32_t h = 0; h < size; ++h) own[h] = columns_of(G + h * d->size, s->number + c, s->count - c);
        for (int32_t at = begin; at < end; ++at) {
            const double *D = piece->D[s->number[at] - law->first];
            *(three *)(s->M + (size_t)at * stride + c) = three_fill(D[0] * softness) * own[0] +
                                                         three_fill(D[1] * softness) * own[1] +
                                                         three_fill(D[2] * softness) * own[2];
        }
    }
    for (int32_t at = begin; at < end; ++at) {
        const int32_t k = s->number[at] - law->first;
        double *M = s->M + (size_t)at * stride, right = s->step[law->first + k];
        for (int32_t h = 0; h < size; ++h) right -= piece->D[k][h] * softness * s->moved[law->first + h];
        for (int32_t other = begin; other < end; ++other) {
            const int32_t h = s->number[other] - law->first;
            M[other] += (h == k) - (1 - s->give) * piece->D[k][h];
        }
        M[at] += s->proximal;
        s->right[at] = right;
    }
    *row = end;
}

static bool make_step(struct newton *s)
{
    struct ncp_dense *d = s->d;
    int32_t row = 0;
    sort_numbers(s);
    for (int32_t i = 0; i < d->laws; ++i) enter_law(s, &d->law[i], &s->piece[i], &row);
    const double solved_for = s->count, all = d->size;
    d->budget -= ncp_factor_work(solved_for) + 2 * all * all;
    if (!ncp_factor(s->M, s->pivot, s->count)) return false;
    ncp_substitute(s->M, s->pivot, s->count, s->right);
    for (int32_t r = 0; r < s->count; ++r) s->step[s->number[r]] = s->right[r];
    for (int32_t n = 0; n < d->size; ++n) {
        d->lambda[n] += s->step[n];
        d->u[n] += ncp_row_product(d->G + (size_t)n * (size_t)d->size, s->step, (size_t)d->size);
    }
    return true;
}

/* ---- the search -------------------------------------------------------------------------------------------------- */

static void copy(const struct ncp_dense *d, const double *lambda, const double *u, double *to_lambda, double *to_u)
{
    memcpy(to_lambda, lambda, (size_t)d->size * sizeof *lambda);
    memcpy(to_u, u, (size_t)d->size * sizeof *u);
}

static void keep_best(struct newton *s) { copy(s->d, s->d->lambda, s->d->u, s->best_lambda, s->best_u); }

/* What the natural map is a share of: the largest speed, m/s, or load times response. */
static double size_of(const struct ncp_dense *d)
{
    double size = 0;
    for (int32_t i = 0; i < d->laws; ++i)
        for (int32_t k = 0; k < d->law[i].count; ++k) {
            const int32_t n = d->law[i].first + k;
            size = fmax(size, fmax(fabs(d->u[n]), fabs(d->lambda[n]) * d->law[i].response));
        }
    return size;
}

/* As at the start, but for no impulses. */
static void forget(const struct newton *s)
{
    const struct ncp_dense *d = s->d;
    copy(d, s->start_lambda, s->start_u, d->lambda, d->u);
    for (int32_t n = 0; n < d->size; ++n)
        d->u[n] -= ncp_row_product(d->G + (size_t)n * (size_t)d->size, d->lambda, (size_t)d->size);
    memset(d->lambda, 0, (size_t)d->size * sizeof *d->lambda);
}

/* Of laws that give: are they met? From where they are, which is kept otherwise. */
static bool meet_giving(struct newton *s, double size, int *steps)
{
    struct ncp_dense *d = s->d;
    double map = HUGE_VAL;
    copy(d, d->lambda, d->u, s->start_lambda, s->start_u);
    memcpy(s->centre, d->lambda, (size_t)d->size * sizeof *s->centre);
    for (int step = 0; step < STEPS_GIVING; ++step) {
        map = find_pieces(s);
        if (!(map > NEARLY && map < LOST * size && d->budget > 0)) break;
        s->proximal = map > NEAR ? fmin(damping[0].most, fmax(damping[0].least, damping[0].share * map / size)) : 0;
        ++*steps;
        if (!make_step(s)) break;
    }
    if (map <= NEARLY) return true;
    copy(d, s->start_lambda, s->start_u, d->lambda, d->u);
    return false;
}

/* Proximal points (Rockafellar, 1976): laws give by a share of their response, from the impulses that the last such
 * problem was solved by, and from none at first:
 *
 *     lambda = Pi(lambda - u/w - give (lambda - centre))
 *
 * One that gives much is solved by a few steps, and each leads to the next one. Where impulses come to rest, laws that
 * do not give are met, redundant or not. Returns the best map so far. */
static double give_less_and_less(struct newton *s, double size, double best, double enough)
{
    struct ncp_dense *d = s->d;
    double least = 1, last = HUGE_VAL; /* what gave least and was met, and by how much this missed */
    int steps = 0;
    forget(s);
    s->give = GIVE_FIRST;
    while (best > enough && s->give <= GIVE_MOST && steps < STEPS_FROM_GIVING && d->budget > 0) {
        const bool met = meet_giving(s, size, &steps);
        const double map = met ? ncp_natural_map(d) : HUGE_VAL;
        if (map < best) keep_best(s);
        best = fmin(map, best);
        if (met && s->give < least) {
            if (s->give < GIVE_LITTLE && map > last / 2) break; /* impulses grow for good */
            least = s->give, last = map;
        }
        s->give *= met ? GIVE_LESS : GIVE_MORE;
    }
    s->give = 0;
    copy(d, s->best_lambda, s->best_u, d->lambda, d->u);
    return best;
}

/* Full steps: on the way to the right pieces the map may grow. Returns the best map so far. */
static double take_steps(struct newton *s, int steps, double size, double best, double enough)
{
    struct ncp_dense *d = s->d;
    double map = find_pieces(s);
    for (int step = 0; step < steps && best > enough && map < LOST * size && d->budget > 0; ++step) {
        const struct damping *by = &damping[step / STEPS_IN_TURN % DAMPINGS];
        s->proximal = map > NEAR ? fmin(by->most, fmax(by->least, by->share * map / size)) : 0;
        if (!make_step(s)) return best;
        map = find_pieces(s);
        if (map < best) keep_best(s);
        best = map < best ? map : best;
    }
    return best;
}

double SADMM_KERNEL(ncp_newton)(struct ncp_dense *d, double enough)
{
    struct newton s = newton_of(d);
    const double size = size_of(d);
    double best = ncp_natural_map(d);
    if (!(best > enough && size < HUGE_VAL)) return best;
    copy(d, d->lambda, d->u, s.start_lambda, s.start_u);
    keep_best(&s);
    best = take_steps(&s, STEPS_FROM_START, size, best, enough);
    if (best > NEARLY) {
        copy(d, s.start_lambda, s.start_u, d->lambda, d->u);
        const double map = SADMM_KERNEL(ncp_interior)(d, enough);
        if (map < best) keep_best(&s);
        best = take_steps(&s, STEPS_FROM_INTERIOR, size, fmin(best, map), enough);
    }
    if (best > NCP_ENOUGH) {
        best = give_less_and_less(&s, size, best, NEAR);
        best = take_steps(&s, STEPS_FROM_START, size, best, enough);
    }
    copy(d, s.best_lambda, s.best_u, d->lambda, d->u);
    return best;
}
