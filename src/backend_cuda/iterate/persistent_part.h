/* The persistent kernel (persistent.h): a thread block's part. persistent_load.h brings it onto the chip and back,
 * persistent_steps.h iterates. */
#ifndef SADMM_CUDA_ITERATE_PERSISTENT_PART_H
#define SADMM_CUDA_ITERATE_PERSISTENT_PART_H

#include "persistent_memory.h"
#include "persistent_rows.h"
#include "stop_rule.h"

/* ---- sides in registers --------------------------------------------------------------------------------------- */

/* A lane's share of its quad's side: points lane, lane + 4, ... The side on side b sees the relative velocity x; the
 * side on side a sees -x, so its errors and weights have the other sign too. A point that is not there has all 0. */
template <int POINTS> struct side_lane {
    enum { COUNT = POINTS / QUAD };
    vec3 normal;
    real friction, sign;
    vec3 own_arm[COUNT], other_arm[COUNT], lambda[COUNT];
    real error[COUNT], inv_s[COUNT];
    int32_t own;              /* body, in the part */
    const solver_real *other; /* row of the other body's state in even iterations */
    int32_t other_odd;        /* from there to its row in odd iterations */
    bool pair;                /* a side of a pair */
};

/* ---- a part ---------------------------------------------------------------------------------------------------- */

template <int POINTS, int MODE, int SIZE, bool FAST> struct part_run {
    enum { COUNT = POINTS / QUAD, MORE = MODE == BLOCK ? 8 : 4 }; /* more take registers, fewer another round */
    const cuda_view &v;
    const cuda_args &args;
    part_memory m;
    int32_t t, r, lane, side; /* thread; component of a body; lane of a quad; the quad's side */
    int32_t first_body, bodies, first_side, sides;
    body_thread found; /* the thread's first body */

    /* One body for each eight threads is in registers, with where its records are; more are in shared memory. What the
     * loop needs is worked out before it: addresses, and what holds for a whole warp. */
    int32_t body;
    const solver_real *gathered; /* component r of the first record */
    int32_t gathered_count;      /* 0 in lanes that have no component */
    bool many;                   /* some lane of the warp has more than FETCHED_FIRST */
    bool moves, updates, row_sides; /* the warp has bodies, sides, sides of constraints given by rows */
    const solver_real *own_row;  /* of the side's own body in even iterations */
    solver_real *own_state;      /* the body's component r, in even iterations */
    real2_pair *own_record;
    solver_real *row_memory;     /* of the warp's rows */
    body_lane own_body;
    real momentum;               /* b - A v */
    real sum, step;              /* FAST: J^T d lambda, what v has gone by in this iteration */
    side_lane<POINTS> own;
    /* Until iterations begin (registers): what the side is, and its pair as it is in memory. */
    int32_t side_code;
    pair_bodies on;
    real4 about, between, point[COUNT];

    __device__ __forceinline__ part_run(const cuda_view &view, const cuda_args &arguments, unsigned char *memory)
        : v(view), args(arguments), t((int32_t)threadIdx.x), r(t % LANES), lane(t % QUAD), side(t / QUAD),
          first_body(v.graph.parts[blockIdx.x]), bodies(v.graph.parts[blockIdx.x + 1] - first_body),
          first_side(v.graph.offsets[first_body]), sides(v.graph.offsets[first_body + bodies] - first_side),
          found(body_of_slot(v.graph, first_body + t / LANES, t / LANES < bodies)), body(t / LANES), gathered(nullptr),
          gathered_count(0), many(false), moves(warp_has_body(0)), updates(warp_has_side()), row_sides(false),
          own_row(nullptr), own_state(nullptr), own_record(nullptr), row_memory(nullptr), own_body(), momentum(0),
          sum(0), step(0), own(), side_code(side < sides ? v.graph.incident[first_side + side] : 0), on(), about(),
          between(), point()
    {
        lay_out(&m, memory, MODE == CLUSTER, HAS_ROWS<SIZE> ? v.rows.count : 0, (int)blockDim.x, args.most_bodies);
        if (!HAS_ROWS<SIZE>) return;
        part_rows_from_pairs();
        row_sides = __ballot_sync((unsigned)ALL_LANES, is_row_side()) != 0;
        updates = __ballot_sync((unsigned)ALL_LANES, side < sides && !is_row_side()) != 0;
    }

    /* A block of one warp has work, or would not be here. */
    __device__ __forceinline__ bool has_moves(void) const { return SIZE == ONE_WARP || moves; }
    __device__ __forceinline__ bool has_updates(void) const { return SIZE == ONE_WARP || updates; }

    __device__ __forceinline__ solver_real *state(int32_t odd) const
    {
        return m.state + (MODE == CLUSTER && odd ? args.most_bodies * ROW : 0);
    }
    /* Number i of the part's rows of ROW, in the bodies' raw order. */
    __device__ __forceinline__ size_t raw_row(int32_t i) const
    {
        return (size_t)v.graph.body_of[first_body + i / ROW] * ROW + (size_t)(i % ROW);
    }
    /* What prologue.h sees of it. */
    __device__ __forceinline__ block_part for_prologue(void) const
    {
        const block_part out = {first_body, bodies, m.terms, m.range, m.flags};
        return out;
    }
    /* fast: has the island of the side met the stop rule? */
    __device__ __forceinline__ bool side_stopped(void) const
    {
        return FAST && island_stopped(v.graph, v.islands, args.checks, v.graph.body_of[first_body + own.own]);
    }
    __device__ __forceinline__ bool has_side(void) const { return side < sides; }
    __device__ __forceinline__ bool is_row_side(void) const
    {
        return HAS_ROWS<SIZE> && side < sides && side_code / 2 >= v.contacts.pair_capacity;
    }
    /* Warps without work are left out of everything but barriers. */
    __device__ __forceinline__ bool warp_has_body(int32_t first) const
    {
        return first + t / WARP * (WARP / LANES) < bodies;
    }
    __device__ __forceinline__ bool warp_has_side(void) const { return t / WARP * (WARP / QUAD) < sides; }

    __device__ __forceinline__ void part_rows_from_pairs(void);
    __device__ __forceinline__ void load(void);
    /* Where point k of the side's pair is, if there is memory for so many: their number is not waited for. */
    __device__ __forceinline__ size_t slot_or_first(int32_t k) const
    {
        return k < v.contacts.lanes * ((v.contacts.point_slots + v.contacts.lanes - 1) / v.contacts.lanes)
                   ? point_slot(v.contacts, side_code / 2, k)
                   : 0;
    }
    __device__ __forceinline__ void fetch_side(void);
    __device__ __forceinline__ void load_side(void);
    __device__ __forceinline__ void find_other(int32_t other);
    __device__ __forceinline__ void start_records(void);
    __device__ __forceinline__ void start_row_records(void);
    __device__ __forceinline__ void load_records(void);
    __device__ __forceinline__ void store_record(real2_pair *record, real2_pair sum) const;
    __device__ __forceinline__ real gather(real g, const solver_real *from, int32_t count, bool more) const;
    __device__ __forceinline__ void publish(solver_real *to, int32_t i, real value, int32_t odd);
    __device__ __forceinline__ void move_bodies(int32_t odd);
    __device__ __forceinline__ void move_bodies_fast(int32_t odd, real relaxation, real multipliers);
    __device__ __forceinline__ void update_sides(int32_t odd, real relaxation_factor, bool plain);
    __device__ __forceinline__ void update_rows(const row_lane &rows, int32_t odd, real relaxation_factor) const;
    __device__ __forceinline__ bool has_candidate(int32_t odd) const;
    __device__ __forceinline__ void store_bodies(int32_t odd);
    __device__ __forceinline__ void store_pair(void);
};

#define PART template <int POINTS, int MODE, int SIZE, bool FAST>
#define PART_RUN part_run<POINTS, MODE, SIZE, FAST>

/* The quad's sum as the record of its side. */
PART __device__ __forceinline__ void PART_RUN::store_record(real2_pair *record, real2_pair sum) const
{
    sum.x *= own.sign;
    sum.y *= own.sign;
    if (own.pair) *record = sum;
}

#endif
