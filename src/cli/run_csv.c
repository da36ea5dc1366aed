#include "run_csv.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/names.h"

/* Of a body's id; scenes neither make nor remove bodies as they run. */
struct named_body {
    int32_t index;    /* among all bodies of the world, as run_body.index */
    const char *name; /* the world's */
};

struct run_csv {
    struct output *outputs[RUN_CSV_KINDS];
    sadmm_contact *contacts;
    struct named_body *bodies; /* by slot */
    size_t slots;
};

/* ---- fields ------------------------------------------------------------------------------------------------------ */

/* Nothing where it was not measured (negative). */
static void put_measured(FILE *out, double x)
{
    if (x < 0) fputc(',', out);
    else if (isnan(x)) fputs(",nan", out);
    else fprintf(out, ",%.17g", x);
}

static void put(FILE *out, const double *x, size_t count)
{
    for (size_t k = 0; k < count; ++k) fprintf(out, ",%.17g", x[k]);
}

/* Quoted where a comma, a quote or a line's end makes it necessary. */
static void put_text(FILE *out, const char *text)
{
    fputc(',', out);
    if (!strpbrk(text, ",\"\r\n")) {
        fputs(text, out);
        return;
    }
    fputc('"', out);
    for (; *text; ++text) {
        if (*text == '"') fputc('"', out);
        fputc(*text, out);
    }
    fputc('"', out);
}

static int fail_world(sadmm_world *world) { return cli_error(CLI_FAILED, "%s", sadmm_world_message(world)); }

/* ---- states ------------------------------------------------------------------------------------------------------ */

static int write_states(struct run_csv *csv, FILE *out, const struct run_record *record, sadmm_world *world)
{
    (void)csv;
    for (size_t k = 0; k < record->body_count; ++k) {
        sadmm_body_state s;
        if (sadmm_world_body_state(world, record->bodies[k].id, &s) != SADMM_OK) return fail_world(world);
        fprintf(out, "%zu,%.17g,%d", record->steps, record->last.time, record->bodies[k].index);
        put(out, s.position, 3);
        put(out, s.orientation, 4);
        put(out, s.linear_velocity, 3);
        put(out, s.angular_velocity, 3);
        fputc('\n', out);
    }
    return CLI_DONE;
}

/* ---- contacts ---------------------------------------------------------------------------------------------------- */

/* Static and kinematic bodies have contacts, too. */
static int know_bodies(struct run_csv *csv, sadmm_world *world)
{
    const int32_t count = sadmm_world_body_count(world);
    for (int32_t k = 0; k < count; ++k) {
        sadmm_body_id id;
        sadmm_body_def def;
        if (sadmm_world_body_at(world, k, &id) != SADMM_OK || sadmm_world_body_def(world, id, &def) != SADMM_OK)
            return fail_world(world);
        const size_t slots = (size_t)id.slot + 1; /* they rise from body to body */
        if (!SADMM_GROW(csv->bodies, csv->slots, slots))
            return cli_error(CLI_FAILED, "out of memory for the names of %d bodies", count);
        csv->bodies[id.slot] = (struct named_body){k, def.name ? def.name : ""};
        csv->slots = slots;
    }
    return CLI_DONE;
}

static int write_contacts(struct run_csv *csv, FILE *out, const struct run_record *record, sadmm_world *world)
{
    const int32_t count = record->steps > 0 ? sadmm_world_contact_count(world) : 0;
    if (!SADMM_GROW(csv->contacts, 0, (size_t)count))
        return cli_error(CLI_FAILED, "out of memory for %d contacts", count);
    if (count > 0 && sadmm_world_contacts(world, 0, count, csv->contacts) != SADMM_OK) return fail_world(world);
    for (int32_t k = 0; k < count; ++k) {
        const sadmm_contact *c = &csv->contacts[k];
        const struct named_body *a = &csv->bodies[c->body_a.slot], *b = &csv->bodies[c->body_b.slot];
        fprintf(out, "%zu,%.17g,%d,%d", record->steps, record->last.time, a->index, b->index);
        put_text(out, a->name);
        put_text(out, b->name);
        put(out, c->position, 3);
        put(out, c->normal, 3);
        put(out, &c->separation, 1);
        put(out, c->force, 3);
        fputc('\n', out);
    }
    return CLI_DONE;
}

/* ---- errors ------------------------------------------------------------------------------------------------------ */

static int write_error(struct run_csv *csv, FILE *out, const struct run_record *record, sadmm_world *world)
{
    const sadmm_step_report *r = &record->last;
    const sadmm_certificate *c = &r->certificate;
    const bool certified = c->ncp_max != -1;
    (void)csv, (void)world;
    if (record->steps == 0) return CLI_DONE;
    fprintf(out, "%zu,%.17g", record->steps, r->time);
    put_measured(out, r->error);
    put_text(out, r->error < 0 ? "" : sadmm_step_error_names[r->error_kind]);
    put_measured(out, c->ncp_max);
    put_measured(out, certified ? c->ncp_mean : -1);
    put_measured(out, certified ? c->momentum_max : -1);
    put_measured(out, certified ? c->siconos : -1);
    fprintf(out, ",%d", r->iterations);
    put(out, &r->iterations_mean, 1);
    if (r->unsolved < 0) fputc(',', out);
    else fprintf(out, ",%" PRId64, r->unsolved);
    fprintf(out, ",%d,%.6g\n", r->contacts, r->ms.total);
    return CLI_DONE;
}

/* ---- the files --------------------------------------------------------------------------------------------------- */

static const struct {
    const char *option, *what, *header;
    int (*write)(struct run_csv *csv, FILE *out, const struct run_record *record, sadmm_world *world);
} kinds[RUN_CSV_KINDS] = {
    [RUN_CSV_TRACE] = {"--trace", "trace", "step,time,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n", write_states},
    [RUN_CSV_CONTACTS] = {"--contacts-csv", "contacts",
                          "step,time,body_a,body_b,name_a,name_b,px,py,pz,nx,ny,nz,gap,fx,fy,fz\n", write_contacts},
    [RUN_CSV_ERROR] = {"--error-csv", "errors",
                       "step,time,error,error_kind,ncp_max,ncp_mean,momentum_max,siconos,iterations,iterations_mean,"
                       "unsolved,contacts,step_ms\n",
                       write_error},
};

int run_csv_open(const char *const names[RUN_CSV_KINDS], struct run_csv **csv)
{
    int code = CLI_DONE;
    *csv = sadmm_alloc(1, sizeof **csv);
    if (!*csv) return cli_error(CLI_FAILED, "out of memory");
    for (int k = 0; k < RUN_CSV_KINDS && code == CLI_DONE; ++k)
        if (names[k]) code = output_open(kinds[k].option, names[k], OUTPUT_STREAM, &(*csv)->outputs[k]);
    return code;
}

int run_csv_begin(struct run_csv *csv, struct run_record *record, sadmm_world *world)
{
    for (int k = 0; k < RUN_CSV_KINDS; ++k)
        if (csv->outputs[k]) fputs(kinds[k].header, output_stream(csv->outputs[k]));
    const int code = csv->outputs[RUN_CSV_CONTACTS] ? know_bodies(csv, world) : CLI_DONE;
    return code == CLI_DONE ? run_csv_step(csv, record, world) : code;
}

int run_csv_step(struct run_csv *csv, struct run_record *record, sadmm_world *world)
{
    int code = CLI_DONE;
    for (int k = 0; k < RUN_CSV_KINDS && code == CLI_DONE; ++k) {
        if (!csv->outputs[k]) continue;
        FILE *const out = output_stream(csv->outputs[k]);
        code = kinds[k].write(csv, out, record, world);
        if (code != CLI_DONE || !ferror(out)) continue;
        code = CLI_FAILED;
        snprintf(record->failure, sizeof record->failure, "step %zu: the %s could not be written", record->steps,
                 kinds[k].what);
    }
    return code;
}

int run_csv_close(struct run_csv *csv)
{
    int code = CLI_DONE;
    for (int k = 0; k < RUN_CSV_KINDS; ++k) {
        const int closed = output_close(csv->outputs[k]);
        csv->outputs[k] = NULL;
        if (code == CLI_DONE) code = closed;
    }
    return code;
}

void run_csv_free(struct run_csv *csv)
{
    if (!csv) return;
    sadmm_free(csv->contacts);
    sadmm_free(csv->bodies);
    sadmm_free(csv);
}
