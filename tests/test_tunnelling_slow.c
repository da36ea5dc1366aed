/* A million drops and shots at random (drops.h), and bodies shot at one another (shots.h). */
#include "shots.h"

enum { WORLDS = 420 }; /* of a form and a ground, of 40 bodies each: 10 x 6 x 420 x 40 = 1,008,000 */

static const int forms[] = {
    SADMM_SHAPE_SPHERE, SADMM_SHAPE_CAPSULE, SADMM_SHAPE_BOX, SADMM_SHAPE_HULL,      SADMM_SHAPE_CYLINDER,
    SADMM_SHAPE_CONE,   DROP_COMPOUND,       DROP_NEEDLE,     SADMM_SHAPE_ELLIPSOID, DROP_LEAF};

START_TEST(a_million_drops_stay_on_their_side) { drop_worlds(forms[_i], 1000, WORLDS); }
END_TEST

/* Of 100,000 at most one in a thousand: those that turn by radians within the step once they are hit, and touch
 * again. */
enum { SHOT_WORLDS = 2500 };
START_TEST(shots_do_not_go_through)
{
    const int through = shots_all(1000, SHOT_WORLDS), most = SHOT_WORLDS * SHOT_PAIRS / 1000;
    ck_assert_msg(through <= most, "%d of %d are through", through, SHOT_WORLDS * SHOT_PAIRS);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("tunnelling, a million drops");
    TCase *tests = tcase_create("drops");
    tcase_add_loop_test(tests, a_million_drops_stay_on_their_side, 0, (int)(sizeof forms / sizeof *forms));
    tcase_add_test(tests, shots_do_not_go_through);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
