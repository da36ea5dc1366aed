#include "motion_measure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bench.h"
#include "core/base/memory.h"

const double motion_least = 1e-3;

/* ---- a world's frames ------------------------------------------------------------------------------------------ */

sadmm_status motion_measure_frame(struct motion_measure *m, const struct motion_world *w, int frame, int frames)
{
    if (!overlaps_find(&m->overlaps, w->solids, w->shape_count)) return sadmm_fail_memory(w->error, "the overlaps");
    for (size_t k = 0; k < m->overlaps.count; ++k) {
        const struct overlap *pair = &m->overlaps.pairs[k];
        const double a = solid_thickness(&w->solids[pair->a]), b = solid_thickness(&w->solids[pair->b]);
        depth_count(&m->depths, pair->depth, fmin(a, b));
    }
    ++m->frames;
    for (int k = 0; k < COURSE_POINTS; ++k) {
        if (frame != (int)((int64_t)frames * (k + 1) / COURSE_POINTS)) continue;
        const struct motion_moments now = motion_world_moments(w);
        m->course[k].height += now.height;
        m->course[k].spread += now.spread;
        m->course[k].kinetic += now.kinetic;
        ++m->runs[k];
    }
    return SADMM_OK;
}

void motion_measure_free(struct motion_measure *m) { overlaps_free(&m->overlaps); }

/* ---- tracks ---------------------------------------------------------------------------------------------------- */

struct motion_error motion_error_none(void) { return (struct motion_error){NAN, NAN}; }

sadmm_status track_create(struct track *track, const struct motion_world *w)
{
    const size_t bodies = (size_t)w->body_count, starts = (size_t)track->runs * bodies;
    track->body_count = w->body_count;
    track->bodies = sadmm_alloc(bodies, sizeof *track->bodies);
    track->start = sadmm_alloc(starts, sizeof *track->start);
    track->states = sadmm_alloc(starts * (size_t)track->points, sizeof *track->states);
    if (!track->bodies || !track->start || !track->states) return sadmm_fail_memory(w->error, "a trajectory");
    memcpy(track->bodies, w->bodies, bodies * sizeof *w->bodies);
    return SADMM_OK;
}

void track_free(struct track *track)
{
    sadmm_free(track->bodies);
    sadmm_free(track->start);
    sadmm_free(track->states);
    *track = (struct track){0};
}

sadmm_body_state *track_states(const struct track *track, int run, int point)
{
    return track->states + ((size_t)run * (size_t)track->points + (size_t)point) * (size_t)track->body_count;
}

/* Of a body at any point of a run: from where the other run has it then, or from one state. */
static double largest_distance(const struct track *track, int run, int body, const struct track *other,
                               const sadmm_body_state *state)
{
    double largest = 0;
    for (int point = 0; point < track->points; ++point) {
        const sadmm_body_state *a = &track_states(track, run, point)[body];
        const sadmm_body_state *b = state ? state : &track_states(other, run, point)[body];
        largest = fmax(largest, pose_distance(&track->bodies[body], a, b));
    }
    return largest;
}

sadmm_status track_compare(const struct track *track, const struct track *reference, struct motion_error *out,
                           struct sadmm_error *error)
{
    const size_t bodies = (size_t)track->body_count;
    size_t count = 0;
    *out = motion_error_none();
    double *distances = sadmm_alloc((size_t)track->runs * bodies, sizeof *distances);
    if (!distances) return sadmm_fail_memory(error, "the distances");
    for (int run = 0; run < track->runs; ++run)
        for (size_t i = 0; i < bodies; ++i) {
            const double distance = largest_distance(track, run, (int)i, reference, NULL);
            const sadmm_body_state *start = &reference->start[(size_t)run * bodies + i];
            out->largest = fmax(out->largest, distance);
            if (largest_distance(reference, run, (int)i, NULL, start) > motion_least) distances[count++] = distance;
        }
    qsort(distances, count, sizeof *distances, bench_compare_doubles);
    if (count > 0) out->median = 0.5 * (distances[(count - 1) / 2] + distances[count / 2]);
    sadmm_free(distances);
    return SADMM_OK;
}
