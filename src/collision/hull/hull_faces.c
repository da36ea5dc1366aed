/* What qhull is asked, and how it is kept from talking to anyone but us: messages go into a buffer that nobody reads,
 * and errors come back by longjmp. Nothing of ours is on the stack between here and there that would have to be freed.
 */
#include "hull_faces.h"

#include <math.h>
#include <setjmp.h>
#include <stdio.h>

#include <libqhull_r/qhull_ra.h>

#include "core/base/memory.h"

enum { MESSAGES = 4096, COMMAND = 64 };

struct job {
    qhT qh;
    char command[COMMAND], messages[MESSAGES];
    double *points;
    int32_t count, most;
    struct hull_mesh *mesh;
    int32_t *corners; /* of a face; room for all points */
    bool without_memory, too_many;
};

/* Numbers in commands are read by the locale's rules: no decimal point. TA: corners at most, and nothing is joined. */
static void write_command(struct job *job, double flat)
{
    const long long centrum = llround(flat * 1e15);
    if (job->most > 0) snprintf(job->command, sizeof job->command, "qhull Pp TA%d", (int)job->most);
    else if (centrum > 0) snprintf(job->command, sizeof job->command, "qhull Pp C%llde-15", centrum);
    else snprintf(job->command, sizeof job->command, "qhull Pp");
}

/* The corners of a face. qhull has them clockwise seen from outside, unless it is built otherwise (qh_ORIENTclock). */
static bool add_face(struct job *job, facetT *facet)
{
    setT *vertices = qh_facet3vertex(&job->qh, facet);
    vertexT *vertex, **vertexp;
    const int32_t count = qh_setsize(&job->qh, vertices);
    int32_t k = 0;
    if (!SADMM_GROW(job->corners, 0, (size_t)count)) return false;
    FOREACHvertex_(vertices) {
        job->corners[qh_ORIENTclock ? k : count - 1 - k] = qh_pointid(&job->qh, vertex->point);
        ++k;
    }
    qh_settempfree(&job->qh, &vertices);
    return sadmm_hull_mesh_add(job->mesh, job->corners, count);
}

/* All that may end in qh_errexit. */
static void work(struct job *job)
{
    qhT *qh = &job->qh;
    facetT *facet;
    qh->NOerrexit = False;
    qh_initflags(qh, job->command);
    qh_init_B(qh, job->points, job->count, 3, False);
    qh_qhull(qh);
    qh_prepare_output(qh);
    job->too_many = job->most > 0 && qh->num_vertices >= job->most;
    FORALLfacets {
        if (job->too_many || job->without_memory) break;
        job->without_memory = !add_face(job, facet);
    }
}

static int run(struct job *job)
{
    const int code = setjmp(job->qh.errexit);
    if (code == 0) work(job);
    job->qh.NOerrexit = True;
    return code;
}

/* What cannot be freed after an error is lost. */
static void free_all(struct job *job)
{
    qhT *qh = &job->qh;
    int count, bytes;
    if (setjmp(qh->errexit) == 0) {
        qh->NOerrexit = False;
        qh_freeqhull(qh, qh_ALL);
        qh_memfreeshort(qh, &count, &bytes);
    }
}

static enum hull_faces_are find(struct job *job)
{
    FILE *file = fmemopen(job->messages, sizeof job->messages, "w");
    if (!file) return HULL_FACES_NO_MEMORY;
    qh_init_A(&job->qh, NULL, file, file, 0, NULL);
    const int code = run(job);
    free_all(job);
    fclose(file);
    if (code == qh_ERRmem || job->without_memory) return HULL_FACES_NO_MEMORY;
    if (job->too_many) return HULL_FACES_TOO_MANY;
    return code == 0 ? HULL_FACES_FOUND : HULL_FACES_NOT_FOUND;
}

enum hull_faces_are sadmm_hull_faces_find(const double *points, int32_t count, double flat, int32_t most,
                                          struct hull_mesh *mesh)
{
    enum hull_faces_are are = HULL_FACES_NO_MEMORY;
    struct job *job = (struct job *)sadmm_alloc(1, sizeof *job);
    if (job) {
        job->points = (double *)points; /* qhull writes where it is to scale or turn them only */
        job->count = count;
        job->most = most;
        job->mesh = mesh;
        write_command(job, flat);
        are = find(job);
        sadmm_free(job->corners);
    }
    sadmm_free(job);
    return are;
}
