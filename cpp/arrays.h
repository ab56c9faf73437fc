// NumPy arrays in and out.
#pragma once

#include "grid.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <stdexcept>

namespace smokelift {

namespace py = pybind11;

using Array = py::array_t<float, py::array::c_style | py::array::forcecast>;
using Array3 = std::array<Array, 3>;

inline Shape shape_of(const Array &a) {
    if (a.ndim() != 3 || a.size() == 0)
        throw std::invalid_argument("expected a three-dimensional array that is not empty.");
    return {int(a.shape(0)), int(a.shape(1)), int(a.shape(2))};
}

inline In view(const Array &a) { return {a.data(), shape_of(a)}; }

inline In view(const Array &a, const Shape &expected) {
    if (shape_of(a) != expected)
        throw std::invalid_argument("the arrays do not have shapes that belong together.");
    return view(a);
}

inline In3 view(const Array3 &a, const std::array<Shape, 3> &expected) {
    return {view(a[0], expected[0]), view(a[1], expected[1]), view(a[2], expected[2])};
}

// The cells between the faces of a velocity.
inline Shape cells_of(const Array3 &faces) {
    const Shape x = shape_of(faces[0]);
    return {x[0] - 1, x[1], x[2]};
}

inline In3 faces_view(const Array3 &a) { return view(a, face_shapes(cells_of(a))); }

// Not defined at first; its memory goes back to the system with it, however small the others around it.
inline Array new_array(const Shape &n) {
    auto values = std::make_unique<Values>(volume(n));
    const py::capsule owner(values.get(), [](void *p) { delete static_cast<Values *>(p); });
    float *data = values.release()->data();
    return Array(std::vector<py::ssize_t>{n[0], n[1], n[2]}, data, owner);
}

inline Array3 new_arrays(const std::array<Shape, 3> &n) {
    return {new_array(n[0]), new_array(n[1]), new_array(n[2])};
}

inline Array3 copy_of(const In3 &a) {
    Array3 result;
    for (int c = 0; c < 3; ++c) {
        result[c] = new_array(a[c].n);
        std::copy_n(a[c].data, volume(a[c].n), result[c].mutable_data());
    }
    return result;
}

inline Out out(Array &a) { return {a.mutable_data(), shape_of(a)}; }
inline Out3 out(Array3 &a) { return {out(a[0]), out(a[1]), out(a[2])}; }

void register_transport(py::module_ &module);
void register_velocity(py::module_ &module);
void register_render(py::module_ &module);

} // namespace smokelift
