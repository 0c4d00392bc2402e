#include "collision/geometry/divide_faces.hpp"

#include <numeric>
#include <stdexcept>

#include "collision/base/message.hpp"

namespace nbd {

FaceDivision::FaceDivision(VerticesRef X, FacesRef F) : centroids_(F.rows(), 3), faces_(F.rows()) {
    if (F.rows() == 0) throw std::invalid_argument("a tree needs at least one face, the surface has none");
    for (Eigen::Index v = 0; v < X.rows(); ++v)
        if (!X.row(v).allFinite()) throw std::invalid_argument(message("vertex ", v, " is not finite"));
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        for (const int v : F.row(f))
            if (v < 0 || v >= X.rows())
                throw std::invalid_argument(message("face ", f, " refers to vertex ", v,
                                                    ", but the surface has ", X.rows(), " vertices"));
    for (Eigen::Index f = 0; f < F.rows(); ++f)
        centroids_.row(f) =
            (X.row(F(f, 0)).cast<double>() + X.row(F(f, 1)).cast<double>() + X.row(F(f, 2)).cast<double>()) /
            3;
    std::iota(faces_.begin(), faces_.end(), 0);
}

void FaceDivision::divide(std::span<int> faces, int parts,
                          const std::function<void(std::span<int>)>& part) const {
    if (parts <= 1) return part(faces);
    const int first = parts / 2;
    const std::size_t count =
        faces.size() * static_cast<std::size_t>(first) / static_cast<std::size_t>(parts);
    split(faces, count);
    divide(faces.first(count), first, part);
    divide(faces.subspan(count), parts - first, part);
}

}  // namespace nbd
