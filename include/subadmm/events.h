/* What begins and ends between shapes: contacts, and overlaps with sensors.
 *
 * A world records events on request. Each step that is made then compares which pairs of shapes touch with the step
 * before, and keeps what has changed until it is taken:
 *
 *     sadmm_world_record_events(world, 4096);
 *     for (;;) {
 *         sadmm_world_step(world);
 *         sadmm_world_take_events(world, 256, events, &count, NULL);
 *     }
 *
 * Two shapes touch in a step if one of their contact points carries an impulse, or has a gap <= 0 (sadmm_contact: a
 * point that is only foreseen does neither). With sub-steps: in the last one.
 *
 * A sensor is a shape that touches nothing (sadmm_shape_def.sensor). It reports which shapes overlap it where the step
 * has left them: those that would meet it if it were no sensor (environment, category and mask, pairs of bodies without
 * contact, bodies that joints keep from meeting), that are on another body, and are no sensors themselves. Static
 * bodies' sensors see dynamic and kinematic bodies, those of the others see all.
 *
 * Order: by step; in a step contacts first, then sensors; of either by the slots of a, then of b, and what ended before
 * what begun. Events are the same on all backends as far as their steps are, and do not depend on threads.
 *
 * Price: a step with events recorded is waited for (sadmm_world_step_async). On CUDA the device then reports which
 * pairs touch, and all contacts are read where something has begun; that time is in no report. With sensors, bodies are
 * read too, and the tree that queries use follows them (query.h). Worlds that record nothing pay nothing; a sensor that
 * nobody asks about costs nothing.
 *
 * Threads: as in world.h, a world is used by one thread at a time.
 */
#ifndef SUBADMM_EVENTS_H
#define SUBADMM_EVENTS_H

#include "world.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum sadmm_event_type {
    SADMM_EVENT_CONTACT_BEGUN = 0,
    SADMM_EVENT_CONTACT_ENDED, /* they touch no longer, or one of them has been removed */
    SADMM_EVENT_SENSOR_BEGUN,
    SADMM_EVENT_SENSOR_ENDED,
    SADMM_EVENT_TYPE_COUNT
} sadmm_event_type;

typedef struct sadmm_event {
    int64_t step;                    /* that it came with: sadmm_step_report.step after it */
    sadmm_event_type type;
    sadmm_shape_id shape_a, shape_b; /* contacts: as in sadmm_contact; sensors: a is the sensor. After a removal they are
                                        ids of what is there no more */
    sadmm_body_id body_a, body_b;    /* that have, or had, these */
    double position[3];              /* CONTACT_BEGUN: of the point with the largest normal impulse, of equal ones the
                                        deepest, as in sadmm_contact, m, world; else 0 */
    double normal[3];                /* CONTACT_BEGUN: there, unit, world, from a to b; else 0 */
    double speed;                    /* CONTACT_BEGUN: at which the surfaces came closer there before the step, m/s: how
                                        hard they hit; else 0 */
    double impulse[3];               /* CONTACT_BEGUN: sum over all points of the two shapes, on b, world, N s, of the step
                                        (with sub-steps: of the last one); else 0. What does not bounce is stopped by this
                                        step and the next: in this one it still comes as far as the surface */
} sadmm_event;

/* Record events from the next step on, and keep up to `capacity` of them until they are taken; where more come the
 * oldest are dropped. 0: record no more. What was recorded before is dropped, and what touches in the first step
 * recorded has begun in it, so that every end has had its begin. After sadmm_world_restore recording goes on, and
 * begins anew in the same way. capacity: in [0, 2^24]; memory for it is taken here, about 150 bytes each. Errors:
 * INVALID_ARGUMENT (range; nothing changes), OUT_OF_MEMORY (nothing changes). A device that fails while events are read
 * after a step makes that step return DEVICE, as one that fails in it does (world.h). */
SADMM_API sadmm_status sadmm_world_record_events(sadmm_world *world, int32_t capacity);
/* As it was given; of NULL: 0. */
SADMM_API int32_t sadmm_world_event_capacity(const sadmm_world *world);
/* Events that wait to be taken; of NULL: 0. Waits for no step: those that record are done when they return. */
SADMM_API int32_t sadmm_world_event_count(const sadmm_world *world);
/* Take events out, the oldest first: at most `capacity` of them; *count: how many. *dropped (NULL: not asked for): how
 * many have been lost since they were taken last, because more came than are kept. Where memory for the comparison runs
 * out, a step is made all the same and its events come with a later one. capacity: >= 0; events may be NULL where it is
 * 0. Errors: INVALID_ARGUMENT. */
SADMM_API sadmm_status sadmm_world_take_events(sadmm_world *world, int32_t capacity, sadmm_event *events,
                                               int32_t *count, int64_t *dropped);

/* The shapes that overlap a sensor now (see above), recorded or not. Writes their ids in the order of their slots: the
 * first `capacity` of them, or less if there are less; *count: how many there are. sensor: a shape whose definition has
 * `sensor`. capacity: >= 0; shapes may be NULL where it is 0. A query as those of query.h, with their errors and:
 * STALE_ID, INVALID_ARGUMENT (no sensor). */
SADMM_API sadmm_status sadmm_world_sensor_overlaps(sadmm_world *world, sadmm_shape_id sensor, int32_t capacity,
                                                   sadmm_shape_id *shapes, int32_t *count);

#ifdef __cplusplus
}
#endif
#endif
