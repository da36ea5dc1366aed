/* A user's first program, compiled by test_install.sh as C and as C++ against the installed tree. */
#include <stdio.h>
#include <string.h>

#include <subadmm/subadmm.h>

int main(int argc, char **argv)
{
    sadmm_problem *problem = NULL;
    if (sadmm_problem_create(&problem) != SADMM_OK) {
        fprintf(stderr, "%s\n", sadmm_last_message());
        return 1;
    }
    sadmm_problem_destroy(problem);

    /* The library that runs must be the one whose .pc file was read. */
    if (argc != 2 || strcmp(argv[1], sadmm_version()) != 0) {
        fprintf(stderr, "linked with version %s\n", sadmm_version());
        return 1;
    }
    return 0;
}
