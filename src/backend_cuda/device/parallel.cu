/* Sort and scan: CUB, or the standard library for the emulated device. */
#include "parallel.h"

#ifndef SADMM_CUDA_EMULATED

#define CCCL_DISABLE_NVTX /* no hooks for profilers inside a library */
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <thrust/iterator/transform_iterator.h>

cudaError_t COLLISION(sort)(void *temp, size_t *bytes, uint64_t *const keys[2], uint32_t *const *values, int count,
                            int bits, int *result, cudaStream_t stream)
{
    cub::DoubleBuffer<uint64_t> key(keys[0], keys[1]);
    cudaError_t code;
    if (values) {
        cub::DoubleBuffer<uint32_t> value(values[0], values[1]);
        code = cub::DeviceRadixSort::SortPairs(temp, *bytes, key, value, count, 0, bits, stream);
        /* CUB moves both together; the callers rely on it */
        if (code == cudaSuccess && value.selector != key.selector) code = cudaErrorUnknown;
    } else {
        code = cub::DeviceRadixSort::SortKeys(temp, *bytes, key, count, 0, bits, stream);
    }
    *result = key.selector;
    return code;
}

cudaError_t COLLISION(sort_numbers)(void *temp, size_t *bytes, const int32_t *keys, int32_t *sorted_keys,
                                    const int32_t *values, int32_t *sorted_values, int count, int bits,
                                    cudaStream_t stream)
{
    return cub::DeviceRadixSort::SortPairs(temp, *bytes, keys, sorted_keys, values, sorted_values, count, 0, bits,
                                           stream);
}

namespace {
struct size_operator {
    __host__ __device__ uint64_t operator()(uint8_t points) const { return size_of(points); }
};
} // namespace

cudaError_t COLLISION(sum)(void *temp, size_t *bytes, const uint8_t *in, uint64_t *out, int count, cudaStream_t stream)
{
    return cub::DeviceScan::ExclusiveSum(temp, *bytes, thrust::make_transform_iterator(in, size_operator()), out, count,
                                         stream);
}

#else

#include <vector>

cudaError_t COLLISION(sort)(void *temp, size_t *bytes, uint64_t *const keys[2], uint32_t *const *values, int count,
                            int bits, int *result, cudaStream_t)
{
    *bytes = 1;
    *result = 0;
    if (!temp) return cudaSuccess;
    CUDA_EMULATION_CALL;
    *result = 1;
    uint64_t *const from = keys[0], *const to = keys[1];
    uint32_t *const values_from = values ? values[0] : nullptr, *const values_to = values ? values[1] : nullptr;
    return cuda_emulation_enqueue([=]() {
        const uint64_t mask = bits < 64 ? (UINT64_C(1) << bits) - 1 : ~UINT64_C(0);
        std::vector<uint32_t> order((size_t)count);
        for (size_t i = 0; i < order.size(); ++i) order[i] = (uint32_t)i;
        std::stable_sort(order.begin(), order.end(),
                         [=](uint32_t a, uint32_t b) { return (from[a] & mask) < (from[b] & mask); });
        for (size_t i = 0; i < order.size(); ++i) {
            to[i] = from[order[i]];
            if (values_to) values_to[i] = values_from[order[i]];
        }
        return true;
    });
}

cudaError_t COLLISION(sort_numbers)(void *temp, size_t *bytes, const int32_t *keys, int32_t *sorted_keys,
                                    const int32_t *values, int32_t *sorted_values, int count, int bits, cudaStream_t)
{
    *bytes = 1;
    if (!temp) return cudaSuccess;
    CUDA_EMULATION_CALL;
    return cuda_emulation_enqueue([=]() {
        const int32_t mask = (int32_t)((UINT32_C(1) << bits) - 1);
        std::vector<int32_t> order((size_t)count);
        for (size_t i = 0; i < order.size(); ++i) order[i] = (int32_t)i;
        std::stable_sort(order.begin(), order.end(),
                         [=](int32_t a, int32_t b) { return (keys[a] & mask) < (keys[b] & mask); });
        for (size_t i = 0; i < order.size(); ++i) {
            sorted_keys[i] = keys[order[i]];
            sorted_values[i] = values[order[i]];
        }
        return true;
    });
}

cudaError_t COLLISION(sum)(void *temp, size_t *bytes, const uint8_t *in, uint64_t *out, int count, cudaStream_t)
{
    *bytes = 1;
    if (!temp) return cudaSuccess;
    CUDA_EMULATION_CALL;
    return cuda_emulation_enqueue([=]() {
        uint64_t sum = 0;
        for (int i = 0; i < count; ++i) {
            out[i] = sum;
            sum += size_of(in[i]);
        }
        return true;
    });
}

#endif
