#include "run_trace.h"

void run_trace_begin(FILE *trace)
{
    fputs("step,time,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n", trace);
}

static void put(FILE *trace, const double *x, size_t count)
{
    for (size_t k = 0; k < count; ++k) fprintf(trace, ",%.17g", x[k]);
}

bool run_trace_step(FILE *trace, const struct run_record *record, sadmm_world *world, double time)
{
    for (size_t k = 0; k < record->body_count; ++k) {
        sadmm_body_state s;
        if (sadmm_world_body_state(world, record->bodies[k].id, &s) != SADMM_OK) {
            cli_error(CLI_FAILED, "%s", sadmm_world_message(world));
            return false;
        }
        fprintf(trace, "%zu,%.17g,%d", record->steps, time, record->bodies[k].index);
        put(trace, s.position, 3);
        put(trace, s.orientation, 4);
        put(trace, s.linear_velocity, 3);
        put(trace, s.angular_velocity, 3);
        fputc('\n', trace);
    }
    return true;
}
