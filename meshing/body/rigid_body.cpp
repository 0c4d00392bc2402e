#include "meshing/body/rigid_body.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "collision/geometry/far_origin.hpp"
#include "meshing/body/embed.hpp"
#include "meshing/surface/material_fill.hpp"

namespace nbd {
namespace {

/// The mean of z z^T over a tetrahedron of what a closed surface encloses, counted where that is. z: [n, 4]
/// barycentric coordinates of the vertices; a sum over tetrahedra between each face and the point `apex`.
Eigen::Matrix4d integrated_products(const Eigen::Matrix<double, Eigen::Dynamic, 4>& z, const Faces& F,
                                    const Eigen::Vector4d& apex) {
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
        Eigen::Matrix4d corners;  // columns
        corners << apex, z.row(F(f, 0)).transpose(), z.row(F(f, 1)).transpose(), z.row(F(f, 2)).transpose();
        const Eigen::Vector4d total = corners.rowwise().sum();
        sum += corners.determinant() / 20 * (corners * corners.transpose() + total * total.transpose());
    }
    return sum;
}

}  // namespace

double set_inertia(TetMesh& tets, const RigidInertia& inertia) {
    const double share = tets.filled(0), m = inertia.mass;
    if (!(m > 0) || !std::isfinite(m))
        throw std::invalid_argument(fmt::format("a mass of {} kg; allowed: more than 0", m));
    Eigen::Matrix4d corners;  // columns (corner, 1)
    for (int k = 0; k < 4; ++k) corners.col(k) << tets.X.row(tets.T(0, k)).transpose(), 1;
    // Of places (x, 1): the mean of their products, with the centre of mass in the last column.
    const Eigen::Matrix4d evenly =
        corners * (coordinate_products(tets.fill.row(0)) / share) * corners.transpose();
    const Eigen::Vector3d even_centre = evenly.topRightCorner<3, 1>(),
                          centre = inertia.centre.value_or(even_centre);
    Eigen::Matrix3d spread = evenly.topLeftCorner<3, 3>() - even_centre * even_centre.transpose();
    if (inertia.moments) {
        constexpr double rounding = 1e-9;
        const Eigen::Matrix3d &given = *inertia.moments, I = (given + given.transpose()) / 2;
        if (!given.allFinite() || (given - I).norm() > rounding * I.norm())
            throw std::invalid_argument("moments that are not finite, or no symmetric matrix");
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(I);
        const Eigen::Vector3d principal = solver.eigenvalues();  // ascending
        if (!(principal[0] > rounding * principal[2]) ||
            principal[2] > (1 + rounding) * (principal[0] + principal[1]))
            throw std::invalid_argument(
                fmt::format("principal moments {:.6g}, {:.6g} and {:.6g} kg m2; allowed: more than 0, none "
                            "larger than the two others together",
                            principal[0], principal[1], principal[2]));
        const Eigen::Vector3d along = (principal.sum() / 2 - principal.array()).max(0.0).matrix() / m;
        spread = solver.eigenvectors() * along.asDiagonal() * solver.eigenvectors().transpose();
    }
    Eigen::Matrix4d products;
    products << spread + centre * centre.transpose(), centre, centre.transpose(), 1;
    const Eigen::Matrix4d inverse = corners.inverse();
    products = share * inverse * products * inverse.transpose();
    if (!(products.minCoeff() >= 0))
        throw std::invalid_argument(
            "a centre of mass and moments that reach out of the tetrahedron of the rigid body, three times as "
            "large as its surface; allowed: those of masses about where the surface is");
    tets.fill.row(0) = fill_of_products(products);
    return m / (share * volume(tets, 0));
}

bool is_rigid(const TetMesh& tets) noexcept {
    return tets.T.rows() == 1 && tets.fill.rows() == 1 && !tets.is_quadratic();
}

Material rigid_material(const TetMesh& tets, double density) {
    const Eigen::RowVector3d size = tets.X.colwise().maxCoeff() - tets.X.colwise().minCoeff();
    return {.young = density * size.norm() / 3 * rigid_acceleration / rigid_strain,
            .poisson = 0,
            .density = density,
            .rayleigh_mass = 0,
            .rayleigh_stiffness = 0};
}

Body make_rigid_body(std::string name, TriMesh surface, double density) {
    check_material({.density = density});
    Body body;
    body.name = std::move(name);
    body.origin = far_origin(surface.X, surface.F);
    surface.X.rowwise() -= body.origin.transpose();
    const Eigen::RowVector3d low = surface.X.colwise().minCoeff(), high = surface.X.colwise().maxCoeff();
    const Eigen::RowVector3d centre = (low + high) / 2, half = (high - low) / 2;
    if (!(half.minCoeff() > 0))
        throw std::invalid_argument("a rigid body needs a surface that encloses a volume; this one is flat");
    // The smallest that holds the box, but for a little room for rounding.
    constexpr double room = 1.001;
    Eigen::Matrix<double, 4, 3> alternate;
    alternate << 1, 1, 1, -1, -1, 1, -1, 1, -1, 1, -1, -1;
    body.tets.X = ((3 * room * alternate * half.asDiagonal()).rowwise() + centre);
    body.tets.T.resize(1, 4);
    body.tets.T << 0, 1, 2, 3;
    if (volume(body.tets, 0) < 0) body.tets.T << 0, 2, 1, 3;
    body.W = embed(body.tets, surface.X, {.only_inside = true});
    const Eigen::Matrix<double, Eigen::Dynamic, 4> z =
        Eigen::MatrixXd(body.W)(Eigen::all, body.tets.T.row(0).transpose());
    const Eigen::Matrix4d products = integrated_products(z, surface.F, Eigen::Vector4d::Constant(0.25));
    const double share = products.sum();
    constexpr double least_share = 1e-9;  // what body files allow
    if (!(share > least_share))
        throw std::invalid_argument(
            fmt::format("a rigid body needs a surface that encloses a volume; this one encloses {:.3g} m3",
                        share * volume(body.tets, 0)));
    body.tets.fill.resize(1, 10);
    body.tets.fill.row(0) = fill_of_products(products);
    body.material = rigid_material(body.tets, density);
    body.surface = std::move(surface);
    check_body(body);
    return body;
}

Body make_rigid_body(std::string name, TriMesh surface, RigidInertia inertia) {
    Body body = make_rigid_body(std::move(name), std::move(surface), Material{}.density);
    if (inertia.centre) *inertia.centre -= body.origin;
    const double density = set_inertia(body.tets, inertia);
    check_material({.density = density});
    body.material = rigid_material(body.tets, density);
    check_body(body);
    return body;
}

}  // namespace nbd
