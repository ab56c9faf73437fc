// A few worker threads, which calls from Python borrow.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace smokelift {

// Number of threads of every call from now on; 0 takes every core that the process may use. Results do not
// depend on it.
void set_threads(int count);

class Workers {
public:
    explicit Workers(int threads); // with the one that calls run()
    ~Workers();
    Workers(const Workers &) = delete;
    Workers &operator=(const Workers &) = delete;

    // Runs task(0) ... task(count - 1), in any order and on any thread. What a task computes must not depend
    // on that order; sums are therefore formed per task and added up afterwards (see sum()). Throws what a
    // task throws; the tasks that are not begun by then are left out.
    void run(int count, const std::function<void(int)> &task);

    // The sum of partial(0) ... partial(count - 1), added in that order whatever the number of threads.
    double sum(int count, const std::function<double(int)> &partial);

    // Runs task(begin, end) on ranges of `size`, the last one shorter, that make up 0 ... count.
    template <class Task> void run_ranges(std::size_t count, std::size_t size, const Task &task) {
        run(int((count + size - 1) / size), [&](int range) {
            const std::size_t begin = range * size;
            task(begin, count - begin < size ? count : begin + size);
        });
    }

    int threads() const { return wanted_; }

private:
    void serve();
    void work();

    const int wanted_;
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

// Workers for one call: those of the call before, since to start threads takes as long as a small loop, or
// new ones if another call has them. After fork() the child starts its own.
class BorrowedWorkers {
public:
    BorrowedWorkers();
    ~BorrowedWorkers();
    BorrowedWorkers(const BorrowedWorkers &) = delete;
    BorrowedWorkers &operator=(const BorrowedWorkers &) = delete;
    Workers &operator*() const { return *workers_; }

private:
    std::unique_ptr<Workers> workers_;
};

} // namespace smokelift
