// A few worker threads that live as long as one call from Python: nothing global, so fork() stays safe.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace smokelift {

class Workers {
public:
    // `threads` = 0 takes every core of the machine.
    explicit Workers(int threads);
    ~Workers();
    Workers(const Workers &) = delete;
    Workers &operator=(const Workers &) = delete;

    // Runs task(0) ... task(count - 1), in any order and on any thread. What a task computes must not depend
    // on that order; sums are therefore formed per task and added up afterwards (see sum()).
    void run(int count, const std::function<void(int)> &task);

    // The sum of partial(0) ... partial(count - 1), added in that order whatever the number of threads.
    double sum(int count, const std::function<double(int)> &partial);

private:
    void serve();
    void work();

    std::vector<std::thread> threads_;
    std::mutex mutex_;
    std::condition_variable start_;
    std::atomic<unsigned> round_{0};
    std::atomic<bool> ending_{false};
    std::atomic<int> next_{0}, busy_{0};
    int count_ = 0;
    const std::function<void(int)> *task_ = nullptr;
};

inline Workers::Workers(int threads) {
    if (threads <= 0)
        threads = static_cast<int>(std::thread::hardware_concurrency());
    for (int t = 1; t < threads; ++t)
        threads_.emplace_back([this] { serve(); });
}

inline Workers::~Workers() {
    {
        std::lock_guard<std::mutex> lock(mutex_);
        ending_ = true;
    }
    start_.notify_all();
    for (auto &thread : threads_)
        thread.join();
}

inline void Workers::work() {
    for (int i; (i = next_.fetch_add(1)) < count_;)
        (*task_)(i);
}

inline void Workers::serve() {
    unsigned seen = 0;
    for (;;) {
        // Loops follow each other within microseconds, so look a little while before going to sleep.
        for (int spin = 0; spin < 2000 && round_ == seen && !ending_; ++spin)
            std::this_thread::yield();
        {
            std::unique_lock<std::mutex> lock(mutex_);
            start_.wait(lock, [&] { return round_ != seen || ending_; });
            if (ending_)
                return;
            seen = round_;
        }
        work();
        --busy_;
    }
}

inline void Workers::run(int count, const std::function<void(int)> &task) {
    if (threads_.empty() || count < 2) {
        for (int i = 0; i < count; ++i)
            task(i);
        return;
    }
    {
        std::lock_guard<std::mutex> lock(mutex_);
        task_ = &task;
        count_ = count;
        next_ = 0;
        busy_ = static_cast<int>(threads_.size());
        ++round_;
    }
    start_.notify_all();
    work();
    while (busy_ > 0)
        std::this_thread::yield();
}

inline double Workers::sum(int count, const std::function<double(int)> &partial) {
    std::vector<double> partials(count);
    run(count, [&](int i) { partials[i] = partial(i); });
    double total = 0;
    for (double value : partials)
        total += value;
    return total;
}

} // namespace smokelift
