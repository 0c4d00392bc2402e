#include "meshing/cage/divide_edges.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

namespace nbd {
namespace {

class Divider {
 public:
    Divider(const TriMesh& surface, int vertices) {
        X_.resize(std::max<Eigen::Index>(vertices, surface.X.rows()), 3);
        X_.topRows(surface.X.rows()) = surface.X;
        count_ = surface.X.rows();
        for (int f = 0; f < surface.F.rows(); ++f)
            add({surface.F(f, 0), surface.F(f, 1), surface.F(f, 2)}, f);
    }

    void divide_longest() {
        const auto [length, a, b] = longest_.top();
        longest_.pop();
        const int middle = count_++;
        X_.row(middle) = (X_.row(a) + X_.row(b)) / 2;
        for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, a}}) {
            const int f = face_of_.at({from, to});
            std::array<int, 3> face = faces_[f];
            while (face[0] != from) std::ranges::rotate(face, face.begin() + 1);
            face_of_.erase({from, to});
            add({from, middle, face[2]}, f);
            add({middle, to, face[2]}, faces_.size());
        }
    }

    int count() const noexcept { return count_; }

    TriMesh mesh() const {
        TriMesh mesh{X_.topRows(count_), Faces(faces_.size(), 3)};
        for (std::size_t f = 0; f < faces_.size(); ++f)
            for (int c = 0; c < 3; ++c) mesh.F(f, c) = faces_[f][c];
        return mesh;
    }

 private:
    /// Puts a face at row f of the faces. Edges without an entry yet are queued once.
    void add(const std::array<int, 3>& face, int f) {
        if (f == static_cast<int>(faces_.size())) faces_.emplace_back();
        faces_[f] = face;
        for (std::size_t c = 0; c < 3; ++c) {
            const int from = face[c], to = face[(c + 1) % 3];
            const bool is_new = face_of_.insert_or_assign({from, to}, f).second;
            if (is_new && !face_of_.contains({to, from}))
                longest_.emplace((X_.row(from) - X_.row(to)).squaredNorm(), std::min(from, to),
                                 std::max(from, to));
        }
    }

    Nodes X_;
    int count_ = 0;
    std::vector<std::array<int, 3>> faces_;
    std::map<std::pair<int, int>, int> face_of_;  // by directed edge
    std::priority_queue<std::tuple<double, int, int>> longest_;
};

}  // namespace

TriMesh divide_longest_edges(const TriMesh& surface, int vertices) {
    Divider divider(surface, vertices);
    while (divider.count() < vertices) divider.divide_longest();
    return divider.mesh();
}

}  // namespace nbd
