/* One number of all states: two worlds that have it alike are alike, bit for bit. */
#include <string.h>

#include "core/base/check.h"
#include "world/resident/resident.h"

/* FNV-1a over the bit patterns. */
static uint64_t hash_doubles(uint64_t hash, const double *x, int count)
{
    for (int k = 0; k < count; ++k) {
        uint64_t bits;
        memcpy(&bits, &x[k], sizeof bits);
        for (int byte = 0; byte < 8; ++byte) {
            hash ^= bits >> (8 * byte) & 0xff;
            hash *= UINT64_C(0x100000001b3);
        }
    }
    return hash;
}

sadmm_status sadmm_world_state_hash(sadmm_world *world, uint64_t *out)
{
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    TRY(sadmm_check_given(world, "world", NULL));
    TRY(sadmm_check_given(out, "hash", &world->error));
    TRY(sadmm_world_download_bodies(world));
    for (SADMM_OBJECTS(slot, &world->body_ids)) {
        const struct sadmm_world_body *body = &world->bodies[slot];
        hash = hash_doubles(hash, body->rigid.position, 3);
        hash = hash_doubles(hash, body->rigid.orientation, 4);
        hash = hash_doubles(hash, body->rigid.velocity, 6);
    }
    *out = hash;
    return SADMM_OK;
}
