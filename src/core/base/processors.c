#define _GNU_SOURCE /* sched_getaffinity */
#include "processors.h"

#include <pthread.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifdef _OPENMP
#include <omp.h>
#endif

enum { MOST_PATH = 4096 };

/* The first line of a file of a control group; false: there is no such file. */
static bool read_line(const char *root, const char *controller, const char *group, const char *name, char line[128])
{
    char path[MOST_PATH + 512];
    const int length = snprintf(path, sizeof path, "%s%s%s/%s", root, controller, group, name);
    FILE *file = length > 0 && length < (int)sizeof path ? fopen(path, "r") : NULL;
    if (!file) return false;
    const bool read = fgets(line, 128, file) != NULL;
    fclose(file);
    return read;
}

/* Version 2: "QUOTA PERIOD", or "max PERIOD". */
static double quota_of_v2(const char *root, const char *group)
{
    char line[128];
    long long quota, period;
    if (!read_line(root, "", group, "cpu.max", line) || sscanf(line, "%lld %lld", &quota, &period) != 2) return 0;
    return quota > 0 && period > 0 ? (double)quota / (double)period : 0;
}

/* Version 1: two files, the quota -1 where there is none. */
static double quota_of_v1(const char *root, const char *group)
{
    char quota[128], period[128];
    if (!read_line(root, "/cpu", group, "cpu.cfs_quota_us", quota) ||
        !read_line(root, "/cpu", group, "cpu.cfs_period_us", period))
        return 0;
    const double microseconds = atof(quota), of = atof(period);
    return microseconds > 0 && of > 0 ? microseconds / of : 0;
}

static bool has_word(const char *list, const char *word)
{
    const size_t length = strlen(word);
    for (const char *at = list; at; at = strchr(at, ',')) {
        at += *at == ',';
        if (strncmp(at, word, length) == 0 && (at[length] == 0 || at[length] == ',')) return true;
    }
    return false;
}

/* The least quota of a group and of those above it. In a container a path may begin outside of what can be seen: then
 * the root's is left. */
static double least_quota(const char *root, char *group, double (*quota_of)(const char *, const char *))
{
    double least = 0;
    for (;;) {
        const double quota = quota_of(root, group);
        if (quota > 0 && (least == 0 || quota < least)) least = quota;
        char *slash = strrchr(group, '/');
        if (!slash) return least;
        *slash = 0;
    }
}

int sadmm_processor_quota(const char *groups, const char *root)
{
    char line[MOST_PATH];
    double least = 0;
    FILE *file = fopen(groups, "r");
    if (!file) return 0;
    while (fgets(line, sizeof line, file)) { /* NUMBER:CONTROLLERS:PATH; version 2 has no controllers */
        char *controllers = strchr(line, ':'), *group = controllers ? strchr(controllers + 1, ':') : NULL;
        if (!group) continue;
        *controllers++ = 0;
        *group++ = 0;
        group[strcspn(group, "\n")] = 0;
        double quota = 0;
        if (*controllers == 0) quota = least_quota(root, group, quota_of_v2);
        else if (has_word(controllers, "cpu")) quota = least_quota(root, group, quota_of_v1);
        if (quota > 0 && (least == 0 || quota < least)) least = quota;
    }
    fclose(file);
    if (least == 0) return 0;
    return least < 1 ? 1 : least < 1e6 ? (int)least : 1000000;
}

static pthread_once_t once = PTHREAD_ONCE_INIT;
static int processors = 1;

static void look_up(void)
{
#ifdef _OPENMP
    processors = omp_get_num_procs(); /* also where OpenMP has bound the calling thread to one of its places */
#else
    const long online = sysconf(_SC_NPROCESSORS_ONLN);
    processors = online > 1 && online < 1 << 20 ? (int)online : 1;
#ifdef __linux__
    cpu_set_t allowed; /* of up to 1,024 processors; larger machines answer with an error */
    if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) processors = CPU_COUNT(&allowed);
#endif
#endif
#ifdef __linux__
    const int quota = sadmm_processor_quota("/proc/self/cgroup", "/sys/fs/cgroup");
    if (quota > 0 && quota < processors) processors = quota;
#endif
}

int sadmm_processors(void)
{
    pthread_once(&once, look_up);
    return processors;
}
