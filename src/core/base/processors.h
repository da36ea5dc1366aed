/* How many processors there are for this process. */
#ifndef SADMM_CORE_PROCESSORS_H
#define SADMM_CORE_PROCESSORS_H

#ifdef __cplusplus
extern "C" {
#endif

/* Those that its affinity allows, at most as many as the quotas of its control groups pay for. At least 1; looked up
 * once in a process. */
int sadmm_processors(void);

/* The least quota of the control groups that the file `groups` names (as /proc/self/cgroup does) and of those above
 * them, in whole processors, at least 1: a fraction would be paid for by pauses. 0: there is none. `root`: the folder
 * of the control groups, /sys/fs/cgroup. */
int sadmm_processor_quota(const char *groups, const char *root);

#ifdef __cplusplus
}
#endif
#endif
