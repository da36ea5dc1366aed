/* What begins and ends between shapes: contacts, and overlaps with sensors.
 *
 * A world records events on request. Every step then compares the pairs of shapes that touch with those of the step
 * before, and queues the changes until they are taken:
 *
 *     sadmm_world_record_events(world, 4096);
 *     for (;;) {
 *         sadmm_world_step(world);
 *         sadmm_world_take_events(world, 256, events, &count, NULL);
 *     }
 *
 * Two shapes touch in a step if one of their contact points carries an impulse, or has a separation <= 0 (speculative
 * contact points have neither). With sub-steps: in the last one.
 *
 * A sensor is a shape without contacts (sadmm_shape_def.sensor). It reports the shapes that overlap it after the step:
 * those on other bodies that would collide with it if it were not a sensor (environment, category and mask, pairs of
 * bodies without contact, bodies connected by joints) and are not sensors themselves. Sensors of static bodies detect
 * dynamic and kinematic bodies, those of other bodies detect all.
 *
 * Order: by step; in a step contacts before sensors; then by the slots of a and b; ended before begun. Events do not
 * depend on threads, and are the same on all backends where their steps are.
 *
 * Cost: steps that record events are waited for (sadmm_world_step_async). On CUDA the device lists the pairs that
 * touch, and all contacts are read back when a contact has begun; reports do not include that time. With sensors,
 * bodies are read back too, and the tree of the queries is updated (query.h). Without recording, events and sensors
 * cost nothing.
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
    int64_t step;                    /* the step that made it: sadmm_step_report.step after it */
    sadmm_event_type type;
    sadmm_shape_id shape_a, shape_b; /* contacts: as in sadmm_contact; sensors: a is the sensor. After a removal the ids
                                        are stale */
    sadmm_body_id body_a, body_b;    /* the bodies of the shapes */
    double position[3];              /* CONTACT_BEGUN: the point with the largest normal impulse (the deepest of equal
                                        ones), as in sadmm_contact, m, world; else 0 */
    double normal[3];                /* CONTACT_BEGUN: at that point, unit, world, from a to b; else 0 */
    double speed;                    /* CONTACT_BEGUN: approach speed at that point before the step, m/s; else 0 */
    double impulse[3];               /* CONTACT_BEGUN: sum over all contact points of the two shapes in the step (with
                                        sub-steps: in the last one), on b, world, N s; else 0. An impact without
                                        restitution takes two steps: in the first the bodies just reach each other's
                                        surface, the second stops them */
} sadmm_event;

/* Record events from the next step on, and keep up to `capacity` of them until they are taken; if there are more, the
 * oldest are dropped. 0: stop recording. Earlier events are dropped, and pairs that touch in the first recorded step
 * begin in it, so that every end has a begin. Recording goes on after sadmm_world_restore, and starts anew in the same
 * way. capacity: in [0, 2^24]; the memory is allocated here, about 150 bytes each. Errors: INVALID_ARGUMENT (range;
 * nothing changes), OUT_OF_MEMORY (nothing changes). A device that fails while events are read after a step makes that
 * step return DEVICE, as one that fails in it does (world.h). */
SADMM_API sadmm_status sadmm_world_record_events(sadmm_world *world, int32_t capacity);
/* The capacity that was set; 0 for NULL. */
SADMM_API int32_t sadmm_world_event_capacity(const sadmm_world *world);
/* Number of events that can be taken; 0 for NULL. Never has to wait: steps that record are done when they return. */
SADMM_API int32_t sadmm_world_event_count(const sadmm_world *world);
/* Take up to `capacity` events out of the queue, the oldest first; *count: how many. *dropped (may be NULL): how many
 * were lost since the last call because the queue was full. If memory runs out while pairs are compared, the step is
 * done and its events come with a later one. capacity: >= 0; events may be NULL where it is
 * 0. Errors: INVALID_ARGUMENT. */
SADMM_API sadmm_status sadmm_world_take_events(sadmm_world *world, int32_t capacity, sadmm_event *events,
                                               int32_t *count, int64_t *dropped);

/* The shapes that overlap a sensor now (see above), recorded or not. Writes their ids in the order of their slots: the
 * first `capacity` of them, or less if there are less; *count: how many there are. sensor: a shape whose definition has
 * `sensor`. capacity: >= 0; shapes may be NULL where it is 0. A query like those of query.h, with their errors and:
 * STALE_ID, INVALID_ARGUMENT (no sensor). */
SADMM_API sadmm_status sadmm_world_sensor_overlaps(sadmm_world *world, sadmm_shape_id sensor, int32_t capacity,
                                                   sadmm_shape_id *shapes, int32_t *count);

#ifdef __cplusplus
}
#endif
#endif
