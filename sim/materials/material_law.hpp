#pragma once

#include <array>

#include "meshing/body/body.hpp"
#include "sim/materials/polar.hpp"

namespace nbd {

/// A material as the elements see it.
struct Moduli {
    MaterialLaw law = MaterialLaw::corotated;
    double mu = 0, lambda = 0;  // Lame parameters, Pa

    bool operator==(const Moduli&) const = default;
};

Moduli moduli_of(const Material& material);

/// The moduli of `lanes` elements.
struct LaneModuli {
    std::array<MaterialLaw, lanes> law;
    Lanes mu, lambda;
};

/// The energy density psi of isotropic materials and its derivatives, as functions of the principal stretches
/// sigma. In the axes of F = U diag(sigma) V^T, the stress P = dpsi/dF has the diagonal `stress`; a change dF
/// with entries H_ij there changes it
///   on the diagonal by     sum over j of A_ij H_jj,
///   off the diagonal by    flip_k (H_ij + H_ji) / 2 + twist_k (H_ij - H_ji) / 2,
/// where k is the third axis beside i and j [SmithDeGoesKim19].
struct PrincipalResponse {
    Lanes energy;                // J/m3, zero at rest
    PrincipalLanes stress;       // dpsi/dsigma, Pa
    SymmetricLanes A;            // second derivatives of psi, Pa
    PrincipalLanes flip, twist;  // Pa

    /// Replaces negative eigenvalues of the derivative of P by zero.
    void project() noexcept;
};

/// Of the corotated law, `twist` is the part that ElasticBody's usual tangent leaves out.
PrincipalResponse respond(const LaneModuli& moduli, const PrincipalLanes& sigma) noexcept;

/// What the laws call dilatation, of which lambda/2 times the square is a part of psi: sum (sigma - 1) of the
/// corotated one, det F - 1 of the Neo-Hookean one, the trace of Green's strain of the third.
struct Dilatation {
    Lanes value;
    PrincipalLanes slope;  // its derivatives by sigma
};
Dilatation dilatation(const LaneModuli& moduli, const PrincipalLanes& sigma) noexcept;

/// Adds what a pressure [Pa] on dilatation does to the stress and its derivatives, but not how the pressure
/// changes.
void add_pressure(const LaneModuli& moduli, const PrincipalLanes& sigma, const Lanes& pressure,
                  PrincipalResponse& response) noexcept;

}  // namespace nbd
