/* Contacts of environments that are recorded. */
#include "environment_contacts.h"

#include "core/base/check.h"
#include "core/base/memory.h"
#include "environment_checks.h"
#include "environment_merge.h"

sadmm_status sadmm_environments_keep_contacts(struct sadmm_environments *environments,
                                              struct sadmm_environment_worker *worker, int32_t environment)
{
    if (!environments->contacts) return SADMM_OK;
    struct sadmm_environment_contacts *kept = &environments->contacts[environment];
    const int32_t count = sadmm_world_contact_count(worker->world);
    kept->count = 0;
    if (count == 0) return SADMM_OK;
    if (!SADMM_GROW(kept->list, 0, (size_t)count)) return sadmm_fail_memory(&worker->world->error, "contacts");
    TRY(sadmm_world_contacts(worker->world, 0, count, kept->list));
    kept->count = count;
    return SADMM_OK;
}

/* Those of all environments, in the order of the merged world, and hits at the end. */
sadmm_status sadmm_environments_keep_merged_contacts(struct sadmm_environments *environments)
{
    struct sadmm_environment_worker *worker = &environments->worker[0];
    sadmm_world *world = environments->merged.world;
    if (!environments->contacts) return SADMM_OK;
    const int32_t count = sadmm_world_contact_count(world);
    if (!SADMM_GROW(worker->contacts, 0, (size_t)count)) return sadmm_fail_memory(&environments->error, "contacts");
    const sadmm_status status = count > 0 ? sadmm_world_contacts(world, 0, count, worker->contacts) : SADMM_OK;
    if (status != SADMM_OK) return sadmm_fail(&environments->error, status, "%s", world->error.message);
    for (int32_t e = 0; e < environments->count; ++e)
        if (!environments->marked[e]) environments->contacts[e].count = 0;
    for (int32_t k = 0; k < count; ++k) {
        int32_t environment;
        sadmm_environments_rename_contact(environments, &worker->contacts[k], &environment);
        struct sadmm_environment_contacts *kept = &environments->contacts[environment];
        const size_t at = (size_t)kept->count;
        if (environments->marked[environment]) continue;
        if (!SADMM_GROW(kept->list, at, at + 1)) return sadmm_fail_memory(&environments->error, "contacts");
        kept->list[kept->count++] = worker->contacts[k];
    }
    return SADMM_OK;
}

void sadmm_environments_forget_contacts(struct sadmm_environments *environments, const int32_t *which, int32_t count)
{
    for (int32_t k = 0; environments->contacts && k < count; ++k)
        environments->contacts[which ? which[k] : k].count = 0;
}

sadmm_status sadmm_environments_record_contacts(sadmm_environments *environments, bool record)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    if (record == (environments->contacts != NULL)) return SADMM_OK;
    if (!record) {
        sadmm_environments_free_contacts(environments);
        return SADMM_OK;
    }
    environments->contacts =
        (struct sadmm_environment_contacts *)sadmm_alloc((size_t)environments->count, sizeof *environments->contacts);
    return environments->contacts ? SADMM_OK : sadmm_fail_memory(&environments->error, "contacts of environments");
}

void sadmm_environments_free_contacts(struct sadmm_environments *environments)
{
    for (int32_t e = 0; environments->contacts && e < environments->count; ++e)
        sadmm_free(environments->contacts[e].list);
    sadmm_free(environments->contacts);
    environments->contacts = NULL;
}

sadmm_status sadmm_environments_contacts(sadmm_environments *environments, int32_t environment,
                                         const sadmm_contact **contacts, int32_t *count)
{
    TRY(sadmm_check_given(environments, "environments", NULL));
    struct sadmm_error *error = &environments->error;
    TRY(sadmm_check_given(contacts, "contacts", error));
    TRY(sadmm_check_given(count, "count", error));
    TRY(sadmm_environments_check(environments, "environment", environment));
    if (!environments->contacts) return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE, "contacts: are not recorded");
    *contacts = environments->contacts[environment].list;
    *count = environments->contacts[environment].count;
    return SADMM_OK;
}
