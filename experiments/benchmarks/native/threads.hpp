// A batch split into even, contiguous shares, one a thread.
#pragma once

#include <algorithm>
#include <thread>
#include <vector>

template <class Work>
void split(int count, int threads, Work work) {
    if (threads <= 1) return work(0, count);
    std::vector<std::thread> running;
    for (int k = 0; k < threads; ++k) {
        const int begin = static_cast<long>(count) * k / threads, end = static_cast<long>(count) * (k + 1) / threads;
        running.emplace_back([=] { work(begin, end); });
    }
    for (auto& thread : running) thread.join();
}
