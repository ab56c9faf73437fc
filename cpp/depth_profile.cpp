#include "depth_profile.h"

#include <algorithm>
#include <cmath>

namespace smokelift {
namespace {

// Where a coordinate lies among ascending nodes. Neighbouring voxels ask for neighbouring places.
class Node {
public:
    explicit Node(const std::vector<double> &nodes) : nodes_(nodes) {}

    void move_to(double place) {
        const int last = int(nodes_.size()) - 1;
        while (low_ < last && nodes_[low_ + 1] <= place)
            ++low_;
        while (low_ > 0 && nodes_[low_] > place)
            --low_;
        high_ = std::min(low_ + 1, last);
        share_ =
            high_ == low_ ? 0 : std::clamp((place - nodes_[low_]) / (nodes_[high_] - nodes_[low_]), 0.0, 1.0);
    }
    int low() const { return low_; }
    int high() const { return high_; }
    double share() const { return share_; }

private:
    const std::vector<double> &nodes_;
    int low_ = 0, high_ = 0;
    double share_ = 0;
};

class Reader {
public:
    explicit Reader(const HeightTable &table) : table_(table), row_(table.heights), column_(table.laterals) {}

    double at(double height, double lateral) {
        row_.move_to(height);
        if (table_.laterals.size() == 1)
            return mixed(row_, table_.values[row_.low()], table_.values[row_.high()]);
        column_.move_to(lateral);
        const std::size_t columns = table_.laterals.size();
        const double *const low = table_.values + row_.low() * columns;
        const double *const high = table_.values + row_.high() * columns;
        return mixed(row_, mixed(column_, low[column_.low()], low[column_.high()]),
                     mixed(column_, high[column_.low()], high[column_.high()]));
    }

private:
    static double mixed(const Node &at, double low, double high) { return low + at.share() * (high - low); }

    const HeightTable &table_;
    Node row_, column_;
};

} // namespace

void find_profile(const DepthProfile &profile, Mask voxels, const std::vector<std::size_t> &first,
                  const SeenAt &seen_at, float *shapes, float *widths, Workers &workers) {
    std::vector<float> balls(first.back()), aside(first.back());
    const auto read = [&](const double *picture, std::vector<float> &values) {
        read_bilinearly(picture, profile.rows, profile.columns, seen_at.rows, seen_at.columns, values.size(),
                        values.data(), workers);
    };
    read(profile.balls, balls), read(profile.aside, aside);
    workers.run(voxels.n[0], [&](int i) {
        std::size_t at = first[i];
        if (at == first[i + 1])
            return;
        Reader middle(profile.middle), across(profile.across), apart(profile.apart);
        for (int j = 0; j < voxels.n[1]; ++j) {
            const unsigned char *const row = voxels.row(i, j);
            const auto along = [&](int direction, int k) {
                const auto &d = profile.directions[direction];
                return profile.places[0][i] * d[0] + profile.places[1][j] * d[1] +
                       profile.places[2][k] * d[2];
            };
            for (int k = first_marked(row, voxels.n[2]); k < voxels.n[2]; ++k) {
                if (!row[k])
                    continue;
                const double lateral = along(0, k), height = along(2, k);
                const double behind = apart.at(height, lateral);
                const double spread = std::sqrt(across.at(height, lateral) * balls[at] + behind * behind);
                const double width = profile.scale * std::max(spread, profile.least);
                const double distance = std::abs(along(1, k) - middle.at(height, lateral) - aside[at]);
                shapes[at] = std::exp(-std::pow(float(distance / width), float(profile.flatness)));
                widths[at++] = float(width);
            }
        }
    });
}

} // namespace smokelift
