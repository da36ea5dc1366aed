/* Runs a fuzzer where there is no libFuzzer: over the files of the folders and files named, and over RUNS inputs of
 * its own making, the same ones everywhere. So every compiler's build runs the fuzzers a little, as ordinary tests.
 *
 * usage: fuzz_X [RUNS] [FILE|FOLDER]...
 */
#include <dirent.h>
#include <string.h>
#include <sys/stat.h>

#include "bytes.h"

enum { LONGEST = 4096 };

static unsigned inputs;

static void run_file(const char *path)
{
    static uint8_t data[1 << 20];
    FILE *file = fopen(path, "rb");
    MUST(file, "%s", path);
    size_t size = fread(data, 1, sizeof data, file);
    fclose(file);
    uint8_t *exact = malloc(size ? size : 1); /* so that the address sanitizer sees a read past the end */
    MUST(exact, "memory");
    memcpy(exact, data, size);
    LLVMFuzzerTestOneInput(exact, size);
    free(exact);
    ++inputs;
}

static void run_path(const char *path)
{
    char name[1024];
    struct dirent *entry;
    DIR *folder = opendir(path);
    if (!folder) {
        run_file(path);
        return;
    }
    while ((entry = readdir(folder)))
        if (entry->d_name[0] != '.' && snprintf(name, sizeof name, "%s/%s", path, entry->d_name) < (int)sizeof name)
            run_file(name);
    closedir(folder);
}

static uint64_t next(uint64_t *state) /* splitmix64 */
{
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

static void run_own(long runs)
{
    static uint8_t data[LONGEST];
    uint64_t state = 1;
    for (long run = 0; run < runs; ++run) {
        size_t size = (size_t)(next(&state) % LONGEST);
        for (size_t k = 0; k < size; ++k) data[k] = (uint8_t)next(&state);
        LLVMFuzzerTestOneInput(data, size);
        ++inputs;
    }
}

int main(int argc, char **argv)
{
    long runs = argc > 1 ? strtol(argv[1], NULL, 10) : 0;
    for (int k = 2; k < argc; ++k) run_path(argv[k]);
    run_own(runs);
    MUST(inputs > 0, "nothing to run");
    printf("%u inputs\n", inputs);
    return 0;
}
