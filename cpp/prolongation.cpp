#include "halves.h"

#include <algorithm>
#include <vector>

namespace smokelift {
namespace {

// A fine cell across an axis: its coarse one, that one's neighbors (itself at an end) and on which side it
// lies.
struct Half {
    Half(int fine, int coarse_cells)
        : middle(fine / 2), low(std::max(middle - 1, 0)), high(std::min(middle + 1, coarse_cells - 1)),
          side(fine % 2 ? 1.0f : -1.0f) {}

    int middle, low, high;
    float side;
};

// The mean over one half of a cell of the parabola that has the means of the cell and of its neighbors.
float half_mean(float low, float middle, float high, float side) { return middle + side * (high - low) / 8; }

SMOKELIFT_CLONES
void mix_rows(const float *__restrict low, const float *__restrict middle, const float *__restrict high,
              float side, float *__restrict out, int n) {
    for (int k = 0; k < n; ++k)
        out[k] = half_mean(low[k], middle[k], high[k], side);
}

// The component along an axis on the fine faces of coarse faces, at one fine place along x.
void fill_coarse_faces(const In &from, const Out &to, int along, int i) {
    if (along == 0 && i % 2)
        return;
    const int n = from.n[2];
    const Half x(i, from.n[0]);
    std::vector<float> low(n), middle(n), high(n), row(n);
    const auto across_x = [&](int j, std::vector<float> &out) {
        if (along == 0)
            std::copy_n(from.row(i / 2, j), n, out.data());
        else
            mix_rows(from.row(x.low, j), from.row(x.middle, j), from.row(x.high, j), x.side, out.data(), n);
    };
    for (int j = 0; j < to.n[1]; j += along == 1 ? 2 : 1) {
        if (along == 1) {
            across_x(j / 2, row);
        } else {
            const Half y(j, from.n[1]);
            across_x(y.low, low), across_x(y.middle, middle), across_x(y.high, high);
            mix_rows(low.data(), middle.data(), high.data(), y.side, row.data(), n);
        }
        float *out = to.row(i, j);
        if (along == 2) {
            for (int k = 0; k < n; ++k)
                out[2 * k] = row[k];
        } else {
            for (int k = 0; k < 2 * n; ++k) {
                const Half z(k, n);
                out[k] = half_mean(row[z.low], row[z.middle], row[z.high], z.side);
            }
        }
    }
}

// The twelve faces inside of a coarse cell, from the 24 on its sides: equations 5 to 8 of Toth and Roe (2002)
// for cubes.
struct CoarseCell {
    // `u`, `v` and `w` of [i, j, k] are what leaves and enters through the x, y and z sides of the eighth [i,
    // j, k].
    float u[2][2][2], v[2][2][2], w[2][2][2];

    void fill(const StaggeredOut &fine, int i, int j, int k) const {
        float u_xx = 0, v_yy = 0, w_zz = 0, u_xyz = 0, v_xyz = 0, w_xyz = 0;
        for (int a = 0; a < 2; ++a)
            for (int b = 0; b < 2; ++b)
                for (int c = 0; c < 2; ++c) {
                    const float x = sign(a), y = sign(b), z = sign(c);
                    u_xx += x * (y * v[a][b][c] + z * w[a][b][c]);
                    v_yy += y * (x * u[a][b][c] + z * w[a][b][c]);
                    w_zz += z * (x * u[a][b][c] + y * v[a][b][c]);
                    u_xyz += x * y * z * u[a][b][c];
                    v_xyz += x * y * z * v[a][b][c];
                    w_xyz += x * y * z * w[a][b][c];
                }
        for (int a = 0; a < 2; ++a)
            for (int b = 0; b < 2; ++b) {
                const float p = sign(a), q = sign(b);
                fine[0].row(2 * i + 1, 2 * j + a)[2 * k + b] =
                    (u[0][a][b] + u[1][a][b]) / 2 + u_xx / 8 + (q * v_xyz + p * w_xyz) / 16;
                fine[1].row(2 * i + a, 2 * j + 1)[2 * k + b] =
                    (v[a][0][b] + v[a][1][b]) / 2 + v_yy / 8 + (p * w_xyz + q * u_xyz) / 16;
                fine[2].row(2 * i + a, 2 * j + b)[2 * k + 1] =
                    (w[a][b][0] + w[a][b][1]) / 2 + w_zz / 8 + (q * u_xyz + p * v_xyz) / 16;
            }
    }

    static float sign(int side) { return side ? 1.0f : -1.0f; }
};

} // namespace

void prolong(const StaggeredIn &coarse, const StaggeredOut &fine, Workers &workers) {
    for (int along = 0; along < 3; ++along)
        workers.run(fine[along].n[0],
                    [&](int i) { fill_coarse_faces(coarse[along], fine[along], along, i); });
    const auto [nx, ny, nz] = coarse.box.cells;
    workers.run(nx, [&, ny = ny, nz = nz](int i) {
        CoarseCell cell;
        for (int j = 0; j < ny; ++j)
            for (int k = 0; k < nz; ++k) {
                for (int a = 0; a < 2; ++a)
                    for (int b = 0; b < 2; ++b)
                        for (int c = 0; c < 2; ++c) {
                            cell.u[a][b][c] = fine[0].row(2 * (i + a), 2 * j + b)[2 * k + c];
                            cell.v[a][b][c] = fine[1].row(2 * i + a, 2 * (j + b))[2 * k + c];
                            cell.w[a][b][c] = fine[2].row(2 * i + a, 2 * j + b)[2 * (k + c)];
                        }
                cell.fill(fine, i, j, k);
            }
    });
}

} // namespace smokelift
