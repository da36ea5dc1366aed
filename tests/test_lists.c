/* Growable arrays; and lists that stay quick wherever things come and go: key trees, pools of ids, tables of pairs,
 * against plain arrays. */
#include <check.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/key_tree.h"
#include "core/base/memory.h"
#include "run_suite.h"
#include "world/state/id_pool.h"
#include "world/state/pair_table.h"

enum { KEYS = 300, SLOTS = 700, BODIES = 14, CALLS = 20000 };

static uint64_t state;

static int below(int n)
{
    state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (int)((state >> 33) % (uint64_t)n);
}

/* Key k, all over the 64 bits. */
static uint64_t key_of(int k) { return (uint64_t)k << 55 | (uint64_t)k; }

/* Elements that are kept stay, room beyond them is zero, and blocks begin where vectors may. */
static void check_array(const int *array, size_t used, size_t room)
{
    ck_assert_uint_eq((uintptr_t)array % 64, 0);
    size_t wrong = 0;
    for (size_t k = 0; k < room; ++k) wrong += array[k] != (k < used ? (int)k + 1 : 0);
    ck_assert_uint_eq(wrong, 0);
}

START_TEST(arrays)
{
    int *array = NULL;
    size_t used = 0;
    ck_assert_uint_eq(SADMM_ROOM(array), 0);
    ck_assert(SADMM_GROW(array, 0, 0) && !array);
    while (used < 5000) {
        const size_t before = SADMM_ROOM(array);
        ck_assert(SADMM_GROW(array, used, used + 1));
        const size_t room = SADMM_ROOM(array);
        if (used < before) ck_assert_uint_eq(room, before);
        else {
            ck_assert_uint_ge(room, used + 1);
            ck_assert_uint_le(room, used + used / 2 + 16);
            check_array(array, used, room);
        }
        array[used] = (int)used + 1;
        ++used;
    }
    const int *const block = array;
    const size_t room = SADMM_ROOM(array);
    sadmm_test_fail_allocations_after(0); /* nothing changes then */
    ck_assert(!SADMM_GROW(array, used, room + 1) && !SADMM_GROW(array, 0, SIZE_MAX));
    sadmm_test_fail_allocations_after(-1);
    ck_assert(!SADMM_GROW(array, 0, SIZE_MAX / 2) && array == block && SADMM_ROOM(array) == room);
    check_array(array, used, used);
    ck_assert(SADMM_GROW(array, 10, room + 1) && SADMM_ROOM(array) > room);
    check_array(array, 10, SADMM_ROOM(array));
    sadmm_free(array);

    array = (int *)sadmm_alloc(7, sizeof *array); /* a block grows as well */
    for (int k = 0; k < 7; ++k) array[k] = k + 1;
    ck_assert_uint_eq(SADMM_ROOM(array), 7);
    ck_assert(SADMM_GROW(array, 7, (8 << 20) / sizeof *array)); /* to one of large pages */
    check_array(array, 7, SADMM_ROOM(array));
    sadmm_free(array);
}
END_TEST

static void compare_tree(const struct sadmm_key_tree *tree, const double values[KEYS])
{
    size_t count = 0;
    for (int k = 0; k < KEYS; ++k) {
        const double *found = sadmm_key_tree_find(tree, key_of(k));
        const struct sadmm_key_node *from = sadmm_key_tree_from(tree, key_of(k));
        int next = k;
        while (next < KEYS && values[next] < 0) ++next;
        ck_assert((found != NULL) == (values[k] >= 0) && (!found || *found == values[k]));
        ck_assert((from != NULL) == (next < KEYS) && (!from || from->key == key_of(next)));
        if (!found) continue;
        ck_assert(sadmm_key_tree_at(tree, count)->key == key_of(k));
        ++count;
    }
    ck_assert_uint_eq(sadmm_key_tree_count(tree), count);
}

/* Negative values: keys that are not there. Few and many in turn. */
START_TEST(key_trees)
{
    struct sadmm_key_tree tree = {0};
    double values[KEYS];
    state = 5;
    for (int k = 0; k < KEYS; ++k) values[k] = -1;
    for (int call = 0; call < CALLS; ++call) {
        const int k = below(KEYS) * (call % 3 == 0) + below(KEYS) / 8 * (call % 3 != 0);
        if (below(CALLS) < (call / 4000 % 2 ? 6000 : 14000)) {
            values[k] = below(1000);
            ck_assert(sadmm_key_tree_reserve(&tree));
            sadmm_key_tree_set(&tree, key_of(k), values[k]);
        } else {
            values[k] = -1;
            sadmm_key_tree_remove(&tree, key_of(k));
        }
        if (call % 50 == 0) compare_tree(&tree, values);
    }
    ck_assert_uint_le(tree.used, KEYS + 1); /* what was removed is used again */
    sadmm_key_tree_free(&tree);
}
END_TEST

/* What a pool of ids has to be, in plain arrays: by slot whether there is an object, and its generation, or the next
 * one's. */
struct plain_pool {
    bool taken[SLOTS];
    uint32_t generation[SLOTS];
    int slots, count;
};

static int next_slot(const struct plain_pool *plain)
{
    int slot = 0;
    while (slot < plain->slots && plain->taken[slot]) ++slot;
    return slot;
}

static void compare_pool(const struct sadmm_id_pool *pool, const struct plain_pool *plain)
{
    int32_t count = 0;
    size_t from = 0;
    ck_assert_uint_eq(pool->slots, (size_t)plain->slots);
    ck_assert_int_eq(pool->count, plain->count);
    for (int slot = 0; slot < plain->slots; ++slot) {
        ck_assert_int_eq(sadmm_ids_index(pool, (size_t)slot), count);
        ck_assert_uint_eq(pool->generations[slot], plain->generation[slot]);
        ck_assert(sadmm_ids_has(pool, (size_t)slot) == plain->taken[slot]);
        if (!plain->taken[slot]) continue;
        ck_assert_uint_eq(sadmm_ids_at(pool, count), (size_t)slot);
        ck_assert_uint_eq(sadmm_ids_from(pool, from), (size_t)slot);
        from = (size_t)slot + 1;
        ++count;
    }
    ck_assert(!sadmm_ids_has(pool, pool->slots) && sadmm_ids_from(pool, from) == pool->slots);
    for (SADMM_OBJECTS(slot, pool)) {
        ck_assert(plain->taken[slot]);
        --count;
    }
    ck_assert_int_eq(count, 0);
}

static size_t take_next(struct sadmm_id_pool *pool)
{
    size_t slot;
    ck_assert_int_eq(sadmm_ids_next(pool, &slot, NULL), SADMM_OK);
    sadmm_ids_take(pool, slot);
    return slot;
}

static struct sadmm_id_pool empty_pool(void)
{
    return (struct sadmm_id_pool){.object = "thing", .objects = "things", .most = 10};
}

/* Objects come and go in random order, few and many in turn; the next one gets the lowest free slot. */
START_TEST(pools)
{
    struct sadmm_id_pool pool = empty_pool();
    struct plain_pool plain = {.slots = 0};
    state = 9;
    compare_pool(&pool, &plain);
    for (int call = 0; call < CALLS; ++call) {
        if (plain.count < SLOTS && below(CALLS) < (call / 2500 % 2 ? 8000 : 14000)) {
            const int slot = next_slot(&plain);
            ck_assert_uint_eq(take_next(&pool), (size_t)slot);
            if (slot == plain.slots) plain.generation[plain.slots++] = 1;
            plain.taken[slot] = true;
            ++plain.count;
        } else if (plain.count > 0) {
            const int slot = (int)sadmm_ids_at(&pool, below(plain.count));
            sadmm_ids_release(&pool, (size_t)slot);
            plain.taken[slot] = false;
            ++plain.generation[slot];
            --plain.count;
        }
        if (call % 200 < 2) compare_pool(&pool, &plain);
    }
    ck_assert_int_gt(plain.slots, 300); /* several words, and many slots used again */
    ck_assert_int_gt(plain.slots, plain.count);
    sadmm_ids_free(&pool);
    compare_pool(&pool, &(struct plain_pool){.slots = 0});
}
END_TEST

/* Ids of what is gone, of what is not there yet, and of nothing. */
START_TEST(stale_ids)
{
    struct sadmm_id_pool pool = empty_pool();
    struct sadmm_error error = {.status = SADMM_OK};
    ck_assert_int_eq(sadmm_ids_check(&pool, 1, 1, "id", NULL), SADMM_ERROR_STALE_ID);
    for (size_t slot = 0; slot < 3; ++slot) ck_assert_uint_eq(take_next(&pool), slot);
    sadmm_ids_release(&pool, 1);
    static const uint32_t refused[][2] = {{0, 0}, {0, 1}, {1, 0}, {1, 2}, {2, 1}, {2, 2}, {4, 1}, {UINT32_MAX, 1}};
    for (size_t k = 0; k < sizeof refused / sizeof *refused; ++k)
        ck_assert_int_eq(sadmm_ids_check(&pool, refused[k][0], refused[k][1], "id", NULL), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_ids_check(&pool, 3, 1, "id", NULL), SADMM_OK);
    ck_assert_uint_eq(take_next(&pool), 1);
    ck_assert_int_eq(sadmm_ids_check(&pool, 2, 2, "id", NULL), SADMM_OK);
    ck_assert_int_eq(sadmm_ids_check(&pool, 2, 1, "def->thing", &error), SADMM_ERROR_STALE_ID);
    ck_assert_str_eq(error.message, "def->thing = (slot 2, generation 1): no such thing (any more)");

    pool.generations[1] = UINT32_MAX; /* as after so many objects in the slot */
    sadmm_ids_release(&pool, 1);
    ck_assert_uint_eq(take_next(&pool), 1);
    ck_assert_int_eq(sadmm_ids_check(&pool, 2, UINT32_MAX, "id", NULL), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_ids_check(&pool, 2, 0, "id", NULL), SADMM_ERROR_STALE_ID);
    ck_assert_int_eq(sadmm_ids_check(&pool, 2, 1, "id", NULL), SADMM_OK);
    sadmm_ids_free(&pool);
}
END_TEST

START_TEST(full_pools)
{
    struct sadmm_id_pool pool = empty_pool();
    struct sadmm_error error = {.status = SADMM_OK};
    size_t slot;
    for (long left = 0;; ++left) { /* of three arrays */
        sadmm_test_fail_allocations_after(left);
        const sadmm_status status = sadmm_ids_next(&pool, &slot, &error);
        sadmm_test_fail_allocations_after(-1);
        if (status == SADMM_OK) break;
        ck_assert(status == SADMM_ERROR_OUT_OF_MEMORY && pool.slots == 0 && pool.count == 0 && left < 3);
        ck_assert_str_eq(error.message, "out of memory for a thing");
    }
    for (size_t k = 0; k < 1024; ++k) ck_assert_uint_eq(take_next(&pool), k);
    ck_assert_int_eq(sadmm_ids_next(&pool, &slot, &error), SADMM_ERROR_LIMIT);
    ck_assert_str_eq(error.message, "1024 things: a world holds at most 2^10");
    sadmm_ids_release(&pool, 700);
    sadmm_ids_release(&pool, 77);
    ck_assert_uint_eq(take_next(&pool), 77);
    ck_assert_uint_eq(take_next(&pool), 700);
    ck_assert_int_eq(sadmm_ids_next(&pool, &slot, NULL), SADMM_ERROR_LIMIT);
    sadmm_ids_free(&pool);
}
END_TEST

static void compare_pairs(struct sadmm_pair_table *table, double values[BODIES][BODIES])
{
    size_t count = 0;
    ck_assert_int_eq(sadmm_pair_table_list(table, NULL), SADMM_OK);
    for (int a = 0; a < BODIES; ++a)
        for (int b = a + 1; b < BODIES; ++b) {
            const uint64_t key = sadmm_pair_key((size_t)b, (size_t)a);
            const double *found = sadmm_pair_table_find(table, key);
            double at;
            ck_assert((found != NULL) == (values[a][b] > 0) && (!found || *found == values[a][b]));
            if (!found) continue;
            ck_assert(table->keys[count] == key && table->values[count] == values[a][b]);
            ck_assert(sadmm_pair_table_at(table, count, &at) == key && at == values[a][b]);
            ++count;
        }
    ck_assert_uint_eq(sadmm_pair_table_count(table), count);
}

START_TEST(pairs)
{
    struct sadmm_pair_table table = {.listed = false};
    double values[BODIES][BODIES] = {{0}};
    state = 2;
    for (int call = 0; call < CALLS; ++call) {
        const int a = below(BODIES - 1), b = a + 1 + below(BODIES - 1 - a), kind = below(40);
        const uint64_t key = sadmm_pair_key((size_t)a, (size_t)b);
        if (kind == 0) {
            sadmm_pair_table_forget(&table, (uint32_t)a);
            for (int k = 0; k < BODIES; ++k) values[a][k] = values[k][a] = 0;
        } else if (kind < 5) {
            sadmm_pair_table_remove(&table, key);
            values[a][b] = 0;
        } else if (kind < 20) {
            sadmm_pair_table_lower(&table, key);
            if (values[a][b] > 0) --values[a][b];
        } else {
            values[a][b] = 1 + below(3);
            ck_assert_int_eq(sadmm_pair_table_set(&table, key, values[a][b], NULL), SADMM_OK);
        }
        if (call % 20 == 0) compare_pairs(&table, values);
    }
    sadmm_pair_table_free(&table);
}
END_TEST

int main(void)
{
    Suite *suite = suite_create("lists");
    TCase *cases = tcase_create("lists");
    tcase_add_test(cases, arrays);
    tcase_add_test(cases, key_trees);
    tcase_add_test(cases, pools);
    tcase_add_test(cases, stale_ids);
    tcase_add_test(cases, full_pools);
    tcase_add_test(cases, pairs);
    suite_add_tcase(suite, cases);
    return run_suite(suite);
}
