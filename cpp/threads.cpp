#include "threads.h"

#include <algorithm>
#include <system_error>
#include <utility>

#if defined(__linux__)
#include <sched.h>
#endif
#if !defined(_WIN32)
#include <pthread.h>
#endif

namespace smokelift {
namespace {

// Checks for the next loop before a thread goes to sleep: the loops of one call follow each other as fast,
// calls from Python do not (docs/experiments/memory-and-time.md).
constexpr int SPINS = 100;

std::atomic<int> threads_set{0};

int usable_cores() {
#if defined(__linux__)
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof(set), &set) == 0)
        return CPU_COUNT(&set);
#endif
    return static_cast<int>(std::thread::hardware_concurrency());
}

// Those that no call has. They are not joined at exit, where Windows would wait for them for ever.
std::mutex idle_mutex;
Workers *idle = nullptr;

std::unique_ptr<Workers> take_idle() {
    std::lock_guard<std::mutex> lock(idle_mutex);
    return std::unique_ptr<Workers>(std::exchange(idle, nullptr));
}

// A child of fork() has none of the threads, so that it forgets them; nobody may hold the lock meanwhile.
void survive_fork() {
#if !defined(_WIN32)
    static const int registered = pthread_atfork([] { idle_mutex.lock(); }, [] { idle_mutex.unlock(); },
                                                 [] {
                                                     idle = nullptr;
                                                     idle_mutex.unlock();
                                                 });
    (void)registered;
#endif
}

} // namespace

void set_threads(int count) { threads_set = count; }

BorrowedWorkers::BorrowedWorkers() {
    survive_fork();
    const int threads = threads_set > 0 ? threads_set.load() : usable_cores();
    workers_ = take_idle();
    if (!workers_ || workers_->threads() != threads)
        workers_ = std::make_unique<Workers>(threads);
}

BorrowedWorkers::~BorrowedWorkers() {
    std::lock_guard<std::mutex> lock(idle_mutex);
    if (!idle)
        idle = workers_.release();
}

Workers::Workers(int threads) : wanted_(threads) {
    threads_.reserve(std::max(threads - 1, 0));
    try {
        for (int t = 1; t < threads; ++t)
            threads_.emplace_back([this] { serve(); });
    } catch (const std::system_error &) {
        // The system allows no more threads; those that run do all the work.
    }
}

Workers::~Workers() {
    {
        std::lock_guard<std::mutex> lock(mutex_);
        ending_ = true;
    }
    start_.notify_all();
    for (auto &thread : threads_)
        thread.join();
}

void Workers::work() {
    try {
        for (int i; (i = next_.fetch_add(1)) < count_;)
            (*task_)(i);
    } catch (...) { // run() throws it, where a caller can catch it
        std::lock_guard<std::mutex> lock(mutex_);
        failure_ = std::current_exception();
        next_ = count_;
    }
}

void Workers::serve() {
    unsigned seen = 0;
    for (;;) {
        // Loops follow each other within microseconds.
        for (int spin = 0; spin < SPINS && round_ == seen && !ending_; ++spin)
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

void Workers::run(int count, const std::function<void(int)> &task) {
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
    if (failure_)
        std::rethrow_exception(std::exchange(failure_, nullptr));
}

double Workers::sum(int count, const std::function<double(int)> &partial) {
    std::vector<double> partials(count);
    run(count, [&](int i) { partials[i] = partial(i); });
    double total = 0;
    for (double value : partials)
        total += value;
    return total;
}

} // namespace smokelift
