#include "python.h"

PYBIND11_MODULE(_core, module) {
    using namespace pybind11::literals;
    module.doc() =
        R"(Transport, velocity and rendering of smoke on a box of unit cells, compiled from ``cpp/``.

        Arrays are float32, C-contiguous, ``[x, y, z]``. What is only read is converted if it is not, what is written is
        refused. ``cells`` have the shape (nx, ny, nz). ``faces`` are the normal components on x, y and z faces, arrays
        of shape (nx+1, ny, nz), (nx, ny+1, nz) and (nx, ny, nz+1). Velocities are displacements in cells per frame.
        ``closed`` says which sides of the box are walls, in the order x-, x+, y-, y+, z-, z+.

        The renderer's grid has a border of one voxel. A volume is (nx+2, ny+2, nz+2, 1 + channels): by voxel the
        extinction in 1/m and the in-scattered radiance of each channel, or derivatives by these. Of its diffuse light
        arrays over blocks of voxels are (fields, bx, by, bz). What is linear across a block has four fields: the mean,
        and the slopes along x, y and z, which are the differences across a block.

        Functions raise ValueError for arrays whose shapes do not belong together.)";
    module.def(
        "set_threads", &smokelift::set_threads, "count"_a,
        R"(Set the number of threads of every call from now on; 0, as at first, takes all cores of the process.

        Results do not depend on it.)");
    smokelift::register_transport(module);
    smokelift::register_velocity(module);
    smokelift::register_render(module);
    smokelift::register_pictures(module);
    smokelift::register_density(module);
}
