/* The entries of contact finding on the device, in C: COLLISION(name) is set by the includer. */
struct cuda_gravities; /* device/gravity.h */

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
 * for the stream once at the end, or once more for every time that a capacity has to grow. */
sadmm_status COLLISION(find)(struct sadmm_cuda_collision *collision, void *stream,
                             const struct sadmm_collision_input *input, struct sadmm_cuda_contacts *out,
                             struct sadmm_error *error);

/* The current set, copied to the host, as it is once the work on the stream is done. `contacts` is unchanged (but for
 * its capacity) after a failure. */
sadmm_status COLLISION(download)(struct sadmm_cuda_collision *collision, void *stream,
                                 struct sadmm_contact_set *contacts, struct sadmm_error *error);

/* Which pairs of the current set touch: one entry each, in the set's order, for which there is room. */
sadmm_status COLLISION(touching)(struct sadmm_cuda_collision *collision, void *stream,
                                 struct sadmm_touching_shapes *touching, struct sadmm_error *error);

/* ---- for steps that are enqueued: no host in between ---- */

/* Take what a find takes from the host, once; `bodies` (by body slot) will be on the device, written before each
 * enqueued find, and are as input->bodies now. `abort_code`, on the device: while it is not 0, enqueued finds do
 * nothing; sub-steps set it to ABORT_REACH (device/layout.h) where a shape leaves what the first one foresaw. `dt` and
 * `gravity`, on the device: in the place of the input's.
 * Everything enqueued earlier must be done. The current set stays. */
sadmm_status COLLISION(attach)(struct sadmm_cuda_collision *collision, void *stream,
                               const struct sadmm_collision_input *input, const struct sadmm_collision_body *bodies,
                               int32_t *abort_code, const double *dt, const double *gravity,
                               struct sadmm_error *error);
/* Gravity of environments, each its own: in the place of that. After attach, which takes it away. */
void COLLISION(use_gravities)(struct sadmm_cuda_collision *collision, const struct cuda_gravities *gravities);
/* The shapes on the device, by slot, to set materials there; the next input is taken whole. */
struct sadmm_shape *COLLISION(shapes_to_set)(struct sadmm_cuda_collision *collision);
/* Capacity for so many candidates and points in both sets, or all three where a step has sub-steps; they keep what they
 * hold. 0: what a scene of this size is likely to need. Everything enqueued must be done. *candidates and *points: the
 * capacities now, at least as much. */
sadmm_status COLLISION(reserve)(struct sadmm_cuda_collision *collision, bool substeps, int64_t *candidates,
                                int64_t *points, struct sadmm_error *error);
/* Launches alone, so that a graph may record them: find contacts. The
 * counts say afterwards whether everything fitted (nothing is written to the set when not). */
sadmm_status COLLISION(enqueue)(struct sadmm_cuda_collision *collision, void *stream,
                                const struct sadmm_cuda_find *find, struct sadmm_error *error);
/* What hits of bodies in flight are to know of the world; held: by body slot, not 0: joints hold the body. After
 * attach, with its input. */
sadmm_status COLLISION(load_hits)(struct sadmm_cuda_collision *collision, const struct sadmm_collision_input *input,
                                  const unsigned char *held, struct sadmm_error *error);
/* Can they be taken in it? */
bool COLLISION(takes_hits)(const struct sadmm_cuda_collision *collision);
/* They are to be. After reserve. */
sadmm_status COLLISION(reserve_hits)(struct sadmm_cuda_collision *collision, struct sadmm_error *error);
/* Launches alone, before those of enqueue for the same find, which has `hits`: candidates, and the step's hits. */
sadmm_status COLLISION(enqueue_hits)(struct sadmm_cuda_collision *collision, void *stream,
                                     const struct sadmm_cuda_find *find, struct sadmm_error *error);
/* And once wrenches have been recovered: what hits give. */
sadmm_status COLLISION(give_hits)(struct sadmm_cuda_collision *collision, void *stream,
                                  const struct sadmm_cuda_hits *step, struct sadmm_error *error);
/* The hits of the step that ended in `into`, if there is room for them; *first: of its last sub-step. */
sadmm_status COLLISION(read_hits)(struct sadmm_cuda_collision *collision, void *stream, int into,
                                  struct sadmm_world_hit *out, size_t capacity, size_t *count, size_t *first,
                                  struct sadmm_error *error);
/* A set's pointers; counts are not filled. */
struct sadmm_cuda_contacts COLLISION(set)(const struct sadmm_cuda_collision *collision, int which);
/* Which set is the current one, and with how much in it, after enqueued finds. */
void COLLISION(set_current)(struct sadmm_cuda_collision *collision, int current,
                            struct sadmm_cuda_contact_counts counts);
int COLLISION(current)(const struct sadmm_cuda_collision *collision);

/* Put back the set that the last successful find replaced. Does nothing when the last find failed or was undone. */
void COLLISION(undo)(struct sadmm_cuda_collision *collision);

/* Contacts of worlds of many equal ones (core/solve/resident.h): worlds with a state begin with its contacts. The
 * current set; `states`, on the device: a world each, NULL: its contacts stay; *counts: pairs and points of all of
 * these, and then what the set has. *fits: false: there is no room, and nothing is done. Waits. */
sadmm_status COLLISION(put_contacts)(struct sadmm_cuda_collision *collision, void *stream,
                                     const struct sadmm_resident_copies *copies,
                                     const struct cuda_kept_state *const *states,
                                     struct sadmm_cuda_contact_counts *counts, bool *fits, struct sadmm_error *error);

size_t COLLISION(memory)(const struct sadmm_cuda_collision *collision); /* bytes of the device */
struct sadmm_cuda_collision_stats COLLISION(stats)(const struct sadmm_cuda_collision *collision);
/* From the next find on. */
void COLLISION(tune)(struct sadmm_cuda_collision *collision, const struct sadmm_cuda_collision_tuning *tuning);

#ifdef __cplusplus
}
#endif
