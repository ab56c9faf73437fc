// Arrays of floats over a box, [x, y, z] with z fastest, and velocities on the faces of its cells (MAC grid).
#pragma once

#include <array>
#include <cstddef>
#include <new>
#include <utility>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

// Hot loops are compiled for several instruction sets; the loader picks one. Elsewhere: the compiler's
// target.
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 12 && defined(__x86_64__) && defined(__linux__)
#define SMOKELIFT_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define SMOKELIFT_CLONES
#endif

#if defined(__GNUC__)
#define SMOKELIFT_INLINE inline __attribute__((always_inline))
#define SMOKELIFT_INLINE_LAMBDA __attribute__((always_inline))
#else
#define SMOKELIFT_INLINE inline
#define SMOKELIFT_INLINE_LAMBDA
#endif

namespace smokelift {

using Shape = std::array<int, 3>;

inline std::size_t volume(const Shape &n) { return std::size_t(n[0]) * n[1] * n[2]; }

// A view: does not own its data.
template <class T> struct Grid {
    T *data = nullptr;
    Shape n{};

    T *row(int i, int j) const { return data + (std::size_t(i) * n[1] + j) * n[2]; }
    std::size_t slab_size() const { return std::size_t(n[1]) * n[2]; }
    operator Grid<const T>() const { return {data, n}; }
};

using In = Grid<const float>;
using Out = Grid<float>;

// Three arrays of different shapes that belong together; `shapes` says how they lie on the cells.
using In3 = std::array<In, 3>;
using Out3 = std::array<Out, 3>;

// The elements with the first index i.
template <class T> Grid<T> slab(const Grid<T> &a, int i) { return {a.row(i, 0), {1, a.n[1], a.n[2]}}; }

inline In3 read(const Out3 &a) { return {In(a[0]), In(a[1]), In(a[2])}; }

// Shapes of the normal velocities on x, y and z faces of a box of `n` cells.
inline std::array<Shape, 3> face_shapes(const Shape &n) {
    return {Shape{n[0] + 1, n[1], n[2]}, Shape{n[0], n[1] + 1, n[2]}, Shape{n[0], n[1], n[2] + 1}};
}

// Shapes of quantities on edges along x, y and z (curl of a face velocity).
inline std::array<Shape, 3> edge_shapes(const Shape &n) {
    return {Shape{n[0], n[1] + 1, n[2] + 1}, Shape{n[0] + 1, n[1], n[2] + 1},
            Shape{n[0] + 1, n[1] + 1, n[2]}};
}

// Leaves numbers uninitialised, so that the threads that fill an array are also those that first touch its
// pages. A large one has pages of its own, large too where the system has them: given back as soon as it is
// done with.
template <class T> struct LazyPages {
    using value_type = T;

    LazyPages() = default;
    template <class U> LazyPages(const LazyPages<U> &) {}

    T *allocate(std::size_t n) {
#if defined(__linux__)
        if (large(n)) {
            void *memory =
                mmap(nullptr, n * sizeof(T), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
            if (memory == MAP_FAILED)
                throw std::bad_alloc();
            madvise(memory, n * sizeof(T), MADV_HUGEPAGE);
            return static_cast<T *>(memory);
        }
#endif
        return static_cast<T *>(::operator new(n * sizeof(T)));
    }
    void deallocate(T *memory, std::size_t n) {
#if defined(__linux__)
        if (large(n)) {
            munmap(memory, n * sizeof(T));
            return;
        }
#endif
        (void)n;
        ::operator delete(memory);
    }
    static bool large(std::size_t n) { return n * sizeof(T) >= std::size_t(1) << 22; }
    template <class U> void construct(U *) {}
    template <class U, class... V> void construct(U *at, V &&...values) {
        ::new (static_cast<void *>(at)) U(std::forward<V>(values)...);
    }
    template <class U> bool operator==(const LazyPages<U> &) const { return true; }
    template <class U> bool operator!=(const LazyPages<U> &) const { return false; }
};

using Values = std::vector<float, LazyPages<float>>;

// Owns one array; what it holds at first is not defined.
class Field {
public:
    Field() = default;
    explicit Field(const Shape &n) : data_(volume(n)), n_(n) {}
    operator Out() { return {data_.data(), n_}; }
    operator In() const { return {data_.data(), n_}; }
    Out out() { return *this; }
    In in() const { return *this; }
    Values &data() { return data_; }

private:
    Values data_;
    Shape n_{};
};

// Owns three arrays in one block, so that sums and dot products are one loop; not defined at first either.
class Field3 {
public:
    Field3() = default;
    explicit Field3(const std::array<Shape, 3> &shapes)
        : data_(volume(shapes[0]) + volume(shapes[1]) + volume(shapes[2])), shapes_(shapes) {}

    Out3 out() {
        float *p = data_.data();
        Out3 views;
        for (int c = 0; c < 3; ++c) {
            views[c] = {p, shapes_[c]};
            p += volume(shapes_[c]);
        }
        return views;
    }
    In3 in() const { return read(const_cast<Field3 *>(this)->out()); }
    float *data() { return data_.data(); }
    const float *data() const { return data_.data(); }
    std::size_t size() const { return data_.size(); }
    const std::array<Shape, 3> &shapes() const { return shapes_; }

private:
    Values data_;
    std::array<Shape, 3> shapes_{};
};

// Which sides of the box are walls, in the order x-, x+, y-, y+, z-, z+. The others are open.
using Closed = std::array<bool, 6>;

} // namespace smokelift
