/* FCL's dynamic AABB trees: the default broad phase on the CPU.
 *
 * A group (environment) has two trees, of what moves and of what does not, so that static boxes never meet each other
 * and groups that share a place in space cost nothing. Group -1 has one tree of static boxes that every group is
 * collided with. Objects are kept between steps; only changed ones are touched.
 *
 * FCL sees our boxes, not its own: a proxy sets the AABB that CollisionObject would compute from its geometry. Its tree
 * may keep a leaf larger than asked for (update of a box inside the old one) and may swap the two objects of a pair, so
 * the callback checks the boxes itself and orders nothing: the pair set depends on the boxes alone. Planes never enter
 * a tree: half-spaces crash it.
 *
 * C++ exceptions end here. After one the trees are dropped and built again by the next update.
 */
#include "broad_phase.h"

#include <memory>
#include <new>
#include <unordered_map>
#include <vector>

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/collision_object.h>

#include "core/base/memory.h"

namespace {

using Tree = fcl::DynamicAABBTreeCollisionManager<double>;

/* FCL multiplies sizes and crashes where these overflow. Coordinates are cut to what it can take: boxes that overlap
 * still do, and those that do not are sorted out by the callback. */
constexpr double farthest = 1e75;

/* What is no number reaches everywhere. */
double lower(double x) { return x > -farthest ? (x < farthest ? x : farthest) : -farthest; }
double upper(double x) { return x < farthest ? (x > -farthest ? x : -farthest) : farthest; }

struct Proxy : fcl::CollisionObject<double> {
    Proxy(const std::shared_ptr<fcl::CollisionGeometry<double>> &geometry, uint32_t slot_)
        : fcl::CollisionObject<double>(geometry), slot(slot_)
    {
    }
    void place(const sadmm_box3 &box)
    {
        for (int k = 0; k < 3; ++k) {
            aabb.min_[k] = lower(box.lo[k]);
            aabb.max_[k] = upper(box.hi[k]);
        }
    }
    uint32_t slot;
    int32_t group = 0;
    bool moves = false;
};

/* A tree that is refitted keeps the shape it was built with: after boxes have mixed, queries take four times as long
 * (measured: 2,000 boxes, 400 steps of 1 cm). It is built again once every box has moved this many times on average,
 * which costs a few per cent. */
constexpr size_t moves_before_rebuild = 32;

struct Group {
    explicit Group(int32_t id_) : id(id_) {}
    const int32_t id;
    Tree moving, fixed;
    size_t moves = 0; /* since the moving tree was built */
    /* objects of the update at hand */
    std::vector<fcl::CollisionObject<double> *> added_moving, added_fixed, moved, fixed_moved;
    bool touched = false;
};

struct Query {
    const sadmm_broad_entry *entries;
    sadmm_pair_list *list;
    bool failed;
};

bool record(fcl::CollisionObject<double> *a, fcl::CollisionObject<double> *b, void *data)
{
    Query *query = static_cast<Query *>(data);
    const uint32_t i = static_cast<const Proxy *>(a)->slot, j = static_cast<const Proxy *>(b)->slot;
    if (i == j || !boxes_overlap(&query->entries[i].box, &query->entries[j].box)) return false;
    if (!sadmm_pair_list_add(query->list, i, j)) query->failed = true;
    return query->failed; /* true ends the traversal */
}

} // namespace

struct sadmm_broad_phase {
    std::shared_ptr<fcl::CollisionGeometry<double>> geometry;
    std::vector<std::unique_ptr<Proxy>> proxies; /* by slot, null when absent */
    std::unordered_map<int32_t, std::unique_ptr<Group>> groups; /* those that hold something */
    std::vector<Group *> touched;

    Group &group(int32_t id)
    {
        std::unique_ptr<Group> &g = groups[id];
        if (!g) g.reset(new Group(id));
        return *g;
    }
    void touch(Group &g)
    {
        if (!g.touched) {
            touched.push_back(&g);
            g.touched = true;
        }
    }
    void clear()
    {
        touched.clear();
        groups.clear();
        proxies.clear();
    }
    void apply(const sadmm_broad_entry *entries, size_t count, const uint32_t *changed, size_t changed_count);
};

void sadmm_broad_phase::apply(const sadmm_broad_entry *entries, size_t count, const uint32_t *changed,
                              size_t changed_count)
{
    if (proxies.size() < count) proxies.resize(count);
    touched.clear();
    for (size_t k = 0; k < changed_count; ++k) {
        const uint32_t slot = changed[k];
        const sadmm_broad_entry &entry = entries[slot];
        std::unique_ptr<Proxy> &proxy = proxies[slot];
        if (proxy && (!entry.present || proxy->group != entry.group || proxy->moves != entry.moves)) {
            Group &g = group(proxy->group);
            (proxy->moves ? g.moving : g.fixed).unregisterObject(proxy.get());
            touch(g);
            proxy.reset();
        }
        if (!entry.present) continue;
        Group &g = group(entry.group);
        touch(g);
        if (proxy) {
            proxy->place(entry.box);
            (entry.moves ? g.moved : g.fixed_moved).push_back(proxy.get());
        } else {
            proxy.reset(new Proxy(geometry, slot));
            proxy->group = entry.group;
            proxy->moves = entry.moves;
            proxy->place(entry.box);
            (entry.moves ? g.added_moving : g.added_fixed).push_back(proxy.get());
        }
    }
    for (Group *g : touched) {
        g->moves += g->moved.size();
        const bool rebuild = g->moves > moves_before_rebuild * g->moving.size();
        if (rebuild) g->moves = 0;
        /* setup(), also within update(), builds the tree again when it is higher than log2(size) + this */
        g->moving.max_tree_nonbalanced_level = rebuild ? -1000 : 10;
        /* Most of a tree moved: refit it as a whole; else move the leaves one by one. */
        if (rebuild || g->moved.size() * 2 > g->moving.size()) g->moving.update();
        else if (!g->moved.empty()) g->moving.update(g->moved);
        if (!g->fixed_moved.empty()) g->fixed.update(g->fixed_moved);
        g->moving.registerObjects(g->added_moving);
        g->fixed.registerObjects(g->added_fixed);
        g->moving.setup();
        g->fixed.setup();
        g->moved.clear();
        g->fixed_moved.clear();
        g->added_moving.clear();
        g->added_fixed.clear();
        g->touched = false;
    }
    /* Ids may be used once and never again: what is kept must not grow with them. */
    for (Group *g : touched)
        if (g->moving.size() + g->fixed.size() == 0) groups.erase(g->id);
    touched.clear();
}

namespace {

sadmm_status fcl_create(sadmm_broad_phase **out, sadmm_error *error)
{
    *out = nullptr;
    if (sadmm_test_allocation_fails()) return sadmm_fail_memory(error, "FCL broad phase");
    try {
        std::unique_ptr<sadmm_broad_phase> bp(new sadmm_broad_phase);
        bp->geometry = std::make_shared<fcl::Sphere<double>>(1.0);
        *out = bp.release();
        return SADMM_OK;
    } catch (const std::bad_alloc &) {
        return sadmm_fail_memory(error, "FCL broad phase");
    } catch (const std::exception &e) {
        return sadmm_fail(error, SADMM_ERROR_UNAVAILABLE, "FCL broad phase: %s", e.what());
    }
}

void fcl_destroy(sadmm_broad_phase *bp) { delete bp; }

sadmm_status fcl_update(sadmm_broad_phase *bp, const sadmm_broad_entry *entries, size_t entry_count,
                        const uint32_t *changed, size_t changed_count, sadmm_error *error)
{
    if (sadmm_test_allocation_fails()) {
        bp->clear();
        return sadmm_fail_memory(error, "FCL broad phase");
    }
    try {
        bp->apply(entries, entry_count, changed, changed_count);
        return SADMM_OK;
    } catch (const std::bad_alloc &) {
        bp->clear();
        return sadmm_fail_memory(error, "FCL broad phase");
    } catch (const std::exception &e) {
        bp->clear();
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "FCL broad phase: %s", e.what());
    }
}

sadmm_status fcl_pairs(sadmm_broad_phase *bp, const sadmm_broad_entry *entries, size_t, sadmm_pair_list *list,
                       sadmm_error *error)
{
    Query query = {entries, list, false};
    try {
        const auto shared = bp->groups.find(-1);
        for (auto &item : bp->groups) {
            Group &g = *item.second;
            if (item.first < 0 || query.failed) continue;
            g.moving.collide(&query, record);
            if (!query.failed) g.moving.collide(&g.fixed, &query, record);
            if (!query.failed && shared != bp->groups.end()) g.moving.collide(&shared->second->fixed, &query, record);
        }
    } catch (const std::bad_alloc &) {
        query.failed = true;
    } catch (const std::exception &e) {
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "FCL broad phase: %s", e.what());
    }
    return query.failed ? sadmm_fail_memory(error, "broad-phase pairs") : SADMM_OK;
}

sadmm_status fcl_pairs_of(sadmm_broad_phase *bp, const sadmm_broad_entry *entries, size_t, const uint32_t *slots,
                          size_t slot_count, sadmm_pair_list *list, sadmm_error *error)
{
    Query query = {entries, list, false};
    try {
        const auto shared = bp->groups.find(-1);
        for (size_t k = 0; k < slot_count && !query.failed; ++k) {
            Proxy *proxy = slots[k] < bp->proxies.size() ? bp->proxies[slots[k]].get() : nullptr;
            if (!proxy) continue;
            if (proxy->group >= 0) {
                Group &g = *bp->groups.find(proxy->group)->second;
                g.moving.collide(proxy, &query, record);
                if (proxy->moves && !query.failed) g.fixed.collide(proxy, &query, record);
                if (proxy->moves && !query.failed && shared != bp->groups.end())
                    shared->second->fixed.collide(proxy, &query, record);
            } else {
                for (auto &item : bp->groups)
                    if (!query.failed) item.second->moving.collide(proxy, &query, record);
            }
        }
    } catch (const std::bad_alloc &) {
        query.failed = true;
    } catch (const std::exception &e) {
        return sadmm_fail(error, SADMM_ERROR_UNSUPPORTED, "FCL broad phase: %s", e.what());
    }
    return query.failed ? sadmm_fail_memory(error, "broad-phase pairs") : SADMM_OK;
}

} // namespace

extern "C" const sadmm_broad_phase_kind sadmm_broad_phase_fcl = {
    "fcl", fcl_create, fcl_destroy, fcl_update, fcl_pairs, fcl_pairs_of,
};
