#include "apps/clip/clip.hpp"

#include <Eigen/Geometry>

namespace nbd {

void smooth_normals(VerticesRef x, FacesRef F, Vertices& n) {
    Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> sum(x.rows(), 3);
    sum.setZero();
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
        const Eigen::RowVector3d a = x.row(F(f, 0)).cast<double>();
        const Eigen::RowVector3d normal =
            (x.row(F(f, 1)).cast<double>() - a).cross(x.row(F(f, 2)).cast<double>() - a);
        for (int c = 0; c < 3; ++c) sum.row(F(f, c)) += normal;
    }
    n.resize(x.rows(), 3);
    for (Eigen::Index v = 0; v < x.rows(); ++v) {
        const double length = sum.row(v).norm();
        n.row(v) = length > 0 ? (sum.row(v) / length).cast<float>().eval() : Eigen::RowVector3f(0, 0, 1);
    }
}

}  // namespace nbd
