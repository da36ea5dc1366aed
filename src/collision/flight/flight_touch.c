#define SADMM_SMOOTH_ELSEWHERE sadmm_smooth_manifold_baseline
#include "flight_touch.h"

#include "flight_touch_math.h"

void sadmm_flight_at(const struct sadmm_flight *flight, double t, struct sadmm_flight_pose *pose)
{
    flight_at(flight, t, pose);
}

bool sadmm_flight_touch(struct sadmm_swept_pair *pair, double from, double to, struct sadmm_flight_touch *touch)
{
    return swept_touch(pair, from, to, touch);
}
