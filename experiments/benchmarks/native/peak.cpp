// Floating-point peak of one core or more: fused multiply-adds on independent registers and nothing else.
#include "lanes.hpp"
#include "threads.hpp"

extern "C" {

// Runs rounds x 16 vector multiply-adds a thread, and returns the operations done by all, two a multiply-add.
double multiply_adds(long rounds, int threads, double* sink) {
    split(threads, threads, [=](int begin, int end) {
        for (int thread = begin; thread < end; ++thread) {
            Lanes x[16];
            for (int k = 0; k < 16; ++k) x[k] = all(1.0 + 1e-3 * k);
            const Lanes factor = all(sink[0]), term = all(sink[1]);
            for (long i = 0; i < rounds; ++i) {
#pragma GCC unroll 16
                for (int k = 0; k < 16; ++k) x[k] = x[k] * factor + term;
            }
            Lanes sum = x[0];
            for (int k = 1; k < 16; ++k) sum += x[k];
            sink[2 + thread] = sum[0];
        }
    });
    return 2.0 * LANES * 16 * static_cast<double>(rounds) * threads;
}

}  // extern "C"
