#include "sim/materials/material_law.hpp"

#include <algorithm>

namespace nbd {
namespace {

/// The rotation is undefined where two stretches add up to zero; its derivative is bounded there.
constexpr double least_sum = 0.01;

// The three laws. Each agrees with linear elasticity of the same Lame parameters for small strains.

/// psi = mu sum (sigma - 1)^2 + lambda/2 (sum (sigma - 1))^2 [MuellerGross04].
PrincipalResponse corotated(const Lanes& mu, const Lanes& lambda, const PrincipalLanes& s) noexcept {
    const Lanes trace = s[0] + s[1] + s[2] - 3;
    PrincipalResponse r;
    r.energy = mu * ((s[0] - 1).square() + (s[1] - 1).square() + (s[2] - 1).square()) +
               0.5 * lambda * trace.square();
    for (std::size_t i = 0; i < 3; ++i) r.stress[i] = 2 * mu * (s[i] - 1) + lambda * trace;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        r.A.diagonal[i] = 2 * mu + lambda;
        r.A.off[i] = lambda;
        r.flip[i] = 2 * mu;
        r.twist[i] = (r.stress[j] + r.stress[k]) / (s[j] + s[k]).max(least_sum);
    }
    return r;
}

/// psi = mu'/2 (|F|^2 - 3) + lambda'/2 (det F - alpha)^2 - mu'/2 log(|F|^2 + 1) [SmithDeGoesKim18].
PrincipalResponse stable_neo_hookean(const Lanes& lame_mu, const Lanes& lame_lambda,
                                     const PrincipalLanes& s) noexcept {
    const Lanes mu = 4.0 / 3.0 * lame_mu, lambda = lame_lambda + 5.0 / 6.0 * lame_mu,
                alpha = 1 + 0.75 * mu / lambda;
    const Lanes growth = s[0].square() + s[1].square() + s[2].square() - 3;
    const Lanes size = growth + 4;  // |F|^2 + 1
    const Lanes swelling = s[0] * s[1] * s[2] - 1, beyond = swelling + 1 - alpha;
    const Lanes k = mu * (1 - 1 / size), bend = 2 * mu / size.square();
    PrincipalResponse r;
    r.energy =
        0.5 * mu * (growth - (growth / 4).log1p()) + 0.5 * lambda * swelling.square() - 0.75 * mu * swelling;
    const PrincipalLanes area{s[1] * s[2], s[2] * s[0], s[0] * s[1]};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, l = (i + 2) % 3;
        r.stress[i] = k * s[i] + lambda * beyond * area[i];
        r.A.diagonal[i] = k + bend * s[i].square() + lambda * area[i].square();
        r.A.off[i] = bend * s[j] * s[l] + lambda * (area[j] * area[l] + beyond * s[i]);
        r.flip[i] = k - lambda * beyond * s[i];
        r.twist[i] = k + lambda * beyond * s[i];
    }
    return r;
}

/// psi = mu sum e^2 + lambda/2 (sum e)^2, where e = (sigma^2 - 1) / 2.
PrincipalResponse st_venant_kirchhoff(const Lanes& mu, const Lanes& lambda,
                                      const PrincipalLanes& s) noexcept {
    const PrincipalLanes e{0.5 * (s[0].square() - 1), 0.5 * (s[1].square() - 1), 0.5 * (s[2].square() - 1)};
    const Lanes pressure = lambda * (e[0] + e[1] + e[2]);
    PrincipalResponse r;
    r.energy = mu * (e[0].square() + e[1].square() + e[2].square()) + 0.5 * pressure * (e[0] + e[1] + e[2]);
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
        r.stress[i] = s[i] * (2 * mu * e[i] + pressure);
        r.A.diagonal[i] = mu * (3 * s[i].square() - 1) + lambda * s[i].square() + pressure;
        r.A.off[i] = lambda * s[j] * s[k];
        const Lanes both = s[j].square() + s[k].square() - 1, product = s[j] * s[k];
        r.flip[i] = mu * (both + product) + pressure;
        r.twist[i] = mu * (both - product) + pressure;
    }
    return r;
}

using Mask = Eigen::Array<bool, lanes, 1>;

void take(const Mask& mask, const Lanes& from, Lanes& to) noexcept { to = mask.select(from, to); }

void take(const Mask& mask, const PrincipalLanes& from, PrincipalLanes& to) noexcept {
    for (std::size_t i = 0; i < 3; ++i) take(mask, from[i], to[i]);
}

void take(const Mask& mask, const PrincipalResponse& from, PrincipalResponse& to) noexcept {
    take(mask, from.energy, to.energy);
    take(mask, from.stress, to.stress);
    take(mask, from.A.diagonal, to.A.diagonal);
    take(mask, from.A.off, to.A.off);
    take(mask, from.flip, to.flip);
    take(mask, from.twist, to.twist);
}

PrincipalResponse respond(MaterialLaw law, const LaneModuli& m, const PrincipalLanes& sigma) noexcept {
    switch (law) {
        case MaterialLaw::stable_neo_hookean:
            return stable_neo_hookean(m.mu, m.lambda, sigma);
        case MaterialLaw::st_venant_kirchhoff:
            return st_venant_kirchhoff(m.mu, m.lambda, sigma);
        case MaterialLaw::corotated:
            break;
    }
    return corotated(m.mu, m.lambda, sigma);
}

}  // namespace

Moduli moduli_of(const Material& material) {
    const double E = material.young, nu = material.poisson;
    return {.law = material.law, .mu = E / (2 * (1 + nu)), .lambda = E * nu / ((1 + nu) * (1 - 2 * nu))};
}

void PrincipalResponse::project() noexcept {
    clamp_eigenvalues(A);
    for (std::size_t i = 0; i < 3; ++i) {
        flip[i] = flip[i].max(0.0);
        twist[i] = twist[i].max(0.0);
    }
}

PrincipalResponse respond(const LaneModuli& moduli, const PrincipalLanes& sigma) noexcept {
    const MaterialLaw first = moduli.law[0];
    PrincipalResponse result = respond(first, moduli, sigma);
    for (const MaterialLaw law :
         {MaterialLaw::corotated, MaterialLaw::stable_neo_hookean, MaterialLaw::st_venant_kirchhoff}) {
        Mask mask;
        for (std::size_t l = 0; l < lanes; ++l) mask[l] = moduli.law[l] == law;
        if (law != first && mask.any()) take(mask, respond(law, moduli, sigma), result);
    }
    return result;
}

Dilatation dilatation(const LaneModuli& moduli, const PrincipalLanes& s) noexcept {
    const Lanes one = Lanes::Ones();
    Dilatation result{.value = s[0] + s[1] + s[2] - 3, .slope = {one, one, one}};
    for (int l = 0; l < lanes; ++l) {
        if (moduli.law[l] == MaterialLaw::corotated) continue;
        const Eigen::Array3d of_lane(s[0][l], s[1][l], s[2][l]);
        const bool is_by_volume = moduli.law[l] == MaterialLaw::stable_neo_hookean;
        result.value[l] = is_by_volume ? of_lane.prod() - 1 : (of_lane.square().sum() - 3) / 2;
        for (std::size_t i = 0; i < 3; ++i)
            result.slope[i][l] = is_by_volume ? s[(i + 1) % 3][l] * s[(i + 2) % 3][l] : s[i][l];
    }
    return result;
}

void add_pressure(const LaneModuli& moduli, const PrincipalLanes& s, const Lanes& pressure,
                  PrincipalResponse& r) noexcept {
    const PrincipalLanes slope = dilatation(moduli, s).slope;
    for (std::size_t i = 0; i < 3; ++i) {
        r.stress[i] += pressure * slope[i];
        for (int l = 0; l < lanes; ++l) {
            const double p = pressure[l];
            switch (moduli.law[l]) {
                case MaterialLaw::corotated:
                    r.twist[i][l] += 2 * p / std::max(s[(i + 1) % 3][l] + s[(i + 2) % 3][l], least_sum);
                    break;
                case MaterialLaw::stable_neo_hookean:
                    r.A.off[i][l] += p * s[i][l];
                    r.flip[i][l] -= p * s[i][l];
                    r.twist[i][l] += p * s[i][l];
                    break;
                case MaterialLaw::st_venant_kirchhoff:
                    r.A.diagonal[i][l] += p;
                    r.flip[i][l] += p;
                    r.twist[i][l] += p;
                    break;
            }
        }
    }
}

}  // namespace nbd
