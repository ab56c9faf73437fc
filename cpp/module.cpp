#include "python.h"

PYBIND11_MODULE(_core, module) {
    using namespace pybind11::literals;
    module.doc() = "Transport, velocity and rendering of smoke on a box of unit cells; see _core.pyi.";
    module.def("set_threads", &smokelift::set_threads, "count"_a);
    smokelift::register_transport(module);
    smokelift::register_velocity(module);
    smokelift::register_render(module);
    smokelift::register_pictures(module);
    smokelift::register_density(module);
}
