"""The velocity that carries one density into the next.

Two densities say how fast smoke moves along their gradient; that the flow has no divergence and is smooth
says the rest. The estimate minimises

    sum W (r + g . (u - u_k))^2 + R(u - u_p) + irrotational * sum outside the smoke of |curl u|^2

subject to div u = 0, over velocities u on voxel faces, in voxels per frame, with

    r = (after(x) - before(x - u_k(x))) / s       what the estimate so far, u_k, leaves unexplained
    g = grad (after(x) + before(x - u_k(x))) / 2s
    s = root mean square of |grad| inside the smoke
    W = 0 where smoke enters (`sources`), else 1
    u_p = t prediction + P(momentum)              both fitted with a few numbers (`momentum`)
    R(v) = k (smoothness * sum |grad curl v|^2 + kinetic * sum |v|^2)    (|grad v|^2 in method "paper")

from coarse to fine grids (`pyramid`), linearised anew after every solve (`linear`, `estimate`). Before and after are
the densities that `noise` and `contrast` make of the given ones. Dividing by s makes every weight independent of the
scales of density, space and time. k grows as u_p proves right: it is the given share of the change over the one that
u_p leaves unexplained.

Sources: Cen, Zhang, Liang (2023), Entropy 25, 1348, section 3.3 and algorithm 5 (method "paper"); Chambolle
and Pock (2011), J. Math. Imaging Vis. 40, 120; Eckert et al. (2019), ACM TOG 38(6), 239 (ScalarFlow).
"""

from smokelift.transport import Velocity
from smokelift.velocity.estimate import estimate_velocity, predict_velocity
from smokelift.velocity.settings import VelocitySettings

__all__ = ["Velocity", "VelocitySettings", "estimate_velocity", "predict_velocity"]
