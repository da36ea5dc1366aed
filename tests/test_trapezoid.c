/* Trapezoid corrections of bodies (core/math/trapezoid.h): what they are at contact points. */
#include <check.h>
#include <math.h>

#include "core/math/rigid.h"
#include "core/math/trapezoid.h"
#include "run_suite.h"

/* dt 0.01 s, slop 1e-5 m: 1e-6 m of noise. Corrections are along the normal. */
START_TEST(points)
{
    static const struct {
        double separation, push, speed, correction[2];
        int island, body[2];
        uint32_t migrates;
    } cases[] = {
        /* rest, and sliding: nothing along the normal */
        {0, 1, 0, {0, 0}, 0, {TOUCH_SUPPORTED, TOUCH_SUPPORTED}, MIGRATES_NOT},
        /* a landing: it stops, from 1 m/s */
        {0.003, 1, -0.3, {0, 0.35}, TOUCH_PENETRATES, {TOUCH_SUPPORTED, TOUCH_SUPPORTED}, MIGRATES_NOT},
        /* what falls is lifted */
        {0.003, 0, -0.2, {0, -0.05}, 0, {0, 0}, MIGRATES_NOT},
        /* an airborne body that rises to something has room for it, or for half of it, or has not */
        {0.003, 0, -0.2, {0, 0.04}, 0, {0, 0}, MIGRATES_NOT},
        {0.003, 0, -0.2, {0, 0.06}, 0, {0, TOUCH_SUPPORTED}, MIGRATES_NOT},
        {0.003, 0, -0.2, {0, 0.11}, TOUCH_PENETRATES, {0, TOUCH_SUPPORTED}, MIGRATES_NOT},
        /* two that fall as one */
        {0.0001, 0, 0, {0.05, -0.05}, 0, {TOUCH_SUPPORTED, 0}, MIGRATES_NOT},
        /* overlapping ones, and noise */
        {-0.003, 1, 0.1, {0, 0.05}, TOUCH_PENETRATES, {TOUCH_SUPPORTED, TOUCH_SUPPORTED}, MIGRATES_NOT},
        {0, 0, 0, {0, 4e-5}, 0, {0, 0}, MIGRATES_NOT},
        /* a bounce that keeps all of its speed goes back to where it was */
        {0.003, 1, 1, {0, 1}, 0, {TOUCH_SUPPORTED, TOUCH_SUPPORTED}, MIGRATES_NOT},
        /* what rolls stays as deep as it is, by the mean of an end where it opens as fast as it closed */
        {-0.003, 1, 0.1, {0, 0.1}, 0, {TOUCH_SUPPORTED, TOUCH_SUPPORTED}, MIGRATES_NOWHERE},
        {-0.003, 1, 0.1, {0, 0.11}, TOUCH_PENETRATES, {TOUCH_SUPPORTED, TOUCH_SUPPORTED}, MIGRATES_NOWHERE},
        /* where a round surface pressed before, half of what the correction moves it by */
        {-0.003, 1, 0.1, {0, 0.11}, 0, {TOUCH_SUPPORTED, TOUCH_SUPPORTED}, MIGRATES_SOON},
        {-0.003, 1, 0.1, {0, 0.3}, TOUCH_PENETRATES, {TOUCH_SUPPORTED, TOUCH_SUPPORTED}, MIGRATES_SOON},
        /* of 0.2 m 5 % would be 10 mm more than there is room for; of an arm of 0.1 m it is 5 mm */
        {0.1925, 0, 0, {0, 20}, TOUCH_PENETRATES, {0, TOUCH_SUPPORTED}, MIGRATES_NOT},
    };
    const double size[2] = {fabs(cases[_i].correction[0]), fabs(cases[_i].correction[1])};
    static const double arm[2] = {0.1, 0.1};
    struct trapezoid_touch touch = {0, {0, 0}};
    static const double gravity[3] = {0, 0, -20}, force[3] = {0, 0, 8}; /* 1 kg: 0.01 x 2 m/s a step by itself */
    const double at_rest = trapezoid_rest_speed(gravity, 0.5, force, 1, 0.01), rest[2] = {at_rest, at_rest};
    const double moves[2] = {0.0019, 0.0021};
    const struct trapezoid_separation separation = {cases[_i].separation, cases[_i].speed, {arm[0], arm[1]},
                                                    cases[_i].migrates};
    trapezoid_add_point(&touch, separation, cases[_i].push, cases[_i].correction, size, moves, rest, 0.01, 1e-5);
    ck_assert_int_eq(touch.island, cases[_i].island);
    for (int s = 0; s < 2; ++s) {
        ck_assert_int_eq(touch.body[s] & TOUCH_SUPPORTED, cases[_i].body[s]);
        ck_assert_int_eq((touch.body[s] & TOUCH_MOVED) != 0, s);
    }
}
END_TEST
enum { POINTS = 15 };

int main(void)
{
    Suite *suite = suite_create("trapezoid");
    TCase *cases = tcase_create("trapezoid");
    tcase_add_loop_test(cases, points, 0, POINTS);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
