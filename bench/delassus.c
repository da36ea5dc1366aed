#include "delassus.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/math/dense6.h"

/* ---- gathering --------------------------------------------------------------------------------------------------- */

/* Which side of contact k a body is; -1: both are others. */
static int side_of(struct delassus *d, int32_t k, int32_t body)
{
    for (int side = 0; side < 2; ++side) {
        int32_t *at = &d->body[2 * (size_t)k + (size_t)side];
        if (*at < 0) *at = body;
        if (*at == body) return side;
    }
    return -1;
}

static sadmm_status gather(const struct sadmm_global_problem *g, struct delassus *d, struct sadmm_error *error)
{
    for (size_t k = 0; k < 2 * (size_t)d->contacts; ++k) d->body[k] = -1;
    for (size_t e = 0; e < g->M.count; ++e) {
        const int32_t row = g->M.row[e], column = g->M.column[e];
        if (row / 6 == column / 6)
            d->factor[36 * (size_t)(row / 6) + (size_t)(6 * (row % 6) + column % 6)] += g->M.value[e];
    }
    for (size_t e = 0; e < g->H.count; ++e) {
        const int32_t k = g->H.column[e] / 3, body = g->H.row[e] / 6;
        if (g->H.value[e] == 0) continue;
        const int side = side_of(d, k, body);
        if (side < 0) return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "contact %d acts on more than two bodies", k);
        d->J[18 * (2 * (size_t)k + (size_t)side) + (size_t)(6 * (g->H.column[e] % 3) + g->H.row[e] % 6)] +=
            g->H.value[e];
    }
    return SADMM_OK;
}

static sadmm_status factor(struct delassus *d, struct sadmm_error *error)
{
    for (int32_t i = 0; i < d->bodies; ++i) {
        double L[36];
        if (!dense6_cholesky(d->factor + 36 * (size_t)i, L))
            return sadmm_fail(error, SADMM_ERROR_INVALID_ARGUMENT, "M of body %d is not positive definite", i);
        memcpy(d->factor + 36 * (size_t)i, L, sizeof L);
    }
    return SADMM_OK;
}

static double product(const double *a, const double *b)
{
    double sum = 0;
    for (int k = 0; k < 6; ++k) sum += a[k] * b[k];
    return sum;
}

static void respond(const struct sadmm_global_problem *g, struct delassus *d)
{
    memcpy(d->offset, g->w, 3 * (size_t)d->contacts * sizeof *d->offset);
    for (size_t at = 0; at < 2 * (size_t)d->contacts; ++at) {
        const int32_t body = d->body[at];
        for (int row = 0; body >= 0 && row < 3; ++row) {
            double *response = d->response + 18 * at + 6 * row;
            dense6_solve(d->factor + 36 * (size_t)body, d->J + 18 * at + 6 * row, response);
            d->offset[3 * (at / 2) + (size_t)row] += product(response, g->f + 6 * (size_t)body);
        }
    }
}

/* Contacts of each body. */
static void list_touches(struct delassus *d)
{
    for (size_t at = 0; at < 2 * (size_t)d->contacts; ++at)
        if (d->body[at] >= 0) ++d->first[d->body[at] + 1];
    for (int32_t i = 0; i < d->bodies; ++i) d->first[i + 1] += d->first[i];
    for (size_t at = 2 * (size_t)d->contacts; at-- > 0;) /* from the end: first[i + 1] comes down to first[i] */
        if (d->body[at] >= 0) d->touches[--d->first[d->body[at] + 1]] = (int32_t)(at / 2);
    memmove(d->first, d->first + 1, (size_t)d->bodies * sizeof *d->first);
    d->first[d->bodies] = 0;
    for (size_t at = 0; at < 2 * (size_t)d->contacts; ++at) d->first[d->bodies] += d->body[at] >= 0;
}

sadmm_status delassus_make(const struct sadmm_global_problem *g, struct delassus *out, struct sadmm_error *error)
{
    const size_t bodies = (size_t)g->bodies, contacts = (size_t)g->contacts;
    *out = (struct delassus){.bodies = g->bodies, .contacts = g->contacts};
    if (g->hard_rows > 0)
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "%d bilateral rows: must have none", g->hard_rows);
    out->body = sadmm_alloc(2 * contacts, sizeof *out->body);
    out->J = sadmm_alloc(36 * contacts, sizeof *out->J);
    out->response = sadmm_alloc(36 * contacts, sizeof *out->response);
    out->factor = sadmm_alloc(36 * bodies, sizeof *out->factor);
    out->offset = sadmm_alloc(3 * contacts, sizeof *out->offset);
    out->first = sadmm_alloc(bodies + 1, sizeof *out->first);
    out->touches = sadmm_alloc(2 * contacts, sizeof *out->touches);
    sadmm_status status = SADMM_OK;
    if (!out->body || !out->J || !out->response || !out->factor || !out->offset || !out->first || !out->touches)
        status = sadmm_fail_memory(error, "the Delassus form of a problem");
    if (status == SADMM_OK) status = gather(g, out, error);
    if (status == SADMM_OK) status = factor(out, error);
    if (status == SADMM_OK) {
        respond(g, out);
        list_touches(out);
    } else {
        delassus_free(out);
    }
    return status;
}

void delassus_free(struct delassus *d)
{
    sadmm_free(d->body);
    sadmm_free(d->J);
    sadmm_free(d->response);
    sadmm_free(d->factor);
    sadmm_free(d->offset);
    sadmm_free(d->first);
    sadmm_free(d->touches);
    memset(d, 0, sizeof *d);
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

int32_t delassus_most_in_row(const struct delassus *d)
{
    int32_t most = 1;
    for (int32_t i = 0; i < d->bodies; ++i)
        if (d->first[i + 1] - d->first[i] > most) most = d->first[i + 1] - d->first[i];
    return 2 * most;
}

/* Two ascending lists in one, what is in both once. */
int32_t delassus_row(const struct delassus *d, int32_t k, int32_t *list)
{
    const int32_t *at[2], *end[2];
    int32_t count = 0;
    for (int side = 0; side < 2; ++side) {
        const int32_t body = d->body[2 * (size_t)k + (size_t)side];
        at[side] = body < 0 ? d->touches : d->touches + d->first[body];
        end[side] = body < 0 ? d->touches : d->touches + d->first[body + 1];
    }
    while (at[0] < end[0] || at[1] < end[1]) {
        const bool second = at[0] == end[0] || (at[1] < end[1] && *at[1] < *at[0]);
        const int32_t next = *at[second]++;
        if (count == 0 || list[count - 1] != next) list[count++] = next;
    }
    return count;
}

void delassus_block(const struct delassus *d, int32_t k, int32_t l, double block[9])
{
    memset(block, 0, 9 * sizeof *block);
    for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b) {
            const size_t of_k = 2 * (size_t)k + (size_t)a, of_l = 2 * (size_t)l + (size_t)b;
            if (d->body[of_k] < 0 || d->body[of_k] != d->body[of_l]) continue;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    block[3 * i + j] += product(d->response + 18 * of_k + 6 * i, d->J + 18 * of_l + 6 * j);
        }
}

void delassus_velocities(const struct delassus *d, const double *f, const double *r, double *v)
{
    memcpy(v, f, 6 * (size_t)d->bodies * sizeof *v);
    for (size_t at = 0; at < 2 * (size_t)d->contacts; ++at)
        for (int row = 0; d->body[at] >= 0 && row < 3; ++row)
            for (int k = 0; k < 6; ++k)
                v[6 * (size_t)d->body[at] + (size_t)k] +=
                    d->J[18 * at + (size_t)(6 * row + k)] * r[3 * (at / 2) + (size_t)row];
    for (int32_t i = 0; i < d->bodies; ++i)
        dense6_solve(d->factor + 36 * (size_t)i, v + 6 * (size_t)i, v + 6 * (size_t)i);
}
