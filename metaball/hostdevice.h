// The one place that knows CUDA's function qualifiers: formulas written with SHERD_HD compile for
// the CPU and for the GPU from the same text.
#pragma once

#if defined(__CUDACC__)
#define SHERD_HD __host__ __device__ inline
#else
#define SHERD_HD inline
#endif
