#include "arrays.h"

PYBIND11_MODULE(_core, module) {
    module.doc() =
        "Transport and velocity of smoke on a box of unit cells; see smokelift.velocity for units.";
    smokelift::register_transport(module);
    smokelift::register_velocity(module);
    smokelift::register_render(module);
}
