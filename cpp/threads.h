// A few worker threads that live as long as one call from Python, so that fork() stays safe.
#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace smokelift {

// Number of threads of every call from now on; 0 takes every core that the process may use. Results do not
// depend on it.
void set_threads(int count);

class Workers {
public:
    Workers();
    ~Workers();
    Workers(const Workers &) = delete;
    Workers &operator=(const Workers &) = delete;

    // Runs task(0) ... task(count - 1), in any order and on any thread. What a task computes must not depend
    // on that order; sums are therefore formed per task and added up afterwards (see sum()). Throws what a
    // task throws; the tasks that are not begun by then are left out.
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
    std::exception_ptr failure_; // what a task threw
};

} // namespace smokelift
