/* The method `fast`: what the stop rule of a step has found (iterate/stop_rule.cu). */
#ifndef SADMM_CUDA_ITERATE_STOP_RULE_H
#define SADMM_CUDA_ITERATE_STOP_RULE_H

#include "backend_cuda/device/context.h"

/* Had every island stopped by the last of `checks` convergence checks? */
static __device__ __forceinline__ bool all_stopped(const island_view &islands, int32_t checks)
{
    return checks > 0 && islands.stop->unmet[checks % CHECKS_KEPT] == 0;
}

/* Had the island of a body? Then it stays as it is, whatever its thread block still does for others: an island's result
 * does not depend on who is beside it. */
static __device__ __forceinline__ bool island_stopped(const graph_view &graph, const island_view &islands,
                                                      int32_t checks, int32_t body)
{
    return checks > 0 && islands.info[graph.label[body]].stopped > 0;
}

static __device__ __forceinline__ bool pair_stopped(const model_view &model, const graph_view &graph,
                                                    const island_view &islands, int32_t checks, const pair_bodies &pair)
{
    return checks > 0 && island_stopped(graph, islands, checks, pair.body_a < model.bodies ? pair.body_a : pair.body_b);
}

static __device__ __forceinline__ bool rows_stopped(const model_view &model, const graph_view &graph,
                                                    const island_view &islands, int32_t checks,
                                                    const row_constraint &rows)
{
    const int32_t body = rows.body_a < model.bodies ? rows.body_a : rows.body_b;
    return checks > 0 && body < model.bodies && island_stopped(graph, islands, checks, body);
}

/* Had all islands of the slots [first, end), which are whole ones? */
static __device__ __forceinline__ bool part_stopped(const graph_view &graph, const island_view &islands, int32_t checks,
                                                    int32_t first, int32_t end)
{
    bool all = checks > 0;
    for (int32_t s = first; all && s < end;) {
        const int32_t label = graph.label[graph.body_of[s]];
        all = islands.info[label].stopped > 0;
        s += graph.island_bodies[label];
    }
    return all;
}

#endif
