#include "hand_motion.h"

#include <stddef.h>

#include "pull.h"

const struct sadmm_hand_task sadmm_golden_task = {{0, -0.12}, 3, 8, 9.5};
const struct sadmm_hand_task sadmm_heavy_task = {{0, 0.02}, 13, 18, 19.5};
const struct sadmm_hand_task sadmm_spoon_task = {{0, 0.16}, 23, 24.5, 26};
const struct sadmm_hand_task sadmm_stack_task = {{0, 0.3}, 29.4, 30.4, 32};
const double sadmm_stack_on[2] = {0.11, 0.3};
const double sadmm_car_at[2] = {0.06, -0.32};
const double sadmm_motion_end = 38;

/* Keyframes: time (s), middle between thumb and fingers (m), yaw (rad), how far these are apart (m). */
static const struct {
    double time;
    struct sadmm_grip grip;
} recording[] = {
    /* the golden cube, 65 mm wide */
    {0.0, {{0, -0.12, 0.150}, 0, 0.110}},
    {1.0, {{0, -0.12, 0.033}, 0, 0.110}},
    {1.8, {{0, -0.12, 0.033}, 0, 0.057}},
    {3.0, {{0, -0.12, 0.183}, 0, 0.057}},
    {8.0, {{0, -0.12, 0.183}, 0, 0.057}},
    {9.0, {{0, -0.12, 0.0335}, 0, 0.057}},
    {9.5, {{0, -0.12, 0.0335}, 0, 0.110}},
    {10.2, {{0, -0.12, 0.180}, 0, 0.110}},
    /* the heavy one, 60 mm wide */
    {11.0, {{0, 0.02, 0.150}, 0, 0.110}},
    {11.6, {{0, 0.02, 0.030}, 0, 0.110}},
    {12.2, {{0, 0.02, 0.030}, 0, 0.052}},
    {13.0, {{0, 0.02, 0.160}, 0, 0.052}},
    {18.0, {{0, 0.02, 0.160}, 0, 0.052}},
    {19.0, {{0, 0.02, 0.0305}, 0, 0.052}},
    {19.5, {{0, 0.02, 0.0305}, 0, 0.110}},
    {20.2, {{0, 0.02, 0.180}, 0, 0.110}},
    /* the spoon, by its handle, 10 mm wide */
    {21.0, {{0, 0.16, 0.100}, 0, 0.060}},
    {21.6, {{0, 0.16, 0.0135}, 0, 0.060}},
    {22.2, {{0, 0.16, 0.0135}, 0, 0.002}},
    {23.0, {{0, 0.16, 0.120}, 0, 0.002}},
    {24.5, {{0, 0.16, 0.120}, 0, 0.002}},
    {25.5, {{0, 0.16, 0.0140}, 0, 0.002}},
    {26.0, {{0, 0.16, 0.0140}, 0, 0.060}},
    {26.6, {{0, 0.16, 0.120}, 0, 0.060}},
    /* a cube of 40 mm onto another one */
    {27.3, {{0, 0.3, 0.120}, 0, 0.070}},
    {28.0, {{0, 0.3, 0.020}, 0, 0.070}},
    {28.6, {{0, 0.3, 0.020}, 0, 0.032}},
    {29.4, {{0, 0.3, 0.100}, 0, 0.032}},
    {30.4, {{0.11, 0.3, 0.100}, 0, 0.032}},
    {31.2, {{0.11, 0.3, 0.0605}, 0, 0.032}},
    {32.0, {{0.11, 0.3, 0.0605}, 0, 0.080}},
    {32.8, {{0.11, 0.3, 0.180}, 0, 0.080}},
    /* the car, pushed by the fingers' backs */
    {34.0, {{-0.06, -0.32, 0.120}, 0, 0.020}},
    {34.7, {{-0.06, -0.32, 0.026}, 0, 0.020}},
    {36.5, {{0.17, -0.32, 0.026}, 0, 0.020}},
    {37.2, {{0.12, -0.32, 0.026}, 0, 0.020}},
    {38.0, {{0.12, -0.32, 0.150}, 0, 0.020}},
};

enum { KEYS = sizeof recording / sizeof recording[0] };

static double between(double a, double b, double share)
{
    return a + share * (b - a);
}

struct sadmm_grip sadmm_hand_motion(double t)
{
    size_t k = 0;
    while (k + 2 < KEYS && t >= recording[k + 1].time) ++k;
    const double share = sadmm_smooth((t - recording[k].time) / (recording[k + 1].time - recording[k].time));
    const struct sadmm_grip *a = &recording[k].grip, *b = &recording[k + 1].grip;
    struct sadmm_grip grip = {.yaw = between(a->yaw, b->yaw, share), .opening = between(a->opening, b->opening, share)};
    for (int i = 0; i < 3; ++i) grip.position[i] = between(a->position[i], b->position[i], share);
    return grip;
}
