/* The entries of contact finding on the device, in C: COLLISION(name) is set by the includer. */
#ifdef __cplusplus
extern "C" {
#endif

/* A pipeline on a device. UNAVAILABLE without a device. */
sadmm_status COLLISION(create)(int device, struct sadmm_cuda_collision **out, struct sadmm_error *error);
/* Nothing of the pipeline may be running any more. NULL is fine. */
void COLLISION(destroy)(struct sadmm_cuda_collision *collision);

/* Replace the current set by one of the host's. `set` is free again when this returns. */
sadmm_status COLLISION(upload)(struct sadmm_cuda_collision *collision, void *stream,
                               const struct sadmm_contact_set *set, struct sadmm_error *error);

/* Find all contacts: the same set, in the same order, with the same impulses and caches as sadmm_collision_find. The
 * current set is the previous step's on entry and the new one on success; after a failure it is what it was. Waits
 * for the stream once at the end, or once more for every time that room has to grow. */
sadmm_status COLLISION(find)(struct sadmm_cuda_collision *collision, void *stream,
                             const struct sadmm_collision_input *input, struct sadmm_cuda_contacts *out,
                             struct sadmm_error *error);

/* The current set, copied to the host, as it is once the work on the stream is done. `contacts` is unchanged (but for
 * its room) after a failure. */
sadmm_status COLLISION(download)(struct sadmm_cuda_collision *collision, void *stream,
                                 struct sadmm_contact_set *contacts, struct sadmm_error *error);

/* Put back the set that the last successful find replaced. Does nothing when the last find failed or was undone. */
void COLLISION(undo)(struct sadmm_cuda_collision *collision);

struct sadmm_cuda_collision_stats COLLISION(stats)(const struct sadmm_cuda_collision *collision);
/* From the next find on. */
void COLLISION(tune)(struct sadmm_cuda_collision *collision, const struct sadmm_cuda_collision_tuning *tuning);

#ifdef __cplusplus
}
#endif
