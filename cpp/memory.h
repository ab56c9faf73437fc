// Memory for large arrays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <utility>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace smokelift {

// Leaves numbers uninitialized, so that the threads that fill an array are also those that first touch its
// pages. A large array has pages of its own, which hold zeros and go back to the system with the array. They
// are large pages where the system has them: in small ones the look-ups of rays would cost as much again.
template <class T> struct LazyPages {
    static constexpr std::size_t LARGE_PAGE = std::size_t(1) << 21; // bytes, of most systems (by definition)

    using value_type = T;

    LazyPages() = default;
    template <class U> LazyPages(const LazyPages<U> &) {}

    T *allocate(std::size_t n) {
#if defined(__linux__)
        if (is_large(n))
            return static_cast<T *>(map(n * sizeof(T)));
#endif
        return static_cast<T *>(::operator new(n * sizeof(T)));
    }
    void deallocate(T *memory, std::size_t n) {
#if defined(__linux__)
        if (is_large(n)) {
            munmap(memory, n * sizeof(T));
            return;
        }
#endif
        (void)n;
        ::operator delete(memory);
    }
    // From one large page on: in smaller pages the rays through a volume of 64 x 64 x 96 take a third longer.
    static bool is_large(std::size_t n) { return n * sizeof(T) >= LARGE_PAGE; }
    static bool starts_as_zero(std::size_t n) {
#if defined(__linux__)
        return is_large(n);
#else
        return (void)n, false;
#endif
    }
    template <class U> void construct(U *) {}
    template <class U, class... V> void construct(U *at, V &&...values) {
        ::new (static_cast<void *>(at)) U(std::forward<V>(values)...);
    }
    template <class U> bool operator==(const LazyPages<U> &) const { return true; }
    template <class U> bool operator!=(const LazyPages<U> &) const { return false; }

private:
#if defined(__linux__)
    // Begins at the boundary of a large page; what lies before it and behind the end is given back at once.
    static void *map(std::size_t bytes) {
        const auto small = std::size_t(sysconf(_SC_PAGESIZE));
        void *memory =
            mmap(nullptr, bytes + LARGE_PAGE, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (memory == MAP_FAILED)
            throw std::bad_alloc();
        const auto begin = reinterpret_cast<std::uintptr_t>(memory), end = begin + bytes + LARGE_PAGE;
        const std::uintptr_t first = (begin + LARGE_PAGE - 1) / LARGE_PAGE * LARGE_PAGE;
        const std::uintptr_t last = (first + bytes + small - 1) / small * small;
        if (first > begin)
            munmap(memory, first - begin);
        if (end > last)
            munmap(reinterpret_cast<void *>(last), end - last);
        madvise(reinterpret_cast<void *>(first), bytes, MADV_HUGEPAGE);
        return reinterpret_cast<void *>(first);
    }
#endif
};

using Values = std::vector<float, LazyPages<float>>;

} // namespace smokelift
