/* Texts are cut at characters: names of bodies, and messages that quote what somebody else has written. */
#include <check.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/error.h"
#include "core/base/utf8.h"
#include "run_suite.h"
#include "subadmm/save.h"
#include "subadmm/world.h"
#include "world/save/save.h"

static const struct {
    const char *text;
    size_t length; /* of the first character; 0: none */
} characters[] = {
    {"", 0},
    {"ab", 1},
    {"\x7f", 1},
    {"\xc2\x80", 2},         /* U+0080, the first of two bytes */
    {"\xdf\xbf", 2},         /* U+07FF, the last */
    {"\xe0\xa0\x80", 3},     /* U+0800 */
    {"\xed\x9f\xbf", 3},     /* U+D7FF, before the surrogates */
    {"\xee\x80\x80", 3},     /* U+E000, behind them */
    {"\xef\xbf\xbf", 3},     /* U+FFFF */
    {"\xf0\x90\x80\x80", 4}, /* U+10000 */
    {"\xf4\x8f\xbf\xbf", 4}, /* U+10FFFF, the last of all */
    {"\x80", 0},             /* the middle of one */
    {"\xc2", 0},             /* cut */
    {"\xe2\x82", 0},
    {"\xf0\x9f\x98", 0},
    {"\xc2"
     "a",
     0},
    {"\xc1\xbf", 0},         /* U+007F written longer than it is */
    {"\xe0\x9f\xbf", 0},     /* U+07FF */
    {"\xf0\x8f\xbf\xbf", 0}, /* U+FFFF */
    {"\xed\xa0\x80", 0},     /* a surrogate */
    {"\xf4\x90\x80\x80", 0}, /* beyond U+10FFFF */
    {"\xf8\x88\x80\x80\x80", 0},
    {"\xff", 0},
};

START_TEST(characters_are_as_long_as_they_are)
{
    ck_assert_uint_eq(sadmm_utf8_character(characters[_i].text), characters[_i].length);
}
END_TEST

/* Any bytes: what is mended has characters alone, what was whole stays, and so does the length. */
START_TEST(mended_texts_have_whole_characters)
{
    static const char part[] = "a\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80\x80\xed\xa0";
    unsigned seed = 1;
    for (int trial = 0; trial < 20000; ++trial) {
        char text[12], mended[12];
        for (size_t k = 0; k < sizeof text; ++k) {
            seed = seed * 1664525u + 1013904223u;
            text[k] = part[(seed >> 20) % (sizeof part - 1)];
        }
        text[sizeof text - 1] = 0;
        strcpy(mended, text);
        sadmm_utf8_mend(mended);
        ck_assert_uint_eq(sadmm_utf8_fit(mended, sizeof mended), sizeof text - 1);
        const size_t whole = sadmm_utf8_fit(text, sizeof text);
        ck_assert(memcmp(text, mended, whole) == 0);
        ck_assert(whole == sizeof text - 1 || mended[whole] == '?');
    }
}
END_TEST

START_TEST(messages_have_whole_characters)
{
    struct sadmm_error error;
    char name[2 * SADMM_MESSAGE_SIZE];
    /* Two bytes each, cut behind every number of bytes. */
    for (size_t k = 0; k + 2 < sizeof name; k += 2) memcpy(name + k, "\xc3\xa9", 3);
    for (int most = 0; most < 8; ++most) {
        sadmm_fail(&error, SADMM_ERROR_INVALID_ARGUMENT, "name = %.*s: is cut", most, name);
        ck_assert_uint_eq(sadmm_utf8_fit(error.message, sizeof error.message), strlen(error.message));
    }
    for (int before = 0; before < 2; ++before) { /* at the message's own end */
        sadmm_fail(&error, SADMM_ERROR_INVALID_ARGUMENT, "%.*s%s", before, "a", name);
        ck_assert_uint_eq(strlen(error.message), SADMM_MESSAGE_SIZE - 1);
        ck_assert_uint_eq(sadmm_utf8_fit(error.message, sizeof error.message), strlen(error.message));
        ck_assert_str_eq(error.message, sadmm_last_message());
    }
}
END_TEST

static sadmm_world *make_world(void)
{
    sadmm_world_def def = sadmm_world_def_default();
    sadmm_world *world = NULL;
    ck_assert(sadmm_world_create(&def, &world) == SADMM_OK);
    return world;
}

static sadmm_status add(sadmm_world *world, const char *name, sadmm_body_id *id)
{
    sadmm_body_def def = sadmm_body_def_default();
    def.type = SADMM_BODY_STATIC, def.name = name;
    return sadmm_world_add_body(world, &def, id);
}

/* Characters of one to four bytes from every place in the name: as many as fit, and none in part. */
START_TEST(names_are_cut_at_characters)
{
    static const char *const letters[] = {"n", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x98\x80"};
    sadmm_world *world = make_world();
    for (size_t size = 1; size <= 4; ++size)
        for (size_t before = 0; before < 5; ++before) {
            char name[200] = "";
            sadmm_body_id id;
            sadmm_body_def def;
            memset(name, 'x', before);
            for (size_t k = before; k < 120; k += size) strcpy(name + k, letters[size - 1]);
            ck_assert(add(world, name, &id) == SADMM_OK);
            ck_assert(sadmm_world_body_def(world, id, &def) == SADMM_OK);
            ck_assert_uint_eq(strlen(def.name), before + (63 - before) / size * size);
            ck_assert(memcmp(def.name, name, strlen(def.name)) == 0);
        }
    sadmm_world_destroy(world);
}
END_TEST

START_TEST(names_are_utf8)
{
    sadmm_world *world = make_world();
    sadmm_body_id id;
    ck_assert(add(world, "caf\xe9", &id) == SADMM_ERROR_INVALID_ARGUMENT); /* Latin-1 */
    ck_assert_str_eq(sadmm_world_message(world), "def->name: must be UTF-8, its byte 3 (0xe9) is not");
    ck_assert_int_eq(sadmm_world_body_count(world), 0);
    /* The same for bytes that somebody has changed. */
    size_t size;
    ck_assert(add(world, "a name to be found", &id) == SADMM_OK);
    ck_assert(sadmm_world_save(world, NULL, 0, &size) == SADMM_OK);
    unsigned char *bytes = (unsigned char *)malloc(size);
    ck_assert(sadmm_world_save(world, bytes, size, &size) == SADMM_OK);
    ck_assert(sadmm_world_restore(world, bytes, size) == SADMM_OK);
    size_t at = 0;
    while (memcmp(bytes + at, "a name to be found", 18) != 0) ++at;
    bytes[at + 3] = 0xe9;
    sadmm_save_repair(bytes, size);
    ck_assert(sadmm_world_restore(world, bytes, size) == SADMM_ERROR_INVALID_ARGUMENT);
    ck_assert_int_eq(sadmm_world_body_count(world), 1);
    free(bytes);
    sadmm_world_destroy(world);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("utf8");
    TCase *tests = tcase_create("texts");
    tcase_add_loop_test(tests, characters_are_as_long_as_they_are, 0, (int)(sizeof characters / sizeof *characters));
    tcase_add_test(tests, mended_texts_have_whole_characters);
    tcase_add_test(tests, messages_have_whole_characters);
    tcase_add_test(tests, names_are_cut_at_characters);
    tcase_add_test(tests, names_are_utf8);
    suite_add_tcase(suite, tests);
    return run_suite(suite);
}
